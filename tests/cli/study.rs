//! `meshray study`: rows as they come, reports, what is advised.

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
