//! `--again`: turns the settings stored in a picture back into a command line.
//!
//! Settings are stored as the flags that repeat them, with the values that were used (an `auto` depth as the depth it resolved
//! to). Since a picture may come from an untrusted source, only flags that shape pixels are taken from it: never names of
//! outputs, folders or limits.

use super::archives;
use super::args::{Cli, Command, LoadArgs, RenderArgs};
use super::camera::{Choice, LensChoice};
use super::exit::Exit;
use super::job::{Batch, Look, RenderJob, Shot};
use super::parse::{self, Env};
use super::picture::Effective;
use super::sampling;
use super::sequence::Sequence;
use super::stats::Counted;
use super::up_to_date;
use crate::accel::auto::Reason;
use crate::accel::{AccelKind, Assign, MailboxKind};
use crate::image::{ExrSamples, FileKind, ImageError, Metadata, PngDepth, read_metadata};
use crate::load::{Diagnostic, Loaded, MtlMode, Polygons};
use crate::math::DVec3;
use crate::number::hash;
use crate::render::Sampled;
use crate::scene::{Background, Environment, UpAxis};
use clap::Parser;
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// Flags that may be taken from a picture.
const FLAGS: [&str; 65] = [
    "size",
    "aa",
    "samples",
    "pixel-error",
    "target-error",
    "confidence",
    "min-samples",
    "max-samples",
    "filter",
    "error-space",
    "aa-split",
    "aa-threshold",
    "aa-depth",
    "aa-min-depth",
    "aperture",
    "focus",
    "depth",
    "cutoff",
    "seed",
    "view",
    "camera",
    "eye",
    "at",
    "up-vector",
    "fov",
    "ortho",
    "up",
    "background",
    "env",
    "env-rotate",
    "env-rays",
    "gloss-rays",
    "light-rays",
    "sun-size",
    "tone-map",
    "exposure",
    "bits",
    "float",
    "layers",
    "merge",
    "format",
    "scene",
    "animation",
    "time",
    "frame",
    "fps",
    "frames",
    "turntable",
    "variant",
    "polygons",
    "smooth",
    "line-width",
    "mtl",
    "accel",
    "intersector",
    "grid-density",
    "grid-resolution",
    "max-depth",
    "step-cost",
    "leaf-size",
    "grid-cells",
    "max-references",
    "assign",
    "mailbox",
    "allow-empty",
];

/// Everything about the making of a picture that its metadata records.
pub(super) struct Making<'a> {
    /// The whole job.
    pub job: &'a RenderJob,
    /// Inputs.
    pub batch: &'a Batch,
    /// Picture.
    pub shot: &'a Shot,
    /// Effective settings.
    pub effective: &'a Effective,
    /// Sampling results.
    pub sampled: &'a Sampled,
    /// Effective maximum depth.
    pub depth: u32,
    /// Kind of the structure used.
    pub accel: AccelKind,
    /// Reason for the structure, if it was chosen by counts.
    pub reason: Option<Reason>,
    /// Loaded scene.
    pub loaded: &'a Loaded,
}

impl Making<'_> {
    /// Names of the inputs, as typed.
    pub(super) fn inputs(&self) -> Vec<String> {
        self.batch.inputs.iter().map(|i| i.to_string_lossy().into_owned()).collect()
    }

    /// Hash of everything read.
    pub(super) fn hash(&self) -> String {
        hash(self.loaded.facts.hash)
    }

    /// Flags that render the same picture again.
    fn settings(&self) -> Map<String, Value> {
        let settings = &self.effective.settings;
        let mut flags = Map::new();
        let mut set = |flag: &str, value: String| drop(flags.insert(flag.into(), Value::String(value)));
        set("size", format!("{}x{}", settings.width, settings.height));
        sampling::flags(settings, &mut set);
        set("depth", self.depth.to_string());
        set("cutoff", settings.cutoff.to_string());
        set("seed", settings.seed.to_string());
        self.set_view(&mut set);
        self.set_surroundings(&mut set);
        self.set_written(&mut set);
        self.set_loading(&mut set);
        self.set_structure(&mut set);
        if settings.layers && !self.job.look.costs.is_empty() {
            let names: Vec<_> = self.job.look.costs.iter().map(|cost| cost.name()).collect();
            set("layers", names.join(","));
        }
        let is_exr = self.shot.kind == FileKind::Exr;
        let switches = [
            ("float", is_exr && self.effective.output.exr_samples == ExrSamples::Float),
            ("layers", settings.layers && self.job.look.costs.is_empty()),
            ("merge", self.batch.inputs.len() > 1),
            ("allow-empty", self.job.allow_empty),
        ];
        flags.extend(switches.into_iter().filter(|(_, on)| *on).map(|(flag, _)| (flag.into(), Value::Bool(true))));
        flags
    }
}

