//! Sampling of a picture: the number of rays of a pixel, their positions in it, and when they are enough.

use crate::image::ToneMap;
use crate::named::names;

/// How many rays a pixel gets, and where.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sampling {
    /// [`super::Settings::samples`] rays at the same positions in every pixel; a single one in its centre.
    #[default]
    Uniform,
    /// Rays through the pixel's corners and centre, and more where these differ.
    Adaptive(Adaptive),
    /// Rays at random positions until their mean is certain.
    Stochastic(Stochastic),
}

/// Five rays in a square, the corners shared with adjacent squares; a quadrant that is worth it becomes a square of its own (T.
/// Whitted, "An Improved Illumination Model for Shaded Display", 1980). Details that fall between the first rays of adjacent
/// pixels are missed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Which quadrants are split.
    pub split: Split,
    /// Threshold above which quadrants are split, as defined by [`Split`].
    pub threshold: f32,
    /// Most times that a pixel's side is halved; at most [`Adaptive::MAX_LEVELS`].
    pub levels: u32,
    /// Number of times that the side is halved in any case; `levels` if that is less.
    pub min_levels: u32,
    /// Space in which effects are measured; corners are compared in linear light after its exposure.
    pub space: ErrorSpace,
}

/// Which quadrants of a square are split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Split {
    /// Quadrants whose corner differs from the centre of the square, in any channel of linear light after exposure, by more than
    /// the threshold: the algorithm as published.
    Corners,
    /// Quadrants whose traced border points, those of neighbours included, lie so far apart that the written value of the pixel
    /// would differ by more than the threshold if the whole quadrant were as the one or as the other.
    #[default]
    Effect,
}

impl Adaptive {
    /// A square of the last level has a side of 1/256 of a pixel's.
    pub const MAX_LEVELS: u32 = 8;

    /// Usual settings for this rule of splitting.
    pub fn usual(split: Split) -> Self {
        let space = ErrorSpace::default();
        match split {
            Split::Corners => Self { split, threshold: 0.05, levels: 3, min_levels: 0, space },
            Split::Effect => Self { split, threshold: 0.001, levels: 6, min_levels: 1, space },
        }
    }
}

impl Default for Adaptive {
    fn default() -> Self {
        Self::usual(Split::default())
    }
}

/// Rays at random positions, added in rounds until the mean of a pixel is certain.
///
/// R. L. Cook, T. Porter, L. Carpenter, "Distributed Ray Tracing" (1984); M. A. Z. Dippé, E. H. Wold, "Antialiasing Through
/// Stochastic Sampling" (1985). The same random numbers sample area lights, rough surfaces and lenses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stochastic {
    /// Allowed error of a pixel: the root of the mean squared error of its channels, each 0…1 after development.
    pub error: f32,
    /// Probability that the error is no larger than that, 0.5…0.9999.
    pub confidence: f64,
    /// Fewest rays of a pixel, taken when they and those of its neighbours all agree, at least 1; raised to a power of two. If it
    /// is less than 4, a pixel gets 4 wherever they do not look the same.
    pub min_samples: u32,
    /// Most rays of a pixel; lowered to a power of two.
    pub max_samples: u32,
    /// Each ray is as sharp as one of this many in a pixel; `None`: as one of `max_samples`.
    pub sharpness: Option<u32>,
    /// Weights of positions in and around a pixel.
    pub filter: Filter,
    /// Space in which errors are measured.
    pub space: ErrorSpace,
    /// Allowed error of the whole picture, the root of its mean squared error in this space. If given, `error` is chosen so that
    /// the picture just meets it.
    pub target: Option<f32>,
}

impl Stochastic {
    /// Fewest and most samples of a pixel, rounded to powers of two.
    pub(super) fn powers(&self) -> (u32, u32) {
        let most = 1 << self.max_samples.max(1).ilog2();
        let fewest = self.min_samples.max(1).checked_next_power_of_two().unwrap_or(most);
        (fewest.min(most), most)
    }
}

impl Default for Stochastic {
    fn default() -> Self {
        Quality::default().stochastic()
    }
}

