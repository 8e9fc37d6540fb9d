//! Sampling of pixels: flags, layers, statistics, and repeatable pictures.

use super::program::{Folder, picture};
use meshray::image::{FileKind, Metadata, Output, encode, read_metadata};
use serde_json::Value;

const SMALL: [&str; 4] = ["render", "cube.obj", "--size", "32x24"];

fn run(folder: &Folder, arguments: &[&str]) -> super::program::Run {
    folder.run(&[&SMALL, arguments].concat())
}

#[test]
fn pictures_of_every_kind_of_sampling_are_repeated_byte_for_byte() {
    let kinds = [
        "",
        "--aa off",
        "--aa adaptive --aa-threshold 0.03 --aa-depth 2",
        "--quality draft --filter tent --confidence 90% --error-space linear",
        "--pixel-error 0.02 --min-samples 6 --max-samples 40 --aperture 0.1 --focus 0,0,1",
        "--samples 3 --aperture 0.1",
        "--target-error 0.01",
    ];
    for kind in kinds {
        let folder = Folder::with_cube();
        let words: Vec<&str> = kind.split_whitespace().collect();
        run(&folder, &[&["-o", "first.png"], words.as_slice()].concat()).ends(0);
        folder.run(&["render", "--again", "first.png", "-o", "second.png"]).ends(0);
        assert!(folder.read("first.png") == folder.read("second.png"), "{kind}");
    }
}

#[test]
fn a_picture_that_carries_an_error_to_reach_and_a_limit_of_samples_is_repeated_with_both() {
    let folder = Folder::with_cube();
    let settings = |name: &str| -> Value {
        let metadata = read_metadata(&folder.path(name)).unwrap().unwrap();
        serde_json::from_str(metadata.get(Metadata::SETTINGS).unwrap()).unwrap()
    };
    run(&folder, &["--target-error", "0.01", "-o", "free.png"]).ends(0);
    let mut limited = settings("free.png");
    limited["max-samples"] = "8".into();
    let metadata = read_metadata(&folder.path("free.png")).unwrap().unwrap();
    let metadata = metadata.with(Metadata::SETTINGS, limited.to_string());
    let file = encode(&picture(&folder.path("free.png")), FileKind::Png, &Output::default(), &metadata).unwrap();
    std::fs::write(folder.path("limited.png"), file).unwrap();
    folder.run(&["render", "--again", "limited.png", "-o", "again.png"]).ends(0);
    assert_eq!(settings("again.png"), limited);
}

#[test]
fn the_default_stops_when_it_is_certain_and_says_so() {
    let folder = Folder::with_cube();
    let done = run(&folder, &["-o", "a.exr", "--layers", "--float", "--stats", "json"]).ends(0);
    let stats: Value = serde_json::from_str(done.text()).unwrap();
    let sampling = &stats["sampling"];
    assert_eq!((&stats["samples"], sampling["aa"].as_str()), (&Value::Null, Some("stochastic")));
    assert_eq!(sampling["error_space"], "linear");
    let number = |key: &str| sampling[key].as_f64().unwrap();
    assert!(number("mean") >= 4.0 && number("most") > 4.0 && number("rmse") > 0.0, "{sampling}");
    assert_eq!(number("met") + number("ceiling"), 32.0 * 24.0);
    let layers = picture(&folder.path("a.exr")).layers.unwrap();
    let channel = |name: &str| layers.channels.iter().find(|c| c.name == name).unwrap();
    let rays: f64 = channel("sampling.count").values.iter().sum();
    assert!((number("samples_a_pixel") * 32.0 * 24.0 - rays).abs() < 1e-6, "{sampling}");
    assert_eq!(Some(rays), sampling["rays"].as_f64());
    assert_eq!(Some(rays), stats["counts"]["primary"]["rays"].as_f64());
    let squares: f64 = channel("sampling.error").values.iter().map(|e| e * e).sum();
    assert!(((squares / (32.0 * 24.0)).sqrt() - number("rmse")).abs() < 1e-9);
    assert!(number("spare") > 0.0 && number("spare") < 0.8 * rays, "{sampling}");
    let words = ["samples a pixel", "within 0.08", "at 95 % confidence", "error at most about", "have met", "to spare"];
    run(&folder, &["-o", "a.png"]).ends(0).says(&words);
}

#[test]
fn samples_alone_are_uniform() {
    let folder = Folder::with_cube();
    let stats: Value =
        serde_json::from_str(run(&folder, &["--samples", "5", "--stats", "json"]).ends(0).text()).unwrap();
    assert_eq!((stats["samples"].as_u64(), stats["sampling"]["rays"].as_u64()), (Some(5), Some(32 * 24 * 5)));
}