impl Making<'_> {
    /// Sets the flags of the camera.
    fn set_view(&self, mut set: impl FnMut(&str, String)) {
        match &self.shot.choice {
            Choice::Default => {}
            Choice::Named(view) => set("view", view.name().into()),
            Choice::Camera(name) => set("camera", name.clone()),
            Choice::Free { eye, at, up } => {
                set("eye", vector(*eye));
                at.iter().for_each(|at| set("at", vector(*at)));
                up.iter().for_each(|up| set("up-vector", vector(*up)));
            }
        }
        match self.job.look.lens {
            Some(LensChoice::Fov(radians)) => set("fov", degrees(radians)),
            Some(LensChoice::Ortho(height)) => set("ortho", height.map_or("auto".into(), |h| h.to_string())),
            None => {}
        }
    }

    /// Sets the flags of background, environment, and rays to environment and lamps.
    fn set_surroundings(&self, mut set: impl FnMut(&str, String)) {
        let (look, settings) = (&self.job.look, &self.effective.settings);
        match look.background {
            Some(Background::Transparent) => set("background", "transparent".into()),
            Some(Background::Environment) => set("background", "env".into()),
            Some(Background::Color(color)) => set("background", parse::color_text(color)),
            None => {}
        }
        match &look.env {
            Some(Env::BuiltIn(Environment::Studio)) => set("env", "studio".into()),
            Some(Env::BuiltIn(Environment::Black)) => set("env", "black".into()),
            Some(Env::BuiltIn(_)) => set("env", "white".into()),
            Some(Env::File(file)) => {
                set("env", file.to_string_lossy().into_owned());
                set("env-rotate", look.env_rotate.to_string());
            }
            None => {}
        }
        settings.env_rays.iter().for_each(|n| set("env-rays", n.to_string()));
        settings.gloss_rays.iter().for_each(|n| set("gloss-rays", n.to_string()));
        look.light_rays.iter().for_each(|n| set("light-rays", n.to_string()));
        look.sun_size.iter().for_each(|size| set("sun-size", size.to_string()));
    }

    /// Sets the flags of development and file format.
    fn set_written(&self, mut set: impl FnMut(&str, String)) {
        let output = &self.effective.output;
        set("tone-map", output.tone_map.name().into());
        set("exposure", output.exposure.to_string());
        set("format", self.shot.kind.extension().into());
        if self.shot.kind == FileKind::Png && output.png_depth == PngDepth::Sixteen {
            set("bits", "16".into());
        }
    }

    /// Sets the flags that select the part of the file, the moment, and the way of loading.
    fn set_loading(&self, mut set: impl FnMut(&str, String)) {
        let load = &self.job.load;
        load.up.iter().for_each(|up| set("up", if *up == UpAxis::Y { "y" } else { "z" }.into()));
        load.scene.iter().for_each(|scene| set("scene", scene.clone()));
        self.set_step(&mut set);
        load.variant.iter().for_each(|variant| set("variant", variant.clone()));
        if load.polygons == Polygons::Whole {
            set("polygons", "whole".into());
        }
        load.smooth.iter().for_each(|&lean| set("smooth", degrees(lean)));
        load.wire_widths.iter().for_each(|[width, _]| set("line-width", width.to_string()));
        if load.mtl == MtlMode::Literal {
            set("mtl", "literal".into());
        }
    }

    /// Sets the flags of acceleration structure and intersector.
    fn set_structure(&self, mut set: impl FnMut(&str, String)) {
        set("accel", self.accel.name().into());
        set("intersector", self.job.intersector.name().into());
        let params = &self.job.params;
        params.density.iter().for_each(|n| set("grid-density", n.to_string()));
        params.max_resolution.iter().for_each(|n| set("grid-resolution", n.to_string()));
        params.max_depth.iter().for_each(|n| set("max-depth", n.to_string()));
        params.step_cost.iter().for_each(|n| set("step-cost", n.to_string()));
        params.leaf_size.iter().for_each(|n| set("leaf-size", n.to_string()));
        params.grid_cells.iter().for_each(|[x, y, z]| set("grid-cells", format!("{x}x{y}x{z}")));
        params.max_references.iter().for_each(|n| set("max-references", n.to_string()));
        if params.assign != Assign::default() {
            set("assign", params.assign.name().into());
        }
        if params.mailbox != MailboxKind::default() {
            set("mailbox", params.mailbox.name().into());
        }
    }

    /// Sets the flags of the moment and of the sequence that determines the camera.
    fn set_step(&self, mut set: impl FnMut(&str, String)) {
        let step = &self.shot.step;
        let number = step.number.unwrap_or_default();
        if let Some(animation) = step.moment.as_ref().and_then(|moment| moment.animation.as_ref()) {
            set("animation", animation.clone());
        }
        if let Some(Sequence::Frames { frames, fps, .. }) = &self.job.sequence {
            set("frames", frames.to_string());
            set("frame", number.to_string());
            set("fps", fps.to_string());
        } else {
            step.moment.iter().for_each(|moment| set("time", moment.time.to_string()));
        }
        if let Some(Sequence::Turntable(turns)) = &self.job.sequence {
            set("turntable", format!("{number}/{}", turns.count));
        }
    }
}

