//! Instruction counts of the kernels and of whole pictures: `cargo bench --bench instructions -- [--record]`.
//!
//! Valgrind's Callgrind counts them, so that the figures depend neither on the machine's speed nor on its load. It does not
//! support AVX-512: those kernels are the same code as AVX2's. Counts must not exceed those of `baseline.txt` beside this file by
//! more than [`ALLOWED`]; `--record` rewrites that file.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command that prints what it counted")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Arc;

use meshray::accel::{
    Accel, AccelKind, AccelParams, AnyAccel, BitSet, Hit, NO_PRIM, NoProbe, Ray, Shapes, Splitting, TraceMode, Wide,
};
use meshray::generate::Family;
use meshray::math::random::Random;
use meshray::math::simd::Level;
use meshray::math::{DVec3, Vec3};
use meshray::render::texture::TextureStore;
use meshray::render::view::Lens;
use meshray::render::{Job, Settings, View, World, render};
use meshray::scene::{
    AlphaMode, Bitmap, Coat, Environment, Falloff, Light, LightKind, Material, MetalRough, Panorama, Pixels,
    Reflection, Sampler, Scene, Sheen, Texture, TextureRef, UvTransform, default_light, framing,
};

/// Fraction by which a count may exceed its baseline.
const ALLOWED: f64 = 0.03;

/// The same if the baseline was recorded with another compiler, which generates different code.
const ALLOWED_OF_ANOTHER: f64 = 0.15;

const TRIANGLES: usize = 20_000;
const RAYS: usize = 4096;

/// Fraction of the landscape that coherent rays cover: neighbours then often hit the same triangle, as in a picture.
const NARROW: f32 = 0.125;

const LEVELS: [&str; 2] = ["portable", "AVX2"];
const MODES: [(TraceMode, &str); 3] =
    [(TraceMode::OneByOne, "one-by-one"), (TraceMode::InFlight, "in-flight"), (TraceMode::Packets, "packets")];
const RUNS: [&str; 2] = ["alike", "apart"];
const QUESTIONS: [&str; 2] = ["first", "any"];

/// Pictures by surface and light: one sample for each of [`RAYS`] pixels. They are rendered with the best instructions that
/// Valgrind supports, so that a formula that is no longer vectorised shows.
const PICTURES: [[&str; 2]; 10] = [
    ["plain", "lamp"],
    ["plain", "ball"],
    ["plain", "studio"],
    ["mapped", "lamp"],
    ["mapped", "studio"],
    ["mapped", "panorama"],
    ["lobes", "lamp"],
    ["lobes", "studio"],
    ["holed", "lamp"],
    ["glass", "studio"],
];
const SIDE: u32 = 64;
/// Columns and rows of the maps.
const MAP_SIDE: u32 = 256;
/// Rows of the panorama, which has twice as many columns.
const PANORAMA_ROWS: u32 = 64;
/// Bounces in glass.
const BOUNCES: u32 = 3;

/// One case: level, trace mode, coherence of the rays, and kind of query; or level, "picture", surface, and light.
type Case = [String; 4];

fn main() -> ExitCode {
    // Cargo adds --bench to the arguments.
    let words: Vec<String> = std::env::args().skip(1).filter(|w| w != "--bench").collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["trace", _, "picture", of, light] => picture(of, light),
        ["trace", level, way, run, question] => trace([level, way, run, question]),
        [] => compare(false),
        ["--record"] => compare(true),
        _ => {
            eprintln!("usage: instructions [--record]");
            ExitCode::from(2)
        }
    }
}

