//! `meshray diff`: differences of two pictures, in numbers and as a picture.
//!
//! # Schema `meshray-diff/1`
//! One JSON object: `version`, `expected`, `actual` (as typed), `width`, `height`, `space` (`display` or `linear`), `channels`
//! (3, or 4 with coverage), `rmse`, `relative_rmse`, `bias`, `max`, `worst` (`x`, `y`, `expected`, `actual`: the values
//! compared), `psnr`, `threshold`, `pixels_over`, `pixels`, `flip` (`mean`, `max`, `worst` with `x` and `y`, `pixels_per_degree`,
//! and for linear pictures `exposures` with `first`, `last` in stops and `count`), `layers` (`name`, `rmse`, `max`, `differing`,
//! `of_one` (finite in only one file, excluded from `rmse`), `values`; in layers of ids, such as `id.prim`, a difference counts
//! 1), `layers_of_one` (names), `left_out` (parts of the files that are not read), `broken` (limits of `--fail-if`). Non-finite
//! values are null. Keys are only ever added.

mod args;
mod limit;
mod report;

use super::exit::Exit;
use super::message::{Messages, Severity};
use super::writable::{self, Sources};
use super::{interrupt, output_name, panics};
use crate::image::diff::{
    Difference, FlipResult, LayerDifference, Space, compare, greatest, layer_differences, looks, side_by_side,
};
use crate::image::draw::heat::{Map, Scale};
use crate::image::read::{PictureFile, read_picture_file};
use crate::image::statistics::{as_is, developed};
use crate::image::{FileKind, ImageError, Layers, Metadata, Output, Picture, ToneMap, encode};
use crate::load::Diagnostic;
use crate::number::short;
pub(super) use args::DiffArgs;
use args::Show;
use std::path::{Path, PathBuf};

/// Factor by which the difference is amplified in the side-by-side picture.
const GAIN: f32 = 8.0;

/// Two pictures and their difference.
struct Compared {
    expected: Picture,
    actual: Picture,
    space: Space,
    difference: Difference,
    looks: FlipResult,
    layers: Vec<LayerDifference>,
    layers_of_one: Vec<String>,
    /// Parts of the files that were neither read nor compared, each with its file.
    left_out: Vec<String>,
}

impl Compared {
    /// Greatest difference of a value of any layer; infinite if a part of one file has no counterpart to compare with.
    fn layer_max(&self) -> f64 {
        let all = self.layers_of_one.is_empty() && self.left_out.is_empty();
        self.layers.iter().map(|layer| layer.max).fold(if all { 0.0 } else { f64::INFINITY }, f64::max)
    }
}

/// Compares the pictures, prints the figures, and draws the difference.
pub(super) fn run(args: &DiffArgs) -> Exit {
    let messages = Messages::new(args.messages.into(), false);
    panics::guard(&args.actual.display().to_string(), &messages, || {
        let drawn = check_outputs(args).and_then(|()| compared(args, &messages)).and_then(|compared| {
            draw(args, &compared)?;
            Ok(compared)
        });
        match drawn {
            Ok(compared) => print_figures(args, &compared, &messages).unwrap_or_else(|exit| exit),
            Err(fault) => messages.fail(&fault.0, fault.1),
        }
    })
}

/// A fault, and the exit code that it causes.
type Fault = Box<(Diagnostic, Exit)>;

/// Checks that the drawings replace neither of the compared pictures and are two different files.
fn check_outputs(args: &DiffArgs) -> Result<(), Fault> {
    let sources = Sources::of([&args.expected, &args.actual]);
    let outputs = [("-o", &args.output), ("--side-by-side", &args.side_by_side)];
    for (flag, path) in outputs {
        let Some(path) = path else { continue };
        if FileKind::from_path(path).ok() != Some(FileKind::Png) {
            let fault = Diagnostic::new("usage", path, "", format!("{flag} writes a PNG; end its name in .png"));
            return Err(Box::new((fault, Exit::Usage)));
        }
        writable::check(path, flag, &sources).map_err(|fault| Box::new((fault, Exit::Failed)))?;
    }
    let names: Vec<PathBuf> = outputs.into_iter().filter_map(|(_, path)| path.clone()).collect();
    if output_name::collision(&names).is_some() {
        let fault = Diagnostic::new("usage", "", "", "-o and --side-by-side name one file");
        return Err(Box::new((fault, Exit::Usage)));
    }
    Ok(())
}

fn compared(args: &DiffArgs, messages: &Messages) -> Result<Compared, Fault> {
    let (expected, actual) = (read(&args.expected)?, read(&args.actual)?);
    let kinds = [expected.kind, actual.kind];
    let left_out = told_left_out([(&args.expected, &expected), (&args.actual, &actual)], messages);
    let (expected, actual) = (expected.picture, actual.picture);
    let size = |picture: &Picture| (picture.width, picture.height);
    if size(&expected) != size(&actual) {
        let [(w, h), (width, height)] = [&expected, &actual].map(size);
        let text = format!("{width}×{height} pixels, but {} has {w}×{h}", args.expected.display());
        let fault = Diagnostic::new("sizes-differ", &args.actual, "", text).remedy("compare pictures of one size");
        return Err(Box::new((fault, Exit::Input)));
    }
    let both_linear = kinds == [FileKind::Exr; 2];
    let space = args.space.map_or(if both_linear { Space::Linear } else { Space::Display }, Into::into);
    check_use(args, kinds, space)?;
    let none = Layers::default();
    let [ours, theirs] = [&expected, &actual].map(|picture| picture.layers.as_ref().unwrap_or(&none));
    let (layers, layers_of_one) = layer_differences(ours, theirs);
    let shown = |picture: Picture, kind| match space {
        Space::Display if kind == FileKind::Exr => displayed(&picture, &development(args)),
        _ => picture,
    };
    let (expected, actual) = (shown(expected, kinds[0]), shown(actual, kinds[1]));
    let difference = compare(&expected, &actual, space, args.threshold);
    let Some((difference, looks)) = difference.zip(looks(&expected, &actual, space, args.pixels_per_degree)) else {
        let fault = Diagnostic::new("picture-broken", &args.actual, "", "it has not as many pixels as its size says");
        return Err(Box::new((fault, Exit::Input)));
    };
    Ok(Compared { expected, actual, space, difference, looks, layers, layers_of_one, left_out })
}

