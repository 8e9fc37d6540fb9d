//! Preparation of eight rays of a batch at once, for kernels that trace each of them alone.

use super::node::Tree;
use super::padded::{PaddedSlabs, Padding};
use super::slabs::BoxMargins;
use crate::accel::query_batch::{Pencil, QueryBatch};
use crate::accel::{NO_PRIM, Ray};
use crate::math::Vec3;
use crate::math::sight::Sight;
use crate::math::simd::{LANES, Row, Simd};
use bytemuck::{Pod, Zeroable};

/// A ray prepared for boxes and blocks: rows of four numbers, each of which is stored at once.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct PreparedRay {
    pub slabs: PaddedSlabs,
    pub sight: Sight,
    /// Largest t of a hit.
    pub t_max: f32,
}

/// Eight prepared rays.
pub(super) struct PreparedRays {
    pub rays: [PreparedRay; LANES],
    /// Smallest t of a hit.
    pub t_min: Row,
    /// Excluded prims.
    pub exclude: [u32; LANES],
    /// Bit mask of the rays for which the bounds of padded boxes hold, and whose range is not empty.
    pub allowed: u32,
}

impl Default for PreparedRays {
    fn default() -> Self {
        Self { rays: [PreparedRay::zeroed(); LANES], t_min: [0.0; LANES], exclude: [NO_PRIM; LANES], allowed: 0 }
    }
}

impl PreparedRays {
    /// Prepares the rays of a batch from `start` on, of which there must be at least one.
    #[inline(always)]
    pub(super) fn take<B: BoxMargins, S: Simd, W: QueryBatch>(&mut self, s: S, tree: &Tree, batch: &W, start: usize) {
        let rays = &batch.rays()[start..];
        let Columns { origin: o, dir: d, t_min, t_max } = match batch.pencil() {
            Some(pencil) if rays.len() >= LANES => Columns::of_pencil(s, &pencil, start),
            _ => Columns::of(s, rays),
        };
        let last = rays.len() - 1;
        self.exclude = std::array::from_fn(|lane| batch.exclude(start + lane.min(last)));
        self.t_min = s.store(t_min);
        batch.adapt_t_min(start, &mut self.t_min[..rays.len().min(LANES)]);
        let t_min = s.load(&self.t_min);
        // An overflowing distance is no hit; a NaN stays NaN.
        let t_max = s.smaller(s.splat(f32::MAX), t_max);
        let zero = s.splat(0.0);
        let (from, limit) = (s.greater(B::started_lanes(s, t_min), zero), B::widened_lanes(s, t_max));

        let Padding { inverse, first, last, allowed } = Padding::of::<B, _, LANES>(s, tree.extent, o, d);
        self.allowed = allowed & s.at_most(t_min, t_max) & s.at_most(zero, t_min);

        let size = [s.abs(d[0]), s.abs(d[1]), s.abs(d[2])];
        // Of equal components the first is the main one.
        let x = s.at_most(size[1], size[0]) & s.at_most(size[2], size[0]);
        let main = [x, !x & s.at_most(size[2], size[1])];
        let along = turned(s, d, main);
        let per_length = s.div(s.splat(1.0), along);
        let shear =
            [s.div(turned(s, [d[1], d[2], d[0]], main), along), s.div(turned(s, [d[2], d[0], d[1]], main), along)];
        let sheared = [turned(s, [o[1], o[2], o[0]], main), turned(s, [o[2], o[0], o[1]], main), turned(s, o, main)];

        let octant = octants(s, [s.signs(d[0]), s.signs(d[1]), s.signs(d[2])]);
        let main = s.choose(main[0], word(s, 0), s.choose(main[1], word(s, 1), word(s, 2)));
        let rows = [
            s.rows([inverse[0], inverse[1], inverse[2], from]),
            s.rows([first[0], first[1], first[2], limit]),
            s.rows([last[0], last[1], last[2], octant]),
            s.rows([sheared[0], sheared[1], sheared[2], per_length]),
            s.rows([shear[0], shear[1], main, t_max]),
        ];
        for (lane, ray) in self.rays.iter_mut().enumerate() {
            let [a, b, c, d, e] = &rows;
            *ray = bytemuck::cast([a[lane], b[lane], c[lane], d[lane], e[lane]]);
        }
    }
}

