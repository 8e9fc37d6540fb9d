//! Fans: rays from one origin against triangles, by the planes through the triangles' edges and that origin.
//!
//! As in [`sight`](super::sight), but rays that start together share more: the edge value of a ray is linear in its
//! direction, d · (p × q) / d_z for the edge from q to p, so that the cross products, the error of the edge values, and the
//! side of each triangle on which the origin lies are computed once for all rays, for eight triangles at a time. Only two
//! operations per edge remain for each ray.

use super::Vec3;
use super::bounds::{EdgeMargins, FAN_EDGE, HEIGHTS, WEIGHTS};
use super::sight::{AXES, Rows};
use super::simd::{Axis, LANES, Lanewise, Row, Simd};
use super::triangles::{Corners8, Verdicts};

/// Rays side by side from one origin, with one octant and the same main axis; their numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE), and hits behind their origin do not count.
pub struct Fan<S: Lanewise<N>, const N: usize> {
    /// Axes in sheared order.
    axes: [Axis; 3],
    /// Origin along these axes.
    origin: [f32; 3],
    /// Components of the directions along the first two axes over that along the last.
    shear: [S::Lanes; 2],
    /// Reciprocal of the component along the last axis.
    per_length: S::Lanes,
    /// Sign of that component.
    forwards: f32,
}

/// Eight triangles prepared for a fan.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct FanReady {
    /// By edge: factors of the shears, and summand. Edge values of rays that hit are positive.
    edges: [[Row; 3]; 3],
    /// Bound of the error of an edge value.
    error: Row,
    /// Corners along the main axis, relative to the origin.
    heights: [Row; 3],
    /// Error of the mean of the heights: the part to be divided by the sum of the edge values, and the constant part.
    moved: Row,
    rounded: Row,
}

impl FanReady {
    /// No triangles.
    pub const EMPTY: Self = {
        let none = [0.0; LANES];
        Self { edges: [[none; 3]; 3], error: none, heights: [none; 3], moved: none, rounded: none }
    };
}

/// Edge values of the rays.
pub struct FanTest<S: Lanewise<N>, const N: usize>([S::Lanes; 3]);

impl<S: Lanewise<N>, const N: usize> Fan<S, N> {
    /// Prepares rays from `origin`, with directions by axis and lane, whose largest components are along axis `z`, and the
    /// reciprocals of these.
    #[inline(always)]
    pub fn new(s: S, origin: Vec3, dir: &[[f32; N]; 3], z: usize, per_length: &[f32; N]) -> Self {
        let per_length = s.load(per_length);
        let (p, q) = (s.mul(s.load(&dir[(z + 1) % 3]), per_length), s.mul(s.load(&dir[(z + 2) % 3]), per_length));
        Self {
            axes: AXES[z % 4],
            origin: [origin[(z + 1) % 3], origin[(z + 2) % 3], origin[z % 3]],
            shear: [p, q],
            per_length,
            forwards: 1f32.copysign(dir[z % 3][0]),
        }
    }

    /// Corner relative to the origin.
    #[inline(always)]
    fn relative<T: Simd>(&self, s: T, corner: &[Row; 3]) -> [T::Lanes; 3] {
        let ([x, y, z], [ox, oy, oz]) = (self.axes, self.origin);
        [
            s.sub(s.along(corner, x), s.splat(ox)),
            s.sub(s.along(corner, y), s.splat(oy)),
            s.sub(s.along(corner, z), s.splat(oz)),
        ]
    }

    /// Edge vector between two corners.
    #[inline(always)]
    fn edge<T: Simd>(&self, s: T, from: &[Row; 3], to: &[Row; 3]) -> [T::Lanes; 3] {
        let [x, y, z] = self.axes;
        [
            s.sub(s.along(to, x), s.along(from, x)),
            s.sub(s.along(to, y), s.along(from, y)),
            s.sub(s.along(to, z), s.along(from, z)),
        ]
    }

