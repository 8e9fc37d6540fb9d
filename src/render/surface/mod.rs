//! From a hit to the surface: position with error bound, normals, and texture coordinates.
//!
//! Evaluated once, for the hit that counts. Nothing here knows of light; materials only provide their normal and bump maps, and
//! their opacity. Whatever a file contains, normals come out finite and of unit length.

use super::branch::ShadingPoint;
use super::context::Context;
use super::lobe_frame::LobeFrame;
use super::patch::{Footprint, Gradients, Patch, color_at, coordinates_at};
use super::shade::{ShadingFrame, base_color, has_inside};
use super::texture::TextureStore;
use super::world::{Placement, PrimSource, World};
use crate::accel::refine::Refined;
use crate::accel::{Hit, NO_PRIM, Ray};
use crate::math::bounds::offset_origin;
use crate::math::{Vec2, Vec3};
use crate::scene::{Material, Mesh, Scene, TextureRef};
use std::cell::Cell;

/// The prim that was hit, before anything about it is computed.
#[derive(Clone, Copy)]
pub(crate) struct HitPrim<'a> {
    pub prim: u32,
    /// Instances first, then spheres, then cones, then planes.
    pub instance: u32,
    pub material_id: u32,
    pub material: &'a Material,
    mesh: Option<(&'a Mesh, &'a Placement)>,
    source: PrimSource,
}

impl<'a> HitPrim<'a> {
    pub(crate) fn new(scene: &'a Scene, world: &'a World, prim: u32) -> Self {
        let source = world.source(prim);
        let of_instance = |instance: u32| {
            let mesh = &scene.meshes[scene.instances[instance as usize].mesh as usize];
            (instance, mesh.material, Some((mesh, world.placement(instance))))
        };
        let (instance, material_id, mesh) = match source {
            PrimSource::Triangle { instance, .. } | PrimSource::Polygon { instance, .. } => of_instance(instance),
            PrimSource::Sphere(i) => (id(scene.instances.len()) + i, scene.spheres[i as usize].material, None),
            PrimSource::Cone(i) => {
                let first = id(scene.instances.len() + scene.spheres.len());
                (first + i, scene.cones[i as usize].material, None)
            }
            PrimSource::Plane(i) => {
                let first = id(scene.instances.len() + scene.spheres.len() + scene.cones.len());
                (first + i, scene.planes[i as usize].material, None)
            }
        };
        let material = &scene.materials[material_id as usize];
        Self { prim, instance, material_id, material, mesh, source }
    }

    /// Whether a ray that leaves the surface cannot hit it again.
    fn is_planar(&self) -> bool {
        !matches!(self.source, PrimSource::Sphere(_) | PrimSource::Cone(_))
    }

    /// The part of the mesh around a hit; `None` on spheres, cones and planes, which have no texture coordinates.
    ///
    /// `u`, `v` are the barycentric coordinates of a triangle's second and third corner, `position` is in the centred frame. Maps
    /// are read at the point, at full resolution.
    pub(crate) fn patch(&self, world: &World, u: f32, v: f32, position: Vec3) -> Option<Patch<'a>> {
        let (mesh, placement) = self.mesh?;
        let (corners, weights) = match self.source {
            PrimSource::Triangle { triangle, .. } => (mesh.triangles[triangle as usize], [1.0 - u - v, u, v]),
            _ => fan_triangle(mesh, world, self.prim, self.source, position),
        };
        let vertices = self.vertices(world, corners, mesh);
        let print = Footprint::NONE;
        Some(Patch { mesh, placement, corners, weights, vertices, print, last: Cell::new(None), read: Cell::new(None) })
    }

    /// Opacity where a ray has hit a triangle, with maps read at full resolution; `None` on other shapes.
    pub(crate) fn opacity(&self, hit: &Hit, store: &TextureStore) -> Option<f32> {
        let PrimSource::Triangle { triangle, .. } = self.source else { return None };
        let (mesh, _) = self.mesh?;
        let (corners, weights) = (mesh.triangles[triangle as usize], [1.0 - hit.u - hit.v, hit.u, hit.v]);
        let at = |map: &TextureRef| coordinates_at(mesh, corners, weights, map).map_or(Vec2::ZERO, |(uv, _)| uv);
        let of_map = |map: &TextureRef| store.channel::<0>(map.texture, at(map));
        let alpha = |map: &TextureRef| store.channel::<3>(map.texture, at(map));
        let material = self.material;
        let alpha = Vec3::ONE.extend(material.base_color_map.as_ref().map_or(1.0, alpha));
        let of_map = material.opacity_map.as_ref().map_or(1.0, of_map);
        Some(base_color(material, alpha, of_map, color_at(mesh, corners, weights)).w)
    }

    /// World positions (centred frame) of mesh vertices.
    fn vertices(&self, world: &World, corners: [u32; 3], mesh: &Mesh) -> [Vec3; 3] {
        let shapes = &world.shapes;
        match self.source {
            PrimSource::Triangle { .. } => world.triangle(self.prim),
            _ => {
                let (first, _) = world.polygon(self.prim);
                let (own_first, _) = polygon_run(mesh, self.source);
                let base = shapes.polygon_corners[first as usize] - mesh.polygon_corners[own_first as usize];
                corners.map(|i| shapes.vertices[(i + base) as usize])
            }
        }
    }
}

