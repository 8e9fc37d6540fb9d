//! Filtered lookups of a panorama, many side by side, each with its own blur.

use super::panorama::{Level, coordinates};
use crate::math::formula::{floor, log2, near_integer};
use crate::math::{Vec3, Vec4};

/// Number of lookups side by side.
pub(super) const LOOKUPS: usize = 64;

/// One value of every lookup.
pub(super) type Row<T = f32> = [T; LOOKUPS];

/// Coordinates, widths and weights of lookups.
pub(super) struct Lookups {
    /// Coordinates, both 0 … 1: around the horizon, and from the zenith down.
    pub around: Row,
    pub down: Row,
    /// Filter width of each lookup, radians across.
    pub angle: Row,
    /// Weight of each lookup; 0 for unused lanes.
    pub weight: Row,
}

/// Texels and weights of each lookup in one mip level.
pub(super) struct Taps {
    /// Indices of the four texels around each place: two of the upper row, then two of the lower.
    texels: [Row<u32>; 4],
    /// Offset of the place from the first texel, in texels, to the right and down.
    right: Row,
    down: Row,
}

impl Lookups {
    /// No lookups: all weights are 0.
    pub(super) const NONE: Self =
        Self { around: [0.0; LOOKUPS], down: [0.0; LOOKUPS], angle: [0.0; LOOKUPS], weight: [0.0; LOOKUPS] };

    /// Sets the coordinates from unit directions in the panorama's frame, given by axis. For a kernel.
    #[inline(always)]
    pub(super) fn look_along(&mut self, [x, y, z]: &[Row; 3]) {
        for k in 0..LOOKUPS {
            (self.around[k], self.down[k]) = coordinates(Vec3::new(x[k], y[k], z[k]));
        }
    }

    /// Weighted mean of all lookups, each interpolated between the two of the mip levels `copies` next to its width; `None` where
    /// all weights are 0. For a kernel.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "a few copies")]
    pub(super) fn mean(&self, copies: &[Level]) -> Option<Vec3> {
        let [whole, smaller @ ..] = copies else { return None };
        let (finest, coarsest) = (whole.angle(), smaller.len() as f32);
        let (mut fine, mut coarse, mut between) = ([0; LOOKUPS], [0; LOOKUPS], [0.0; LOOKUPS]);
        for k in 0..LOOKUPS {
            let level = log2((self.angle[k] / finest).max(1.0)).min(coarsest);
            let whole = floor(level);
            between[k] = level - whole;
            fine[k] = near_integer(whole).cast_unsigned();
            coarse[k] = near_integer((whole + 1.0).min(coarsest)).cast_unsigned();
        }
        let (mut near, mut far) = (Taps::NONE, Taps::NONE);
        near.find(self, &fine, [whole.width, whole.height]);
        far.find(self, &coarse, [whole.width, whole.height]);
        let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
        for k in 0..LOOKUPS {
            let weight = self.weight[k];
            if weight > 0.0 {
                let copy = |number: &Row<u32>| copies.get(number[k] as usize).map_or(&[][..], Level::texels);
                let light = near.read(k, copy(&fine)).lerp(far.read(k, copy(&coarse)), between[k]);
                sum += light * weight;
                weights += weight;
            }
        }
        (weights > 0.0).then(|| sum.truncate() / weights)
    }
}

impl Taps {
    pub(super) const NONE: Self = Self { texels: [[0; LOOKUPS]; 4], right: [0.0; LOOKUPS], down: [0.0; LOOKUPS] };

