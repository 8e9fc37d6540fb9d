//! From a hit to the surface there: position with its error, normals, and the coordinates textures are read with.
//!
//! Evaluated once, for the hit that counts. Nothing here knows of light; materials are only asked for their normal and
//! bump maps. Whatever a file gives, normals come out finite and of unit length.

use super::branch::Ground;
use super::context::Context;
use super::footing::Footing;
use super::patch::{Footprint, Gradients, Patch, color_at, coordinates_at};
use super::shade::{Seen, base_color, has_inside};
use super::texture::TextureStore;
use super::world::{Placement, PrimSource, World};
use crate::accel::refine::Refined;
use crate::accel::{Hit, NO_PRIM, Ray};
use crate::math::bounds::offset_origin;
use crate::math::{Vec2, Vec3};
use crate::scene::{Material, Mesh, Scene, TextureRef};
use std::cell::Cell;

/// What was hit, before anything about it is computed.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a> {
    pub prim: u32,
    /// Instances first, then spheres, then cones, then planes.
    pub instance: u32,
    pub material_id: u32,
    pub material: &'a Material,
    mesh: Option<(&'a Mesh, &'a Placement)>,
    source: PrimSource,
}

impl<'a> Target<'a> {
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

    /// Whether a ray that leaves the surface cannot meet it again.
    fn is_planar(&self) -> bool {
        !matches!(self.source, PrimSource::Sphere(_) | PrimSource::Cone(_))
    }

    /// The part of the mesh around a hit; `None` on spheres, cones and planes, which have no texture coordinates.
    ///
    /// `u`, `v` are the weights of a triangle's second and third corner, `position` is in the centred frame. Maps are read at
    /// the point, as sharp as they are.
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

    /// The opacity where a ray has hit a triangle, of maps as sharp as they are; `None` on other shapes.
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

/// The normal that a file gives for a point of a face: interpolated, of unit length, on whatever side the file has it.
/// `None` where it gives none.
pub fn given_normal(scene: &Scene, world: &World, prim: u32, at: &Refined) -> Option<Vec3> {
    Target::new(scene, world, prim).patch(world, at.u, at.v, at.position)?.normal()
}

/// First corner and length of a polygon in its mesh.
fn polygon_run(mesh: &Mesh, source: PrimSource) -> (u32, u32) {
    let PrimSource::Polygon { polygon, .. } = source else { return (0, 0) };
    let p = mesh.polygons[polygon as usize];
    (p.first, p.len)
}

/// The triangle of a polygon's fan that `position` lies in, or lies least outside of, and its weights there.
///
/// For attributes that are affine over the polygon, as projected coordinates are, any triangle gives the same answer.
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
    pub target: Target<'a>,
    pub patch: Option<Patch<'a>>,
    pub footprint: Footprint,
    pub position: Vec3,
    /// Where secondary rays start, but for the offset along the normal.
    start: Vec3,
    /// Absolute error bound of `position` and `start`, per axis.
    pub error: Vec3,
    /// Unit normal of the shape itself, turned to the side the ray comes from.
    pub geometric: Vec3,
    /// Unit normal before maps turn it, on that side as a whole.
    smooth: Vec3,
    /// 1 where a mesh's own normal is on that side, else −1.
    side: f32,
    /// Unit normal for shading, never turned away from the ray.
    pub normal: Vec3,
    /// Unit normal of the plane that lights must be above to shine on it: where a mesh stands for something round, not that
    /// of the triangle.
    pub horizon: Vec3,
    /// Unit vector back along the ray.
    pub view: Vec3,
    /// Whether the front of the face was hit.
    pub front: bool,
}

impl<'a> Surface<'a> {
    /// The surface at `hit` of `ray` whose cone is `width` wide there.
    pub(crate) fn new(world: &World, target: Target<'a>, ray: &Ray, hit: &Hit, width: f32) -> Self {
        let refined = world.refine(ray, hit);
        let view = -ray.dir.try_normalize().unwrap_or(Vec3::Z);
        let mut patch = target.patch(world, refined.u, refined.v, refined.position);

        // The winding in the world is turned round in mirrored instances; the file's front stays the front.
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

    /// Finds the shading normal: interpolated, turned by normal and bump map, and to the side of the ray.
    ///
    /// The geometric normal decides the side, so normals that a file gives against its own winding still light the
    /// face that is seen.
    pub(crate) fn shade_smoothly(&mut self, store: &TextureStore) {
        let Some(patch) = &self.patch else { return };
        let material = self.target.material;
        let own = patch.normal().unwrap_or(if self.front { self.geometric } else { -self.geometric });
        let side = self.side(own);
        (self.smooth, self.side) = (own * side, side);
        if patch.is_curved() {
            self.horizon = facing(self.smooth, self.view);
        }
        self.normal = mapped_normal(patch, material, store, own, side, self.view);
    }

    /// 1 for a normal on the side that is seen, −1 for one on the other.
    pub(super) fn side(&self, own: Vec3) -> f32 {
        side_of(own, self.geometric)
    }

    /// What lobes over it lie on.
    pub(crate) fn footing(&self) -> Footing<'_> {
        let Self { smooth, side, normal, view, .. } = *self;
        Footing { patch: self.patch.as_ref(), smooth, side, normal, view }
    }

