//! Eight triangles against one ray: the filter of [`triangle`](super::triangle) in eight lanes.
//!
//! Edge values are computed as there, with fused operations where the processor has them, and their bound from the
//! farthest that any triangle of the scene may be; what this cannot decide is left to the scalar form. Verdicts are exact,
//! so it does not matter which of the two found them.

use super::DVec3;
use super::Vec3;
use super::aabb::Aabb;
use super::bounds::{EdgeMargins, HEIGHTS, PLANE_TERMS_F64, POSITION_T, WEIGHTS};
use super::shear::RaySpace;
use super::simd::{Axis, LANES, Lanewise, Row, Simd};
use super::triangle::{flat_axes, magnitude_cross};

/// Corners of eight triangles, by corner and axis.
pub type Corners8 = [[Row; 3]; 3];

/// No coordinate of what lies in the box is farther from that of the origin.
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

/// The triangle in a lane.
#[inline(always)]
pub fn corners_of(corners: &Corners8, lane: usize) -> [Vec3; 3] {
    let corner = |c: &[Row; 3]| Vec3::new(c[0][lane % LANES], c[1][lane % LANES], c[2][lane % LANES]);
    [corner(&corners[0]), corner(&corners[1]), corner(&corners[2])]
}

/// Lanes without a triangle: a NaN in every corner.
pub const NO_CORNERS: Corners8 = [[[f32::NAN; LANES]; 3]; 3];

/// Puts a triangle into one lane.
pub fn set_corners(corners: &mut Corners8, lane: usize, triangle: &[Vec3; 3]) {
    for (rows, corner) in corners.iter_mut().zip(triangle) {
        for (row, x) in rows.iter_mut().zip(corner.to_array()) {
            row[lane] = x;
        }
    }
}

/// A ray as blocks see it that are asked about distances, too: its numbers are within
/// [`BOX_RANGE`](super::bounds::BOX_RANGE).
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Sight {
    /// Origin along the axes in sheared order.
    pub origin: [f32; 3],
    /// 1 over the direction's component along the last of these axes.
    pub per_length: f32,
    /// The direction's components along the first two of these axes over that along the last.
    pub shear: [f32; 2],
    /// The axis of the direction's largest component.
    pub main: u32,
}

/// The axes in sheared order, by the ray's main axis.
static AXES: [[Axis; 3]; 3] = {
    let [x, y, z] = [Axis::new(0), Axis::new(1), Axis::new(2)];
    [[y, z, x], [z, x, y], [x, y, z]]
};

/// What a ray sees of eight triangles.
pub struct Look<S: Simd> {
    /// Which of them it hits.
    pub verdicts: Verdicts,
    /// Edge values, and what they may be off.
    edges: [S::Lanes; 3],
    error: S::Lanes,
    /// Corners along the ray's main axis, relative to its origin.
    heights: [S::Lanes; 3],
    /// The largest of their sizes.
    height: S::Lanes,
}