fn vector(v: DVec3) -> String {
    format!("{},{},{}", v.x, v.y, v.z)
}

/// Degrees that convert back to exactly the same radians; the value as typed, if it has few digits.
fn degrees(radians: f64) -> String {
    let exact = radians.to_degrees();
    let typed = (exact * 1e9).round() / 1e9;
    if typed.to_radians() == radians { typed } else { exact }.to_string()
}

/// Metadata of a finished picture.
pub(super) fn metadata(making: &Making, counted: Option<&Counted>) -> Metadata {
    let metadata = Metadata::new()
        .with(Metadata::SETTINGS, Value::Object(making.settings()).to_string())
        .with(Metadata::INPUT, Value::from(making.inputs()).to_string())
        .with(Metadata::INPUT_HASH, making.hash());
    let made_of = match &making.job.again {
        // A repeated picture keeps the entry of its original.
        Some(_) => making.job.made_of.clone(),
        None if making.job.update => up_to_date::made_of(making.job, making.batch, making.shot, making.loaded),
        None => None,
    };
    let metadata = made_of.into_iter().fold(metadata, |metadata, text| metadata.with(Metadata::MADE_OF, text));
    match counted {
        Some(counted) => metadata.with(Metadata::COUNTS, counted.json().to_string()),
        None => metadata,
    }
}

/// Settings of a picture to repeat.
pub(super) struct Repeat {
    /// Command line that repeats the picture.
    pub args: RenderArgs,
    /// Hash that the inputs must have.
    pub hash: String,
    /// Hashes of what the picture was made of, as JSON, if stored.
    pub made_of: Option<String>,
    /// Warning if another version of meshray wrote the picture.
    pub warning: Option<Diagnostic>,
}

