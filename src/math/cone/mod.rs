//! Ray against the mantle of a truncated cone (a cylinder if both radii are equal), open at both ends.
//!
//! Every number is in a form that does not cancel (`roots`), with a running bound of its error; where `f64` cannot decide,
//! the same formula runs in double-length numbers. The results, for the `f32` ray and cone:
//!
//! - A distance is within 2½ ulp (`f32`) of the exact one. Below 2⁻⁸⁰ of the cone's size, near the origin, the error is
//!   absolute, and distances that cannot be told from 0 are 0: a ray that starts on the mantle hits it at 0.
//! - The verdict (hit or not) is exact unless the line passes the outline or a rim within 2⁻⁸⁰ of the distance from which the
//!   ray comes; there it counts as a hit: a tangent, a rim and an apex are hit.
//! - A line that runs in the mantle has no single point in common with it and does not hit, as with triangles.

mod roots;
#[cfg(test)]
mod tests;

use super::aabb::Aabb;
use super::quotient::round;
use super::shear::RaySpace;
use super::{DVec3, Vec3};

/// Mantle between two circles around one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Centre of one end.
    pub base: Vec3,
    /// Radius at the base; 0 or more, and not 0 at both ends.
    pub base_radius: f32,
    /// Centre of the other end. If it equals `base`, nothing is hit.
    pub apex: Vec3,
    /// Radius at the apex.
    pub apex_radius: f32,
}

/// Distances at which the line through the ray meets the mantle, smaller first, NaN for none; rounded once.
///
/// With `ahead`, negative distances may be left out.
pub fn intersect(ray: &RaySpace, cone: &Cone, ahead: bool) -> [f32; 2] {
    let [a, b] = distances(ray, cone, ahead).map(round);
    // Also where only the first is NaN.
    if a <= b || b.is_nan() { [a, b] } else { [b, a] }
}

/// [`intersect`], not rounded and in no order.
pub fn distances(ray: &RaySpace, cone: &Cone, ahead: bool) -> [f64; 2] {
    roots::distances(ray, cone, ahead)
}

impl Cone {
    /// Box around the mantle, each side less than two floats too far out.
    ///
    /// A circle of radius r across the unit axis a reaches r √(1 − aₖ²) along axis k.
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what this does")]
    pub fn bounds(&self) -> Aabb {
        let axis = self.apex.as_dvec3() - self.base.as_dvec3();
        let (square, length2) = (axis * axis, axis.length_squared());
        // 1 − aₖ² from the other two components, which does not cancel; errs by less than 8 u.
        let across = DVec3::new(square.y + square.z, square.z + square.x, square.x + square.y);
        let reach = (across / length2).map(|x| (x.sqrt() * (1.0 + 1e-14)).min(1.0));
        let reach = if reach.is_nan() { DVec3::ONE } else { reach };
        let ends = [(self.base, self.base_radius), (self.apex, self.apex_radius)];
        let [(lo_a, hi_a), (lo_b, hi_b)] = ends.map(|(center, radius)| {
            let (center, arm) = (center.as_dvec3(), reach * f64::from(radius));
            (center - arm, center + arm)
        });
        let down = |x: f64| if f64::from(x as f32) <= x { x as f32 } else { (x as f32).next_down() };
        let (lo, hi) = (lo_a.min(lo_b).to_array(), hi_a.max(hi_b).to_array());
        // One float more, for the rounding of the sum in `f64`.
        Aabb {
            lo: Vec3::from_array(lo.map(|x| down(x).next_down())),
            hi: Vec3::from_array(hi.map(|x| -down(-x).next_down())),
        }
    }

    /// Largest of the radii and the axis, which is measured along its largest component.
    pub fn size(&self) -> f32 {
        let length = (self.apex - self.base).abs().max_element();
        length.max(self.base_radius).max(self.apex_radius).min(f32::MAX)
    }

    /// Point of the mantle nearest to `p`, which is near it, relative to the base; the size of the numbers rounded in
    /// between; and the outward unit normal there.
    pub fn project(&self, p: DVec3) -> (DVec3, f64, DVec3) {
        let profile = Profile::new(self);
        let p = p - self.base.as_dvec3();
        let s = p.dot(profile.axis);
        let radial = p - profile.axis * s;
        let out = radial.try_normalize().unwrap_or_else(|| profile.axis.any_orthonormal_vector());
        // In the half plane through the axis the mantle is a segment.
        let off = profile.height_above(s, radial.length());
        let s = (s - off * profile.normal.0).clamp(0.0, profile.length);
        let radius = profile.radius_at(s);
        let normal = profile.axis * profile.normal.0 + out * profile.normal.1;
        (profile.axis * s + out * radius, profile.length + radius, normal.normalize_or(out))
    }
}

/// Profile of the cone in a half plane through its axis, where the mantle is the segment from (0, base radius) to (length,
/// apex radius).
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Unit axis, from base to apex.
    pub axis: DVec3,
    /// Distance between the ends.
    pub length: f64,
    /// Radius at the base, and its growth along the whole length.
    radii: (f64, f64),
    /// Unit normal of the segment: (along the axis, away from it).
    normal: (f64, f64),
}

impl Profile {
    /// Computes the profile of a cone whose ends differ.
    pub fn new(cone: &Cone) -> Self {
        let axis = cone.apex.as_dvec3() - cone.base.as_dvec3();
        let length = axis.length();
        let (r0, r1) = (f64::from(cone.base_radius), f64::from(cone.apex_radius));
        let side = (length * length + (r1 - r0) * (r1 - r0)).sqrt();
        let axis = axis.try_normalize().unwrap_or(DVec3::Z);
        Self { axis, length, radii: (r0, r1 - r0), normal: ((r0 - r1) / side, length / side) }
    }

    /// Signed distance from the line through the segment, for the point `s` along the axis and `across` away from it.
    fn height_above(&self, s: f64, across: f64) -> f64 {
        (across - self.radii.0) * self.normal.1 + s * self.normal.0
    }

    fn radius_at(&self, s: f64) -> f64 {
        if self.length > 0.0 { (self.radii.0 + self.radii.1 * (s / self.length)).max(0.0) } else { self.radii.0 }
    }

    /// Distance from the mantle, for a point `s` along the axis and `across` ≥ 0 away from it.
    pub fn distance(&self, s: f64, across: f64) -> f64 {
        let (ds, dr) = (self.length, self.radii.1);
        let (x, y) = (s, across - self.radii.0);
        let share = ((x * ds + y * dr) / (ds * ds + dr * dr)).clamp(0.0, 1.0);
        let (x, y) = (x - share * ds, y - share * dr);
        (x * x + y * y).sqrt()
    }
}
