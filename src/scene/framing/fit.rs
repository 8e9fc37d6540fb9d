//! Fitting a camera: stepping back until everything is in the picture, and no further.

use super::{Bounds, Direction, in_world};
use crate::math::{DAffine3, DMat3, DVec3};
use crate::scene::corners::{Outline, take_in};
use crate::scene::{Camera, Projection, Scene};

/// Kind of camera to place.
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

/// Fraction of the picture's width and height that the model may fill; the rest is border.
const FILL: f64 = 0.92;

/// Reach beyond the extremes, as a fraction of half the model's diagonal, that is ignored as rounding.
const ROUNDING: f64 = 1e-12;

/// A camera that sees the model in `bounds` from `direction`, filling a picture of `aspect` width / height.
///
/// The fit uses the projected vertices, not a box or ball around them: the outermost ones touch the border on two opposite sides
/// and are centred between the others.
pub fn frame(scene: &Scene, bounds: &Bounds, direction: Direction, lens: FrameLens, aspect: f64) -> Camera {
    let mut fit = Fit::new(direction, bounds.center(), lens, aspect);
    fit.add(scene, bounds);
    fit.camera(bounds.radius())
}

/// Frames the model for a camera that orbits it, about the up axis through the centre of `bounds`: at every point of the orbit
/// the whole model is in the picture. The orbit begins at `direction`.
pub fn frame_around(scene: &Scene, bounds: &Bounds, direction: Direction, lens: FrameLens, aspect: f64) -> Camera {
    let mut fit = Fit::new(direction, bounds.center(), lens, aspect);
    let up = in_world(scene.up, DVec3::Y);
    let up_in_camera = fit.camera_from_world * up;
    let center = fit.center;
    let add = |extremes: &mut Extremes, p: DVec3, radius: f64| {
        let p = p - center;
        let height = p.dot(up);
        extremes.add_ring(up_in_camera, height, (p - up * height).length(), radius);
    };
    fit.extremes = Fitted { bounds, extremes: fit.extremes, add }.all(scene);
    fit.camera(bounds.radius())
}

/// Fit of one camera to several scenes, such as the frames of an animation.
pub struct Fit {
    lens: FrameLens,
    aspect: f64,
    axes: DMat3,
    camera_from_world: DMat3,
    /// Origin of camera space, in world space.
    center: DVec3,
    extremes: Extremes,
}

impl Fit {
    /// A fit without contents. `center` should be near the model, and `aspect` is width / height.
    pub fn new(direction: Direction, center: DVec3, lens: FrameLens, aspect: f64) -> Self {
        let axes = axes(direction);
        let aspect = if aspect.is_finite() && aspect > 0.0 { aspect } else { 1.0 };
        let slopes = match lens {
            FrameLens::Perspective { y_fov } => {
                let half = libm::tan(0.5 * y_fov.clamp(1e-3, 3.0));
                (half * aspect * FILL, half * FILL)
            }
            FrameLens::Orthographic => (0.0, 0.0),
        };
        let extremes = Extremes::none(slopes);
        Self { lens, aspect, axes, camera_from_world: axes.transpose(), center, extremes }
    }

    /// Takes in the model within `bounds`.
    pub fn add(&mut self, scene: &Scene, bounds: &Bounds) {
        let (camera_from_world, center) = (self.camera_from_world, self.center);
        let add = |extremes: &mut Extremes, p: DVec3, radius: f64| {
            extremes.add(camera_from_world * (p - center), radius);
        };
        self.extremes = Fitted { bounds, extremes: self.extremes, add }.all(scene);
    }

    /// Returns the camera for everything taken in, whose radius is `radius`.
    pub fn camera(mut self, radius: f64) -> Camera {
        if self.extremes.near == f64::NEG_INFINITY {
            self.extremes.add(DVec3::ZERO, radius);
        }
        let (eye, projection) = match self.lens {
            FrameLens::Perspective { y_fov } => {
                (self.extremes.pinhole(radius), Projection::Perspective { y_fov, aspect: None })
            }
            FrameLens::Orthographic => {
                let (eye, half_height) = self.extremes.parallel(radius, self.aspect);
                (eye, Projection::Orthographic { x_mag: half_height * self.aspect, y_mag: half_height })
            }
        };
        let world_from_camera = DAffine3::from_mat3_translation(self.axes, self.center + self.axes * eye);
        Camera { name: String::new(), projection, world_from_camera }
    }
}

/// The camera's axes: +x right, +y up, +z towards the eye.
fn axes(direction: Direction) -> DMat3 {
    let z = direction.from.normalize_or(DVec3::Z);
    let upright = |up: DVec3| up.cross(z).try_normalize();
    let x = upright(direction.up).or_else(|| upright(DVec3::Y)).or_else(|| upright(DVec3::Z)).unwrap_or(DVec3::X);
    DMat3::from_cols(x, z.cross(x), z)
}

/// Collects the extremes of a model: calls `add` with centre and radius of every ball of the model in `bounds`. Vertices have
/// radius 0; those that reach no further than others by more than rounding may be left out.
#[derive(Clone)]
struct Fitted<'a, F> {
    bounds: &'a Bounds,
    extremes: Extremes,
    add: F,
}

