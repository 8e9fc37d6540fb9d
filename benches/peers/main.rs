//! The same rays through other programs: `cargo bench --bench peers -- [options]`.
//!
//! One process, one thread: each pass sends all rays of a kind through every program in turn; the median processor time of the
//! passes is compared. Embree is loaded from the path in `MESHRAY_EMBREE`, if that is set.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command that prints what it measured")]

mod embree;
mod mesh;
mod obvhs;
mod ours;
mod rays;
mod tracer;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use meshray::accel::{AccelChoice, AccelParams, InstancedObjects, NO_PRIM, Pencil, Splitting, TraceMode, Wide, auto};
use meshray::bench::clock::{Spread, processor_seconds};
use meshray::math::simd::Level;

use crate::embree::Embree;
use crate::mesh::Mesh;
use crate::obvhs::Compressed;
use crate::ours::Ours;
use crate::rays::{Kind, primary, secondary};
use crate::tracer::{Answer, PACKET, Rays, Tracer, directions, packets};

const USAGE: &str = "\
usage: peers [--passes N] [--kinds LETTERS] [--only WORD] [--size TRIANGLES] [--simd LEVEL] [MESH...]
       --passes N   timed passes of each program over all rays of a kind (default 5)
       --kinds PDS  only these kinds of rays: from the eye, diffuse, shadow
       --only WORD  only programs whose names have this word
       --size N     triangles of the made mesh, mountain (default 2e6)
       --simd LEVEL instruction set that all keep to, one that the machine has: portable, avx2, avx512, neon
       MESH         rocker, bunny, stadium, hall, mountain (default: all)
environment: MESHRAY_SHARED, the folder with bench/ and peers/ (default ../shared); MESHRAY_EMBREE, a libembree3 or
libembree4";

/// Rays handed to a program at once.
const SLICE: usize = 4096;

const KERNELS: [(TraceMode, &str); 4] = [
    (TraceMode::OneByOne, "ray by ray"),
    (TraceMode::InFlight, "in flight"),
    (TraceMode::Packets, "packets of 16 or 32"),
    (TraceMode::Adaptive, "as it chooses"),
];

const MESHES: [&str; 5] = ["rocker", "bunny", "stadium", "hall", "mountain"];

/// Parsed command line.
struct Words {
    passes: usize,
    kinds: String,
    only: String,
    size: f64,
    simd: Level,
    meshes: Vec<String>,
}

