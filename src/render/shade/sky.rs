//! What rays that leave the scene see, and what arrives from there without a ray.

use crate::math::Vec3;
use crate::render::studio;
use crate::scene::{Background, Environment, Scene, UpAxis};

/// The environment of a scene, asked with world directions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sky {
    environment: Environment,
    up: UpAxis,
    /// What secondary rays see of a scene without an environment: the background colour, as the founding texts say.
    backdrop: Vec3,
}

impl Sky {
    pub(crate) fn new(scene: &Scene) -> Self {
        let backdrop = match scene.background {
            Some(Background::Color(color)) => color,
            _ => Vec3::ZERO,
        };
        Self { environment: scene.environment, up: scene.up, backdrop }
    }

    /// Whether nothing comes from anywhere.
    pub(crate) fn is_dark(&self) -> bool {
        self.environment == Environment::Black && self.backdrop == Vec3::ZERO
    }

    /// The up axis of the studio, if that is what surrounds the scene; else every direction is alike.
    pub(crate) fn studio(&self) -> Option<UpAxis> {
        (self.environment == Environment::Studio).then_some(self.up)
    }

    /// Radiance along a unit direction.
    pub(crate) fn radiance(&self, dir: Vec3) -> Vec3 {
        match self.environment {
            Environment::Black => self.backdrop,
            Environment::Constant(radiance) => radiance,
            Environment::Studio => studio::radiance(studio::from_world(self.up, dir)),
        }
    }

    /// Mean radiance around a mirror direction, as wide as `roughness` (0 … 1) makes it.
    pub(crate) fn blurred(&self, dir: Vec3, roughness: f32) -> Vec3 {
        match self.environment {
            Environment::Studio => studio::blurred(studio::from_world(self.up, dir), roughness),
            _ => self.radiance(dir),
        }
    }

    /// Cosine-weighted mean radiance over the hemisphere around `normal`.
    pub(crate) fn diffuse(&self, normal: Vec3) -> Vec3 {
        match self.environment {
            Environment::Black => Vec3::ZERO,
            Environment::Constant(radiance) => radiance,
            Environment::Studio => studio::diffuse(studio::from_world(self.up, normal)),
        }
    }
}
