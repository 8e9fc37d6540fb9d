//! The Khronos validator's own test files against the table of codes: refused, warned about, or accepted.
//!
//! Runs only when `MESHRAY_SHARED` names the folder that holds `models/`. The table promises behaviour by rule; nothing in the
//! loader knows of these files.

use meshray::load::gltf::codes::{TABLE, Verdict};
use meshray::load::{LoadError, LoadOptions, load};
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

/// Files whose outcome differs from that of their codes, and why.
const EXCEPTIONS: &[(&str, Verdict, &str)] = &[
    ("base/data/json/bom.gltf", Verdict::Warn, "a byte-order mark is no reason to refuse"),
    ("base/data/glb/bom.glb", Verdict::Warn, "a byte-order mark is no reason to refuse"),
    ("base/data/image/unrecognized_format.gltf", Verdict::Accept, "an image that nothing shows is not read"),
    (
        "base/data/camera/empty_objects.gltf",
        Verdict::Warn,
        "cameras without their numbers are left out, the rest is drawn",
    ),
    ("base/data/camera/infinite_znear.gltf", Verdict::Refuse, "the JSON parser knows no endless numbers"),
];

#[test]
fn shared_validator_files_end_as_the_table_says() {
    let Some(folder) = folder() else { return };
    let mut reports = Vec::new();
    find_reports(&folder, &mut reports);
    reports.sort();
    assert!(!reports.is_empty(), "no reports under {}", folder.display());
    let mut wrong = Vec::new();
    let mut counts = [0; 3];
    for report in &reports {
        let model = report.with_extension("").with_extension("");
        let name = model.strip_prefix(&folder).unwrap_or(&model).to_string_lossy().replace('\\', "/");
        let expected = EXCEPTIONS.iter().find(|e| e.0 == name).map_or_else(|| expected(report), |e| e.1);
        let (found, messages) = outcome(&model);
        counts[expected as usize] += 1;
        if found != Some(expected) {
            wrong.push(format!("{name}: {found:?}, not {expected:?} {:?}\n    {messages}", codes(report)));
        }
    }
    println!("{} files: {} refused, {} warned, {} accepted", reports.len(), counts[0], counts[1], counts[2]);
    assert!(wrong.is_empty(), "{} files end otherwise:\n{}", wrong.len(), wrong.join("\n"));
}

fn folder() -> Option<PathBuf> {
    let shared = std::env::var_os("MESHRAY_SHARED").map(PathBuf::from);
    if shared.is_none() {
        println!("MESHRAY_SHARED is not set: 0 validator files");
    }
    shared.map(|shared| shared.join("models/invalid/gltf-validator"))
}

fn find_reports(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            find_reports(&path, out);
        } else if path.to_string_lossy().ends_with(".report.json") {
            out.push(path);
        }
    }
}

/// Codes of a report, with their places in the form of our messages.
fn codes(report: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(report).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    let messages = report["issues"]["messages"].as_array().cloned().unwrap_or_default();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or_default().to_owned();
    let code = |m: &serde_json::Value| (text(&m["code"]), text(&m["pointer"]).trim_start_matches('/').to_owned());
    messages.iter().map(code).collect()
}

/// Warnings of ours about files that break no rule.
const OWN: &[&str] = &["face-degenerate", "gltf-buffer-nowhere", "gltf-extensions-ignored", "points-and-lines"];

/// The most severe verdict among the codes of a report.
fn expected(report: &Path) -> Verdict {
    let verdicts = codes(report).into_iter().map(|(code, pointer)| {
        let row = TABLE.iter().find(|row| row.khronos == code);
        let verdict = row.unwrap_or_else(|| panic!("{code} is not in the table")).verdict;
        let parts = ["animations/", "images/", "materials/", "textures/", "samplers/"];
        let spared = parts.iter().any(|part| pointer.starts_with(part)) || pointer.contains("KHR_lights_punctual");
        if spared && verdict == Verdict::Refuse { Verdict::Warn } else { verdict }
    });
    verdicts.min_by_key(|&verdict| verdict as usize).unwrap_or(Verdict::Accept)
}

/// Outcome for a file, with its message; `None`: a panic, or a refusal without a message.
fn outcome(model: &Path) -> (Option<Verdict>, String) {
    match catch_unwind(|| load(model, &LoadOptions::default())) {
        Err(_) => (None, "panic".into()),
        Ok(Err(LoadError::Input(faults))) if faults.iter().any(|f| f.text.is_empty()) => (None, "no text".into()),
        Ok(Err(error)) => (Some(Verdict::Refuse), error.to_string()),
        Ok(Ok(loaded)) => {
            let told = loaded.warnings.iter().filter(|w| !OWN.contains(&w.code));
            let lines: Vec<String> = told.map(ToString::to_string).collect();
            let verdict = if lines.is_empty() { Verdict::Accept } else { Verdict::Warn };
            (Some(verdict), lines.join("\n    "))
        }
    }
}
