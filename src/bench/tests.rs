//! A small scene with rays of every class and every question, measured and reported.

mod studies;

use super::compare::{Plan, Task, compare, count};
use super::machine::Machine;
use super::rays::{Class, RaySet, record};
use super::report::{Format, Model, Rays, Report, text};
use super::row::Row;
use crate::accel::{
    Accel, AccelKind, AccelParams, AnyAccel, Count, Hit, HitQueries, OccludedFilter, Probe, Ray, RayCounts, Unculled,
};
use crate::load::{LoadOptions, load_bytes};
use crate::render::texture::TextureStore;
use crate::render::{ClassCounts, Filters, Job, Question, Settings, View, World, render_counted};
use crate::scene::framing::{default_camera, robust_bounds};
use crate::scene::{Scene, default_light};

const STILL: &str = "\
[materials.glass]\ndiffuse=0\nior=1.5\ntransmission=[0.9,0.9,0.9]\nmirror=0.1\n\
[materials.mirror]\ndiffuse='grey'\nmirror=[0.6,0.6,0.6]\n\
[materials.veil]\ndiffuse='red'\nopacity=0.5\n\
[[spheres]]\ncenter=[0.5,0.5,2]\nradius=0.6\nmaterial='glass'\n\
[[spheres]]\ncenter=[3,0.5,0.5]\nradius=0.7\nmaterial='mirror'\n\
[[spheres]]\ncenter=[1.5,1.8,1]\nradius=0.4\nmaterial='veil'\n\
[[meshes]]\npositions=[[0,0,0],[2,0.1,0],[2,1,0.2],[0,1,0],[0.1,0,1],[2,0,1.1],[2,1.3,1],[0,1,1]]\n\
faces=[[0,2,1],[0,3,2],[4,5,6],[4,6,7],[0,1,5],[0,5,4],[3,7,6],[3,6,2],[0,4,7],[0,7,3],[1,2,6],[1,6,5]]\n";

const SIZE: (u32, u32) = (24, 18);

/// A scene with everything needed to render it.
struct Stage {
    scene: Scene,
    world: World,
    view: View,
    settings: Settings,
}

impl Stage {
    fn new() -> Self {
        let mut scene = load_bytes("still.toml".as_ref(), STILL.into(), &LoadOptions::default()).unwrap().scene;
        let camera = default_camera(&scene, &robust_bounds(&scene), 4.0 / 3.0);
        default_light::add_if_missing(&mut scene, &camera);
        let settings = Settings { width: SIZE.0, height: SIZE.1, samples: 1, ..Settings::default() };
        Self { world: World::new(&scene), scene, view: View::from_camera(&camera), settings }
    }

    fn with_job<T>(&self, kind: AccelKind, work: impl FnOnce(&Job) -> T) -> T {
        work(&Job {
            scene: &self.scene,
            world: &self.world,
            accel: &AnyAccel::build(kind, &self.world.shapes, &AccelParams::DEFAULT),
            textures: &TextureStore::new(&self.scene),
            view: &self.view,
            settings: &self.settings,
        })
    }

    fn rays(&self) -> Vec<RaySet> {
        self.with_job(AccelKind::DEFAULT, |job| record(job, Plan::RAYS, 1)).unwrap().0
    }

    fn counts(&self, kind: AccelKind) -> ClassCounts {
        self.with_job(kind, |job| render_counted(job, &())).counts
    }

    fn rows(&self, rays: &[RaySet], plan: &Plan) -> Vec<Row> {
        let textures = TextureStore::new(&self.scene);
        let filters = Filters::of(&self.scene, &self.world, &textures, &self.settings);
        assert!(filters.is_some(), "light passes a veil");
        compare(&self.world, filters.as_ref(), rays, (SIZE.0 * SIZE.1) as usize, plan, &mut |_, _| true).unwrap()
    }

    /// Records, compares and reports with every structure of the plan.
    fn report(&self, plan: Plan) -> Report {
        let rays = self.rays();
        let model = Model {
            name: "still \"life\".toml".into(),
            hash: 7,
            prims: self.world.shapes.len(),
            objects: self.world.shapes.objects().len(),
            auto: plan.sweep.is_none().then(|| self.world.judged()),
            width: SIZE.0,
            height: SIZE.1,
            samples: 1,
            depth: 12,
            view: "default view".into(),
            camera: self.view,
            rays: rays.iter().map(Rays::of).collect(),
            rows: self.rows(&rays, &plan),
            kept: 0,
            left_out: Vec::new(),
            pruning: None,
        };
        Report {
            machine: Machine::here(),
            plan,
            models: vec![model],
            family: None,
            heatmap_max: None,
            compare: None,
            complete: true,
        }
    }
}

