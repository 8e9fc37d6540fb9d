//! Automatic exposure of scenes whose lamps are given in lux and candela.
//!
//! Room lamps have hundreds of candela and the sun a hundred thousand lux, far beyond what a display can show; many files, on the
//! other hand, use values from 0 to 1. So a small picture is rendered first, and if it is far too bright or too dark, a
//! correcting exposure is used and reported. Each view is exposed as if it were rendered alone. All pictures of a sequence share
//! one exposure to avoid flicker: that of the first picture that shows something lit, whichever of them are rendered.

use super::camera::Choice;
use crate::image::Picture;
use crate::image::tone::luminance;
use crate::render::{Job, Sampling, Settings, render};
use crate::scene::features::is_unlit;
use crate::scene::{MAX_STOPS, Scene};
use std::time::Instant;

/// Longest side of the small picture, in pixels.
const SIDE: u32 = 96;

/// Share of the model's lit pixels that may be brighter than [`BRIGHT`].
const ABOVE: f32 = 0.1;

/// Luminance to which the brightest of the others are brought …
const BRIGHT: f32 = 0.7;

/// … unless they are in this range already: such light is taken as intended.
const FINE: std::ops::RangeInclusive<f32> = 0.15..=1.5;

/// Exposure in stops of each view metered so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Metered {
    stops: Vec<(Choice, f32)>,
    /// Seconds of metering that no picture has reported yet.
    seconds: f64,
}

impl Metered {
    /// Exposure of a view, if known.
    pub(super) fn get(&self, view: &Choice) -> Option<f32> {
        self.stops.iter().find(|(known, _)| known == view).map(|(_, stops)| *stops)
    }

    /// Exposure of a view, calculated by `find` and stored if unknown; `None` if `find` has no answer.
    pub(super) fn get_or_find(&mut self, view: &Choice, find: impl FnOnce() -> Option<f32>) -> Option<f32> {
        self.get(view).or_else(|| {
            let start = Instant::now();
            let stops = find();
            self.stops.extend(stops.map(|stops| (view.clone(), stops)));
            self.seconds += start.elapsed().as_secs_f64();
            stops
        })
    }

    /// Seconds of metering since the last call.
    pub(super) fn take_seconds(&mut self) -> f64 {
        std::mem::take(&mut self.seconds)
    }
}

/// Whether a scene's pictures need metering: it has photometric lamps, and a surface that they light.
pub(super) fn is_due(scene: &Scene) -> bool {
    scene.photometric && !is_unlit(scene)
}

/// Exposure in stops, 0 if the scene needs no correction; `None` if nothing is lit.
pub(super) fn exposure(job: &Job) -> Option<f32> {
    let Settings { width, height, .. } = *job.settings;
    let shrink = |side: u32| (u64::from(side) * u64::from(SIDE)).div_ceil(u64::from(width.max(height)));
    #[expect(clippy::cast_possible_truncation, reason = "at most SIDE")]
    let small = |side: u32| (shrink(side) as u32).clamp(1, side);
    let settings = Settings {
        width: small(width),
        height: small(height),
        samples: 4,
        sampling: Sampling::Uniform,
        lens: None,
        layers: true,
        env_rays: Some(0),
        gloss_rays: Some(0),
        ..job.settings.clone()
    };
    let picture = render(&Job { settings: &settings, ..*job }, &()).picture;
    let bright = bright(&picture)?;
    // Tenths of a stop, so that the printed value is the exact one.
    let stops = || (libm::log2f(BRIGHT / bright) * 10.0).round() / 10.0;
    Some(if FINE.contains(&bright) { 0.0 } else { stops().clamp(-MAX_STOPS, MAX_STOPS) })
}

/// Note on a metered exposure.
pub(super) fn phrase(stops: f32) -> String {
    format!("exposure {stops:+.1} stops (metered)")
}

