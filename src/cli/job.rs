//! Validated job of a command line: all faults that can be found before any work are reported here.

use super::archives::on_disk;
use super::args::{AccelArgs, FileType, MessageFormat, RenderArgs, SpaceArg, StatsFormat};
use super::camera::{self, Choice, LensChoice};
use super::output_name::{Fields, Naming};
use super::outputs::{self, Growth, SideFiles, Target};
use super::parse::Env;
use super::sampling::SamplingArgs;
use super::sequence::{self, Sequence, Step};
use super::surroundings::EnvRead;
use super::{folders, message};
use crate::accel::{AccelChoice, AccelKind, AccelParams, IntersectorKind};
use crate::image::{ExrSamples, FileKind, PngDepth, ToneMap};
use crate::load::LoadOptions;
use crate::render::{Cost, Instancing};
use crate::scene::Background;
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// Fault in the command line: one line, exit code 2.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct UsageError(pub String);

/// Fails with a [`UsageError`] of this text.
pub(super) fn usage_error<T>(text: impl Into<String>) -> Result<T, UsageError> {
    Err(UsageError(text.into()))
}

/// Everything that `meshray render` is to do.
#[derive(Clone, Debug)]
pub(super) struct RenderJob {
    /// One scene each, in the order given.
    pub batches: Vec<Batch>,
    /// Options for loading, except for the moment, which each picture has itself.
    pub load: LoadOptions,
    /// Sequence that the pictures of a scene belong to, if any.
    pub sequence: Option<Sequence>,
    /// Settings of the picture from the command line; the rest comes from the scene or the defaults.
    pub look: Look,
    /// Acceleration structure.
    pub accel: AccelChoice,
    /// Parameters of the structure.
    pub params: AccelParams,
    /// Ray/triangle test.
    pub intersector: IntersectorKind,
    /// Treatment of instances; flattened if the structure supports nothing else.
    pub instances: Instancing,
    /// Number of threads; 0: all.
    pub threads: usize,
    /// Whether to run code paths that the scene does not need, too.
    pub no_prune: bool,
    /// Heat maps to write beside each picture.
    pub heatmaps: Vec<Cost>,
    /// Value of the heat maps' brightest colour; `None`: the maximum of all pixels.
    pub heatmap_max: Option<f64>,
    /// Statistics, if requested.
    pub stats: Option<Stats>,
    /// Whether a memory limit was typed.
    pub bounded: bool,
    /// Whether to report where the time went.
    pub profile: bool,
    /// Whether to print only warnings and errors.
    pub quiet: bool,
    /// Whether warnings are errors.
    pub strict: bool,
    /// Whether a scene with nothing to draw is accepted.
    pub allow_empty: bool,
    /// Whether to forecast pictures instead of rendering them.
    pub dry_run: bool,
    /// Whether to skip pictures that are up to date, and to store in the others what they are made of.
    pub update: bool,
    /// Whether to keep finished tiles on Ctrl-C.
    pub keep_partial: bool,
    /// Picture to repeat.
    pub again: Option<PathBuf>,
    /// Stored hashes of what that picture was made of, as JSON.
    pub made_of: Option<String>,
    /// Hash that the inputs must have (`--again`), in hexadecimal.
    pub expected_hash: Option<String>,
}

/// One scene and its pictures.
#[derive(Clone, Debug)]
pub(super) struct Batch {
    /// Files that make the scene; `-` is standard input.
    pub inputs: Vec<PathBuf>,
    /// Pictures of the scene, at least one.
    pub shots: Vec<Shot>,
}

/// One picture to render.
#[derive(Clone, Debug)]
pub(super) struct Shot {
    /// Choice of camera.
    pub choice: Choice,
    /// Position in the sequence, and the moment shown.
    pub step: Step,
    /// Output.
    pub target: Target,
    /// File type.
    pub kind: FileKind,
    /// Folder that may be created for the picture.
    pub growth: Growth,
}

