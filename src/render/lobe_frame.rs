//! Frames of lobes over a surface: clear coat with a normal map of its own, and anisotropy along tangents.

use super::patch::Patch;
use super::surface::facing;
use super::texture::TextureStore;
use crate::math::{Vec2, Vec3};
use crate::scene::{TextureRef, UvTransform};

/// A surface point as its lobes need it: unit vectors in world space.
#[derive(Clone, Copy)]
pub(crate) struct LobeFrame<'a> {
    /// The part of the mesh around the point.
    pub patch: Option<&'a Patch<'a>>,
    /// Normal before maps turn it, on the side from which the surface as a whole is seen.
    pub smooth: Vec3,
    /// 1 where a mesh's own normal is on that side, else −1.
    pub side: f32,
    /// Normal of the face, on the side that is seen.
    pub geometric: Vec3,
    /// Shading normal.
    pub normal: Vec3,
    /// Direction back along the ray.
    pub view: Vec3,
}

impl LobeFrame<'_> {
    /// Normal of a clear coat with this normal map and scale, on the side of the ray.
    pub(crate) fn coat_normal(&self, map: Option<&TextureRef>, scale: f32, store: &TextureStore) -> Vec3 {
        // Maps turn the mesh's own normal, because tangents belong to that side.
        let turned = |patch: &Patch| patch.normal_mapped(self.smooth * self.side, map?, scale, store);
        let turned = self.patch.and_then(turned).map(|normal| normal * self.side);
        facing(turned.unwrap_or(self.smooth), self.geometric, self.view)
    }

    /// Tangent and bitangent for the uv coordinates of a map; an arbitrary orthonormal pair where the mesh has no coordinates.
    pub(crate) fn tangents(&self, map: Option<&TextureRef>) -> [Vec3; 2] {
        /// Source of tangents without a map: the first uv set.
        const FIRST: TextureRef = TextureRef {
            texture: 0,
            uv_set: 0,
            transform: UvTransform { offset: Vec2::ZERO, rotation: 0.0, scale: Vec2::ONE },
        };
        let of = |patch: &Patch| patch.tangents(self.normal * self.side, map.unwrap_or(&FIRST));
        let (tangent, bitangent) = self.patch.and_then(of).unwrap_or_else(|| self.normal.any_orthonormal_pair());
        [tangent, bitangent]
    }
}
