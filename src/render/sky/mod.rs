//! Radiance of the environment: along rays that leave the scene, and gathered without a ray.

mod beyond;
mod diffuse;
mod distribution;
mod gloss;
mod hotspot;
mod lookups;
mod panorama;

use super::shade::{Lobe, ShadingFrame};
use super::studio;
use crate::image::ToneMap;
use crate::math::Vec3;
use crate::scene::features::is_unlit;
use crate::scene::{Background, Environment, Panorama, Scene, UpAxis};
use distribution::EnvironmentDistribution;
use hotspot::Hotspot;
use panorama::Pyramid;
use std::sync::{Arc, OnceLock};

/// Cone angle, radians across, from which the studio is blurred, gradually up to twice that: where smooth surfaces spread rays so
/// far that each stands for much of the room.
const WIDE: f32 = 0.1;

/// Environment of a scene, looked up with world directions.
#[derive(Clone, Debug)]
pub(crate) struct Sky {
    environment: Environment,
    up: UpAxis,
    /// Radiance that secondary rays see in a scene without an environment: the background colour, as in the founding texts.
    backdrop: Vec3,
    /// Whether the background has the usual tone curve applied: pictures of scenes without lighting have none, and stand before
    /// the same walls as others.
    is_toned: bool,
    /// Factor on the radiance of the studio's walls in the background.
    walls: f32,
    map: Option<Map>,
}

/// A panorama, ready for lookups.
#[derive(Clone, Debug)]
struct Map {
    tables: Arc<Tables>,
    /// Whether its hotspot is sampled separately.
    seeks_hotspot: bool,
    /// Sine and cosine of its rotation about the up axis.
    turn: (f32, f32),
}

/// Tables for lookups and draws in a panorama, independent of its rotation.
#[derive(Debug)]
struct Tables {
    pyramid: Pyramid,
    distribution: EnvironmentDistribution,
    /// Computed on first use.
    hotspot: OnceLock<Option<Hotspot>>,
}

impl Tables {
    fn of(panorama: &Panorama) -> Self {
        let pyramid = Pyramid::new(panorama);
        let distribution =
            EnvironmentDistribution::new(pyramid.at_most(distribution::COLUMNS).clone(), distribution::EVEN);
        Self { pyramid, distribution, hotspot: OnceLock::new() }
    }

    /// Hotspot, computed by each thread that needs it before it is known: waiting for another thread could deadlock, as that one
    /// may be at work for the waiting one.
    fn hotspot(&self) -> Option<&Hotspot> {
        if self.hotspot.get().is_none() {
            let found = Hotspot::of(&self.pyramid);
            self.hotspot.get_or_init(|| found);
        }
        self.hotspot.get().and_then(Option::as_ref)
    }

    /// Tables that an earlier picture has cached with the panorama, if they were made of the same texels; else new ones.
    fn of_prepared(panorama: &Panorama) -> Arc<Self> {
        let kept = panorama.prepared.get_or_make(|| Self::of(panorama));
        kept.filter(|kept| kept.pyramid.is_of(panorama)).unwrap_or_else(|| Arc::new(Self::of(panorama)))
    }
}

impl Map {
    /// Hotspot, if there is one and it was requested.
    fn hotspot(&self) -> Option<&Hotspot> {
        self.seeks_hotspot.then(|| self.tables.hotspot()).flatten()
    }
}

impl Sky {
    pub(crate) fn new(scene: &Scene) -> Self {
        let backdrop = scene.background.and_then(Background::color).unwrap_or(Vec3::ZERO);
        let panorama = scene.panorama.as_ref().filter(|_| scene.environment == Environment::Panorama);
        let map = panorama.filter(|p| !p.texels.is_empty()).map(|panorama| {
            let (tables, turn) = (Tables::of_prepared(panorama), libm::sincosf(panorama.rotation));
            Map { tables, seeks_hotspot: false, turn }
        });
        let is_toned = is_unlit(scene);
        Self { environment: scene.environment, up: scene.up, backdrop, is_toned, walls: 1.0, map }
    }

    /// Replaces the brightness factor of the walls in the background.
    pub(crate) fn before_walls(self, walls: f32) -> Self {
        Self { walls, ..self }
    }

    /// Whether the environment gives no light at all.
    pub(crate) fn is_dark(&self) -> bool {
        match self.environment {
            Environment::Black => self.backdrop == Vec3::ZERO,
            Environment::Panorama => self.map.is_none(),
            Environment::Constant(_) | Environment::Studio => false,
        }
    }

    /// Whether the environment is a panorama.
    pub(crate) fn is_map(&self) -> bool {
        self.map.is_some()
    }

    /// Up axis of the studio, if that is the environment; without one, and unless it is a panorama, all directions look alike.
    pub(crate) fn studio(&self) -> Option<UpAxis> {
        (self.environment == Environment::Studio).then_some(self.up)
    }

