//! Names of pictures: templates, defaults, and collisions.
//!
//! Template fields are `{dir}` (the input's folder), `{sub}` (path to it from the folder that was named; if they are the same, it
//! and a following slash vanish), `{stem}` (file name without extension), `{ext}` (extension), `{view}` and `{frame}` (number of
//! the picture: in its sequence, or else in this run, from 1; `{frame:04}` pads it with zeros). `{{` and `}}` are literal braces.

use crate::image::destination;
use crate::load::paths::lexical;
use crate::load::suggest::nearest;
use std::collections::HashMap;
use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf, is_separator};

/// Values of the fields of a template.
#[derive(Clone, Debug)]
pub(super) struct Fields<'a> {
    /// The input, or `-`.
    pub input: &'a Path,
    /// Path to the input's folder from the one that was named.
    pub sub: &'a Path,
    /// Name of the view or camera.
    pub view: &'a str,
    /// Number of the picture: in its sequence, or else in this run, from 1.
    pub frame: u32,
}

const FIELDS: [&str; 6] = ["dir", "sub", "stem", "ext", "view", "frame"];

/// The input's name without folder and extension; `stdin` for `-`.
pub(super) fn stem(input: &Path) -> OsString {
    if input == Path::new("-") {
        return "stdin".into();
    }
    input.file_stem().map_or_else(|| "picture".into(), OsStr::to_os_string)
}

/// Fills a template. Errors name the unknown field.
pub(super) fn fill(template: &str, fields: &Fields) -> Result<PathBuf, String> {
    filled(template, fields, |_| false).map(|(name, _)| PathBuf::from(name))
}

/// Folder below which a template may create folders: the part before its first field other than `{dir}`, whose folder exists.
/// `None` for a template without such fields.
pub(super) fn grows_in(template: &str, fields: &Fields) -> Result<Option<PathBuf>, String> {
    let (mut before, found) = filled(template, fields, |field| field != "dir")?;
    // Makes the last component a file name even if the text ends in a separator.
    before.push("x");
    let folder = Path::new(&before).parent().filter(|folder| !folder.as_os_str().is_empty());
    Ok(found.then(|| folder.unwrap_or(Path::new(".")).to_path_buf()))
}

/// Fills a template up to the first field for which `ends` holds, and returns whether there was one.
fn filled(template: &str, fields: &Fields, ends: impl Fn(&str) -> bool) -> Result<(OsString, bool), String> {
    let mut name = OsString::new();
    let mut rest = template;
    while let Some(at) = rest.find(['{', '}']) {
        name.push(&rest[..at]);
        let tail = &rest[at..];
        if let Some(after) = tail.strip_prefix("{{").or_else(|| tail.strip_prefix("}}")) {
            name.push(&tail[..1]);
            rest = after;
        } else if let Some((field, after)) = tail.strip_prefix('{').and_then(|t| t.split_once('}')) {
            if ends(field) {
                return Ok((name, true));
            }
            let value = value(field, fields)?;
            name.push(&value);
            // An empty path is no folder.
            rest = if value.is_empty() && field == "sub" {
                after.strip_prefix(is_separator).unwrap_or(after)
            } else {
                after
            };
        } else {
            return Err(format!("`{template}`: a brace without its partner; write {{{{ or }}}} for a plain brace"));
        }
    }
    name.push(rest);
    Ok((name, false))
}

fn value(field: &str, fields: &Fields) -> Result<OsString, String> {
    let (name, width) = field.split_once(':').unwrap_or((field, ""));
    if name != "frame" && !width.is_empty() {
        return Err(format!("`{{{field}}}`: only {{frame}} takes a width, as in {{frame:04}}"));
    }
    match name {
        "dir" => Ok(folder(fields.input)),
        "sub" => Ok(fields.sub.into()),
        "stem" => Ok(stem(fields.input)),
        "ext" => Ok(fields.input.extension().unwrap_or_default().into()),
        "view" => Ok(fields.view.replace(is_of_no_name, "_").into()),
        "frame" => {
            let width: usize = if width.is_empty() { 0 } else { width.parse().map_err(|_| bad_width(field))? };
            if width > 20 { Err(bad_width(field)) } else { Ok(format!("{:0width$}", fields.frame).into()) }
        }
        _ => {
            let hint = nearest(name, FIELDS).map_or_else(String::new, |n| format!("; did you mean {{{n}}}?"));
            Err(format!(
                "`{{{field}}}` is not a known field; use {{dir}}, {{sub}}, {{stem}}, {{ext}}, {{view}} or {{frame:04}}{hint}"
            ))
        }
    }
}