    /// Finds the texels in the mip levels with these numbers: level 0 is `width` × `height`, each next half as large. Without
    /// branches and casts, which keep compilers from vectorising.
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, reason = "sides are below 2²²")]
    #[expect(clippy::needless_range_loop, reason = "of several arrays, side by side")]
    pub(super) fn find(&mut self, lookups: &Lookups, copies: &Row<u32>, [width, height]: [u32; 2]) {
        for k in 0..LOOKUPS {
            let wide = (width >> copies[k]).max(1).cast_signed();
            let high = (height >> copies[k]).max(1).cast_signed();
            let (x, y) = (lookups.around[k] * wide as f32 - 0.5, lookups.down[k] * high as f32 - 0.5);
            let (left, top) = (floor(x), floor(y));
            (self.right[k], self.down[k]) = (x - left, y - top);
            // Left column and upper row; both may be -1.
            let (column, row) = (near_integer(left), near_integer(top));
            // At most one turn beyond, and once more for the half turn behind a pole.
            let around = |column: i32| if column >= wide { column - wide } else { column };
            let first = around(if column < 0 { column + wide } else { column });
            let second = around(first + 1);
            for j in 0..2 {
                let row = row + j;
                // Beyond a pole lies the same row, half a turn away.
                let over = (row < 0) | (row >= high);
                let turn = if over { wide >> 1 } else { 0 };
                let row = if row < 0 { 0 } else { row };
                let start = (if row >= high { high - 1 } else { row }).wrapping_mul(wide);
                let place = 2 * j as usize;
                self.texels[place][k] = start.wrapping_add(around(first + turn)).cast_unsigned();
                self.texels[place + 1][k] = start.wrapping_add(around(second + turn)).cast_unsigned();
            }
        }
    }

    /// Bilinear value of lookup k in its mip level.
    #[inline(always)]
    pub(super) fn read(&self, k: usize, texels: &[[f32; 3]]) -> Vec4 {
        let texel = |place: usize| {
            // Texels out of range read as black.
            let [x, y, z] = texels.get(self.texels[place][k] as usize).copied().unwrap_or_default();
            Vec4::new(x, y, z, 0.0)
        };
        let (right, down) = (self.right[k], self.down[k]);
        texel(0).lerp(texel(1), right).lerp(texel(2).lerp(texel(3), right), down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::math::simd::{self, Kernel, Simd};
    use crate::render::sky::panorama::Pyramid;
    use crate::scene::Panorama;
    use std::sync::Arc;

    fn pyramid(width: u32, height: u32, mut texel: impl FnMut() -> [f32; 3]) -> Pyramid {
        let texels = (0..width * height).map(|_| texel()).collect();
        Pyramid::new(&Panorama { name: String::new(), width, height, texels: Arc::new(texels), ..Panorama::default() })
    }

    struct Mean<'a>(&'a Pyramid, &'a Lookups);

    impl Kernel for Mean<'_> {
        type Output = Option<Vec3>;

        #[inline(always)]
        fn run<S: Simd>(self, _: S) -> Option<Vec3> {
            self.1.mean(&self.0.soft)
        }
    }

    /// One lookup by its definition: interpolated between the two mip levels next to its width.
    fn defined(sky: &Pyramid, at: (f32, f32), angle: f32) -> Vec3 {
        let last = sky.soft.len() - 1;
        let level = log2((angle / sky.finest()).max(1.0)).min(last as f32);
        let fine = level as usize;
        sky.soft[fine].at(at).lerp(sky.soft[(fine + 1).min(last)].at(at), level - fine as f32)
    }

    #[test]
    fn lookups_side_by_side_are_those_one_by_one_at_every_level_and_size() {
        let mut random = Random::new(3);
        for (width, height) in [(1, 1), (2, 1), (1, 8), (3, 2), (6, 3), (7, 3), (96, 48), (100, 51), (300, 150)] {
            let sky = pyramid(width, height, || [random.unit(), random.unit(), 9.0 * random.unit()]);
            for round in 0..8 {
                let mut lookups = Lookups::NONE;
                let (mut sum, mut weights) = (Vec3::ZERO, 0.0);
                for k in 0..LOOKUPS {
                    // All around, and exactly on the edges.
                    let place = |unit: f32| if unit < 0.1 { (unit * 20.0).floor() } else { unit };
                    (lookups.around[k], lookups.down[k]) = (place(random.unit()), place(random.unit()));
                    lookups.angle[k] = sky.finest() * (random.unit() * 10.0 - 1.0).exp2();
                    lookups.weight[k] = if k % 5 == round { 0.0 } else { random.unit() };
                    if lookups.weight[k] > 0.0 {
                        sum +=
                            defined(&sky, (lookups.around[k], lookups.down[k]), lookups.angle[k]) * lookups.weight[k];
                        weights += lookups.weight[k];
                    }
                }
                for level in simd::Level::all() {
                    let mean = level.run(Mean(&sky, &lookups));
                    assert_eq!(mean, Some(sum / weights), "{width}×{height}, {level:?}");
                }
            }
            assert_eq!(Lookups::NONE.mean(&sky.soft), None);
        }
    }

    #[test]
    fn an_even_sky_is_even_however_smooth() {
        let mut random = Random::new(4);
        for (width, height) in [(1, 1), (2, 1), (1, 8), (7, 3), (300, 150), (1000, 500)] {
            let sky = pyramid(width, height, || [2.0, 1.0, 0.5]);
            for k in 0..14_u8 {
                let mut lookups =
                    Lookups { angle: [sky.finest() * 1.5 * f32::from(k).exp2(); LOOKUPS], ..Lookups::NONE };
                lookups.weight = [1.0; LOOKUPS];
                lookups.around = std::array::from_fn(|_| random.unit());
                lookups.down = std::array::from_fn(|_| random.unit());
                let seen = lookups.mean(&sky.soft).expect("all count");
                assert!((seen - Vec3::new(2.0, 1.0, 0.5)).length() < 1e-4, "{width}×{height}: {seen}");
            }
        }
    }
}