    /// Radiance along a unit direction, averaged over a cone this many radians across.
    pub(crate) fn radiance(&self, dir: Vec3, angle: f32) -> Vec3 {
        match (self.environment, &self.map) {
            (Environment::Constant(radiance), _) => radiance,
            // A cone as wide as the lobe of rough facets.
            (Environment::Studio, _) if angle > WIDE => {
                let spread = 0.5 * angle * (angle / WIDE - 1.0).min(1.0);
                studio::blurred(studio::from_world(self.up, dir), spread.min(1.0).sqrt())
            }
            (Environment::Studio, _) => studio::radiance(studio::from_world(self.up, dir)),
            (Environment::Panorama, Some(map)) => map.tables.pyramid.radiance(self.to_map(map, dir), angle),
            (Environment::Black | Environment::Panorama, _) => self.backdrop,
        }
    }

    /// Background along a unit direction from the eye, averaged over such a cone: as [`Self::radiance`], but only the walls of
    /// the studio.
    pub(crate) fn behind(&self, dir: Vec3, angle: f32) -> Vec3 {
        let walls = |up| self.toned(studio::backdrop(studio::from_world(up, dir)));
        self.studio().map_or_else(|| self.radiance(dir, angle), walls)
    }

    /// Radiance of a wall of the studio as it shows in the background.
    #[inline(always)]
    fn toned(&self, wall: Vec3) -> Vec3 {
        self.walls * if self.is_toned { ToneMap::default().map(wall.to_array()).into() } else { wall }
    }

    /// Mean radiance around a mirror direction, over the lobe of this `roughness` (0 … 1).
    pub(crate) fn blurred(&self, dir: Vec3, roughness: f32) -> Vec3 {
        match (self.environment, &self.map) {
            (Environment::Studio, _) => studio::blurred(studio::from_world(self.up, dir), roughness),
            (Environment::Panorama, Some(map)) => map.tables.pyramid.blurred(self.to_map(map, dir), roughness),
            _ => self.radiance(dir, 0.0),
        }
    }

    /// Mean radiance mirrored by the facets of a rough mirror: for a panorama by the visible facets themselves, else blurred
    /// around the mirrored direction.
    pub(crate) fn mirrored(&self, seen: &ShadingFrame, roughness: f32) -> Vec3 {
        let exact = self.map.as_ref().and_then(|map| {
            let lobe = Lobe::even(seen.normal, roughness * roughness);
            map.tables.pyramid.mirrored(&lobe, seen.view, |dir| self.to_map(map, dir))
        });
        exact.unwrap_or_else(|| self.blurred(seen.mirrored(), roughness))
    }

    /// Cosine-weighted mean radiance over the hemisphere around `normal`.
    pub(crate) fn diffuse(&self, normal: Vec3) -> Vec3 {
        match (self.environment, &self.map) {
            (Environment::Constant(radiance), _) => radiance,
            (Environment::Studio, _) => studio::diffuse(studio::from_world(self.up, normal)),
            (Environment::Panorama, Some(map)) => map.tables.pyramid.diffuse(self.to_map(map, normal)),
            (Environment::Black | Environment::Panorama, _) => Vec3::ZERO,
        }
    }

    /// Direction of a light sample, drawn with two numbers from 0 … 1; `None` where no direction is better than others.
    pub(crate) fn draw(&self, at: [f32; 2]) -> Option<Vec3> {
        self.map.as_ref().map(|map| self.to_world(map, map.tables.distribution.draw(at)))
    }

    /// Radiance as seen by samples of [`Self::draw`], and the density of drawing this direction, 1/sr.
    pub(crate) fn drawn(&self, dir: Vec3) -> (Vec3, f32) {
        self.map
            .as_ref()
            .map_or_else(|| (self.radiance(dir, 0.0), 0.0), |map| map.tables.distribution.look(self.to_map(map, dir)))
    }

    fn to_map(&self, map: &Map, dir: Vec3) -> Vec3 {
        let (sin, cos) = map.turn;
        let Vec3 { x, y, z } = studio::from_world(self.up, dir);
        Vec3::new(cos * x - sin * z, y, sin * x + cos * z)
    }

