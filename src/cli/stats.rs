//! `--stats`: costs of pictures, as a table or as JSON.
//!
//! # Schema `meshray-stats/1`
//! One JSON object per picture written, each on its own line:
//!
//! | key | what |
//! |---|---|
//! | `schema`, `version` | `meshray-stats/1`; version of meshray |
//! | `inputs`, `output`, `input_hash` | files as typed (`-`: standard streams); xxh3-128 of everything read, hexadecimal |
//! | `width`, `height`, `samples`, `depth`, `cutoff`, `seed`, `view`, `accel`, `intersector`, `threads` | settings used |
//! | `sampling` | `aa` and its settings (top-level `samples` is `null` unless uniform); primary `rays`, their `mean` per pixel of the picture (including those traced again at tile borders and those `looked` with), the mean `samples_a_pixel` that the picture was made of, and the `most` of one pixel; for stochastic sampling: pixels that `met` `pixel_error`, pixels stopped at the `ceiling`, rays `spare`, rays with which it was `looked` beforehand for objects that randomly spread rays seldom hit (except the first ones of a small picture, which are its own), and the picture's `rmse` in `error_space`: estimated from several renderings, or a cautious bound from one |
//! | `auto` | `null`, or the reason for the choice of `--accel auto`: `why` in words; `rays` and `prims` of the sample; cost per ray of `fast-octree` and `fast-bvh`, in nodes of eight boxes, `null` without a sample |
//! | `parameters` | of the structure, as used: `leaf_size` (`null`: by step cost); for grids and octrees also `grid_density`, `grid_resolution`, `max_depth`, `step_cost`, `grid_cells` (`null`: by density), `max_references`, `assign`, `mailbox` |
//! | `seconds` | of the timed run: `load`, `build`, `meter` (exposure of lamps in lux and candela), `render`, `write`; `load` and `build` are 0 for further pictures of one scene, `meter` is 0 for further pictures of one view and without metered lamps |
//! | `animation` | `null`, or the one shown: its `number` in the file, and the `time` in seconds, clamped to its end |
//! | `scene` | as shown: `triangles`, `polygons`, `spheres`, `cones` (cylinders too), `planes`, `materials`, `textures`, `lights`; as stored: `vertices`, `stored_triangles`, `bytes` of all shapes; `kept_instances`: instances of meshes stored once |
//! | `structure` | V. Havran's `n_in`, `n_v`, `n_ev`, `n_oiv`; `bytes` and `depth` |
//! | `counts` | for each ray class `primary`, `shadow`, `reflected`, `refracted`, and `all`: exact `rays`, `hits`, `tests`, `steps`, `cells`, `empty_cells`, `volume_tests`, `tests_saved`, `transforms`; and per ray `n_it`, `n_ts`, `n_ets`, `n_eets`, `n_bit`, `n_mb`, `n_xf`; `culled` = 1 − n_it / N |
//! | `counted_seconds` | time of the second run that counted; never compare it with `seconds` |
//! | `profile` | `null`, or with `--profile` its `stages`: `stage`, `part_of` (ray classes and `shade` are parts of `tiles`), seconds `wall` (`null` for parts) and `cpu` of all threads, `rays` of a class; `peak_memory`, bytes (`null` if unknown) |
//! | `rounding` | largest displacement of a vertex by rounding, world units |
//!
//! Keys are only ever added; a change of meaning gets another schema name.

use super::again::Making;
use super::args::StatsFormat;
use super::exit::Exit;
use super::interrupt;
use super::job::RenderJob;
use super::message::Messages;
use super::profile::Profile;
use super::{outputs, sampling, summary};
use crate::accel::{AccelKind, AccelParams, RayCounts, StructureStats};
use crate::number::{bytes, grouped, seconds, so_many};
use crate::render::{CLASS_NAMES, ClassCounts, Job, Progress, Rendered, Sampling, World};
use serde_json::{Value, json};
use std::time::Instant;
use std::{fs, io};

/// Seconds per stage.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Times {
    /// Reading and decoding; 0 if reported for an earlier picture.
    pub load: f64,
    /// Building the structure.
    pub build: f64,
    /// Metering the exposure; 0 if nothing was metered.
    pub meter: f64,
    /// Tracing and shading.
    pub render: f64,
    /// Encoding and writing.
    pub write: f64,
}

impl Times {
    /// Times in one line of text.
    pub(super) fn line(&self, eye_rays: u64) -> String {
        format!("{}; {}", self.formatted_stages().join(", "), so_many(eye_rays, "eye ray"))
    }