/// Normal that a file gives for a point of a face: interpolated, of unit length, on whichever side the file has it. `None` where
/// it gives none.
pub fn given_normal(scene: &Scene, world: &World, prim: u32, at: &Refined) -> Option<Vec3> {
    HitPrim::new(scene, world, prim).patch(world, at.u, at.v, at.position)?.normal()
}

/// First corner and length of a polygon in its mesh.
fn polygon_run(mesh: &Mesh, source: PrimSource) -> (u32, u32) {
    let PrimSource::Polygon { polygon, .. } = source else { return (0, 0) };
    let p = mesh.polygons[polygon as usize];
    (p.first, p.len)
}

/// The triangle of a polygon's fan that contains `position`, or is nearest to it, and the barycentric coordinates there.
///
/// For attributes that are affine over the polygon, as projected coordinates are, any triangle gives the same result.
fn fan_triangle(mesh: &Mesh, world: &World, prim: u32, source: PrimSource, position: Vec3) -> ([u32; 3], [f32; 3]) {
    let shapes = &world.shapes;
    let (first, len) = polygon_run(mesh, source);
    let (world_first, _) = world.polygon(prim);
    let corner = |i: u32| shapes.vertices[shapes.polygon_corners[(world_first + i) as usize] as usize];
    let mut best = ([first; 3], [1.0, 0.0, 0.0], f32::NEG_INFINITY);
    for i in 1..len.saturating_sub(1) {
        let gradients = Gradients::new([corner(0), corner(i), corner(i + 1)]);
        let offset = position - corner(0);
        let (u, v) = (gradients.second.dot(offset), gradients.third.dot(offset));
        let weights = [1.0 - u - v, u, v];
        let inside = weights[0].min(u).min(v);
        if inside > best.2 {
            best = ([first, first + i, first + i + 1], weights, inside);
        }
    }
    (best.0.map(|i| mesh.polygon_corners[i as usize]), best.1)
}

/// A point of a surface, as seen along a ray. Positions in the centred frame, directions in world space.
pub(crate) struct Surface<'a> {
    pub target: HitPrim<'a>,
    pub patch: Option<Patch<'a>>,
    pub footprint: Footprint,
    pub position: Vec3,
    /// Origin of secondary rays, before the offset along the normal.
    start: Vec3,
    /// Absolute error bound of `position` and `start`, per axis.
    pub error: Vec3,
    /// Unit normal of the shape itself, facing the ray's origin.
    pub geometric: Vec3,
    /// Unit normal before maps turn it, on the same side as `geometric`.
    smooth: Vec3,
    /// 1 where a mesh's own normal is on that side, else −1.
    side: f32,
    /// Unit shading normal, always facing the ray's origin.
    pub normal: Vec3,
    /// Unit normal of the plane that lights must be above to reach the point: where a mesh stands for a round surface, not that
    /// of the triangle.
    pub horizon: Vec3,
    /// Unit vector back along the ray.
    pub view: Vec3,
    /// Whether the front of the face was hit.
    pub front: bool,
}