    /// How its normal turns along both axes of the ray's cone before maps turn it.
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

    /// How far its normal turns in `reach` of the ray's cone, with this normal map and its scale: the squares, summed over both
    /// axes. Bump maps are not asked.
    pub(crate) fn turning(&self, context: &Context, reach: f32, (map, scale): (Option<&TextureRef>, f32)) -> f32 {
        let [along, across] = self.bends(context);
        let of_mesh = (along.length_squared() + across.length_squared()) * (reach * reach);
        let of_map = self.patch.as_ref().zip(map);
        of_mesh + of_map.map_or(0.0, |(patch, map)| patch.turning_of_map(map, scale, context.textures, reach))
    }

    /// Whether it is seen from outside: from either side where there is no inside.
    pub(crate) fn is_outside(&self) -> bool {
        self.front || !has_inside(self.target.material)
    }

    /// How it is seen.
    pub(crate) fn seen(&self) -> Seen {
        Seen { normal: self.normal, geometric: self.geometric, view: self.view, outside: self.is_outside() }
    }

    /// A ray from here along `dir` (of any length) up to `t_max`; it starts outside the error of the position, on the
    /// side it goes to, and cannot meet the flat face it starts on.
    pub(crate) fn ray(&self, dir: Vec3, t_max: f32, sample: u32) -> Ray {
        Ray { origin: self.origin(dir), t_min: 0.0, dir, t_max, exclude: self.excluded(), sample }
    }

    /// The face that rays from here cannot meet again; [`NO_PRIM`] on round shapes, which they may.
    fn excluded(&self) -> u32 {
        if self.target.is_planar() { self.target.prim } else { NO_PRIM }
    }

    /// Where rays towards `dir` start.
    pub(crate) fn origin(&self, dir: Vec3) -> Vec3 {
        offset_origin(self.start, self.error, self.geometric, dir)
    }
}

