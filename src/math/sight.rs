//! Visibility of triangles to rays: exact verdicts where a filter in lanes is certain, and bounds of the distances of hits.
//!
//! As in [`triangles`](super::triangles), but with fused operations where the processor has them, and with bounds for each
//! triangle's own distance: intervals that contain the exact distances are enough to order most hits.

use bytemuck::{Pod, Zeroable};

use super::bounds::{EdgeMargins, HEIGHTS, WEIGHTS};
use super::simd::{Axis, LANES, Lanewise, Row, Simd};
use super::triangles::{Corners8, Verdicts};

/// A ray prepared for tests of blocks that also yield distances: its numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE).
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Sight {
    /// Origin along the axes in sheared order.
    pub origin: [f32; 3],
    /// Reciprocal of the direction's component along the last of these axes.
    pub per_length: f32,
    /// Components of the direction along the first two of these axes over that along the last.
    pub shear: [f32; 2],
    /// Axis of the direction's largest component.
    pub main: u32,
}

/// Axes in sheared order, by the ray's main axis; the last entry is padding, so that any two bits index an entry.
pub(super) static AXES: [[Axis; 3]; 4] = {
    let [x, y, z] = [Axis::new(0), Axis::new(1), Axis::new(2)];
    [[y, z, x], [z, x, y], [x, y, z], [x, y, z]]
};

/// Result of testing a ray against eight triangles.
pub struct BlockTest<S: Simd> {
    /// Triangles that the ray hits.
    pub verdicts: Verdicts,
    view: View<S, LANES>,
}

impl Sight {
    /// Tests eight triangles.
    #[inline(always)]
    pub fn test<S: Simd>(&self, s: S, corners: &Corners8) -> BlockTest<S> {
        let [ox, oy, oz] = [s.splat(self.origin[0]), s.splat(self.origin[1]), s.splat(self.origin[2])];
        let [p, q] = [s.splat(self.shear[0]), s.splat(self.shear[1])];
        let [x, y, z] = AXES[self.main as usize % 4];
        let [a, b, c] = corners;
        let (az, bz, cz) = (s.sub(s.along(a, z), oz), s.sub(s.along(b, z), oz), s.sub(s.along(c, z), oz));
        let (ax, ay) = (s.sub_mul(p, az, s.sub(s.along(a, x), ox)), s.sub_mul(q, az, s.sub(s.along(a, y), oy)));
        let (bx, by) = (s.sub_mul(p, bz, s.sub(s.along(b, x), ox)), s.sub_mul(q, bz, s.sub(s.along(b, y), oy)));
        let (cx, cy) = (s.sub_mul(p, cz, s.sub(s.along(c, x), ox)), s.sub_mul(q, cz, s.sub(s.along(c, y), oy)));
        let (verdicts, view) = view(s, [[ax, ay], [bx, by], [cx, cy]], [az, bz, cz]);
        BlockTest { verdicts, view }
    }
}

impl<S: Simd> BlockTest<S> {
    /// Bounds of the exact distances of the triangles that are hit for certain.
    ///
    /// The exact distance is the mean of the corners' heights, weighted by the exact edge values, all of one sign, over the
    /// direction's component. Edge values that err by e move the mean by 3 e times the spread of the heights over their sum
    /// S: half of the spread times the sum of the changes of the weights, 6 e/S. The roundings of heights, products, sums,
    /// the reciprocal and the last products are 10 u of the largest height; 16 u covers what they leave out.
    #[inline(always)]
    pub fn distances(&self, s: S, sight: &Sight) -> [S::Lanes; 2] {
        self.view.distances(s, s.splat(sight.per_length), [WEIGHTS, HEIGHTS])
    }
}

/// Rays side by side with the same main axis, prepared for tests against one triangle at a time; their numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE).
pub struct RowSight<S: Lanewise<N>, const N: usize> {
    /// Main axis of the rays.
    main: usize,
    /// Origins along the axes in sheared order.
    origin: [S::Lanes; 3],
    shear: [S::Lanes; 2],
    /// Reciprocals of the directions' components along the last of the axes.
    per_length: S::Lanes,
}