    /// Stages with their times; metering only if there was any.
    fn formatted_stages(&self) -> Vec<String> {
        let is_told = |(name, time): &(&str, f64)| *name != "meter" || *time > 0.0;
        let told = self.stages().into_iter().filter(is_told);
        told.map(|(name, time)| format!("{name} {}", seconds(time))).collect()
    }

    fn stages(&self) -> [(&'static str, f64); 5] {
        let Self { load, build, meter, render, write } = *self;
        [("load", load), ("build", build), ("meter", meter), ("render", render), ("write", write)]
    }

    fn json(&self) -> Value {
        Value::from_iter(self.stages())
    }
}

/// Results of a counted run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Counted {
    /// Counts by ray class.
    pub counts: ClassCounts,
    /// Time of the counted run.
    pub seconds: f64,
    /// Number of prims of all kinds.
    pub prims: u64,
    /// Whether the pixels equal those of the timed run; otherwise the counts are of another picture.
    pub same: bool,
}

/// Renders once more, counting; `None` when the user interrupts.
pub(super) fn count(work: &Job, timed: &Rendered, progress: &dyn Progress) -> Option<Counted> {
    let start = Instant::now();
    let counted = crate::render::render_counted(work, progress);
    counted.complete.then(|| Counted {
        counts: counted.counts,
        seconds: start.elapsed().as_secs_f64(),
        prims: work.world.len() as u64,
        same: counted.picture == timed.picture,
    })
}

impl Counted {
    /// Counts by ray class and in total.
    pub(super) fn json(&self) -> Value {
        let mut all = RayCounts::default();
        let mut classes = serde_json::Map::new();
        for (name, counts) in self.classes() {
            all += *counts;
            classes.insert(name.into(), class_json(counts, self.prims));
        }
        classes.insert("all".into(), class_json(&all, self.prims));
        Value::Object(classes)
    }