/// Refuses options that have no effect on files of these kinds.
fn check_use(args: &DiffArgs, kinds: [FileKind; 2], space: Space) -> Result<(), Fault> {
    let is_developed = space == Space::Display && kinds.contains(&FileKind::Exr);
    let has_layers = kinds == [FileKind::Exr; 2];
    let text = if (args.tone_map.is_some() || args.exposure.is_some()) && !is_developed {
        "--tone-map and --exposure say how an EXR becomes display colour: they need one, and --space display"
    } else if args.fail_if.iter().any(|limit| limit.is_of_layers()) && !has_layers {
        "--fail-if layer-max needs two EXR files: others have no layers"
    } else {
        return Ok(());
    };
    Err(Box::new((Diagnostic::new("usage", &args.actual, "", text), Exit::Usage)))
}

/// Warns of parts of the files that are not read and hence not compared, and returns them.
fn told_left_out(files: [(&PathBuf, &PictureFile); 2], messages: &Messages) -> Vec<String> {
    let all = files.into_iter().flat_map(|(path, file)| file.left_out.iter().map(move |what| (path, what)));
    all.map(|(path, what)| {
        let warning = Diagnostic::new("not-compared", path, "", format!("{what}: not read, so not compared"));
        messages.say(Severity::Warning, &warning);
        format!("{}: {what}", path.display())
    })
    .collect()
}

/// Picture as light of the display. NaN is kept, although a developed picture shows a colour there: it is an error.
fn displayed(picture: &Picture, development: &Output) -> Picture {
    let mut shown = developed(picture, development);
    let broken = picture.beauty.iter().map(|pixel| pixel.iter().any(|c| c.is_nan()));
    shown.beauty.iter_mut().zip(broken).filter(|(_, broken)| *broken).for_each(|(pixel, _)| *pixel = [f32::NAN; 4]);
    shown
}

/// Output settings that turn EXR files into display colour.
fn development(args: &DiffArgs) -> Output {
    let (tone_map, exposure) = (args.tone_map.unwrap_or(ToneMap::None), args.exposure.unwrap_or(0.0));
    Output { tone_map, exposure, ..Output::default() }
}

fn read(path: &Path) -> Result<PictureFile, Fault> {
    read_picture_file(path).map_err(|e| match e {
        ImageError::Read { source, .. } => {
            Box::new((Diagnostic::new("file-unreadable", path, "", source.to_string()), Exit::Failed))
        }
        other => Box::new((Diagnostic::new("picture-unreadable", path, "", other.to_string()), Exit::Input)),
    })
}

fn draw(args: &DiffArgs, compared: &Compared) -> Result<(), Fault> {
    if let Some(path) = &args.output {
        write(path, map(args, compared))?;
    }
    if let Some(path) = &args.side_by_side {
        let whole = side_by_side(&compared.expected, &compared.actual, GAIN);
        write(path, encode(&whole, FileKind::Png, &as_is(), &Metadata::new()))?;
    }
    Ok(())
}

fn map(args: &DiffArgs, compared: &Compared) -> Result<Vec<u8>, ImageError> {
    let (what, values) = match args.show {
        Show::Flip => ("FLIP", compared.looks.values.iter().copied().map(f64::from).collect()),
        Show::Channel => {
            let values = greatest(&compared.expected, &compared.actual, compared.space);
            ("greatest difference of a channel", values.unwrap_or_default())
        }
    };
    let most = values.iter().copied().fold(0.0, f64::max);
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let told = |x: f64| if x.is_infinite() { "infinite".into() } else { short(x) };
    let title = format!("{what}: mean {}, most {}", told(mean), told(most));
    let finite = || values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let end = args.heatmap_max.unwrap_or_else(finite);
    let scale = Scale::new(end, finest(end));
    Map { width: compared.expected.width, values: &values, scale, title: &title, label: short }
        .draw()
        .png(&Metadata::new())
}

/// Smallest value shown distinct from 0 on a scale up to `most`: a power of ten, at least ten times smaller.
fn finest(most: f64) -> f64 {
    if most > 0.0 { libm::exp10(libm::floor(libm::log10(most)) - 1.0) } else { 0.1 }
}

fn write(path: &Path, bytes: Result<Vec<u8>, ImageError>) -> Result<(), Fault> {
    let fault = |text: String| Box::new((Diagnostic::new("output-unwritable", path, "", text), Exit::Failed));
    interrupt::write_atomic(path, &bytes.map_err(|e| fault(e.to_string()))?).map_err(|e| fault(e.to_string()))
}

/// Prints the figures; a broken limit is reported and fails the command.
fn print_figures(args: &DiffArgs, compared: &Compared, messages: &Messages) -> Result<Exit, Exit> {
    let broken: Vec<String> = args.fail_if.iter().filter_map(|limit| limit.broken_by(compared)).collect();
    let text = if args.json { report::json(args, compared, &broken) } else { report::text(args, compared) };
    messages.print(&text)?;
    broken.iter().for_each(|line| messages.error("pictures-differ", line, ""));
    Ok(if broken.is_empty() { Exit::Done } else { Exit::Failed })
}