impl Sight {
    /// Tests eight triangles.
    #[inline(always)]
    pub fn look<S: Simd>(&self, s: S, corners: &Corners8) -> Look<S> {
        let [ox, oy, oz] = [s.splat(self.origin[0]), s.splat(self.origin[1]), s.splat(self.origin[2])];
        let [p, q] = [s.splat(self.shear[0]), s.splat(self.shear[1])];
        let [x, y, z] = AXES[self.main as usize % 3];
        let [a, b, c] = corners;
        let (az, bz, cz) = (s.sub(s.along(a, z), oz), s.sub(s.along(b, z), oz), s.sub(s.along(c, z), oz));
        let (ax, ay) = (s.sub_mul(p, az, s.sub(s.along(a, x), ox)), s.sub_mul(q, az, s.sub(s.along(a, y), oy)));
        let (bx, by) = (s.sub_mul(p, bz, s.sub(s.along(b, x), ox)), s.sub_mul(q, bz, s.sub(s.along(b, y), oy)));
        let (cx, cy) = (s.sub_mul(p, cz, s.sub(s.along(c, x), ox)), s.sub_mul(q, cz, s.sub(s.along(c, y), oy)));
        let u = s.mul_sub(cx, by, s.mul(cy, bx));
        let v = s.mul_sub(ax, cy, s.mul(ay, cx));
        let w = s.mul_sub(bx, ay, s.mul(by, ax));

        let spread = s.larger(s.larger(ax, ay), s.larger(s.larger(bx, by), s.larger(cx, cy)));
        let height = s.larger(az, s.larger(bz, cz));
        let error = EdgeMargins::WITH_DISTANCES.error_by_height(s, height, spread);
        // Below zero where all edge values have one sign, as far as the nearest of them is from zero.
        let zero = s.splat(0.0);
        let (low, high) = (s.smaller(u, s.smaller(v, w)), s.greater(u, s.greater(v, w)));
        let apart = s.smaller(s.sub(zero, low), high);
        let (hit, miss) = (s.less(apart, s.sub(zero, error)), s.less(error, apart));
        let verdicts = Verdicts { hit, unsure: !(hit | miss) & ((1 << LANES) - 1) };
        Look { verdicts, edges: [u, v, w], error, heights: [az, bz, cz], height }
    }
}

impl<S: Simd> Look<S> {
    /// Between which distances the exact ones lie, of the triangles that are hit for certain.
    ///
    /// The exact distance is the mean of the corners' heights with the exact edge values for weights, all of one sign, over
    /// the direction's component. Edge values that err by e move the mean by 3 e times the spread of the heights over their
    /// sum S: half of the spread times the sum of the changes of the weights, 6 e/S. The roundings of heights, products,
    /// sums, the reciprocal and the last products are 10 u of the largest height; 16 u is for what they leave out.
    #[inline(always)]
    pub fn distances(&self, s: S, sight: &Sight) -> [S::Lanes; 2] {
        self.distances_within(s, sight, WEIGHTS, HEIGHTS)
    }

    /// [`Self::distances`] by given margins.
    #[inline(always)]
    fn distances_within(&self, s: S, sight: &Sight, weights: f32, heights: f32) -> [S::Lanes; 2] {
        let ([u, v, w], [a, b, c]) = (self.edges, self.heights);
        let per_length = s.splat(sight.per_length);
        let whole = s.mul(s.div(s.splat(1.0), s.add(u, s.add(v, w))), per_length);
        let spread = s.sub(s.greater(a, s.greater(b, c)), s.smaller(a, s.smaller(b, c)));
        let t = s.mul(s.mul_add(u, a, s.mul_add(v, b, s.mul(w, c))), whole);
        let moved = s.mul(s.mul(spread, self.error), s.splat(weights));
        // What underflow adds is far below the second.
        let rounded = s.mul_add(self.height, s.splat(heights), s.splat(EdgeMargins::WITH_DISTANCES.underflow));
        let rounded = s.mul(rounded, s.abs(per_length));
        let error = s.mul_add(moved, s.abs(whole), rounded);
        [s.sub(t, error), s.add(t, error)]
    }
}

/// A ray ready to be tested against blocks.
pub struct RayLanes<S: Simd> {
    /// Axes in sheared order: x, y, z.
    axes: [Axis; 3],
    /// Origin along these axes.
    origin: [S::Lanes; 3],
    shear: [S::Lanes; 2],
    /// No corner is farther from the origin on any axis.
    reach: S::Lanes,
}

/// Which lanes are hit; a bit of neither mask is a certain miss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Verdicts {
    /// The line through the ray meets the triangle for certain.
    pub hit: u32,
    /// A closer look is needed. Lanes without a triangle are among these.
    pub unsure: u32,
}

impl<S: Simd> RayLanes<S> {
    /// Spreads a ray over the lanes; none of the triangles that it is tested against is farther than `reach` ([`reach`]).
    #[inline(always)]
    pub fn new(s: S, ray: &RaySpace, reach: f32) -> Self {
        let origin = [s.splat(ray.origin[ray.x]), s.splat(ray.origin[ray.y]), s.splat(ray.origin[ray.z])];
        let shear = [s.splat(ray.shear.0), s.splat(ray.shear.1)];
        Self { axes: AXES[ray.z % 3], origin, shear, reach: s.splat(reach) }
    }

