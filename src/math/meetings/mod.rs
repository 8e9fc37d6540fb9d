//! Intersections of rays with triangles that they hit: [`meet`](super::triangle::meet) and
//! [`barycentrics_at`](super::triangle::barycentrics_at) in lanes, operation by operation; for rays that each have a triangle
//! of their own ([`meet`]), or that share one ([`Plane`]).

mod plane;
mod quotients;
#[cfg(test)]
mod tests;
mod vectors;

pub use plane::{Plane, RowBounds};

use super::simd::{LANES, Lanewise, Row, Simd};
use super::triangles::Corners8;
use quotients::{Quotients, SURE, clamped, quotient};
use vectors::Vectors;

/// Rays and the triangles they hit, by axis and lane.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    /// Origins of the rays.
    pub origin: [Row; 3],
    /// Directions of the rays.
    pub dir: [Row; 3],
    /// The triangle that each ray hits.
    pub corners: Corners8,
}

/// Intersections of rays with triangles.
#[derive(Clone, Copy, Debug)]
pub struct Meetings<L> {
    /// Exact t, rounded once.
    pub t: L,
    /// Barycentric weights of the second and third corner.
    pub weights: [L; 2],
    /// Bit mask of the lanes in which the results are certain; the others need the scalar form.
    pub sure: u32,
}

impl Pairs {
    /// No rays and no triangles.
    pub const EMPTY: Self =
        Self { origin: [[0.0; LANES]; 3], dir: [[0.0; LANES]; 3], corners: super::triangles::NO_CORNERS };

    /// Intersects each ray with its triangle.
    #[inline(always)]
    pub fn meet<S: Simd>(&self, s: S) -> Meetings<Row> {
        let [a, b, c] = &self.corners;
        let corners = [loaded(s, a), loaded(s, b), loaded(s, c)];
        let Meetings { t, weights: [u, v], sure } = meet(s, loaded(s, &self.origin), loaded(s, &self.dir), corners);
        Meetings { t: s.store(t), weights: [s.store(u), s.store(v)], sure }
    }
}

/// Loads three rows.
#[inline(always)]
fn loaded<S: Lanewise<N>, const N: usize>(s: S, [x, y, z]: &[[f32; N]; 3]) -> [S::Lanes; 3] {
    [s.load(x), s.load(y), s.load(z)]
}

/// Intersects rays with their triangles; origins, directions and corners by axis.
#[inline(always)]
pub fn meet<S: Lanewise<N>, const N: usize>(
    s: S,
    origin: [S::Lanes; 3],
    dir: [S::Lanes; 3],
    corners: [[S::Lanes; 3]; 3],
) -> Meetings<S::Lanes> {
    let [n_bound, d_bound] = term_bounds(s, origin, dir, corners);
    let [a, b, c] = corners;
    let (a, b, c) = (Vectors::<S, N>::of(s, a), Vectors::<S, N>::of(s, b), Vectors::<S, N>::of(s, c));
    let (o, d) = (Vectors::<S, N>::of(s, origin), Vectors::<S, N>::of(s, dir));
    let (e1, e2) = (b.minus(s, &a), c.minus(s, &a));
    let normal = e1.cross(s, &e2);
    let (numerator, denominator) = (normal.dot(s, &a.minus(s, &o)), normal.dot(s, &d));
    let (n_bound, d_bound) = (s.widen(n_bound), s.widen(d_bound));
    let Quotients { rounded, value, sure } = quotient(s, [numerator, n_bound], [denominator, d_bound]);
    Meetings { t: rounded, weights: weights(s, [&o, &d, &a], [&e1, &e2], &normal, value), sure }
}

/// Lower bounds for certain numerators and denominators: [`SURE`] times the sums of the sizes of their terms.
#[inline(always)]
fn term_bounds<S: Lanewise<N>, const N: usize>(
    s: S,
    origin: [S::Lanes; 3],
    dir: [S::Lanes; 3],
    [a, b, c]: [[S::Lanes; 3]; 3],
) -> [S::Lanes; 2] {
    let (p, q, from) = (apart(s, b, a), apart(s, c, a), apart(s, a, origin));
    let sizes = [
        s.mul_add(p[1], q[2], s.mul(p[2], q[1])),
        s.mul_add(p[2], q[0], s.mul(p[0], q[2])),
        s.mul_add(p[0], q[1], s.mul(p[1], q[0])),
    ];
    let along = [s.abs(dir[0]), s.abs(dir[1]), s.abs(dir[2])];
    let (sure, least) = (s.splat(SURE), s.splat(f32::MIN_POSITIVE));
    [s.mul_add(sum(s, sizes, from), sure, least), s.mul_add(sum(s, sizes, along), sure, least)]
}

/// Absolute differences, by axis.
#[inline(always)]
fn apart<S: Lanewise<N>, const N: usize>(s: S, p: [S::Lanes; 3], q: [S::Lanes; 3]) -> [S::Lanes; 3] {
    [s.abs(s.sub(p[0], q[0])), s.abs(s.sub(p[1], q[1])), s.abs(s.sub(p[2], q[2]))]
}

/// p · q.
#[inline(always)]
fn sum<S: Lanewise<N>, const N: usize>(s: S, p: [S::Lanes; 3], q: [S::Lanes; 3]) -> S::Lanes {
    s.mul_add(p[0], q[0], s.mul_add(p[1], q[1], s.mul(p[2], q[2])))
}

/// Barycentric weights of the second and third corner: areas in the projection along the axis in which they are largest. Each
/// is a component of a cross product over that of the normal.
#[inline(always)]
fn weights<S: Lanewise<N>, const N: usize>(
    s: S,
    [o, d, a]: [&Vectors<S, N>; 3],
    [e1, e2]: [&Vectors<S, N>; 2],
    normal: &Vectors<S, N>,
    t: S::Doubles,
) -> [S::Lanes; 2] {
    let [x, y, z] = normal.abs(s).0;
    let along_x = !s.less_f64(x, y) & !s.less_f64(x, z);
    let along = [along_x, !s.less_f64(y, z) & !along_x];
    let scale = s.div_f64(s.splat_f64(1.0), normal.turned(s, along)[2]);
    let ([ox, oy, _], [dx, dy, _], [ax, ay, _]) = (o.turned(s, along), d.turned(s, along), a.turned(s, along));
    let px = s.sub_f64(s.add_f64(ox, s.mul_f64(dx, t)), ax);
    let py = s.sub_f64(s.add_f64(oy, s.mul_f64(dy, t)), ay);
    let ([bx, by, _], [cx, cy, _]) = (e1.turned(s, along), e2.turned(s, along));
    let u = s.sub_f64(s.mul_f64(px, cy), s.mul_f64(cx, py));
    let v = s.sub_f64(s.mul_f64(bx, py), s.mul_f64(px, by));
    clamped(s, s.mul_f64(u, scale), s.mul_f64(v, scale))
}
