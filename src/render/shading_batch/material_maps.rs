//! Maps of a material and vertex colours that are read side by side for the points of a batch.

use super::PlacedMesh;
use super::columns::{Columns, Found, HitData, LANES, POINTS, ShadingBatch, get, padded, put};
use super::cones::Cones;
use super::constants::{other_maps, reads_reflectance};
use super::painted::Painted;
use crate::math::simd::{Kernel, Simd};
use crate::math::{Vec2, Vec3, Vec4};
use crate::render::context::Context;
use crate::render::patch::{
    BakedFrame, FrameTurn, Turn, given_tangent, mixed_color, smooth_normal, turned_by_texel, turning_of,
};
use crate::render::shade::{MetalRoughInputs, PhongInputs, base_color, base_space, has_inside, is_cut_out, occlusion};
use crate::render::surface::{facing, side_of};
use crate::render::texture::{ColorSpace, Layout, Places, Spots, TextureStore, changes};
use crate::render::world::Placement;
use crate::scene::{Material, Mesh, MetalRough, Reflection, TextureRef, UvTransform};

/// Use of a map.
#[derive(Clone, Copy, Debug)]
enum Slot {
    Base,
    Opacity,
    Emission,
    Occlusion,
    Normal,
    MetalRough,
    Transmission,
    Ambient,
    Specular,
    Shininess,
}

const SLOTS: usize = 10;

/// Texels of the maps at eight points.
type Texels = [[Vec4; LANES]; SLOTS];

/// Maximum number of coordinate sets (with transform) of a material's maps.
const GROUPS: usize = 2;

/// Maximum number of maps of lobes and of reflectance of a material.
pub(super) const LOBE_MAPS: usize = 11;

/// Texels of the maps of lobes and of reflectance at every point.
pub(super) type LobeTexels = [[Vec4; POINTS]; LOBE_MAPS];

/// Maps of a material.
#[derive(Clone, Debug)]
pub(crate) struct MaterialMaps {
    groups: Vec<Group>,
    /// Texture of the normal map, which is in the first group, and its layout.
    normal_map: Option<(u32, Layout)>,
    /// Maps of lobes and of reflectance, by their indices in [`LobeTexels`]; empty where these are not read here.
    lobes: Vec<(TextureRef, ColorSpace)>,
}

/// Maps with the same coordinates.
#[derive(Clone, Debug)]
struct Group {
    uv_set: u32,
    transform: UvTransform,
    turn: Turn,
    stacks: Vec<Stack>,
    /// Textures with an alpha cutoff, and the use of each.
    cuts: Vec<(Slot, u32)>,
}

/// Maps that are read at the same texel addresses.
#[derive(Clone, Debug)]
struct Stack {
    layout: Layout,
    maps: Vec<Map>,
}

/// A texture in one colour space with its uses: mostly one, but occlusion often shares a map with metalness.
#[derive(Clone, Debug)]
struct Map {
    texture: u32,
    space: ColorSpace,
    slots: Vec<Slot>,
    /// Indices in [`LobeTexels`], where it belongs to lobes or reflectance.
    lobes: Vec<usize>,
}

/// Use of a texel.
#[derive(Clone, Copy)]
enum TexelUse {
    Slot(Slot),
    Lobe(usize),
}

impl MaterialMaps {
    /// `None` for materials whose maps have too many coordinate sets, or one map that cannot be read here.
    pub(super) fn of(material: &Material, store: &TextureStore) -> Option<Self> {
        let maps = maps(material);
        // The thickness of glass is irrelevant where rays pass through it; maps of lobes are read with these.
        let others = |m: &MetalRough| usize::from(m.thickness_map.is_some()) + other_maps(m);
        if maps.len() + material.metal_rough().map_or(0, others) < material.textures().count() {
            return None;
        }
        let mut material_maps = Self { groups: Vec::new(), normal_map: None, lobes: Vec::new() };
        if let Some((_, map, _)) = maps.iter().find(|(slot, ..)| matches!(slot, Slot::Normal)) {
            material_maps.group(map)?;
        }
        for (slot, map, space) in maps {
            let group = material_maps.group(map)?;
            if is_cut_out(material) && matches!(slot, Slot::Base | Slot::Opacity) {
                material_maps.groups[group].cuts.push((slot, map.texture));
                if let Slot::Opacity = slot {
                    continue;
                }
            }
            let layout = Layout::of(store, map.texture)?;
            material_maps.groups[group].add(layout, TexelUse::Slot(slot), map.texture, space);
            if let Slot::Normal = slot {
                material_maps.normal_map = Some((map.texture, layout));
            }
        }
        let with_lobes = material.metal_rough().and_then(|m| material_maps.clone().with_lobes(m, store));
        Some(with_lobes.unwrap_or(material_maps))
    }