/// Rays side by side that prepare eight triangles at once, and test one after another.
pub trait Rows<S: Lanewise<N>, const N: usize> {
    /// Eight prepared triangles.
    type Ready;
    /// Result of testing the rays against one triangle.
    type BlockTest;

    /// Prepares eight triangles.
    fn ready<T: Simd>(&self, s: T, corners: &Corners8) -> Self::Ready;

    /// Tests one of eight prepared triangles, with a bit per ray. A hit behind the origin may be reported as a miss.
    fn test(&self, s: S, ready: &Self::Ready, lane: usize) -> (Verdicts, Self::BlockTest);

    /// Bounds of the exact distances of the rays that hit for certain.
    fn distances(&self, s: S, ready: &Self::Ready, lane: usize, test: &Self::BlockTest) -> [S::Lanes; 2];
}

impl<S: Lanewise<N>, const N: usize> RowSight<S, N> {
    /// Prepares rays, by axis and lane, whose largest components are along axis `z`, with the reciprocals of these.
    #[inline(always)]
    pub fn new(s: S, origin: &[[f32; N]; 3], dir: &[[f32; N]; 3], z: usize, per_length: &[f32; N]) -> Self {
        let axes = [(z + 1) % 3, (z + 2) % 3, z % 3];
        let per_length = s.load(per_length);
        Self {
            main: z,
            origin: [s.load(&origin[axes[0]]), s.load(&origin[axes[1]]), s.load(&origin[axes[2]])],
            shear: [s.mul(s.load(&dir[axes[0]]), per_length), s.mul(s.load(&dir[axes[1]]), per_length)],
            per_length,
        }
    }

    /// Corner of the triangle in a lane, relative to the origins.
    #[inline(always)]
    fn relative(&self, s: S, [x, y, z]: &[Row; 3], lane: usize) -> [S::Lanes; 3] {
        let [x, y, z] = [s.splat(x[lane % LANES]), s.splat(y[lane % LANES]), s.splat(z[lane % LANES])];
        [s.sub(x, self.origin[0]), s.sub(y, self.origin[1]), s.sub(z, self.origin[2])]
    }

    #[inline(always)]
    fn sheared(&self, s: S, [x, y, z]: [S::Lanes; 3]) -> [S::Lanes; 2] {
        [s.sub_mul(self.shear[0], z, x), s.sub_mul(self.shear[1], z, y)]
    }
}

impl<S: Lanewise<N>, const N: usize> Rows<S, N> for RowSight<S, N> {
    type Ready = Corners8;
    type BlockTest = View<S, N>;

    /// Puts the coordinates into sheared order.
    #[inline(always)]
    fn ready<T: Simd>(&self, s: T, corners: &Corners8) -> Corners8 {
        let axes = AXES[self.main % 4];
        let mut ready = [[[0.0; LANES]; 3]; 3];
        for (ready, rows) in ready.iter_mut().zip(corners) {
            for k in 0..3 {
                ready[k] = s.store(s.along(rows, axes[k]));
            }
        }
        ready
    }

    #[inline(always)]
    fn test(&self, s: S, [a, b, c]: &Corners8, lane: usize) -> (Verdicts, View<S, N>) {
        let (a, b, c) = (self.relative(s, a, lane), self.relative(s, b, lane), self.relative(s, c, lane));
        let sheared = [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)];
        view(s, sheared, [a[2], b[2], c[2]])
    }

    #[inline(always)]
    fn distances(&self, s: S, _: &Corners8, _: usize, view: &View<S, N>) -> [S::Lanes; 2] {
        view.distances(s, self.per_length, [WEIGHTS, HEIGHTS])
    }
}

