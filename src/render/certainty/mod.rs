//! Decides when the mean of a pixel's samples is certain enough.
//!
//! A pixel's samples are runs of one scrambled sequence: [`GROUPS`] groups, each of which fills the pixel evenly, and all
//! together more evenly than groups of different scramblings would. Each group has its own mean, and the spread of these bounds
//! the error of the overall mean (A. B. Owen, "Randomized QMC", 2013, chapter 17, for independent groups; where one group fills
//! the gaps of another, the overall mean is better than that, and the estimate errs on the safe side). What counts is the written
//! picture: the mean goes through the tone curve, so its error there is found by leaving out each group in turn (J. W. Tukey's
//! jackknife, 1958).
//!
//! Where few samples hit a bright light, most pixels that have not hit it yet look certain. So a pixel's samples are assumed to
//! vary no less than those of the fifth of its eight neighbours, ordered by variance.
//!
//! A pixel is judged repeatedly, and stops at the first round that finds it certain. Were each round 95 % certain, all together
//! would be less. [`factor`] corrects for that.

mod beside;
mod confidence;
mod even;

use super::frame::{Frame, Sum};
use super::{ErrorSpace, Stochastic};
use crate::image::{Developer, Output};
use crate::math::simd::Level;
use crate::math::{Vec3, Vec4};
use crate::scene::Background;
pub(in crate::render) use beside::Pixels;
pub(in crate::render) use confidence::factor;
pub(in crate::render) use even::{Even, Shown};

/// Number of groups of a pixel's samples.
pub(super) const GROUPS: usize = 8;

/// Number of samples that suffice by themselves; a pixel with fewer must look like its neighbours.
pub(super) const SURE: u32 = 4;

/// Judges all pixels of a picture.
pub(super) struct Certainty<'a> {
    /// `None`: errors are measured in linear light.
    developer: Option<Developer<'a>>,
    background: Option<Vec3>,
    /// Whether glass may stand before the background.
    has_veil: bool,
    /// Whether the written picture has an alpha channel that counts.
    transparent: bool,
    /// Factor that the exposure applies to light.
    gain: f32,
    /// Allowed error of a pixel.
    error: f32,
    /// Number of standard errors that must fit into the allowed error.
    factor: f32,
    level: Level,
}

/// How a pixel's mean is written; [`Certainty`] holds the background.
pub(super) fn output(space: ErrorSpace, background: Option<Vec3>) -> Option<Output> {
    let ErrorSpace::Display { tone_map, exposure } = space else { return None };
    Some(Output { tone_map, exposure, background: background.map(|b| b.to_array()), ..Output::default() })
}

impl<'a> Certainty<'a> {
    /// For a picture that is written as `output` says (`None`: as linear light), with each pixel within `error`, which must hold
    /// `factor` standard errors ([`factor`]).
    pub(super) fn new(
        output: Option<&'a Output>,
        background: Option<Vec3>,
        has_veil: bool,
        transparent: bool,
        error: f32,
        factor: f32,
    ) -> Self {
        let developer = output.map(Developer::new);
        let gain = output.map_or(1.0, |output| libm::exp2f(output.exposure));
        Self { developer, background, has_veil, transparent, gain, error, factor, level: Level::best() }
    }

    /// For a picture that is sampled as `how` says.
    pub(super) fn of(
        frame: &Frame,
        how: &Stochastic,
        output: Option<&'a Output>,
        background: Option<Background>,
    ) -> Self {
        let transparent = matches!(background, None | Some(Background::Transparent));
        Self::new(output, frame.background, frame.has_veil, transparent, how.error, frame.standard_errors)
    }

    /// Whether samples in this range agree within the allowed error: the pixel shows no detail that could be missed.
    pub(super) fn agree(&self, range: &Range) -> bool {
        (range.most - range.least).cmple(Vec4::splat(self.error)).all()
    }

    /// Whether the detail that makes a pixel uneven is thinner than a pixel: of the nine pixels around and including it, fewer
    /// than three lie on one side of the middle of its range. An edge has at least three on each side.
    pub(super) fn is_thin(&self, own: &Range, around: impl Iterator<Item = PixelSummary>) -> bool {
        let (wide, middle) = (own.most - own.least, (own.least + own.most) * 0.5);
        let channel = (0..self.channels()).fold(0, |most, c| if wide[c] > wide[most] { c } else { most });
        let (mut above, mut below) = (0, 0);
        for seen in around {
            above += u32::from(seen.color[channel] > middle[channel]);
            below += u32::from(seen.color[channel] <= middle[channel]);
        }
        above.min(below) < 3
    }