    /// These maps and those of lobes; `None` where one cannot be read here, or there are too many coordinate sets.
    fn with_lobes(mut self, m: &MetalRough, store: &TextureStore) -> Option<Self> {
        for (map, space) in lobe_maps(m) {
            let layout = Layout::of(store, map.texture)?;
            let group = self.group(map)?;
            self.groups[group].add(layout, TexelUse::Lobe(self.lobes.len()), map.texture, space);
            self.lobes.push((*map, space));
        }
        Some(self)
    }

    /// Maps of lobes that it reads, by their indices in [`LobeTexels`].
    pub(super) fn lobes(&self) -> &[(TextureRef, ColorSpace)] {
        &self.lobes
    }

    /// Group of a map; `None` where there is no room for another.
    fn group(&mut self, map: &TextureRef) -> Option<usize> {
        let is_same = |group: &Group| (group.uv_set, group.transform) == (map.uv_set, map.transform);
        let found = self.groups.iter().position(is_same);
        if found.is_none() && self.groups.len() < GROUPS {
            let turn = Turn::new(&map.transform);
            let (uv_set, transform) = (map.uv_set, map.transform);
            self.groups.push(Group { uv_set, transform, turn, stacks: Vec::new(), cuts: Vec::new() });
            return Some(self.groups.len() - 1);
        }
        found
    }

    /// Whether there is anything to read on a mesh, and the mesh has the attributes it needs.
    pub(super) fn covers(&self, mesh: &Mesh) -> bool {
        let turns = self.normal_map.is_some();
        let colored = !mesh.colors.is_empty();
        (colored || !self.groups.is_empty())
            && (!colored || mesh.colors.len() == mesh.positions.len())
            && self.groups.iter().all(|group| mesh.uvs.len() > group.uv_set as usize)
            && !(turns && mesh.tangents.is_empty())
    }

    /// Whether it needs vertex colours there, or coordinates beyond those of the first group.
    pub(super) fn wants_extras(&self, mesh: &Mesh) -> bool {
        !mesh.colors.is_empty() || self.groups.len() > 1
    }

    /// Coordinates of the corners for the `k`th group, without the offset.
    pub(super) fn coordinates(&self, k: usize, mesh: &Mesh, corners: [u32; 3]) -> [Vec2; 3] {
        let Some(group) = self.groups.get(k) else { return [Vec2::ZERO; 3] };
        let set = mesh.uvs.get(group.uv_set as usize);
        let corner = |i: u32| set.and_then(|set| set.get(i as usize)).map_or(Vec2::ZERO, |&uv| group.turn.apply(uv));
        corners.map(corner)
    }
}

impl Group {
    /// Reads its maps at `points` of these spots; those of lobes and reflectance from `start` on, if they are wanted.
    #[inline(always)]
    fn read<S: Simd>(
        &self,
        s: S,
        store: &TextureStore,
        (places, spots): (&mut Places, &Spots),
        (texels, points): (&mut Texels, usize),
        (of_lobes, start, reads_lobes): (&mut LobeTexels, usize, bool),
    ) {
        for stack in &self.stacks {
            let wanted = |map: &Map| reads_lobes || !map.slots.is_empty();
            if !reads_lobes && !stack.maps.iter().any(wanted) {
                continue;
            }
            places.find(&stack.layout, spots);
            for map in stack.maps.iter().filter(|map| wanted(map)) {
                places.prefetch(s, store, map.texture, map.space);
            }
            for Map { texture, space, slots, lobes } in stack.maps.iter().filter(|map| wanted(map)) {
                let mut read = [Vec4::ONE; LANES];
                places.read(store, *texture, *space, &mut read[..points]);
                slots.iter().for_each(|&slot| texels[slot as usize] = read);
                lobes.iter().for_each(|&lobe| of_lobes[lobe].as_chunks_mut().0[start / LANES] = read);
            }
        }
        if !self.cuts.is_empty() {
            self.cut(store, spots, texels, points);
        }
    }

