//! Cameras as described in files.

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

/// Mapping of directions to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// A pinhole.
    Perspective {
        /// Vertical field of view, radians.
        y_fov: f64,
        /// Aspect ratio, width / height, given by the file; `None`: the picture's.
        aspect: Option<f64>,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the visible width, world units.
        x_mag: f64,
        /// Half the visible height, world units.
        y_mag: f64,
    },
}

impl Camera {
    /// Returns the camera as a part of something placed in the world: it is moved along, and sees the same extent of it as
    /// before.
    #[must_use]
    pub fn placed(mut self, world_from_part: &DAffine3) -> Self {
        let placed = *world_from_part * self.world_from_camera;
        let DMat3 { x_axis, y_axis, z_axis } = placed.matrix3;
        let lengths = [x_axis, y_axis, z_axis].map(DVec3::length);
        let is_rigid = lengths.iter().all(|l| (l - 1.0).abs() < 1e-9) && placed.matrix3.determinant() > 0.0;
        self.world_from_camera = if is_rigid { placed } else { Self::rigid(placed).unwrap_or(placed) };
        if let (Projection::Orthographic { x_mag, y_mag }, false) = (&mut self.projection, is_rigid) {
            (*x_mag, *y_mag) = (*x_mag * lengths[0], *y_mag * lengths[1]);
        }
        self
    }

    /// Removes scale, shear and mirroring from a transform, keeping the view axis and the direction upwards. `None` if these are
    /// degenerate.
    pub fn rigid(world: DAffine3) -> Option<DAffine3> {
        let back = world.matrix3.z_axis.try_normalize()?;
        let up = world.matrix3.y_axis;
        let up = (up - back * up.dot(back)).try_normalize()?;
        let rigid = DAffine3::from_mat3_translation(DMat3::from_cols(up.cross(back), up, back), world.translation);
        rigid.is_finite().then_some(rigid)
    }

    /// `world_from_camera` of a camera at `eye` with `at` in the centre of its picture, and `up` as close to its top as possible.
    ///
    /// If `at` is the eye, the view is along −z; if `up` is parallel to the view, another axis stands in for it.
    pub fn look_at(eye: DVec3, at: DVec3, up: DVec3) -> DAffine3 {
        let z = (eye - at).try_normalize().unwrap_or(DVec3::Z);
        let up = up.normalize_or(DVec3::Y);
        let side = |up: DVec3| up.cross(z).try_normalize().filter(|_| up.dot(z).abs() < 0.999_999);
        let x = side(up).or_else(|| side(DVec3::NEG_Z)).unwrap_or(DVec3::X);
        DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: eye }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DQuat;

    #[test]
    fn cameras_lose_scale_and_mirror_but_keep_where_they_look() {
        let turn = DQuat::from_rotation_y(0.5);
        let scaled = DAffine3::from_scale_rotation_translation(DVec3::new(-3.0, 2.0, 5.0), turn, DVec3::X);
        let expected = DAffine3::from_rotation_translation(turn, DVec3::X);
        assert!(Camera::rigid(scaled).unwrap().abs_diff_eq(expected, 1e-12));
        assert!(Camera::rigid(DAffine3::from_scale(DVec3::ZERO)).is_none());
    }

    #[test]
    fn a_camera_of_parallel_rays_sees_as_much_of_a_model_that_is_scaled() {
        let projection = Projection::Orthographic { x_mag: 2.0, y_mag: 1.0 };
        let camera =
            Camera { name: String::new(), projection, world_from_camera: DAffine3::from_translation(DVec3::Z) };
        let scaled = camera.clone().placed(&DAffine3::from_scale(DVec3::splat(3.0)));
        assert_eq!(scaled.projection, Projection::Orthographic { x_mag: 6.0, y_mag: 3.0 });
        assert_eq!(scaled.world_from_camera, DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.0)));
        // If only rotated and translated, it stays the same to the last bit.
        let turned = DAffine3::from_rotation_translation(DQuat::from_rotation_y(0.3), DVec3::X);
        let placed = camera.clone().placed(&turned);
        assert_eq!((placed.projection, placed.world_from_camera), (projection, turned * camera.world_from_camera));
    }
}
