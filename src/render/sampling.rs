//! How a picture is sampled: how many rays a pixel gets, where in it they lie, and when they are enough.

use crate::image::ToneMap;
use crate::named::names;

/// Which rays a pixel gets.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sampling {
    /// [`super::Settings::samples`] at the same places in every pixel; of 1 in its middle.
    #[default]
    Uniform,
    /// Its corners and its middle, and more where these differ.
    Adaptive(Adaptive),
    /// Random ones until their mean is certain.
    Stochastic(Stochastic),
}

/// Five rays in a square, the corners shared with the squares beside it; a quadrant that is worth it becomes a square of its
/// own (T. Whitted, "An Improved Illumination Model for Shaded Display", 1980). What lies between the first rays of a pixel and
/// of those beside it is missed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Which quadrants are split.
    pub split: Split,
    /// What they are split above, as that says.
    pub threshold: f32,
    /// How often a pixel's side is halved at most; at most [`Adaptive::MAX_LEVELS`].
    pub levels: u32,
    /// How often it is halved in any case; `levels` when that is less.
    pub min_levels: u32,
    /// In which numbers effects are counted; corners are compared in linear light after this exposure.
    pub space: ErrorSpace,
}

/// Which quadrants of a square are split.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Split {
    /// Those whose corner differs from the middle of the square: a channel, linear light after exposure, by more than the
    /// threshold. As the algorithm was published.
    Corners,
    /// Those in which the points that were traced on the border, by neighbours too, lie so far apart that the value of
    /// the pixel would be written by more than the threshold differently, were the quadrant as the one or as the other.
    #[default]
    Effect,
}

impl Adaptive {
    /// A square of the last level is the 256th part of a pixel's side.
    pub const MAX_LEVELS: u32 = 8;

    /// What is usual where quadrants are split so.
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

/// Rays at random places, added in rounds until the mean of a pixel is certain.
///
/// R. L. Cook, T. Porter, L. Carpenter, "Distributed Ray Tracing" (1984); M. A. Z. Dippé, E. H. Wold, "Antialiasing Through
/// Stochastic Sampling" (1985). With the same numbers area lights, rough surfaces and lenses are sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stochastic {
    /// What a pixel may be wrong by, the root of the mean squared error of its channels, each 0…1 after development.
    pub error: f32,
    /// How certain that is to be: a probability in 0.5…0.9999.
    pub confidence: f64,
    /// Rays of a pixel when all of them and its neighbours' agree, at least 1; raised to a power of two. From less than 4 on a
    /// pixel gets 4 wherever they do not look the same.
    pub min_samples: u32,
    /// Rays of a pixel at most; lowered to a power of two.
    pub max_samples: u32,
    /// Each ray is as sharp as one of so many in a pixel; `None`: of the most of them.
    pub sharpness: Option<u32>,
    /// Weights of the places in and around a pixel.
    pub filter: Filter,
    /// In which numbers errors are counted.
    pub space: ErrorSpace,
    /// What the whole picture may be wrong by, the root of its mean squared error in these numbers. With it, `error` is found
    /// so that the picture is just as exact as that.
    pub target: Option<f32>,
}

impl Stochastic {
    /// Fewest and most samples of a pixel as they are taken, powers of two.
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

/// Weight of a place by its distance from a pixel's middle, on each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// All of the pixel alike, nothing outside.
    #[default]
    Box,
    /// Falls to nothing at the middle of the next pixel.
    Tent,
}

/// The numbers in which errors are counted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ErrorSpace {
    /// Linear light as it is stored in an EXR.
    Linear,
    /// sRGB codes 0…1 of the developed picture.
    Display {
        /// Curve from scene light to display light.
        tone_map: ToneMap,
        /// Stops of brightening before that.
        exposure: f32,
    },
}

