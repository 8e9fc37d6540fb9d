//! Materials that absorb light inside, and their coefficients.

use crate::accel::{Hit, Ray};
use crate::math::Vec3;
use crate::render::media::{Media, MediaTable};
use crate::render::optics::transmittance;
use crate::render::wave::Path;
use crate::scene::{Material, Reflection};

/// Coefficients of Beer's law by material, 1 / unit of length; empty where no material absorbs light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Absorption(Vec<Vec3>);

impl Absorption {
    /// Coefficients of all materials; with `no_prune` even where all are zero.
    pub(crate) fn of(materials: &[Material], no_prune: bool) -> Self {
        let coefficient = |material: &Material| match &material.reflection {
            Reflection::MetalRough(m) if m.thick && m.transmission > 0.0 => m.absorption,
            _ => Vec3::ZERO,
        };
        let all: Vec<Vec3> = materials.iter().map(coefficient).collect();
        Self(if no_prune || all.iter().any(|a| *a != Vec3::ZERO) { all } else { Vec::new() })
    }

    /// Whether any material absorbs light.
    pub(crate) fn is_some(&self) -> bool {
        !self.0.is_empty()
    }

    /// Coefficient inside a material.
    pub(crate) fn by(&self, material: u32) -> Option<Vec3> {
        self.0.get(material as usize).copied()
    }

    /// Coefficient of the medium that a ray is in; `None` in empty space.
    pub(crate) fn within(&self, table: &MediaTable, media: Media) -> Option<Vec3> {
        self.by(table.innermost(media)?.material)
    }

    /// The path after absorption in the medium of its ray up to `hit`.
    pub(crate) fn attenuated(&self, table: &MediaTable, ray: &Ray, path: &Path, hit: &Hit) -> Path {
        let length = (hit.t - path.since) * ray.dir.length();
        let left = self.within(table, path.media).map_or(Vec3::ONE, |a| transmittance(a, length));
        Path { weight: path.weight * left, since: hit.t, ..*path }
    }
}

#[cfg(test)]
impl From<Vec<Vec3>> for Absorption {
    fn from(coefficients: Vec<Vec3>) -> Self {
        Self(coefficients)
    }
}
