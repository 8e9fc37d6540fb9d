//! The camera: position, axes and lens, and the ray through each point of the picture.
//!
//! Everything is `f64` in world space; the caller moves origins into the scene's centred frame. Choosing a view for a scene is up
//! to `scene::framing`.
//!
//! A view fixes the *vertical* extent of what is seen. The horizontal extent follows from the picture's own width and
//! height, so a glTF camera whose `aspectRatio` differs from the picture's keeps its vertical field of view (or `ymag`)
//! and shows more or less at the sides; nothing is ever stretched.

use crate::math::{DAffine3, DMat3, DVec2, DVec3};
use crate::scene::{Camera, Projection};

/// An eye in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Centre of projection, or of the film when the lens is parallel.
    pub eye: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector to the top of the picture.
    pub up: DVec3,
    /// Unit vector into the picture; depth (the Z layer) counts along it.
    pub forward: DVec3,
    /// Vertical extent of the view.
    pub lens: Lens,
}

/// The vertical extent of a [`View`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// A pinhole.
    Perspective {
        /// Tangent of half the vertical field of view.
        half_height: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Half the height seen, world units.
        half_height: f64,
    },
}

/// A ray through a point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrimaryRay {
    /// Origin, world space.
    pub origin: DVec3,
    /// Unit direction, world space.
    pub dir: DVec3,
    /// Width of a pixel at the origin, world units.
    pub cone_width: f32,
    /// Growth of that width per unit of length along the ray.
    pub cone_spread: f32,
}

/// Range of half the field of view, radians: just inside 0…90°, so that careless values in a file still give a picture.
const HALF_FOV: (f64, f64) = (1e-4, 1.57);

impl Lens {
    /// A pinhole with a vertical field of view in radians, clamped to the open range 0…π.
    pub fn perspective(y_fov: f64) -> Self {
        let half = if y_fov.is_finite() { y_fov * 0.5 } else { 0.4 };
        Self::Perspective { half_height: libm::tan(half.clamp(HALF_FOV.0, HALF_FOV.1)) }
    }

    /// Parallel rays over `height` world units; a height that is not positive and finite counts as 1.
    pub fn orthographic(height: f64) -> Self {
        let height = if height.is_finite() && height > 0.0 { height } else { 1.0 };
        Self::Orthographic { half_height: height * 0.5 }
    }
}

impl View {
    /// The view of a camera in a file. Scale in its transform is ignored, as glTF demands; a transform without three independent
    /// axes counts as the identity rotation.
    pub fn from_camera(camera: &Camera) -> Self {
        let DAffine3 { matrix3, translation } = camera.world_from_camera;
        let axes = orthonormal(&matrix3);
        let lens = match camera.projection {
            Projection::Perspective { y_fov, .. } => Lens::perspective(y_fov),
            Projection::Orthographic { y_mag, .. } => Lens::orthographic(2.0 * y_mag.abs()),
        };
        Self { eye: translation, right: axes.x_axis, up: axes.y_axis, forward: -axes.z_axis, lens }
    }

    /// The view from `eye` towards `at`, with the picture's top as close to `up` as possible.
    ///
    /// If `at` is the eye, the view is along −z; if `up` is parallel to the view, another axis stands in for it.
    pub fn look_at(eye: DVec3, at: DVec3, up: DVec3, lens: Lens) -> Self {
        Self::look_along(eye, at - eye, up, lens)
    }

    /// The view from `eye` along `direction` (any length); otherwise as [`View::look_at`].
    pub fn look_along(eye: DVec3, direction: DVec3, up: DVec3, lens: Lens) -> Self {
        let forward = direction.try_normalize().unwrap_or(DVec3::NEG_Z);
        let upright = |up: DVec3| {
            let side = forward.cross(up);
            (side.length_squared() > 1e-12 * up.length_squared()).then(|| side.normalize())
        };
        let right = upright(up).or_else(|| upright(DVec3::NEG_Z)).or_else(|| upright(DVec3::Y)).unwrap_or(DVec3::X);
        Self { eye, right, up: right.cross(forward), forward, lens }
    }

    /// The ray through (`x`, `y`), in pixels from the top left corner of a `width × height` picture; pixel centres are
    /// at halves.
    #[inline(always)]
    pub fn primary(&self, x: f64, y: f64, width: u32, height: u32) -> PrimaryRay {
        let pixel = 2.0 / f64::from(height.max(1));
        let film = DVec2::new((x - f64::from(width) * 0.5) * pixel, 1.0 - y * pixel);
        match self.lens {
            Lens::Perspective { half_height } => {
                let to_film = (self.right * film.x + self.up * film.y) * half_height + self.forward;
                // One division serves all four results.
                let nearness = 1.0 / to_film.length();
                PrimaryRay {
                    origin: self.eye,
                    dir: to_film * nearness,
                    cone_width: 0.0,
                    cone_spread: narrow(pixel * half_height * nearness),
                }
            }
            Lens::Orthographic { half_height } => PrimaryRay {
                origin: self.eye + (self.right * film.x + self.up * film.y) * half_height,
                dir: self.forward,
                cone_width: narrow(pixel * half_height),
                cone_spread: 0.0,
            },
        }
    }

