//! The knobs of a scene, their cost and risk ([`Knob::price`]), and the settings of each to try.

use super::Subject;
use crate::accel::IntersectorKind;
use crate::render::{Adaptive, Quality, Sampling, Settings, Stochastic};
use crate::scene::features::{Feature, Features};
use crate::scene::{Material, MetalRough, Scene};
use std::fmt;

/// Option that is varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// `--quality`.
    Quality,
    /// `--aa off` and `uniform`.
    Uniform,
    /// `--aa adaptive`.
    Adaptive,
    /// `--aa stochastic`.
    Stochastic,
    /// `--depth`.
    Depth,
    /// `--cutoff`.
    Cutoff,
    /// `--light-rays`.
    LightRays,
    /// `--env-rays`.
    EnvRays,
    /// `--gloss-rays`.
    GlossRays,
    /// `--intersector`.
    Test,
}

impl Knob {
    /// All knobs, in the order of measurement.
    pub const ALL: [Self; 10] = [
        Self::Quality,
        Self::Uniform,
        Self::Adaptive,
        Self::Stochastic,
        Self::Depth,
        Self::Cutoff,
        Self::LightRays,
        Self::EnvRays,
        Self::GlossRays,
        Self::Test,
    ];

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Quality => "quality",
            Self::Uniform => "uniform",
            Self::Adaptive => "adaptive",
            Self::Stochastic => "stochastic",
            Self::Depth => "depth",
            Self::Cutoff => "cutoff",
            Self::LightRays => "light-rays",
            Self::EnvRays => "env-rays",
            Self::GlossRays => "gloss-rays",
            Self::Test => "intersector",
        }
    }

    /// Cost of turning the knob up, and risk of turning it down.
    pub const fn price(self) -> (&'static str, &'static str) {
        match self {
            Self::Quality | Self::Stochastic => {
                ("rays of each pixel that is not certain yet", "noise; what is smaller than a pixel is found by chance")
            }
            Self::Uniform => {
                ("rays of every pixel", "jagged edges, and patterns that are not there where there is fine detail")
            }
            Self::Adaptive => (
                "rays where points beside each other differ",
                "what is smaller than the distance of the first rays is lost",
            ),
            Self::Depth => ("rays behind mirrors and glass", "what is seen through more surfaces is black"),
            Self::Cutoff => {
                ("rays behind mirrors and glass, of little weight", "their light is missing: pictures get darker")
            }
            Self::LightRays => ("shadow rays to wide lights", "noise in soft shadows"),
            Self::EnvRays => ("rays to a panorama from every point", "noise in what it lights"),
            Self::GlossRays => ("rays that a rough surface spreads", "noise in what frosted glass shows"),
            Self::Test => ("time of each ray/triangle test", "holes and wrong hits where rays graze edges"),
        }
    }

    /// Whether the knob has an effect in the scene.
    fn is_in(self, features: &Features, scene: &Scene) -> bool {
        let is_frosted = |m: &MetalRough| m.transmits() && m.roughness > 0.0;
        let any = |of: &[Feature]| of.iter().any(|&f| features.has(f));
        match self {
            Self::Quality | Self::Uniform | Self::Adaptive | Self::Stochastic => true,
            Self::Test => any(&[Feature::Triangles]),
            Self::Depth | Self::Cutoff => any(&[Feature::Mirrors, Feature::Refraction, Feature::ThinTransmission]),
            Self::LightRays => any(&[Feature::SoftShadows]),
            Self::EnvRays => any(&[Feature::Panorama]),
            Self::GlossRays => scene.materials.iter().filter_map(Material::metal_rough).any(is_frosted),
        }
    }
}

impl fmt::Display for Knob {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// One way to render the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Knob that is varied.
    pub knob: Knob,
    /// Flags of `meshray render` for the setting.
    pub flags: String,
    /// Render settings that the flags mean.
    pub settings: Settings,
    /// Ray/triangle test.
    pub test: IntersectorKind,
}

