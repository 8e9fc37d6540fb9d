//! Choosing a camera for a scene that brings none: from which side, how far away, and of what.
//!
//! [`robust_bounds`] finds the model and leaves stray geometry out, [`NamedView`] and [`default_direction`] say from where
//! to look, and [`frame`] steps back just far enough. The result is an ordinary [`Camera`], as if the file had brought it.

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

/// Vertical field of view when nothing else is asked for, radians (30°: a portrait lens, little distortion).
pub const DEFAULT_FOV: f64 = std::f64::consts::PI / 6.0;

/// The sides a model can be seen from. Its front is +Z in a Y-up scene, as glTF says, and −Y in a Z-up one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NamedView {
    /// Sees the front.
    Front,
    /// Sees the back.
    Back,
    /// Sees the model's −X side.
    Left,
    /// Sees the model's +X side.
    Right,
    /// Sees it from above, the front at the bottom of the picture.
    Top,
    /// Sees it from below, the front at the top of the picture.
    Bottom,
    /// Sees the front, +X and upper sides at equal angles.
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
    /// Where it looks from.
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

/// From where to look, and what is up in the picture; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction {
    /// Unit vector from the model to the eye.
    pub from: DVec3,
    /// Towards the top of the picture.
    pub up: DVec3,
}

impl Direction {
    /// A direction given in a Y-up frame whose front is +Z, for a scene with up axis `up`.
    fn new(up: UpAxis, from: DVec3, top: DVec3) -> Self {
        Self { from: in_world(up, from.normalize_or(DVec3::Z)), up: in_world(up, top) }
    }

    /// `azimuth` from the front towards +X and `elevation` above the horizon, radians.
    pub fn around(up: UpAxis, azimuth: f64, elevation: f64) -> Self {
        let (flat, height) = (libm::cos(elevation), libm::sin(elevation));
        let from = DVec3::new(flat * libm::sin(azimuth), height, flat * libm::cos(azimuth));
        Self::new(up, from, DVec3::Y)
    }
}

/// Where the default view stands: to the right of the front and a little above.
const AZIMUTH: f64 = 28.0;
const ELEVATION: f64 = 18.0;

/// How thin a model is seen face on (thickness / middle extent), and how thick one is seen from the default side.
const CARD: f64 = 0.04;
const SOLID: f64 = 0.4;

/// Elevation from which models flatter than high are seen: terrain, floor plans.
const LANDSCAPE_ELEVATION: f64 = 38.0;

impl Direction {
    /// This direction for a scene that may face back.
    fn towards_front(self, scene: &Scene) -> Self {
        if !scene.faces_back {
            return self;
        }
        let axis = in_world(scene.up, DVec3::Y);
        let half_a_turn = |v: DVec3| axis * (2.0 * axis.dot(v)) - v;
        Self { from: half_a_turn(self.from), up: half_a_turn(self.up) }
    }
}

/// From which side a view sees a scene.
pub fn named_direction(scene: &Scene, view: NamedView) -> Direction {
    view.direction(scene.up).towards_front(scene)
}

/// From where a model looks good when nobody says.
///
/// A three-quarter view, slightly from above. Cards, panels and rows of test objects are looked at face on, from the side
/// their faces turn to, and things between card and solid from in between; a model that is flat on the ground is seen
/// from higher up.
pub fn default_direction(scene: &Scene, bounds: &Bounds) -> Direction {
    by_extent(scene, bounds).towards_front(scene)
}

/// The default direction of a scene that does not face back.
fn by_extent(scene: &Scene, bounds: &Bounds) -> Direction {
    // The model's extents in the Y-up frame.
    let extent = in_studio(scene.up, bounds.hi - bounds.lo).abs();
    let (x, y, z) = (extent.x, extent.y, extent.z);
    let turn = |thin: f64, other: f64| ((thin / other - CARD) / (SOLID - CARD)).clamp(0.0, 1.0);
    let (azimuth, elevation) = (AZIMUTH.to_radians(), ELEVATION.to_radians());

    // Asked of what is thin: what is solid has faces on all sides.
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

/// A camera that has gone around the up axis through `pivot` by `angle`, radians, from the front towards +X.
pub fn turned(camera: &Camera, up: UpAxis, pivot: DVec3, angle: f64) -> Camera {
    let axis = in_world(up, DVec3::Y);
    let turn = DQuat::from_vec4((axis * libm::sin(0.5 * angle)).extend(libm::cos(0.5 * angle)));
    let about = DAffine3::from_translation(pivot) * DAffine3::from_quat(turn) * DAffine3::from_translation(-pivot);
    Camera { world_from_camera: about * camera.world_from_camera, ..camera.clone() }
}

/// The camera of a picture nobody directed: the one the scene file chose, else [`default_direction`] framed for a picture
/// of `aspect` width / height.
///
/// Cameras of a model are left alone: they were placed for other pictures, and often see little of it.
pub fn default_camera(scene: &Scene, bounds: &Bounds, aspect: f64) -> Camera {
    let chosen = scene.hints.camera.and_then(|i| scene.cameras.get(i as usize));
    chosen.cloned().unwrap_or_else(|| {
        let lens = FrameLens::Perspective { y_fov: DEFAULT_FOV };
        frame(scene, bounds, default_direction(scene, bounds), lens, aspect)
    })
}

/// From the Y-up, front-+Z frame to the world.
fn in_world(up: UpAxis, v: DVec3) -> DVec3 {
    match up {
        UpAxis::Y => v,
        UpAxis::Z => DVec3::new(v.x, -v.z, v.y),
    }
}

/// From the world to the Y-up, front-+Z frame.
fn in_studio(up: UpAxis, v: DVec3) -> DVec3 {
    match up {
        UpAxis::Y => v,
        UpAxis::Z => DVec3::new(v.x, v.z, -v.y),
    }
}

#[cfg(test)]
mod tests;
