//! `meshray study`: rows as they are measured, reports, and advice.

use super::program::Folder;
use serde_json::Value;

#[test]
fn a_study_measures_every_setting_and_says_which_to_use() {
    let folder = Folder::with_cube();
    let words = ["study", "cube.obj", "--size", "24x18", "--passes", "2", "--reference-samples", "64", "-q"];
    let reports = ["--report", "a.json", "--report", "a.csv", "--report", "a.html"];
    let run = folder.run(&[words.as_slice(), &reports].concat()).ends(0);
    for line in ["--quality normal", "--samples 64", "--aa adaptive", "--intersector", "for draft:", "for final:"] {
        assert!(run.text().contains(line), "{line}\n{}", run.text());
    }
    assert!(!run.text().contains("metered"), "it has no lamps: {}", run.text());
    let json: Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
    assert_eq!((&json["schema"], &json["complete"]), (&"meshray-study/1".into(), &true.into()));
    let rows = json["rows"].as_array().unwrap();
    assert!(rows.iter().any(|row| row["is_on_front"] == true) && json["advice"].as_array().unwrap().len() == 3);
    assert!(!rows.iter().any(|row| row["knob"] == "light-rays"), "a cube in the studio has no wide light");
    let lines = String::from_utf8(folder.read("a.csv")).unwrap().lines().count();
    assert_eq!(lines, rows.len() + 1);
    assert!(String::from_utf8(folder.read("a.html")).unwrap().contains("Error against time"));
}

#[test]
fn what_cannot_be_studied_is_told() {
    let folder = Folder::with_cube().file("empty.obj", "# nothing");
    folder.run(&["study", "empty.obj"]).ends(3).says(&["empty.obj"]);
    folder.run(&["study", "cube.obj", "--report", "a.txt"]).ends(2).says(&[".html"]);
    assert!(!folder.has("a.txt"));
}

#[test]
fn measured_lamps_are_exposed_as_they_are_in_a_picture() {
    // Nine little-endian floats: (-1, -1, 0), (1, -1, 0), (0, 1, 0).
    let bytes = "AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA";
    let lit = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0,1]}}],
        "nodes":[{{"mesh":0}},{{"translation":[0,0,2],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}}],
        "extensionsUsed":["KHR_lights_punctual"],
        "extensions":{{"KHR_lights_punctual":{{"lights":[{{"type":"point","intensity":3000}}]}}}},
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{bytes}"}}]}}"#
    );
    let folder = Folder::new().file("lit.gltf", lit);
    let said = folder.run(&["render", "lit.gltf", "--size", "24x18"]).ends(0).stderr;
    let exposure = said.split(", ").find(|part| part.contains("(metered)")).unwrap().lines().next().unwrap();
    let words = ["study", "lit.gltf", "--size", "24x18", "--passes", "2", "--reference-samples", "64", "-q"];
    let run = folder.run(&words).ends(0);
    assert!(run.text().contains(exposure), "{exposure}\n{}", run.text());
    assert!(!folder.run(&[&words[..], &["--exposure", "1"]].concat()).ends(0).text().contains("metered"));
}

#[test]
fn what_is_studied_is_the_picture_before_its_background() {
    let ball = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n";
    for (background, channels) in [("white", 3), ("transparent", 4)] {
        let scene = format!("background = \"{background}\"\n{ball}");
        let folder = Folder::new().file("ball.toml", &scene);
        let words = ["study", "ball.toml", "--size", "16x12", "--passes", "2", "--reference-samples", "64", "-q"];
        folder.run(&[words.as_slice(), &["--report", "a.json"]].concat()).ends(0);
        let json: Value = serde_json::from_slice(&folder.read("a.json")).unwrap();
        assert_eq!(json["reference"]["channels"], channels, "{background}");
        let rows = json["rows"].as_array().unwrap();
        assert!(!rows.iter().any(|row| row["knob"] == "gloss-rays"), "nothing is frosted");
    }
}
