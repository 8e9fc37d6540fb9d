//! Reference picture of a study.

use super::{Plan, Subject};
use crate::image::{Developer, Picture};
use crate::render::{Sampling, Settings, Stochastic, render};
use crate::scene::MAX_DEPTH;

/// Number of renderings with different seeds that are averaged.
const PARTS: u32 = 8;

/// Mean of many samples per pixel, with every knob that truncates light paths turned up; accumulated in double precision.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Width in pixels.
    pub width: u32,
    /// Display codes 0..=1 of the picture, over its background or else over black, and coverage; row by row.
    pub pixels: Vec<[f64; 4]>,
    /// Whether some pixel is not fully covered, so that coverage is compared too.
    pub is_transparent: bool,
    /// Error of the reference itself: root mean square of the standard error of the mean, estimated from its parts.
    pub error: f64,
    /// Samples per pixel.
    pub samples: u32,
}

impl Reference {
    pub(super) fn render(subject: &Subject, plan: &Plan, go_on: &mut dyn FnMut(u32, u32) -> bool) -> Option<Self> {
        let samples = (plan.reference_samples / PARTS).max(8);
        // Blur by ray footprints would remain in the mean of all parts without showing in their differences.
        let sharpness = Some(samples * PARTS);
        let how = Stochastic { min_samples: samples, max_samples: samples, sharpness, ..Stochastic::default() };
        let (mut sums, mut veils): (Vec<[f64; 4]>, Vec<[f64; 4]>) = (Vec::new(), Vec::new());
        let mut parts: Vec<Vec<[f64; 4]>> = Vec::new();
        let mut width = 0;
        for part in 0..PARTS {
            if !go_on(part, PARTS) {
                return None;
            }
            let settings = Settings {
                sampling: Sampling::Stochastic(Stochastic { space: subject.space(), ..how }),
                // No compared rendering uses these seeds.
                seed: plan.seed.wrapping_add(0x5eed_0000 + u64::from(part)),
                depth: subject.base.depth.and(Some(MAX_DEPTH)).or(deep(subject)),
                cutoff: 1e-6,
                layers: false,
                ..subject.base.clone()
            };
            let picture = render(&subject.job(&settings, subject.accel), &()).picture;
            width = picture.width;
            add(&mut sums, &picture.beauty);
            add(&mut veils, &picture.veil);
            parts.push(codes(&picture, subject));
        }
        let height = u32::try_from(sums.len()).unwrap_or(u32::MAX).checked_div(width).unwrap_or(0);
        let mean = Picture { veil: means(&veils), ..Picture::of(width, height, means(&sums)) };
        let pixels = codes(&mean, subject);
        let is_transparent = pixels.iter().any(|p| p[3] != 1.0);
        let error = standard_error(&parts, channels(is_transparent));
        Some(Self { width, pixels, is_transparent, error, samples: samples * PARTS })
    }

    /// Number of channels compared: 3, or 4 with coverage.
    pub fn channels(&self) -> usize {
        channels(self.is_transparent)
    }
}

/// Adds one part, weighted by 1 / [`PARTS`].
fn add<const N: usize>(sums: &mut Vec<[f64; N]>, part: &[[f32; N]]) {
    sums.resize(part.len(), [0.0; N]);
    for (sum, pixel) in sums.iter_mut().zip(part) {
        (0..N).for_each(|c| sum[c] += f64::from(pixel[c]) / f64::from(PARTS));
    }
}

#[expect(clippy::cast_possible_truncation, reason = "the mean of single numbers as one of them")]
fn means<const N: usize>(sums: &[[f64; N]]) -> Vec<[f32; N]> {
    sums.iter().map(|sum| sum.map(|c| c as f32)).collect()
}

/// Maximum depth, to leave nothing out; `None` where the scene needs no bounces.
fn deep(subject: &Subject) -> Option<u32> {
    use crate::scene::features::{Feature, Features};
    let features = Features::of(subject.scene);
    let any = [Feature::Mirrors, Feature::Refraction, Feature::ThinTransmission].iter().any(|&f| features.has(f));
    any.then_some(MAX_DEPTH)
}

fn channels(is_transparent: bool) -> usize {
    if is_transparent { 4 } else { 3 }
}

/// Display codes of a picture, over its background or else over black.
pub(super) fn codes(picture: &Picture, subject: &Subject) -> Vec<[f64; 4]> {
    let developer = Developer::new(subject.output);
    let veil = |i: usize| picture.veil.get(i).filter(|_| subject.output.background.is_some());
    let coded = |(i, &pixel): (usize, &[f32; 4])| match veil(i) {
        Some(&veil) => developer.coded_through_glass(pixel, veil),
        None => developer.coded(pixel),
    };
    picture.beauty.iter().enumerate().map(coded).map(|pixel| pixel.map(f64::from)).collect()
}

/// Standard error of the mean of all parts, over all pixels and channels.
fn standard_error(parts: &[Vec<[f64; 4]>], channels: usize) -> f64 {
    let n = parts.len() as f64;
    let pixels = parts.first().map_or(0, Vec::len);
    let variance = |i: usize, c: usize| {
        let mean = parts.iter().map(|part| part[i][c]).sum::<f64>() / n;
        parts.iter().map(|part| (part[i][c] - mean) * (part[i][c] - mean)).sum::<f64>() / (n - 1.0)
    };
    let sum: f64 = (0..pixels).map(|i| (0..channels).map(|c| variance(i, c)).sum::<f64>()).sum();
    (sum / (pixels * channels).max(1) as f64 / n).sqrt()
}