fn main() -> ExitCode {
    let Some(words) = parse(std::env::args().skip(1).filter(|w| w != "--bench")) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    if let Err(chosen) = words.simd.choose() {
        eprintln!("the kernels have begun with {}", chosen.name());
        return ExitCode::FAILURE;
    }
    println!("{}", words.simd.name());
    meshray::huge_pages::allow(Duration::MAX);
    let shared = std::env::var_os("MESHRAY_SHARED").map_or_else(|| PathBuf::from("../shared"), PathBuf::from);
    let embree = std::env::var_os("MESHRAY_EMBREE").map(|path| Embree::load(Path::new(&path), words.simd)).transpose();
    let embree = match embree {
        Ok(embree) => embree,
        Err(message) => {
            eprintln!("MESHRAY_EMBREE: {message}");
            return ExitCode::from(2);
        }
    };
    if embree.is_none() {
        println!("MESHRAY_EMBREE is not set: without Embree");
    }
    let cameras = std::fs::read_to_string(shared.join("peers/cameras.csv")).unwrap_or_default();
    let mut clean = true;
    for name in &words.meshes {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates")]
        let mesh = match name.as_str() {
            "mountain" => Ok(Mesh::mountain(words.size as usize)),
            name => Mesh::read(&shared.join("bench"), name, &cameras),
        };
        match mesh {
            Ok(mesh) => clean &= compare(&mesh, embree.as_ref(), &words),
            Err(message) => {
                println!("left out: {message}");
                clean = false;
            }
        }
    }
    if clean { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn parse(mut words: impl Iterator<Item = String>) -> Option<Words> {
    let mut parsed = Words {
        passes: 5,
        kinds: "PDS".into(),
        only: String::new(),
        size: 2e6,
        simd: *Level::all().last()?,
        meshes: Vec::new(),
    };
    while let Some(word) = words.next() {
        match word.as_str() {
            "--passes" => parsed.passes = words.next()?.parse().ok().filter(|&n| n > 0)?,
            "--kinds" => parsed.kinds = words.next()?,
            "--only" => parsed.only = words.next()?,
            "--simd" => parsed.simd = words.next()?.parse().ok()?,
            "--size" => parsed.size = words.next()?.parse().ok()?,
            name if MESHES.contains(&name) => parsed.meshes.push(word),
            _ => return None,
        }
    }
    if parsed.meshes.is_empty() {
        parsed.meshes = MESHES.map(String::from).to_vec();
    }
    Some(parsed)
}

/// Compares all programs on one mesh; returns whether all verdicts of ours equal those of the robust reference.
fn compare(mesh: &Mesh, embree: Option<&Embree>, words: &Words) -> bool {
    let shapes = &mesh.shapes;
    let rays = {
        let primary = primary(&mesh.camera);
        let hits = Ours::hits(shapes, &primary);
        let [diffuse, shadow] = secondary(shapes, &mesh.camera, &primary, &hits);
        [primary, diffuse, shadow]
    };
    let packed = [packets(&rays[0]), packets(&rays[1]), packets(&rays[2])];
    println!(
        "\n{}: {} triangles; {} rays from the eye, {} hits",
        mesh.name,
        shapes.triangles.len(),
        rays[0].len(),
        rays[1].len()
    );
    println!("auto takes {}", auto::reason(shapes, &InstancedObjects::default(), u64::MAX));

    if words.only.is_empty() {
        builds(mesh, embree, words.passes);
    }
    let mut tracers: Vec<Box<dyn Tracer + '_>> = Vec::new();
    let mut reference: Option<Box<dyn Tracer + '_>> = None;
    if let Some(embree) = embree {
        let widest = embree.widest;
        for (robust, rays) in [(false, 1), (false, widest), (true, 1), (true, widest)] {
            let (mut built, ()) = embree.build(shapes, robust, 1, |build| build());
            built.with_packets(rays);
            tracers.push(Box::new(built));
        }
        reference = Some(Box::new(embree.build(shapes, true, 1, |build| build()).0));
    }
    tracers.push(Box::new(Compressed::build(shapes)));
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        for (rays, how) in KERNELS {
            tracers.push(Box::new(Ours::new(Wide::build(shapes, splitting).with_rays(rays), how)));
        }
    }
    tracers.retain(|t| t.name().contains(&words.only));

    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|kind| words.kinds.contains(kind.letter())).collect();
    let (origin, dirs) = (mesh.camera.eye.as_vec3(), directions(&rays[0]));
    let of = |kind: Kind| Rays {
        all: &rays[kind as usize],
        packets: &packed[kind as usize],
        pencil: (kind == Kind::Primary).then(|| Pencil { origin, dirs: dirs.each_ref().map(Vec::as_slice) }),
    };
    let rates: Vec<_> = kinds.iter().map(|&kind| measure(&tracers, kind, of(kind), words.passes)).collect();
    let wrong: Option<Vec<_>> =
        reference.map(|reference| kinds.iter().map(|&kind| verdicts(&tracers, &*reference, kind, of(kind))).collect());
    let letters: String = kinds.iter().map(|kind| format!("{:>9}", kind.letter())).collect();
    println!("{:44}{letters}{:>12}", "Mrays/s, one thread", "verdicts");
    let mut clean = true;
    for (i, tracer) in tracers.iter().enumerate() {
        let row: String = rates.iter().map(|r| format!("{:9.2}", r[i])).collect();
        let differ = wrong.as_ref().map(|wrong| wrong.iter().map(|w| w[i]).sum::<usize>());
        let shown = differ.map_or_else(|| "-".to_owned(), |differ| differ.to_string());
        println!("{:44}{row}{shown:>12}", tracer.name());
        clean &= !tracer.name().starts_with("meshray") || differ.is_none_or(|differ| differ == 0);
    }
    clean
}

/// Builds a structure with the given number of threads; returns seconds and bytes.
type Build<'a> = Box<dyn Fn(usize) -> (f64, usize) + 'a>;

