//! Lights: points, directions, and what shines from a small ball, a disc in the sky or a rectangle.

use crate::math::{DVec3, Vec3};

/// A light in world space.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name in the file, or an empty string.
    pub name: String,
    /// Linear colour × intensity. Candela for point and spot lights with [`Falloff::InverseSquare`], lux for
    /// directional ones, plain radiance-like factors for [`Falloff::None`] as the founding texts use: such a light of
    /// strength 1 shows a white matt surface that faces it as 1, and so does a directional light of π lux.
    pub intensity: Vec3,
    /// Where from.
    pub kind: LightKind,
    /// Whether surfaces throw shadows from it.
    pub shadows: bool,
    /// Radius of the ball that shines, world units; of a directional light half the angle that its disc is seen under,
    /// radians. 0: shadows have sharp edges. A rectangle has none.
    pub size: f64,
}

/// Position and shape of a light.
#[derive(Clone, Copy, Debug)]
pub enum LightKind {
    /// Shines from a point in every direction.
    Point {
        /// World position.
        position: DVec3,
        /// How it weakens.
        falloff: Falloff,
    },
    /// Shines along one direction from infinitely far.
    Directional {
        /// Unit vector along which the light travels.
        direction: DVec3,
    },
    /// A point light limited to a cone.
    Spot {
        /// World position.
        position: DVec3,
        /// Unit vector along the axis, away from the light.
        direction: DVec3,
        /// Half angle where it starts to fade, radians.
        inner: f64,
        /// Half angle where it ends, radians.
        outer: f64,
        /// How it weakens.
        falloff: Falloff,
    },
    /// Shines from one side of a rectangle, by the cosine: `intensity` is that along its normal.
    Rectangle {
        /// World position of its middle.
        position: DVec3,
        /// Its sides, world units; it shines to where their cross product points.
        sides: [DVec3; 2],
        /// How it weakens.
        falloff: Falloff,
    },
}

impl Light {
    /// Whether it has an extent, so that shadows have soft edges.
    pub fn is_wide(&self) -> bool {
        self.size > 0.0 || matches!(self.kind, LightKind::Rectangle { .. })
    }
}

/// How light weakens with distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// Not at all (the founding texts, MTL viewers).
    None,
    /// 1/d², windowed to end at `range` as KHR_lights_punctual recommends.
    InverseSquare {
        /// Distance where it ends; infinite when the file gives none.
        range: f64,
    },
}