#[test]
fn costs_of_pixels_are_those_of_a_fixed_number_of_rays() {
    let folder = Folder::with_cube();
    run(&folder, &["-o", "a.exr", "--float", "--layers", "tests"]).ends(0);
    run(&folder, &["-o", "b.exr", "--float", "--layers", "tests", "--samples", "4"]).ends(0);
    let tests = |name: &str| {
        let layers = picture(&folder.path(name)).layers.unwrap();
        layers.channels.into_iter().find(|c| c.name == "tests.primary").unwrap()
    };
    assert_eq!(tests("a.exr"), tests("b.exr"));
}

#[test]
fn flags_that_contradict_each_other_are_refused() {
    let folder = Folder::with_cube();
    for (words, said) in [
        ("--samples 4 --pixel-error 0.01", "--samples"),
        ("--aa uniform --quality final", "--quality"),
        ("--aa-depth 2 --filter tent", "--aa-depth"),
        ("--min-samples 9 --max-samples 8", "--min-samples 9"),
        ("--target-error 0.002 --max-samples 8", "--pixel-error with --max-samples"),
        ("--confidence 3", "50%"),
        ("--focus 3", "--aperture"),
        ("--aperture=-1", "radius"),
    ] {
        let words: Vec<&str> = words.split_whitespace().collect();
        run(&folder, &words).ends(2).says(&[said]);
    }
    run(&folder, &["--aperture", "0.1", "--eye", "0,0,5", "--at", "0,0,0", "--focus", "0,0,9"])
        .ends(3)
        .says(&["not in front of the camera", "-4 along"]);
}

#[test]
fn a_dry_run_foretells_and_writes_nothing() {
    let folder = Folder::with_cube();
    let run = folder.run(&["render", "cube.obj", "--size", "160x120", "--dry-run"]).ends(0);
    for words in ["160×120", "processor time", "rays from the eye", "ray/prim tests", "error", "nothing is written"] {
        assert!(run.text().contains(words), "{words}\n{}", run.text());
    }
    let run = folder.run(&["render", "cube.obj", "--size", "160x120", "--dry-run", "--stats", "json"]).ends(0);
    let told: Value = serde_json::from_str(run.text()).unwrap();
    assert_eq!(told["schema"], "meshray-forecast/1");
    let (rays, rmse) = (&told["rays"], &told["rmse"]["value"]);
    assert!(rays["low"].as_f64() <= rays["value"].as_f64() && rays["value"].as_f64() <= rays["high"].as_f64());
    assert!(rmse.as_f64().unwrap() > 0.0 && told["looked_at"].as_u64().unwrap() < 160 * 120, "{told}");
    assert_eq!(folder.names(), ["cube.obj"]);
    let views = ["render", "cube.obj", "--size", "32x24", "--dry-run", "--view", "front,iso", "-o", "{view}.png"];
    let run = folder.run(&views).ends(0);
    assert!(
        run.text().contains("cube.obj, front view, as front.png: ")
            && run.text().contains("cube.obj, iso view, as iso.png: "),
        "{}",
        run.text()
    );
    let run = folder.run(&[&views[..], &["--stats", "json"]].concat()).ends(0);
    let outputs = run.text().lines().map(|line| serde_json::from_str::<Value>(line).unwrap()["output"].clone());
    assert_eq!(outputs.collect::<Vec<_>>(), ["front.png", "iso.png"]);
}

#[test]
fn what_finding_out_takes_is_foretold_with_the_rest() {
    let folder = Folder::with_cube();
    let json = |more: &[&str]| {
        let words = ["render", "cube.obj", "--size", "96x72", "--target-error", "0.002", "-q", "--stats", "json"];
        let run = folder.run(&[&words[..], more].concat()).ends(0);
        serde_json::from_str::<Value>(run.text()).unwrap()
    };
    let (foretold, took) = (json(&["--dry-run"]), json(&["-o", "a.png"]));
    let (rays, eye) =
        (foretold["rays"]["value"].as_f64().unwrap(), 96.0 * 72.0 * took["sampling"]["mean"].as_f64().unwrap());
    assert!((0.75..1.33).contains(&(eye / rays)), "{rays} foretold, {eye} sent");
}

#[test]
fn an_error_that_is_asked_for_is_reached_and_said_with_what_was_foretold() {
    let folder = Folder::with_cube();
    let run = folder.run(&["render", "cube.obj", "--size", "96x72", "--target-error", "0.002", "-o", "a.png"]).ends(0);
    run.says(&["where 0.002 was asked for", "forecast"]);
    folder.run(&["render", "cube.obj", "--target-error", "0.002", "--samples", "4"]).ends(2).says(&["--target-error"]);
    folder.run(&["render", "cube.obj", "--target-error", "0.002", "--pixel-error", "0.1"]).ends(2);
}
