use super::knob::Knob;
use super::report::{Format, text};
use super::*;
use crate::accel::{AccelKind, AccelParams};
use crate::math::DVec3;
use crate::render::{Quality, Sampling};
use crate::scene::{Camera, Environment, Material, MetalRough, Projection, Reflection, Sphere};
use std::path::Path;

/// A mirror ball before a matt one, in the studio.
fn balls() -> Scene {
    let metal = MetalRough { metallic: 1.0, roughness: 0.0, ..MetalRough::default() };
    let mirror = Material { reflection: Reflection::MetalRough(metal), ..Material::plain() };
    let ball =
        |x: f64, material| Sphere { name: String::new(), center: DVec3::new(x, 0.0, 0.0), radius: 1.0, material };
    Scene {
        materials: vec![mirror, Material::plain()],
        spheres: vec![ball(-0.7, 0), ball(1.4, 1)],
        environment: Environment::Studio,
        ..Scene::default()
    }
}

fn study(knobs: &[Knob]) -> Study {
    let scene = balls();
    let world = World::new(&scene);
    let accel = AnyAccel::build(AccelKind::DEFAULT, &world.shapes, &AccelParams::DEFAULT);
    let camera = Camera {
        name: String::new(),
        projection: Projection::Perspective { y_fov: 0.7, aspect: None },
        world_from_camera: crate::math::DAffine3::from_translation(DVec3::Z * 7.0),
    };
    let (textures, view) = (TextureStore::new(&scene), View::from_camera(&camera));
    let base = Settings { width: 48, height: 32, ..Settings::default() };
    let output = Output::default();
    let subject = Subject {
        scene: &scene,
        world: &world,
        accel: &accel,
        textures: &textures,
        view: &view,
        base: &base,
        output: &output,
    };
    let plan = Plan { passes: 2, reference_samples: 512, seed: 7 };
    let reference = reference(&subject, &plan, &mut |_, _| true).unwrap();
    let rows: Vec<Row> = settings(&subject)
        .into_iter()
        .filter(|setting| knobs.contains(&setting.knob))
        .map(|setting| measure(&subject, &plan, &reference, setting))
        .collect();
    Study {
        name: "two <balls>".into(),
        hash: 1,
        view: "from the front".into(),
        size: (48, 32),
        threads: 1,
        plan,
        reference,
        rows,
        complete: true,
    }
}

fn row<'a>(study: &'a Study, flags: &str) -> &'a Row {
    study.rows.iter().find(|row| row.setting.flags == flags).unwrap()
}

#[test]
fn more_samples_are_nearer_to_the_reference_and_what_is_the_same_each_time_is_bias() {
    let study = study(&[Knob::Uniform, Knob::Stochastic]);
    assert!(study.reference.error < 0.003, "{}", study.reference.error);
    let errors: Vec<f64> = ["--samples 1", "--samples 4", "--samples 16", "--samples 64"]
        .map(|flags| row(&study, flags).error.rmse)
        .into();
    assert!(errors.windows(2).all(|pair| pair[0] > pair[1]), "{errors:?}");
    let off = row(&study, "--samples 1").error;
    assert!(off.noise == 0.0 && (off.bias - off.rmse).abs() < 1e-12 && off.max > off.rmse && off.flip > 0.0);
    let random = row(&study, "--pixel-error 0.04").error;
    assert!(random.noise > random.bias && random.rmse < 0.04, "{random:?}");
    // What is measured is what the flag alone gives.
    let most = Quality::default().stochastic().max_samples;
    let rows: Vec<&Row> = study.rows.iter().filter(|row| row.setting.knob == Knob::Stochastic).collect();
    let is_usual =
        |row: &&Row| matches!(row.setting.settings.sampling, Sampling::Stochastic(how) if how.max_samples == most);
    assert!(rows.len() == 4 && rows.iter().all(is_usual));
}

#[test]
fn bounces_that_are_missing_show_as_bias() {
    let study = study(&[Knob::Depth]);
    let [none, many] = ["--depth 0", "--depth 8"].map(|flags| row(&study, flags).error);
    assert!(none.bias > 0.05 && none.bias > none.noise && many.bias < 0.2 * none.bias, "{none:?} {many:?}");
    assert!(study.rows.iter().all(|row| matches!(row.setting.settings.sampling, Sampling::Stochastic(_))));
}

#[test]
fn a_scene_is_asked_only_about_the_knobs_that_it_has() {
    let study = study(&[Knob::LightRays, Knob::EnvRays, Knob::GlossRays, Knob::Test]);
    assert!(study.rows.is_empty(), "no wide light, no panorama, no glass, no triangle");
}

#[test]
fn every_report_has_every_row_and_says_what_to_use() {
    let study = study(&[Knob::Quality]);
    assert_eq!(study.rows.len(), Quality::ALL.len());
    let advice = study.advice();
    assert_eq!(advice.len(), 3);
    for advice in &advice {
        assert!(!advice.why.is_empty());
        let chosen = advice.row.map(|i| study.rows[i].error.rmse);
        assert!(chosen.is_none_or(|rmse| rmse <= advice.purpose.good_enough()));
        let least =
            |rows: &mut dyn Iterator<Item = &Row>| rows.map(|row| row.cpu.median()).fold(f64::INFINITY, f64::min);
        let good = |row: &&Row| row.error.rmse <= advice.purpose.good_enough();
        let is_fastest =
            advice.row.is_some_and(|i| study.rows[i].cpu.median() == least(&mut study.rows.iter().filter(good)));
        assert_eq!(advice.why.contains("the fastest with"), is_fastest, "{}", advice.why);
    }
    let lines: String = study.rows.iter().map(text::row).collect();
    assert_eq!(lines.lines().count(), 3);
    assert!(text::head(&study).contains("reference") && text::conclusion(&study).contains("for draft"));
    let format = |name: &str| Format::from_path(Path::new(name));
    let json: serde_json::Value = serde_json::from_str(&format("a.json").unwrap().write(&study)).unwrap();
    assert_eq!((&json["schema"], json["rows"].as_array().map(Vec::len)), (&"meshray-study/1".into(), Some(3)));
    assert_eq!(format("a.csv").unwrap().write(&study).lines().count(), 4);
    let html = format("a.HTML").unwrap().write(&study);
    assert!(html.contains("two &lt;balls&gt;") && html.contains("<svg") && html.contains("data:image/png"));
    assert!(!html.contains("<balls>") && !html.contains("<script"));
    assert!(format("a.txt").unwrap_err().contains(".html"));
}