/// Command line that made `picture`, completed by `typed`: inputs, output, and how to run.
///
/// An error comes with the exit code of the command.
pub(super) fn repeat(picture: &Path, typed: &RenderArgs) -> Result<Repeat, (Box<Diagnostic>, Exit)> {
    let refuse = |text: String, exit| (Box::new(Diagnostic::new("again", picture, "", text)), exit);
    let metadata = read_metadata(picture).map_err(|error| match error {
        ImageError::Read { source, .. } => refuse(source.to_string(), Exit::Failed),
        other => refuse(other.to_string(), Exit::Input),
    })?;
    repeat_from(metadata, picture, typed).map_err(|fault| (Box::new(fault), Exit::Input))
}

fn repeat_from(metadata: Option<Metadata>, picture: &Path, typed: &RenderArgs) -> Result<Repeat, Diagnostic> {
    let fault = |text: String| Diagnostic::new("again", picture, "", text);
    let another = |fault: Diagnostic| fault.remedy("name a picture that meshray wrote");
    let metadata = metadata.ok_or_else(|| another(fault("was not written by meshray".into())))?;
    if metadata.get(Metadata::VERSION).is_some() && metadata.get(Metadata::SETTINGS).is_none() {
        let text =
            "does not say how it was made: it is what --keep-partial kept of a picture, or shows costs or differences";
        let fault = fault(text.into());
        return Err(fault.remedy("name a whole picture that meshray rendered"));
    }
    let entry =
        |key| metadata.get(key).ok_or_else(|| another(fault(format!("carries no {key}: it cannot be repeated"))));
    let settings: Map<String, Value> =
        serde_json::from_str(entry(Metadata::SETTINGS)?).map_err(|e| fault(format!("{}: {e}", Metadata::SETTINGS)))?;
    let inputs: Vec<String> =
        serde_json::from_str(entry(Metadata::INPUT)?).map_err(|e| fault(format!("{}: {e}", Metadata::INPUT)))?;
    let hash = entry(Metadata::INPUT_HASH)?.to_owned();

    let inputs: Vec<PathBuf> =
        if typed.inputs.is_empty() { inputs.iter().map(|i| found(i, picture)).collect() } else { typed.inputs.clone() };
    if typed.inputs.is_empty() && inputs.iter().any(|i| i == Path::new("-")) {
        return Err(fault("was made from standard input".into()).remedy("name the model, or `-`, before --again"));
    }
    let mut args = parse_settings(&settings).map_err(fault)?;
    if let Some(Env::File(panorama)) = &mut args.env {
        *panorama = found(&panorama.to_string_lossy(), picture);
    }
    let warning = entry(Metadata::VERSION).ok().filter(|v| *v != super::version::SHORT).map(|version| {
        let text =
            format!("written by meshray {version}; this is {}, which may draw it otherwise", super::version::SHORT);
        Diagnostic::new("again-version", picture, "", text)
    });
    let made_of = metadata.get(Metadata::MADE_OF).map(str::to_owned);
    Ok(Repeat { args: with_typed(args, inputs, typed), hash, made_of, warning })
}

/// Path of an input named by a picture: as named, or beside the picture. The hash will show whether it is the same.
fn found(input: &str, picture: &Path) -> PathBuf {
    let (named, folder) = (PathBuf::from(input), picture.parent().unwrap_or(Path::new("")));
    if input == "-" || archives::is_there(&named) {
        return named;
    }
    let beside = named.file_name().map(|name| folder.join(name));
    [Some(folder.join(&named)), beside].into_iter().flatten().find(|path| archives::is_there(path)).unwrap_or(named)
}