    fn classes(&self) -> [(&'static str, &RayCounts); 4] {
        let c = &self.counts;
        let [primary, shadow, reflected, refracted] = CLASS_NAMES;
        [(primary, &c.primary), (shadow, &c.shadow), (reflected, &c.reflected), (refracted, &c.refracted)]
    }
}

fn class_json(c: &RayCounts, prims: u64) -> Value {
    let per_ray = |n: u64| if c.queries == 0 { 0.0 } else { n as f64 / c.queries as f64 };
    json!({
        "rays": c.queries, "hits": c.found, "tests": c.n_it, "steps": c.n_ts, "cells": c.n_ets,
        "empty_cells": c.n_eets, "volume_tests": c.n_bit, "tests_saved": c.n_mb,
        "transforms": c.n_xf,
        "n_it": per_ray(c.n_it), "n_ts": per_ray(c.n_ts), "n_ets": per_ray(c.n_ets),
        "n_eets": per_ray(c.n_eets), "n_bit": per_ray(c.n_bit), "n_mb": per_ray(c.n_mb),
        "n_xf": per_ray(c.n_xf),
        "culled": if prims == 0 { 0.0 } else { 1.0 - per_ray(c.n_it) / prims as f64 },
    })
}

/// Parameters of a structure that apply to its kind, as used.
fn parameters(kind: AccelKind, params: &AccelParams) -> Value {
    match kind {
        AccelKind::Bvh => json!({ "leaf_size": params.tree_leaf_size() }),
        AccelKind::Grid | AccelKind::GridOctree | AccelKind::GridBvh | AccelKind::Octree => {
            let grid = params.grid(kind);
            let in_trees = (kind == AccelKind::GridBvh).then(|| params.tree_leaf_size());
            json!({
                "grid_density": grid.density, "grid_resolution": grid.max_resolution, "max_depth": grid.max_depth,
                "step_cost": grid.step_cost, "leaf_size": in_trees.or(grid.leaf_size), "grid_cells": grid.dims,
                "max_references": grid.references, "assign": grid.assign.name(), "mailbox": params.mailbox.name(),
            })
        }
        _ => json!({}),
    }
}

/// Statistics of one picture.
pub(super) struct PictureStats {
    json: Value,
    /// Statistics as text, without all settings.
    text: String,
}

impl PictureStats {
    /// Gathers the statistics.
    pub(super) fn new(
        making: &Making,
        view: &str,
        times: Times,
        world: &World,
        structure: StructureStats,
        counted: Option<Counted>,
        profile: Option<&Profile>,
    ) -> Self {
        let settings = &making.effective.settings;
        let samples = (settings.sampling == Sampling::Uniform).then_some(settings.samples);
        let sampling = sampling::json(settings, making.sampled);
        let (scene, shapes) = (&making.loaded.scene, &world.shapes);
        let kept_vertices: usize = world.instanced.objects().iter().map(|o| o.shapes().vertices.len()).sum();
        // This loops over all corners, which pictures without statistics avoid.
        let rounding = counted.as_ref().map(|_| making.loaded.facts.max_rounding + world.rounding(scene));
        let json = json!({
            "schema": "meshray-stats/1", "version": super::version::SHORT,
            "inputs": making.inputs(),
            "output": making.shot.target.path().map_or("-".into(), |p| p.to_string_lossy()),
            "input_hash": making.hash(),
            "width": settings.width, "height": settings.height, "samples": samples, "sampling": sampling, "depth": making.depth,
            "cutoff": sampling::plain(settings.cutoff), "seed": settings.seed, "view": view, "accel": making.accel.name(),
            "intersector": making.job.intersector.name(),
            "auto": making.reason.map(|r| (r, r.sample())).map(|(r, sample)| json!({
                "why": r.to_string(), "rays": sample.map_or(0, |s| s.rays), "prims": r.prims,
                "fast-octree": sample.map(|s| s.octree), "fast-bvh": sample.map(|s| s.bvh),
            })),
            "animation": summary::animation_shown(&making.loaded.facts).map(|(number, time)| json!({ "number": number, "time": time })),
            "parameters": parameters(making.accel, &making.job.params),
            "threads": rayon::current_num_threads(),
            "seconds": times.json(),
            "scene": {
                "triangles": world.triangles(), "polygons": shapes.polygons.len(),
                "spheres": shapes.spheres.len(), "cones": shapes.cones.len(), "planes": shapes.planes.len(),
                "vertices": shapes.vertices.len() + kept_vertices,
                "kept_instances": world.instanced.placed().len(),
                "stored_triangles": shapes.triangles.len() + world.instanced.stored(),
                "bytes": world.bytes(),
                "materials": scene.materials.len(), "textures": scene.textures.len(), "lights": scene.lights.len(),
            },
            "structure": {
                "n_in": structure.n_in, "n_v": structure.n_v, "n_ev": structure.n_ev, "n_oiv": structure.n_oiv,
                "bytes": structure.bytes, "depth": structure.depth,
            },
            "counts": counted.as_ref().map(Counted::json),
            "counted_seconds": counted.as_ref().map(|c| c.seconds),
            "profile": profile.map(Profile::json),
            "rounding": rounding,
        });
        let text = statistics_text(making, &times, world, structure, counted.as_ref());
        Self { json, text }
    }
}

/// Statistics as text.
fn statistics_text(
    making: &Making,
    times: &Times,
    world: &World,
    structure: StructureStats,
    counted: Option<&Counted>,
) -> String {
    let (settings, shapes) = (&making.effective.settings, &world.shapes);
    let mut lines = vec![format!(
        "{}  {}×{}  {:.1} samples  depth {}  {}  {} threads",
        making.shot.target.path().map_or("-".into(), |path| path.to_string_lossy()),
        settings.width,
        settings.height,
        making.sampled.samples(),
        making.depth,
        making.accel.name(),
        rayon::current_num_threads(),
    )];
    lines.push(format!("  time       {}", times.formatted_stages().join("  ")));
    let shapes = [
        (world.triangles() as usize, "triangles"),
        (shapes.polygons.len(), "polygons"),
        (shapes.spheres.len(), "spheres"),
        (shapes.cones.len(), "cones"),
        (shapes.planes.len(), "planes"),
    ];
    let shapes = shapes.into_iter().filter(|(n, _)| *n > 0);
    let shapes: Vec<String> = shapes.map(|(n, kind)| format!("{} {kind}", grouped(n as u64))).collect();
    lines.push(format!("  scene      {}", shapes.join("  ")));
    let kept = world.instanced.placed().len();
    if kept > 0 {
        let stored = grouped((world.shapes.triangles.len() + world.instanced.stored()) as u64);
        let size = bytes(world.bytes() as u64);
        lines.push(format!("  stored     {stored} triangles  {size}  {} instances kept", grouped(kept as u64)));
    }
    let StructureStats { n_in, n_v, n_ev, n_oiv, .. } = structure;
    let numbers = [("n_in", n_in), ("n_v", n_v), ("n_ev", n_ev), ("n_oiv", n_oiv)];
    let numbers = numbers.map(|(name, n)| format!("{name} {}", grouped(n))).join("  ");
    lines.push(format!("  structure  {numbers}  {}", bytes(structure.bytes)));
    lines.extend(making.reason.map(|reason| format!("  auto       {reason}")));
    lines.extend(counted.map(count_table).unwrap_or_default());
    lines.join("\n")
}

fn count_table(counted: &Counted) -> Vec<String> {
    let mut all = RayCounts::default();
    let names: String = all.named().map(|(name, _)| format!(" {name:>9}")).concat();
    let mut lines = vec![format!("  {:<10} {:>12} {:>12}{names}", "counts", "rays", "hits")];
    let mut row = |name: &str, c: &RayCounts| {
        let per_ray = |n: u64| n as f64 / c.queries.max(1) as f64;
        let numbers: String = c.named().map(|(_, n)| format!(" {:>9.3}", per_ray(n))).concat();
        lines.push(format!("  {name:<10} {:>12} {:>12}{numbers}", c.queries, c.found));
    };
    for (name, counts) in counted.classes().into_iter().filter(|(_, c)| c.queries > 0) {
        all += *counts;
        row(name, counts);
    }
    row("all", &all);
    lines
}

/// Statistics of all pictures in the requested format; empty without any.
pub(super) fn text(job: &RenderJob, pictures: &[PictureStats]) -> String {
    let line = |picture: &PictureStats| match job.stats.as_ref().map(|stats| stats.format) {
        Some(StatsFormat::Json) => format!("{}\n", picture.json),
        Some(StatsFormat::Text) => format!("{}\n", picture.text),
        None => String::new(),
    };
    pictures.iter().map(line).collect()
}

/// Prints the statistics, or writes them to the requested file.
pub(super) fn report(job: &RenderJob, text: &str, messages: &Messages) -> Exit {
    let result = match job.stats_file() {
        None => super::print(text),
        Some(path) => {
            // The folder may not exist yet if no picture was written.
            let made = outputs::grows_with(&job.batches, path).map_or(Ok(()), fs::create_dir_all);
            made.and_then(|()| interrupt::write_atomic(path, text.as_bytes()))
                .map_err(|e| io::Error::new(e.kind(), format!("{}: {e}", path.display())))
        }
    };
    match result {
        Ok(()) => Exit::Done,
        Err(e) => {
            messages.error("stats-unwritable", format!("the statistics could not be written: {e}"), "");
            Exit::Failed
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::AnyAccel;
    use crate::math::DVec3;
    use crate::render::texture::TextureStore;
    use crate::render::view::Lens;
    use crate::render::{Settings, View, render};
    use crate::scene::{Material, Scene, Sphere};

    #[test]
    fn metering_is_named_where_there_was_any() {
        let times = Times { load: 0.01, build: 0.02, meter: 0.0, render: 0.5, write: 0.03 };
        assert_eq!(times.line(9), "load 10.0 ms, build 20.0 ms, render 500 ms, write 30.0 ms; 9 eye rays");
        let metered = Times { meter: 0.004, ..times };
        assert_eq!(
            metered.line(9),
            "load 10.0 ms, build 20.0 ms, meter 4.00 ms, render 500 ms, write 30.0 ms; 9 eye rays"
        );
        assert_eq!((&times.json()["meter"], &metered.json()["meter"]), (&0.0.into(), &0.004.into()));
    }

    #[test]
    fn a_counted_run_with_other_pixels_is_told_from_one_with_the_same() {
        let scene = Scene {
            spheres: vec![Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 }],
            materials: vec![Material::plain()],
            ..Scene::default()
        };
        let world = World::new(&scene);
        let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&scene);
        let view = View::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(3.0));
        let settings = &Settings { width: 8, height: 6, ..Settings::default() };
        let job = Job { scene: &scene, world: &world, accel: &accel, textures: &textures, view: &view, settings };
        let mut timed = render(&job, &());
        assert!(count(&job, &timed, &()).unwrap().same);
        timed.picture.beauty[0][0] += 0.25;
        assert!(!count(&job, &timed, &()).unwrap().same);
    }

    #[test]
    fn counts_per_ray_are_totals_divided_by_the_rays_asked() {
        let primary = RayCounts { queries: 4, found: 2, n_it: 10, ..RayCounts::default() };
        let counts = ClassCounts { primary, shadow: primary, ..ClassCounts::default() };
        let json = Counted { counts, seconds: 0.0, prims: 10, same: true }.json();
        assert_eq!((&json["primary"]["n_it"], &json["all"]["tests"]), (&2.5.into(), &20.into()));
        assert_eq!(json["all"]["culled"], 0.75);
        assert_eq!(json["reflected"]["n_it"], 0.0, "no ray is no division by zero");
    }
}
