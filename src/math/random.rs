//! Pseudorandom numbers, identical in every run.

use super::Vec3;

/// Generator by G. Steele, D. Lea, C. Flood, *Fast Splittable Pseudorandom Number Generators* (SplitMix), 2014.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates a stream; different seeds give different streams.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform 0 ≤ x < 1, a multiple of 2⁻²⁴.
    #[expect(clippy::cast_precision_loss, reason = "24 bits fit")]
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    /// Uniform 0 ≤ i < n; 0 for n = 0.
    #[expect(clippy::cast_possible_truncation, reason = "less than n")]
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n.max(1) as u64) as usize
    }

    /// Uniform point in the cube −1..1.
    pub fn cube(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
    }

    /// Uniformly distributed unit vector.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.cube();
            if (1e-3..=1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_numbers_each_time_and_other_seeds_give_others() {
        let first = |seed| Random::new(seed).bits();
        // The generator's published first output for seed 0.
        assert_eq!(first(0), 0xe220_a839_7b1d_cdaf);
        assert_ne!(first(1), first(2));
    }

    #[test]
    fn directions_are_of_unit_length_and_point_everywhere() {
        let mut random = Random::new(3);
        let sum = (0..4000).map(|_| random.direction()).inspect(|d| assert!(d.is_normalized())).sum::<Vec3>();
        assert!(sum.length() < 200.0, "{sum}");
    }
}