fn parse_settings(settings: &Map<String, Value>) -> Result<RenderArgs, String> {
    let mut words = vec!["meshray".to_owned(), "render".to_owned()];
    for (flag, value) in settings {
        if !FLAGS.contains(&flag.as_str()) {
            return Err(format!("carries a setting '{flag}' that is not known here"));
        }
        match value {
            Value::String(text) => words.push(format!("--{flag}={text}")),
            Value::Bool(true) => words.push(format!("--{flag}")),
            _ => return Err(format!("carries a setting '{flag}' that makes no sense")),
        }
    }
    // A placeholder for the real inputs, since the parser requires one.
    words.push("input".into());
    match Cli::try_parse_from(words).map(|cli| cli.command) {
        Ok(Command::Render(args)) => Ok(*args),
        Ok(_) => Err("carries no settings of a picture".into()),
        Err(e) => Err(format!("carries settings that are not understood: {}", e.kind())),
    }
}

/// Combines settings that shape pixels from the picture with everything else as typed. If the typed output name has another file
/// type, settings specific to the picture's own type are dropped.
fn with_typed(pixels: RenderArgs, inputs: Vec<PathBuf>, typed: &RenderArgs) -> RenderArgs {
    let named = typed.output.as_deref().and_then(|name| FileKind::from_path(Path::new(name)).ok());
    let kind = named.or(pixels.format.map(FileKind::from));
    let is = |wanted| kind.is_none_or(|kind| kind == wanted);
    let pixels = RenderArgs {
        format: if named.is_some() { None } else { pixels.format },
        bits: pixels.bits.filter(|_| is(FileKind::Png)),
        float: pixels.float && is(FileKind::Exr),
        layers: pixels.layers.filter(|_| is(FileKind::Exr)),
        ..pixels
    };
    RenderArgs {
        inputs,
        again: typed.again.clone(),
        output: typed.output.clone(),
        load: LoadArgs { root: typed.load.root.clone(), max_memory: typed.load.max_memory, ..pixels.load },
        keep_partial: typed.keep_partial,
        no_prune: typed.no_prune,
        instances: typed.instances,
        heatmap: typed.heatmap.clone(),
        heatmap_max: typed.heatmap_max,
        strict: typed.strict,
        threads: typed.threads,
        simd: typed.simd,
        profile: typed.profile,
        stats: typed.stats,
        stats_file: typed.stats_file.clone(),
        messages: typed.messages,
        quiet: typed.quiet,
        ..pixels
    }
}

/// Refuses inputs that differ from those of the picture. One hash covers all files read, so the changed one is not known.
pub(super) fn check_hash(expected: &str, loaded: &Loaded, inputs: &[PathBuf], look: &Look) -> Result<(), Diagnostic> {
    let found = hash(loaded.facts.hash);
    if found == expected {
        return Ok(());
    }
    let read = what_was_read(inputs, look);
    let text = format!("{read} has changed since the picture was made: hash {found}, the picture's is {expected}");
    let remedy = "bring back what was read then, or name the model that was rendered then";
    Err(Diagnostic::new("again-hash", &inputs[0], "", text).remedy(remedy))
}

