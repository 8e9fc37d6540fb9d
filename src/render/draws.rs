//! Numbers for random choices: the same in every run, with every structure and any number of threads.

use super::sobol::{self, mix};
use crate::accel::{Hit, Ray};
use crate::math::random::Random;

/// Steps of an additive recurrence that fills the unit square evenly: the inverse powers of the root of x³ = x + 1.
///
/// M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018).
const STEPS: [f32; 2] = [0.754_877_7, 0.569_840_3];

/// Position of a sample among those of its pixel: index `index` in a sequence that belongs to this pixel alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stream {
    pub key: u32,
    pub index: u32,
}

/// The random choices of one hit.
#[derive(Clone, Debug)]
pub(crate) struct Draws(From);

#[derive(Clone, Debug)]
enum From {
    /// Numbers decided by the hit alone.
    Hit(Random),
    /// Numbers of the sample's position in its stream; the second field is the dimension, which depends on the purpose.
    Stream(Stream, u32),
}

/// A set of points that fills the unit square evenly.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleSet {
    /// A lattice, shifted as a whole.
    Moved([f32; 2]),
    /// A part of a sequence, from index `first`.
    Part { key: u32, first: u32 },
}

/// Purpose of a random choice at a hit: each has numbers of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Lights,
    Facets,
    Surroundings,
    Roulette,
    ShadowQueue,
    Hotspot,
}

impl Draws {
    /// Returns the numbers of a hit. Without a stream for the sample, they depend only on the ray and its hit: equal rays get
    /// equal numbers. Otherwise they are the sample's elements of sequences that all samples of its pixel share, so that these
    /// together fill their domain evenly; `branch` tells the hits of one sample's ray tree apart.
    pub(crate) fn at(seed: u64, streams: &[Stream], branch: u32, ray: &Ray, hit: &Hit, purpose: Purpose) -> Self {
        if let Some(&stream) = streams.get(ray.sample as usize) {
            return Self::of(stream, branch, purpose);
        }
        let words = ray.origin.to_array().into_iter().chain(ray.dir.to_array()).chain([hit.t, hit.u, hit.v]);
        let start = seed ^ u64::from(hit.prim) ^ ((purpose as u64) << 32);
        let mixed = words.fold(start, |mixed, word| Random::new(mixed ^ u64::from(word.to_bits())).bits());
        Self(From::Hit(Random::new(mixed)))
    }

    /// Returns the numbers of a sample's position in its stream.
    pub(crate) fn of(stream: Stream, branch: u32, purpose: Purpose) -> Self {
        Self(From::Stream(stream, mix(branch, purpose as u32)))
    }

    /// Returns a set of `points` points, independent of those taken before.
    pub(crate) fn spread(&mut self, points: u32) -> SampleSet {
        match &mut self.0 {
            From::Hit(random) => SampleSet::Moved([random.unit(), random.unit()]),
            From::Stream(stream, dimension) => {
                *dimension = mix(*dimension, u32::MAX);
                SampleSet::Part { key: mix(stream.key, *dimension), first: stream.index.wrapping_mul(points) }
            }
        }
    }
}

impl SampleSet {
    /// The `k`th point of the set, both coordinates 0 ≤ x < 1.
    #[inline(always)]
    pub(crate) fn point(self, k: u32) -> [f32; 2] {
        match self {
            Self::Moved(shift) => [0, 1].map(|axis: usize| (shift[axis] + k as f32 * STEPS[axis]).fract()),
            Self::Part { key, first } => sobol::square(first.wrapping_add(k), key).map(below_one),
        }
    }
}

/// Rounds to f32, but never up to 1.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
fn below_one(x: f64) -> f32 {
    (x as f32).min(1.0_f32.next_down())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn a_hit_decides_its_numbers_and_its_neighbours_have_others() {
        let ray = |x: f32| Ray {
            origin: Vec3::X * x,
            t_min: 0.0,
            dir: Vec3::NEG_Z,
            t_max: 9.0,
            exclude: crate::accel::NO_PRIM,
            sample: 0,
        };
        let at = |seed, x| Draws::at(seed, &[], 0, &ray(x), &Hit { t: 1.0, ..Hit::MISS }, Purpose::Facets);
        let first = |seed, x| at(seed, x).spread(1).point(0);
        assert_eq!(first(0, 1.0), first(0, 1.0));
        assert_ne!(first(0, 1.0), first(1, 1.0));
        assert_ne!(first(0, 1.0), first(0, 1.0 + f32::EPSILON));
        let all = [
            Purpose::Lights,
            Purpose::Facets,
            Purpose::Surroundings,
            Purpose::Roulette,
            Purpose::ShadowQueue,
            Purpose::Hotspot,
        ];
        let mut points = all.map(|purpose| {
            let mut draws = Draws::at(0, &[], 0, &ray(1.0), &Hit { t: 1.0, ..Hit::MISS }, purpose);
            draws.spread(1).point(0).map(f32::to_bits)
        });
        points.sort_unstable();
        assert!(points.windows(2).all(|pair| pair[0] != pair[1]), "each purpose has its own");
    }

    #[test]
    fn points_fill_the_square_evenly() {
        let spread = SampleSet::Moved([0.3, 0.9]);
        let mut cells = [0; 64];
        for k in 0..640 {
            let [x, y] = spread.point(k);
            cells[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
        }
        assert!(cells.iter().all(|&n| (7..=13).contains(&n)), "{cells:?}");
    }

    #[test]
    fn the_samples_of_a_pixel_share_a_sequence_whatever_they_hit() {
        let ray = |sample| Ray {
            origin: Vec3::X * sample as f32,
            t_min: 0.0,
            dir: Vec3::NEG_Z,
            t_max: 9.0,
            exclude: crate::accel::NO_PRIM,
            sample,
        };
        let streams: Vec<Stream> = (0..64).map(|index| Stream { key: 5, index }).collect();
        let cell = |sample, branch, purpose| {
            let [x, y] = Draws::at(0, &streams, branch, &ray(sample), &Hit::MISS, purpose).spread(1).point(0);
            (x * 8.0) as usize * 8 + (y * 8.0) as usize
        };
        for (branch, purpose) in [(0, Purpose::Lights), (7, Purpose::Facets)] {
            let mut cells: Vec<usize> = (0..64).map(|sample| cell(sample, branch, purpose)).collect();
            cells.sort_unstable();
            assert!(cells.into_iter().eq(0..64), "{purpose:?}");
        }
        // Other branches and purposes draw from other sequences.
        let same =
            |a: (u32, Purpose), b: (u32, Purpose)| (0..64).filter(|&s| cell(s, a.0, a.1) == cell(s, b.0, b.1)).count();
        assert!(same((0, Purpose::Lights), (0, Purpose::Facets)) < 8);
        assert!(same((0, Purpose::Lights), (1, Purpose::Lights)) < 8);
    }
}
