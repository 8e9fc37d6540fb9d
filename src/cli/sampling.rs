//! Flags of pixel sampling and of the lens: arguments, their joint meaning, and their storage in a picture.

use super::args::SpaceArg;
use super::job::UsageError;
use super::parse::{self, Focus};
use crate::image::{FileKind, Output};
use crate::load::Diagnostic;
use crate::math::DVec3;
use crate::number::so_many;
use crate::render::{
    Adaptive, ErrorSpace, Filter, Quality, Sampled, Sampling, Settings, Split, Stochastic, ThinLens, View,
};
use crate::scene::RenderHints;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::path::Path;

/// How pixels are sampled.
#[derive(Debug, Clone, Default, Args)]
pub(super) struct SamplingArgs {
    /// How the rays of a pixel are chosen: `off` one through its middle; `uniform` --samples of them at the same places in
    /// each; `adaptive` corners and middle, and more where these differ; `stochastic` more until the mean is certain
    /// [default: stochastic, unless other flags imply another]
    #[arg(long, value_name = "HOW", value_enum, help_heading = "Quality", hide_short_help = true)]
    pub aa: Option<Aa>,
    /// Quality of a stochastic picture: draft (error per pixel 0.25, up to 64 rays), normal (0.08, up to 256) or final
    /// (0.035, up to 1024) [default: normal]
    #[arg(long, value_name = "WORD", value_parser = parse::named::<Quality>(), help_heading = "Quality")]
    pub quality: Option<Quality>,
    /// Exactly N rays per pixel, at the same places in each (--aa uniform). Costs of pixels (--layers tests, --heatmap) are
    /// always those of N rays, 4 by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Quality")]
    pub samples: Option<u32>,
    /// Error at which stochastic sampling stops in a pixel: root mean square over its channels, which run from 0 to 1 in the
    /// written picture. Half the error costs about two to three times the rays
    #[arg(long, value_name = "E", value_parser = parse::error, help_heading = "Quality", hide_short_help = true)]
    pub pixel_error: Option<f32>,
    /// Error of the whole picture to reach, and not much less: root mean square in the numbers of --error-space. Part of the
    /// picture is rendered first to plan (see --dry-run); then it is rendered twice, so that the difference tells the error,
    /// and missing samples are added. It takes as many rays as needed: not with --max-samples
    #[arg(long, value_name = "E", value_parser = parse::error, help_heading = "Quality", hide_short_help = true,
          conflicts_with_all = ["pixel_error", "quality"])]
    pub target_error: Option<f32>,
    /// Confidence with which the error is to be met, such as 95% or 0.95 [default: 95%]
    #[arg(long, value_name = "PERCENT", value_parser = parse::confidence, help_heading = "Quality", hide_short_help = true)]
    pub confidence: Option<f64>,
    /// Fewest rays per pixel of stochastic sampling, which are enough where they and those of the neighbours agree; rounded
    /// up to a power of two. Light, gloss and environment rays per sample are divided by it, at least by 4 [default: 1; 16
    /// with --aperture, and for points and lines narrower than 2 pixels]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(Settings::MOST_RAYS)),
          help_heading = "Quality",
          hide_short_help = true)]
    pub min_samples: Option<u32>,
    /// Most rays per pixel of stochastic sampling, certain or not; rounded down to a power of two
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1_048_576), help_heading = "Quality",
          hide_short_help = true)]
    pub max_samples: Option<u32>,
    /// Reconstruction filter of stochastic sampling: box (uniform over the pixel) or tent (weighted to its middle and
    /// reaching beyond it, softer) [default: box]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<Filter>(), help_heading = "Quality",
          hide_short_help = true)]
    pub filter: Option<Filter>,
    /// Space in which --pixel-error, --target-error and --aa-threshold count: sRGB codes after exposure and tone map, or
    /// linear light [default: linear for EXR, else display]
    #[arg(long, value_name = "SPACE", value_enum, help_heading = "Quality", hide_short_help = true)]
    pub error_space: Option<SpaceArg>,
    /// Which quadrants of a pixel adaptive sampling subdivides: `corners` those whose corner differs from the middle of the
    /// pixel, as published; `effect` those that, judging by everything found on their border, could change the pixel: fewer
    /// rays for a smaller error [default: effect]
    #[arg(long, value_name = "NAME", value_parser = parse::named::<Split>(), help_heading = "Quality",
          hide_short_help = true)]
    pub aa_split: Option<Split>,
    /// Threshold above which they are subdivided: for `effect` the possible change of the pixel, 0 to 1 in the written
    /// picture, half of it for 1.5 times the rays [default: 0.001]; for `corners` the difference of a channel, linear light
    /// after exposure [default: 0.05]
    #[arg(long, value_name = "T", value_parser = parse::error, help_heading = "Quality", hide_short_help = true)]
    pub aa_threshold: Option<f32>,
    /// Most subdivisions of a pixel in adaptive sampling; 0: five rays [default: 6; 3 for `corners`]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Adaptive::MAX_LEVELS)),
          help_heading = "Quality", hide_short_help = true)]
    pub aa_depth: Option<u32>,
    /// Subdivisions that every pixel gets in adaptive sampling: detail that lies between all rays is missed, and there are 2,
    /// 8, 32 … of them per pixel. Each level costs four times the rays in empty regions [default: 1; 0 for `corners`]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=i64::from(Adaptive::MAX_LEVELS)),
          help_heading = "Quality", hide_short_help = true)]
    pub aa_min_depth: Option<u32>,
    /// Radius of the lens, in the units of the model: everything away from --focus is blurred [default: 0, everything is
    /// sharp]
    #[arg(long, value_name = "R", value_parser = parse::radius, help_heading = "Camera", hide_short_help = true)]
    pub aperture: Option<f64>,
    /// Where the picture is sharp: a distance along the line of sight, or a point [default: the middle of the model]
    #[arg(long, value_name = "D|X,Y,Z", value_parser = parse::focus, requires = "aperture", help_heading = "Camera",
          hide_short_help = true, allow_hyphen_values = true)]
    pub focus: Option<Focus>,
}

