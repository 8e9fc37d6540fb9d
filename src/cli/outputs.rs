//! Destinations of pictures and of the files beside them, and their collisions.

use super::args::RenderArgs;
use super::camera::Choice;
use super::job::{Batch, Shot, Stats, UsageError, usage_error};
use super::output_name::{self, Fields, Naming};
use crate::image::FileKind;
use crate::load::Diagnostic;
use crate::load::paths::lexical;
use crate::render::Cost;
use std::collections::HashSet;
use std::fs;
use std::path::{Component, Path, PathBuf, absolute, is_separator};

/// Destination of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Standard output.
    Stdout,
    /// File that is replaced whatever it contains.
    Named(PathBuf),
    /// File name chosen by the program: only a picture written by meshray is replaced.
    Default(PathBuf),
}

impl Target {
    /// Restricts a target in one of these folders to replacing pictures written by meshray.
    pub(super) fn spares_beside(self, folders: &HashSet<PathBuf>) -> Self {
        match self {
            Self::Named(path) if !folders.is_empty() && folders.contains(&folder_of(&path)) => Self::Default(path),
            other => other,
        }
    }

    /// File path, if the target is a file.
    pub(super) fn path(&self) -> Option<&Path> {
        match self {
            Self::Stdout => None,
            Self::Named(path) | Self::Default(path) => Some(path),
        }
    }
}

/// Folder of a file in a unique spelling, with symbolic links resolved.
pub(super) fn folder_of(file: &Path) -> PathBuf {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = || lexical(&absolute(folder).unwrap_or_else(|_| folder.to_path_buf()));
    folder.canonicalize().unwrap_or_else(|_| written())
}

/// Folder that may be created for a picture, along with folders below it; its own parent must exist.
pub(super) type Growth = Option<PathBuf>;

/// Destination, file type and folder of the next picture.
pub(super) fn target(
    args: &RenderArgs,
    fields: &Fields,
    naming: Naming,
) -> Result<(Target, FileKind, Growth), UsageError> {
    let format = args.format.map(FileKind::from);
    let usual = |folder| output_name::default_template(folder, naming, format.unwrap_or(FileKind::Png).extension());
    let (template, kept): (String, fn(PathBuf) -> Target) = match args.output.as_deref() {
        Some("-") => return Ok((Target::Stdout, format.unwrap_or(FileKind::Png), None)),
        Some("") => return usage_error("-o needs a name"),
        Some(folder) if folder.ends_with(is_separator) || Path::new(folder).is_dir() => {
            (usual(Some(folder)), Target::Default)
        }
        Some(template) => (template.to_owned(), Target::Named),
        None => (name_again(args).unwrap_or_else(|| usual(None)), Target::Default),
    };
    let path = output_name::fill(&template, fields).map_err(UsageError)?;
    // Paths that lead out of the folder again do not create it.
    let holds = |base: &PathBuf| {
        let (base, path) = (lexical(base), lexical(&path));
        path.strip_prefix(&base).is_ok_and(|way| way.components().all(|part| matches!(part, Component::Normal(_))))
    };
    let growth = output_name::grows_in(&template, fields).map_err(UsageError)?.filter(holds);
    let kind = match (format, FileKind::from_path(&path)) {
        (Some(typed), Ok(named)) if typed != named => {
            let (path, format) = (path.display(), typed.extension());
            return usage_error(format!("{path} is called {named}, but --format says {format}; say it in one place"));
        }
        (Some(kind), _) | (None, Ok(kind)) => kind,
        (None, Err(e)) => return usage_error(format!("{e}, or say --format")),
    };
    Ok((kept(path), kind, growth))
}

/// Template for a repeated picture: the file name of the original.
fn name_again(args: &RenderArgs) -> Option<String> {
    let name = Path::new(args.again.as_ref()?.file_name()?);
    let kind = FileKind::from_path(name).ok()?;
    let fits = args.format.is_none_or(|format| FileKind::from(format) == kind);
    fits.then(|| name.to_str().map(output_name::escape)).flatten()
}

/// Files written beside each picture, named after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SideFiles<'a> {
    /// Costs shown by heat maps.
    pub heatmaps: &'a [Cost],
    /// Whether an interrupted picture is kept.
    pub partial: bool,
}

/// Destination of a heat map: `ship.png` -> `ship-tests.png`.
pub(super) fn heat_map(picture: &Target, cost: Cost) -> Option<Target> {
    let path = picture.path()?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    Some(Target::Default(path.with_file_name(format!("{stem}-{cost}.png"))))
}

/// Destination of an interrupted picture: `ship.png` -> `ship.partial.png`.
pub(super) fn partial(picture: &Target) -> Option<Target> {
    picture.path().map(|path| Target::Default(output_name::partial(path)))
}

/// Destinations of a picture and of the files beside it.
pub(super) fn of(shot: &Shot, beside: SideFiles) -> Vec<Target> {
    let maps = beside.heatmaps.iter().filter_map(|&cost| heat_map(&shot.target, cost));
    let partial = beside.partial.then(|| partial(&shot.target)).flatten();
    std::iter::once(shot.target.clone()).chain(maps).chain(partial).collect()
}

/// Files of these pictures and those beside them.
fn files<'a>(shots: impl Iterator<Item = &'a Shot>, beside: SideFiles) -> Vec<PathBuf> {
    shots.flat_map(|shot| of(shot, beside)).filter_map(|target| target.path().map(Path::to_path_buf)).collect()
}