/// Counts every case and compares it with the baseline, or records it.
fn compare(record: bool) -> ExitCode {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/instructions/baseline.txt");
    let baseline = match std::fs::read_to_string(&file) {
        Ok(baseline) => baseline,
        Err(_) if record => String::new(),
        Err(e) => {
            eprintln!("{}: {e}; record what is counted now with --record", file.display());
            return ExitCode::from(2);
        }
    };
    let (compiler, baseline) = baseline.split_once('\n').unwrap_or_default();
    let baseline: BTreeMap<&str, u64> = baseline
        .lines()
        .filter_map(|line| line.rsplit_once(' ').and_then(|(c, n)| Some((c, n.parse().ok()?))))
        .collect();
    let mut recorded = format!("{}\n", env!("MESHRAY_COMPILER"));
    let is_same = compiler == env!("MESHRAY_COMPILER");
    let allowed = if is_same { ALLOWED } else { ALLOWED_OF_ANOTHER };
    let mut left = baseline.clone();
    let (mut worse, mut unknown) = (false, 0);
    println!("{:38}{:>14}{:>10}{:>10}", "instructions a ray", "now", "baseline", "ratio");
    for case in cases() {
        let name = case.join(" ");
        let count = match count(&case) {
            Ok(count) => count,
            Err(message) => {
                eprintln!("{name}: {message}");
                return ExitCode::from(2);
            }
        };
        recorded.push_str(&format!("{name} {count}\n"));
        let per_ray = |n: u64| n as f64 / RAYS as f64;
        match left.remove(name.as_str()) {
            Some(before) => {
                let ratio = count as f64 / before as f64;
                worse |= ratio > 1.0 + allowed;
                println!("{name:38}{:14.0}{:10.0}{ratio:10.3}", per_ray(count), per_ray(before));
            }
            None => {
                unknown += 1;
                println!("{name:38}{:14.0}{:>10}", per_ray(count), "-");
            }
        }
    }
    if record {
        return match std::fs::write(&file, recorded) {
            Ok(()) => ExitCode::SUCCESS,
            Err(e) => {
                eprintln!("{}: {e}", file.display());
                ExitCode::from(2)
            }
        };
    }
    if !is_same {
        println!("recorded with {compiler}: the code of another compiler may take {:.0} % more", allowed * 100.0);
    }
    if unknown > 0 {
        eprintln!("the baseline has nothing of {unknown} of these; accept what is counted now with --record");
        return ExitCode::FAILURE;
    }
    // Levels that this machine lacks are not counted on it.
    let here = Level::all();
    left.retain(|name, _| here.iter().any(|level| name.split(' ').next() == Some(level.name())));
    if let Some(name) = left.keys().next() {
        eprintln!("the baseline has {} more, such as '{name}'; accept that they are gone with --record", left.len());
        return ExitCode::FAILURE;
    }
    if worse {
        eprintln!("more than {:.0} % above the baseline; accept it with --record", allowed * 100.0);
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn cases() -> Vec<Case> {
    let here = Level::all();
    let mut cases = Vec::new();
    for level in LEVELS.into_iter().filter(|level| here.iter().any(|l| l.name() == *level)) {
        for (_, way) in MODES {
            for run in RUNS {
                for question in QUESTIONS {
                    cases.push([level, way, run, question].map(String::from));
                }
            }
        }
    }
    if here.iter().any(|level| level.name() == "AVX2") {
        cases.extend(PICTURES.map(|[of, light]| ["AVX2", "picture", of, light].map(String::from)));
    }
    cases
}

/// Instructions of one case, counted by running this program again.
fn count(case: &Case) -> Result<u64, String> {
    let program: PathBuf = std::env::current_exe().map_err(|e| e.to_string())?;
    let out = Command::new("valgrind")
        .args(["--tool=callgrind", "--collect-atstart=no", "--toggle-collect=*counted*"])
        .arg("--callgrind-out-file=/dev/null")
        .arg(program)
        .arg("trace")
        .args(case)
        .output()
        .map_err(|e| format!("valgrind does not start ({e}); install it"))?;
    let text = String::from_utf8_lossy(&out.stderr);
    let count = text.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok());
    count.filter(|&n| out.status.success() && n > 0).ok_or_else(|| format!("valgrind counted nothing:\n{text}"))
}

/// Traces the rays of one case; most of the work is in [`counted`].
fn trace([level, way, run, question]: [&str; 4]) -> ExitCode {
    let world = World::new(&Family::Mountain.scene(TRIANGLES));
    let (vertices, triangles) = (world.shapes.vertices, world.shapes.triangles);
    let shapes = Shapes { opaque: BitSet::filled(triangles.len(), true), vertices, triangles, ..Shapes::default() };
    let (Some(level), Some(&(way, _))) =
        (Level::all().into_iter().find(|l| l.name() == level), MODES.iter().find(|(_, name)| *name == way))
    else {
        return ExitCode::from(2);
    };
    let wide = Wide::build(&shapes, Splitting::SurfaceArea).at_level(level).with_rays(way);
    let mut scratch = wide.scratch();
    let mut answers = Answers { hits: vec![Hit::MISS; RAYS], occluded: vec![false; RAYS] };
    counted(&wide, &rays(&shapes, run == "alike"), question == "any", &mut answers, &mut scratch);
    let found = answers.hits.iter().filter(|h| h.is_some()).count() + answers.occluded.iter().filter(|&&b| b).count();
    println!("{found} of {RAYS} rays hit");
    if found > RAYS / 4 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Renders a landscape of one material from above, plain or with maps that make it rough, smooth and bumpy in turn; most of the
/// work is in [`counted_picture`].
fn picture(of: &str, light: &str) -> ExitCode {
    let mut scene = Family::Mountain.scene(TRIANGLES);
    scene.materials.fill(Material::plain());
    scene.lights.clear();
    match of {
        "mapped" => paint(&mut scene),
        "lobes" => {
            paint(&mut scene);
            cover(&mut scene);
        }
        "holed" => {
            paint(&mut scene);
            punch(&mut scene);
        }
        "glass" => {
            let glass =
                MetalRough { transmission: 1.0, thick: true, roughness: 0.0, metallic: 0.0, ..MetalRough::default() };
            scene.materials.fill(Material { reflection: Reflection::MetalRough(glass), ..Material::plain() });
        }
        _ => {}
    }
    let (lo, hi) = World::new(&scene).bounds;
    let (middle, size) = ((lo + hi) * 0.5, hi - lo);
    let camera = framing::default_camera(&scene, &framing::robust_bounds(&scene), 1.0);
    let eye = middle + DVec3::new(-0.1, -0.6, 1.0) * size.length();
    if light == "panorama" {
        scene.environment = Environment::Panorama;
        scene.panorama = Some(panorama());
    } else if let "lamp" | "ball" = light {
        let kind = LightKind::Point { position: eye + DVec3::X * size.x, falloff: Falloff::None };
        let radius = if light == "ball" { 0.05 * size.x } else { 0.0 };
        scene.lights.push(Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: true, size: radius });
    } else {
        default_light::add_if_missing(&mut scene, &camera);
    }
    let world = World::new(&scene);
    let accel = AnyAccel::build(AccelKind::default(), &world.shapes, &AccelParams::DEFAULT);
    let depth = (of == "glass").then_some(BOUNCES);
    let settings = Settings { width: SIDE, height: SIDE, samples: 1, depth, ..Settings::default() };
    let textures = TextureStore::new(&scene);
    let view = &View::look_at(eye, middle, DVec3::Z, Lens::perspective(0.3));
    let job = Job { scene: &scene, world: &world, accel: &accel, textures: &textures, view, settings: &settings };
    // The thread of the pool executes the code that is counted.
    let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() else { return ExitCode::from(2) };
    let shown = pool.install(|| counted_picture(&job));
    println!("{shown} of {RAYS} pixels show the landscape");
    if shown > RAYS / 2 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A panorama of noise.
fn panorama() -> Panorama {
    let mut random = Random::new(5);
    let (width, height) = (2 * PANORAMA_ROWS, PANORAMA_ROWS);
    let texels = (0..width * height).map(|_| [(); 3].map(|()| random.unit())).collect();
    Panorama { name: String::new(), width, height, texels: Arc::new(texels), ..Panorama::default() }
}

/// Gives all meshes normals, tangents and texture coordinates, and all materials maps of noise.
fn paint(scene: &mut Scene) {
    let (lo, hi) = World::new(scene).bounds;
    let scale = (1.0 / (hi - lo).max_element()) as f32;
    for mesh in &mut scene.meshes {
        let at = |p: &Vec3| p.truncate() * scale;
        let leaning = |p: &Vec3| (p.truncate().fract() - 0.5).extend(2.0).normalize();
        mesh.uvs = vec![mesh.positions.iter().map(at).collect()];
        mesh.normals = mesh.positions.iter().map(leaning).collect();
        mesh.tangents = vec![Vec3::X.extend(1.0); mesh.positions.len()];
    }
    let mut random = Random::new(3);
    for texture in 0..3 {
        let bytes = (0..MAP_SIDE * MAP_SIDE * 3).map(|_| 64 | random.bits().to_le_bytes()[0]).collect();
        let pixels = Pixels::Rgb8(bytes);
        scene.bitmaps.push(Bitmap { name: String::new(), width: MAP_SIDE, height: MAP_SIDE, pixels });
        scene.textures.push(Texture { bitmap: texture, sampler: Sampler::default() });
    }
    let map = |texture| Some(TextureRef { texture, uv_set: 0, transform: UvTransform::default() });
    let surface = MetalRough { roughness: 0.4, metallic: 0.5, metal_rough_map: map(1), ..MetalRough::default() };
    scene.materials.fill(Material {
        base_color_map: map(0),
        normal_map: map(2),
        occlusion_map: map(1),
        reflection: Reflection::MetalRough(surface),
        ..Material::plain()
    });
}

/// Cuts holes into all materials, where the red channel of their base colour map is below 0.4.
fn punch(scene: &mut Scene) {
    if let Pixels::Rgb8(numbers) = &scene.bitmaps[0].pixels {
        scene.bitmaps[0].pixels = Pixels::Rgba8(numbers.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b, r]).collect());
    }
    scene.materials.iter_mut().for_each(|material| material.alpha_mode = AlphaMode::Mask { cutoff: 0.4 });
}