    /// Reads the opacities of a cut-out material at `points` of these spots.
    #[inline(never)]
    fn cut(&self, store: &TextureStore, spots: &Spots, texels: &mut Texels, points: usize) {
        for &(slot, texture) in &self.cuts {
            let texels = &mut texels[slot as usize];
            if let Slot::Base = slot {
                let alphas = store.channels::<3, LANES>(texture, &spots.uv, points);
                texels.iter_mut().zip(alphas).for_each(|(texel, alpha)| texel.w = alpha);
            } else {
                let opacities = store.channels::<0, LANES>(texture, &spots.uv, points);
                texels.iter_mut().zip(opacities).for_each(|(texel, opacity)| texel.x = opacity);
            }
        }
    }

    fn add(&mut self, layout: Layout, what: TexelUse, texture: u32, space: ColorSpace) {
        let known = self.stacks.iter().position(|stack| stack.layout == layout).unwrap_or_else(|| {
            self.stacks.push(Stack { layout, maps: Vec::new() });
            self.stacks.len() - 1
        });
        let maps = &mut self.stacks[known].maps;
        let known = maps.iter().position(|map| (map.texture, map.space) == (texture, space)).unwrap_or_else(|| {
            maps.push(Map { texture, space, slots: Vec::new(), lobes: Vec::new() });
            maps.len() - 1
        });
        match what {
            TexelUse::Slot(slot) => maps[known].slots.push(slot),
            TexelUse::Lobe(lobe) => maps[known].lobes.push(lobe),
        }
    }
}

/// Maps that batches can read, with their uses.
fn maps(material: &Material) -> Vec<(Slot, &TextureRef, ColorSpace)> {
    let ([metal_rough, transmission], [ambient, specular, shininess]) = match &material.reflection {
        Reflection::MetalRough(m) => ([&m.metal_rough_map, &m.transmission_map].map(Option::as_ref), [None; 3]),
        Reflection::Phong(p) => ([None; 2], [&p.ambient_map, &p.specular_map, &p.shininess_map].map(Option::as_ref)),
        Reflection::Unlit => ([None; 2], [None; 3]),
    };
    let all = [
        (Slot::Base, material.base_color_map.as_ref(), base_space(material)),
        (Slot::Opacity, material.opacity_map.as_ref(), ColorSpace::Linear),
        (Slot::Emission, material.emission_map.as_ref(), ColorSpace::Srgb),
        (Slot::Occlusion, material.occlusion_map.as_ref(), ColorSpace::Linear),
        (Slot::Normal, material.normal_map.as_ref(), ColorSpace::Linear),
        (Slot::MetalRough, metal_rough, ColorSpace::Linear),
        (Slot::Transmission, transmission, ColorSpace::Linear),
        (Slot::Ambient, ambient, ColorSpace::Srgb),
        (Slot::Specular, specular, ColorSpace::Srgb),
        (Slot::Shininess, shininess, ColorSpace::Linear),
    ];
    all.into_iter().filter_map(|(slot, map, space)| Some((slot, map?, space))).collect()
}

/// Maps of lobes and of reflectance with their colour spaces, except the normal map of the clear coat. A map that gives a colour
/// and another value in its alpha is listed once.
fn lobe_maps(m: &MetalRough) -> impl Iterator<Item = (&TextureRef, ColorSpace)> {
    let both = |color, alpha| [(color, ColorSpace::Srgb), (alone(alpha, color), ColorSpace::Linear)];
    let numbers = |maps: [_; 2]| maps.map(|map: &Option<TextureRef>| (map.as_ref(), ColorSpace::Linear));
    let reflectance = both(m.specular_color_map.as_ref(), m.specular_map.as_ref());
    let anisotropy = m.anisotropy.iter().map(|anisotropy| (anisotropy.map.as_ref(), ColorSpace::Linear));
    let iridescence = m.iridescence.iter().flat_map(move |iridescence| numbers(iridescence.maps()));
    let sheen = m.sheen.iter().flat_map(move |sheen| both(sheen.color_map.as_ref(), sheen.roughness_map.as_ref()));
    let coat = m.coat.iter().flat_map(move |coat| numbers([&coat.strength_map, &coat.roughness_map]));
    let through = m.diffuse_transmission.iter().flat_map(move |t| both(t.color_map.as_ref(), t.share_map.as_ref()));
    let all = reflectance.into_iter().chain(through).chain(anisotropy).chain(iridescence).chain(sheen).chain(coat);
    all.filter_map(|(map, space)| Some((map?, space)))
}

