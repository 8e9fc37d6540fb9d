//! Data shared by all pixels of a picture, and the resolve from samples to a pixel.

use super::Settings;
use super::certainty;
use super::context::Context;
use super::media::Medium;
use super::media::around_eye::media_around;
use super::primary_rays::{Ball, CameraSample, Eye, ThinLens};
use super::sample_offsets::sample_offsets;
use super::sampling::Sampling;
use super::sobol::{self, mix};
use super::view::View;
use super::whitted::Sample;
use crate::accel::Accel;
use crate::math::simd::{Kernel, LANES, Level, Simd};
use crate::math::{DVec3, Vec3};
use crate::scene::Background;

/// Levels of adaptive sampling beyond which rays get no sharper: finer texture detail would be hit or missed by chance.
const SHARPEST: u32 = 3;

/// Data shared by all tiles.
pub(super) struct Frame<'a> {
    pub view: &'a View,
    pub settings: &'a Settings,
    /// Offsets of the samples of a pixel, where these are the same in every pixel.
    pub offsets: Vec<(f64, f64)>,
    /// Footprint width of one sample relative to a pixel.
    sample_width: f32,
    scene: Ball,
    /// Media that the eye is inside of, the innermost last.
    pub media: Vec<Medium>,
    pub background: Option<Vec3>,
    /// Whether glass may stand before the background.
    pub has_veil: bool,
    /// How many standard errors of a pixel its allowed error must be; found by a search, therefore once for all tiles.
    pub standard_errors: f32,
}

/// Footprint width of one sample relative to a pixel.
#[expect(clippy::cast_precision_loss, reason = "sample counts are small")]
pub(super) fn sample_width(settings: &Settings) -> f32 {
    // Where the number of samples varies, every ray is as sharp as at the largest number: what a ray blurs stays blurred.
    let samples = match settings.sampling {
        Sampling::Uniform => settings.samples.max(1) as f32,
        Sampling::Adaptive(how) => (4_u32 << (2 * how.levels.min(SHARPEST))) as f32,
        Sampling::Stochastic(how) => how.sharpness.unwrap_or(how.max_samples).max(1) as f32,
    };
    1.0 / samples.sqrt()
}

impl<'a> Frame<'a> {
    pub(super) fn new<A: Accel>(context: &Context, accel: &A, view: &'a View, settings: &'a Settings) -> Self {
        let offsets = sample_offsets(settings.samples);
        let background = context.scene.background.and_then(Background::color);
        let sample_width = sample_width(settings);
        let standard_errors = match settings.sampling {
            Sampling::Stochastic(how) => certainty::factor(how.confidence),
            Sampling::Uniform | Sampling::Adaptive(_) => 0.0,
        };
        let (scene, media) = (Ball::around(context.scene, context.world), media_around(context, accel, view));
        let has_veil = background.is_some() && context.lets_background_through;
        Self { view, settings, offsets, sample_width, scene, media, background, has_veil, standard_errors }
    }

    /// Returns the eye that eye rays start from.
    pub(super) fn eye(&self, center: DVec3) -> Eye<'_> {
        let Settings { width, height, lens, .. } = *self.settings;
        let Self { view, sample_width, scene, .. } = *self;
        Eye { view, width, height, center, sample_width, scene, lens }
    }

    /// Samples of a pixel where their offsets are the same in every pixel; only their lens points differ.
    pub(super) fn places(&self, (x, y): (u32, u32)) -> impl Iterator<Item = CameraSample> {
        let (lens, key) = (self.settings.lens, pixel_key(self.settings.seed, (x, y)));
        (0..).zip(&self.offsets).map(move |(i, &(dx, dy))| {
            let place = CameraSample::new(f64::from(x) + dx, f64::from(y) + dy);
            CameraSample { lens: on_lens(lens, key, i), ..place }
        })
    }
}

/// The `i`th lens point of a pixel; the centre of a lens without an aperture.
pub(super) fn on_lens(lens: Option<ThinLens>, key: u32, i: u32) -> [f64; 2] {
    lens.map_or([0.5; 2], |_| sobol::point(i, key))
}

/// Key of the random numbers of a pixel.
#[expect(clippy::cast_possible_truncation, reason = "both halves are mixed in")]
#[inline(always)]
pub(super) fn pixel_key(seed: u64, (x, y): (u32, u32)) -> u32 {
    mix(mix(mix(seed as u32, (seed >> 32) as u32), x), y)
}

/// The [`pixel_key`]s of the pixels at these columns and rows.
pub(super) fn pixel_keys(seed: u64, (x, y): (&[u32], &[u32])) -> Vec<u32> {
    let mut keys = vec![0; x.len().min(y.len())];
    Level::best().run(Keys { seed, x, y, keys: &mut keys });
    keys
}

struct Keys<'a> {
    seed: u64,
    x: &'a [u32],
    y: &'a [u32],
    keys: &'a mut [u32],
}