/// Intermediate results of a verdict, from which distances are computed.
pub struct View<S: Lanewise<N>, const N: usize> {
    /// Edge values, and the bound of their error.
    edges: [S::Lanes; 3],
    error: S::Lanes,
    /// Corners along the ray's main axis, relative to its origin, and the largest of their sizes.
    heights: [S::Lanes; 3],
    height: S::Lanes,
}

/// Tests sheared corners and their heights against the rays.
#[inline(always)]
fn view<S: Lanewise<N>, const N: usize>(
    s: S,
    [[ax, ay], [bx, by], [cx, cy]]: [[S::Lanes; 2]; 3],
    heights: [S::Lanes; 3],
) -> (Verdicts, View<S, N>) {
    let u = s.mul_sub(cx, by, s.mul(cy, bx));
    let v = s.mul_sub(ax, cy, s.mul(ay, cx));
    let w = s.mul_sub(bx, ay, s.mul(by, ax));

    let spread = s.larger(s.larger(ax, ay), s.larger(s.larger(bx, by), s.larger(cx, cy)));
    let height = s.larger(heights[0], s.larger(heights[1], heights[2]));
    let error = EdgeMargins::WITH_DISTANCES.error_by_height(s, height, spread);
    // Negative if all edge values have one sign, by the distance of the smallest from zero. At most one of the two operands
    // is negative.
    let zero = s.splat(-0.0);
    let (low, high) = (s.smaller(u, s.smaller(v, w)), s.greater(u, s.greater(v, w)));
    let apart = s.sooner(s.sub(zero, low), high);
    let (hit, miss) = (s.less(apart, s.sub(zero, error)), s.less(error, apart));
    let verdicts = Verdicts { hit, unsure: !(hit | miss) & (u32::MAX >> (u32::BITS as usize - N)) };
    (verdicts, View { edges: [u, v, w], error, heights, height })
}

impl<S: Lanewise<N>, const N: usize> View<S, N> {
    /// [`BlockTest::distances`] with given margins of weights and heights.
    #[inline(always)]
    fn distances(&self, s: S, per_length: S::Lanes, [weights, heights]: [f32; 2]) -> [S::Lanes; 2] {
        let ([u, v, w], [a, b, c]) = (self.edges, self.heights);
        let whole = s.mul(s.div(s.splat(1.0), s.add(u, s.add(v, w))), per_length);
        let spread = s.sub(s.greater(a, s.greater(b, c)), s.smaller(a, s.smaller(b, c)));
        let t = s.mul(s.mul_add(u, a, s.mul_add(v, b, s.mul(w, c))), whole);
        let moved = s.mul(s.mul(spread, self.error), s.splat(weights));
        // What underflow adds is far below the second term.
        let rounded = s.mul_add(self.height, s.splat(heights), s.splat(EdgeMargins::WITH_DISTANCES.underflow));
        let error = s.mul_add(moved, s.abs(whole), s.mul(rounded, s.abs(per_length)));
        [s.sub(t, error), s.add(t, error)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::Vec3;
    use super::super::random::Random;
    use super::super::rational::{exact, hit, point};
    use super::super::shear::RaySpace;
    use super::super::simd::{Kernel, Level, Row};
    use super::super::triangle::{self, Triangle};
    use super::super::triangles::tests::each_case;
    use super::super::triangles::{NO_CORNERS, set_corners};
    use super::*;

    fn sight(ray: &RaySpace) -> Sight {
        Sight {
            origin: [ray.origin[ray.x], ray.origin[ray.y], ray.origin[ray.z]],
            per_length: 1.0 / ray.dir[ray.z],
            shear: [ray.shear.0, ray.shear.1],
            main: ray.z as u32,
        }
    }

    /// Kernel for the verdicts and the bounds of distances, with given margins of weights and heights.
    struct Looked<'a>(&'a Sight, &'a Corners8, [f32; 2]);

    impl Kernel for Looked<'_> {
        type Output = (Verdicts, [Row; 2]);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let Self(sight, corners, margins) = self;
            let test = sight.test(s, corners);
            let [low, high] = test.view.distances(s, s.splat(sight.per_length), margins);
            (test.verdicts, [s.store(low), s.store(high)])
        }
    }

