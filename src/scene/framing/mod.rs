//! Choosing a camera for a scene without one: direction, distance, and the part of the scene to frame.
//!
//! [`robust_bounds`] finds the model and leaves out stray geometry, [`NamedView`] and [`default_direction`] give the viewing
//! direction, and [`frame`] steps back just far enough. The result is an ordinary [`Camera`], as if it were in the file.

mod bounds;
mod crowd;
mod fit;
mod parts;
mod slices;

pub use bounds::{Bounds, robust_bounds, robust_bounds_within};
pub use fit::{Fit, FrameLens, frame, frame_around};

use super::{Camera, Scene, UpAxis};
use crate::math::{DAffine3, DQuat, DVec3};
use crate::named::names;

/// Default vertical field of view, radians (30°: a portrait lens, little distortion).
pub const DEFAULT_FOV: f64 = std::f64::consts::PI / 6.0;

/// Named viewing directions. The front of a model is +Z in a Y-up scene, as in glTF, and −Y in a Z-up one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NamedView {
    /// Shows the front.
    Front,
    /// Shows the back.
    Back,
    /// Shows the model's −X side.
    Left,
    /// Shows the model's +X side.
    Right,
    /// Shows the model from above, its front at the bottom of the picture.
    Top,
    /// Shows the model from below, its front at the top of the picture.
    Bottom,
    /// Shows the front, +X and upper sides at equal angles.
    Iso,
}

names!(
    NamedView, "view",
    Front => "front",
    Back => "back",
    Left => "left",
    Right => "right",
    Top => "top",
    Bottom => "bottom",
    Iso => "iso",
);

impl NamedView {
    /// Viewing direction in a scene with this up axis.
    pub fn direction(self, up: UpAxis) -> Direction {
        let (from, top) = match self {
            Self::Front => (DVec3::Z, DVec3::Y),
            Self::Back => (DVec3::NEG_Z, DVec3::Y),
            Self::Left => (DVec3::NEG_X, DVec3::Y),
            Self::Right => (DVec3::X, DVec3::Y),
            Self::Top => (DVec3::Y, DVec3::NEG_Z),
            Self::Bottom => (DVec3::NEG_Y, DVec3::Z),
            Self::Iso => (DVec3::ONE, DVec3::Y),
        };
        Direction::new(up, from, top)
    }
}

/// A viewing direction, and the up direction of the picture; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Unit vector from the model to the eye.
    pub from: DVec3,
    /// Direction towards the top of the picture.
    pub up: DVec3,
}

impl Direction {
    /// A direction given in a Y-up frame whose front is +Z, for a scene with up axis `up`.
    fn new(up: UpAxis, from: DVec3, top: DVec3) -> Self {
        Self { from: in_world(up, from.normalize_or(DVec3::Z)), up: in_world(up, top) }
    }

    /// Direction at `azimuth` from the front towards +X and `elevation` above the horizon, radians.
    pub fn around(up: UpAxis, azimuth: f64, elevation: f64) -> Self {
        let (flat, height) = (libm::cos(elevation), libm::sin(elevation));
        let from = DVec3::new(flat * libm::sin(azimuth), height, flat * libm::cos(azimuth));
        Self::new(up, from, DVec3::Y)
    }
}

/// Default viewing angles, degrees: to the right of the front and a little above.
const AZIMUTH: f64 = 28.0;
const ELEVATION: f64 = 18.0;

/// Relative thickness (thickness / middle extent) up to which a model is viewed face on, and from which it is viewed at the
/// default angles.
const CARD: f64 = 0.04;
const SOLID: f64 = 0.4;

/// Elevation, degrees, for models that are flat on the ground: terrain, floor plans.
const LANDSCAPE_ELEVATION: f64 = 38.0;

impl Direction {
    /// Adapts this direction to a scene that may face backwards.
    fn towards_front(self, scene: &Scene) -> Self {
        if !scene.faces_back {
            return self;
        }
        let axis = in_world(scene.up, DVec3::Y);
        let half_a_turn = |v: DVec3| axis * (2.0 * axis.dot(v)) - v;
        Self { from: half_a_turn(self.from), up: half_a_turn(self.up) }
    }
}

/// Direction of a named view of a scene.
pub fn named_direction(scene: &Scene, view: NamedView) -> Direction {
    view.direction(scene.up).towards_front(scene)
}