impl<'a> Surface<'a> {
    /// The surface at `hit` of `ray` whose cone is `width` wide there.
    pub(crate) fn new(world: &World, target: HitPrim<'a>, ray: &Ray, hit: &Hit, width: f32) -> Self {
        let refined = world.refine(ray, hit);
        let view = -ray.dir.try_normalize().unwrap_or(Vec3::Z);
        let mut patch = target.patch(world, refined.u, refined.v, refined.position);

        // Mirrored instances reverse the winding in the world; the file's front stays the front.
        let mirrored = patch.as_ref().is_some_and(|p| p.placement.mirrored);
        let winding = if refined.normal.is_normalized() { refined.normal } else { view };
        let outward = if mirrored { -winding } else { winding };
        let front = outward.dot(view) >= 0.0;
        let geometric = if front { outward } else { -outward };
        let footprint = Footprint::new(-view, geometric, width);
        if let Some(patch) = &mut patch {
            patch.print = footprint;
        }
        let (position, start, error) = (refined.position, refined.start, refined.error);
        Self {
            target,
            patch,
            footprint,
            position,
            start,
            error,
            geometric,
            smooth: geometric,
            side: 1.0,
            normal: geometric,
            horizon: geometric,
            view,
            front,
        }
    }

    /// Computes the shading normal: interpolated, turned by normal and bump map, and to the side of the ray.
    ///
    /// The geometric normal decides the side, so normals that contradict their own winding still light the visible face.
    pub(crate) fn shade_smoothly(&mut self, store: &TextureStore) {
        let Some(patch) = &self.patch else { return };
        let material = self.target.material;
        let own = patch.normal().unwrap_or(if self.front { self.geometric } else { -self.geometric });
        let side = self.side(own);
        (self.smooth, self.side) = (own * side, side);
        if patch.is_curved() {
            self.horizon = facing(self.smooth, self.geometric, self.view);
        }
        self.normal = mapped_normal(patch, material, store, own, side, self.geometric, self.view);
    }

    /// 1 for a normal on the visible side, −1 for one on the other.
    pub(super) fn side(&self, own: Vec3) -> f32 {
        side_of(own, self.geometric)
    }

    /// Frame of the lobes on this surface.
    pub(crate) fn lobe_frame(&self) -> LobeFrame<'_> {
        let Self { smooth, side, geometric, normal, view, .. } = *self;
        LobeFrame { patch: self.patch.as_ref(), smooth, side, geometric, normal, view }
    }

    /// Change of the normal, before maps turn it, along both axes of the ray's cone.
    pub(crate) fn bends(&self, context: &Context) -> [Vec3; 2] {
        let Footprint { along, across } = self.footprint;
        match (&self.patch, self.target.source) {
            (Some(patch), _) => patch.bends([along, across]),
            (None, PrimSource::Sphere(i)) => {
                let curvature = (1.0 / context.scene.spheres[i as usize].radius) as f32;
                [along * curvature, across * curvature]
            }
            (None, PrimSource::Cone(i)) => {
                let cone = &context.scene.cones[i as usize];
                let axis = (cone.apex - cone.base).normalize_or_zero();
                let from = self.position.as_dvec3() + context.world.center - cone.base;
                let curvature = 1.0 / (from - axis * axis.dot(from)).length();
                let round = |v: Vec3| ((v.as_dvec3() - axis * axis.dot(v.as_dvec3())) * curvature).as_vec3();
                [round(along), round(across)]
            }
            _ => [Vec3::ZERO; 2],
        }
    }

    /// Squared change of the normal within `reach` of the ray's cone, with this normal map and its scale, summed over both axes.
    /// Bump maps are ignored.
    pub(crate) fn turning(&self, context: &Context, reach: f32, (map, scale): (Option<&TextureRef>, f32)) -> f32 {
        let [along, across] = self.bends(context);
        let of_mesh = (along.length_squared() + across.length_squared()) * (reach * reach);
        let of_map = self.patch.as_ref().zip(map);
        of_mesh + of_map.map_or(0.0, |(patch, map)| patch.turning_of_map(map, scale, context.textures, reach))
    }

    /// Whether it is seen from outside: always, if there is no inside.
    pub(crate) fn is_outside(&self) -> bool {
        self.front || !has_inside(self.target.material)
    }

    /// View and normals for shading.
    pub(crate) fn seen(&self) -> ShadingFrame {
        ShadingFrame { normal: self.normal, geometric: self.geometric, view: self.view, outside: self.is_outside() }
    }

    /// A ray from here along `dir` (of any length) up to `t_max`; it starts outside the error bound of the position, on the side
    /// it goes to, and cannot hit the flat face it starts on.
    pub(crate) fn ray(&self, dir: Vec3, t_max: f32, sample: u32) -> Ray {
        Ray { origin: self.origin(dir), t_min: 0.0, dir, t_max, exclude: self.excluded(), sample }
    }

    /// The face that rays from here cannot hit again; [`NO_PRIM`] on round shapes, which they may.
    fn excluded(&self) -> u32 {
        if self.target.is_planar() { self.target.prim } else { NO_PRIM }
    }

    /// Origin of rays towards `dir`.
    pub(crate) fn origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.start, self.error, self.geometric, dir)
    }
}