impl ErrorSpace {
    /// By how much light is multiplied before errors are counted.
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

/// How good a stochastic picture is to be, in a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// To see whether it is what was meant.
    Draft,
    /// To look at.
    #[default]
    Normal,
    /// To print and to measure.
    Final,
}

impl Quality {
    /// Root mean square error of a picture that is good enough for the purpose, codes 0..=1: about five, two and a half and
    /// one of 255 steps.
    pub const fn good_enough(self) -> f64 {
        match self {
            Self::Draft => 0.02,
            Self::Normal => 0.01,
            Self::Final => 0.004,
        }
    }

    /// What the word stands for: what comes below [`Quality::good_enough`] on models with textures, fine alpha, tinted glass
    /// and metal. Clear glass is just at that for a final picture; thin wires before a far pattern need the next word.
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

/// What came of the sampling of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sampled {
    /// Pixels of the picture.
    pub pixels: u64,
    /// Eye rays of each pixel, row by row; rays that pixels share count for each of them. Empty where all have as many.
    pub counts: Vec<u32>,
    /// Standard error of each pixel in the error space, the root of the mean over its channels; of stochastic sampling.
    pub errors: Vec<f32>,
    /// Eye rays in all.
    pub rays: u64,
    /// Of them those that were sent before the picture, to find what rays that are spread by chance seldom meet, and are none of
    /// its own.
    pub looked: u64,
    /// Pixels whose mean became as certain as was asked.
    pub met: u64,
    /// Pixels that were given up at the most rays allowed.
    pub at_most: u64,
    /// Eye rays beyond what made pixels certain, by their own estimates: rays come in rounds that double.
    pub spare: u64,
    /// How near it came to the error of the whole picture that was asked for, if one was.
    pub targeted: Option<Targeted>,
}

/// The error of a whole picture, the root of its mean squared error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Targeted {
    /// What was asked for.
    pub target: f32,
    /// What was expected from a part of the picture, before it was rendered.
    pub foretold: f64,
    /// What was estimated from all of it, by how its renderings differ; `None` of a single one.
    pub estimate: Option<f64>,
    /// Seconds of processor time that were expected, without those for finding out.
    pub foretold_cpu: f64,
    /// What it took.
    pub cpu: f64,
}

impl Sampled {
    /// Eye rays for each pixel on the average, whatever they were sent for; 0 without pixels.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn mean(&self) -> f64 {
        self.rays as f64 / self.pixels.max(1) as f64
    }

    /// Eye rays that the picture was made of: all but those that found out how many, or were traced again for another tile.
    pub fn own(&self) -> u64 {
        let each: u64 = self.counts.iter().copied().map(u64::from).sum();
        // Shared ones count for several pixels.
        if self.counts.is_empty() { self.rays } else { each.min(self.rays) }
    }

    /// Samples of a pixel on the average; 0 without pixels.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn samples(&self) -> f64 {
        self.own() as f64 / self.pixels.max(1) as f64
    }

    /// Most rays of a pixel.
    pub fn most(&self) -> u64 {
        self.counts.iter().copied().max().map_or_else(|| self.rays / self.pixels.max(1), u64::from)
    }

    /// Root of the mean squared error of the whole picture; `None` where nothing is known of it. Where there are several
    /// renderings it is an estimate; of one, the root of the mean squared standard error. That errs to the safe side, as samples
    /// spread evenly are better than it knows: in thirty-four pictures it was 1.23 to 2.44 times the true error, and in one of a
    /// shut-in room under a white sky, whose light hardly any ray finds, no more than that.
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn rmse(&self) -> Option<f64> {
        if let Some(estimate) = self.targeted.and_then(|targeted| targeted.estimate) {
            return Some(estimate);
        }
        // Sums side by side, none of which waits for another.
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
    /// A place, in pixels from the pixel's upper left corner, that is drawn by this filter's weight with a number 0 ≤ u < 1.
    ///
    /// Places are drawn, not weighed: every sample counts the same (M. Ernst, M. Stamminger, G. Greiner, "Filter Importance
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
