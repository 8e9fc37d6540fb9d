//! The same rays through the fast structures and through brute force: every bit of every hit must be the same.

use std::ops::Add;

use meshray::accel::{Accel, AccelKind, AccelParams, AnyAccel, Hit, Listed, NoProbe, Ray, Shapes};
use meshray::bench::aim::{Aim, Aimer};
use meshray::load::{LoadOptions, load};
use meshray::render::World;
use rayon::prelude::*;

/// Rays of one aim in one task.
const SLICE: usize = 1024;

/// One task in this many also makes occlusion queries and next-hit queries.
const OTHER_QUERIES: usize = 8;

#[derive(Clone, Copy, Default)]
struct Count {
    rays: u64,
    hits: u64,
    differ: u64,
    brute_rays: u64,
    tests: u64,
    brute_differ: u64,
}

impl Add for Count {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        Self {
            rays: self.rays + o.rays,
            hits: self.hits + o.hits,
            differ: self.differ + o.differ,
            brute_rays: self.brute_rays + o.brute_rays,
            tests: self.tests + o.tests,
            brute_differ: self.brute_differ + o.brute_differ,
        }
    }
}

/// Compares hits over all models with triangles; each gets the same share of rays and of tests.
pub(crate) fn run(files: &[String], rays: f64, tests: f64) -> bool {
    println!(
        "{rays:e} rays through fast-octree and fast-bvh, {tests:e} tests by brute force, spread over {} files",
        files.len()
    );
    println!(
        "{:36}{:>10}{:>16}{:>16}{:>8}{:>14}{:>12}{:>8}",
        "model", "triangles", "rays", "hits", "differ", "brute rays", "tests", "differ"
    );
    let share = 1.0 / files.len() as f64;
    let (mut total, mut missed) = (Count::default(), 0);
    for file in files {
        let scene = match load(file.as_ref(), &LoadOptions::default()) {
            Ok(loaded) => loaded.scene,
            Err(error) => {
                eprintln!("{file}: {error}");
                missed += 1;
                continue;
            }
        };
        let shapes = World::new(&scene).shapes;
        let count = model(&shapes, rays * share, tests * share);
        if count.rays == 0 {
            eprintln!("{file}: has nothing that rays could be aimed at");
            missed += 1;
        }
        let name = std::path::Path::new(file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        print(&name, shapes.triangles.len(), count);
        total = total + count;
    }
    print("together", 0, total);
    missed == 0 && total.differ == 0 && total.brute_differ == 0 && total.rays > 0
}

fn print(name: &str, triangles: usize, c: Count) {
    #[expect(clippy::cast_precision_loss, reason = "printed to three digits")]
    let tests = c.tests as f64;
    println!(
        "{name:36}{triangles:>10}{:>16}{:>16}{:>8}{:>14}{tests:>12.3e}{:>8}",
        c.rays, c.hits, c.differ, c.brute_rays, c.brute_differ
    );
}

fn model(shapes: &Shapes, rays: f64, tests: f64) -> Count {
    let Some(aimer) = Aimer::new(shapes, 0) else { return Count::default() };
    let fast = [AccelKind::FastOctree, AccelKind::FastBvh].map(|k| AnyAccel::build(k, shapes, &AccelParams::DEFAULT));
    let brute = Listed::new(shapes);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates")]
    let tasks = (rays / (SLICE * Aim::ALL.len()) as f64).ceil() as usize;
    // Each task sends as many rays to brute force as the tests allow.
    let per_task = tests / shapes.bounded().max(1) as f64 / tasks as f64;
    let task = |number: usize| {
        let mut aimer = aimer.reseeded(number as u64 ^ 0x5851_f42d_4c95_7f2d);
        // The fractional rays that remain are distributed over the tasks.
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates")]
        let brute_rays = ((number + 1) as f64 * per_task) as usize - (number as f64 * per_task) as usize;
        let rays: Vec<Ray> = Aim::ALL.iter().flat_map(|&aim| aimer.rays(aim, SLICE)).collect();
        compare(&fast, &brute, &rays, brute_rays, number.is_multiple_of(OTHER_QUERIES), number)
    };
    (0..tasks).into_par_iter().map(task).reduce(Count::default, Count::add)
}

fn compare(fast: &[AnyAccel; 2], brute: &Listed, rays: &[Ray], brute_rays: usize, other: bool, number: usize) -> Count {
    let [a, b] = [closest(&fast[0], rays), closest(&fast[1], rays)];
    let mut count = Count { rays: rays.len() as u64, ..Count::default() };
    count.hits = a.iter().filter(|h| h.is_some()).count() as u64;
    count.differ = differences(&a, &b);
    if other {
        count.differ += differences(&next(&fast[0], rays, &a), &next(&fast[1], rays, &a));
        let [a, b] = [occluded(&fast[0], rays), occluded(&fast[1], rays)];
        count.differ += a.iter().zip(&b).filter(|(a, b)| a != b).count() as u64;
    }
    // Rays of all aims in turn.
    let chosen: Vec<usize> = (0..brute_rays.min(rays.len())).map(|i| (number * 7 + i * 1031) % rays.len()).collect();
    if !chosen.is_empty() {
        let some: Vec<Ray> = chosen.iter().map(|&i| rays[i]).collect();
        let expected: Vec<Hit> = chosen.iter().map(|&i| a[i]).collect();
        count.brute_rays = some.len() as u64;
        count.tests = count.brute_rays * fast[0].shapes().bounded() as u64;
        count.brute_differ = differences(&closest(brute, &some), &expected);
    }
    count
}

fn closest<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
    hits
}

fn next<A: Accel>(accel: &A, rays: &[Ray], after: &[Hit]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.next(rays, after, &mut hits, &mut accel.scratch(), &mut NoProbe);
    hits
}

fn occluded<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<bool> {
    let mut occluded = vec![false; rays.len()];
    accel.occluded(rays, &mut occluded, &mut accel.scratch(), &mut NoProbe);
    occluded
}

fn differences(a: &[Hit], b: &[Hit]) -> u64 {
    a.iter().zip(b).filter(|(a, b)| a.bits() != b.bits()).count() as u64
}