/// Settings of the picture from the command line; `None` if not given.
#[derive(Clone, Debug, Default)]
pub(super) struct Look {
    /// Width and height in pixels.
    pub size: Option<(u32, u32)>,
    /// Sampling of pixels, and the lens.
    pub sampling: SamplingArgs,
    /// Maximum number of bounces after the primary ray.
    pub depth: Option<u32>,
    /// Weight below which a branch of the ray tree ends.
    pub cutoff: Option<f32>,
    /// Seed of every random stream.
    pub seed: u64,
    /// Field of view, or orthographic height.
    pub lens: Option<LensChoice>,
    /// Background.
    pub background: Option<Background>,
    /// Environment.
    pub env: Option<Env>,
    /// Environment once it is read.
    pub env_read: EnvRead,
    /// Rotation of the environment, in degrees.
    pub env_rotate: f64,
    /// Environment rays from each point.
    pub env_rays: Option<u32>,
    /// Number of rays that a rough surface spreads.
    pub gloss_rays: Option<u32>,
    /// Shadow rays to each area light.
    pub light_rays: Option<u32>,
    /// Angular diameter of directional lights, in degrees.
    pub sun_size: Option<f64>,
    /// Tone curve from scene light to display light.
    pub tone_map: Option<ToneMap>,
    /// Exposure, in stops.
    pub exposure: Option<f32>,
    /// Bits per channel of a PNG.
    pub png: PngDepth,
    /// Number format of EXR samples.
    pub exr: ExrSamples,
    /// Whether to add layers beside the beauty layer.
    pub layers: bool,
    /// Costs per pixel to add as further layers.
    pub costs: Vec<Cost>,
}

/// Statistics and their destination.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Stats {
    /// Text or JSON.
    pub format: StatsFormat,
    /// File; `None` for standard output.
    pub file: Option<PathBuf>,
}

impl RenderJob {
    /// Validates the arguments; accesses no file.
    pub(super) fn new(args: &RenderArgs) -> Result<Self, UsageError> {
        check_flags(args)?;
        args.sampling.check()?;
        if args.again.is_none() {
            args.sampling.check_target()?;
        }
        // Repeated pictures may carry parameters that had no effect.
        let kinds = if args.again.is_some() { &AccelKind::ALL[..] } else { args.accel.kinds() };
        let choices = choices(args)?;
        let sequence = sequence::of(args)?;
        let batches = batches(args, &choices, sequence.as_ref())?;
        let stats = stats(args);
        outputs::check_stats_file(stats.as_ref(), &batches, beside(args))?;
        let to_stdout = batches.iter().flat_map(|b| &b.shots).any(|s| s.target == Target::Stdout);
        if to_stdout && !args.dry_run && stats.as_ref().is_some_and(|s| s.file.is_none()) {
            return usage_error("the picture goes to standard output, so the statistics cannot; add --stats-file PATH");
        }
        Ok(Self {
            load: args.load.options(),
            look: look(args),
            params: params(&args.params, kinds)?,
            accel: args.accel,
            intersector: args.intersector,
            instances: instances(args)?,
            threads: usize::from(args.threads),
            no_prune: args.no_prune,
            heatmaps: args.heatmap.clone(),
            heatmap_max: args.heatmap_max,
            stats,
            bounded: args.load.max_memory.is_some(),
            profile: args.profile,
            quiet: args.quiet,
            strict: args.strict,
            allow_empty: args.allow_empty,
            dry_run: args.dry_run,
            update: args.update,
            keep_partial: args.keep_partial,
            again: None,
            made_of: None,
            expected_hash: None,
            sequence,
            batches,
        })
    }

    /// Files written beside each picture.
    pub(super) fn beside(&self) -> SideFiles<'_> {
        SideFiles { heatmaps: &self.heatmaps, partial: self.keep_partial }
    }

    /// File of the statistics, if any.
    pub(super) fn stats_file(&self) -> Option<&Path> {
        self.stats.as_ref()?.file.as_deref()
    }
}

/// Whether the choice of structure allows instances to be kept.
pub(super) fn keeps_instances(choice: AccelChoice) -> bool {
    match choice {
        AccelChoice::Auto => true,
        AccelChoice::Kind(kind) => kind.keeps_instances(),
    }
}