/// Maximum number of samples per pixel with a target error of the whole picture.
const MOST_TO_TARGET: u32 = 1 << 14;

/// `--aa`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Aa {
    Off,
    Uniform,
    Adaptive,
    Stochastic,
}

/// Minimum number of samples per pixel with an open lens: defocused objects show in only few rays of many pixels, so that
/// neighbouring single rays that agree prove nothing.
const FEWEST_OF_LENS: u32 = 16;

/// Minimum number of samples per pixel for points and lines narrower than [`NARROW`] pixels: one ray per pixel may miss them all.
const FEWEST_OF_WIRES: u32 = 16;
const NARROW: f64 = 2.0;

impl SamplingArgs {
    /// Refuses combinations of flags of different kinds of sampling.
    pub(super) fn check(&self) -> Result<(), UsageError> {
        let (stochastic, adaptive) = (self.stochastic_flags(), self.adaptive_flags());
        let uniform = [("--samples", self.samples.is_some())];
        let groups = [(Aa::Stochastic, &stochastic[..]), (Aa::Adaptive, &adaptive), (Aa::Uniform, &uniform)];
        let asked = |flags: &[(&'static str, bool)]| flags.iter().find(|(_, typed)| *typed).map(|(flag, _)| *flag);
        let mut typed = groups.iter().filter_map(|(aa, flags)| asked(flags).map(|flag| (*aa, flag)));
        if let (Some((_, one)), Some((_, other))) = (typed.next(), typed.next()) {
            return Err(UsageError(format!("{one} and {other} belong to different kinds of --aa; use one of them")));
        }
        for (aa, flags) in groups {
            if let (Some(chosen), Some(flag)) = (self.aa, asked(flags))
                && chosen != aa
            {
                let name = |aa: Aa| aa.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
                return Err(UsageError(format!("{flag} belongs to --aa {}, not to --aa {}", name(aa), name(chosen))));
            }
        }
        if self.error_space.is_some() && (self.samples.is_some() || matches!(self.aa, Some(Aa::Off | Aa::Uniform))) {
            let text = "--error-space belongs to --aa stochastic and adaptive: --aa uniform looks at no error";
            return Err(UsageError(text.into()));
        }
        if let (Some(least), Some(most)) = (self.aa_min_depth, self.aa_depth)
            && least > most
        {
            return Err(UsageError(format!("--aa-min-depth {least} is more than --aa-depth {most}")));
        }
        if let (Some(fewest), Some(most)) = (self.min_samples, self.max_samples)
            && fewest > most
        {
            return Err(UsageError(format!("--min-samples {fewest} is more than --max-samples {most}")));
        }
        Ok(())
    }

    /// Refuses a limit on the samples per pixel together with a target error of the picture, which determines their number. The
    /// stored settings of a picture have both.
    pub(super) fn check_target(&self) -> Result<(), UsageError> {
        if self.target_error.is_none() || self.max_samples.is_none() {
            return Ok(());
        }
        let text = "--target-error takes as many samples as the picture needs, so --max-samples cannot limit them; leave \
                    one of them out, or use --pixel-error with --max-samples";
        Err(UsageError(text.into()))
    }

    /// Flags that only stochastic sampling uses, and whether they were typed.
    fn stochastic_flags(&self) -> [(&'static str, bool); 7] {
        [
            ("--quality", self.quality.is_some()),
            ("--pixel-error", self.pixel_error.is_some()),
            ("--target-error", self.target_error.is_some()),
            ("--confidence", self.confidence.is_some()),
            ("--min-samples", self.min_samples.is_some()),
            ("--max-samples", self.max_samples.is_some()),
            ("--filter", self.filter.is_some()),
        ]
    }

    /// Flags that only adaptive sampling uses, and whether they were typed.
    fn adaptive_flags(&self) -> [(&'static str, bool); 4] {
        [
            ("--aa-split", self.aa_split.is_some()),
            ("--aa-threshold", self.aa_threshold.is_some()),
            ("--aa-depth", self.aa_depth.is_some()),
            ("--aa-min-depth", self.aa_min_depth.is_some()),
        ]
    }

    /// Kind of sampling: as typed, or implied by other flags or by the scene file, or else stochastic.
    fn kind(&self, hints: &RenderHints) -> Aa {
        let typed = |flags: &[(&str, bool)]| flags.iter().any(|(_, typed)| *typed);
        let tuned = typed(&self.stochastic_flags()) || self.error_space.is_some();
        self.aa.unwrap_or(if typed(&self.adaptive_flags()) {
            Aa::Adaptive
        } else if self.samples.is_some() || hints.samples.is_some() && !tuned {
            Aa::Uniform
        } else {
            Aa::Stochastic
        })
    }

    /// Number of samples of uniform sampling, and the sampling itself. Its error space is a default; [`Self::written`] sets it
    /// for a picture.
    pub(super) fn sampling(&self, hints: &RenderHints) -> (u32, Sampling) {
        let usual = Settings::default().samples;
        let samples = self.samples.or(hints.samples).unwrap_or(usual);
        match self.kind(hints) {
            Aa::Off => (1, Sampling::Uniform),
            Aa::Uniform => (samples, Sampling::Uniform),
            Aa::Adaptive => {
                let usual = Adaptive::usual(self.aa_split.unwrap_or_default());
                let threshold = self.aa_threshold.unwrap_or(usual.threshold);
                let levels = self.aa_depth.unwrap_or(usual.levels.max(self.aa_min_depth.unwrap_or(0)));
                let min_levels = self.aa_min_depth.unwrap_or(usual.min_levels).min(levels);
                (samples, Sampling::Adaptive(Adaptive { threshold, levels, min_levels, ..usual }))
            }
            Aa::Stochastic => {
                let usual = self.quality.unwrap_or_default().stochastic();
                let is_open = self.aperture.is_some_and(|radius| radius > 0.0);
                let usual_fewest = if is_open { usual.min_samples.max(FEWEST_OF_LENS) } else { usual.min_samples };
                let usual_most = if self.target_error.is_some() { MOST_TO_TARGET } else { usual.max_samples };
                let most = self.max_samples.unwrap_or(usual_most.max(self.min_samples.unwrap_or(0)));
                let how = Stochastic {
                    error: self.pixel_error.unwrap_or(usual.error),
                    confidence: self.confidence.unwrap_or(usual.confidence),
                    min_samples: self.min_samples.unwrap_or(usual_fewest).min(most),
                    max_samples: most,
                    sharpness: None,
                    filter: self.filter.unwrap_or(usual.filter),
                    space: usual.space,
                    target: self.target_error,
                };
                (samples, Sampling::Stochastic(how))
            }
        }
    }

    /// Sampling for a picture of points and lines about `pixels` pixels wide.
    pub(super) fn of_wires(&self, sampling: Sampling, pixels: f64) -> Sampling {
        match sampling {
            Sampling::Stochastic(how) if self.min_samples.is_none() => {
                let min_samples = how.min_samples.max(fewest_of_wires(pixels)).min(how.max_samples);
                Sampling::Stochastic(Stochastic { min_samples, ..how })
            }
            _ => sampling,
        }
    }

    /// Sampling with the error space of a picture that is developed by `output` and written as this file type.
    pub(super) fn written(&self, sampling: Sampling, kind: FileKind, output: &Output) -> Sampling {
        let linear = match self.error_space {
            Some(space) => space == SpaceArg::Linear,
            None => kind == FileKind::Exr,
        };
        let (tone_map, exposure) = (output.tone_map, output.exposure);
        let space = if linear { ErrorSpace::Linear } else { ErrorSpace::Display { tone_map, exposure } };
        match sampling {
            Sampling::Uniform => sampling,
            Sampling::Adaptive(how) => Sampling::Adaptive(Adaptive { space, ..how }),
            Sampling::Stochastic(how) => Sampling::Stochastic(Stochastic { space, ..how }),
        }
    }

    /// Lens of this camera; `middle` is the middle of the model.
    pub(super) fn lens(&self, view: &View, middle: DVec3, file: &Path) -> Result<Option<ThinLens>, Diagnostic> {
        let Some(radius) = self.aperture.filter(|&radius| radius > 0.0) else { return Ok(None) };
        let depth = |point: DVec3| (point - view.eye).dot(view.forward);
        let focus = match self.focus {
            Some(Focus::Distance(distance)) => distance,
            Some(Focus::Point(point)) => depth(point.into()),
            None => depth(middle),
        };
        if focus > 0.0 && focus.is_finite() {
            return Ok(Some(ThinLens { radius, focus }));
        }
        let text = format!("the point to focus on is not in front of the camera: it lies {focus} along the view");
        Err(Diagnostic::new("focus", file, "", text).remedy("give a --focus that is in front of it"))
    }
}

/// Minimum number of samples per pixel for points and lines about `pixels` pixels wide.
pub(super) fn fewest_of_wires(pixels: f64) -> u32 {
    if pixels < NARROW { FEWEST_OF_WIRES } else { 1 }
}

/// Value of `--error-space`.
fn space(space: ErrorSpace) -> &'static str {
    if space == ErrorSpace::Linear { "linear" } else { "display" }
}

/// Sets the flags that repeat the sampling of a picture.
pub(super) fn flags(settings: &Settings, mut set: impl FnMut(&str, String)) {
    match settings.sampling {
        Sampling::Uniform => {
            set("aa", "uniform".into());
            set("samples", settings.samples.to_string());
        }
        Sampling::Adaptive(how) => {
            set("aa", "adaptive".into());
            set("aa-split", how.split.name().into());
            set("aa-threshold", how.threshold.to_string());
            set("aa-depth", how.levels.to_string());
            set("aa-min-depth", how.min_levels.to_string());
            set("error-space", space(how.space).into());
        }
        Sampling::Stochastic(how) => {
            set("aa", "stochastic".into());
            match how.target {
                Some(target) => set("target-error", target.to_string()),
                None => set("pixel-error", how.error.to_string()),
            }
            set("confidence", how.confidence.to_string());
            set("min-samples", how.min_samples.to_string());
            set("max-samples", how.max_samples.to_string());
            set("filter", how.filter.name().into());
            set("error-space", space(how.space).into());
        }
    }
    if let Some(lens) = settings.lens {
        set("aperture", lens.radius.to_string());
        set("focus", lens.focus.to_string());
    }
}

/// Describes how the picture was sampled.
pub(super) fn phrase(settings: &Settings, sampled: &Sampled) -> String {
    if let Some(to) = sampled.targeted {
        let at_most = if to.estimate.is_none() { "at most " } else { "" };
        return format!(
            "{:.1} samples a pixel (at most {}) and {:.1} to find out how many: picture error {at_most}{:.4} of what rays have met, where {} was asked for (forecast {:.4} and {:.1} s of processor time, took {:.1} s)",
            sampled.samples(),
            sampled.most(),
            sampled.mean() - sampled.samples(),
            sampled.rmse().unwrap_or(to.foretold),
            to.target,
            to.foretold,
            to.foretold_cpu,
            to.cpu
        );
    }
    match settings.sampling {
        Sampling::Uniform => format!("{} a pixel", so_many(u64::from(settings.samples), "sample")),
        Sampling::Adaptive(_) => {
            format!("adaptive, {:.1} samples a pixel (at most {})", sampled.samples(), sampled.most())
        }
        Sampling::Stochastic(how) => {
            let percent = |n: u64| 100.0 * n as f64 / sampled.pixels.max(1) as f64;
            let rmse = sampled.rmse().unwrap_or(0.0);
            format!(
                "{:.1} samples a pixel (at most {}): {:.1} % of pixels within {} at {} % confidence, picture error at most about {rmse:.4} (of what rays have met), {:.0} % of the rays to spare",
                sampled.samples(),
                sampled.most(),
                percent(sampled.met),
                how.error,
                100.0 * how.confidence,
                100.0 * sampled.spare as f64 / sampled.own().max(1) as f64,
            )
        }
    }
}

/// The number as typed, not the `f64` expansion of its nearest `f32`.
pub(super) fn plain(x: f32) -> f64 {
    x.to_string().parse().unwrap_or_else(|_| x.into())
}

/// Sampling of a picture as JSON, with the facts of [`phrase`].
pub(super) fn json(settings: &Settings, sampled: &Sampled) -> Value {
    let rays = json!({
        "rays": sampled.rays, "mean": sampled.mean(), "samples_a_pixel": sampled.samples(), "most": sampled.most(),
    });
    let mut all = match settings.sampling {
        Sampling::Uniform => json!({ "aa": "uniform" }),
        Sampling::Adaptive(how) => json!({
            "aa": "adaptive", "split": how.split.name(), "threshold": plain(how.threshold), "depth": how.levels,
            "min_depth": how.min_levels, "error_space": space(how.space),
        }),
        Sampling::Stochastic(how) => json!({
            "aa": "stochastic", "pixel_error": plain(how.error), "confidence": how.confidence,
            "min_samples": how.min_samples, "max_samples": how.max_samples, "filter": how.filter.name(),
            "error_space": space(how.space),
            "met": sampled.met, "ceiling": sampled.at_most, "rmse": sampled.rmse(), "spare": sampled.spare, "looked": sampled.looked, "target_error": how.target.map(plain),
            "foretold": sampled.targeted.map(|to| json!({ "rmse": to.foretold, "cpu_seconds": to.foretold_cpu })),
        }),
    };
    if let (Value::Object(all), Value::Object(rays)) = (&mut all, rays) {
        all.extend(rays);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(args: SamplingArgs) -> (u32, Sampling) {
        args.check().unwrap();
        args.sampling(&RenderHints::default())
    }

    #[test]
    fn narrow_points_and_lines_are_looked_for_in_every_pixel_unless_fewer_rays_are_asked_for() {
        let fewest =
            |args: &SamplingArgs, pixels: f64| match args.of_wires(args.sampling(&RenderHints::default()).1, pixels) {
                Sampling::Stochastic(how) => how.min_samples,
                other => panic!("{other:?}"),
            };
        let usual = SamplingArgs::default();
        let fewer = SamplingArgs { min_samples: Some(2), ..usual.clone() };
        let few = SamplingArgs { max_samples: Some(8), ..usual.clone() };
        assert_eq!([fewest(&usual, 1.9), fewest(&usual, 2.1), fewest(&fewer, 0.1), fewest(&few, 0.1)], [16, 1, 2, 8]);
    }

    #[test]
    fn nothing_said_is_stochastic_and_samples_alone_are_uniform() {
        let none = SamplingArgs::default();
        assert_eq!(kind(none.clone()).1, Sampling::Stochastic(Quality::Normal.stochastic()));
        assert_eq!(kind(SamplingArgs { samples: Some(9), ..none.clone() }), (9, Sampling::Uniform));
        assert_eq!(kind(SamplingArgs { aa: Some(Aa::Off), ..none.clone() }), (1, Sampling::Uniform));
        assert!(matches!(kind(SamplingArgs { aa_depth: Some(2), ..none.clone() }).1, Sampling::Adaptive(_)));
        let hints = RenderHints { samples: Some(9), ..RenderHints::default() };
        assert_eq!(none.sampling(&hints), (9, Sampling::Uniform));
        let draft = SamplingArgs { quality: Some(Quality::Draft), ..none };
        assert_eq!(draft.sampling(&hints).1, Sampling::Stochastic(Quality::Draft.stochastic()));
    }

    #[test]
    fn flags_of_different_kinds_are_refused_by_name() {
        let none = SamplingArgs::default();
        let both = SamplingArgs { samples: Some(4), pixel_error: Some(0.01), ..none.clone() };
        let UsageError(text) = both.check().unwrap_err();
        assert!(text.contains("--pixel-error") && text.contains("--samples"), "{text}");
        let other = SamplingArgs { aa: Some(Aa::Adaptive), filter: Some(Filter::Tent), ..none.clone() };
        let UsageError(text) = other.check().unwrap_err();
        assert!(text.contains("--filter") && text.contains("stochastic") && text.contains("adaptive"), "{text}");
        assert!(SamplingArgs { min_samples: Some(8), max_samples: Some(4), ..none }.check().is_err());
    }

    #[test]
    fn an_exr_counts_errors_in_linear_light() {
        let args = SamplingArgs::default();
        let sampling = kind(args.clone()).1;
        let space = |args: &SamplingArgs, kind| match args.written(sampling, kind, &Output::default()) {
            Sampling::Stochastic(how) => how.space,
            other => panic!("{other:?}"),
        };
        assert_eq!(space(&args, FileKind::Exr), ErrorSpace::Linear);
        assert_eq!(space(&args, FileKind::Png), ErrorSpace::default());
        let linear = SamplingArgs { error_space: Some(SpaceArg::Linear), ..args };
        assert_eq!(space(&linear, FileKind::Png), ErrorSpace::Linear);
    }
}
