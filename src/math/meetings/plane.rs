//! Rays that share a triangle: the data of its plane are computed once.

use super::super::simd::Lanewise;
use super::super::triangle::{flat_axes, magnitude_cross};
use super::super::{DVec3, Vec3};
use super::Meetings;
use super::quotients::{Quotients, SURE, clamped, quotient};

/// Bounds of the rays of a row.
#[derive(Clone, Copy, Debug)]
pub struct RowBounds {
    /// Smallest origin, by axis.
    pub low: DVec3,
    /// Largest origin, by axis.
    pub high: DVec3,
    /// Common origin, if all rays share one.
    pub from: Option<DVec3>,
    /// Largest absolute component of a direction.
    pub dir: f64,
}

/// Plane of a triangle that the rays of a row share.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    corners: [DVec3; 3],
    normal: DVec3,
    sizes: DVec3,
}

impl Plane {
    /// Computes the plane of a triangle.
    #[inline(always)]
    pub fn of(triangle: &[Vec3; 3]) -> Self {
        let corners = [triangle[0].as_dvec3(), triangle[1].as_dvec3(), triangle[2].as_dvec3()];
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[0]);
        Self { corners, normal: e1.cross(e2), sizes: magnitude_cross(e1.abs(), e2.abs()) }
    }

    /// Intersects rays (by axis and lane) with the triangle.
    #[inline(always)]
    pub fn meet<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        bounds: &RowBounds,
    ) -> Meetings<S::Lanes> {
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
        // Bounds for the farthest and the steepest possible ray.
        let n_bound = s.splat_f64(self.sizes.dot(low.max(high)) * f64::from(SURE));
        let d_bound = s.splat_f64(self.sizes.element_sum() * bounds.dir * f64::from(SURE));
        let Quotients { rounded, value, sure } = quotient(s, [numerator, n_bound], [denominator, d_bound]);
        Meetings { t: rounded, weights: self.barycentrics(s, origin, dir, value), sure }
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

    /// Barycentric weights of the second and third corner: [`barycentrics_at`](super::super::triangle::barycentrics_at) in
    /// lanes.
    #[inline(always)]
    fn barycentrics<S: Lanewise<N>, const N: usize>(
        &self,
        s: S,
        origin: &[[f32; N]; 3],
        dir: &[[f32; N]; 3],
        t: S::Doubles,
    ) -> [S::Lanes; 2] {
        let [i, j] = flat_axes(self.normal);
        let [a, b, c] = [self.corners[0].to_array(), self.corners[1].to_array(), self.corners[2].to_array()];
        let px = self.along(s, origin, dir, t, i);
        let py = self.along(s, origin, dir, t, j);
        let ((bx, by), (cx, cy)) = ((b[i] - a[i], b[j] - a[j]), (c[i] - a[i], c[j] - a[j]));
        let scale = s.splat_f64(1.0 / (bx * cy - by * cx));
        let u = s.sub_f64(s.mul_f64(px, s.splat_f64(cy)), s.mul_f64(py, s.splat_f64(cx)));
        let v = s.sub_f64(s.mul_f64(s.splat_f64(bx), py), s.mul_f64(s.splat_f64(by), px));
        clamped(s, s.mul_f64(u, scale), s.mul_f64(v, scale))
    }

    /// Coordinate `k` of the points at `t`, relative to the first corner.
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
}