    /// Tests eight triangles.
    #[inline(always)]
    pub fn verdicts(&self, s: S, corners: &Corners8) -> Verdicts {
        self.verdicts_within(s, corners, EdgeMargins::DERIVED)
    }

    /// [`Self::verdicts`] by given margins.
    #[inline(always)]
    fn verdicts_within(&self, s: S, corners: &Corners8, margins: EdgeMargins) -> Verdicts {
        let [a, b, c] = [self.relative(s, &corners[0]), self.relative(s, &corners[1]), self.relative(s, &corners[2])];
        judge(s, [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)], self.reach, margins)
    }

    /// A corner relative to the origin, in sheared order.
    #[inline(always)]
    fn relative(&self, s: S, corner: &[Row; 3]) -> [S::Lanes; 3] {
        let [x, y, z] = self.axes;
        [
            s.sub(s.along(corner, x), self.origin[0]),
            s.sub(s.along(corner, y), self.origin[1]),
            s.sub(s.along(corner, z), self.origin[2]),
        ]
    }

    #[inline(always)]
    fn sheared(&self, s: S, [x, y, z]: [S::Lanes; 3]) -> [S::Lanes; 2] {
        [s.sub_mul(self.shear[0], z, x), s.sub_mul(self.shear[1], z, y)]
    }
}

/// Rays side by side, with the same axis first, ready to be tested against one triangle after another.
pub struct RayRow<S: Lanewise<N>, const N: usize> {
    /// Axes in sheared order: x, y, z.
    axes: [usize; 3],
    origin: [S::Lanes; 3],
    /// The origin of all rays, where they have one.
    from: Option<Vec3>,
    shear: [S::Lanes; 2],
    reach: S::Lanes,
}

impl<S: Lanewise<N>, const N: usize> RayRow<S, N> {
    /// Rays by axis and lane, whose largest components are along axis `z`, with the origin of all, if there is one; none
    /// of the triangles that they are tested against is farther from any of them than `reach`.
    #[inline(always)]
    pub fn new(s: S, origin: &[[f32; N]; 3], from: Option<Vec3>, dir: &[[f32; N]; 3], z: usize, reach: f32) -> Self {
        let axes = [(z + 1) % 3, (z + 2) % 3, z % 3];
        let along = s.load(&dir[axes[2]]);
        Self {
            axes,
            origin: [s.load(&origin[axes[0]]), s.load(&origin[axes[1]]), s.load(&origin[axes[2]])],
            from,
            shear: [s.div(s.load(&dir[axes[0]]), along), s.div(s.load(&dir[axes[1]]), along)],
            reach: s.splat(reach),
        }
    }

    /// Tests one triangle: a bit for each ray.
    #[inline(always)]
    pub fn verdicts(&self, s: S, triangle: &[Vec3; 3]) -> Verdicts {
        let (a, b, c) = (self.relative(s, triangle[0]), self.relative(s, triangle[1]), self.relative(s, triangle[2]));
        judge(s, [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)], self.reach, EdgeMargins::DERIVED)
    }

    /// [`Self::verdicts`], fewer of them unsure: by how far the triangle is instead of how far any could be.
    #[inline(always)]
    pub fn closer_verdicts(&self, s: S, triangle: &[Vec3; 3]) -> Verdicts {
        let (a, b, c) = (self.relative(s, triangle[0]), self.relative(s, triangle[1]), self.relative(s, triangle[2]));
        let reach = s.greater(largest3(s, a), s.greater(largest3(s, b), largest3(s, c)));
        judge(s, [self.sheared(s, a), self.sheared(s, b), self.sheared(s, c)], reach, EdgeMargins::DERIVED)
    }

    /// A corner relative to the origins.
    #[inline(always)]
    fn relative(&self, s: S, corner: Vec3) -> [S::Lanes; 3] {
        let [x, y, z] = self.axes;
        if let Some(from) = self.from {
            let p = corner - from;
            return [s.splat(p[x]), s.splat(p[y]), s.splat(p[z])];
        }
        [
            s.sub(s.splat(corner[x]), self.origin[0]),
            s.sub(s.splat(corner[y]), self.origin[1]),
            s.sub(s.splat(corner[z]), self.origin[2]),
        ]
    }

    #[inline(always)]
    fn sheared(&self, s: S, [x, y, z]: [S::Lanes; 3]) -> [S::Lanes; 2] {
        [s.sub_mul(self.shear[0], z, x), s.sub_mul(self.shear[1], z, y)]
    }
}

