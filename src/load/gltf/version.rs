//! Version of glTF: versions other than 2 are reported before anything else is checked.

use super::codes::Code;
use super::report::Report;
use super::tree::Value;

/// Checks `asset.version` and `asset.minVersion`; returns whether the rest should be checked.
pub(super) fn check(root: &Value, report: &mut Report) -> bool {
    if !root.is_object() {
        report.add(Code::TypeMismatch, "", "the JSON is not an object; this is no glTF file");
        return false;
    }
    let Some(version) = root.pointer("/asset/version") else { return !is_version_one(root, report) };
    let Some(version) = version.as_str() else { return true };
    match numbers(version) {
        // Files from the time of glTF 1.0 write the version as loosely as the rest.
        None if version.starts_with("1.") || version == "1" => one(version, Code::PatternMismatch, report),
        None if version == "2" || version.starts_with("2.0.") => {
            let text = format!("version '{}' is not of the form 2.0", crate::load::paths::shorten(version));
            report.warn_with(Code::PatternMismatch, "asset.version", text, "it is read as 2.0");
            true
        }
        None => {
            let text = format!("version '{}' is not of the form 2.0", crate::load::paths::shorten(version));
            report.add(Code::PatternMismatch, "asset.version", text);
            false
        }
        Some((1, _)) => one(version, Code::UnknownAssetMajorVersion, report),
        Some((2, minor)) => {
            if minor > 0 {
                report.add(
                    Code::UnknownAssetMinorVersion,
                    "asset.version",
                    format!("glTF {version} is read as glTF 2.0"),
                );
            }
            minimum(root, (2, minor), report)
        }
        Some(_) => {
            let text = format!("this is glTF {version}; only glTF 2 can be read");
            report.add(Code::UnknownAssetMajorVersion, "asset.version", text);
            false
        }
    }
}

/// Checks `minVersion`; returns whether it is supported.
fn minimum(root: &Value, version: (u32, u32), report: &mut Report) -> bool {
    let Some(text) = root.pointer("/asset/minVersion").and_then(Value::as_str) else { return true };
    let Some(minimum) = numbers(text) else {
        let text = format!("version '{}' is not of the form 2.0", crate::load::paths::shorten(text));
        report.add(Code::PatternMismatch, "asset.minVersion", text);
        return false;
    };
    if minimum > version {
        let text = format!("minVersion {text} is above the version");
        report.add(Code::AssetMinVersionGreaterThanVersion, "asset.minVersion", text);
    }
    if minimum.0 != 2 {
        let text = format!("the file needs glTF {text}; only glTF 2 can be read");
        report.refuse(Code::UnknownAssetMajorVersion, "asset.minVersion", text);
        return false;
    }
    if minimum.1 > 0 {
        report.add(Code::UnknownAssetMinorVersion, "asset.minVersion", format!("glTF {text} is read as glTF 2.0"));
    }
    true
}

fn one(version: &str, code: Code, report: &mut Report) -> bool {
    let version = crate::load::paths::shorten(version);
    report.add(code, "asset.version", format!("this is glTF {version}, which is not supported"));
    false
}

/// Reports a file without a version that has features of glTF 1.0; returns whether it has.
fn is_version_one(root: &Value, report: &mut Report) -> bool {
    let maps = ["buffers", "bufferViews", "accessors", "meshes", "nodes", "scenes", "techniques", "shaders"];
    let old = maps.iter().any(|name| root.get(name).is_some_and(Value::is_object));
    if old {
        one("1.0", Code::UnknownAssetMajorVersion, report);
    }
    old
}

/// Parses `2.0` as (2, 0).
fn numbers(version: &str) -> Option<(u32, u32)> {
    let digits = |s: &str| s.bytes().all(|b| b.is_ascii_digit()).then(|| s.parse().ok()).flatten();
    let (major, minor) = version.split_once('.')?;
    Some((digits(major)?, digits(minor)?))
}