/// The bits of one word, in all lanes.
#[inline(always)]
fn word<S: Simd>(s: S, word: u32) -> S::Lanes {
    s.splat(f32::from_bits(word))
}

/// Octants of rays that run backwards along the axes in the lanes of these masks: words, by their bits.
#[inline(always)]
fn octants<S: Simd>(s: S, [x, y, z]: [u32; 3]) -> S::Lanes {
    let along_z = [
        s.choose(z, word(s, 4), word(s, 0)),
        s.choose(z, word(s, 5), word(s, 1)),
        s.choose(z, word(s, 6), word(s, 2)),
        s.choose(z, word(s, 7), word(s, 3)),
    ];
    s.choose(y, s.choose(x, along_z[3], along_z[2]), s.choose(x, along_z[1], along_z[0]))
}

/// Rays in lanes, by axis.
pub(super) struct Columns<S: Simd> {
    pub origin: [S::Lanes; 3],
    pub dir: [S::Lanes; 3],
    pub t_min: S::Lanes,
    pub t_max: S::Lanes,
}

impl<S: Simd> Columns<S> {
    /// Loads the eight rays of a pencil from `start` on.
    #[inline(always)]
    fn of_pencil(s: S, pencil: &Pencil, start: usize) -> Self {
        let (Vec3 { x: ox, y: oy, z: oz }, dirs) = (pencil.origin, pencil.eight(start));
        Self {
            origin: [s.splat(ox), s.splat(oy), s.splat(oz)],
            dir: [s.load(&dirs[0]), s.load(&dirs[1]), s.load(&dirs[2])],
            t_min: s.splat(0.0),
            t_max: s.splat(f32::INFINITY),
        }
    }

    /// Loads the first eight rays, the last repeated where there are fewer.
    #[inline(always)]
    pub(super) fn of(s: S, rays: &[Ray]) -> Self {
        let last = rays.len() - 1;
        let rays: [_; LANES] = std::array::from_fn(|lane| rays[lane.min(last)].in_fours());
        let [ox, oy, oz, t_min] = s.columns(rays.map(|[from, _]| from));
        let [dx, dy, dz, t_max] = s.columns(rays.map(|[_, to]| to));
        Self { origin: [ox, oy, oz], dir: [dx, dy, dz], t_min, t_max }
    }
}

/// Selects `of[0]` in the lanes of the first mask, `of[1]` in those of the second, else `of[2]`.
#[inline(always)]
fn turned<S: Simd>(s: S, of: [S::Lanes; 3], [first, second]: [u32; 2]) -> S::Lanes {
    s.choose(first, of[0], s.choose(second, of[1], of[2]))
}

#[cfg(test)]
mod tests {
    use super::super::slabs::Derived;
    use super::*;
    use crate::accel::Hit;
    use crate::accel::intersector::Exact;
    use crate::accel::query_batch::{ClosestBatch, NextBatch};
    use crate::accel::tests::scenes::{broken_rays, ray};
    use crate::math::Vec3;
    use crate::math::aabb::Aabb;
    use crate::math::bounds::{BOX_PAD, BOX_RANGE, PARALLEL};
    use crate::math::random::Random;
    use crate::math::shear::RaySpace;
    use crate::math::simd::{Kernel, Level};

