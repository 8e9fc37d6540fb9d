//! Decides which quadrants are worth splitting.

use crate::image::Developer;
use crate::math::Vec3;
use crate::render::certainty::output;
use crate::render::frame::Frame;
use crate::render::sampling::{Adaptive, Split};
use crate::render::whitted::Sample;

/// Colour to compare: linear light over the background, and the transparent share where there is no background.
pub(super) type Color = [f32; 4];

/// Range of the colours of points, channel by channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Span {
    least: Color,
    most: Color,
}

impl Span {
    /// Range of no points.
    pub(super) const NOTHING: Self = Self { least: [f32::INFINITY; 4], most: [f32::NEG_INFINITY; 4] };

    pub(super) fn add(&mut self, color: Color) {
        for (c, value) in color.into_iter().enumerate() {
            self.least[c] = self.least[c].min(value);
            self.most[c] = self.most[c].max(value);
        }
    }
}

/// Judges all quadrants of a picture.
pub(super) struct Judge {
    split: Split,
    threshold: f32,
    /// Factor that the exposure applies to linear light.
    gain: f32,
    /// Display curve; `None`: errors are measured in linear light.
    curve: Option<Curve>,
    background: Option<Vec3>,
}

impl Judge {
    pub(super) fn new(frame: &Frame, how: &Adaptive) -> Self {
        let curve = output(how.space, Some(Vec3::ZERO)).map(|output| Curve::new(&Developer::new(&output)));
        let gain = how.space.gain();
        Self { split: how.split, threshold: how.threshold, gain, curve, background: frame.background }
    }

    /// Linear light over the background; without one, the transparent share takes the fourth channel, as it shows in the
    /// picture's alpha.
    pub(super) fn color(&self, sample: &Sample) -> Color {
        let color = sample.radiance + sample.through * self.background.unwrap_or(Vec3::ZERO);
        let clear = if self.background.is_some() { 0.0 } else { sample.through.element_sum() / 3.0 };
        color.extend(clear).to_array()
    }

    /// Whether all traced points of a quadrant decide about splitting it, or only its corner and the middle.
    pub(super) fn looks_at_all(&self) -> bool {
        self.split == Split::Effect
    }

    /// Whether a corner differs from the middle by more than the threshold, in linear light after exposure.
    pub(super) fn differs(&self, corner: Color, middle: Color) -> bool {
        let gain = |c: usize| if c < 3 { self.gain } else { 1.0 };
        (0..4).any(|c| (corner[c] - middle[c]).abs() * gain(c) > self.threshold)
    }

    /// Whether a pixel's colour has changed so much since it was judged that all its quadrants have to be judged again.
    pub(super) fn is_other(&self, looked: Color, now: Color) -> bool {
        /// Fraction by which a channel may change: the slope of the display's curve changes less.
        const PART: f32 = 0.25;
        (0..4).any(|c| (looked[c] - now[c]).abs() > PART * looked[c].abs().min(now[c].abs()))
    }

    /// Whether the written pixel of this colour would change by more than the threshold if `share` of it took any colour of the
    /// span.
    pub(super) fn matters(&self, pixel: Color, span: &Span, share: f32) -> bool {
        (0..4).any(|c| {
            let reach = 0.5 * share * (span.most[c] - span.least[c]);
            let (low, high) = ((pixel[c] - reach).max(0.0), pixel[c] + reach);
            let change = match &self.curve {
                Some(curve) if c < 3 => curve.code(high) - curve.code(low),
                _ => high - low,
            };
            change > self.threshold
        })
    }
}

/// Codes of greys of linear light, interpolated linearly in a table with evenly spaced ratios in every doubling.
struct Curve {
    codes: Vec<f32>,
}

impl Curve {
    /// Exponents (biased) of the darkest and the brightest value of the table.
    const ENDS: std::ops::Range<u32> = 127 - 14..127 + 12;
    /// Mantissa bits within one step of the table: 32 steps a doubling.
    const WITHIN: u32 = 23 - 5;

    fn new(developer: &Developer) -> Self {
        let values = (Self::ENDS.start << 5)..=(Self::ENDS.end << 5);
        let code = |value: f32| developer.coded([value, value, value, 1.0])[0];
        Self { codes: values.map(|step| code(f32::from_bits(step << Self::WITHIN))).collect() }
    }

    /// Code, 0…1, of linear light before exposure.
    #[expect(clippy::cast_precision_loss, reason = "18 bits")]
    fn code(&self, value: f32) -> f32 {
        let darkest = f32::from_bits(Self::ENDS.start << 23);
        if value <= darkest {
            return self.codes[0] * (value / darkest).max(0.0);
        }
        let bits = value.to_bits();
        let step = ((bits >> Self::WITHIN) - (Self::ENDS.start << 5)) as usize;
        let (Some(from), Some(to)) = (self.codes.get(step), self.codes.get(step + 1)) else {
            return self.codes[self.codes.len() - 1];
        };
        let part = (bits & ((1 << Self::WITHIN) - 1)) as f32 / (1 << Self::WITHIN) as f32;
        from + (to - from) * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::sampling::ErrorSpace;

    #[test]
    fn the_table_is_the_curve_of_greys() {
        let output = output(ErrorSpace::default(), Some(Vec3::ZERO)).expect("a display");
        let developer = Developer::new(&output);
        let curve = Curve::new(&developer);
        for value in [0.0_f32, 1e-6, 1e-4, 0.003, 0.02, 0.18, 0.5, 0.77, 1.0, 3.0, 100.0, 1e6] {
            let expected = developer.coded([value, value, value, 1.0])[0];
            assert!((curve.code(value) - expected).abs() < 4e-4, "{value}: {} {expected}", curve.code(value));
        }
        assert_eq!((curve.code(-1.0), curve.code(f32::INFINITY)), (0.0, curve.code(1e30)));
    }
}
