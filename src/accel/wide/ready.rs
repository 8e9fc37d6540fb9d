//! Eight rays of a wave made ready together, for kernels that then trace each by itself.

use super::node::Tree;
use super::padded::PaddedSlabs;
use super::slabs::BoxMargins;
use crate::accel::Ray;
use crate::accel::wave::Wave;
use crate::math::bounds::{BOX_RANGE, PARALLEL};
use crate::math::sight::Sight;
use crate::math::simd::{LANES, Simd};

/// A ray as boxes and blocks see it.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(super) struct ReadyRay {
    pub slabs: PaddedSlabs,
    pub sight: Sight,
    /// Hits count from here.
    pub t_min: f32,
    /// Hits count up to here.
    pub t_max: f32,
    /// Boxes are entered up to here.
    pub limit: f32,
}

/// Eight rays.
#[derive(Default)]
pub(super) struct Ready {
    pub rays: [ReadyRay; LANES],
    /// Those for which the bounds of padded boxes hold, and whose range is not empty.
    pub allowed: u32,
}

impl Ready {
    /// Takes the rays of a wave from `start` on, of which there is one at least.
    #[inline(always)]
    pub(super) fn take<B: BoxMargins, S: Simd, W: Wave>(&mut self, s: S, tree: &Tree, wave: &W, start: usize) {
        let rays = &wave.rays()[start..];
        let Columns { origin: o, dir: d, t_min, t_max } = Columns::of(s, rays);
        let zero = s.splat(0.0);

        let mut least = s.store(t_min);
        wave.adapt_t_min(start, &mut least[..rays.len().min(LANES)]);
        let t_min = s.load(&least);
        // A distance that overflows is no hit.
        let t_max = s.smaller(t_max, s.splat(f32::MAX));
        let (range, underflow) = (s.splat(B::RANGE), s.splat(B::UNDERFLOW));
        let from = s.sub(s.sub(t_min, s.mul(s.abs(t_min), range)), underflow);
        let limit = s.add(s.add(t_max, s.mul(s.abs(t_max), range)), underflow);

        let (far, size) = ([s.abs(o[0]), s.abs(o[1]), s.abs(o[2])], [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])]);
        let extent = s.splat(tree.extent);
        // Sums keep a NaN.
        let whole = s.add(extent, s.add(s.add(far[0], far[1]), far[2]));
        let length = s.add(s.add(size[0], size[1]), size[2]);
        let (least, most) = (s.splat(1.0 / BOX_RANGE), s.splat(BOX_RANGE));
        self.allowed = s.at_most(t_min, t_max)
            & s.at_most(least, whole)
            & s.at_most(whole, most)
            & s.at_most(least, length)
            & s.at_most(length, most);

        let parallel = s.mul(s.greater(size[0], s.greater(size[1], size[2])), s.splat(PARALLEL));
        let (mut inverse, mut first, mut last) = ([zero; 3], [zero; 3], [zero; 3]);
        for k in 0..3 {
            inverse[k] = s.div(s.splat(1.0), s.with_sign(s.greater(size[k], parallel), d[k]));
            let pad = s.mul(s.mul(s.add(extent, far[k]), s.splat(B::PAD)), s.abs(inverse[k]));
            let middle = s.mul(s.sub(zero, o[k]), inverse[k]);
            (first[k], last[k]) = (s.sub(middle, pad), s.add(middle, pad));
        }

        // Of equal components the first is the main one.
        let x = s.at_most(size[1], size[0]) & s.at_most(size[2], size[0]);
        let main = [x, !x & s.at_most(size[2], size[1])];
        let along = turned(s, d, main);
        let per_length = s.div(s.splat(1.0), along);
        let shear =
            [s.div(turned(s, [d[1], d[2], d[0]], main), along), s.div(turned(s, [d[2], d[0], d[1]], main), along)];
        let sheared = [turned(s, [o[1], o[2], o[0]], main), turned(s, [o[2], o[0], o[1]], main), turned(s, o, main)];

        let back = [s.signs(d[0]), s.signs(d[1]), s.signs(d[2])];
        let inverse = s.rows([inverse[0], inverse[1], inverse[2], from]);
        let first = s.rows([first[0], first[1], first[2], limit]);
        let last = s.rows([last[0], last[1], last[2], t_min]);
        let sight = s.rows([sheared[0], sheared[1], sheared[2], per_length]);
        let shear = s.rows([shear[0], shear[1], t_max, zero]);
        for (lane, ray) in self.rays.iter_mut().enumerate() {
            let bit = |mask: u32| mask >> lane & 1;
            let [ix, iy, iz, from] = inverse[lane];
            let [fx, fy, fz, limit] = first[lane];
            let [lx, ly, lz, t_min] = last[lane];
            let [ox, oy, oz, per_length] = sight[lane];
            let [p, q, t_max, _] = shear[lane];
            let octant = bit(back[0]) | bit(back[1]) << 1 | bit(back[2]) << 2;
            *ray = ReadyRay {
                slabs: PaddedSlabs { inverse: [ix, iy, iz], from, first: [fx, fy, fz], last: [lx, ly, lz], octant },
                sight: Sight {
                    origin: [ox, oy, oz],
                    per_length,
                    shear: [p, q],
                    main: 2 - 2 * bit(main[0]) - bit(main[1]),
                },
                t_min,
                t_max,
                limit,
            };
        }
    }
}

/// Rays in lanes, by axis.
struct Columns<S: Simd> {
    origin: [S::Lanes; 3],
    dir: [S::Lanes; 3],
    t_min: S::Lanes,
    t_max: S::Lanes,
}

impl<S: Simd> Columns<S> {
    /// The first eight rays, the last repeated where there are fewer.
    #[inline(always)]
    fn of(s: S, rays: &[Ray]) -> Self {
        let (mut from, mut to) = ([[0.0; 4]; LANES], [[0.0; 4]; LANES]);
        let last = rays.len() - 1;
        for lane in 0..LANES {
            let ray = &rays[lane.min(last)];
            let (o, d) = (ray.origin, ray.dir);
            from[lane] = [o.x, o.y, o.z, ray.t_min];
            to[lane] = [d.x, d.y, d.z, ray.t_max];
        }
        let ([ox, oy, oz, t_min], [dx, dy, dz, t_max]) = (s.columns(&from), s.columns(&to));
        Self { origin: [ox, oy, oz], dir: [dx, dy, dz], t_min, t_max }
    }
}

/// The first of three in the lanes of the first mask, the second in those of the second, else the third.
#[inline(always)]
fn turned<S: Simd>(s: S, of: [S::Lanes; 3], [first, second]: [u32; 2]) -> S::Lanes {
    s.choose(first, of[0], s.choose(second, of[1], of[2]))
}