fn plan() -> Plan {
    Plan {
        kinds: AccelKind::ALL.to_vec(),
        params: AccelParams::DEFAULT,
        sweep: None,
        passes: 0,
        threads: 1,
        rays: Plan::RAYS,
        slow_tests: Plan::SLOW_TESTS,
        seed: 1,
    }
}

#[test]
fn the_rays_of_the_scene_are_of_every_class_and_question() {
    let rays = Stage::new().rays();
    assert_eq!(rays.iter().map(|r| r.class).collect::<Vec<_>>(), Class::ALL);
    assert!(rays.iter().all(|r| r.asked == r.len() as u64 && r.len() > 40));
    for question in Question::ALL {
        assert!(rays.iter().flat_map(|r| &r.batches).any(|b| b.question == question), "{question:?}");
    }
}

#[test]
fn replayed_rays_cost_what_the_renderer_counts() {
    let stage = Stage::new();
    let rays = stage.rays();
    for row in stage.rows(&rays, &plan()) {
        let counted = stage.counts(row.kind);
        let expected = [counted.primary, counted.shadow, counted.reflected, counted.refracted];
        let replayed: Vec<RayCounts> = row.classes.iter().take(4).map(|c| c.counts).collect();
        assert_eq!(replayed, expected, "{}", row.kind);
        assert_eq!((row.differing(), row.sampled), (0, false));
        let tests: u64 = expected.iter().map(|c| c.n_it).sum();
        assert_eq!(row.tests_by_pixel.iter().map(|&n| u64::from(n)).sum::<u64>(), tests, "{}", row.kind);
    }
}

/// Structure that misses all hits with one prim.
struct Blind<'a>(Unculled<'a>, u32);

impl Accel for Blind<'_> {
    type Scratch = ();

    fn scratch(&self) {}

    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut (), probe: &mut P) {
        self.0.first_hits(queries, hits, scratch, probe);
        hits.iter_mut().filter(|h| h.prim == self.1).for_each(|h| *h = Hit::MISS);
    }

    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut (),
        probe: &mut P,
    ) {
        self.0.occluded_filtered(rays, filter, occluded, scratch, probe);
    }
}

#[test]
fn a_structure_that_loses_hits_is_noticed() {
    let stage = Stage::new();
    let whole = Unculled::new(&stage.world.shapes);
    let task = Task::new(&whole, None, stage.rays().swap_remove(0));
    assert_eq!(count(&whole, None, &task, &mut []).differing, 0);
    let lost: u64 = (0..15).map(|prim| count(&Blind(whole, prim), None, &task, &mut []).differing).sum();
    assert_eq!(lost, task.set.batches[0].rays.len() as u64 - misses(&whole, &task.set), "every hit is lost once");
}

/// Number of rays of the first batch that miss everything.
fn misses(whole: &Unculled, set: &RaySet) -> u64 {
    let rays = &set.batches[0].rays;
    let mut hits = vec![Hit::MISS; rays.len()];
    whole.closest(rays, &mut hits, &mut (), &mut crate::accel::NoProbe);
    hits.iter().filter(|h| !h.is_some()).count() as u64
}

#[test]
fn a_slow_structure_gets_a_sample_with_its_interval() {
    let stage = Stage::new();
    let rays = stage.rays();
    let prims = stage.world.shapes.len() as u64;
    let few = Plan { slow_tests: 30 * prims, ..plan() };
    let rows = stage.rows(&rays, &few);
    let none = rows.iter().find(|r| r.kind == AccelKind::None).unwrap();
    assert!(none.sampled && none.tests_by_pixel.is_empty());
    assert!(none.classes.iter().all(|c| (30..=32).contains(&c.counts.queries)));
    // The true mean lies in the 95 % interval or, as that may fail, near it.
    let all = stage.rows(&rays, &plan());
    let shadow = (&none.classes[1], &all[0].classes[1]);
    let off = (shadow.0.per_ray(Count::It) - shadow.1.per_ray(Count::It)).abs();
    assert!(shadow.0.interval(Count::It) > 0.0 && off <= 2.0 * shadow.0.interval(Count::It), "{off}");
    assert!(none.classes[0].interval(Count::It) < 1.0, "every closest query tests every prim but an excluded one");
    let exact = rows.iter().find(|r| !r.sampled).unwrap();
    assert!(exact.classes.iter().all(|c| !c.is_sampled() && c.interval(Count::It) == 0.0), "nothing was left out");
}