/// Whether a character cannot occur in a file name, or would change its folder. On Windows, the part after a colon names a stream
/// that few programs show.
fn is_of_no_name(c: char) -> bool {
    matches!(c, '/' | '\\' | '\0') || cfg!(windows) && (c.is_control() || "<>:\"|?*".contains(c))
}

fn bad_width(field: &str) -> String {
    format!("`{{{field}}}`: the width is a number from 1 to 20, as in {{frame:04}}")
}

fn folder(input: &Path) -> OsString {
    input.parent().filter(|parent| !parent.as_os_str().is_empty()).map_or_else(|| ".".into(), Into::into)
}

/// Parts that a name needs to distinguish the pictures of one input.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Naming {
    /// Whether there are several views or cameras.
    pub several_views: bool,
    /// Whether pictures belong to a sequence.
    pub numbered: bool,
    /// Whether the input's folder below the named one is reproduced.
    pub mirrors: bool,
}

/// Template used if none is given, or only a folder.
pub(super) fn default_template(folder: Option<&str>, naming: Naming, extension: &str) -> String {
    let name = match (naming.several_views, naming.numbered) {
        (false, false) => "{stem}",
        (true, false) => "{stem}-{view}",
        (false, true) => "{stem}.{frame:04}",
        (true, true) => "{stem}-{view}.{frame:04}",
    };
    let sub = if naming.mirrors { "{sub}/" } else { "" };
    match folder {
        Some(folder) => format!("{}/{sub}{name}.{extension}", escape(folder.trim_end_matches(is_separator))),
        None => format!("{sub}{name}.{extension}"),
    }
}

/// Escapes braces, so that the filled template equals `plain`.
pub(super) fn escape(plain: &str) -> String {
    plain.replace('{', "{{").replace('}', "}}")
}

/// Indices of the first two `names` that denote one file.
pub(super) fn collision(names: &[PathBuf]) -> Option<(usize, usize)> {
    let mut seen = HashMap::new();
    names.iter().enumerate().find_map(|(i, name)| seen.insert(identity(name), i).map(|earlier| (earlier, i)))
}

/// Unique spelling of a file's path, with symbolic links resolved; the file need not exist. Hard links count as different files,
/// since writing replaces one name and leaves the other.
pub(super) fn identity(name: &Path) -> PathBuf {
    let name = &destination(name);
    if name.exists() {
        return in_one_case(name.clone());
    }
    let parent = name.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let parent = parent.canonicalize().unwrap_or_else(|_| lexical(parent));
    in_one_case(parent.join(name.file_name().unwrap_or_default()))
}

/// Whether names that differ in case denote the same file, as on most disks of these systems.
const CASE_IS_IGNORED: bool = cfg!(any(windows, target_os = "macos"));

fn in_one_case(name: PathBuf) -> PathBuf {
    if CASE_IS_IGNORED { name.to_string_lossy().to_lowercase().into() } else { name }
}