    /// Configuration of a ray and the triangles that it is aimed at.
    #[derive(Clone, Copy, Debug)]
    enum Kind {
        Ordinary,
        /// The ray starts this many sizes away.
        Far(f32),
        /// The triangles are nearly edge-on.
        Grazing(f32),
        /// Large and small triangles, from next to them.
        Near,
        /// Numbers scaled to the largest and smallest allowed.
        Scaled(i32),
    }

    const KINDS: [Kind; 10] = [
        Kind::Ordinary,
        Kind::Far(1e2),
        Kind::Far(1e4),
        Kind::Far(1e6),
        Kind::Grazing(1e-1),
        Kind::Grazing(1e-2),
        Kind::Grazing(1e-4),
        Kind::Near,
        Kind::Scaled(30),
        Kind::Scaled(-30),
    ];

    /// Generates eight triangles around a ray, each of its own size.
    fn seen(random: &mut Random, kind: Kind) -> Option<(RaySpace, [Triangle; LANES])> {
        let (target, dir) = (random.cube(), random.direction() * (0.1 + random.unit()));
        let triangles: [Triangle; LANES] = std::array::from_fn(|_| {
            let flat = match kind {
                Kind::Grazing(slope) => slope,
                _ => 1.0,
            };
            let size = match kind {
                Kind::Near => 2.0f32.powi(random.below(17) as i32 - 8),
                _ => 0.2 + random.unit(),
            };
            let corner = |from: Vec3| {
                let across = from - dir * (from.dot(dir) / dir.length_squared());
                (across * flat + dir * random.cube().x) * size
            };
            let around = dir.any_orthonormal_vector();
            let turned = dir.cross(around).normalize();
            let corners = [around, turned - around, -turned - around].map(corner);
            let shift = (corners[0] - corners[1]) * (random.unit() * random.unit());
            corners.map(|p| target + p + shift)
        });
        let back = match kind {
            Kind::Far(sizes) => sizes,
            Kind::Near => 1e-3 * random.unit(),
            _ => 4.0 * random.unit(),
        };
        let scale = match kind {
            Kind::Scaled(exponent) => 2.0f32.powi(exponent),
            _ => 1.0,
        };
        let ray = RaySpace::new((target - dir * back) * scale, dir * scale.recip())?;
        Some((ray, triangles.map(|t| t.map(|p| p * scale))))
    }

    /// Calls `check` with some rays of each kind.
    fn each_kind(kinds: &[Kind], mut check: impl FnMut(Kind, &RaySpace, &[Triangle; LANES], &Corners8)) {
        let mut random = Random::new(51);
        for &kind in kinds {
            for _ in 0..120 {
                let Some((ray, triangles)) = seen(&mut random, kind) else { continue };
                let mut corners = NO_CORNERS;
                (0..LANES).for_each(|lane| set_corners(&mut corners, lane, &triangles[lane]));
                check(kind, &ray, &triangles, &corners);
            }
        }
    }

    #[test]
    fn certain_verdicts_of_a_look_are_those_of_the_exact_test() {
        for level in Level::all() {
            let (mut certain, mut hits) = (0, 0);
            each_kind(&KINDS, |kind, ray, triangles, corners| {
                let (verdicts, _) = level.run(Looked(&sight(ray), corners, [WEIGHTS, HEIGHTS]));
                assert_eq!(verdicts.hit & verdicts.unsure, 0);
                for lane in (0..LANES).filter(|lane| verdicts.unsure >> lane & 1 == 0) {
                    let exact = triangle::is_hit_near_edge(ray, &triangles[lane]);
                    assert_eq!(verdicts.hit >> lane & 1 == 1, exact, "{kind:?} on {}", level.name());
                    (certain, hits) = (certain + 1, hits + u32::from(exact));
                }
            });
            assert!(hits > 1000 && certain > hits + 20, "{hits} hits of {certain}");
        }
    }