/// Prints the build times and sizes of structures. The programs take turns.
fn builds(mesh: &Mesh, embree: Option<&Embree>, passes: usize) {
    let (shapes, triangles) = (&mesh.shapes, mesh.shapes.triangles.len() as f64);
    let mut programs: Vec<(&str, Build)> = Vec::new();
    if let Some(embree) = embree {
        let build = |threads| {
            let (built, seconds) = embree.build(shapes, false, threads, |build| {
                let start = Instant::now();
                build();
                start.elapsed().as_secs_f64()
            });
            (seconds, built.bytes)
        };
        programs.push((&embree.version, Box::new(build)));
    }
    for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
        let build = move |threads| ours(threads, || Wide::build(shapes, splitting), |wide| wide.summary().bytes);
        programs.push((ours::structure(splitting), Box::new(build)));
    }
    let auto = |threads| {
        let build = || auto::build(AccelChoice::Auto, shapes, &AccelParams::DEFAULT);
        ours(threads, build, |(built, _)| built.summary().bytes)
    };
    programs.push(("meshray auto, the default", Box::new(auto)));

    let mut times = vec![[Spread::default(), Spread::default()]; programs.len()];
    let mut bytes = vec![0; programs.len()];
    for _ in 0..passes {
        for (i, (_, build)) in programs.iter().enumerate() {
            for (threads, spread) in (1..).zip(&mut times[i]) {
                let (seconds, size) = build(threads);
                spread.push(seconds);
                bytes[i] = size;
            }
        }
    }
    println!("{:44}{:>12}{:>12}{:>18}", "build", "1 thread ms", "2 threads", "bytes a triangle");
    for (((name, _), times), bytes) in programs.iter().zip(&times).zip(&bytes) {
        let [one, two] = times.each_ref().map(|t| t.median() * 1e3);
        println!("{name:44}{one:12.2}{two:12.2}{:18.1}", *bytes as f64 / triangles);
    }
}

/// Builds a structure of ours with `threads` threads, which are already awake, as they are after a file has been read.
fn ours<T: Send>(threads: usize, build: impl Fn() -> T + Sync, bytes: impl Fn(&T) -> u64) -> (f64, usize) {
    let Ok(pool) = meshray::threads::pool(threads) else { return (f64::NAN, 0) };
    pool.broadcast(|_| ());
    let start = Instant::now();
    let built = pool.install(&build);
    let seconds = start.elapsed().as_secs_f64();
    (seconds, bytes(&built) as usize)
}

/// Rays per second, in millions, of each program.
fn measure(tracers: &[Box<dyn Tracer + '_>], kind: Kind, rays: Rays, passes: usize) -> Vec<f64> {
    let mut answers = vec![Answer { prim: NO_PRIM, t: 0.0 }; SLICE];
    let mut spreads = vec![Spread::default(); tracers.len()];
    for pass in 0..=passes {
        for (tracer, spread) in tracers.iter().zip(&mut spreads) {
            let (any, coherent) = (kind == Kind::Shadow, kind != Kind::Diffuse);
            let ((), seconds) = processor_seconds(|| {
                let parts = rays.all.chunks(SLICE).zip(rays.packets.chunks(SLICE / PACKET));
                for (start, (all, packets)) in (0..).step_by(SLICE).zip(parts) {
                    let pencil = rays.pencil.map(|pencil| pencil.part(start..start + all.len()));
                    tracer.trace(any, coherent, Rays { all, packets, pencil }, &mut answers[..all.len()]);
                }
            });
            // The first pass warms up.
            if pass > 0 {
                spread.push(seconds);
            }
        }
    }
    spreads.iter().map(|s| rays.all.len() as f64 / s.median() * 1e-6).collect()
}

/// Number of rays for which each program reports a hit and the reference a miss, or vice versa.
fn verdicts(tracers: &[Box<dyn Tracer + '_>], reference: &dyn Tracer, kind: Kind, rays: Rays) -> Vec<usize> {
    let ask = |tracer: &dyn Tracer| {
        let mut answers = vec![Answer { prim: NO_PRIM, t: 0.0 }; rays.all.len()];
        tracer.trace(kind == Kind::Shadow, kind != Kind::Diffuse, rays, &mut answers);
        answers
    };
    let expected = ask(reference);
    let differ = |got: Vec<Answer>| {
        got.iter().zip(&expected).filter(|(a, b)| (a.prim == NO_PRIM) != (b.prim == NO_PRIM)).count()
    };
    tracers.iter().map(|t| differ(ask(&**t))).collect()
}
