//! Cameras as files describe them.

use crate::math::{DAffine3, DMat3, DVec3};

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

impl Camera {
    /// `world_from_camera` of a camera at `eye` that sees `at` in the middle, with `up` towards the top as well as can be.
    ///
    /// When `at` is the eye it looks along −z; when `up` lies along the view, another axis stands in for it.
    pub fn look_at(eye: DVec3, at: DVec3, up: DVec3) -> DAffine3 {
        let z = (eye - at).try_normalize().unwrap_or(DVec3::Z);
        let up = up.normalize_or(DVec3::Y);
        let side = |up: DVec3| up.cross(z).try_normalize().filter(|_| up.dot(z).abs() < 0.999_999);
        let x = side(up).or_else(|| side(DVec3::NEG_Z)).unwrap_or(DVec3::X);
        DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: eye }
    }
}