/// A map whose alpha is used, if its colour is not read anyway.
fn alone<'a>(alpha: Option<&'a TextureRef>, color: Option<&TextureRef>) -> Option<&'a TextureRef> {
    alpha.filter(|_| alpha != color)
}

impl ShadingBatch {
    /// Reads maps and vertex colours at the points of a placed mesh, and turns their normals. If highlights are widened
    /// (`widens`), also computes by how much a normal map turns them.
    pub(super) fn read_material_maps(
        &mut self,
        context: &Context,
        material: &Material,
        material_maps: &MaterialMaps,
        PlacedMesh { mesh, placement }: PlacedMesh,
        widens: bool,
    ) {
        let count = self.count.min(POINTS);
        let (smooth, colored) = (!mesh.normals.is_empty(), !mesh.colors.is_empty());
        let Self { given, found, painted, of_lobes, cones, places, level, .. } = self;
        let store = context.textures;
        let reach = context.highlight_reach;
        let turns = material_maps.normal_map.as_ref().filter(|_| widens).map(|map| (map, reach));
        let front = &found.front;
        // Lobes lie on the outside; reflectance counts on both sides.
        let outside_alone = has_inside(material) && !material.metal_rough().is_some_and(reads_reflectance);
        level.run(Read {
            material_maps,
            material,
            store,
            given,
            front,
            outside_alone,
            cones,
            painted,
            of_lobes,
            places,
            turns,
            colored,
            count,
        });
        if material_maps.normal_map.is_some() {
            let points = padded(count);
            let scale = material.normal_scale;
            let turn = material.normal_map.as_ref().and_then(|map| FrameTurn::new(mesh.tangents_along, map));
            level.run(TurnNormals { given, found, painted, points, placement, smooth, scale, turn });
        }
    }
}

struct Read<'a> {
    material_maps: &'a MaterialMaps,
    material: &'a Material,
    store: &'a TextureStore<'a>,
    given: &'a HitData,
    front: &'a [u32; POINTS],
    /// Whether maps of lobes count only where fronts are seen.
    outside_alone: bool,
    cones: &'a mut Cones,
    painted: &'a mut Painted,
    of_lobes: &'a mut LobeTexels,
    places: &'a mut Places,
    /// The normal map, and the reach within which its changes count.
    turns: Option<(&'a (u32, Layout), f32)>,
    colored: bool,
    count: usize,
}

impl Kernel for Read<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self {
            material_maps,
            material,
            store,
            given,
            front,
            outside_alone,
            cones,
            painted,
            of_lobes,
            places,
            turns,
            colored,
            count,
        } = self;
        for start in (0..count.min(POINTS)).step_by(LANES) {
            let mut spots = Spots::default();
            let mut texels: Texels = [[Vec4::ONE; LANES]; SLOTS];
            let points = (count - start).min(LANES);
            let reads_lobes = !outside_alone || front[start..start + points].contains(&1);
            if let Some(group) = material_maps.groups.first() {
                spread(&mut spots, given, cones, start, group.transform.offset, |i| given.faces.uvs(i));
                group.read(s, store, (places, &spots), (&mut texels, points), (of_lobes, start, reads_lobes));
            }
            for group in material_maps.groups.iter().skip(1) {
                let mut spots = Spots::default();
                spread(&mut spots, given, cones, start, group.transform.offset, |i| given.faces.other_uvs(i));
                group.read(s, store, (places, &spots), (&mut texels, points), (of_lobes, start, reads_lobes));
            }
            for i in start..start + points {
                let vertex =
                    if colored { mixed_color(given.faces.colors(i), given.corner_weights(i)) } else { Vec4::ONE };
                inputs(painted, i, material, vertex, |slot| texels[slot as usize][i - start]);
            }
            if let Some(((texture, layout), reach)) = turns {
                let mut narrow = [false; LANES];
                (0..points).for_each(|lane| narrow[lane] = painted.has_narrow_highlight(start + lane));
                if narrow != [false; LANES] {
                    let [along, across] = changes(store, *texture, layout, &spots, reach, narrow);
                    for lane in 0..points {
                        cones.turning[start + lane] = turning_of([along[lane], across[lane]], material.normal_scale);
                    }
                }
            }
        }
    }
}

