//! Speed against error: our ray/triangle tests and, where its library is named, Embree's, on difficult rays.

use std::fs;
use std::path::Path;

use meshray::accel::{Accel, AccelKind, AccelParams, AnyAccel, Hit, IntersectorKind, NoProbe, Ray};
use meshray::bench::aim::{Aim, Aimer};
use meshray::bench::clock::{Spread, processor_seconds};
use meshray::bench::oracle::{Oracle, Truth};
use meshray::bench::verify::kernels::{Kernel, html};
use meshray::bench::verify::tally::{Rate, Tally};
use meshray::load::{LoadOptions, load};
use meshray::math::simd::Level;
use meshray::render::World;
use rayon::prelude::*;

use crate::embree::Embree;
use crate::tracer::{Answer, Rays, Tracer, packets};

/// Number of timed passes of each candidate.
const PASSES: usize = 5;

/// A candidate for finding the hits of all rays.
type Candidate<'a> = (String, bool, Box<dyn FnMut(&mut Vec<Hit>) + 'a>);

/// Judges the candidates on one model, with `count` rays of each aim, and writes an HTML page.
pub(crate) fn run(file: &str, count: usize, page: &str) -> bool {
    let scene = match load(file.as_ref(), &LoadOptions::default()) {
        Ok(loaded) => loaded.scene,
        Err(error) => {
            eprintln!("{file}: {error}");
            return false;
        }
    };
    let shapes = World::new(&scene).shapes;
    let Some(mut aimer) = Aimer::new(&shapes, 1) else {
        eprintln!("{file}: no triangles to aim at");
        return false;
    };
    let rays: Vec<Ray> = Aim::ALL.iter().flat_map(|&aim| aimer.rays(aim, count)).collect();
    let oracle = Oracle::new(&shapes);
    let truths: Vec<Option<Truth>> = rays.par_iter().map(|ray| oracle.nearest(ray)).collect();
    let accel = AnyAccel::build(AccelKind::DEFAULT, &shapes, &AccelParams::DEFAULT);
    let embree = std::env::var_os("MESHRAY_EMBREE").map(|path| Embree::load(Path::new(&path), Level::best()));
    let embree = match embree.transpose() {
        Ok(embree) => embree,
        Err(error) => {
            eprintln!("{error}");
            return false;
        }
    };
    let packed = packets(&rays);
    let both = Rays { all: &rays, packets: &packed, pencil: None };
    let mut candidates: Vec<Candidate> = Vec::new();
    for test in IntersectorKind::ALL {
        let tested = accel.clone().tested_by(test);
        let mut scratch = tested.scratch();
        let rays = &rays;
        let trace = move |hits: &mut Vec<Hit>| tested.closest(rays, hits, &mut scratch, &mut NoProbe);
        candidates.push((test.name().to_owned(), true, Box::new(trace)));
    }
    let modes = [(false, false), (false, true), (true, false), (true, true)];
    for (embree, (robust, packets)) in embree.iter().flat_map(|embree| modes.map(|mode| (embree, mode))) {
        let (mut built, ()) = embree.build(&shapes, robust, 1, |build| build());
        built.with_packets(if packets { embree.widest } else { 1 });
        let name = built.name();
        let mut answers = vec![Answer { prim: 0, t: 0.0 }; rays.len()];
        let trace = move |hits: &mut Vec<Hit>| {
            built.trace(false, false, both, &mut answers);
            for (hit, answer) in hits.iter_mut().zip(&answers) {
                *hit = Hit { t: answer.t, prim: answer.prim, ..Hit::MISS };
            }
        };
        candidates.push((name, false, Box::new(trace)));
    }
    let kernels = measure(&oracle, &rays, &truths, candidates);
    for kernel in &kernels {
        let wrong = match kernel.wrong_in_a_billion() {
            Rate::Seen(x) => format!("{x:.3e}"),
            Rate::Below(x) => format!("< {x:.1e}"),
        };
        println!(
            "{:28}{:>8.2} Mrays/s  wrong in 1e9: {wrong:>10}  t: {:.2} ulp rms, {:.1} max",
            kernel.name,
            kernel.rate(),
            kernel.tally.rms_ulps(),
            kernel.tally.max_ulps
        );
    }
    let name = Path::new(file).file_name().unwrap_or_default().to_string_lossy();
    let told = format!(
        "{} rays, {count} each at {}; one thread, medians of {PASSES} passes in turn; judged by exact arithmetic",
        rays.len(),
        Aim::ALL.map(Aim::name).join(", ")
    );
    if let Err(error) = fs::write(page, html(&name, &told, &kernels)) {
        eprintln!("{page}: {error}");
        return false;
    }
    kernels.iter().filter(|k| k.name == IntersectorKind::Exact.name()).all(|k| k.tally.is_clean())
}

fn measure(oracle: &Oracle, rays: &[Ray], truths: &[Option<Truth>], mut candidates: Vec<Candidate>) -> Vec<Kernel> {
    let mut hits = vec![Hit::MISS; rays.len()];
    let mut found: Vec<(Tally, Spread)> = vec![Default::default(); candidates.len()];
    for pass in 0..PASSES {
        for ((_, _, trace), (tally, times)) in candidates.iter_mut().zip(&mut found) {
            let ((), seconds) = processor_seconds(|| trace(&mut hits));
            times.push(seconds / rays.len().max(1) as f64);
            if pass == 0 {
                *tally = Tally::of(oracle, rays, truths, &hits);
            }
        }
    }
    let kernel = |((name, is_ours, _), (tally, times)): (Candidate, (Tally, Spread))| Kernel {
        name,
        is_ours,
        seconds_per_ray: times.median(),
        tally,
    };
    candidates.into_iter().zip(found).map(kernel).collect()
}