/// Weight of a position by its distance from a pixel's centre, on each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// Constant within the pixel, zero outside.
    #[default]
    Box,
    /// Falls linearly to zero at the centre of the next pixel.
    Tent,
}

/// Space in which errors are measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorSpace {
    /// Linear light, as stored in an EXR.
    Linear,
    /// sRGB codes 0…1 of the developed picture.
    Display {
        /// Curve from scene light to display light.
        tone_map: ToneMap,
        /// Stops of exposure before that.
        exposure: f32,
    },
}

impl ErrorSpace {
    /// Factor applied to light before errors are measured.
    pub(super) fn gain(self) -> f32 {
        match self {
            Self::Linear => 1.0,
            Self::Display { exposure, .. } => libm::exp2f(exposure),
        }
    }
}

impl Default for ErrorSpace {
    fn default() -> Self {
        Self::Display { tone_map: ToneMap::default(), exposure: 0.0 }
    }
}

/// Quality of a stochastic picture, in a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// To check that the picture is the intended one.
    Draft,
    /// To look at.
    #[default]
    Normal,
    /// To print and to measure.
    Final,
}

impl Quality {
    /// Root mean square error of a picture that is good enough for the purpose, codes 0..=1: about five, two and a half and one
    /// of 255 steps.
    pub const fn good_enough(self) -> f64 {
        match self {
            Self::Draft => 0.02,
            Self::Normal => 0.01,
            Self::Final => 0.004,
        }
    }

    /// Settings for this quality: they stay below [`Quality::good_enough`] on models with textures, fine alpha, tinted glass and
    /// metal. Clear glass just reaches it in a final picture; thin wires before a distant pattern need the next quality.
    pub fn stochastic(self) -> Stochastic {
        let (error, min_samples, max_samples) = match self {
            Self::Draft => (0.25, 1, 64),
            Self::Normal => (0.08, 1, 256),
            Self::Final => (0.035, 1, 1024),
        };
        Stochastic {
            error,
            confidence: 0.95,
            min_samples,
            max_samples,
            sharpness: None,
            filter: Filter::default(),
            space: ErrorSpace::default(),
            target: None,
        }
    }
}

/// Statistics of the sampling of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sampled {
    /// Number of pixels of the picture.
    pub pixels: u64,
    /// Eye rays of each pixel, row by row; a ray shared by pixels counts for each of them. Empty where all have the same number.
    pub counts: Vec<u32>,
    /// Standard error of each pixel in the error space, the root mean square over its channels; only in stochastic sampling.
    pub errors: Vec<f32>,
    /// Number of eye rays.
    pub rays: u64,
    /// Eye rays sent before the picture, to find light that randomly spread rays seldom hit, and not part of the picture.
    pub looked: u64,
    /// Number of pixels whose mean became as certain as asked.
    pub met: u64,
    /// Number of pixels that were given up at the most rays allowed.
    pub at_most: u64,
    /// Eye rays beyond those that made pixels certain, by their own estimates: rays come in rounds that double.
    pub spare: u64,
    /// Outcome of a target for the error of the whole picture, if one was given.
    pub targeted: Option<Targeted>,
}

/// Error of a whole picture, the root of its mean squared error, against its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Targeted {
    /// The target.
    pub target: f32,
    /// Error predicted from a part of the picture, before it was rendered.
    pub foretold: f64,
    /// Error estimated from the whole picture, by how its renderings differ; `None` for a single rendering.
    pub estimate: Option<f64>,
    /// Predicted processor time, seconds, without that of the prediction itself.
    pub foretold_cpu: f64,
    /// Actual processor time, seconds.
    pub cpu: f64,
}