/// Computes the coordinates and footprints of eight points from `start` on, from the coordinates of the corners.
#[inline(always)]
fn spread(
    spots: &mut Spots,
    given: &HitData,
    cones: &Cones,
    start: usize,
    offset: Vec2,
    uvs: impl Fn(usize) -> [Vec2; 3],
) {
    for lane in 0..LANES {
        let i = start + lane;
        let [a, b, c] = uvs(i);
        let [along, across] = given.faces.gradients(i).of_coordinates([b - a, c - a], &cones.footprint(i));
        let uv = given.mix(i, [a, b, c]) + offset;
        (spots.uv[0][lane], spots.uv[1][lane]) = (uv.x, uv.y);
        (spots.along[0][lane], spots.along[1][lane]) = (along.x, along.y);
        (spots.across[0][lane], spots.across[1][lane]) = (across.x, across.y);
    }
}

/// Computes the material at a point from its maps and vertex colour.
#[inline(always)]
fn inputs(painted: &mut Painted, i: usize, material: &Material, vertex: Vec4, texel: impl Fn(Slot) -> Vec4) {
    let base = base_color(material, texel(Slot::Base), texel(Slot::Opacity).x, vertex);
    painted.coverage[i] = material.alpha_mode.covers(base.w);
    let base = base.truncate();
    painted.put_emission(i, material.emission * texel(Slot::Emission).truncate());
    painted.put_normal_texel(i, texel(Slot::Normal).truncate());
    match &material.reflection {
        Reflection::Unlit => painted.put_unlit(i, base),
        Reflection::Phong(p) => {
            let [ambient, specular] = [Slot::Ambient, Slot::Specular].map(|slot| texel(slot).truncate());
            painted.put_phong(i, PhongInputs::of(p, base, (ambient, specular, texel(Slot::Shininess).x)));
        }
        Reflection::MetalRough(m) => {
            let open = occlusion(material, texel(Slot::Occlusion).x);
            painted.put_metal_rough(
                i,
                MetalRoughInputs::of(m, base, open, [Slot::MetalRough, Slot::Transmission].map(texel).into()),
            );
        }
    }
}

/// Kernel that turns normals by the texels of a normal map.
struct TurnNormals<'a> {
    given: &'a HitData,
    found: &'a mut Found,
    painted: &'a Painted,
    points: usize,
    placement: &'a Placement,
    smooth: bool,
    scale: f32,
    turn: Option<FrameTurn>,
}

impl Kernel for TurnNormals<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { given, found, painted, points, placement, smooth, scale, turn } = self;
        let placement = *placement;
        let mut turns = Turns::default();
        if smooth {
            turns.turn_smooth(given, painted, points, &placement, scale, turn);
        } else {
            turns.turn_flat(given, painted, points, &placement, scale, turn);
        }
        for i in 0..points.min(POINTS) {
            let geometric = get(&found.geometric, i);
            let side = side_of(get(&turns.own, i), geometric);
            put(&mut found.normal, i, facing(get(&turns.turned, i) * side, geometric, get(&found.view, i)));
            // Without a tangent it would need the coordinates around.
            found.certain[i] &= turns.has_tangent[i];
        }
    }
}

/// Steps from a mesh's own normal to the turned one: in columns that cannot alias, so that compilers vectorise each loop.
struct Turns {
    own: Columns,
    tangent: Columns,
    bitangent: Columns,
    turned: Columns,
    /// 1 where there is a usable tangent.
    has_tangent: [u32; POINTS],
}

impl Default for Turns {
    fn default() -> Self {
        let three = [[0.0; POINTS]; 3];
        Self { own: three, tangent: three, bitangent: three, turned: three, has_tangent: [0; POINTS] }
    }
}

