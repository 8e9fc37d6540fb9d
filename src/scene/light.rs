//! Lights: point, directional, spot and rectangular ones, the first three optionally with an extent.

use crate::math::{DVec3, Vec3};

/// A light in world space.
#[derive(Clone, Debug)]
pub struct Light {
    /// Name in the file, or an empty string.
    pub name: String,
    /// Linear colour × intensity. Candela for point and spot lights with [`Falloff::InverseSquare`], lux for directional ones,
    /// plain radiance-like factors for [`Falloff::None`] as used by the founding texts: such a light of strength 1 shows a white
    /// matt surface that faces it as 1, and so does a directional light of π lux.
    pub intensity: Vec3,
    /// Shape and position of the light.
    pub kind: LightKind,
    /// Whether surfaces cast shadows in this light.
    pub shadows: bool,
    /// Radius of the luminous ball, world units; for a directional light the angular radius of its disc, radians. 0: shadows have
    /// sharp edges. Unused for a rectangle.
    pub size: f64,
}

/// Position and shape of a light.
#[derive(Clone, Copy, Debug)]
pub enum LightKind {
    /// Shines from a point in all directions.
    Point {
        /// World position.
        position: DVec3,
        /// Falloff with distance.
        falloff: Falloff,
    },
    /// Shines in one direction from infinitely far away.
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
        /// Half angle at which the light starts to fade, radians.
        inner: f64,
        /// Half angle at which the light ends, radians.
        outer: f64,
        /// Falloff with distance.
        falloff: Falloff,
    },
    /// Shines from one side of a rectangle, by the cosine law: `intensity` is that along its normal.
    Rectangle {
        /// World position of the rectangle's centre.
        position: DVec3,
        /// Sides of the rectangle, world units; it shines in the direction of their cross product.
        sides: [DVec3; 2],
        /// Falloff with distance.
        falloff: Falloff,
    },
}

impl Light {
    /// Whether the light has an extent, so that shadows have soft edges.
    pub fn is_wide(&self) -> bool {
        self.size > 0.0 || matches!(self.kind, LightKind::Rectangle { .. })
    }
}

/// Falloff of light with distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// No falloff (the founding texts, MTL viewers).
    None,
    /// 1/d², windowed to end at `range` as KHR_lights_punctual recommends.
    InverseSquare {
        /// Distance at which the light ends; infinite if the file gives none.
        range: f64,
    },
}