/// All settings of all knobs that apply to the scene. Everything else is as `render` has it by default.
pub(super) fn settings(subject: &Subject) -> Vec<Setting> {
    let features = Features::of(subject.scene);
    Knob::ALL
        .into_iter()
        .filter(|knob| knob.is_in(&features, subject.scene))
        .flat_map(|knob| of(knob, subject))
        .collect()
}

fn of(knob: Knob, subject: &Subject) -> Vec<Setting> {
    let stochastic = |how: Stochastic| {
        let min_samples = how.min_samples.max(subject.fewest).min(how.max_samples);
        Sampling::Stochastic(Stochastic { min_samples, space: subject.space(), ..how })
    };
    // Settings of a rendering whose flags do not concern sampling.
    let usual = match subject.samples {
        Some(samples) => Settings { sampling: Sampling::Uniform, samples, ..subject.base.clone() },
        None => Settings { sampling: stochastic(Quality::default().stochastic()), ..subject.base.clone() },
    };
    let sampled = |sampling: Sampling, samples: u32| Settings { sampling, samples, ..usual.clone() };
    let setting = |flags: String, settings: Settings| Setting { knob, flags, settings, test: IntersectorKind::Exact };
    match knob {
        Knob::Quality => {
            let with = |quality: Quality| {
                setting(format!("--quality {quality}"), sampled(stochastic(quality.stochastic()), usual.samples))
            };
            Quality::ALL.iter().copied().map(with).collect()
        }
        Knob::Uniform => {
            let with = |n: u32| setting(format!("--samples {n}"), sampled(Sampling::Uniform, n));
            [1, 4, 16, 64].map(with).into()
        }
        Knob::Adaptive => {
            let with = |threshold: f32| {
                let how = Adaptive { threshold, space: subject.space(), ..Adaptive::default() };
                setting(
                    format!("--aa adaptive --aa-threshold {threshold}"),
                    sampled(Sampling::Adaptive(how), usual.samples),
                )
            };
            [0.008, 0.004, 0.002, 0.001].map(with).into()
        }
        Knob::Stochastic => {
            let with = |error: f32| {
                let how = Stochastic { error, ..Quality::default().stochastic() };
                setting(format!("--pixel-error {error}"), sampled(stochastic(how), usual.samples))
            };
            [0.16, 0.08, 0.04, 0.02].map(with).into()
        }
        Knob::Depth => {
            let with = |n: u32| setting(format!("--depth {n}"), Settings { depth: Some(n), ..usual.clone() });
            [0, 1, 2, 4, 8, 16, 32].map(with).into()
        }
        Knob::Cutoff => {
            let with = |cutoff: f32| setting(format!("--cutoff {cutoff}"), Settings { cutoff, ..usual.clone() });
            [1.0 / 8.0, 1.0 / 32.0, 1.0 / 128.0, 1.0 / 2048.0].map(with).into()
        }
        Knob::LightRays => {
            let with = |n: u32| setting(format!("--light-rays {n}"), Settings { light_rays: n, ..usual.clone() });
            [1, 4, 16, 64].map(with).into()
        }
        Knob::EnvRays => {
            let with = |n: u32| setting(format!("--env-rays {n}"), Settings { env_rays: Some(n), ..usual.clone() });
            [2, 8, 32, 128].map(with).into()
        }
        Knob::GlossRays => {
            let with = |n: u32| setting(format!("--gloss-rays {n}"), Settings { gloss_rays: Some(n), ..usual.clone() });
            [1, 4, 16].map(with).into()
        }
        Knob::Test => {
            let others = IntersectorKind::ALL.into_iter().filter(|test| *test != IntersectorKind::Exact);
            others.map(|test| Setting { test, ..setting(format!("--intersector {test}"), usual.clone()) }).collect()
        }
    }
}
