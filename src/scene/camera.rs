//! Cameras as files describe them.

use crate::math::DAffine3;

/// A camera in world space: it looks along its −z, +y up, +x right.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Name in the file, or an empty string.
    pub name: String,
    /// Lens.
    pub projection: Projection,
    /// From camera space to world space; rotation and translation only.
    pub world_from_camera: DAffine3,
}

/// How the camera maps directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians.
        y_fov: f64,
        /// Width / height the file asks for; `None`: the picture's.
        aspect: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the width seen, world units.
        x_mag: f64,
        /// Half the height seen, world units.
        y_mag: f64,
    },
}