/// Where rays side by side meet the plane of one triangle: [`meet`](super::triangle::meet) in lanes, operation by
/// operation.
#[derive(Clone, Copy, Debug)]
pub struct Meetings<L, D> {
    /// t, rounded once.
    pub t: L,
    /// t to a relative error of [`POSITION_T`].
    pub t_f64: D,
    /// The lanes in which that is certain; for the others the scalar form must be asked.
    pub sure: u32,
}

/// What bounds the rays of a row.
#[derive(Clone, Copy, Debug)]
pub struct RowBounds {
    /// All origins lie between these.
    pub low: DVec3,
    /// The same.
    pub high: DVec3,
    /// The origin, where all rays have the same.
    pub from: Option<DVec3>,
    /// No component of a direction is larger in size.
    pub dir: DVec3,
}

impl RowBounds {
    /// Around nothing.
    pub const NONE: Self = Self { low: DVec3::ZERO, high: DVec3::ZERO, from: None, dir: DVec3::ZERO };
}

/// What the rays of a row share when they meet a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    corners: [DVec3; 3],
    normal: DVec3,
    sizes: DVec3,
}

impl Plane {
    /// The plane of a triangle.
    #[inline(always)]
    pub fn of(triangle: &[Vec3; 3]) -> Self {
        let corners = [triangle[0].as_dvec3(), triangle[1].as_dvec3(), triangle[2].as_dvec3()];
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        Self { corners, normal: e1.cross(e2), sizes: magnitude_cross(e1.abs(), e2.abs()) }
    }