/// Checks the requested treatment of instances against structure and intersector.
fn instances(args: &RenderArgs) -> Result<Instancing, UsageError> {
    let able = keeps_instances(args.accel);
    let exact = args.intersector == IntersectorKind::Exact;
    match args.instances {
        Instancing::Keep if !able => usage_error(format!(
            "--instances keep: {} stores each instance by itself; use --accel fast-octree, fast-bvh or auto",
            args.accel
        )),
        Instancing::Keep if !exact => usage_error(format!(
            "--instances keep goes with the exact test alone, not with --intersector {}",
            args.intersector
        )),
        Instancing::Auto if !(able && exact) => Ok(Instancing::Flatten),
        how => Ok(how),
    }
}

/// Refuses to read standard input twice.
pub(super) fn check_stdin(inputs: &[PathBuf]) -> Result<(), UsageError> {
    let times = inputs.iter().filter(|input| input.as_path() == Path::new("-")).count();
    if times > 1 { usage_error("standard input (`-`) can be read only once") } else { Ok(()) }
}

fn check_flags(args: &RenderArgs) -> Result<(), UsageError> {
    check_stdin(&args.inputs)?;
    if args.inputs.is_empty() {
        return usage_error("no input; name a model");
    }
    if args.eye.is_none() && (args.at.is_some() || args.up_vector.is_some()) {
        return usage_error("--at and --up-vector belong to --eye; say where the camera stands");
    }
    camera::check_eye(args.eye, args.at)?;
    if args.eye.is_some() && !(args.view.is_empty() && args.camera.is_empty()) {
        return usage_error("--eye places the camera, so --view and --camera cannot; use one of them");
    }
    if args.merge && args.load.scene.is_some() {
        return usage_error("--scene chooses a scene of one file and cannot be used with --merge");
    }
    if args.merge && args.load.variant.is_some() {
        return usage_error("--variant chooses materials of one file and cannot be used with --merge");
    }
    if args.env_rotate.is_some() && !matches!(args.env, Some(Env::File(_))) {
        return usage_error("--env-rotate turns a picture; the built-in surroundings stay with the model");
    }
    if args.merge && args.load.moment.animation.is_some() {
        return usage_error("--animation chooses an animation of one file and cannot be used with --merge");
    }
    if args.profile && args.quiet && args.stats.is_none() {
        return usage_error("--profile tells where the time went, and --quiet silences it; leave one of them out");
    }
    if args.stats_file.is_some() && args.stats.is_none() && !args.dry_run {
        return usage_error("--stats-file needs --stats text or --stats json");
    }
    Ok(())
}

/// All requested views; the default one if none was.
fn choices(args: &RenderArgs) -> Result<Vec<Choice>, UsageError> {
    if let Some(eye) = args.eye {
        let (at, up) = (args.at.map(Into::into), args.up_vector.map(Into::into));
        return Ok(vec![Choice::Free { eye: eye.into(), at, up }]);
    }
    let mut choices: Vec<Choice> = args.view.iter().map(|view| Choice::Named(*view)).collect();
    choices.extend(args.camera.iter().map(|name| Choice::Camera(name.clone())));
    if choices.is_empty() {
        choices.push(Choice::Default);
    }
    Ok(choices)
}

fn batches(args: &RenderArgs, choices: &[Choice], sequence: Option<&Sequence>) -> Result<Vec<Batch>, UsageError> {
    let steps = sequence::steps(args, sequence)?;
    let groups: Vec<Vec<PathBuf>> =
        if args.merge { vec![args.inputs.clone()] } else { args.inputs.iter().map(|i| vec![i.clone()]).collect() };
    // A name made from a model's name may be that of a file belonging to another model.
    let is_made = args.output.as_deref().is_some_and(|name| name.contains('{'));
    let sources: HashSet<PathBuf> =
        args.inputs.iter().filter(|_| is_made).map(|input| outputs::folder_of(on_disk(input))).collect();
    let mut batches = Vec::new();
    let mut frame = 0;
    for inputs in groups {
        // A picture of several models belongs to the folder of none.
        let sub = if args.merge { PathBuf::new() } else { folders::way_below(&args.folders, &inputs[0]) };
        let mut shots = Vec::new();
        for (step, choice) in steps.iter().flat_map(|step| choices.iter().map(move |choice| (step, choice))) {
            frame += 1;
            let fields =
                Fields { input: &inputs[0], sub: &sub, view: &choice.name(), frame: step.number.unwrap_or(frame) };
            let (several_views, numbered) = (choices.len() > 1, step.number.is_some());
            let naming = Naming { several_views, numbered, mirrors: !sub.as_os_str().is_empty() };
            let (target, kind, growth) = outputs::target(args, &fields, naming)?;
            let target = target.spares_beside(&sources);
            shots.push(Shot { choice: choice.clone(), step: step.clone(), target, kind, growth });
        }
        batches.push(Batch { inputs, shots });
    }
    outputs::refuse_collisions(&batches)?;
    outputs::check_beside(&batches, beside(args))?;
    check_kinds(args, &batches)?;
    Ok(batches)
}