    /// Projects `point`: x to the right and y up in half picture heights from the centre, and its depth along the view axis. With
    /// a perspective lens x and y are meaningless unless the depth is positive.
    pub fn project(&self, point: DVec3) -> DVec3 {
        let p = point - self.eye;
        let (x, y, depth) = (p.dot(self.right), p.dot(self.up), p.dot(self.forward));
        match self.lens {
            Lens::Perspective { half_height } => {
                DVec3::new(x / (depth * half_height), y / (depth * half_height), depth)
            }
            Lens::Orthographic { half_height } => DVec3::new(x / half_height, y / half_height, depth),
        }
    }
}

/// The axes of `m` made orthonormal, z first: the view direction matters most.
fn orthonormal(m: &DMat3) -> DMat3 {
    let Some(z) = m.z_axis.try_normalize() else { return DMat3::IDENTITY };
    let Some(x) = m.y_axis.cross(z).try_normalize() else { return DMat3::IDENTITY };
    DMat3::from_cols(x, z.cross(x), z)
}

#[expect(clippy::cast_possible_truncation, reason = "a footprint needs no more than f32")]
fn narrow(x: f64) -> f32 {
    x as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn close(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-12
    }

    fn square(lens: Lens) -> View {
        View::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, lens)
    }

    #[test]
    fn the_ray_through_the_middle_goes_along_the_axis() {
        let ray = square(Lens::perspective(1.0)).primary(4.0, 3.0, 8, 6);
        assert!(close(ray.dir, DVec3::NEG_Z) && close(ray.origin, DVec3::new(0.0, 0.0, 5.0)));
    }

    #[test]
    fn the_top_and_side_of_the_picture_are_where_the_field_of_view_says() {
        let view = square(Lens::perspective(FRAC_PI_2));
        let top = view.primary(8.0, 0.0, 16, 8).dir;
        assert!(close(top, DVec3::new(0.0, 1.0, -1.0).normalize()), "{top}");
        // Twice as wide as high: the vertical field of view stays, the horizontal one grows.
        let right = view.primary(16.0, 4.0, 16, 8).dir;
        assert!(close(right, DVec3::new(2.0, 0.0, -1.0).normalize()), "{right}");
    }

    #[test]
    fn parallel_rays_start_on_the_film() {
        let ray = square(Lens::orthographic(4.0)).primary(0.0, 0.0, 10, 10);
        assert!(close(ray.dir, DVec3::NEG_Z) && close(ray.origin, DVec3::new(-2.0, 2.0, 5.0)));
        assert!((f64::from(ray.cone_width) - 0.4).abs() < 1e-6 && ray.cone_spread == 0.0);
    }

    #[test]
    fn a_projected_point_is_seen_through_the_pixel_it_projects_to() {
        for lens in [Lens::perspective(0.8), Lens::orthographic(3.0)] {
            let view = View::look_at(DVec3::new(2.0, 3.0, 4.0), DVec3::new(-0.5, 0.1, 0.2), DVec3::Y, lens);
            let point = DVec3::new(0.3, -0.2, 0.5);
            let film = view.project(point);
            let (width, height) = (640, 480);
            let (x, y) = (320.0 + film.x * 240.0, 240.0 - film.y * 240.0);
            let ray = view.primary(x, y, width, height);
            let t = (point - ray.origin).dot(ray.dir);
            assert!(close(ray.origin + ray.dir * t, point), "{lens:?}");
        }
    }

    #[test]
    fn the_cone_is_as_wide_as_the_distance_between_neighbouring_rays() {
        let view = square(Lens::perspective(0.9));
        let (a, b) = (view.primary(30.0, 30.0, 64, 64), view.primary(30.0, 31.0, 64, 64));
        // Two neighbouring rays where they meet the plane at depth 7.
        let at = |r: &PrimaryRay| r.origin + r.dir * (7.0 / r.dir.dot(view.forward));
        let (pa, pb) = (at(&a), at(&b));
        let width = f64::from(a.cone_spread) * (pa - a.origin).length();
        assert!((width / (pa - pb).length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_file_camera_ignores_scale_and_looks_along_minus_z() {
        let turned = DMat3::from_rotation_y(FRAC_PI_2) * DMat3::from_diagonal(DVec3::new(3.0, 0.5, 2.0));
        let camera = Camera {
            name: String::new(),
            projection: Projection::Perspective { y_fov: 0.7, aspect: Some(1.0) },
            world_from_camera: DAffine3::from_mat3_translation(turned, DVec3::X),
        };
        let view = View::from_camera(&camera);
        assert!(close(view.forward, DVec3::NEG_X) && close(view.up, DVec3::Y) && close(view.right, DVec3::NEG_Z));
    }

    #[test]
    fn careless_input_still_gives_unit_axes() {
        let views = [
            View::look_at(DVec3::ONE, DVec3::ONE, DVec3::Y, Lens::perspective(f64::NAN)),
            View::look_at(DVec3::Y, DVec3::ZERO, DVec3::Y, Lens::perspective(9.0)),
            View::look_at(DVec3::Z, DVec3::ZERO, DVec3::Z, Lens::orthographic(-1.0)),
            View::look_at(DVec3::Z, DVec3::ZERO, DVec3::ZERO, Lens::orthographic(f64::INFINITY)),
        ];
        for view in views {
            let axes = DMat3::from_cols(view.right, view.up, -view.forward);
            assert!((axes.determinant() - 1.0).abs() < 1e-12, "{view:?}");
            assert!(view.primary(1.0, 2.0, 8, 8).dir.is_finite());
        }
    }
}