    /// [`Rows::ready`] with a given margin of edge values.
    #[inline(always)]
    fn ready_within<T: Simd>(&self, s: T, corners: &Corners8, margin: f32) -> FanReady {
        let [pa, pb, pc] = corners;
        let (a, b, c) = (self.relative(s, pa), self.relative(s, pb), self.relative(s, pc));
        let (cb, ac, ba) = (self.edge(s, pc, pb), self.edge(s, pa, pc), self.edge(s, pb, pa));
        let (u, v, w) = (cross(s, c, cb), cross(s, a, ac), cross(s, b, ba));
        // Six times the volume between the origin and the triangle: its sign tells from which side the triangle is seen.
        let volume = s.mul_add(u[0], a[0], s.mul_add(u[1], a[1], s.mul(u[2], a[2])));

        let far = s.larger(largest(s, a), s.larger(largest(s, b), largest(s, c)));
        let long = s.larger(largest(s, cb), s.larger(largest(s, ac), largest(s, ba)));
        let relative = s.mul(s.mul(far, long), s.splat(margin));
        let known = s.less(s.mul_add(relative, far, s.splat(VOLUME_UNDERFLOW)), s.abs(volume));
        let error = s.add(relative, s.splat(EdgeMargins::WITH_DISTANCES.underflow));
        let error = s.choose(known, error, s.splat(f32::INFINITY));
        let side = s.with_sign(s.splat(1.0), s.mul(volume, s.splat(self.forwards)));
        let (u, v, w) = (turned(s, u, side), turned(s, v, side), turned(s, w, side));

        let heights = [a[2], b[2], c[2]];
        let highest = s.greater(heights[0], s.greater(heights[1], heights[2]));
        let lowest = s.smaller(heights[0], s.smaller(heights[1], heights[2]));
        let rounded = s.mul_add(largest(s, heights), s.splat(HEIGHTS), s.splat(EdgeMargins::WITH_DISTANCES.underflow));
        FanReady {
            edges: [stored(s, u), stored(s, v), stored(s, w)],
            error: s.store(error),
            heights: stored(s, heights),
            moved: s.store(s.mul(s.mul(s.sub(highest, lowest), error), s.splat(WEIGHTS))),
            rounded: s.store(rounded),
        }
    }
}

impl<S: Lanewise<N>, const N: usize> Rows<S, N> for Fan<S, N> {
    type Ready = FanReady;
    type BlockTest = FanTest<S, N>;

    #[inline(always)]
    fn ready<T: Simd>(&self, s: T, corners: &Corners8) -> FanReady {
        self.ready_within(s, corners, FAN_EDGE)
    }

    #[inline(always)]
    fn test(&self, s: S, ready: &FanReady, lane: usize) -> (Verdicts, FanTest<S, N>) {
        let u = self.value(s, &ready.edges[0], lane);
        let v = self.value(s, &ready.edges[1], lane);
        let w = self.value(s, &ready.edges[2], lane);
        let low = s.smaller(u, s.smaller(v, w));
        let error = ready.error[lane % LANES];
        let (hit, miss) = (s.less(s.splat(error), low), s.less(low, s.splat(-error)));
        let unsure = !(hit | miss) & (u32::MAX >> (u32::BITS as usize - N));
        (Verdicts { hit, unsure }, FanTest([u, v, w]))
    }

    #[inline(always)]
    fn distances(&self, s: S, ready: &FanReady, lane: usize, FanTest([u, v, w]): &FanTest<S, N>) -> [S::Lanes; 2] {
        let [a, b, c] = &ready.heights;
        let (a, b, c) = (s.splat(a[lane % LANES]), s.splat(b[lane % LANES]), s.splat(c[lane % LANES]));
        let whole = s.mul(s.div(s.splat(1.0), s.add(*u, s.add(*v, *w))), self.per_length);
        let t = s.mul(s.mul_add(*u, a, s.mul_add(*v, b, s.mul(*w, c))), whole);
        let (moved, rounded) = (s.splat(ready.moved[lane % LANES]), s.splat(ready.rounded[lane % LANES]));
        let error = s.mul_add(moved, s.abs(whole), s.mul(rounded, s.abs(self.per_length)));
        [s.sub(t, error), s.add(t, error)]
    }
}

impl<S: Lanewise<N>, const N: usize> Fan<S, N> {
    /// Values of the rays for an edge of the triangle in a lane.
    #[inline(always)]
    fn value(&self, s: S, [x, y, z]: &[Row; 3], lane: usize) -> S::Lanes {
        let (x, y, z) = (s.splat(x[lane % LANES]), s.splat(y[lane % LANES]), s.splat(z[lane % LANES]));
        s.mul_add(self.shear[0], x, s.mul_add(self.shear[1], y, z))
    }
}

/// p × q.
#[inline(always)]
fn cross<S: Simd>(s: S, [px, py, pz]: [S::Lanes; 3], [qx, qy, qz]: [S::Lanes; 3]) -> [S::Lanes; 3] {
    [s.mul_sub(py, qz, s.mul(pz, qy)), s.mul_sub(pz, qx, s.mul(px, qz)), s.mul_sub(px, qy, s.mul(py, qx))]
}

/// Largest absolute component.
#[inline(always)]
fn largest<S: Simd>(s: S, [x, y, z]: [S::Lanes; 3]) -> S::Lanes {
    s.larger(x, s.larger(y, z))
}

