//! Eight triangles against one ray: the filter of [`triangle`](super::triangle) in eight lanes.
//!
//! Edge values are computed as there, operation by operation, with an error bound from the farthest possible triangle of the
//! scene; undecided lanes are left to the scalar form. Verdicts are exact, so it does not matter which of the two found them.

use super::Vec3;
use super::aabb::Aabb;
use super::bounds::EdgeMargins;
use super::shear::RaySpace;
use super::simd::{LANES, Lanewise, Row, Simd};

/// Corners of eight triangles, by corner and axis.
pub type Corners8 = [[Row; 3]; 3];

/// Largest distance, on any axis, from the origin to a point in the box.
#[inline(always)]
pub fn reach(origin: Vec3, bounds: &Aabb) -> f32 {
    // Subtraction is monotonic, rounded or not.
    let far = |lo: f32, hi: f32, o: f32| {
        let (below, above) = ((lo - o).abs(), (hi - o).abs());
        if below > above { below } else { above }
    };
    let x = far(bounds.lo.x, bounds.hi.x, origin.x);
    let y = far(bounds.lo.y, bounds.hi.y, origin.y);
    let z = far(bounds.lo.z, bounds.hi.z, origin.z);
    let most = if x > y { x } else { y };
    if most > z { most } else { z }
}

/// Triangle in a lane.
#[inline(always)]
pub fn corners_of(corners: &Corners8, lane: usize) -> [Vec3; 3] {
    let corner = |c: &[Row; 3]| Vec3::new(c[0][lane % LANES], c[1][lane % LANES], c[2][lane % LANES]);
    [corner(&corners[0]), corner(&corners[1]), corner(&corners[2])]
}

/// Eight empty lanes: NaN in every corner.
pub const NO_CORNERS: Corners8 = [[[f32::NAN; LANES]; 3]; 3];

/// Stores a triangle in one lane.
pub fn set_corners(corners: &mut Corners8, lane: usize, triangle: &[Vec3; 3]) {
    for (rows, corner) in corners.iter_mut().zip(triangle) {
        for (row, x) in rows.iter_mut().zip(corner.to_array()) {
            row[lane] = x;
        }
    }
}

/// A ray prepared for tests against blocks.
pub struct RayLanes<S: Simd> {
    /// Axes in sheared order: x, y, z.
    axes: [usize; 3],
    /// Origin along these axes.
    origin: [S::Lanes; 3],
    shear: [S::Lanes; 2],
    /// Largest distance of a corner from the origin on any axis.
    reach: S::Lanes,
}

/// Verdicts as bit masks of lanes; a lane in neither mask is a certain miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdicts {
    /// Lanes whose triangle the line through the ray hits for certain.
    pub hit: u32,
    /// Lanes that need the exact test. Empty lanes are among these.
    pub unsure: u32,
}

impl<S: Simd> RayLanes<S> {
    /// Broadcasts a ray to the lanes; no triangle tested against it may be farther than `reach` ([`reach`]).
    #[inline(always)]
    pub fn new(s: S, ray: &RaySpace, reach: f32) -> Self {
        let axes = [ray.x, ray.y, ray.z];
        let origin = [s.splat(ray.origin[axes[0]]), s.splat(ray.origin[axes[1]]), s.splat(ray.origin[axes[2]])];
        Self { axes, origin, shear: [s.splat(ray.shear.0), s.splat(ray.shear.1)], reach: s.splat(reach) }
    }

    /// Tests eight triangles.
    #[inline(always)]
    pub fn verdicts(&self, s: S, corners: &Corners8) -> Verdicts {
        self.verdicts_within(s, corners, EdgeMargins::DERIVED)
    }

    /// [`Self::verdicts`] with given margins.
    #[inline(always)]
    fn verdicts_within(&self, s: S, corners: &Corners8, margins: EdgeMargins) -> Verdicts {
        let [a, b, c] = [self.relative(s, &corners[0]), self.relative(s, &corners[1]), self.relative(s, &corners[2])];
        judge(s, [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)], self.reach, margins)
    }

    /// Corner relative to the origin, in sheared order.
    #[inline(always)]
    fn relative(&self, s: S, corner: &[Row; 3]) -> [S::Lanes; 3] {
        let [x, y, z] = self.axes;
        [
            s.sub(s.load(&corner[x]), self.origin[0]),
            s.sub(s.load(&corner[y]), self.origin[1]),
            s.sub(s.load(&corner[z]), self.origin[2]),
        ]
    }

    #[inline(always)]
    fn sheared(&self, s: S, [x, y, z]: [S::Lanes; 3]) -> [S::Lanes; 2] {
        [s.sub(x, s.mul(self.shear[0], z)), s.sub(y, s.mul(self.shear[1], z))]
    }
}