    /// Where rays (by axis and lane) meet it.
    #[inline(always)]
    pub fn meet<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        bounds: &RowBounds,
    ) -> Meetings<S::Lanes, S::Doubles> {
        let a = self.corners[0];
        let (low, high) = ((a - bounds.low).abs(), (a - bounds.high).abs());
        let numerator = match bounds.from {
            Some(from) => s.splat_f64(self.normal.dot(a - from)),
            None => {
                let o = [s.load(&origin[0]), s.load(&origin[1]), s.load(&origin[2])];
                let x = s.sub_f64(s.splat_f64(a.x), s.widen(o[0]));
                let y = s.sub_f64(s.splat_f64(a.y), s.widen(o[1]));
                let z = s.sub_f64(s.splat_f64(a.z), s.widen(o[2]));
                self.dot(s, [x, y, z])
            }
        };
        let d = [s.widen(s.load(&dir[0])), s.widen(s.load(&dir[1])), s.widen(s.load(&dir[2]))];
        let denominator = self.dot(s, d);
        // Those of the farthest and of the steepest ray there could be.
        let n_error = s.splat_f64(self.sizes.dot(low.max(high)) * PLANE_TERMS_F64);
        let d_error = s.splat_f64(self.sizes.dot(bounds.dir) * PLANE_TERMS_F64);
        let (n, d) = (s.abs_f64(numerator), s.abs_f64(denominator));
        let quarter = s.splat_f64(0.25);
        let signs = s.less_f64(d_error, s.mul_f64(quarter, d)) & s.less_f64(n_error, s.mul_f64(quarter, n));
        let reciprocal = s.div_f64(s.splat_f64(1.0), denominator);
        let t = s.mul_f64(numerator, reciprocal);
        let size = s.abs_f64(t);
        let terms = s.add_f64(n_error, s.mul_f64(d_error, size));
        let error = s.add_f64(
            s.mul_f64(terms, s.mul_f64(s.splat_f64(1.5), s.abs_f64(reciprocal))),
            s.mul_f64(size, s.splat_f64(2.0 * f64::EPSILON)),
        );
        let spread = s.mul_f64(error, s.splat_f64(1.001));
        let (low, high) = (s.narrow(s.sub_f64(t, spread)), s.narrow(s.add_f64(t, spread)));
        let rounded = s.at_most(low, high) & s.at_most(high, low);
        // Below the normal numbers zero gets a sign, which is left to the scalar form.
        let normal = s.less_f64(s.splat_f64(f64::from(f32::MIN_POSITIVE)), size);
        let sure = signs & s.less_f64(error, s.mul_f64(size, s.splat_f64(POSITION_T))) & rounded & normal;
        Meetings { t: low, t_f64: t, sure }
    }

    /// n·v.
    #[inline(always)]
    fn dot<S: Lanewise<N>, const N: usize>(&self, s: S, [x, y, z]: [S::Doubles; 3]) -> S::Doubles {
        let n = self.normal;
        s.add_f64(
            s.add_f64(s.mul_f64(s.splat_f64(n.x), x), s.mul_f64(s.splat_f64(n.y), y)),
            s.mul_f64(s.splat_f64(n.z), z),
        )
    }

    /// Weights of the second and third corner: [`barycentrics_at`](super::triangle::barycentrics_at) in lanes.
    #[inline(always)]
    pub fn barycentrics<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        t: &[f64; N],
    ) -> [[f32; N]; 2] {
        let [i, j] = flat_axes(self.normal);
        let [a, b, c] = [self.corners[0].to_array(), self.corners[1].to_array(), self.corners[2].to_array()];
        let t = s.load_f64(t);
        let px = self.along(s, origin, dir, t, i);
        let py = self.along(s, origin, dir, t, j);
        let ((bx, by), (cx, cy)) = ((b[i] - a[i], b[j] - a[j]), (c[i] - a[i], c[j] - a[j]));
        let scale = s.splat_f64(1.0 / (bx * cy - by * cx));
        let u = s.sub_f64(s.mul_f64(px, s.splat_f64(cy)), s.mul_f64(py, s.splat_f64(cx)));
        let v = s.sub_f64(s.mul_f64(s.splat_f64(bx), py), s.mul_f64(s.splat_f64(by), px));
        let u = self.clamped(s, s.mul_f64(u, scale));
        let v = self.clamped(s, s.mul_f64(v, scale));
        let (u, mut v) = (s.store(u), s.store(v));
        for lane in 0..N {
            v[lane] = if u[lane] + v[lane] > 1.0 { 1.0 - u[lane] } else { v[lane] };
        }
        [u, v]
    }

    /// Coordinate `k` of the places at `t`, relative to the first corner.
    #[inline(always)]
    fn along<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        t: S::Doubles,
        k: usize,
    ) -> S::Doubles {
        let (o, d) = (s.widen(s.load(&origin[k % 3])), s.widen(s.load(&dir[k % 3])));
        s.sub_f64(s.add_f64(o, s.mul_f64(d, t)), s.splat_f64(self.corners[0][k % 3]))
    }

    /// Within 0 to 1, rounded; 0 for a NaN.
    #[inline(always)]
    fn clamped<S: Lanewise<N>, const N: usize>(&self, s: S, x: S::Doubles) -> S::Lanes {
        let positive = s.greater_f64(x, s.splat_f64(0.0));
        s.narrow(s.smaller_f64(positive, s.splat_f64(1.0)))
    }
}