#[inline(always)]
fn turned<S: Simd>(s: S, [x, y, z]: [S::Lanes; 3], side: S::Lanes) -> [S::Lanes; 3] {
    [s.mul(x, side), s.mul(y, side), s.mul(z, side)]
}

#[inline(always)]
fn stored<S: Simd>(s: S, [x, y, z]: [S::Lanes; 3]) -> [Row; 3] {
    [s.store(x), s.store(y), s.store(z)]
}

/// Exceeds what underflow adds to six times a volume: nine products, 2⁻¹⁵⁰ each, of which those in the cross product are
/// multiplied by a distance below [`BOX_RANGE`](super::bounds::BOX_RANGE).
const VOLUME_UNDERFLOW: f32 = 1.0 / (1u128 << 100) as f32;

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::super::rational::{exact, hit, point};
    use super::super::shear::RaySpace;
    use super::super::simd::{Kernel, Level};
    use super::super::triangle::{self, Triangle};
    use super::super::triangles::{NO_CORNERS, set_corners};
    use super::*;

    /// Rays from one origin, and triangles.
    struct Case {
        origin: Vec3,
        dirs: [Vec3; LANES],
        triangles: [Triangle; LANES],
    }

    /// Result of a fan for each triangle: the verdicts, and bounds of the distances of hits.
    type Said = [(Verdicts, [Row; 2]); LANES];

    struct Ask<'a>(&'a Case, f32);

    impl Kernel for Ask<'_> {
        type Output = Said;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Said {
            let Self(Case { origin, dirs, triangles }, margin) = self;
            let mut dir = [[0.0; LANES]; 3];
            for (lane, d) in dirs.iter().enumerate() {
                for k in 0..3 {
                    dir[k][lane] = d[k];
                }
            }
            let mut corners = NO_CORNERS;
            (0..LANES).for_each(|lane| set_corners(&mut corners, lane, &triangles[lane]));
            let z = RaySpace::checked(*origin, dirs[0]).0.z;
            let per_length = s.store(s.div(s.splat(1.0), s.load(&dir[z])));
            let fan = Fan::<S, LANES>::new(s, *origin, &dir, z, &per_length);
            let ready = fan.ready_within(s, &corners, margin);
            let mut said = [(Verdicts { hit: 0, unsure: 0 }, [[0.0; LANES]; 2]); LANES];
            for (lane, said) in said.iter_mut().enumerate() {
                let (verdicts, test) = fan.test(s, &ready, lane);
                let [low, high] = fan.distances(s, &ready, lane, &test);
                *said = (verdicts, [s.store(low), s.store(high)]);
            }
            said
        }
    }

    /// Configuration of rays and triangles.
    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Kind {
        Ordinary,
        /// Rays from a distance of this many sizes.
        Far(f32),
        /// The origin lies nearly in the triangles' planes.
        Grazing(f32),
        /// Rays aimed at corners and edges.
        Edges,
        /// Some triangles are behind the origin, some around it.
        Around,
        /// Numbers scaled to the largest and smallest allowed.
        Scaled(i32),
    }

    const KINDS: [Kind; 11] = [
        Kind::Ordinary,
        Kind::Far(1e2),
        Kind::Far(1e4),
        Kind::Far(1e6),
        Kind::Grazing(1e-1),
        Kind::Grazing(1e-3),
        Kind::Grazing(1e-6),
        Kind::Edges,
        Kind::Around,
        Kind::Scaled(30),
        Kind::Scaled(-30),
    ];

    /// Generates rays with one octant and one main axis; `None` if they differ.
    fn case(random: &mut Random, kind: Kind) -> Option<Case> {
        let (middle, along) = (random.cube(), random.direction());
        let (right, back) = (along.any_orthonormal_vector(), if let Kind::Far(sizes) = kind { sizes } else { 4.0 });
        let up = along.cross(right);
        let scale = if let Kind::Scaled(exponent) = kind { 2f32.powi(exponent) } else { 1.0 };
        let origin = middle - along * (back * random.unit());
        let flat = if let Kind::Grazing(slope) = kind { slope } else { 1.0 };
        let depth = if kind == Kind::Around { 6.0 } else { 1.0 };
        let triangles: [Triangle; LANES] = std::array::from_fn(|_| {
            let size = 0.1 + random.unit();
            let place = middle + along * (random.cube().x * depth);
            [0, 1, 2].map(|_| {
                let across = right * random.cube().x + up * (random.cube().x * flat);
                let p = place + (across + along * random.cube().x) * size;
                if kind == Kind::Around { p } else { p + right * (0.3 * size) }
            })
        });
        let dirs: [Vec3; LANES] = std::array::from_fn(|k| {
            let [a, b, c] = triangles[random.below(LANES)];
            let target = match kind {
                Kind::Edges if k % 2 == 0 => a,
                Kind::Edges => (a + b) * 0.5,
                _ => triangle::within(&[a, b, c], random.unit(), random.unit()),
            };
            (target - origin) * (0.1 + random.unit())
        });
        let spaces = dirs.map(|dir| RaySpace::checked(origin, dir).0);
        let signs = |d: Vec3| [d.x, d.y, d.z].map(f32::is_sign_negative);
        let alike = spaces.iter().all(|s| s.z == spaces[0].z && signs(s.dir) == signs(dirs[0]));
        alike.then(|| Case {
            origin: origin * scale,
            dirs: dirs.map(|d| d * scale.recip()),
            triangles: triangles.map(|t| t.map(|p| p * scale)),
        })
    }

    fn cases(kind: Kind, count: usize) -> Vec<Case> {
        let mut random = Random::new(81);
        std::iter::repeat_with(|| case(&mut random, kind)).flatten().take(count).collect()
    }

    /// Numbers of certain hits, certain misses, and wrong ones among these, with a given margin.
    fn judged(kind: Kind, margin: f32, level: Level) -> [usize; 3] {
        let (mut hits, mut misses, mut wrong) = (0, 0, 0);
        for case in cases(kind, 150) {
            let said = level.run(Ask(&case, margin));
            for ((verdicts, _), triangle) in said.iter().zip(&case.triangles) {
                assert_eq!(verdicts.hit & verdicts.unsure, 0);
                for (lane, &dir) in case.dirs.iter().enumerate() {
                    let ray = RaySpace::checked(case.origin, dir).0;
                    let ahead = triangle::intersect(&ray, triangle).is_some_and(|t| t >= 0.0);
                    let [hit, unsure] = [verdicts.hit, verdicts.unsure].map(|mask| mask >> lane & 1 == 1);
                    (hits, misses) = (hits + usize::from(hit), misses + usize::from(!hit && !unsure));
                    wrong += usize::from(!unsure && hit != ahead);
                }
            }
        }
        [hits, misses, wrong]
    }

    #[test]
    fn certain_verdicts_of_a_fan_are_those_of_the_exact_test() {
        for level in Level::all() {
            let mut all = [0, 0];
            for kind in KINDS {
                let [hits, misses, wrong] = judged(kind, FAN_EDGE, level);
                assert_eq!(wrong, 0, "{kind:?} on {}", level.name());
                all = [all[0] + hits, all[1] + misses];
                if kind == Kind::Ordinary {
                    assert!(hits > 1000 && hits + misses > 150 * 60, "{hits} and {misses} of {}", 150 * 64);
                }
            }
            assert!(all[0] > 10_000 && all[1] > 10_000, "{all:?}");
        }
    }

    #[test]
    fn the_margin_of_edge_values_is_needed() {
        let wrong = |margin| KINDS.map(|kind| judged(kind, margin, Level::best())[2]).iter().sum::<usize>();
        assert!(wrong(0.0) > 0, "nothing goes wrong without it");
    }

    #[test]
    fn exact_distances_lie_where_a_fan_says() {
        let mut hits = 0;
        for kind in KINDS {
            for case in cases(kind, 60) {
                for level in Level::all() {
                    let said = level.run(Ask(&case, FAN_EDGE));
                    for ((verdicts, [low, high]), triangle) in said.iter().zip(&case.triangles) {
                        for lane in (0..LANES).filter(|lane| verdicts.hit >> lane & 1 == 1) {
                            let t = hit(&point(case.origin), &point(case.dirs[lane]), triangle).expect("it is hit");
                            assert!(exact(low[lane]) <= t && t <= exact(high[lane]), "{kind:?} on {}", level.name());
                            hits += 1;
                        }
                    }
                }
            }
        }
        assert!(hits > 5_000 * Level::all().len(), "{hits}");
    }

    #[test]
    fn a_fan_is_never_certain_of_empty_lanes() {
        let [case] = &cases(Kind::Ordinary, 1)[..] else { panic!("one case") };
        let triangles = [[Vec3::NAN; 3]; LANES];
        for level in Level::all() {
            for (verdicts, _) in level.run(Ask(&Case { triangles, ..*case }, FAN_EDGE)) {
                assert_eq!(verdicts, Verdicts { hit: 0, unsure: 255 }, "{}", level.name());
            }
        }
    }
}
