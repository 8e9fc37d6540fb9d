//! Sheared ray space: the ray becomes the third axis, and what it hits is decided in the plane of the other two.
//!
//! After S. Woop, C. Benthin, I. Wald, *Watertight Ray/Triangle Intersection*, 2013. Corners shared by prims get the same
//! sheared coordinates, so a mesh becomes one planar drawing without gaps. What differs: the sign of every edge value is
//! exact for the `f32` ray and corners, so that it does not depend on how it was computed.

use super::bounds::edge_error_f64;
use super::expansion::{Expansion, cross, difference, dot_f32};
use super::{DVec3, Vec3};

/// What the tests of one ray share. Nothing is fused and nothing depends on the prims.
#[derive(Clone, Copy, Debug)]
pub struct RaySpace {
    /// The ray's origin.
    pub origin: Vec3,
    /// The ray's direction, of any length.
    pub dir: Vec3,
    /// Axis of the direction's largest component.
    pub z: usize,
    /// The next axis.
    pub x: usize,
    /// The axis after that.
    pub y: usize,
    /// dir.x / dir.z in these axes, in `f32`; at most 1 in size.
    pub shear: (f32, f32),
}

impl RaySpace {
    /// `None` for a ray that cannot hit: zero direction, or anything not finite.
    pub fn new(origin: Vec3, dir: Vec3) -> Option<Self> {
        let size = dir.abs();
        let z = if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let usable = origin.is_finite() && dir.is_finite() && dir[z] != 0.0;
        usable.then(|| Self { origin, dir, z, x, y, shear: (dir[x] / dir[z], dir[y] / dir[z]) })
    }

    /// A corner relative to the origin, axes in sheared order but not yet sheared, in `f64`.
    fn relative(&self, p: Vec3) -> DVec3 {
        DVec3::new(
            f64::from(p[self.x]) - f64::from(self.origin[self.x]),
            f64::from(p[self.y]) - f64::from(self.origin[self.y]),
            f64::from(p[self.z]) - f64::from(self.origin[self.z]),
        )
    }

    /// The shear of a relative corner, in `f64`.
    fn shear64(&self, a: DVec3) -> (f64, f64) {
        let z = f64::from(self.dir[self.z]);
        (a.x - f64::from(self.dir[self.x]) / z * a.z, a.y - f64::from(self.dir[self.y]) / z * a.z)
    }

    /// The exact sign of x'ₚ y'_q − y'ₚ x'_q: on which side of the ray the edge from `p` to `q` passes.
    pub fn edge_sign(&self, p: Vec3, q: Vec3) -> i32 {
        let (a, b) = (self.relative(p), self.relative(q));
        let ((ax, ay), (bx, by)) = (self.shear64(a), self.shear64(b));
        let reach = a.abs().max_element().max(b.abs().max_element());
        let spread = ax.abs().max(ay.abs()).max(bx.abs()).max(by.abs());
        let edge = ax * by - ay * bx;
        if edge.abs() > edge_error_f64(reach, spread) {
            return if edge > 0.0 { 1 } else { -1 };
        }
        self.edge_sign_exact(p, q)
    }

    /// x'ₚ y'_q − y'ₚ x'_q = d · (p × q) / d_z with p, q relative to the origin.
    #[cold]
    fn edge_sign_exact(&self, p: Vec3, q: Vec3) -> i32 {
        let o = self.origin.to_array();
        let normal = cross(&difference(p.to_array(), o), &difference(q.to_array(), o));
        dot_f32(&normal, self.dir.to_array()).sign() * self.direction_sign()
    }

    /// The exact sign of y' of a corner.
    pub fn height_sign(&self, p: Vec3) -> i32 {
        let a = self.relative(p);
        let (_, y) = self.shear64(a);
        // The displacement of a sheared corner, as in `edge_error_f64`: 4 u D + u M, M ≤ 2 D.
        if y.abs() > 7.0 * super::bounds::U64 * a.abs().max_element() {
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