impl Turns {
    /// Turns interpolated normals in the frames in which maps are baked.
    #[inline(always)]
    fn turn_smooth(
        &mut self,
        given: &HitData,
        painted: &Painted,
        points: usize,
        placement: &Placement,
        scale: f32,
        turn: Option<FrameTurn>,
    ) {
        for i in 0..points.min(POINTS) {
            put(&mut self.own, i, given.own_normal(placement, i));
        }
        for i in 0..points.min(POINTS) {
            let frame = given.baked_frame(i);
            put(&mut self.tangent, i, frame.tangent);
            put(&mut self.bitangent, i, frame.bitangent);
        }
        if let Some(turn) = turn {
            for i in 0..points.min(POINTS) {
                let (tangent, bitangent) = (get(&self.tangent, i), get(&self.bitangent, i));
                let frame = turn.apply_to_baked(BakedFrame { normal: Vec3::ZERO, tangent, bitangent });
                put(&mut self.tangent, i, frame.tangent);
                put(&mut self.bitangent, i, frame.bitangent);
            }
        }
        for i in 0..points.min(POINTS) {
            let normal = given.mix(i, given.faces.normals(i));
            let frame = BakedFrame { normal, tangent: get(&self.tangent, i), bitangent: get(&self.bitangent, i) };
            self.has_tangent[i] = u32::from(frame.is_valid());
            let turned = smooth_normal(placement, frame.decode(painted.normal_texel(i), scale));
            put(&mut self.turned, i, turned.unwrap_or(get(&self.own, i)));
        }
    }

    /// Turns normals of faces in frames that are perpendicular to them.
    #[inline(always)]
    fn turn_flat(
        &mut self,
        given: &HitData,
        painted: &Painted,
        points: usize,
        placement: &Placement,
        scale: f32,
        turn: Option<FrameTurn>,
    ) {
        for i in 0..points.min(POINTS) {
            let own = given.faces.outward(i);
            let tangent = given_tangent(placement, given.mix(i, given.faces.tangents(i)), own);
            let (tangent, sign) = tangent.unwrap_or((Vec3::NAN, 1.0));
            let (tangent, sign) = turn.map_or((tangent, sign), |turn| turn.apply(tangent, sign, own));
            put(&mut self.own, i, own);
            put(&mut self.tangent, i, tangent);
            put(&mut self.bitangent, i, own.cross(tangent) * sign);
            self.has_tangent[i] = u32::from(tangent.x.is_finite());
        }
        for i in 0..points.min(POINTS) {
            let (own, frame) = (get(&self.own, i), [get(&self.tangent, i), get(&self.bitangent, i)]);
            let turned = turned_by_texel(own, frame, painted.normal_texel(i), scale).unwrap_or(own);
            put(&mut self.turned, i, turned);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bitmap, Pixels, Sampler, Scene, Texture};

    #[test]
    fn maps_with_two_kinds_of_coordinates_are_read_together_and_those_with_three_are_not() {
        let pixels = Pixels::Rgb8(vec![90; 3].into());
        let scene = Scene {
            bitmaps: vec![Bitmap { name: String::new(), width: 1, height: 1, pixels }],
            textures: vec![Texture { bitmap: 0, sampler: Sampler::default() }],
            ..Scene::default()
        };
        let store = TextureStore::new(&scene);
        let map = |uv_set| Some(TextureRef { texture: 0, uv_set, transform: UvTransform::default() });
        let material = |sets: [u32; 3]| Material {
            base_color_map: map(sets[0]),
            emission_map: map(sets[1]),
            normal_map: map(sets[2]),
            ..Material::plain()
        };
        let groups = |sets| MaterialMaps::of(&material(sets), &store).map(|material_maps| material_maps.groups.len());
        assert_eq!([[1; 3], [0, 1, 0], [0, 1, 2]].map(groups), [Some(1), Some(2), None]);
        let material_maps = MaterialMaps::of(&material([0, 0, 1]), &store).expect("two");
        assert!(material_maps.normal_map.is_some() && material_maps.groups[0].uv_set == 1, "it comes first");
        let mut mesh = Mesh { positions: vec![Vec3::ZERO], uvs: vec![vec![Vec2::ZERO]], ..Mesh::default() };
        mesh.tangents = vec![Vec4::X];
        assert!(!material_maps.covers(&mesh), "it has one kind");
        mesh.uvs.push(vec![Vec2::ONE]);
        assert!(material_maps.covers(&mesh) && material_maps.wants_extras(&mesh));
        mesh.colors = vec![Vec4::ONE; 2];
        assert!(!material_maps.covers(&mesh), "not a colour for each corner");
        let bare = MaterialMaps::of(&Material::plain(), &store).expect("nothing to read");
        mesh.colors.pop();
        assert!(bare.covers(&mesh) && bare.wants_extras(&mesh));
        mesh.colors.clear();
        assert!(!bare.covers(&mesh), "nothing");
    }
}