/// The verdicts on triangles by their sheared corners, where that is certain.
#[inline(always)]
fn judge<S: Lanewise<N>, const N: usize>(
    s: S,
    corners: [[S::Lanes; 2]; 3],
    reach: S::Lanes,
    margins: EdgeMargins,
) -> Verdicts {
    let [[ax, ay], [bx, by], [cx, cy]] = corners;
    let u = s.mul_sub(cx, by, s.mul(cy, bx));
    let v = s.mul_sub(ax, cy, s.mul(ay, cx));
    let w = s.mul_sub(bx, ay, s.mul(by, ax));

    let spread = s.greater(largest2(s, ax, ay), s.greater(largest2(s, bx, by), largest2(s, cx, cy)));
    let error = margins.error_lanes(s, reach, spread);
    let negative = s.sub(s.splat(0.0), error);
    let (low, high) = (s.smaller(u, s.smaller(v, w)), s.greater(u, s.greater(v, w)));

    // Overflow makes the bound too large or NaN, and the comparisons false.
    let sound = s.less(error, s.splat(margins.overflow));
    let miss = s.less(low, negative) & s.less(error, high);
    let hit = (s.less(error, low) | s.less(high, negative)) & sound;
    Verdicts { hit, unsure: !(hit | miss & sound) & ((1 << N) - 1) }
}

#[inline(always)]
fn largest2<S: Lanewise<N>, const N: usize>(s: S, x: S::Lanes, y: S::Lanes) -> S::Lanes {
    s.greater(s.abs(x), s.abs(y))
}