impl<F: Fn(&mut Extremes, DVec3, f64) + Clone + Send + Sync> Fitted<'_, F> {
    fn all(mut self, scene: &Scene) -> Extremes {
        take_in(scene, &mut self);
        for sphere in scene.spheres.iter().filter(|sphere| self.bounds.contains(sphere.center)) {
            (self.add)(&mut self.extremes, sphere.center, sphere.radius);
        }
        for cone in &scene.cones {
            let (lo, hi) = cone.bounds();
            if self.bounds.contains((lo + hi) * 0.5) {
                // Balls around the ends enclose the lateral surface; those of a wide flat cone reach too far.
                (self.add)(&mut self.extremes, cone.base, cone.base_radius);
                (self.add)(&mut self.extremes, cone.apex, cone.apex_radius);
            }
        }
        self.extremes
    }
}

impl<F: Fn(&mut Extremes, DVec3, f64) + Clone + Send + Sync> Outline for Fitted<'_, F> {
    fn add(&mut self, p: DVec3) {
        if self.bounds.contains(p) {
            (self.add)(&mut self.extremes, p, 0.0);
        }
    }

    fn join(&mut self, other: &Self) {
        self.extremes.join(&other.extremes);
    }

    fn holds(&self, p: DVec3) -> bool {
        let mut with = Extremes::none(self.extremes.slopes);
        (self.add)(&mut with, p, 0.0);
        with.reach_no_further(&self.extremes, ROUNDING * self.bounds.radius())
    }
}

/// Reach of the model beyond planes through the origin of camera space that are inclined like the sides of the view frustum.
///
/// Right, left, top, bottom: the greatest `±x + slope·z`, `±y + slope·z`, z towards the eye; and the greatest z.
#[derive(Clone, Copy)]
struct Extremes {
    sides: [f64; 4],
    near: f64,
    slopes: (f64, f64),
    /// Lengths of these planes' normals: a ball reaches past a plane by its radius times the length.
    lengths: (f64, f64),
}

impl Extremes {
    /// Extremes without contents.
    fn none(slopes: (f64, f64)) -> Self {
        let length = |slope: f64| (1.0 + slope * slope).sqrt();
        let lengths = (length(slopes.0), length(slopes.1));
        Self { sides: [f64::NEG_INFINITY; 4], near: f64::NEG_INFINITY, slopes, lengths }
    }

    /// Takes in everything that another has taken in.
    fn join(&mut self, other: &Self) {
        for (side, other) in self.sides.iter_mut().zip(other.sides) {
            *side = side.max(other);
        }
        self.near = self.near.max(other.near);
    }

    /// Whether no extreme exceeds that of `other` by more than `slack`; `false` if one is NaN.
    fn reach_no_further(&self, other: &Self, slack: f64) -> bool {
        let sides = self.sides.iter().zip(other.sides);
        sides.chain([(&self.near, other.near)]).all(|(reach, other)| *reach <= other + slack)
    }

    /// Takes in a ball, or a point of radius 0.
    fn add(&mut self, p: DVec3, radius: f64) {
        let (sx, sy) = self.slopes;
        let (rx, ry) = (radius * self.lengths.0, radius * self.lengths.1);
        let reach = [p.x + sx * p.z + rx, -p.x + sx * p.z + rx, p.y + sy * p.z + ry, -p.y + sy * p.z + ry];
        for (side, reach) in self.sides.iter_mut().zip(reach) {
            *side = side.max(reach);
        }
        self.near = self.near.max(p.z + radius);
    }

    /// Takes in a ball, or a point of radius 0, at every point of a circle about `up` (a unit vector in camera space): `height`
    /// along it from the origin, and `distance` from the axis.
    fn add_ring(&mut self, up: DVec3, height: f64, distance: f64, radius: f64) {
        let (sx, sy) = self.slopes;
        // The component of a plane's normal along the axis is the same all around; the rest is aligned somewhere on the circle.
        let reach = |n: DVec3| {
            let along = n.dot(up);
            let across = (n.length_squared() - along * along).max(0.0).sqrt();
            height * along + distance * across + radius * n.length()
        };
        let normals = [(1.0, 0.0, sx), (-1.0, 0.0, sx), (0.0, 1.0, sy), (0.0, -1.0, sy)].map(DVec3::from);
        for (side, normal) in self.sides.iter_mut().zip(normals) {
            *side = side.max(reach(normal));
        }
        self.near = self.near.max(reach(DVec3::Z));
    }

    /// The nearest eye whose frustum contains everything, centred where there is room.
    fn pinhole(&self, radius: f64) -> DVec3 {
        let [right, left, top, bottom] = self.sides;
        let (sx, sy) = self.slopes;
        let distance = ((right + left) / (2.0 * sx)).max((top + bottom) / (2.0 * sy));
        // A model without extent across the view is viewed from its own radius away.
        let z = distance.max(self.near + 1e-3 * radius);
        let z = if distance > self.near + 1e-9 * radius { z } else { self.near + radius };
        DVec3::new((right - left) * 0.5, (top - bottom) * 0.5, z)
    }

    /// An eye in front of the centre of the model, and half the height of the view.
    fn parallel(&self, radius: f64, aspect: f64) -> (DVec3, f64) {
        let [right, left, top, bottom] = self.sides;
        let half = ((top + bottom) * 0.5).max((right + left) * 0.5 / aspect) / FILL;
        let half = if half > 1e-9 * radius { half } else { radius };
        (DVec3::new((right - left) * 0.5, (top - bottom) * 0.5, self.near + radius), half)
    }
}
