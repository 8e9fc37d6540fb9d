//! Hits of a wave by instance, each with its face; faces that are hit again are cached.

use super::faces::{FaceNumbers, Skin};
use super::material_maps::MaterialMaps;
use crate::accel::NO_PRIM;
use crate::accel::refine::TrianglePlane;
use crate::math::{Vec3, Vec4};
use crate::render::context::Context;
use crate::render::patch::Gradients;
use crate::render::world::PrimSource;
use crate::scene::Mesh;

/// Number of cached faces: a block of pixels sees about as many.
const REMEMBERED: usize = 256;

/// Marks faces that have no instance, and are shaded one by one; also marks "no skin".
const NONE: u32 = u32::MAX;

/// A face that was hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    pub(super) numbers: FaceNumbers,
    instance: u32,
    /// Index among the skins; [`NONE`] if it has none.
    pub(super) skin: u32,
}

/// Hits of a wave, by instance.
#[derive(Debug)]
pub(crate) struct HitsByInstance {
    faces: Vec<Face>,
    skins: Vec<Skin>,
    /// Cache of prims and their faces, addressed by the prim.
    remembered: Box<[(u32, u32); REMEMBERED]>,
    /// Ray and face of the hits of each instance.
    lists: Vec<Vec<(u32, u32)>>,
    /// Instances that were hit, in the order of their first hits.
    pub(super) hit: Vec<u32>,
}

impl Default for HitsByInstance {
    fn default() -> Self {
        let remembered = Box::new([(NO_PRIM, 0); REMEMBERED]);
        Self { faces: Vec::new(), skins: Vec::new(), remembered, lists: Vec::new(), hit: Vec::new() }
    }
}

impl HitsByInstance {
    /// Drops all hits.
    pub(crate) fn clear(&mut self, instances: usize) {
        self.faces.clear();
        self.skins.clear();
        self.remembered.fill((NO_PRIM, 0));
        self.lists.resize_with(instances, Vec::new);
        for instance in self.hit.drain(..) {
            self.lists[instance as usize].clear();
        }
    }

    /// Adds the hits of `count` consecutive rays on one prim; false if they must be shaded one by one.
    #[inline(always)]
    pub(crate) fn take(&mut self, context: &Context, first: u32, count: usize, prim: u32) -> bool {
        let place = &mut self.remembered[prim as usize % REMEMBERED];
        if place.0 != prim {
            *place = (prim, u32::try_from(self.faces.len()).unwrap_or(NONE));
            self.faces.push(Face::of(context, prim, &mut self.skins));
        }
        let at = place.1;
        let instance = self.faces[at as usize].instance;
        let Some(list) = self.lists.get_mut(instance as usize) else { return false };
        if list.is_empty() {
            self.hit.push(instance);
        }
        list.extend((first..).take(count).map(|ray| (ray, at)));
        true
    }

    /// Number of instances that were hit.
    pub(crate) fn instances(&self) -> usize {
        self.hit.len()
    }

    /// The `k`th instance that was hit, and its hits: rays, and faces among [`Self::faces`].
    pub(crate) fn of(&self, k: usize) -> (u32, &[(u32, u32)]) {
        let instance = self.hit[k];
        (instance, &self.lists[instance as usize])
    }

    /// All faces that were hit.
    pub(crate) fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// These faces, without hits.
    #[cfg(test)]
    pub(super) fn of_faces(faces: Vec<Face>) -> Self {
        Self { faces, ..Self::default() }
    }

    /// Skins of the faces that have one.
    pub(super) fn skins(&self) -> &[Skin] {
        &self.skins
    }
}

impl Face {
    /// Looks up a prim.
    #[inline(never)]
    fn of(context: &Context, prim: u32, skins: &mut Vec<Skin>) -> Self {
        let nothing = || FaceNumbers::new(prim, &TrianglePlane::default(), Vec3::ZERO, None);
        Self::new(context, prim, skins).unwrap_or_else(|| Self { numbers: nothing(), instance: NONE, skin: NONE })
    }

    /// `None` unless it is a triangle with an area and a material with shared constants.
    fn new(context: &Context, prim: u32, skins: &mut Vec<Skin>) -> Option<Self> {
        let (scene, world) = (context.scene, context.world);
        let PrimSource::Triangle { instance, triangle: in_mesh } = world.source(prim) else { return None };
        let mesh = &scene.meshes[scene.instances[instance as usize].mesh as usize];
        let constants = context.material_constants[mesh.material as usize].as_ref()?;
        let corners = world.triangle(prim);
        let plane = TrianglePlane::of(&corners);
        let winding = plane.flat.unit();
        if !winding.is_normalized() {
            return None;
        }
        let outward = if world.placement(instance).mirrored { -winding } else { winding };
        let normals = if mesh.normals.is_empty() {
            None
        } else {
            let [a, b, c] = mesh.triangles[in_mesh as usize];
            let normal = |i: u32| mesh.normals.get(i as usize).copied();
            Some([normal(a)?, normal(b)?, normal(c)?])
        };
        let numbers = FaceNumbers::new(prim, &plane, outward, normals);
        let material_maps = constants.material_maps.as_ref().filter(|material_maps| material_maps.covers(mesh));
        if material_maps.is_none() && !constants.needs_cones {
            return Some(Self { numbers, instance, skin: NONE });
        }
        let skin = u32::try_from(skins.len()).unwrap_or(NONE);
        skins.push(skin_of(mesh, mesh.triangles[in_mesh as usize], &Gradients::new(corners), material_maps));
        Some(Self { numbers, instance, skin })
    }

    /// A face without instance.
    #[cfg(test)]
    pub(super) fn of_triangle(
        prim: u32,
        corners: &crate::math::triangle::Triangle,
        normals: Option<[Vec3; 3]>,
    ) -> Self {
        let plane = TrianglePlane::of(corners);
        Self { numbers: FaceNumbers::new(prim, &plane, plane.flat.unit(), normals), instance: NONE, skin: NONE }
    }
}

/// Skin of a triangle of a mesh.
fn skin_of(mesh: &Mesh, corners: [u32; 3], gradients: &Gradients, material_maps: Option<&MaterialMaps>) -> Skin {
    let uvs = |k: usize| {
        material_maps.map_or_else(Default::default, |material_maps| material_maps.coordinates(k, mesh, corners))
    };
    // Corners without a tangent give points without one, which are shaded one by one.
    let tangent = |i: u32| mesh.tangents.get(i as usize).copied().unwrap_or(Vec4::NAN);
    let skin = Skin::new(gradients, uvs(0), corners.map(tangent));
    if !material_maps.is_some_and(|material_maps| material_maps.wants_extras(mesh)) {
        return skin;
    }
    let color = |i: u32| mesh.colors.get(i as usize).copied().unwrap_or(Vec4::ONE);
    skin.with(uvs(1), corners.map(color))
}