/// Verdicts on triangles by their sheared corners, where they are certain.
#[inline(always)]
fn judge<S: Lanewise<N>, const N: usize>(
    s: S,
    corners: [[S::Lanes; 2]; 3],
    reach: S::Lanes,
    margins: EdgeMargins,
) -> Verdicts {
    let [[ax, ay], [bx, by], [cx, cy]] = corners;
    let u = s.sub(s.mul(cx, by), s.mul(cy, bx));
    let v = s.sub(s.mul(ax, cy), s.mul(ay, cx));
    let w = s.sub(s.mul(bx, ay), s.mul(by, ax));

    let spread = s.greater(largest2(s, ax, ay), s.greater(largest2(s, bx, by), largest2(s, cx, cy)));
    let error = margins.error_lanes(s, reach, spread);
    let negative = s.sub(s.splat(0.0), error);
    let (low, high) = (s.smaller(u, s.smaller(v, w)), s.greater(u, s.greater(v, w)));

    // Overflow makes the bound too large or NaN, and the comparisons false.
    let sound = s.less(error, s.splat(margins.overflow));
    let miss = s.less(low, negative) & s.less(error, high);
    let hit = (s.less(error, low) | s.less(high, negative)) & sound;
    Verdicts { hit, unsure: !(hit | miss & sound) & (u32::MAX >> (u32::BITS as usize - N)) }
}