    fn to_world(&self, map: &Map, dir: Vec3) -> Vec3 {
        let (sin, cos) = map.turn;
        let turned = Vec3::new(cos * dir.x + sin * dir.z, dir.y, cos * dir.z - sin * dir.x);
        studio::to_world(self.up, turned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Panorama;
    use std::f32::consts::FRAC_PI_2;
    use std::sync::Arc;

    /// A sky that is red along +X, green along +Z, blue along −X and white along −Z of its own frame.
    fn quarters(rotation: f32, up: UpAxis) -> Sky {
        let color = |column: u32| match (column + 32) / 64 % 4 {
            0 => [0.0, 0.0, 1.0],
            1 => [1.0, 1.0, 1.0],
            2 => [1.0, 0.0, 0.0],
            _ => [0.0, 1.0, 0.0],
        };
        let texels = (0..128 * 256).map(|i| color(i % 256)).collect();
        let panorama = Panorama {
            name: String::new(),
            width: 256,
            height: 128,
            texels: Arc::new(texels),
            rotation,
            ..Panorama::default()
        };
        Sky::new(&Scene { environment: Environment::Panorama, panorama: Some(panorama), up, ..Scene::default() })
    }

    #[test]
    fn what_was_made_of_a_panorama_serves_its_clones_however_turned_but_no_other_texels() {
        let sky = |panorama: &Panorama| {
            let panorama = Some(panorama.clone());
            let mut sky = Sky::new(&Scene { environment: Environment::Panorama, panorama, ..Scene::default() });
            sky.find_hotspot();
            sky.map.unwrap()
        };
        let mut sun = vec![[0.1; 3]; 64 * 32];
        sun[700] = [900.0; 3];
        let panorama = Panorama { width: 64, height: 32, texels: Arc::new(sun), ..Panorama::default() };
        let turned = Panorama { rotation: 1.0, ..panorama.clone() };
        let (first, second) = (sky(&panorama), sky(&turned));
        assert!(Arc::ptr_eq(&first.tables, &second.tables) && first.turn != second.turn);
        assert!(first.hotspot().is_some());
        let scene = Scene { environment: Environment::Panorama, panorama: Some(turned), ..Scene::default() };
        assert!(Sky::new(&scene).hotspot().is_none(), "not asked for");
        let dark = Panorama { texels: Arc::new(vec![[0.1; 3]; 64 * 32]), ..panorama };
        let other = sky(&dark);
        assert!(!Arc::ptr_eq(&first.tables, &other.tables) && other.hotspot().is_none());
    }

    #[test]
    fn a_panorama_is_seen_where_its_convention_says() {
        let sky = quarters(0.0, UpAxis::Y);
        let seen = |dir: Vec3| sky.radiance(dir, 0.0).to_array();
        assert_eq!(seen(Vec3::X), [1.0, 0.0, 0.0]);
        assert_eq!(seen(Vec3::Z), [0.0, 1.0, 0.0]);
        assert_eq!(seen(Vec3::NEG_X), [0.0, 0.0, 1.0]);
        assert_eq!(seen(Vec3::NEG_Z), [1.0, 1.0, 1.0]);
        assert_eq!(quarters(0.0, UpAxis::Z).radiance(Vec3::NEG_Y, 0.0).to_array(), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn the_studio_blurs_little_by_little_as_cones_widen() {
        let sky = Sky::new(&Scene { environment: Environment::Studio, ..Scene::default() });
        let dirs = (0..64_u8).map(|i| Vec3::new(libm::cosf(f32::from(i)), 0.4 * libm::sinf(f32::from(3 * i)), 0.7));
        for dir in dirs.map(Vec3::normalize) {
            let along = (0..400_u16).map(|i| sky.radiance(dir, f32::from(i) * 0.001).x).collect::<Vec<_>>();
            let steps = along.windows(2).map(|pair| (pair[1] / pair[0] - 1.0).abs());
            assert!(steps.fold(0.0, f32::max) < 0.02, "{dir}");
        }
    }

    #[test]
    fn walls_are_as_bright_as_was_asked_behind_everything_and_nowhere_else() {
        let sky = Sky::new(&Scene { environment: Environment::Studio, ..Scene::default() });
        let bright = sky.clone().before_walls(8.0);
        let (dir, columns) = (Vec3::new(0.6, 0.0, 0.8), [[0.6], [0.0], [0.8]]);
        assert_eq!(bright.behind(dir, 0.0), 8.0 * sky.behind(dir, 0.0));
        let mut told = Vec3::ZERO;
        bright.each_behind(&[0], columns.each_ref().map(|row| &row[..]), &[0.0], |_, wall| told = wall);
        assert_eq!(told, bright.behind(dir, 0.0));
        assert_eq!((bright.radiance(dir, 0.0), bright.diffuse(dir)), (sky.radiance(dir, 0.0), sky.diffuse(dir)));
    }

    #[test]
    fn a_quarter_turn_brings_what_was_along_x_towards_minus_z() {
        let sky = quarters(FRAC_PI_2, UpAxis::Y);
        assert_eq!(sky.radiance(Vec3::NEG_Z, 0.0).to_array(), [1.0, 0.0, 0.0]);
        assert!(sky.diffuse(Vec3::NEG_Z).x > sky.diffuse(Vec3::X).x);
        assert!(sky.blurred(Vec3::NEG_Z, 0.5).x > 0.9);
    }

    #[test]
    fn drawn_directions_have_the_density_they_are_said_to_have() {
        let sky = quarters(1.0, UpAxis::Z);
        // ∫ 1 over the sphere, as the mean of 1 / density.
        let n = 4096u16;
        let part = |i: u16| (f32::from(i) + 0.5) / f32::from(n);
        let total: f32 = (0..n)
            .map(|i| sky.draw([part(i), (f32::from(i) * 0.618_034).fract()]).expect("a map is drawn from"))
            .map(|dir| 1.0 / sky.drawn(dir).1 / f32::from(n))
            .sum();
        assert!((total / (4.0 * std::f32::consts::PI) - 1.0).abs() < 0.02, "{total}");
    }
}