/// Covers all materials with sheen and clear coat, and maps of both.
fn cover(scene: &mut Scene) {
    for material in &mut scene.materials {
        let map = material.base_color_map;
        let Reflection::MetalRough(m) = &mut material.reflection else { continue };
        m.sheen = Some(Box::new(Sheen { color: Vec3::splat(0.5), color_map: map, roughness: 0.3, roughness_map: map }));
        m.coat = Some(Box::new(Coat {
            strength: 0.9,
            strength_map: map,
            roughness: 0.3,
            roughness_map: None,
            normal_map: None,
            normal_scale: 1.0,
        }));
    }
}

/// The counted part of a picture; returns how many pixels show anything lit.
#[inline(never)]
fn counted_picture(job: &Job) -> usize {
    render(job, &()).picture.beauty.iter().filter(|[r, g, b, a]| *a > 0.0 && r + g + b > 0.0).count()
}

struct Answers {
    hits: Vec<Hit>,
    occluded: Vec<bool>,
}

/// The counted part of a trace: Callgrind selects it by its name.
#[inline(never)]
fn counted<A: Accel>(accel: &A, rays: &[Ray], any: bool, answers: &mut Answers, scratch: &mut A::Scratch) {
    if any {
        accel.occluded(rays, &mut answers.occluded, scratch, &mut NoProbe);
    } else {
        accel.closest(rays, &mut answers.hits, scratch, &mut NoProbe);
    }
}

/// Rays through the landscape: from a point above it through a grid in blocks of 4×4 if `alike`, otherwise between random points.
fn rays(shapes: &Shapes, alike: bool) -> Vec<Ray> {
    let bounds = shapes.vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |b, &v| (b.0.min(v), b.1.max(v)));
    let (middle, size) = ((bounds.0 + bounds.1) * 0.5, bounds.1 - bounds.0);
    let eye = middle + Vec3::new(-0.1, -0.6, 1.0) * size.length();
    let mut random = Random::new(1);
    let ray = |i: usize| {
        let (block, place) = (i / 16, i % 16);
        let (column, row) = (block % 16 * 4 + place % 4, block / 16 * 4 + place / 4);
        let (x, y) = (column as f32 / 64.0 - 0.5, row as f32 / 64.0 - 0.5);
        let (origin, target) = if alike {
            (eye, middle + Vec3::new(x, y, 0.0) * size * NARROW)
        } else {
            (middle + random.cube() * size * 0.5, middle + random.cube() * size * 0.5)
        };
        Ray { origin, t_min: 0.0, dir: target - origin, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 }
    };
    (0..RAYS).map(ray).collect()
}
