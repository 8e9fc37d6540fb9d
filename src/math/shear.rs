//! Sheared ray space: the ray becomes the third axis, and hits are decided in the plane of the other two.
//!
//! After S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, 2013. Corners shared by prims get the same
//! sheared coordinates, so a mesh becomes one planar drawing without gaps. The difference: the sign of every edge value is
//! exact for the `f32` ray and corners, so that it does not depend on the way of computing it.

use super::bounds::{EDGE_ROUNDING_F64, HEIGHT_F64, edge_error_f64};
use super::expansion::{Expansion, cross, difference, dot_f32};
use super::{DVec3, Vec3};

/// Data shared by the tests of one ray. No operation is fused and nothing depends on the prims.
#[derive(Clone, Copy, Debug)]
pub struct RaySpace {
    /// Origin of the ray.
    pub origin: Vec3,
    /// Direction of the ray, of any length.
    pub dir: Vec3,
    /// Axis of the direction's largest component.
    pub z: usize,
    /// Axis after `z`, cyclically.
    pub x: usize,
    /// Axis after `x`, cyclically.
    pub y: usize,
    /// dir.x / dir.z in these axes, in `f32`; at most 1 in size.
    pub shear: (f32, f32),
}

/// The axis after each, cyclically; the last entry is unused.
const NEXT: [usize; 4] = [1, 2, 0, 0];

/// Axis of a direction's largest component; the first of equal ones.
#[inline(always)]
pub fn main_axis(dir: Vec3) -> usize {
    let (x, y, z) = (dir.x.abs(), dir.y.abs(), dir.z.abs());
    // Without branches, which diverging rays would make unpredictable.
    let either = usize::from(y > x);
    let most = if y > x { y } else { x };
    either + (2 - either) * usize::from(z > most)
}

impl RaySpace {
    /// Ray space of a ray; `None` if it cannot hit: zero direction, or anything not finite.
    #[inline]
    pub fn new(origin: Vec3, dir: Vec3) -> Option<Self> {
        let (space, usable) = Self::checked(origin, dir);
        usable.then_some(space)
    }

    /// Ray space of a ray, and whether it can hit.
    #[inline(always)]
    pub fn checked(origin: Vec3, dir: Vec3) -> (Self, bool) {
        let z = main_axis(dir);
        let (x, y) = (NEXT[z & 3], NEXT[NEXT[z & 3] & 3]);
        let d = [dir.x, dir.y, dir.z, 0.0];
        let (d_x, d_y, d_z) = (d[x & 3], d[y & 3], d[z & 3]);
        let usable = origin.is_finite() && dir.is_finite() && d_z != 0.0;
        (Self { origin, dir, z, x, y, shear: (d_x / d_z, d_y / d_z) }, usable)
    }

    /// Corner relative to the origin, with axes in sheared order but not yet sheared, in `f64`.
    fn relative(&self, p: Vec3) -> DVec3 {
        DVec3::new(
            f64::from(p[self.x]) - f64::from(self.origin[self.x]),
            f64::from(p[self.y]) - f64::from(self.origin[self.y]),
            f64::from(p[self.z]) - f64::from(self.origin[self.z]),
        )
    }

    /// Shears a relative corner, in `f64`.
    fn shear64(&self, a: DVec3) -> (f64, f64) {
        let z = f64::from(self.dir[self.z]);
        (a.x - f64::from(self.dir[self.x]) / z * a.z, a.y - f64::from(self.dir[self.y]) / z * a.z)
    }

    /// Exact sign of x'ₚ y'_q − y'ₚ x'_q: the side of the ray on which the edge from `p` to `q` passes.
    #[inline]
    pub fn edge_sign(&self, p: Vec3, q: Vec3) -> i32 {
        self.edge_sign_within(p, q, EDGE_ROUNDING_F64)
    }

    /// [`Self::edge_sign`], in `f64` where that is certain for the given unit roundoff.
    #[inline]
    fn edge_sign_within(&self, p: Vec3, q: Vec3, rounding: f64) -> i32 {
        let (a, b) = (self.relative(p), self.relative(q));
        let ((ax, ay), (bx, by)) = (self.shear64(a), self.shear64(b));
        let reach = a.abs().max_element().max(b.abs().max_element());
        let spread = ax.abs().max(ay.abs()).max(bx.abs()).max(by.abs());
        let edge = ax * by - ay * bx;
        if edge.abs() > edge_error_f64(reach, spread, rounding) {
            return if edge > 0.0 { 1 } else { -1 };
        }
        self.edge_sign_exact(p, q)
    }

    /// x'ₚ y'_q − y'ₚ x'_q = d · (p × q) / d_z with p, q relative to the origin.
    #[cold]
    fn edge_sign_exact(&self, p: Vec3, q: Vec3) -> i32 {
        // Rounding made the edge a point, or the ray starts at its end, as at a corner where many edges meet.
        if p == q || p == self.origin || q == self.origin {
            return 0;
        }
        let o = self.origin.to_array();
        let normal = cross(&difference(p.to_array(), o), &difference(q.to_array(), o));
        dot_f32(&normal, self.dir.to_array()).sign() * self.direction_sign()
    }

    /// Exact sign of y' of a corner.
    #[inline]
    pub fn height_sign(&self, p: Vec3) -> i32 {
        self.height_sign_within(p, HEIGHT_F64)
    }

    /// [`Self::height_sign`], in `f64` where that is certain for the given relative error.
    #[inline]
    fn height_sign_within(&self, p: Vec3, error: f64) -> i32 {
        let a = self.relative(p);
        let (_, y) = self.shear64(a);
        if y.abs() > error * a.abs().max_element() {
            return if y > 0.0 { 1 } else { -1 };
        }
        self.height_sign_exact(p)
    }

    #[cold]
    fn height_sign_exact(&self, p: Vec3) -> i32 {
        let a = difference(p.to_array(), self.origin.to_array());
        let mut e = Expansion::<8>::ZERO;
        e.add_product(a[self.y].terms(), &[f64::from(self.dir[self.z])], 1.0);
        e.add_product(a[self.z].terms(), &[f64::from(self.dir[self.y])], -1.0);
        e.sign() * self.direction_sign()
    }

    fn direction_sign(&self) -> i32 {
        if self.dir[self.z] > 0.0 { 1 } else { -1 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    /// Numbers of wrong signs of edges and heights when `f64` is trusted with these error bounds; the rays pass exactly
    /// through the corners.
    fn wrong(rounding: f64, height: f64) -> [usize; 2] {
        let mut random = Random::new(8);
        let mut point = || (random.cube() * 50.0).round() * 0.1;
        let (mut edges, mut heights) = (0, 0);
        for _ in 0..2000 {
            let (o, p, q) = (point(), point(), point());
            let Some(ray) = RaySpace::new(o, p - o) else { continue };
            edges += usize::from(ray.edge_sign_within(p, q, rounding) != ray.edge_sign_exact(p, q));
            heights += usize::from(ray.height_sign_within(p, height) != ray.height_sign_exact(p));
        }
        [edges, heights]
    }

    #[test]
    fn the_margins_of_signs_in_double_precision_are_needed() {
        assert_eq!(wrong(EDGE_ROUNDING_F64, HEIGHT_F64), [0, 0]);
        let [edges, heights] = wrong(0.0, 0.0);
        assert!(edges > 0 && heights > 0, "{edges}, {heights}: nothing goes wrong without them");
    }
}