fn beside(args: &RenderArgs) -> SideFiles<'_> {
    SideFiles { heatmaps: &args.heatmap, partial: args.keep_partial }
}

/// Refuses sizes that a file type cannot hold, and flags that only one file type honours.
fn check_kinds(args: &RenderArgs, batches: &[Batch]) -> Result<(), UsageError> {
    if let Some((width, height)) = args.size {
        for shot in batches.iter().flat_map(|b| &b.shots) {
            shot.kind.fits(width, height).map_err(|e| UsageError(e.to_string()))?;
        }
    }
    let all = |kind| batches.iter().flat_map(|b| &b.shots).all(|s| s.kind == kind);
    if (args.layers.is_some() || args.float || args.half) && !all(FileKind::Exr) {
        return usage_error("--layers, --half and --float belong to EXR; use -o NAME.exr or --format exr");
    }
    if args.bits == Some(16) && !all(FileKind::Png) {
        return usage_error("--bits 16 belongs to PNG; an EXR stores floats, the other types 8 bits");
    }
    if args.bits.is_some() && all(FileKind::Exr) {
        return usage_error("--bits belongs to PNG; an EXR stores floats, of 16 bits, or 32 with --float");
    }
    // A repeated picture carries both flags in any case; and errors may be measured in display colours.
    let serves = args.again.is_some() || args.sampling.error_space == Some(SpaceArg::Display);
    if (args.tone_map.is_some() || args.exposure.is_some()) && all(FileKind::Exr) && !serves {
        return usage_error(
            "--tone-map and --exposure make colours for a display; an EXR keeps the light as it is (with --error-space display \
             its errors are counted in them)",
        );
    }
    Ok(())
}

fn look(args: &RenderArgs) -> Look {
    Look {
        size: args.size,
        sampling: args.sampling.clone(),
        depth: args.depth,
        cutoff: args.cutoff,
        seed: args.seed,
        lens: LensChoice::new(args.fov, args.ortho),
        background: args.background,
        env: args.env.clone(),
        env_read: EnvRead::default(),
        env_rotate: args.env_rotate.unwrap_or(0.0),
        env_rays: args.env_rays,
        gloss_rays: args.gloss_rays,
        light_rays: args.light_rays,
        sun_size: args.sun_size,
        tone_map: args.tone_map,
        exposure: args.exposure,
        png: if args.bits == Some(16) { PngDepth::Sixteen } else { PngDepth::Eight },
        exr: if args.float { ExrSamples::Float } else { ExrSamples::Half },
        layers: args.layers.is_some(),
        costs: args.layers.as_ref().map_or(Vec::new(), |list| list.0.clone()),
    }
}

/// Validated parameters of the structures that may be built.
pub(super) fn params(args: &AccelArgs, kinds: &[AccelKind]) -> Result<AccelParams, UsageError> {
    args.check_use(kinds).map_err(UsageError)?;
    let params = AccelParams {
        density: args.grid_density,
        max_resolution: args.grid_resolution,
        max_depth: args.max_depth,
        step_cost: args.step_cost,
        leaf_size: args.leaf_size,
        grid_cells: args.grid_cells,
        max_references: args.max_references,
        assign: args.assign,
        thickness: 0.0,
        mailbox: args.mailbox,
    };
    params.validate().map_err(|e| UsageError(e.to_string()))?;
    Ok(params)
}

fn stats(args: &RenderArgs) -> Option<Stats> {
    let file = args.stats_file.clone().filter(|f| f.as_path() != Path::new("-"));
    // A dry run reports its forecast in any case.
    let format = args.stats.or((args.dry_run && file.is_some()).then_some(StatsFormat::Text));
    format.map(|format| Stats { format, file })
}