#[test]
fn threads_and_passes_change_no_count() {
    let stage = Stage::new();
    let rays = stage.rays();
    let timed = stage.rows(&rays, &Plan { passes: 2, threads: 2, ..plan() });
    for (timed, plain) in timed.iter().zip(stage.rows(&rays, &plan())) {
        assert!(timed.build.len() == 2 && timed.classes.iter().all(|c| c.seconds.len() == 2 && c.seconds.min() > 0.0));
        assert!(timed.classes.iter().zip(&plain.classes).all(|(t, p)| t.counts == p.counts));
    }
}

#[test]
fn work_ends_when_it_is_told_to() {
    let stage = Stage::new();
    let mut heard = 0;
    let mut stop = |rows: &[Row], _: &str| {
        heard = rows.len();
        rows.is_empty()
    };
    assert_eq!(compare(&stage.world, None, &stage.rays(), 0, &plan(), &mut stop), None);
    assert_eq!(heard, 1);
}

#[test]
fn every_format_holds_every_structure_and_class() {
    let report = Stage::new().report(Plan { passes: 1, ..plan() });
    let lines = AccelKind::ALL.len() * Class::ALL.len();
    let json: serde_json::Value = serde_json::from_str(&Format::Json.write(&report)).unwrap();
    let model = &json["models"][0];
    assert_eq!((&json["schema"], &model["identical"]), (&"meshray-bench/1".into(), &true.into()));
    assert_eq!(model["structures"].as_array().unwrap().len(), AccelKind::ALL.len());
    assert!(model["structures"][0]["classes"]["diffuse"]["per_ray"]["n_it"].as_f64().unwrap() > 1.0);
    assert!(model["structures"][1]["t_b"]["median"].as_f64().unwrap() > 0.0);

    let csv = Format::Csv.write(&report);
    let columns = csv.lines().next().unwrap().split(',').count();
    assert_eq!(csv.lines().count(), 1 + lines);
    assert!(csv.lines().all(|l| l.split(',').count() == columns), "{csv}");
    assert!(csv.contains("\"still \"\"life\"\".toml\""));

    let markdown = Format::Markdown.write(&report);
    let rows = markdown.lines().filter(|l| AccelKind::ALL.iter().any(|k| l.starts_with(&format!("| {k} |")))).count();
    assert_eq!(rows, lines + AccelKind::ALL.len());
    assert!(markdown.contains("bit for bit"));

    let html = Format::Html.write(&report);
    assert_eq!(html.matches("<tr><th scope=\"row\">").count(), lines + AccelKind::ALL.len());
    assert_eq!(html.matches("<img ").count(), AccelKind::ALL.len() + 1);
    assert_eq!(html.matches("<svg").count(), html.matches("</svg>").count());
    assert!(html.contains("still &quot;life&quot;.toml") && !html.contains("http") && !html.contains("<script"));
    assert!(Format::from_path("a.txt".as_ref()).unwrap_err().contains(".json"));
}

#[test]
fn the_tables_look_like_this() {
    let report = Stage::new().report(Plan { kinds: vec![AccelKind::None, AccelKind::GridOctree], ..plan() });
    let text = text::write(&report, &report.models[0]);
    assert_eq!(text, include_str!("tests/still.txt"), "\n{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 120));
}

#[test]
fn differences_are_said_and_counted() {
    let mut report = Stage::new().report(plan());
    report.models[0].rows[1].classes[2].differing = 3;
    let (verdict, wrong) = (report.models[0].verdict(), report.models[0].rows[1].kind);
    assert!(verdict.contains("DIFFER") && verdict.contains(&format!("{wrong} in 3 rays")), "{verdict}");
}