    /// Written value of grey light this bright, after exposure.
    pub(super) fn grey(&self, light: f32) -> f32 {
        let grey = light / self.gain;
        self.developer.as_ref().map_or(grey, |developer| developer.coded([grey, grey, grey, 1.0])[0])
    }

    /// Range of written values of grey light this bright, after exposure.
    pub(super) fn range_of(&self, light: f32) -> Range {
        let grey = self.grey(light);
        // Alpha is left open: the light may show whatever covers the pixel.
        let without_alpha = |alpha: f32| Vec4::new(grey, grey, grey, alpha);
        Range { least: without_alpha(f32::INFINITY), most: without_alpha(f32::NEG_INFINITY), brightest: light }
    }

    /// Greatest channel of the light of any of these groups, after exposure.
    fn brightest(&self, groups: &[Sum]) -> f32 {
        groups.iter().map(|group| self.light(group)).fold(0.0, f32::max)
    }

    /// Greatest channel of the light of a group, after exposure.
    #[inline(always)]
    fn light(&self, group: &Sum) -> f32 {
        group.radiance.max_element() / group.weight.max(f32::MIN_POSITIVE) * self.gain
    }

    /// Width of a range, the root of the mean over the channels.
    #[expect(clippy::cast_precision_loss, reason = "a handful of channels")]
    pub(super) fn contrast(&self, range: &Range) -> f32 {
        let wide = (range.most - range.least).max(Vec4::ZERO);
        let squares: f32 = (0..self.channels()).map(|c| wide[c] * wide[c]).sum();
        (squares / self.channels() as f32).sqrt()
    }

    /// Factor by which a sample as bright as `around` would move a pixel's mean farther than white does: 1 where none of these
    /// groups can have missed it, since they differ by about as much as one of its samples would make them.
    pub(super) fn beyond_white(&self, groups: &[Sum], around: f32) -> f32 {
        if around <= 1.0 || self.developer.is_none() {
            return 1.0;
        }
        let samples = groups.first().map_or(0.0, |group| group.weight);
        let least = groups.iter().map(|group| self.light(group)).fold(f32::INFINITY, f32::min);
        if (self.brightest(groups) - least) * samples >= 0.5 * around { 1.0 } else { around }
    }

    /// Whether two neighbouring pixels, of `samples` each, look so different that a detail may lie between them.
    pub(super) fn differ(&self, a: Vec4, b: Vec4, samples: u32) -> bool {
        (a - b).abs().cmpgt(Vec4::splat(Self::steep(samples) * self.error)).any()
    }

    /// Multiple of the allowed error by which pixels of `samples` may differ. With few samples they must look nearly the same, as
    /// there is no other evidence; with more they may differ by what shading changes from pixel to pixel, but not like the
    /// colours on both sides of an edge, which may reach into the pixel as far as samples lie apart.
    const fn steep(samples: u32) -> f32 {
        match samples {
            1 => 0.25,
            2..SURE => 1.0,
            _ => 2.0,
        }
    }

    /// Fraction of the allowed error that a pixel with this standard error uses, given the contrast around it; up to 1 it is
    /// certain enough.
    ///
    /// Samples that saw nothing of their surroundings do not vary, which is no proof that none of it is in the pixel. One sample
    /// of `count` that sees it makes the standard error `contrast / count`: unseen contrast is given half a sample (H. Jeffreys,
    /// "An Invariant Form for the Prior Probability in Estimation Problems", 1946).
    #[expect(clippy::cast_precision_loss, reason = "a count of samples")]
    pub(super) fn used(&self, standard_error: f32, contrast: f32, count: u32) -> f32 {
        let unseen = 0.5 * contrast / count.max(1) as f32;
        standard_error.max(unseen) * self.factor / self.error
    }

    /// Number of samples of `count` that a pixel using this fraction of its error could have done without: the error grows at
    /// most in inverse proportion to the number of samples, as for evenly spread ones.
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part")]
    pub(super) fn spare(&self, used: f32, count: u32) -> u32 {
        ((1.0 - used.clamp(0.0, 1.0)) * count.saturating_sub(GROUPS as u32) as f32) as u32
    }

    fn channels(&self) -> usize {
        if self.transparent { 4 } else { 3 }
    }
}

/// What the samples of a pixel show, in values of the written picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelSummary {
    /// Colour of the mean, up to the curvature of the tone curve.
    pub color: Vec4,
    /// Range of the samples.
    pub range: Range,
    /// Standard error of the mean.
    pub error: f32,
}

impl PixelSummary {
    /// No samples: agrees with everything.
    pub(super) const NOTHING: Self = Self { color: Vec4::NAN, range: Range::NOTHING, error: 0.0 };
}

