//! Height over a triangle of the round surface that its normals describe, so that the shadow rays of coarse smooth meshes start
//! on that surface and not under it.

use crate::accel::{NO_PRIM, Ray};
use crate::math::Vec3;
use crate::render::shade::Incident;
use crate::render::surface::Surface;

/// Cosine between light and triangle normal from which on shadow rays start on the triangle itself; below it, the more grazing
/// the light, the higher they start. Rays to steeper light leave a rounded mesh in any case.
pub(crate) const STEEP: f32 = 0.1;

/// Heights of a triangle's corners over each other's tangent planes.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct Curve {
    /// Unit normals of the corners.
    normals: [Vec3; 3],
    /// For the tangent plane at each corner, the heights of all three corners over it.
    heights: [Vec3; 3],
}

impl Curve {
    /// Curve of the triangle with these corners and their unit normals, all on one side.
    pub(in crate::render) fn new(vertices: [Vec3; 3], normals: [Vec3; 3]) -> Self {
        let over = |k: usize| {
            let height = |j: usize| (vertices[j] - vertices[k]).dot(normals[k]);
            Vec3::new(height(0), height(1), height(2))
        };
        Self { normals, heights: [over(0), over(1), over(2)] }
    }

    /// Offset from the point with these barycentric coordinates to the round surface: the weighted mean of the offsets to those
    /// tangent planes of the corners that it lies under. Zero at the corners, and where the surface is concave.
    ///
    /// J. Hanika, "Hacking the Shadow Terminator" (Ray Tracing Gems II, 2021).
    pub(in crate::render) fn lift(&self, weights: [f32; 3]) -> Vec3 {
        let at = Vec3::from(weights);
        let to_plane = |k: usize| self.normals[k] * (weights[k] * (-self.heights[k].dot(at)).max(0.0));
        to_plane(0) + to_plane(1) + to_plane(2)
    }
}

/// Rays that test for occlusion between a point and a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadowRays {
    /// Towards the light.
    pub ray: Ray,
    /// From the triangle to the start of that ray, if it starts above the triangle: an occluder in between blocks the light as
    /// well.
    pub riser: Option<Ray>,
}

impl Surface<'_> {
    /// Rays that must be unoccluded for light above the [horizon](Self::horizon) to arrive here; `None` where the triangle itself
    /// blocks it.
    pub(crate) fn shadow_rays(&self, incident: &Incident, sample: u32) -> Option<ShadowRays> {
        let cosine = self.geometric.dot(incident.to_light);
        if cosine < STEEP
            && let Some(lift) = self.lift()
        {
            let foot = self.origin(self.geometric);
            let lift = lift * (1.0 - cosine / STEEP).min(1.0);
            let start = foot + lift;
            let (dir, t_max) = incident.shadow_segment(start);
            // A ray that starts above its own triangle may hit it.
            let ray = Ray { origin: start, t_min: 0.0, dir, t_max, exclude: NO_PRIM, sample };
            let riser = Ray { origin: foot, t_min: 0.0, dir: lift, t_max: 1.0, exclude: self.target.prim, sample };
            return Some(ShadowRays { ray, riser: Some(riser) });
        }
        if cosine <= 0.0 {
            return None;
        }
        Some(ShadowRays { ray: self.shadow_ray(incident, sample), riser: None })
    }

    /// Ray from the triangle itself to a light on either side of it.
    pub(crate) fn shadow_ray(&self, incident: &Incident, sample: u32) -> Ray {
        let (dir, end) = incident.shadow_segment(self.origin(incident.to_light));
        self.ray(dir, end, sample)
    }

    /// Offset to the round surface on the visible side, where it exceeds the rounding of the position.
    fn lift(&self) -> Option<Vec3> {
        let patch = self.patch.as_ref()?;
        let lift = patch.curve(self.side(patch.normal()?))?.lift(patch.weights);
        let rounding = self.error.dot(self.geometric.abs());
        (lift.dot(self.geometric) > rounding && lift.is_finite()).then_some(lift)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three points of the unit sphere around +z, roughly `width` radians from it.
    fn cap(width: f32) -> [Vec3; 3] {
        let corner = |turn: f32| {
            let (sin, cos) = libm::sincosf(turn);
            Vec3::new(cos * width, sin * width, 1.0).normalize()
        };
        [corner(0.0), corner(2.1), corner(4.2)]
    }

    fn weights() -> impl Iterator<Item = [f32; 3]> {
        let pairs = (0..=10u8).flat_map(|i| (0..=10 - i).map(move |j| (f32::from(i) / 10.0, f32::from(j) / 10.0)));
        pairs.map(|(u, v)| [1.0 - u - v, u, v])
    }

    #[test]
    fn a_facet_of_a_ball_is_lifted_to_the_ball_and_no_farther_than_its_tangent_planes_meet() {
        for width in [0.5, 0.1, 0.01] {
            let corners = cap(width);
            let curve = Curve::new(corners, corners);
            for [a, b, c] in weights() {
                let place = corners[0] * a + corners[1] * b + corners[2] * c;
                let radius = (place + curve.lift([a, b, c])).length();
                assert!(radius > 1.0 - 1e-6 && radius < 1.0 + width * width, "{width}: {radius} at {a} {b} {c}");
            }
        }
    }

    #[test]
    fn flat_and_hollow_triangles_stay_where_they_are() {
        let corners = cap(0.3);
        let hollow = Curve::new(corners, corners.map(|n| -n));
        assert!(weights().all(|w| hollow.lift(w) == Vec3::ZERO));
        let flat = Curve::new([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::Z; 3]);
        assert!(weights().all(|w| flat.lift(w) == Vec3::ZERO));
    }
}