/// Files covered by the hash of the inputs, in words.
fn what_was_read(inputs: &[PathBuf], look: &Look) -> String {
    let model = if inputs.len() > 1 { "one of the models" } else { "the model" };
    match &look.env {
        Some(Env::File(file)) => format!("{model}, a file that it names, or the panorama {}", file.display()),
        _ => format!("{model}, or a file that it names,"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn every_flag_a_picture_may_bring_is_a_flag() {
        let command = Cli::command();
        let render = command.find_subcommand("render").unwrap();
        for flag in FLAGS {
            assert!(render.get_arguments().any(|a| a.get_long() == Some(flag)), "{flag}");
        }
    }

    #[test]
    fn every_flag_that_shapes_pixels_is_stored_and_cannot_be_typed_beside_again() {
        // Folders and limits, treatment of warnings, a shorthand for settings that are stored one by one, and the storage of
        // instances.
        const EXEMPT: [&str; 5] = ["root", "max-memory", "strict", "quality", "instances"];
        const SHAPING: [&str; 6] = ["Loading", "Animation", "Camera", "Light and background", "Quality", "Structure"];
        let command = Cli::command();
        let render = command.find_subcommand("render").unwrap();
        let again = render.get_arguments().find(|a| a.get_id() == "again").unwrap();
        let refused = render.get_arg_conflicts_with(again);
        for flag in render.get_opts().filter(|a| a.get_help_heading().is_some_and(|h| SHAPING.contains(&h))) {
            let name = flag.get_long().unwrap();
            assert!(FLAGS.contains(&name) != EXEMPT.contains(&name), "{name}");
            let is_refused = refused.iter().any(|other| other.get_id() == flag.get_id());
            assert!(is_refused || !FLAGS.contains(&name), "{name}");
        }
    }

    #[test]
    fn every_other_flag_that_may_be_typed_beside_again_is_carried_on() {
        let words = "meshray render a.obj --output b.png --heatmap tests --heatmap-max 5 --keep-partial --root . \
                     --max-memory 1G --strict --instances flatten --no-prune --threads 3 --simd portable --stats json --stats-file s.json \
                     --profile --messages json --quiet";
        let command = Cli::command();
        let render = command.find_subcommand("render").unwrap();
        let again = render.get_arguments().find(|a| a.get_id() == "again").unwrap();
        let refuses = |one, other| render.get_arg_conflicts_with(one).contains(&other);
        let may_be_typed = |flag| flag != again && !refuses(again, flag) && !refuses(flag, again);
        for flag in render.get_opts().filter(|flag| may_be_typed(flag)) {
            let name = format!("--{}", flag.get_long().unwrap());
            assert!(words.split_whitespace().any(|word| word == name), "{name} is not tried");
        }
        let parsed = |words: &str| match Cli::try_parse_from(words.split_whitespace()).unwrap().command {
            Command::Render(args) => *args,
            other => panic!("{other:?}"),
        };
        let typed = parsed(words);
        let carried = with_typed(parsed("meshray render a.obj"), typed.inputs.clone(), &typed);
        assert_eq!(format!("{carried:?}"), format!("{typed:?}"));
    }

    #[test]
    fn a_picture_of_ours_that_does_not_say_how_it_was_made_is_not_taken_for_that_of_another_program() {
        let words = ["meshray", "render", "--again", "a.png"];
        let Ok(Command::Render(typed)) = Cli::try_parse_from(words).map(|cli| cli.command) else { panic!() };
        let told = |metadata| repeat_from(metadata, Path::new("a.png"), &typed).err().unwrap().to_string();
        assert!(told(None).contains("was not written by meshray"));
        let part = told(Some(Metadata::new()));
        assert!(part.contains("--keep-partial") && !part.contains("wrote"), "{part}");
    }

    #[test]
    fn angles_are_stored_as_they_were_typed() {
        for typed in [0.0, 0.1, 1.0, 29.3, 30.0, 45.7, 90.0, 179.0, 180.0_f64] {
            assert_eq!(degrees(typed.to_radians()), typed.to_string());
        }
        let odd = 0.1234567890123456_f64;
        assert!((degrees(odd).parse::<f64>().unwrap().to_radians() - odd).abs() < 1e-16);
    }

    #[test]
    fn settings_from_a_stranger_cannot_name_outputs_or_folders() {
        for flag in ["output", "root", "stats-file", "max-memory", "again"] {
            let settings = Map::from_iter([(flag.to_owned(), Value::String("/etc".into()))]);
            assert!(parse_settings(&settings).unwrap_err().contains(flag));
        }
    }

    #[test]
    fn settings_are_read_back_as_they_were_stored() {
        let stored =
            serde_json::json!({"size": "64x32", "eye": "-1,2,3.5", "ortho": "2.5", "layers": true, "camera": "-x"});
        let args = parse_settings(stored.as_object().unwrap()).unwrap();
        assert_eq!((args.size, args.eye), (Some((64, 32)), Some([-1.0, 2.0, 3.5])));
        assert_eq!((args.ortho, args.layers), (Some(parse::Ortho::Height(2.5)), Some(parse::CostList(Vec::new()))));
        assert_eq!(args.camera, ["-x"]);
    }
}