impl Sampled {
    /// Mean number of eye rays a pixel, whatever their purpose; 0 without pixels.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn mean(&self) -> f64 {
        self.rays as f64 / self.pixels.max(1) as f64
    }

    /// Eye rays that the picture is made of: all but those that were sent to plan it, or traced again for another tile.
    pub fn own(&self) -> u64 {
        let each: u64 = self.counts.iter().copied().map(u64::from).sum();
        // Shared rays count for several pixels.
        if self.counts.is_empty() { self.rays } else { each.min(self.rays) }
    }

    /// Mean number of samples a pixel; 0 without pixels.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn samples(&self) -> f64 {
        self.own() as f64 / self.pixels.max(1) as f64
    }

    /// Most rays of any pixel.
    pub fn most(&self) -> u64 {
        self.counts.iter().copied().max().map_or_else(|| self.rays / self.pixels.max(1), u64::from)
    }

    /// Root of the mean squared error of the whole picture; `None` if it is unknown. With several renderings it is an estimate;
    /// with one, the root of the mean squared standard error, which errs on the safe side, as evenly spread samples are better
    /// than it assumes: in thirty-four pictures it was 1.23 to 2.44 times the true error, and in one of a closed room under a
    /// white sky, whose light hardly any ray finds, no more than that.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn rmse(&self) -> Option<f64> {
        if let Some(estimate) = self.targeted.and_then(|targeted| targeted.estimate) {
            return Some(estimate);
        }
        // Parallel sums without dependencies on each other.
        let mut sums = [0.0; 8];
        for errors in self.errors.chunks(sums.len()) {
            sums.iter_mut().zip(errors).for_each(|(sum, &error)| *sum += f64::from(error) * f64::from(error));
        }
        let sum: f64 = sums.iter().sum();
        (!self.errors.is_empty()).then(|| (sum / self.errors.len() as f64).sqrt())
    }
}

names!(Filter, "filter", Box => "box", Tent => "tent");
names!(Split, "rule for splitting", Corners => "corners", Effect => "effect");
names!(Quality, "quality", Draft => "draft", Normal => "normal", Final => "final");

impl Filter {
    /// Draws a position, in pixels from the pixel's upper left corner, by the filter's weight from a number 0 ≤ u < 1.
    ///
    /// Positions are drawn, not weighted: every sample counts the same (M. Ernst, M. Stamminger, G. Greiner, "Filter Importance
    /// Sampling", 2006).
    #[inline(always)]
    pub(super) fn place(self, u: f64) -> f64 {
        match self {
            Self::Box => u,
            Self::Tent => {
                let rises = u < 0.5;
                let root = (if rises { 2.0 * u } else { 2.0 - 2.0 * u }).sqrt();
                if rises { root - 0.5 } else { 1.5 - root }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tent_has_its_top_over_the_middle_and_ends_over_the_next() {
        let place = |u| Filter::Tent.place(u);
        assert_eq!((place(0.0), place(0.5)), (-0.5, 0.5));
        assert!((place(1.0 - 1e-12) - 1.5).abs() < 1e-5);
        // An eighth of a tent's area lies in its outer half on each side.
        assert!((place(0.125) - 0.0).abs() < 1e-12 && (place(0.875) - 1.0).abs() < 1e-12);
        let mean = (0..1000).map(|i| place((f64::from(i) + 0.5) / 1000.0)).sum::<f64>() / 1000.0;
        assert!((mean - 0.5).abs() < 1e-9, "{mean}");
    }

    #[test]
    fn samples_of_a_picture_are_those_of_its_pixels_and_not_what_was_looked_with() {
        let counts = vec![4, 8, 2, 2];
        let of = |counts, rays| Sampled { pixels: 4, counts, rays, looked: rays / 2, ..Sampled::default() };
        let stochastic = of(counts.clone(), 100);
        assert_eq!((stochastic.own(), stochastic.samples(), stochastic.most()), (16, 4.0, 8));
        assert_eq!(stochastic.mean(), 25.0);
        assert_eq!(of(counts, 12).own(), 12, "adaptive sampling shares rays");
        assert_eq!(of(Vec::new(), 36).samples(), 9.0, "uniform sampling counts none");
    }

    #[test]
    fn a_better_quality_asks_for_less_error() {
        let errors = Quality::ALL.iter().map(|q| q.stochastic().error).collect::<Vec<_>>();
        assert!(errors.windows(2).all(|pair| pair[0] > pair[1]), "{errors:?}");
    }
}