#[inline(always)]
fn largest3<S: Lanewise<N>, const N: usize>(s: S, [x, y, z]: [S::Lanes; 3]) -> S::Lanes {
    s.greater(s.abs(z), largest2(s, x, y))
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::super::rational::{exact, hit, point};
    use super::super::simd::{Kernel, Level};
    use super::super::triangle::{self, Triangle};
    use super::*;

    /// As [`reach`], of the corners themselves.
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

    /// Triangles of all sizes, rays at random and at corners and edges, scaled by 2^exponent; the triangles themselves
    /// smaller by 2^smaller.
    fn each_case(exponent: i32, smaller: i32, mut check: impl FnMut(&RaySpace, &[[Vec3; 3]; LANES], &Corners8)) {
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

    /// Small triangles seen from far away, so small that the terms of the bound itself are rounded to nothing.
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

    /// Verdicts that are called certain by these margins, and are wrong, of numbers around 2^exponent.
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

    /// Eight rays against the first of eight triangles: the verdicts, where they meet its plane, and the weights there.
    struct Row8<'a>(&'a [RaySpace; LANES], &'a Triangle, Option<Vec3>);

    impl Kernel for Row8<'_> {
        type Output = (Verdicts, Meetings<Row, [f64; LANES]>, [Row; 2]);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let Self(rays, triangle, from) = self;
            let (mut origin, mut dir) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
            for (lane, ray) in rays.iter().enumerate() {
                for k in 0..3 {
                    (origin[k][lane], dir[k][lane]) = (ray.origin[k], ray.dir[k]);
                }
            }
            let far = rays.iter().map(|r| reach(r.origin, &Aabb::around(*triangle))).fold(0.0, f32::max);
            let row = RayRow::new(s, &origin, from, &dir, rays[0].z, far);
            let (verdicts, closer) = (row.verdicts(s, triangle), row.closer_verdicts(s, triangle));
            assert_eq!(verdicts.hit & !(closer.hit | closer.unsure) | closer.unsure & !verdicts.unsure, 0);
            let plane = Plane::of(triangle);
            let (least, most) = (
                |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::min).unwrap(),
                |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::max).unwrap(),
            );
            let bounds = RowBounds {
                low: least(|r| r.origin.as_dvec3()),
                high: most(|r| r.origin.as_dvec3()),
                from: from.map(Vec3::as_dvec3),
                dir: most(|r| r.dir.as_dvec3().abs()),
            };
            let met = plane.meet(s, &origin, &dir, &bounds);
            let met = Meetings { t: s.store(met.t), t_f64: s.store_f64(met.t_f64), sure: met.sure };
            (verdicts, met, plane.barycentrics(s, &origin, &dir, &met.t_f64))
        }
    }

    #[test]
    fn eight_rays_side_by_side_meet_a_triangle_as_each_does_alone() {
        let mut random = Random::new(21);
        let (mut hits, mut sure) = (0, 0);
        for _ in 0..3000 {
            let triangle = [random.cube(), random.cube(), random.cube()];
            let origin = random.cube() * 4.0;
            let aim = |_| triangle::within(&triangle, random.unit() * 1.2, random.unit());
            let rays: Vec<RaySpace> = (0..LANES).map(aim).filter_map(|p| RaySpace::new(origin, p - origin)).collect();
            let Ok(rays) = <[RaySpace; LANES]>::try_from(rays) else { continue };
            if rays.iter().any(|r| r.z != rays[0].z) {
                continue;
            }
            // All start there, whether the row knows it or not.
            for (level, from) in Level::all().into_iter().flat_map(|l| [(l, None), (l, Some(origin))]) {
                let (verdicts, met, [u, v]) = level.run(Row8(&rays, &triangle, from));
                for (lane, ray) in rays.iter().enumerate() {
                    let (bit, hit) = (1 << lane, triangle::is_hit(ray, &triangle));
                    assert!(verdicts.unsure & bit != 0 || (verdicts.hit & bit != 0) == hit, "{}", level.name());
                    if !hit || met.sure & bit == 0 {
                        continue;
                    }
                    let alone = triangle::meet(ray, &triangle);
                    assert_eq!(
                        (met.t[lane].to_bits(), met.t_f64[lane].to_bits()),
                        (alone.t.to_bits(), alone.t_f64.to_bits())
                    );
                    assert_eq!((u[lane], v[lane]), triangle::barycentrics(ray, &triangle));
                    sure += 1;
                }
                hits += rays.iter().filter(|r| triangle::is_hit(r, &triangle)).count();
            }
        }
        assert!(sure > 10_000 && sure > hits * 9 / 10, "{sure} of {hits}");
    }

    fn sight(ray: &RaySpace) -> Sight {
        Sight {
            origin: [ray.origin[ray.x], ray.origin[ray.y], ray.origin[ray.z]],
            per_length: 1.0 / ray.dir[ray.z],
            shear: [ray.shear.0, ray.shear.1],
            main: ray.z as u32,
        }
    }

    /// Verdicts, and between which distances those that are hit are, by these margins of weights and heights.
    struct Looked<'a>(&'a Sight, &'a Corners8, [f32; 2]);

    impl Kernel for Looked<'_> {
        type Output = (Verdicts, [Row; 2]);

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> Self::Output {
            let Self(sight, corners, [weights, heights]) = self;
            let look = sight.look(s, corners);
            let [low, high] = look.distances_within(s, sight, weights, heights);
            (look.verdicts, [s.store(low), s.store(high)])
        }
    }

    /// How a ray sees the triangles that it is aimed at.
    #[derive(Clone, Copy, Debug)]
    enum View {
        Ordinary,
        /// From many sizes away.
        Far(f32),
        /// Nearly edge on.
        Grazing(f32),
        /// Large triangles and small ones, from next to them.
        Near,
        /// With numbers as large, or as small, as may be.
        Scaled(i32),
    }

    const VIEWS: [View; 10] = [
        View::Ordinary,
        View::Far(1e2),
        View::Far(1e4),
        View::Far(1e6),
        View::Grazing(1e-1),
        View::Grazing(1e-2),
        View::Grazing(1e-4),
        View::Near,
        View::Scaled(30),
        View::Scaled(-30),
    ];

    /// Eight triangles around a ray, each of its own size.
    fn seen(random: &mut Random, view: View) -> Option<(RaySpace, [Triangle; LANES])> {
        let (target, dir) = (random.cube(), random.direction() * (0.1 + random.unit()));
        let triangles: [Triangle; LANES] = std::array::from_fn(|_| {
            let flat = match view {
                View::Grazing(slope) => slope,
                _ => 1.0,
            };
            let size = match view {
                View::Near => 2.0f32.powi(random.below(17) as i32 - 8),
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
        let back = match view {
            View::Far(sizes) => sizes,
            View::Near => 1e-3 * random.unit(),
            _ => 4.0 * random.unit(),
        };
        let scale = match view {
            View::Scaled(exponent) => 2.0f32.powi(exponent),
            _ => 1.0,
        };
        let ray = RaySpace::new((target - dir * back) * scale, dir * scale.recip())?;
        Some((ray, triangles.map(|t| t.map(|p| p * scale))))
    }

    /// Some rays of each view.
    fn each_view(views: &[View], mut check: impl FnMut(View, &RaySpace, &[Triangle; LANES], &Corners8)) {
        let mut random = Random::new(51);
        for &view in views {
            for _ in 0..120 {
                let Some((ray, triangles)) = seen(&mut random, view) else { continue };
                let mut corners = NO_CORNERS;
                (0..LANES).for_each(|lane| set_corners(&mut corners, lane, &triangles[lane]));
                check(view, &ray, &triangles, &corners);
            }
        }
    }

    #[test]
    fn certain_verdicts_of_a_look_are_those_of_the_exact_test() {
        for level in Level::all() {
            let (mut certain, mut hits) = (0, 0);
            each_view(&VIEWS, |view, ray, triangles, corners| {
                let (verdicts, _) = level.run(Looked(&sight(ray), corners, [WEIGHTS, HEIGHTS]));
                assert_eq!(verdicts.hit & verdicts.unsure, 0);
                for lane in (0..LANES).filter(|lane| verdicts.unsure >> lane & 1 == 0) {
                    let exact = triangle::is_hit_near_edge(ray, &triangles[lane]);
                    assert_eq!(verdicts.hit >> lane & 1 == 1, exact, "{view:?} on {}", level.name());
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

    /// Hits and, of these, those whose exact distance is not where it is said to be.
    fn misplaced(views: &[View], margins: [f32; 2], level: Level) -> [usize; 2] {
        let (mut hits, mut outside) = (0, 0);
        each_view(views, |view, ray, triangles, corners| {
            let (verdicts, [low, high]) = level.run(Looked(&sight(ray), corners, margins));
            let (origin, dir) = (point(ray.origin), point(ray.dir));
            for lane in (0..LANES).filter(|lane| verdicts.hit >> lane & 1 == 1) {
                let t = hit(&origin, &dir, &triangles[lane]);
                assert!(t.is_some() && low[lane].is_finite() && high[lane].is_finite(), "{view:?}");
                hits += 1;
                outside += usize::from(!t.is_some_and(|t| exact(low[lane]) <= t && t <= exact(high[lane])));
            }
        });
        [hits, outside]
    }

    #[test]
    fn exact_distances_lie_where_they_are_said_to() {
        for level in Level::all() {
            for view in VIEWS {
                let [hits, outside] = misplaced(&[view], [WEIGHTS, HEIGHTS], level);
                assert_eq!(outside, 0, "{view:?} on {}: {hits} hits", level.name());
            }
            let [hits, _] = misplaced(&VIEWS, [WEIGHTS, HEIGHTS], level);
            assert!(hits > 1000, "{hits}");
        }
    }

    #[test]
    fn every_margin_of_a_distance_is_needed() {
        for level in Level::all() {
            for (name, margins) in [("weights", [0.0, HEIGHTS]), ("heights", [WEIGHTS, 0.0])] {
                let [hits, outside] = misplaced(&VIEWS, margins, level);
                assert!(outside > 0, "{name} on {}: nothing of {hits} goes wrong without it", level.name());
            }
        }
    }

    #[test]
    fn distances_of_ordinary_hits_are_known_well() {
        for level in Level::all() {
            each_view(&[View::Ordinary], |_, ray, triangles, corners| {
                let (verdicts, [low, high]) = level.run(Looked(&sight(ray), corners, [WEIGHTS, HEIGHTS]));
                for lane in (0..LANES).filter(|lane| verdicts.hit >> lane & 1 == 1) {
                    let farthest = triangles[lane].map(|p| (p - ray.origin).length()).into_iter().fold(0.0, f32::max);
                    assert!(high[lane] - low[lane] < 1e-4 * (farthest + 1.0) / ray.dir.length(), "{}", level.name());
                }
            });
        }
    }
}