/// Range of the colours of samples, channel by channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    least: Vec4,
    most: Vec4,
    /// Brightest channel of light, which may exceed what can be written.
    pub brightest: f32,
}

impl Range {
    /// Range of no samples.
    pub(super) const NOTHING: Self = Self { least: Vec4::INFINITY, most: Vec4::NEG_INFINITY, brightest: 0.0 };

    /// Union of both ranges.
    pub(super) fn with(self, other: Self) -> Self {
        Self {
            least: self.least.min(other.least),
            most: self.most.max(other.most),
            brightest: self.brightest.max(other.brightest),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::render::sobol::mix;

    fn see(judge: &Certainty, groups: &[Sum]) -> PixelSummary {
        let mut seen = PixelSummary::NOTHING;
        judge.see_each([groups].into_iter(), |all| seen = *all);
        seen
    }

    fn standard_error(judge: &Certainty, groups: &[Sum]) -> f32 {
        let mut error = f32::NAN;
        judge.each_standard_error([groups].into_iter(), |of_groups| error = of_groups);
        error
    }

    fn grey(light: f32, samples: f32) -> Sum {
        Sum { radiance: Vec3::splat(light * samples), through: Vec3::ZERO, solid: samples, weight: samples }
    }

    #[test]
    fn pixels_of_few_samples_must_look_more_alike_than_those_of_many() {
        let judge = Certainty::new(None, None, false, false, 0.1, 1.0);
        let differ = |step: f32, samples| judge.differ(Vec4::ZERO, Vec4::splat(step), samples);
        // The limits of one sample, of two and three, and of more, which allow for shading from pixel to pixel.
        for (samples, most) in [(1, 0.025), (2, 0.1), (3, 0.1), (4, 0.2), (256, 0.2)] {
            assert!(!differ(0.99 * most, samples) && differ(1.01 * most, samples), "{samples}");
        }
    }

    #[test]
    fn what_is_the_same_in_all_groups_is_certain() {
        let output = output(ErrorSpace::default(), None);
        let judge = Certainty::new(output.as_ref(), None, false, false, 0.01, factor(0.95));
        assert_eq!(standard_error(&judge, &[grey(0.3, 3.0); GROUPS]), 0.0);
        let agree = |samples: &[Sum]| judge.agree(&see(&judge, samples).range);
        assert!(agree(&[grey(0.3, 1.0); 4]) && !agree(&[grey(0.3, 1.0), grey(0.4, 1.0)]));
    }

    #[test]
    fn a_wire_is_thin_and_an_edge_is_not() {
        let judge = Certainty::new(None, None, false, false, 0.01, factor(0.95));
        let seen = |colors: [f32; 9]| colors.map(|light| see(&judge, &[grey(light, 1.0)]));
        let own = see(&judge, &[grey(0.0, 1.0), grey(1.0, 1.0)]);
        let is_thin = |colors: [f32; 9]| judge.is_thin(&own.range, seen(colors).into_iter());
        assert!(!is_thin([0.0, 0.0, 0.0, 0.3, 0.5, 0.9, 1.0, 1.0, 1.0]));
        assert!(is_thin([0.0, 0.0, 0.0, 0.3, 0.5, 0.9, 0.0, 0.0, 0.0]));
        assert!(is_thin([1.0, 1.0, 1.0, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0]));
        // At the border of the picture: an edge with no pixels beyond it.
        let mut at_border = seen([0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 1.0, 1.0, 1.0]);
        at_border[6..].fill(PixelSummary::NOTHING);
        assert!(judge.is_thin(&own.range, at_border.into_iter()));
    }

    #[test]
    fn rays_that_nobody_needed_are_those_beyond_the_error_that_was_allowed() {
        // Powers of two, whose products are exact.
        let judge = Certainty::new(None, None, false, false, 1.0 / 64.0, 2.0);
        assert_eq!(judge.used(1.0 / 128.0, 0.0, 64), 1.0);
        assert_eq!(judge.spare(1.0, 64), 0);
        // Half the error: half of the samples beyond the first [`GROUPS`].
        assert_eq!(judge.used(1.0 / 256.0, 0.0, 64), 0.5);
        assert_eq!(judge.spare(0.5, 72), 32);
        // Half a sample of the surroundings, out of 64.
        assert_eq!(judge.used(0.0, 1.0, 64), 1.0);
    }

    #[test]
    fn what_is_brighter_than_white_counts_as_much_more_until_it_has_been_seen() {
        let output = output(ErrorSpace::default(), None);
        let judge = Certainty::new(output.as_ref(), None, false, false, 0.01, factor(0.95));
        let mut groups = [grey(0.25, 4.0); GROUPS];
        assert_eq!(see(&judge, &[grey(64.0, 2.0), grey(0.5, 2.0)]).range.brightest, 64.0);
        assert_eq!(judge.beyond_white(&groups, 64.0), 64.0);
        assert_eq!(judge.beyond_white(&groups, 0.7), 1.0, "less than white is seen as it is");
        // One of four samples has hit it.
        groups[3] = grey(16.0, 4.0);
        assert_eq!(judge.beyond_white(&groups, 64.0), 1.0);
        let linear = Certainty::new(None, None, false, false, 0.01, factor(0.95));
        assert_eq!(linear.beyond_white(&[grey(0.25, 4.0); GROUPS], 64.0), 1.0, "contrast says so itself");
    }

    #[test]
    fn linear_errors_are_those_of_a_mean() {
        let judge = Certainty::new(None, None, false, false, 0.01, factor(0.95));
        let values = [0.1_f32, 0.3, 0.2, 0.5, 0.4, 0.2, 0.1, 0.2];
        let mean = values.iter().sum::<f32>() / 8.0;
        let expected = (values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / (8.0 * 7.0)).sqrt();
        let found = standard_error(&judge, &values.map(|v| grey(v, 5.0)));
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }

    /// Pixels of normal samples, in rounds that double, judged as in pictures.
    #[test]
    fn pixels_that_stop_at_the_first_content_look_are_right_as_often_as_asked() {
        let judge = Certainty::new(None, None, false, false, 0.05, factor(0.95));
        let mut random = Random::new(11);
        for spread in [0.1_f32, 0.3, 0.7, 1.5] {
            let (pixels, mut right) = (4000, 0);
            for _ in 0..pixels {
                let mut groups = [Sum::default(); GROUPS];
                let mut target = 1.0;
                loop {
                    for group in &mut groups {
                        while group.weight < target {
                            // Nearly normal, of variance 1.
                            let noise = (0..12).map(|_| random.unit()).sum::<f32>() - 6.0;
                            *group = group.plus(grey(noise * spread, 1.0), 1.0);
                        }
                    }
                    if judge.used(standard_error(&judge, &groups), 0.0, 1) <= 1.0 {
                        break;
                    }
                    target *= 2.0;
                }
                let all = groups.iter().fold(Sum::default(), |all, s| all.plus(*s, 1.0));
                right += u32::from((all.radiance.x / all.weight).abs() <= 0.05);
            }
            assert!(f64::from(right) >= 0.945 * f64::from(pixels), "{spread}: {right}");
        }
    }

    /// Means, over many pixels of constant brightness, of the squared errors and of the squared standard errors.
    fn squares(samples: u32, brightness: impl Fn([f64; 2], u32) -> f64, mean: f64) -> (f64, f64) {
        let judge = Certainty::new(None, None, false, false, 0.01, factor(0.95));
        let pixels = 2000;
        let (mut errors, mut estimates) = (0.0, 0.0);
        for pixel in 0..pixels {
            let mut groups = [Sum::default(); GROUPS];
            for i in 0..samples {
                let light = brightness(crate::render::sobol::point(i, pixel), mix(pixel, i));
                let group = &mut groups[(i * 8 / samples) as usize];
                *group = group.plus(grey(light as f32, 1.0), 1.0);
            }
            let all = groups.iter().fold(Sum::default(), |all, group| all.plus(*group, 1.0));
            errors += (f64::from(all.radiance.x / all.weight) - mean).powi(2);
            estimates += f64::from(standard_error(&judge, &groups)).powi(2);
        }
        (errors / f64::from(pixels), estimates / f64::from(pixels))
    }

    #[test]
    fn what_groups_differ_by_is_no_less_than_what_their_mean_is_off() {
        let edge = |[x, y]: [f64; 2], _: u32| f64::from(u8::from(y < 0.31 + 0.4 * x));
        let gradient = |[x, y]: [f64; 2], _: u32| 0.7 * x + 0.3 * y;
        // Pure noise is not stratified.
        let noise = |_: [f64; 2], random: u32| f64::from(random) / 4_294_967_296.0;
        for samples in [8, 32, 128] {
            for (what, (error, estimate), at_least) in [
                ("edge", squares(samples, edge, 0.51), 2.0),
                ("gradient", squares(samples, gradient, 0.5), 20.0),
                ("noise", squares(samples, noise, 0.5), 0.88),
            ] {
                assert!(estimate > at_least * error, "{what} of {samples}: {error:e} {estimate:e}");
                assert!(what != "noise" || estimate < 1.12 * error, "{what} of {samples}: {error:e} {estimate:e}");
            }
        }
    }
}