    /// A tree without nodes around a cube.
    fn tree(extent: f32) -> Tree<'static> {
        let bounds = Aabb { lo: Vec3::splat(-extent), hi: Vec3::splat(extent * 0.5) };
        Tree { nodes: &[], blocks: &[], runs: &[], prims: &[], bounds, extent, depth: 0 }
    }

    struct Take<'a, W>(&'a Tree<'a>, &'a W, usize);

    impl<W: QueryBatch> Kernel for Take<'_, W> {
        type Output = PreparedRays;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> PreparedRays {
            let mut ready = PreparedRays::default();
            ready.take::<Derived, _, _>(s, self.0, self.1, self.2);
            ready
        }
    }

    fn take(level: Level, tree: &Tree, rays: &[Ray], start: usize) -> PreparedRays {
        level.run(Take(tree, &ClosestBatch { rays, pencil: None, filter: None, hits: &mut [], test: Exact }, start))
    }

    /// Prepares a ray by scalar arithmetic, the reference for lanes.
    fn plainly(tree: &Tree, ray: &Ray) -> (PreparedRay, f32) {
        let (space, _) = RaySpace::checked(ray.origin, ray.dir);
        let parallel = ray.dir.abs().max_element() * PARALLEL;
        let inverse = [0, 1, 2].map(|k| 1.0 / ray.dir[k].abs().max(parallel).copysign(ray.dir[k]));
        let far = ray.origin.abs();
        let drift = (tree.extent + ((far.x + far.y) + far.z)) * PARALLEL;
        let pad = |k: usize| ((tree.extent + far[k]) * BOX_PAD + drift) * inverse[k].abs();
        let octant = (0..3).fold(0, |octant, k| octant | u32::from(ray.dir[k].is_sign_negative()) << k);
        let t_max = ray.t_max.min(f32::MAX);
        let ready = PreparedRay {
            slabs: PaddedSlabs {
                inverse,
                from: Derived::started(ray.t_min).max(0.0),
                first: [0, 1, 2].map(|k| (0.0 - ray.origin[k]) * inverse[k] - pad(k)),
                limit: Derived::widened(t_max),
                last: [0, 1, 2].map(|k| (0.0 - ray.origin[k]) * inverse[k] + pad(k)),
                octant,
            },
            sight: Sight {
                origin: [ray.origin[space.x], ray.origin[space.y], ray.origin[space.z]],
                per_length: 1.0 / ray.dir[space.z],
                shear: [space.shear.0, space.shear.1],
                main: space.z as u32,
            },
            t_max,
        };
        (ready, ray.t_min)
    }

    /// Prepared ray of a lane, with its `t_min`.
    fn of(ready: &PreparedRays, lane: usize) -> (PreparedRay, f32) {
        (ready.rays[lane], ready.t_min[lane])
    }

    /// Rays of all octants and main axes, also with equal components and zeros, some with ranges.
    fn ordinary() -> Vec<Ray> {
        let mut random = Random::new(61);
        let part = |random: &mut Random| [1.0, -1.0, 0.0, -0.0, 1e-12, -1e-30, random.cube().x][random.below(7)];
        let mut rays = Vec::new();
        while rays.len() < 2000 {
            let dir = Vec3::new(part(&mut random), part(&mut random), part(&mut random));
            let dir = if rays.len() % 2 == 0 { dir } else { random.cube() * 100.0 };
            let range = [(0.0, f32::INFINITY), (-0.0, 2.0), (3.0, 3.0), (f32::MIN_POSITIVE, f32::MAX)];
            let (t_min, t_max) = range[random.below(4)];
            rays.push(Ray { t_min, t_max, ..ray(random.cube() * 3.0, dir) });
            rays.retain(|ray| ray.dir.abs().max_element() > 1e-9);
        }
        rays
    }

    #[test]
    fn eight_rays_are_made_ready_as_each_would_be_alone() {
        let (rays, tree) = (ordinary(), tree(2.0));
        for level in Level::all() {
            for start in (0..rays.len()).step_by(LANES) {
                let ready = take(level, &tree, &rays, start);
                assert_eq!(ready.allowed, 255, "{}: {:?}", level.name(), &rays[start..start + LANES]);
                for (lane, ray) in rays[start..].iter().take(LANES).enumerate() {
                    let (taken, expected) = (format!("{:?}", of(&ready, lane)), format!("{:?}", plainly(&tree, ray)));
                    assert_eq!(taken, expected, "{}: {ray:?}", level.name());
                }
            }
        }
    }

    #[test]
    fn where_fewer_than_eight_rays_are_left_the_last_is_repeated() {
        let (rays, tree) = (&ordinary()[..LANES + 3], tree(2.0));
        for level in Level::all() {
            let ready = take(level, &tree, rays, LANES);
            for lane in 0..LANES {
                let expected = plainly(&tree, &rays[LANES + lane.min(2)]);
                assert_eq!(format!("{:?}", of(&ready, lane)), format!("{expected:?}"), "{}", level.name());
            }
        }
    }

    #[test]
    fn hits_behind_others_count_from_these_on() {
        let (rays, tree) = (&ordinary()[..LANES + 3], tree(2.0));
        let after: Vec<Hit> = (0..rays.len()).map(|i| Hit { t: i as f32 * 0.25, ..Hit::MISS }).collect();
        for level in Level::all() {
            let mut hits = vec![Hit::MISS; rays.len()];
            let batch = NextBatch { rays, after: &after, filter: None, hits: &mut hits, test: Exact };
            for start in [0, LANES] {
                let ready = level.run(Take(&tree, &batch, start));
                for (i, lane) in (start..rays.len()).zip(0..LANES) {
                    let expected = plainly(&tree, &Ray { t_min: batch.t_min(i), ..rays[i] });
                    assert_eq!(format!("{:?}", of(&ready, lane)), format!("{expected:?}"), "{}", level.name());
                }
            }
        }
    }

    fn assert_allowed(tree: &Tree, ray: Ray, expected: bool) {
        let good = self::ray(Vec3::ZERO, Vec3::X);
        for level in Level::all() {
            for lane in 0..LANES {
                let mut rays = [good; LANES];
                rays[lane] = ray;
                let allowed = take(level, tree, &rays, 0).allowed >> lane & 1 == 1;
                assert_eq!(allowed, expected, "lane {lane} on {}: {ray:?}", level.name());
            }
        }
    }

    #[test]
    fn rays_that_may_hit_behind_their_start_are_not_allowed() {
        let good = ray(Vec3::splat(0.5), Vec3::new(0.3, -1.0, 0.2));
        for (t_min, allowed) in [(0.0, true), (-0.0, true), (-f32::MIN_POSITIVE, false), (-1.5, false)] {
            assert_allowed(&tree(2.0), Ray { t_min, ..good }, allowed);
        }
    }

    #[test]
    fn rays_that_cannot_hit_are_not_allowed() {
        for ray in broken_rays() {
            assert_allowed(&tree(2.0), ray, false);
        }
    }

    #[test]
    fn rays_with_numbers_too_large_or_too_small_for_padded_boxes_are_not_allowed() {
        let good = ray(Vec3::splat(0.5), Vec3::new(0.3, -1.0, 0.2));
        for axis in 0..3 {
            for (size, allowed) in [(0.5, true), (1.001, false), (4.0, false), (f32::MAX / BOX_RANGE, false)] {
                let (mut far, mut fast) = (good, good);
                far.origin[axis] = -BOX_RANGE * size;
                fast.dir[axis] = BOX_RANGE * size;
                assert_allowed(&tree(2.0), far, allowed);
                assert_allowed(&tree(2.0), fast, allowed);
            }
        }
        let least = 1.0 / BOX_RANGE;
        assert_allowed(&tree(2.0), Ray { dir: good.dir * least, ..good }, true);
        assert_allowed(&tree(2.0), Ray { dir: good.dir * (least * 0.5), ..good }, false);
        assert_allowed(&tree(2.0), Ray { dir: Vec3::splat(f32::from_bits(1)), ..good }, false);
    }

    #[test]
    fn scenes_too_large_or_too_small_for_padded_boxes_allow_no_ray() {
        let good = ray(Vec3::ZERO, Vec3::X);
        let extents = [(1.0, true), (0.5 * BOX_RANGE, true), (2.0 * BOX_RANGE, false), (f32::MAX, false)];
        let least = [(2.0 / BOX_RANGE, true), (0.5 / BOX_RANGE, false), (0.0, false)];
        for (extent, allowed) in extents.into_iter().chain(least) {
            for level in Level::all() {
                let ready = take(level, &tree(extent), &[good], 0);
                assert_eq!(ready.allowed, if allowed { 255 } else { 0 }, "{extent} on {}", level.name());
            }
        }
    }
}