impl From<FileType> for FileKind {
    fn from(typed: FileType) -> Self {
        match typed {
            FileType::Png => Self::Png,
            FileType::Exr => Self::Exr,
            FileType::Jpg => Self::Jpeg,
            FileType::Webp => Self::Webp,
        }
    }
}

impl From<MessageFormat> for message::Format {
    fn from(typed: MessageFormat) -> Self {
        match typed {
            MessageFormat::Text => Self::Text,
            MessageFormat::Json => Self::Json,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::{Cli, Command};
    use clap::Parser;

    fn job(line: &str) -> Result<RenderJob, UsageError> {
        let words = ["meshray", "render"].into_iter().chain(line.split(' '));
        match Cli::try_parse_from(words).unwrap().command {
            Command::Render(args) => RenderJob::new(&args),
            other => panic!("{other:?}"),
        }
    }

    fn outputs(line: &str) -> Vec<Target> {
        job(line).unwrap().batches.into_iter().flat_map(|b| b.shots).map(|s| s.target).collect()
    }

    #[test]
    fn pictures_go_to_the_current_folder_under_the_stem() {
        assert_eq!(outputs("some/where/a.glb"), [Target::Default("a.png".into())]);
        assert_eq!(outputs("x/a.glb x/b.obj -o {stem}.exr"), ["a.exr", "b.exr"].map(|n| Target::Named(n.into())));
        assert_eq!(outputs("a.glb -o out/"), [Target::Default("out/a.png".into())]);
        assert_eq!(outputs("a.glb --format exr"), [Target::Default("a.exr".into())]);
        assert_eq!(outputs("a.glb -o -"), [Target::Stdout]);
        assert_eq!(outputs("a.glb -o a.tmp --format exr"), [Target::Named("a.tmp".into())]);
        assert_eq!(outputs("a.glb -o a.JPEG --format jpg"), [Target::Named("a.JPEG".into())]);
    }

    #[test]
    fn several_views_are_told_apart_by_name() {
        let expected = ["a-front.png", "a-iso.png", "a-Left eye.png"].map(|n| Target::Default(n.into()));
        let words = ["meshray", "render", "a.glb", "--view", "front,iso", "--camera", "Left eye"];
        let Command::Render(args) = Cli::try_parse_from(words).unwrap().command else { panic!("not render") };
        let job = RenderJob::new(&args).unwrap();
        assert_eq!(job.batches[0].shots.iter().map(|s| s.target.clone()).collect::<Vec<_>>(), expected);
    }

    #[test]
    fn a_picture_that_carries_a_parameter_that_did_nothing_is_repeated() {
        let words = ["meshray", "render", "a.obj", "-o", "b.png", "--grid-density", "2"];
        let Command::Render(mut args) = Cli::try_parse_from(words).unwrap().command else { panic!("not render") };
        assert!(RenderJob::new(&args).is_err());
        args.again = Some("a.png".into());
        assert!(RenderJob::new(&args).is_ok());
    }

    #[test]
    fn what_makes_colours_for_a_display_is_refused_where_all_pictures_keep_the_light() {
        for flag in ["--exposure 1", "--tone-map aces"] {
            let UsageError(text) = job(&format!("a.glb -o a.exr {flag}")).unwrap_err();
            assert!(text.contains("EXR keeps the light"), "{flag}: {text}");
            assert!(job(&format!("a.glb -o a.png {flag}")).is_ok());
        }
        assert!(job("a.glb -o a.exr").is_ok());
        assert!(job("a.glb -o a.exr --error-space display --exposure 1").is_ok());
    }

    #[test]
    fn two_pictures_of_one_name_are_refused_before_any_work() {
        for line in ["x/a.obj y/a.glb", "a.obj b.obj -o c.png", "a.obj --view front,back -o a.png", "a.obj ./a.obj"] {
            let UsageError(text) = job(line).unwrap_err();
            assert!(text.contains("would both be written to"), "{line}: {text}");
        }
        assert!(job("x/a.obj y/a.glb -o {frame:04}.png").is_ok());
        assert!(job("x/a.obj y/a.glb --merge").is_ok());
        assert!(job("a.obj b.obj -o -").is_err());
    }

    #[test]
    fn names_made_of_those_of_models_spare_what_lies_beside_any_of_them() {
        let named = |line: &str| outputs(line).into_iter().map(|t| matches!(t, Target::Named(_))).collect::<Vec<_>>();
        assert_eq!(named("x/a.obj b.obj -o {stem}.png"), [false, false]);
        assert_eq!(named("x/a.obj x/b.obj -o {dir}/{stem}.png"), [false, false]);
        assert_eq!(named("x/a.obj x/b.obj -o thumbs/{stem}.png"), [true, true]);
        assert_eq!(named("a.obj -o a.png"), [true], "a name that was typed is meant");
    }

    #[test]
    fn pictures_of_a_sequence_are_numbered() {
        let named = |names: &[&str]| names.iter().map(|n| Target::Default((*n).into())).collect::<Vec<_>>();
        assert_eq!(outputs("a.glb --frames 9..11"), named(&["a.0009.png", "a.0010.png"]));
        assert_eq!(outputs("a.glb --frames 0..3 --frame 2"), named(&["a.0002.png"]));
        assert_eq!(outputs("a.glb --turntable 2"), named(&["a.0000.png", "a.0001.png"]));
        assert_eq!(outputs("a.glb --turntable 7/36"), named(&["a.0007.png"]));
        let both = ["a-front.0001.png", "a-top.0001.png"];
        assert_eq!(outputs("a.glb --frames 1..=1 --view front,top"), named(&both));
        let job = job("a.glb --frames 12..14 --fps 48 --animation Run").unwrap();
        let moments = job.batches[0].shots.iter().map(|s| s.step.moment.clone().unwrap());
        assert_eq!(moments.map(|m| (m.animation.unwrap(), m.time)).next(), Some(("Run".into(), 0.25)));
    }

    #[test]
    fn what_is_only_foretold_leaves_standard_output_to_statistics() {
        assert!(job("a.obj -o - --stats json --dry-run").is_ok());
    }

    #[test]
    fn contradictions_are_refused() {
        for line in [
            "a.obj --at 0,0,0",
            "a.obj --eye 1,1,1 --at 1,1,1",
            "a.obj --eye 1,1,1 --up-vector 0,0,0",
            "a.obj --eye 1,1,1 --view front",
            "- -",
            "a.obj -o picture.tif",
            "a.obj -o picture.jpg --format png",
            "a.obj -o - --stats json",
            "a.obj --profile -q",
            "a.obj -o a.exr --bits 8",
            "a.obj --stats-file s.json",
            "a.obj -o a.png --stats json --stats-file ./a.png",
            "a.obj --heatmap tests --stats json --stats-file a-tests.png",
            "a.obj --grid-density 0 --accel grid",
            "a.obj --grid-density 2",
            "a.obj --mailbox none --accel bvh",
            "a.obj --leaf-size 8 --accel grid",
            "a.obj --grid-cells 2x2x2 --accel octree",
            "a.obj --assign box --accel fast-bvh",
            "a.obj --layers",
            "a.obj --layers=tests",
            "a.obj -o - --heatmap tests",
            "a.obj --heatmap tests,tests",
            "a.obj a-tests.obj --heatmap tests",
            "a.obj -o a.jpg --bits 16",
            "a.obj -o a.webp --size 16385x1",
            "a.obj --format webp --size 1x16385 --dry-run",
            "a.obj --env studio --env-rotate 90",
            "a.glb --fps 30",
            "a.glb --frames 0..3 --turntable 4",
            "a.glb --frames 0..3 --time 1",
            "a.glb --frames 0..3 --frame 3",
            "a.glb --frames 0..3 -o a.png",
            "a.glb --turntable 3 -o -",
            "- --frames 0..3",
            "a.glb b.glb --merge --animation Run",
        ] {
            // Some contradictions are found by the parser, others by the job.
            let words = ["meshray", "render"].into_iter().chain(line.split(' '));
            match Cli::try_parse_from(words) {
                Err(error) => assert_ne!(error.kind(), clap::error::ErrorKind::UnknownArgument, "{line}"),
                Ok(_) => assert!(job(line).is_err(), "{line}"),
            }
        }
    }
}
