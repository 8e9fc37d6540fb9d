//! Default lights for scenes without any, so that a bare mesh looks right.
//!
//! The key and fill lights move with the camera: whatever side is seen, it is lit from the upper left and softened from the
//! right, and nothing is lit only from behind. The studio around everything (`render::studio`) stays with the model.
//!
//! A file with lights of its own keeps them unchanged, without key and fill. Whether the studio surrounds them is up to the
//! loader: glTF cannot describe surroundings, so it does there, lest metals be black; a scene file says whether it does.

use super::features::is_unlit;
use super::{Camera, Environment, Light, LightKind, Scene};
use crate::math::{DVec3, Vec3};

/// Outcome of [`add_if_missing`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultLight {
    /// Key, fill and studio were added.
    Added,
    /// The scene has lights of its own.
    NotMissing,
    /// The scene file or the caller wants no default lights.
    NotWanted,
    /// The scene is entirely unlit: only the studio was added, as a backdrop.
    NotNeeded,
}

/// Illuminance of the key and fill lights on a face turned to them, lux; white paint reflects 1/π of it.
const KEY: f32 = 1.4;
const FILL: f32 = 0.35;

/// Directions towards the lights in camera space: +x right, +y up, +z towards the viewer.
const KEY_FROM: DVec3 = DVec3::new(-0.5, 0.62, 0.75);
const FILL_FROM: DVec3 = DVec3::new(0.85, 0.15, 0.55);

/// Adds key, fill and studio, as seen from `camera`, to a scene without lights of its own.
///
/// A light is a lamp, an ambient term or an environment; an emissive material is not. An entirely unlit scene needs no lamps and
/// gets only the studio, so that it has the same backdrop as others. The fill casts no shadows: it stands for light from all over
/// that side.
pub fn add_if_missing(scene: &mut Scene, camera: &Camera) -> DefaultLight {
    let what = judged(scene);
    if what == DefaultLight::Added {
        scene.lights = vec![lamp("key", KEY, KEY_FROM, true, camera), lamp("fill", FILL, FILL_FROM, false, camera)];
    }
    if matches!(what, DefaultLight::Added | DefaultLight::NotNeeded) {
        scene.environment = Environment::Studio;
    }
    what
}

/// Decides what [`add_if_missing`] does to a scene, without doing it.
pub fn judged(scene: &Scene) -> DefaultLight {
    if scene.hints.default_light == Some(false) {
        return DefaultLight::NotWanted;
    }
    let own_environment = !matches!(scene.environment, Environment::Black | Environment::Studio);
    if !scene.lights.is_empty() || scene.ambient != Vec3::ZERO || own_environment {
        return DefaultLight::NotMissing;
    }
    if is_unlit(scene) { DefaultLight::NotNeeded } else { DefaultLight::Added }
}

/// A directional light that shines from `from` in camera space.
fn lamp(name: &str, lux: f32, from: DVec3, shadows: bool, camera: &Camera) -> Light {
    let travels = camera.world_from_camera.transform_vector3(-from).normalize_or(DVec3::NEG_Y);
    Light {
        name: name.into(),
        intensity: Vec3::splat(lux),
        kind: LightKind::Directional { direction: travels },
        shadows,
        size: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::scene::{Material, Projection, Reflection, Sphere};

    fn behind() -> Camera {
        // Rotated about y, it looks along +z.
        let world_from_camera = DAffine3::from_rotation_y(std::f64::consts::PI);
        Camera {
            name: String::new(),
            projection: Projection::Orthographic { x_mag: 1.0, y_mag: 1.0 },
            world_from_camera,
        }
    }

    #[test]
    fn the_seen_side_is_lit_wherever_the_camera_stands() {
        let mut scene = Scene { materials: vec![Material::plain()], ..Scene::default() };
        assert_eq!(add_if_missing(&mut scene, &behind()), DefaultLight::Added);
        assert_eq!((scene.lights.len(), scene.environment), (2, Environment::Studio));
        for light in &scene.lights {
            let LightKind::Directional { direction } = light.kind else { panic!("a default light is directional") };
            assert!(direction.dot(DVec3::Z) > 0.3, "{}", light.name);
        }
    }

    #[test]
    fn scenes_with_light_of_their_own_keep_it_alone() {
        let lamp = lamp("own", 1.0, DVec3::Z, true, &behind());
        let mut own = [
            Scene { lights: vec![lamp], ..Scene::default() },
            Scene { ambient: Vec3::splat(0.2), ..Scene::default() },
            Scene { environment: Environment::Constant(Vec3::ONE), ..Scene::default() },
        ];
        for scene in &mut own {
            let lights = scene.lights.len();
            assert_eq!(add_if_missing(scene, &behind()), DefaultLight::NotMissing);
            assert_eq!(scene.lights.len(), lights);
        }
    }

    #[test]
    fn unlit_scenes_get_the_studio_alone_and_scenes_that_want_darkness_nothing() {
        let unlit = Material { reflection: Reflection::Unlit, ..Material::default() };
        let ball = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        // The second material exists, but nothing uses it.
        let mut scene = Scene { materials: vec![unlit, Material::plain()], spheres: vec![ball], ..Scene::default() };
        assert_eq!(add_if_missing(&mut scene, &behind()), DefaultLight::NotNeeded);
        assert!(scene.lights.is_empty() && scene.environment == Environment::Studio);
        let mut scene = Scene::default();
        scene.hints.default_light = Some(false);
        assert_eq!(add_if_missing(&mut scene, &behind()), DefaultLight::NotWanted);
        assert!(scene.lights.is_empty() && scene.environment == Environment::Black);
    }

    #[test]
    fn white_paint_in_the_default_light_is_bright_and_not_blown_out() {
        let mut scene = Scene::default();
        add_if_missing(&mut scene, &behind());
        let (mut brightest, mut facing) = (0.0f32, 0.0);
        for i in 0..2000u32 {
            // Directions on a spiral over the sphere.
            let (y, turn) = (1.0 - f64::from(2 * i + 1) / 2000.0, f64::from(i) * 2.399_963);
            let r = (1.0 - y * y).sqrt();
            let normal = DVec3::new(r * libm::cos(turn), y, r * libm::sin(turn));
            let mut paint = crate::render::studio::diffuse(normal.as_vec3()).x;
            for light in &scene.lights {
                let LightKind::Directional { direction } = light.kind else { continue };
                paint += light.intensity.x * (-direction.dot(normal)).max(0.0) as f32 / std::f32::consts::PI;
            }
            brightest = brightest.max(paint);
            if normal.dot(DVec3::NEG_Z) > 0.99 {
                facing = paint;
            }
        }
        assert!(brightest < 1.0 && (0.45..0.8).contains(&facing), "{brightest}, {facing} facing the eye");
    }
}
