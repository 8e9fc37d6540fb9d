//! Stepping back until everything is in the picture, and no further.

use super::{Bounds, Direction};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::scene::{Camera, Projection, Scene};

/// Which kind of camera to place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameLens {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians, between 0 and π.
        y_fov: f64,
    },
    /// Parallel rays, as far apart as the model needs.
    Orthographic,
}

/// Share of the picture's width and height that the model may fill; the rest is border.
const FILL: f64 = 0.92;

/// A camera that sees the model in `bounds` from `direction`, filling a picture of `aspect` width / height.
///
/// The fit is to the projected vertices, not to a box or ball around them: the outermost ones touch the border on two
/// opposite sides and are centred between the others.
pub fn frame(scene: &Scene, bounds: &Bounds, direction: Direction, lens: FrameLens, aspect: f64) -> Camera {
    let axes = axes(direction);
    let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
    let center = bounds.center();
    let (eye, projection) = match lens {
        FrameLens::Perspective { y_fov } => {
            let half = libm::tan(0.5 * y_fov.clamp(1e-3, 3.0));
            let extremes = Extremes::of(scene, bounds, &axes, center, (half * aspect * FILL, half * FILL));
            (extremes.pinhole(bounds.radius()), Projection::Perspective { y_fov, aspect: None })
        }
        FrameLens::Orthographic => {
            let extremes = Extremes::of(scene, bounds, &axes, center, (0.0, 0.0));
            let (eye, half_height) = extremes.parallel(bounds.radius(), aspect);
            (eye, Projection::Orthographic { x_mag: half_height * aspect, y_mag: half_height })
        }
    };
    let world_from_camera = DAffine3::from_mat3_translation(axes, center + axes * eye);
    Camera { name: String::new(), projection, world_from_camera }
}

/// The camera's axes: +x right, +y up, +z towards the eye.
fn axes(direction: Direction) -> DMat3 {
    let z = direction.from.normalize_or(DVec3::Z);
    let upright = |up: DVec3| up.cross(z).try_normalize();
    let x = upright(direction.up).or_else(|| upright(DVec3::Y)).or_else(|| upright(DVec3::Z)).unwrap_or(DVec3::X);
    DMat3::from_cols(x, z.cross(x), z)
}

/// How far the model reaches past planes through the origin of camera space that lean like the sides of the picture.
///
/// Right, left, top, bottom: the greatest `±x + slope·z`, `±y + slope·z`, z towards the eye; and the greatest z.
struct Extremes {
    sides: [f64; 4],
    near: f64,
    slopes: (f64, f64),
}

impl Extremes {
    fn of(scene: &Scene, bounds: &Bounds, axes: &DMat3, center: DVec3, slopes: (f64, f64)) -> Self {
        let mut extremes = Self { sides: [f64::NEG_INFINITY; 4], near: f64::NEG_INFINITY, slopes };
        let camera_from_world = axes.transpose();
        for instance in &scene.instances {
            let Some(mesh) = scene.meshes.get(instance.mesh as usize) else { continue };
            // Faces share their corners.
            let mut seen = vec![false; mesh.positions.len()];
            for &i in mesh.triangles.iter().flatten().chain(&mesh.polygon_corners) {
                let Some(p) = mesh.positions.get(i as usize) else { continue };
                if std::mem::replace(&mut seen[i as usize], true) {
                    continue;
                }
                let p = instance.world_from_object.transform_point3(p.as_dvec3());
                if bounds.contains(p) {
                    extremes.add(camera_from_world * (p - center), 0.0);
                }
            }
        }
        for sphere in scene.spheres.iter().filter(|sphere| bounds.contains(sphere.center)) {
            extremes.add(camera_from_world * (sphere.center - center), sphere.radius);
        }
        for cone in &scene.cones {
            let (lo, hi) = cone.bounds();
            if bounds.contains((lo + hi) * 0.5) {
                // Balls around the ends hold the mantle; those of a wide flat one reach too far.
                extremes.add(camera_from_world * (cone.base - center), cone.base_radius);
                extremes.add(camera_from_world * (cone.apex - center), cone.apex_radius);
            }
        }
        if extremes.near == f64::NEG_INFINITY {
            extremes.add(DVec3::ZERO, bounds.radius());
        }
        extremes
    }

    /// Takes in a ball, or a point of radius 0.
    fn add(&mut self, p: DVec3, radius: f64) {
        let (sx, sy) = self.slopes;
        // A ball reaches past a plane by its radius times the length of the plane's normal.
        let (rx, ry) = (radius * (1.0 + sx * sx).sqrt(), radius * (1.0 + sy * sy).sqrt());
        let reach = [p.x + sx * p.z + rx, -p.x + sx * p.z + rx, p.y + sy * p.z + ry, -p.y + sy * p.z + ry];
        for (side, reach) in self.sides.iter_mut().zip(reach) {
            *side = side.max(reach);
        }
        self.near = self.near.max(p.z + radius);
    }

    /// The nearest eye whose four leaning planes leave nothing outside, centred where there is room.
    fn pinhole(&self, radius: f64) -> DVec3 {
        let [right, left, top, bottom] = self.sides;
        let (sx, sy) = self.slopes;
        let distance = ((right + left) / (2.0 * sx)).max((top + bottom) / (2.0 * sy));
        // A model without extent across the view is looked at from its own radius away.
        let z = distance.max(self.near + 1e-3 * radius);
        let z = if distance > self.near + 1e-9 * radius { z } else { self.near + radius };
        DVec3::new((right - left) * 0.5, (top - bottom) * 0.5, z)
    }

    /// The middle of the model in front of it, and half the height to see.
    fn parallel(&self, radius: f64, aspect: f64) -> (DVec3, f64) {
        let [right, left, top, bottom] = self.sides;
        let half = ((top + bottom) * 0.5).max((right + left) * 0.5 / aspect) / FILL;
        let half = if half > 1e-9 * radius { half } else { radius };
        (DVec3::new((right - left) * 0.5, (top - bottom) * 0.5, self.near + radius), half)
    }
}
