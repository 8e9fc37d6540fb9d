//! Numbers for random choices: the same in every run, for every structure and any number of threads.

use crate::accel::{Hit, Ray};
use crate::math::random::Random;

/// Steps of a sequence in the unit square that leaves no gaps: the inverse powers of the root of x³ = x + 1.
///
/// M. Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences" (2018).
const STEPS: [f32; 2] = [0.754_877_7, 0.569_840_3];

/// The random choices of one hit.
#[derive(Clone, Debug)]
pub(crate) struct Draws(Random);

/// Points that fill the unit square evenly, moved as a whole.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spread {
    shift: [f32; 2],
}

impl Draws {
    /// Those of a hit; nothing but the ray and where it ended decides them.
    pub(crate) fn at(seed: u64, ray: &Ray, hit: &Hit) -> Self {
        let words = ray.origin.to_array().into_iter().chain(ray.dir.to_array()).chain([hit.t, hit.u, hit.v]);
        let start = seed ^ u64::from(hit.prim);
        Self(Random::new(words.fold(start, |mixed, word| Random::new(mixed ^ u64::from(word.to_bits())).bits())))
    }

    /// A sequence that is independent of those taken before.
    pub(crate) fn spread(&mut self) -> Spread {
        Spread { shift: [self.0.unit(), self.0.unit()] }
    }
}

impl Spread {
    /// Its `k`th point, both coordinates 0 ≤ x < 1.
    pub(crate) fn point(self, k: u32) -> [f32; 2] {
        [0, 1].map(|axis: usize| (self.shift[axis] + k as f32 * STEPS[axis]).fract())
    }
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
        let first = |seed, x| Draws::at(seed, &ray(x), &Hit { t: 1.0, ..Hit::MISS }).spread().point(0);
        assert_eq!(first(0, 1.0), first(0, 1.0));
        assert_ne!(first(0, 1.0), first(1, 1.0));
        assert_ne!(first(0, 1.0), first(0, 1.0 + f32::EPSILON));
    }

    #[test]
    fn points_fill_the_square_evenly() {
        let spread = Spread { shift: [0.3, 0.9] };
        let mut cells = [0; 64];
        for k in 0..640 {
            let [x, y] = spread.point(k);
            cells[(x * 8.0) as usize * 8 + (y * 8.0) as usize] += 1;
        }
        assert!(cells.iter().all(|&n| (7..=13).contains(&n)), "{cells:?}");
    }
}
