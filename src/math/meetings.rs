//! Eight rays, each with the triangle that it hits: [`meet`](super::triangle::meet) and
//! [`barycentrics_at`](super::triangle::barycentrics_at) in lanes, operation by operation.

use super::bounds::{PLANE_TERMS_F64, POSITION_T};
use super::simd::{LANES, Row, Simd};
use super::triangles::Corners8;

/// Rays and triangles, by axis and lane.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    /// Where the rays start.
    pub origin: [Row; 3],
    /// Their directions.
    pub dir: [Row; 3],
    /// The triangle that each of them hits.
    pub corners: Corners8,
}

/// Where they meet.
#[derive(Clone, Copy, Debug)]
pub struct Places {
    /// Exact t, rounded once.
    pub t: Row,
    /// Weights of the second and third corner.
    pub weights: [Row; 2],
    /// The lanes in which that is certain; for the others the scalar form must be asked.
    pub sure: u32,
}

/// Eight vectors.
struct Vectors<S: Simd>([S::Doubles; 3]);

impl<S: Simd> Vectors<S> {
    #[inline(always)]
    fn of(s: S, rows: &[Row; 3]) -> Self {
        Self([s.widen(s.load(&rows[0])), s.widen(s.load(&rows[1])), s.widen(s.load(&rows[2]))])
    }

    #[inline(always)]
    fn minus(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([s.sub_f64(a, *x), s.sub_f64(b, *y), s.sub_f64(c, *z)])
    }

    #[inline(always)]
    fn abs(&self, s: S) -> Self {
        let [x, y, z] = self.0;
        Self([s.abs_f64(x), s.abs_f64(y), s.abs_f64(z)])
    }

    #[inline(always)]
    fn dot(&self, s: S, Self([x, y, z]): &Self) -> S::Doubles {
        let [a, b, c] = self.0;
        s.add_f64(s.add_f64(s.mul_f64(a, *x), s.mul_f64(b, *y)), s.mul_f64(c, *z))
    }

    #[inline(always)]
    fn cross(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([
            s.sub_f64(s.mul_f64(b, *z), s.mul_f64(*y, c)),
            s.sub_f64(s.mul_f64(c, *x), s.mul_f64(*z, a)),
            s.sub_f64(s.mul_f64(a, *y), s.mul_f64(*x, b)),
        ])
    }

    /// With sums for differences.
    #[inline(always)]
    fn magnitude_cross(&self, s: S, Self([x, y, z]): &Self) -> Self {
        let [a, b, c] = self.0;
        Self([
            s.add_f64(s.mul_f64(b, *z), s.mul_f64(c, *y)),
            s.add_f64(s.mul_f64(c, *x), s.mul_f64(a, *z)),
            s.add_f64(s.mul_f64(a, *y), s.mul_f64(b, *x)),
        ])
    }
}

impl Pairs {
    /// No rays.
    pub const EMPTY: Self =
        Self { origin: [[0.0; LANES]; 3], dir: [[0.0; LANES]; 3], corners: super::triangles::NO_CORNERS };

    /// Where each ray meets its triangle.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, s: S) -> Places {
        let [a, b, c] = &self.corners;
        let (a, b, c) = (Vectors::of(s, a), Vectors::of(s, b), Vectors::of(s, c));
        let (o, d) = (Vectors::of(s, &self.origin), Vectors::of(s, &self.dir));
        let (e1, e2) = (b.minus(s, &a), c.minus(s, &a));
        let normal = e1.cross(s, &e2);
        let sizes = e1.abs(s).magnitude_cross(s, &e2.abs(s));
        let from = a.minus(s, &o);
        let terms = s.splat_f64(PLANE_TERMS_F64);
        let (numerator, n_error) = (normal.dot(s, &from), s.mul_f64(sizes.dot(s, &from.abs(s)), terms));
        let (denominator, d_error) = (normal.dot(s, &d), s.mul_f64(sizes.dot(s, &d.abs(s)), terms));

        // As in `quotient::Bounded`.
        let quarter = s.splat_f64(0.25);
        let signs = s.less_f64(d_error, s.mul_f64(quarter, s.abs_f64(denominator)))
            & s.less_f64(n_error, s.mul_f64(quarter, s.abs_f64(numerator)));
        let reciprocal = s.div_f64(s.splat_f64(1.0), denominator);
        let t = s.mul_f64(numerator, reciprocal);
        let size = s.abs_f64(t);
        let error = s.add_f64(
            s.mul_f64(s.add_f64(n_error, s.mul_f64(d_error, size)), s.mul_f64(s.splat_f64(1.5), s.abs_f64(reciprocal))),
            s.mul_f64(size, s.splat_f64(2.0 * f64::EPSILON)),
        );
        let spread = s.mul_f64(error, s.splat_f64(1.001));
        let (low, high) = (s.narrow(s.sub_f64(t, spread)), s.narrow(s.add_f64(t, spread)));
        let rounded = s.at_most(low, high) & s.at_most(high, low);
        // Below the normal numbers zero gets a sign, which is left to the scalar form.
        let normal_t = s.less_f64(s.splat_f64(f64::from(f32::MIN_POSITIVE)), size);
        let sure = signs & s.less_f64(error, s.mul_f64(size, s.splat_f64(POSITION_T))) & rounded & normal_t;

        Places { t: s.store(low), weights: weights(s, [&o, &d, &a], [&e1, &e2], &normal, t), sure }
    }
}

/// Weights of the second and third corner: areas seen along the axis from which they are largest. Each is a component of a
/// cross product over that of the normal.
#[inline(always)]
fn weights<S: Simd>(
    s: S,
    [o, d, a]: [&Vectors<S>; 3],
    [e1, e2]: [&Vectors<S>; 2],
    normal: &Vectors<S>,
    t: S::Doubles,
) -> [Row; 2] {
    let Vectors([dx, dy, dz]) = *d;
    let moved = Vectors::<S>([s.mul_f64(dx, t), s.mul_f64(dy, t), s.mul_f64(dz, t)]);
    let p = Vectors::<S>([s.add_f64(o.0[0], moved.0[0]), s.add_f64(o.0[1], moved.0[1]), s.add_f64(o.0[2], moved.0[2])])
        .minus(s, a);
    let [x, y, z] = normal.abs(s).0;
    let along_x = !s.less_f64(x, y) & !s.less_f64(x, z);
    let along_y = !s.less_f64(y, z) & !along_x;
    let scale = s.div_f64(s.splat_f64(1.0), seen(s, normal, along_x, along_y));
    let u = s.mul_f64(seen(s, &p.cross(s, e2), along_x, along_y), scale);
    let v = s.mul_f64(seen(s, &e1.cross(s, &p), along_x, along_y), scale);
    let (zero, one) = (s.splat_f64(0.0), s.splat_f64(1.0));
    // 0 for a NaN.
    let u = s.store(s.narrow(s.smaller_f64(s.greater_f64(u, zero), one)));
    let mut v = s.store(s.narrow(s.smaller_f64(s.greater_f64(v, zero), one)));
    for lane in 0..LANES {
        v[lane] = if u[lane] + v[lane] > 1.0 { 1.0 - u[lane] } else { v[lane] };
    }
    [u, v]
}

/// The component along an axis, the third where it is neither of both.
#[inline(always)]
fn seen<S: Simd>(s: S, Vectors([x, y, z]): &Vectors<S>, along_x: u32, along_y: u32) -> S::Doubles {
    let mut row = s.store_f64(*z);
    s.put_f64(along_y, *y, &mut row);
    s.put_f64(along_x, *x, &mut row);
    s.load_f64(&row)
}