/// Folder of a file, if it may be created for pictures.
pub(super) fn grows_with<'a>(batches: &'a [Batch], file: &Path) -> Option<&'a Path> {
    let folder = file.file_name().and_then(|_| file.parent())?;
    // Paths through a missing folder with `..` lead nowhere.
    let leads_back = folder.components().any(|part| part == Component::ParentDir);
    let whole = if leads_back { None } else { absolute(folder).ok() };
    let is_same = |growth: &&Path| *growth == folder || whole.is_some() && absolute(growth).ok() == whole;
    let growths = batches.iter().flat_map(|batch| &batch.shots).filter_map(|shot| shot.growth.as_deref());
    // The pictures of one command mostly share a folder.
    let mut growths: Vec<&Path> = growths.collect();
    growths.dedup();
    growths.into_iter().find(is_same)
}

/// Creates the folder of a picture if allowed.
pub(super) fn make_folder(shot: &Shot) -> Result<(), Diagnostic> {
    let folder = shot.growth.as_ref().and_then(|_| shot.target.path()?.parent());
    let Some(folder) = folder.filter(|folder| !folder.as_os_str().is_empty()) else { return Ok(()) };
    fs::create_dir_all(folder).map_err(|error| {
        Diagnostic::new("output-folder", folder, "", format!("cannot be made: {error}")).remedy("name another with -o")
    })
}

/// Refuses two pictures with the same file.
pub(super) fn refuse_collisions(batches: &[Batch]) -> Result<(), UsageError> {
    let shots: Vec<(&Path, &Shot)> =
        batches.iter().flat_map(|b| b.shots.iter().map(|s| (b.inputs[0].as_path(), s))).collect();
    let to_stdout = shots.iter().filter(|(_, s)| s.target == Target::Stdout).count();
    if to_stdout > 1 {
        let numbered = shots.iter().any(|(_, shot)| shot.step.number.is_some());
        let name = if numbered { "{stem}.{frame:04}.png" } else { "{stem}-{view}.png" };
        return usage_error(format!("{to_stdout} pictures cannot all go to standard output; use -o \"{name}\""));
    }
    let names: Vec<PathBuf> = shots.iter().filter_map(|(_, s)| s.target.path().map(Path::to_path_buf)).collect();
    let Some((a, b)) = output_name::collision(&names) else { return Ok(()) };
    let what = |i: usize| {
        let (input, Shot { choice, step, .. }) = shots[i];
        let view = (*choice != Choice::Default).then(|| choice.name());
        let parts: Vec<String> = view.into_iter().chain(step.number.map(|n| format!("number {n}"))).collect();
        let parts = if parts.is_empty() { String::new() } else { format!(" ({})", parts.join(", ")) };
        format!("{}{parts}", input.display())
    };
    if shots[a].0 == shots[b].0 && what(a) == what(b) {
        return usage_error(format!("{} is asked for twice; name it once", what(a)));
    }
    // The most common case is one model in two file types.
    let types = [a, b].map(|i| shots[i].0.extension());
    let example = if types[0] == types[1] { "" } else { ", as in 'thumbs/{sub}/{stem}.{ext}.png'" };
    usage_error(format!(
        "{} and {} would both be written to {}; use {{dir}}, {{sub}}, {{stem}}, {{ext}}, {{view}} or {{frame:04}} in -o{example}",
        what(a),
        what(b),
        names[b].display()
    ))
}

/// Checks that the files beside pictures do not collide.
pub(super) fn check_beside(batches: &[Batch], beside: SideFiles) -> Result<(), UsageError> {
    let shots = || batches.iter().flat_map(|b| &b.shots);
    let heatmaps = beside.heatmaps;
    if let Some(twice) = heatmaps.iter().enumerate().find(|(i, cost)| heatmaps[..*i].contains(cost)) {
        return usage_error(format!("--heatmap names {} twice", twice.1));
    }
    let to_stdout = shots().any(|s| s.target == Target::Stdout);
    if !heatmaps.is_empty() && to_stdout {
        return usage_error("a heat map is named after its picture, and standard output has no name; use -o NAME");
    }
    if beside.partial && to_stdout {
        let text = "--keep-partial names what it keeps after the picture, and standard output has no name; use -o NAME, \
                    or leave --keep-partial out";
        return usage_error(text);
    }
    let all = files(shots(), beside);
    match output_name::collision(&all) {
        Some((_, later)) => {
            usage_error(format!("two pictures would be written to {}; choose another -o", all[later].display()))
        }
        None => Ok(()),
    }
}

/// Checks that the statistics do not replace a picture or a file beside it.
pub(super) fn check_stats_file(stats: Option<&Stats>, batches: &[Batch], beside: SideFiles) -> Result<(), UsageError> {
    let Some(file) = stats.and_then(|stats| stats.file.as_deref()) else { return Ok(()) };
    let names = files(batches.iter().flat_map(|b| &b.shots), beside);
    let target = output_name::identity(file);
    if names.iter().any(|name| output_name::identity(name) == target) {
        let file = file.display();
        return usage_error(format!(
            "a picture and the statistics would both be written to {file}; name another --stats-file"
        ));
    }
    Ok(())
}