impl Ground for Surface<'_> {
    fn material(&self) -> (u32, &Material) {
        (self.target.material_id, self.target.material)
    }

    fn seen(&self) -> Seen {
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

/// 1 for a normal of a mesh on the side that is seen, whose normal is `geometric`; −1 for one on the other.
#[inline(always)]
pub(crate) fn side_of(own: Vec3, geometric: Vec3) -> f32 {
    if own.dot(geometric) < 0.0 { -1.0 } else { 1.0 }
}

/// A mesh's own normal as maps turn it, on the side of the ray.
#[inline]
pub(crate) fn mapped_normal(
    patch: &Patch,
    material: &Material,
    store: &TextureStore,
    own: Vec3,
    side: f32,
    view: Vec3,
) -> Vec3 {
    let turned = |map| patch.normal_mapped(own, map, material.normal_scale, store);
    let mapped = material.normal_map.as_ref().and_then(turned).unwrap_or(own);
    let bumped = patch.bumped(mapped, material, store).unwrap_or(mapped);
    facing(bumped * side, view)
}

/// Least cosine of the view with a normal for shading.
const GRAZING: f32 = 1e-2;

/// Whether `view` sees the front of what has this normal, and not too flat.
#[inline(always)]
pub(crate) fn faces(normal: Vec3, view: Vec3) -> bool {
    normal.dot(view) >= GRAZING
}

/// `normal`, turned just far enough that `view` sees its front.
///
/// Interpolated and mapped normals may point away at silhouettes; unturned they would make black rims.
#[inline(always)]
pub(crate) fn facing(normal: Vec3, view: Vec3) -> Vec3 {
    if faces(normal, view) {
        return normal;
    }
    (normal + view * (GRAZING - normal.dot(view))).try_normalize().unwrap_or(view)
}

#[expect(clippy::cast_possible_truncation, reason = "loading refuses scenes with 2^32 - 1 things of a kind")]
fn id(i: usize) -> u32 {
    i as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, DVec3, Vec2, Vec4};
    use crate::render::patch::Coordinates;
    use crate::scene::{
        Bitmap, Instance, MetalRough, Pixels, Polygon, Reflection, Sampler, TexCoords, Texture, UvTransform,
    };

    /// A unit square in z = 0 that faces +z: u runs along x, v down along −y; texture 0 covers it.
    fn scene(texels: Vec<[u8; 4]>, width: u32) -> Scene {
        let v = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        let uv = |u: f32, v: f32| Vec2::new(u, v);
        let mesh = Mesh {
            positions: vec![v(0.0, 0.0), v(1.0, 0.0), v(1.0, 1.0), v(0.0, 1.0)],
            uvs: vec![vec![uv(0.0, 1.0), uv(1.0, 1.0), uv(1.0, 0.0), uv(0.0, 0.0)]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        };
        let height = texels.len() as u32 / width;
        Scene {
            meshes: vec![mesh],
            instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY }],
            materials: vec![Material::plain()],
            bitmaps: vec![Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels.into()) }],
            textures: vec![Texture { bitmap: 0, sampler: Sampler::default() }],
            ..Scene::default()
        }
    }

    fn map() -> TextureRef {
        TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() }
    }

    /// The surface seen from +z (or −z) at (0.5, 0.25), or wherever the instance has put that point.
    fn seen<T>(scene: &Scene, from: f32, look: impl FnOnce(Surface, &TextureStore) -> T) -> T {
        use crate::accel::{Accel, NoProbe, none::Unculled};
        let world = World::new(scene);
        let at = scene.instances[0].world_from_object.transform_point3(DVec3::new(0.5, 0.25, 0.0)) - world.center;
        let origin = at.as_vec3() + Vec3::Z * from;
        let ray = Ray { origin, t_min: 0.0, dir: Vec3::NEG_Z * from.signum(), t_max: 9.0, exclude: NO_PRIM, sample: 0 };
        let mut hits = [Hit::MISS];
        Unculled::new(&world.shapes).closest(&[ray], &mut hits, &mut (), &mut NoProbe);
        let target = Target::new(scene, &world, hits[0].prim);
        let mut surface = Surface::new(&world, target, &ray, &hits[0], 1e-4);
        let store = TextureStore::new(scene);
        surface.shade_smoothly(&store);
        look(surface, &store)
    }

    fn normal(scene: &Scene, from: f32) -> Vec3 {
        seen(scene, from, |surface, _| surface.normal)
    }

    fn coordinates(scene: &Scene, map: &TextureRef) -> Coordinates {
        seen(scene, 1.0, |s, _| s.patch.as_ref().expect("a mesh has coordinates").coordinates(map))
    }

    #[track_caller]
    fn assert_near(a: Vec3, b: Vec3) {
        // Normal maps of eight bits cannot say more.
        assert!((a - b).length() < 6e-3, "{a} is not {b}");
    }

    #[test]
    fn coordinates_are_interpolated_and_change_with_the_pixel() {
        let at = coordinates(&scene(vec![[0; 4]], 1), &map());
        assert!((at.uv - Vec2::new(0.5, 0.75)).length() < 1e-6);
        let area = at.along.perp_dot(at.across).abs();
        assert!((area - 1e-8).abs() < 1e-11, "the footprint of a cone seen face on is as wide as the cone: {area}");
    }

    #[test]
    fn coordinates_follow_scale_then_rotation_then_offset() {
        let transform = UvTransform {
            offset: Vec2::new(0.25, 0.5),
            rotation: std::f32::consts::FRAC_PI_2,
            scale: Vec2::new(2.0, 1.0),
        };
        let at = coordinates(&scene(vec![[0; 4]], 1), &TextureRef { transform, ..map() });
        // (0.5, 0.75) → (1, 0.75) → turned counter-clockwise as seen with v down: (0.75, −1) → moved.
        assert!((at.uv - Vec2::new(1.0, -0.5)).length() < 1e-6, "{}", at.uv);
    }

    #[test]
    fn a_grazing_footprint_is_long_along_the_ray_only() {
        let dir = Vec3::new(0.6f32.sqrt() * 1.0, 0.0, -(0.4f32.sqrt()));
        let print = Footprint::new(dir, Vec3::Z, 2.0);
        assert!((print.along.length() - 2.0 / 0.4f32.sqrt()).abs() < 1e-5 && print.along.y == 0.0);
        assert!((print.across.length() - 2.0).abs() < 1e-6);
        assert!(Footprint::new(Vec3::X, Vec3::Z, 1.0).along.is_finite());
        assert!(Footprint::new(Vec3::NEG_Z, Vec3::Z, 1.0).along.length() > 0.5);
    }

    /// A normal map of one colour: the unit vector (x, y, z) of tangent space.
    fn with_normal_map(x: f32, y: f32, z: f32) -> Scene {
        let code = |c: f32| ((c * 0.5 + 0.5) * 255.0).round() as u8;
        let mut scene = scene(vec![[code(x), code(y), code(z), 255]], 1);
        scene.materials[0].normal_map = Some(map());
        scene
    }

    #[test]
    fn a_normal_map_leans_along_u_and_against_v() {
        assert_near(normal(&with_normal_map(0.6, 0.0, 0.8), 1.0), Vec3::new(0.6, 0.0, 0.8));
        assert_near(normal(&with_normal_map(0.0, 0.6, 0.8), 1.0), Vec3::new(0.0, 0.6, 0.8));
        let mut flat = with_normal_map(0.6, 0.0, 0.8);
        flat.materials[0].normal_scale = 0.0;
        assert_near(normal(&flat, 1.0), Vec3::Z);
    }

    #[test]
    fn given_tangents_are_used_with_their_handedness() {
        let mut scene = with_normal_map(0.0, 0.6, 0.8);
        scene.meshes[0].normals = vec![Vec3::Z; 4];
        scene.meshes[0].tangents = vec![Vec4::new(0.0, 1.0, 0.0, 1.0); 4];
        assert_near(normal(&scene, 1.0), Vec3::new(-0.6, 0.0, 0.8));
        scene.meshes[0].tangents = vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 4];
        assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.0, 0.8));
    }

    #[test]
    fn the_transform_of_a_normal_map_turns_its_frame_as_transformed_coordinates_do() {
        let turned = |scale: [f32; 2], rotation| UvTransform { offset: Vec2::ZERO, scale: scale.into(), rotation };
        let quarter = std::f32::consts::FRAC_PI_2;
        for (transform, expected) in [
            (turned([1.0, 1.0], quarter), Vec3::new(0.2, -0.6, 0.77)),
            (turned([1.0, -1.0], 0.0), Vec3::new(0.6, -0.2, 0.77)),
            (turned([-3.0, 2.0], 0.0), Vec3::new(-0.6, 0.2, 0.77)),
            (turned([2.0, 5.0], 0.0), Vec3::new(0.6, 0.2, 0.77)),
            (turned([-1.0, -1.0], quarter), Vec3::new(-0.2, 0.6, 0.77)),
        ] {
            let mut scene = with_normal_map(0.6, 0.2, 0.77);
            scene.materials[0].normal_map = Some(TextureRef { transform, ..map() });
            assert_near(normal(&scene, 1.0), expected);
            crate::load::tangents::generate(&mut scene.meshes[0], TexCoords::default());
            assert_near(normal(&scene, 1.0), expected);
            scene.meshes[0].tangents_along = None;
            assert_near(normal(&scene, 1.0), expected);
        }
    }

    #[test]
    fn tangents_made_along_turned_coordinates_of_unequal_sides_are_those_of_the_coordinates() {
        for (scale, rotation) in [([1.0, 1.0], 0.6), ([2.0, -0.5], 0.0), ([-3.0, 2.0], -1.1)] {
            let mut scene = with_normal_map(0.6, 0.2, 0.77);
            // Four times as long as it is wide.
            scene.meshes[0].positions.iter_mut().for_each(|p| p.x *= 4.0);
            let transform = UvTransform { offset: Vec2::new(0.1, 0.2), scale: scale.into(), rotation };
            let mapped = TextureRef { transform, ..map() };
            scene.materials[0].normal_map = Some(mapped);
            let expected = normal(&scene, 1.0);
            crate::load::tangents::generate(&mut scene.meshes[0], mapped.coordinates());
            assert_near(normal(&scene, 1.0), expected);
        }
    }

    #[test]
    fn tangents_made_along_turned_coordinates_turn_back_for_a_map_that_is_not() {
        for (scale, rotation) in [([1.0, 1.0], 0.6), ([1.0, -1.0], 0.0), ([-3.0, 3.0], -1.1)] {
            let transform = UvTransform { offset: Vec2::ZERO, scale: scale.into(), rotation };
            let mut scene = with_normal_map(0.6, 0.2, 0.77);
            let turned = TextureRef { transform, ..map() };
            crate::load::tangents::generate(&mut scene.meshes[0], turned.coordinates());
            assert_eq!(scene.meshes[0].tangents_along, Some(turned.coordinates()));
            assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.2, 0.77));
        }
    }

    #[test]
    fn tangents_that_were_made_for_one_set_of_coordinates_are_of_no_other() {
        let mut scene = with_normal_map(0.6, 0.2, 0.77);
        let turned = scene.meshes[0].uvs[0].iter().map(|uv| Vec2::new(-uv.y, uv.x)).collect();
        scene.meshes[0].uvs.push(turned);
        scene.materials[0].normal_map = Some(TextureRef { uv_set: 1, ..map() });
        let expected = normal(&scene, 1.0);
        assert!((expected - Vec3::new(0.6, 0.2, 0.77)).length() > 0.1, "{expected}");
        crate::load::tangents::generate(&mut scene.meshes[0], TexCoords::default());
        assert_near(normal(&scene, 1.0), expected);
        // Those of a file are of all.
        scene.meshes[0].tangents_along = None;
        assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.2, 0.77));
    }

    #[test]
    fn a_mirrored_instance_mirrors_its_normal_map() {
        for tangents in [vec![], vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4]] {
            for (x, y) in [(0.6, 0.0), (0.0, 0.6)] {
                let mut scene = with_normal_map(x, y, 0.8);
                scene.meshes[0].normals = vec![Vec3::Z; 4];
                scene.meshes[0].tangents.clone_from(&tangents);
                scene.instances[0].world_from_object = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
                assert_near(normal(&scene, 1.0), Vec3::new(-x, y, 0.8));
            }
        }
    }

    #[test]
    fn the_back_of_a_face_has_its_whole_normal_turned_round() {
        assert_near(normal(&with_normal_map(0.6, 0.0, 0.8), -1.0), Vec3::new(-0.6, 0.0, -0.8));
    }

    #[test]
    fn smooth_normals_are_interpolated_and_scaled_as_normals() {
        let mut scene = scene(vec![[0; 4]], 1);
        let tilted = Vec3::new(0.6, 0.0, 0.8);
        scene.meshes[0].normals = vec![tilted; 4];
        assert_near(normal(&scene, 1.0), tilted);
        scene.instances[0].world_from_object = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
        assert_near(normal(&scene, 1.0), Vec3::new(0.3, 0.0, 0.8).normalize());
    }

    #[test]
    fn a_normal_that_points_away_is_turned_until_it_is_seen() {
        let turned = facing(Vec3::new(0.8, 0.0, -0.6), Vec3::Z);
        assert!(turned.dot(Vec3::Z) > 0.0 && turned.x > 0.9 && turned.is_normalized());
        assert_eq!(facing(Vec3::Z, Vec3::Z), Vec3::Z);
        assert!(facing(Vec3::NEG_Z, Vec3::Z).is_normalized());
    }

    #[test]
    fn a_bump_map_leans_against_its_slope() {
        // Heights rise along u from 0 to 1 in four texels; away from the border the slope is 1 a texture.
        let texels = [0u8, 64, 128, 192].map(|h| [h, h, h, 255]).to_vec();
        let mut scene = scene(texels, 4);
        scene.materials[0].bump_map = Some(map());
        scene.materials[0].bump_scale = 0.5;
        let slope = 64.0 / 255.0 * 4.0 * 0.5;
        assert_near(normal(&scene, 1.0), Vec3::new(-slope, 0.0, 1.0).normalize());
    }

    #[test]
    fn attributes_of_whole_polygons_are_those_of_their_fan() {
        let mut scene = scene(vec![[0; 4]], 1);
        let mesh = &mut scene.meshes[0];
        mesh.triangles.clear();
        mesh.polygon_corners = vec![0, 1, 2, 3];
        mesh.polygons = vec![Polygon { first: 0, len: 4, face: 0 }];
        let at = coordinates(&scene, &map());
        assert!((at.uv - Vec2::new(0.5, 0.75)).length() < 1e-6, "{}", at.uv);
    }

    #[test]
    fn surfaces_without_coordinates_or_texture_are_safe() {
        let mut scene = scene(vec![[0, 0, 255, 255]], 1);
        let missing = TextureRef { texture: 7, uv_set: 3, transform: UvTransform::default() };
        scene.materials[0].normal_map = Some(missing);
        scene.materials[0].bump_map = Some(missing);
        scene.materials[0].reflection =
            Reflection::MetalRough(MetalRough { metal_rough_map: Some(missing), ..MetalRough::default() });
        assert_near(normal(&scene, 1.0), Vec3::Z);
    }
}