impl Kernel for Keys<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        for (key, (&x, &y)) in self.keys.iter_mut().zip(self.x.iter().zip(self.y)) {
            *key = pixel_key(self.seed, (x, y));
        }
    }
}

/// Sum over samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sum {
    pub radiance: Vec3,
    pub through: Vec3,
    /// Number of samples through which no background shows.
    pub solid: f32,
    pub weight: f32,
}

impl Sum {
    /// The sum over a single sample.
    #[cfg(test)]
    pub(super) fn of(sample: &Sample) -> Self {
        Self { radiance: sample.radiance, through: sample.through, solid: solid(sample), weight: 1.0 }
    }

    pub(super) fn add(&mut self, sample: &Sample) {
        self.radiance += sample.radiance;
        self.through += sample.through;
        self.solid += solid(sample);
        self.weight += 1.0;
    }

    /// Adds `times` times another sum.
    #[inline(always)]
    pub(super) fn plus(self, other: Self, times: f32) -> Self {
        Self {
            radiance: self.radiance + other.radiance * times,
            through: self.through + other.through * times,
            solid: self.solid + other.solid * times,
            weight: self.weight + other.weight * times,
        }
    }

    /// Resolves the sum into a pixel: premultiplied RGBA, and its [`veil`](crate::image::Picture::veil).
    ///
    /// Alpha is one minus the share of the background that shows through. Coloured glass transmits a different share in each
    /// channel, but there is one alpha: before a known background colour, alpha takes the least channel and the veil takes what
    /// the other channels show more; without one, alpha takes the mean of the channels.
    #[inline(always)]
    pub(super) fn resolve(&self, background: Option<Vec3>) -> ([f32; 4], [f32; 4]) {
        let share = 1.0 / self.weight.max(f32::MIN_POSITIVE);
        let color = self.radiance * share;
        let through = (self.through * share).clamp(Vec3::ZERO, Vec3::ONE);
        let (clear, veil) = match background {
            Some(background) => {
                let least = through.min_element();
                (least, (through - Vec3::splat(least)) * background)
            }
            None if through.x == through.y && through.y == through.z => (through.x, Vec3::ZERO),
            None => (through.element_sum() / 3.0, Vec3::ZERO),
        };
        // A sum of finite parts can still overflow.
        let color = if color.is_finite() { color } else { color.min(Vec3::splat(f32::MAX)).max(Vec3::ZERO) };
        let coverage = 1.0 - clear;
        let glass = if coverage > 0.0 { (1.0 - self.solid * share / coverage).clamp(0.0, 1.0) } else { 1.0 };
        (color.extend(coverage).to_array(), veil.extend(glass).to_array())
    }
}

/// 1 for a sample through which no background shows, else 0.
#[inline(always)]
fn solid(sample: &Sample) -> f32 {
    if sample.through == Vec3::ZERO { 1.0 } else { 0.0 }
}

/// Resolves pixels of `per_pixel` samples each, and appends them to `to`.
pub(super) fn resolve_each(samples: &[Sample], per_pixel: usize, background: Option<Vec3>, to: &mut Vec<[f32; 4]>) {
    Level::best().run(Resolve { samples, per_pixel, background, to });
}

/// Appends the veils of the same pixels to `to`.
pub(super) fn veil_each(samples: &[Sample], per_pixel: usize, background: Option<Vec3>, to: &mut Vec<[f32; 4]>) {
    for samples in samples.chunks(per_pixel.max(1)) {
        let mut sum = Sum::default();
        samples.iter().for_each(|sample| sum.add(sample));
        to.push(sum.resolve(background).1);
    }
}

struct Resolve<'a> {
    samples: &'a [Sample],
    per_pixel: usize,
    background: Option<Vec3>,
    to: &'a mut Vec<[f32; 4]>,
}

/// Number of f32 components of a sample.
const NUMBERS: usize = 6;

impl Kernel for Resolve<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { samples, per_pixel, background, to } = self;
        let numbers: &[f32] = bytemuck::cast_slice(samples);
        // Loads all components of a sample as one vector, so that each sample takes one addition. The lanes behind them hold
        // components of the next sample and are ignored.
        let mut first = 0;
        while first < samples.len() {
            let end = (first + per_pixel.max(1)).min(samples.len());
            #[expect(clippy::cast_precision_loss, reason = "sample counts are small")]
            let weight = (end - first) as f32;
            let mut sum = s.splat(0.0);
            for at in first..end {
                let mut row = [0.0; LANES];
                match numbers[at * NUMBERS..].first_chunk() {
                    Some(whole) => row = *whole,
                    None => row[..NUMBERS].copy_from_slice(&numbers[at * NUMBERS..(at + 1) * NUMBERS]),
                }
                sum = s.add(sum, s.load(&row));
            }
            let [r, g, b, x, y, z, ..] = s.store(sum);
            // The veil is not needed here.
            let sum = Sum { radiance: Vec3::new(r, g, b), through: Vec3::new(x, y, z), solid: 0.0, weight };
            to.push(sum.resolve(background).0);
            first = end;
        }
    }
}