/// Luminance that all but [`ABOVE`] of the model's lit pixels do not exceed; `None` if nothing is lit.
fn bright(picture: &Picture) -> Option<f32> {
    let prims = &picture.layers.as_ref()?.prim;
    let seen = picture.beauty.iter().zip(prims).filter(|(_, prim)| **prim != u32::MAX);
    let mut luminances: Vec<f32> = seen.map(|(p, _)| luminance([p[0], p[1], p[2]])).filter(|l| *l > 0.0).collect();
    luminances.sort_by(f32::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a part of the length")]
    let rank = (luminances.len() as f32 * (1.0 - ABOVE)) as usize;
    luminances.get(rank.min(luminances.len().saturating_sub(1))).copied().filter(|l| l.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{AccelKind, AccelParams, AnyAccel};
    use crate::math::{DVec3, Vec3};
    use crate::render::texture::TextureStore;
    use crate::render::view::Lens;
    use crate::render::{View, World};
    use crate::scene::{Falloff, Light, LightKind, Material, Phong, Reflection, Scene, Sphere};

    /// Metered exposure of a white sphere three units below a lamp of this intensity; also checked without pruning.
    fn metered(candela: f32) -> Option<f32> {
        let kind = LightKind::Point {
            position: DVec3::new(0.0, 0.0, 4.0),
            falloff: Falloff::InverseSquare { range: f64::INFINITY },
        };
        let intensity = Vec3::splat(candela);
        let scene = Scene {
            spheres: vec![Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 }],
            materials: vec![Material::plain()],
            lights: vec![Light { name: String::new(), intensity, kind, shadows: true, size: 0.0 }],
            photometric: true,
            ..Scene::default()
        };
        let world = World::new(&scene);
        let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&scene);
        let view = View::look_at(DVec3::Z * 9.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(3.0));
        let settings = &Settings::default();
        let job = Job { scene: &scene, world: &world, accel: &accel, textures: &textures, view: &view, settings };
        let usual = exposure(&job);
        let (world, textures) = (world.clone().without_pruning(), TextureStore::new(&scene).without_pruning());
        let settings = &Settings { no_prune: true, ..Settings::default() };
        assert_eq!(exposure(&Job { world: &world, textures: &textures, settings, ..job }), usual);
        usual
    }

    #[test]
    fn lamps_that_blind_or_hardly_shine_are_brought_to_the_same_brightness() {
        let (bright, dark) = (metered(30_000.0).unwrap(), metered(0.03).unwrap());
        assert!((dark - bright - libm::log2f(1e6)).abs() < 0.11, "{bright} {dark}");
        assert!(bright < -8.0 && dark > 6.0);
    }

    #[test]
    fn the_time_of_metering_is_told_once_and_none_for_what_is_known() {
        let mut metered = Metered::default();
        let wait = || {
            std::thread::sleep(std::time::Duration::from_millis(2));
            Some(1.5)
        };
        assert_eq!(metered.get_or_find(&Choice::Default, || None), None);
        assert_eq!(metered.get_or_find(&Choice::Default, wait), Some(1.5));
        assert!(metered.take_seconds() >= 0.002);
        assert_eq!(metered.get_or_find(&Choice::Default, wait), Some(1.5));
        assert_eq!(metered.take_seconds(), 0.0);
    }

    #[test]
    fn light_within_reach_stays_as_it_is() {
        assert_eq!(metered(20.0), Some(0.0));
        assert_eq!(metered(0.0), None);
    }

    #[test]
    fn only_measured_lamps_that_something_answers_to_are_metered() {
        let ball = Sphere { name: String::new(), center: DVec3::ZERO, radius: 1.0, material: 0 };
        let scene = |reflection, photometric| Scene {
            spheres: vec![ball.clone()],
            materials: vec![Material { reflection, ..Material::default() }],
            photometric,
            ..Scene::default()
        };
        let matt = || Reflection::Phong(Phong::default());
        let due =
            [scene(matt(), true), scene(matt(), false), scene(Reflection::Unlit, true)].map(|scene| is_due(&scene));
        assert_eq!(due, [true, false, false]);
    }
}