#[inline(always)]
fn largest2<S: Lanewise<N>, const N: usize>(s: S, x: S::Lanes, y: S::Lanes) -> S::Lanes {
    s.greater(s.abs(x), s.abs(y))
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::random::Random;
    use super::super::simd::{Kernel, Level};
    use super::super::triangle;
    use super::*;

    /// [`reach`] of the corners themselves.
    fn farthest(ray: &RaySpace, corners: &Corners8) -> f32 {
        let place = |k: usize| corners.iter().flat_map(move |corner| corner[k]);
        (0..3).flat_map(|k| place(k).map(move |x| (x - ray.origin[k]).abs())).fold(0.0, f32::max)
    }

    struct Test<'a>(&'a RaySpace, &'a Corners8);

    impl Kernel for Test<'_> {
        type Output = Verdicts;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Verdicts {
            RayLanes::new(s, self.0, farthest(self.0, self.1)).verdicts(s, self.1)
        }
    }

    /// Calls `check` with triangles of all sizes and with rays at random and at corners and edges, scaled by 2^exponent; the
    /// triangles themselves are smaller by 2^smaller.
    pub(in super::super) fn each_case(
        exponent: i32,
        smaller: i32,
        mut check: impl FnMut(&RaySpace, &[[Vec3; 3]; LANES], &Corners8),
    ) {
        let mut random = Random::new(7);
        let (scale, shrink) = (2.0f32.powi(exponent), 2.0f32.powi(-smaller));
        for case in 0..600 {
            let triangles: [[Vec3; 3]; LANES] = std::array::from_fn(|_| {
                let (place, size) = (random.cube(), random.unit() * random.unit());
                std::array::from_fn(|_| (place + random.cube() * size * shrink) * scale)
            });
            let mut corners = NO_CORNERS;
            (0..LANES).for_each(|lane| set_corners(&mut corners, lane, &triangles[lane]));
            let [a, b, _] = triangles[random.below(LANES)];
            let target = [random.cube() * scale, a, a + (b - a) * random.unit(), (a + b) * 0.5][case % 4];
            let origin = if case % 5 == 0 { Vec3::ZERO } else { random.cube() * 4.0 * scale };
            if let Some(ray) = RaySpace::new(origin, target - origin) {
                check(&ray, &triangles, &corners);
            }
        }
    }

    #[test]
    fn certain_verdicts_of_eight_lanes_are_those_of_the_exact_test() {
        for exponent in [-120, -60, -30, 0, 30, 60, 120] {
            let (mut hits, mut misses, mut cases) = (0, 0, 0);
            each_case(exponent, 0, |ray, triangles, corners| {
                let verdicts = Level::PORTABLE.run(Test(ray, corners));
                assert_eq!(verdicts.hit & verdicts.unsure, 0);
                for (lane, triangle) in triangles.iter().enumerate() {
                    let exact = triangle::is_hit_near_edge(ray, triangle);
                    assert_eq!(exact, triangle::is_hit(ray, triangle), "2^{exponent}");
                    cases += 1;
                    hits += verdicts.hit >> lane & 1;
                    misses += 1 - ((verdicts.hit | verdicts.unsure) >> lane & 1);
                    assert!(verdicts.unsure >> lane & 1 == 1 || exact == (verdicts.hit >> lane & 1 == 1));
                }
            });
            if exponent.abs() <= 30 {
                assert!(hits > 10 && hits + misses > cases * 8 / 10, "2^{exponent}: {hits} + {misses} of {cases}");
            }
        }
    }

    /// Small triangles from so far away that the terms of the bound itself are rounded to nothing.
    #[test]
    fn verdicts_hold_where_edge_values_are_the_smallest_numbers() {
        let mut certain = 0;
        for exponent in -70..-54 {
            for smaller in [4, 8, 12] {
                each_case(exponent, smaller, |ray, triangles, corners| {
                    let verdicts = Level::PORTABLE.run(Test(ray, corners));
                    for (lane, triangle) in triangles.iter().enumerate() {
                        let exact = triangle::is_hit_near_edge(ray, triangle);
                        assert_eq!(exact, triangle::is_hit(ray, triangle), "2^{exponent} 2^-{smaller}");
                        certain += 1 - (verdicts.unsure >> lane & 1);
                        assert!(verdicts.unsure >> lane & 1 == 1 || exact == (verdicts.hit >> lane & 1 == 1));
                    }
                });
            }
        }
        assert!(certain > 1000, "{certain}");
    }

    struct Within<'a>(&'a RaySpace, &'a Corners8, EdgeMargins);

    impl Kernel for Within<'_> {
        type Output = Verdicts;

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Verdicts {
            RayLanes::new(s, self.0, farthest(self.0, self.1)).verdicts_within(s, self.1, self.2)
        }
    }

    /// Number of wrong verdicts that count as certain with these margins, with numbers around 2^exponent.
    fn wrong(margins: EdgeMargins, exponents: std::ops::Range<i32>) -> u32 {
        let mut wrong = 0;
        for exponent in exponents {
            each_case(exponent, 0, |ray, triangles, corners| {
                let verdicts = Level::best().run(Within(ray, corners, margins));
                for (lane, triangle) in
                    triangles.iter().enumerate().filter(|(lane, _)| verdicts.unsure >> lane & 1 == 0)
                {
                    let exact = triangle::is_hit_near_edge(ray, triangle);
                    wrong += u32::from(exact != (verdicts.hit >> lane & 1 == 1));
                }
            });
        }
        wrong
    }

    #[test]
    fn every_margin_of_an_edge_value_is_needed() {
        let derived = EdgeMargins::DERIVED;
        for (name, shrunk, exponents) in [
            ("rounding", EdgeMargins { rounding: 0.0, ..derived }, 0..4),
            ("underflow", EdgeMargins { underflow: 0.0, ..derived }, -70..-58),
            ("overflow", EdgeMargins { overflow: f32::INFINITY, ..derived }, 60..76),
        ] {
            assert_eq!(wrong(derived, exponents.clone()), 0, "{name}");
            assert!(wrong(shrunk, exponents) > 0, "{name}: nothing goes wrong without it");
        }
    }

    #[test]
    fn every_level_gives_the_same_masks() {
        for exponent in [-120, 0, 100] {
            each_case(exponent, 0, |ray, _, corners| {
                let expected = Level::PORTABLE.run(Test(ray, corners));
                for level in Level::all() {
                    assert_eq!(level.run(Test(ray, corners)), expected, "{}", level.name());
                }
            });
        }
    }

    #[test]
    fn empty_lanes_are_never_certain() {
        let mut corners = NO_CORNERS;
        set_corners(&mut corners, 2, &[Vec3::X, Vec3::Y, Vec3::NEG_ONE]);
        let ray = RaySpace::new(Vec3::new(0.0, 0.0, 5.0), Vec3::NEG_Z).map(|r| Level::PORTABLE.run(Test(&r, &corners)));
        assert_eq!(ray, Some(Verdicts { hit: 0b100, unsure: 0b1111_1011 }));
    }
}
