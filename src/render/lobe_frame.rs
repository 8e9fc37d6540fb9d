//! What lobes over a surface lie on: clear coat that may have a normal map of its own, and a grain that runs along tangents.

use super::patch::Patch;
use super::surface::facing;
use super::texture::TextureStore;
use crate::math::{Vec2, Vec3};
use crate::scene::{TextureRef, UvTransform};

/// A point of a surface as lobes over it ask for it: unit vectors in world space.
#[derive(Clone, Copy)]
pub(crate) struct LobeFrame<'a> {
    /// The part of the mesh around it.
    pub patch: Option<&'a Patch<'a>>,
    /// Normal before maps turn it, on the side that is seen as a whole.
    pub smooth: Vec3,
    /// 1 where a mesh's own normal is on that side, else −1.
    pub side: f32,
    /// Normal of the face, on the side that is seen.
    pub geometric: Vec3,
    /// Normal for shading.
    pub normal: Vec3,
    /// Back along the ray.
    pub view: Vec3,
}

impl LobeFrame<'_> {
    /// The normal of clear coat with this normal map and its scale, to the side of the ray.
    pub(crate) fn coat_normal(&self, map: Option<&TextureRef>, scale: f32, store: &TextureStore) -> Vec3 {
        // Maps turn the mesh's own normal: tangents belong to that side.
        let turned = |patch: &Patch| patch.normal_mapped(self.smooth * self.side, map?, scale, store);
        let turned = self.patch.and_then(turned).map(|normal| normal * self.side);
        facing(turned.unwrap_or(self.smooth), self.geometric, self.view)
    }

    /// Vectors on the surface for coordinates of a map: along and across; any two where nothing tells.
    pub(crate) fn tangents(&self, map: Option<&TextureRef>) -> [Vec3; 2] {
        /// Where tangents come from when no map says: the first set of coordinates.
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
