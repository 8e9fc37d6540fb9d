use super::knob::Knob;
use super::report::{Format, text};
use super::*;
use crate::accel::{AccelKind, AccelParams};
use crate::math::{DAffine3, DVec3, Vec2, Vec3};
use crate::render::{Quality, Sampling};
use crate::scene::{
    Bitmap, Camera, Environment, Instance, Material, Mesh, MetalRough, Pixels, Projection, Reflection, Sampler, Sphere,
    Texture, TextureRef, UvTransform,
};
use std::path::Path;

/// A mirror ball beside a matt one, in the studio environment.
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

/// Wall with a noise texture, three texels per pixel along each axis.
fn noise() -> Scene {
    const SIDE: u32 = 96;
    let code = |i: u32| if i.wrapping_mul(0x9e37_79b9) >> 13 & 1 == 1 { [255; 4] } else { [0, 0, 0, 255] };
    let texels: Vec<[u8; 4]> = (0..SIDE * SIDE).map(|i| code(i ^ i >> 5)).collect();
    let bitmap = Bitmap { name: String::new(), width: SIDE, height: SIDE, pixels: Pixels::Rgba8(texels.into()) };
    let painted = Material {
        reflection: Reflection::Unlit,
        base_color_map: Some(TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() }),
        ..Material::plain()
    };
    let corner = |x: f32, y: f32| Vec3::new(1.3 * x, 1.3 * y, 0.0);
    let wall = Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        uvs: vec![vec![Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let instance = Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY };
    Scene {
        bitmaps: vec![bitmap],
        textures: vec![Texture { bitmap: 0, sampler: Sampler::default() }],
        materials: vec![painted],
        meshes: vec![wall],
        instances: vec![instance],
        ..Scene::default()
    }
}

fn study(knobs: &[Knob]) -> Study {
    study_of(&balls(), 512, knobs)
}

fn study_of(scene: &Scene, reference_samples: u32, knobs: &[Knob]) -> Study {
    let world = World::new(scene);
    let accel = AnyAccel::build(AccelKind::DEFAULT, &world.shapes, &AccelParams::DEFAULT);
    let camera = Camera {
        name: String::new(),
        projection: Projection::Perspective { y_fov: 0.7, aspect: None },
        world_from_camera: DAffine3::from_translation(DVec3::Z * 7.0),
    };
    let (textures, view) = (TextureStore::new(scene), View::from_camera(&camera));
    let base = Settings { width: 48, height: 32, ..Settings::default() };
    let output = Output::default();
    let subject = Subject {
        scene,
        world: &world,
        accel: &accel,
        textures: &textures,
        view: &view,
        base: &base,
        samples: scene.hints.samples,
        fewest: 1,
        output: &output,
    };
    let plan = Plan { passes: 2, reference_samples, seed: 7 };
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
    // The measured settings are those that the flag alone gives.
    let most = Quality::default().stochastic().max_samples;
    let rows: Vec<&Row> = study.rows.iter().filter(|row| row.setting.knob == Knob::Stochastic).collect();
    let is_usual =
        |row: &&Row| matches!(row.setting.settings.sampling, Sampling::Stochastic(how) if how.max_samples == most);
    assert!(rows.len() == 4 && rows.iter().all(is_usual));
}

#[test]
fn a_reference_is_no_farther_off_than_it_says() {
    let [few, many] = [64, 4096].map(|samples| study_of(&noise(), samples, &[]).reference);
    let squares = few.pixels.iter().zip(&many.pixels).flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)));
    let off = (squares.sum::<f64>() / (3 * few.pixels.len()) as f64).sqrt();
    assert!(few.error > 0.001 && off < 1.5 * few.error, "{off} where {} is said", few.error);
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
        let chosen = advice.row.map(|i| study.rows[i].error.known());
        assert!(chosen.is_none_or(|rmse| rmse <= advice.purpose.good_enough()));
        let least =
            |rows: &mut dyn Iterator<Item = &Row>| rows.map(|row| row.cpu.median()).fold(f64::INFINITY, f64::min);
        let good = |row: &&Row| row.error.known() <= advice.purpose.good_enough();
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

#[test]
fn settings_take_the_samples_that_render_takes_of_points_and_lines_and_of_scene_files() {
    let scene = balls();
    let world = World::new(&scene);
    let accel = AnyAccel::build(AccelKind::DEFAULT, &world.shapes, &AccelParams::DEFAULT);
    let view = View::from_camera(&Camera {
        name: String::new(),
        projection: Projection::Perspective { y_fov: 0.7, aspect: None },
        world_from_camera: DAffine3::from_translation(DVec3::Z * 7.0),
    });
    let (textures, base, output) = (TextureStore::new(&scene), Settings::default(), Output::default());
    let of = |samples, fewest| {
        let (scene, world, accel, textures, view) = (&scene, &world, &accel, &textures, &view);
        settings(&Subject { scene, world, accel, textures, view, base: &base, samples, fewest, output: &output })
    };
    let find = |all: &[Setting], flags: &str| all.iter().find(|s| s.flags == flags).expect(flags).settings.clone();
    for setting in of(None, 16) {
        match setting.settings.sampling {
            Sampling::Stochastic(how) => assert!(how.min_samples >= 16, "{}", setting.flags),
            _ => assert!(["quality", "stochastic", "depth"].iter().all(|knob| setting.knob.name() != *knob)),
        }
    }
    let (usual, hinted) = (of(None, 1), of(Some(9), 1));
    let depth = "--depth 1";
    assert!(matches!(find(&usual, depth).sampling, Sampling::Stochastic(how) if how.min_samples == 1));
    assert_eq!((find(&hinted, depth).sampling, find(&hinted, depth).samples), (Sampling::Uniform, 9));
    assert!(matches!(find(&hinted, "--quality normal").sampling, Sampling::Stochastic(_)));
}