/// Name of an interrupted picture: `shot.png` -> `shot.partial.png`, `shot` -> `shot.partial`.
pub(super) fn partial(name: &Path) -> PathBuf {
    let extension = name.extension().map(|e| format!(".{}", e.to_string_lossy())).unwrap_or_default();
    name.with_extension(format!("partial{extension}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(input: &str) -> Fields<'_> {
        Fields { input: Path::new(input), sub: Path::new("b/c"), view: "front", frame: 7 }
    }

    #[test]
    fn every_field_is_filled() {
        let name = fill("{dir}/{stem}-{view}.{frame:04}.{frame}.png", &fields("a/b/ship.v2.obj")).unwrap();
        assert_eq!(name, Path::new("a/b/ship.v2-front.0007.7.png"));
        assert_eq!(fill("{dir}/x", &fields("ship.obj")).unwrap(), Path::new("./x"));
        assert_eq!(fill("{stem}.png", &fields("-")).unwrap(), Path::new("stdin.png"));
        assert_eq!(fill("{stem}.{ext}.png", &fields("a/ship.v2.obj")).unwrap(), Path::new("ship.v2.obj.png"));
    }

    #[cfg(unix)]
    #[test]
    fn names_that_are_no_text_stay_as_they_are() {
        use std::os::unix::ffi::OsStringExt;
        let name = |letters: &[u8]| PathBuf::from(OsString::from_vec(letters.to_vec()));
        let (input, sub) = (name(b"\xf1/\xf2.obj"), name(b"\xf3"));
        let fields = Fields { input: &input, sub: &sub, ..fields("") };
        assert_eq!(fill("{dir}/{sub}/{stem}.png", &fields).unwrap(), name(b"\xf1/\xf3/\xf2.png"));
        assert_eq!(grows_in("{dir}/{sub}/{stem}.png", &fields).unwrap(), Some(name(b"\xf1")));
    }

    #[test]
    fn doubled_braces_are_plain_ones() {
        assert_eq!(fill("{{{stem}}}.png", &fields("a.obj")).unwrap(), Path::new("{a}.png"));
    }

    #[test]
    fn an_unknown_field_names_the_nearest() {
        let error = fill("{steam}.png", &fields("a.obj")).unwrap_err();
        assert!(error.contains("did you mean {stem}?"), "{error}");
        assert!(fill("{stem.png", &fields("a.obj")).is_err());
        assert!(fill("{frame:9999}", &fields("a.obj")).is_err());
        assert!(fill("{stem:04}", &fields("a.obj")).is_err());
    }

    #[test]
    fn a_camera_name_cannot_lead_out_of_the_folder() {
        let fields = Fields { view: "../../etc/x", ..fields("a.obj") };
        assert_eq!(fill("{view}.png", &fields).unwrap(), Path::new(".._.._etc_x.png"));
    }

    #[test]
    fn two_spellings_of_one_file_collide() {
        let names = ["a.png", "b.png", "./nowhere/../a.png"].map(PathBuf::from);
        // Except on Windows, `..` of a missing folder leads nowhere.
        assert_eq!(collision(&names), cfg!(windows).then_some((0, 2)));
        let names = ["a.png", "b.png", "src/../a.png"].map(PathBuf::from);
        assert_eq!(collision(&names), Some((0, 2)));
        assert_eq!(collision(&[PathBuf::from("a.png"), PathBuf::from("b.png")]), None);
        let names = ["to-come/a.png", "to-come/A.png"].map(PathBuf::from);
        assert_eq!(collision(&names), CASE_IS_IGNORED.then_some((0, 1)));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_and_what_it_leads_to_are_one_file() {
        let dir = tempfile::tempdir().unwrap();
        let names = ["real.stl", "link.png"].map(|name| dir.path().join(name));
        assert_eq!(collision(&names), None);
        std::fs::write(&names[0], "precious").unwrap();
        std::os::unix::fs::symlink(&names[0], &names[1]).unwrap();
        assert_eq!(collision(&names), Some((0, 1)));
        let to_come = ["to-come.png", "another.png"].map(|name| dir.path().join(name));
        std::os::unix::fs::symlink("to-come.png", &to_come[1]).unwrap();
        assert_eq!(collision(&to_come), Some((0, 1)), "also before there is a file");
    }

    #[test]
    fn a_folder_with_braces_is_taken_literally() {
        let naming = Naming { several_views: true, ..Naming::default() };
        let template = default_template(Some("{x}/"), naming, "exr");
        assert_eq!(fill(&template, &fields("a.obj")).unwrap(), Path::new("{x}/a-front.exr"));
        let template = default_template(Some("{x}/"), Naming { mirrors: true, ..naming }, "exr");
        assert_eq!(fill(&template, &fields("a.obj")).unwrap(), Path::new("{x}/b/c/a-front.exr"));
        assert_eq!(grows_in(&template, &fields("a.obj")), Ok(Some("{x}".into())));
    }

    #[test]
    fn folders_grow_where_the_fields_of_a_template_begin() {
        let grows_in = |template: &str| grows_in(template, &fields("a/b.obj")).unwrap();
        assert_eq!(grows_in("{sub}/{stem}.png"), Some(".".into()));
        assert_eq!(grows_in("/{sub}/{stem}.png"), Some("/".into()));
        assert_eq!(grows_in("x/{view}/of-{sub}/{stem}.png"), Some("x".into()));
        assert_eq!(grows_in("x/of-{stem}.png"), Some("x".into()));
        assert_eq!(grows_in("x/{{sub}}/{stem}.png"), Some("x/{sub}".into()), "plain braces");
        assert_eq!(grows_in("{dir}/{stem}.png"), Some("a".into()));
        assert_eq!(grows_in("{dir}/x/{stem}.png"), Some("a/x".into()));
        assert_eq!(grows_in("{dir}/x.png"), None);
        assert_eq!(grows_in("x/y.png"), None);
    }

    #[test]
    fn in_the_folder_that_was_named_itself_there_is_no_way() {
        let here = Fields { sub: Path::new(""), ..fields("a.obj") };
        for (template, expected) in
            [("{sub}/{stem}.png", "a.png"), ("x/{sub}/{stem}.png", "x/a.png"), ("of-{sub}.png", "of-.png")]
        {
            assert_eq!(fill(template, &here).unwrap(), Path::new(expected));
        }
    }

    #[test]
    fn a_partial_picture_keeps_its_type() {
        assert_eq!(partial(Path::new("a/b.exr")), Path::new("a/b.partial.exr"));
    }
}