impl ShadingPoint for Surface<'_> {
    fn material(&self) -> (u32, &Material) {
        (self.target.material_id, self.target.material)
    }

    fn seen(&self) -> ShadingFrame {
        self.seen()
    }

    fn is_front(&self) -> bool {
        self.front
    }

    fn bend(&self, context: &Context) -> f32 {
        let [along, across] = self.bends(context);
        along.length_squared() + across.length_squared()
    }

    fn ray(&self, dir: Vec3, sample: u32) -> Ray {
        self.ray(dir, f32::INFINITY, sample)
    }

    fn set_off(&self, dir: Vec3) -> [Vec3; 2] {
        [self.origin(dir), self.start]
    }

    fn excluded(&self) -> u32 {
        self.excluded()
    }
}

/// 1 for a mesh normal on the visible side, whose normal is `geometric`; −1 for one on the other.
#[inline(always)]
pub(crate) fn side_of(own: Vec3, geometric: Vec3) -> f32 {
    if own.dot(geometric) < 0.0 { -1.0 } else { 1.0 }
}

/// A mesh's own normal turned by maps, on the side of the ray.
#[inline]
pub(crate) fn mapped_normal(
    patch: &Patch,
    material: &Material,
    store: &TextureStore,
    own: Vec3,
    side: f32,
    geometric: Vec3,
    view: Vec3,
) -> Vec3 {
    let turned = |map| patch.normal_mapped(own, map, material.normal_scale, store);
    let mapped = material.normal_map.as_ref().and_then(turned).unwrap_or(own);
    let bumped = patch.bumped(mapped, material, store).unwrap_or(mapped);
    facing(bumped * side, geometric, view)
}

/// Smallest cosine between the view and a shading normal.
const GRAZING: f32 = 1e-2;

/// Whether `view` sees the front of a surface with this normal, and not at too grazing an angle.
#[inline(always)]
pub(crate) fn faces(normal: Vec3, view: Vec3) -> bool {
    normal.dot(view) >= GRAZING
}

/// `normal`, turned just far enough that `view` sees its front.
///
/// Interpolated and mapped normals may point away at silhouettes; unturned they would cause black rims. The normal of the face
/// itself, `geometric`, never does, at however grazing an angle, and stays.
#[inline(always)]
pub(crate) fn facing(normal: Vec3, geometric: Vec3, view: Vec3) -> Vec3 {
    /// Rounding of a normal that the file gives, and that was transformed with its face.
    const ROUNDING: f32 = 1e-6;
    let is_own = || (normal - geometric).abs().max_element() <= ROUNDING;
    if faces(normal, view) || (normal.dot(view) > 0.0 && is_own()) {
        return normal;
    }
    (normal + view * (GRAZING - normal.dot(view))).try_normalize().unwrap_or(view)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "`Scene::check` and loading refuse more prims, and with them more of each kind"
)]
fn id(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests;