    #[test]
    fn a_look_judges_triangles_of_all_sizes_and_rays_at_corners_and_edges() {
        let mut certain = 0;
        for exponent in [-20, 0, 20] {
            each_case(exponent, 0, |ray, triangles, corners| {
                for level in Level::all() {
                    let (verdicts, _) = level.run(Looked(&sight(ray), corners, [WEIGHTS, HEIGHTS]));
                    for lane in (0..LANES).filter(|lane| verdicts.unsure >> lane & 1 == 0) {
                        let exact = triangle::is_hit(ray, &triangles[lane]);
                        assert_eq!(verdicts.hit >> lane & 1 == 1, exact, "2^{exponent} on {}", level.name());
                        certain += 1;
                    }
                }
            });
        }
        assert!(certain > 1000, "{certain}");
    }

    #[test]
    fn a_look_is_never_certain_of_empty_lanes() {
        let mut corners = NO_CORNERS;
        set_corners(&mut corners, 2, &[Vec3::X, Vec3::Y, Vec3::NEG_ONE]);
        let down = RaySpace::new(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z).map(|ray| sight(&ray));
        for level in Level::all() {
            let verdicts = down.map(|sight| level.run(Looked(&sight, &corners, [WEIGHTS, HEIGHTS])).0);
            assert_eq!(verdicts, Some(Verdicts { hit: 0b100, unsure: 0b1111_1011 }), "{}", level.name());
        }
    }

    /// Number of hits, and of those whose exact distance is outside its bounds.
    fn misplaced(kinds: &[Kind], margins: [f32; 2], level: Level) -> [usize; 2] {
        let (mut hits, mut outside) = (0, 0);
        each_kind(kinds, |kind, ray, triangles, corners| {
            let (verdicts, [low, high]) = level.run(Looked(&sight(ray), corners, margins));
            let (origin, dir) = (point(ray.origin), point(ray.dir));
            for lane in (0..LANES).filter(|lane| verdicts.hit >> lane & 1 == 1) {
                let t = hit(&origin, &dir, &triangles[lane]);
                assert!(t.is_some() && low[lane].is_finite() && high[lane].is_finite(), "{kind:?}");
                hits += 1;
                outside += usize::from(!t.is_some_and(|t| exact(low[lane]) <= t && t <= exact(high[lane])));
            }
        });
        [hits, outside]
    }

    #[test]
    fn exact_distances_lie_where_they_are_said_to() {
        for level in Level::all() {
            for kind in KINDS {
                let [hits, outside] = misplaced(&[kind], [WEIGHTS, HEIGHTS], level);
                assert_eq!(outside, 0, "{kind:?} on {}: {hits} hits", level.name());
            }
            let [hits, _] = misplaced(&KINDS, [WEIGHTS, HEIGHTS], level);
            assert!(hits > 1000, "{hits}");
        }
    }

    #[test]
    fn every_margin_of_a_distance_is_needed() {
        for level in Level::all() {
            for (name, margins) in [("weights", [0.0, HEIGHTS]), ("heights", [WEIGHTS, 0.0])] {
                let [hits, outside] = misplaced(&KINDS, margins, level);
                assert!(outside > 0, "{name} on {}: nothing of {hits} goes wrong without it", level.name());
            }
        }
    }

    #[test]
    fn distances_of_ordinary_hits_are_known_well() {
        for level in Level::all() {
            each_kind(&[Kind::Ordinary], |_, ray, triangles, corners| {
                let (verdicts, [low, high]) = level.run(Looked(&sight(ray), corners, [WEIGHTS, HEIGHTS]));
                for lane in (0..LANES).filter(|lane| verdicts.hit >> lane & 1 == 1) {
                    let farthest = triangles[lane].map(|p| (p - ray.origin).length()).into_iter().fold(0.0, f32::max);
                    assert!(high[lane] - low[lane] < 1e-4 * (farthest + 1.0) / ray.dir.length(), "{}", level.name());
                }
            });
        }
    }
}