/// Viewing direction that suits a model when none is given.
///
/// A three-quarter view, slightly from above. Cards, panels and rows of test objects are viewed face on, from the side that their
/// faces turn to, and models between card and solid from in between; a model that is flat on the ground is viewed from higher up.
pub fn default_direction(scene: &Scene, bounds: &Bounds) -> Direction {
    by_extent(scene, bounds).towards_front(scene)
}

/// Default direction of a scene, as if it did not face backwards.
fn by_extent(scene: &Scene, bounds: &Bounds) -> Direction {
    // The model's extents in the Y-up frame.
    let extent = in_studio(scene.up, bounds.hi - bounds.lo).abs();
    let (x, y, z) = (extent.x, extent.y, extent.z);
    let turn = |thin: f64, other: f64| ((thin / other - CARD) / (SOLID - CARD)).clamp(0.0, 1.0);
    let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());

    // Evaluated only for thin models: solid ones have faces on all sides.
    let facing = |axis: DVec3| {
        let there = Direction { from: in_world(scene.up, axis), up: DVec3::ZERO }.towards_front(scene).from;
        parts::facing(scene).dot(there)
    };
    let turns_to = |axis: DVec3| facing(axis) >= parts::AWAY;
    if z <= x.min(y) {
        let turned = turn(z, x.min(y));
        let side = if turns_to(DVec3::Z) { 0.0 } else { std::f64::consts::PI };
        Direction::around(scene.up, side + azimuth * turned, elevation * turned)
    } else if x < y.min(z) && turn(x, y.min(z)) < 1.0 {
        match (turn(x, y.min(z)) == 0.0, turns_to(DVec3::X)) {
            (true, true) => NamedView::Right.direction(scene.up),
            (true, false) => NamedView::Left.direction(scene.up),
            (false, true) => Direction::around(scene.up, azimuth, elevation),
            (false, false) => Direction::around(scene.up, -azimuth, elevation),
        }
    } else if y < x.min(z) {
        let flat = 1.0 - turn(y, x.min(z));
        let high = LANDSCAPE_ELEVATION.to_radians();
        let above = flat == 0.0 || turns_to(DVec3::Y);
        let elevation = elevation + (high - elevation) * flat;
        Direction::around(scene.up, azimuth, if above { elevation } else { -elevation })
    } else {
        Direction::around(scene.up, azimuth, elevation)
    }
}

/// The camera after an orbit around the up axis through `pivot` by `angle`, radians, from the front towards +X.
pub fn turned(camera: &Camera, up: UpAxis, pivot: DVec3, angle: f64) -> Camera {
    let axis = in_world(up, DVec3::Y);
    let turn = DQuat::from_vec4((axis * libm::sin(0.5 * angle)).extend(libm::cos(0.5 * angle)));
    let about = DAffine3::from_translation(pivot) * DAffine3::from_quat(turn) * DAffine3::from_translation(-pivot);
    Camera { world_from_camera: about * camera.world_from_camera, ..camera.clone() }
}

/// Default camera of a picture: the one that the scene file chose, else [`default_direction`] framed for a picture of `aspect`
/// width / height.
///
/// Cameras of a model are ignored: they were placed for other pictures, and often show little of it.
pub fn default_camera(scene: &Scene, bounds: &Bounds, aspect: f64) -> Camera {
    let chosen = scene.hints.camera.and_then(|i| scene.cameras.get(i as usize));
    chosen.cloned().unwrap_or_else(|| {
        let lens = FrameLens::Perspective { y_fov: DEFAULT_FOV };
        frame(scene, bounds, default_direction(scene, bounds), lens, aspect)
    })
}

/// Transforms from the Y-up, front-+Z frame to the world.
fn in_world(up: UpAxis, v: DVec3) -> DVec3 {
    match up {
        UpAxis::Y => v,
        UpAxis::Z => DVec3::new(v.x, -v.z, v.y),
    }
}

/// Transforms from the world to the Y-up, front-+Z frame.
fn in_studio(up: UpAxis, v: DVec3) -> DVec3 {
    match up {
        UpAxis::Y => v,
        UpAxis::Z => DVec3::new(v.x, v.z, -v.y),
    }
}

#[cfg(test)]
mod tests;
