//! Gaps in cut-out or blended surfaces, known without shading: rays pass them during traversal. And solid parts, which stop
//! shadow rays.
//!
//! Most hits in a tree are the clear parts of its leaves. Where a map is clear as far around as a lookup may read ([`Survey`]),
//! it need not be read, and the ray need not stop. Other hits are shaded, with the same outcome: a gap is passed as if it were
//! not there, so that pictures are the same bit by bit. Counted runs stop at all of them.

mod face;
#[cfg(test)]
mod tests;

use super::patch::Turn;
use super::shade::is_cut_out;
use super::texture::{Codes, Survey, TextureStore};
use super::wave::{Path, Wave};
use super::world::{PrimSource, World, code, least_solid};
use crate::accel::{Hit, IntersectFilter, Ray};
use crate::math::simd::{LANES, Level};
use crate::math::{Vec2, Vec4};
use crate::scene::{AlphaMode, Instance, Material, Mesh, Scene, TextureRef};
use bytemuck::Zeroable;
use face::{Eight, Face, Rays, Sight};
use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// Number of rays that must hit faces before surveying the maps is worth it: a minimum, plus one for every so many texels and
/// every so many faces, a large part of which will not be hit twice.
const ENOUGH: usize = 1 << 12;
const TEXELS: usize = 1 << 8;
const FACES: usize = 1 << 3;

/// Maximum number of faces that are kept: beyond it each is computed when it is hit.
const MOST: usize = 1 << 20;

/// Distance, relative to the numbers that positions are computed from, within which a surface may be hit again.
const NEAR: f32 = 1e-3;

/// Surfaces of a scene that have gaps.
#[derive(Debug)]
pub(crate) struct AlphaVoids<'a> {
    scene: &'a Scene,
    world: &'a World,
    textures: &'a TextureStore<'a>,
    /// Masked meshes, by mesh index.
    masked_meshes: Vec<Option<MaskedMesh<'a>>>,
    /// Runs of stored prims that are faces of masked meshes, in order, each with the number of such prims before it.
    runs: Vec<(Range<u32>, usize)>,
    count: usize,
    maps: OnDemand<Maps>,
    /// In the order of the runs. Computing all is worth it once as many rays have hit any.
    faces: OnDemand<Vec<Face>>,
}

/// A value computed after enough requests; until then, and while a thread computes it, callers do without.
#[derive(Debug)]
struct OnDemand<T> {
    enough: usize,
    asked: AtomicUsize,
    taken: AtomicBool,
    found: OnceLock<T>,
}

impl<T> OnDemand<T> {
    fn after(enough: usize) -> Self {
        Self { enough, asked: AtomicUsize::new(0), taken: AtomicBool::new(false), found: OnceLock::new() }
    }

    /// A value that is never computed.
    fn never() -> Self {
        Self { taken: AtomicBool::new(true), ..Self::after(usize::MAX) }
    }

    /// Returns the value, if it is computed or these `rays` complete the number of requests for it.
    fn get(&self, rays: usize, find: impl FnOnce() -> T) -> Option<&T> {
        if let Some(found) = self.found.get() {
            return Some(found);
        }
        if self.taken.load(Ordering::Relaxed)
            || self.asked.fetch_add(rays, Ordering::Relaxed) < self.enough
            || self.taken.swap(true, Ordering::Relaxed)
        {
            return None;
        }
        Some(self.found.get_or_init(find))
    }
}

/// The map that decides about a material's opacity.
#[derive(Clone, Copy, Debug)]
struct Cut<'a> {
    map: &'a TextureRef,
    channel: usize,
    /// Highest code of a gap, and lowest code of a solid part.
    codes: Codes,
    one_sided: bool,
    /// Whether the map is always read at full resolution.
    sharp: bool,
}

/// A mesh that a map cuts out.
#[derive(Clone, Copy, Debug)]
struct MaskedMesh<'a> {
    cut: Cut<'a>,
    mesh: &'a Mesh,
    uvs: &'a [Vec2],
    turn: Turn,
    /// Size of the map, in texels.
    texels: Vec2,
}

/// Surveys of the maps.
#[derive(Debug)]
struct Maps {
    surveys: Vec<Arc<Option<Survey>>>,
    /// Index of the survey of each mesh, if it has one.
    of_meshes: Vec<Option<u32>>,
}

impl<'a> AlphaVoids<'a> {
    /// `None` for a scene in which no map cuts anything out.
    pub(crate) fn of(scene: &'a Scene, world: &'a World, textures: &'a TextureStore<'a>) -> Option<Self> {
        let of_materials: Vec<_> = scene.materials.iter().map(Cut::of).collect();
        if of_materials.iter().all(Option::is_none) {
            return None;
        }
        let of_mesh = |mesh: &'a Mesh| of_materials[mesh.material as usize].and_then(|cut| cut.on(mesh, textures));
        let masked_meshes: Vec<_> = scene.meshes.iter().map(of_mesh).collect();
        if masked_meshes.iter().all(Option::is_none) {
            return None;
        }
        let of_instance = |(i, instance): (u32, &Instance)| {
            masked_meshes[instance.mesh as usize].as_ref()?;
            Some(world.triangles_of(i)).filter(|prims| !prims.is_empty() && world.is_stored(prims.start))
        };
        let (mut runs, mut count): (Vec<(Range<u32>, usize)>, _) = (Vec::new(), 0);
        for prims in (0..).zip(&scene.instances).filter_map(of_instance) {
            let more = prims.len();
            match runs.last_mut() {
                Some((last, _)) if last.end == prims.start => last.end = prims.end,
                _ => runs.push((prims, count)),
            }
            count += more;
        }
        let distinct: HashSet<_> = masked_meshes.iter().flatten().map(|masked_mesh| masked_mesh.cut.what()).collect();
        let texels = distinct.into_iter().map(|(map, ..)| textures.size(map)).map(|size| (size.x * size.y) as usize);
        let enough = ENOUGH + count / FACES + texels.sum::<usize>() / TEXELS;
        Some(Self {
            scene,
            world,
            textures,
            masked_meshes,
            runs,
            count,
            maps: OnDemand::after(enough),
            faces: if count > MOST { OnDemand::never() } else { OnDemand::after(count) },
        })
    }

    /// Filter of hits for rays with these cones.
    pub(super) fn filter<'r>(&'r self, rays: &'r [Ray], cones: Cones<'r>) -> AlphaFilter<'r, 'a> {
        AlphaFilter { alpha_voids: self, rays, cones }
    }

    /// Whether a ray that looks for its first hit certainly meets a gap of prim `prim` where it hits that.
    fn rejects(&self, sight: &Sight, prim: u32) -> bool {
        let known = self.face(prim, 1).filter(|(_, map)| map.has_gaps());
        known.is_some_and(|(face, map)| face.sure(map, &Rays::new([*sight], true)).clear == 1)
    }

    /// Whether prim `prim` stops a shadow ray where that hits it, or lets it through, with maps read at full resolution; `None`
    /// where that is uncertain.
    pub(super) fn stops(&self, ray: &Ray, prim: u32) -> Option<bool> {
        let (face, map) = self.face(prim, 1)?;
        let sight = Sight { ray, cone: [0.0; 2], from: f32::NEG_INFINITY };
        let sure = face.sure(map, &Rays::new([sight], false));
        (sure.clear | sure.solid == 1).then_some(sure.solid == 1)
    }

    /// Face of a prim that `rays` rays have hit, and the survey of its map.
    #[inline]
    fn face(&self, prim: u32, rays: usize) -> Option<(Face, &Survey)> {
        let maps = self.maps.get(rays, || self.survey())?;
        let run = self.runs.get(self.runs.partition_point(|(run, _)| run.end <= prim));
        let face = match run.filter(|(run, _)| run.start <= prim) {
            Some((run, before)) => match self.faces.get(rays, || self.all_faces(maps)) {
                Some(faces) => *faces.get(before + (prim - run.start) as usize)?,
                None => self.make(maps, prim)?,
            },
            None if self.world.instanced.is_empty() => return None,
            None => self.make(maps, prim)?,
        };
        let survey = (**maps.surveys.get((face.map as usize).checked_sub(1)?)?).as_ref()?;
        Some((face, survey))
    }

    /// Face of a prim; `None` unless it belongs to a masked mesh.
    #[inline(never)]
    fn make(&self, maps: &Maps, prim: u32) -> Option<Face> {
        let PrimSource::Triangle { instance, triangle } = self.world.source(prim) else { return None };
        let mesh = self.scene.instances[instance as usize].mesh as usize;
        let (masked_mesh, map) = (self.masked_meshes[mesh].as_ref()?, maps.of_meshes[mesh]?);
        Option::as_ref(&maps.surveys[map as usize])?;
        masked_mesh.face(self.world, instance, triangle, prim, map)
    }

    fn all_faces(&self, maps: &Maps) -> Vec<Face> {
        let mut faces = Vec::with_capacity(self.count);
        let prims = self.runs.iter().flat_map(|(run, _)| run.clone());
        faces.extend(prims.map(|prim| self.make(maps, prim).unwrap_or(Face::zeroed())));
        faces
    }

    fn survey(&self) -> Maps {
        let (mut known, mut surveys) = (HashMap::new(), Vec::new());
        let mut number = |cut: &Cut| {
            *known.entry(cut.what()).or_insert_with_key(|&(texture, channel, codes)| {
                surveys.push(self.textures.survey(texture, channel, codes));
                surveys.len() as u32 - 1
            })
        };
        let of_meshes = self.masked_meshes.iter().map(|masked_mesh| Some(number(&masked_mesh.as_ref()?.cut))).collect();
        Maps { surveys, of_meshes }
    }
}

impl MaskedMesh<'_> {
    /// Face of a triangle of an instance, with its prim, on the map with this index.
    fn face(&self, world: &World, instance: u32, triangle: u32, prim: u32, map: u32) -> Option<Face> {
        let Self { cut, mesh, uvs, turn, texels } = *self;
        let corner = |i: u32| uvs.get(i as usize).map_or(Vec2::NAN, |&uv| turn.apply(uv) * texels);
        let uv = mesh.triangles[triangle as usize].map(corner);
        let outward = if world.placement(instance).mirrored { -1.0 } else { 1.0 };
        let face = Face::new(world.triangle(prim), uv, cut.map.transform.offset * texels, outward)?;
        Some(face.cut_by(map + 1, [cut.one_sided, cut.sharp]))
    }
}

impl<'a> Cut<'a> {
    fn of(material: &'a Material) -> Option<Self> {
        let most = most(material)?;
        let is_number = material.opacity.is_finite() && material.base_color.is_finite();
        if material.reflection.transmits() || !is_number {
            return None;
        }
        let least = least_solid(material).map_or(Self::NEVER, |least| code(least, 255));
        // Either map alone can make a gap, whatever the other holds.
        let (map, channel, least) = match (&material.opacity_map, &material.base_color_map) {
            (Some(map), Some(_)) => (map, 0, Self::NEVER),
            (Some(map), None) => (map, 0, least),
            (None, Some(map)) => (map, 3, least),
            (None, None) => return None,
        };
        Some(Self {
            map,
            channel,
            codes: Codes { most, least },
            one_sided: !material.double_sided,
            sharp: is_cut_out(material),
        })
    }

    /// Higher than any code.
    const NEVER: u16 = 256;

    /// Map, channel and codes: what a survey is made for.
    fn what(&self) -> (u32, usize, Codes) {
        (self.map.texture, self.channel, self.codes)
    }

    /// Masks a mesh, if it has the map's coordinates, and no vertex colour makes it more opaque than the map does.
    fn on(self, mesh: &'a Mesh, textures: &TextureStore) -> Option<MaskedMesh<'a>> {
        let uvs = mesh.uvs.get(self.map.uv_set as usize)?;
        let is_part = |color: &Vec4| color.cmpge(Vec4::ZERO).all() && color.cmple(Vec4::ONE).all();
        let is_whole = mesh.colors.iter().all(|color| color.w == 1.0);
        let least = if is_whole { self.codes.least } else { Self::NEVER };
        let cut = Self { codes: Codes { least, ..self.codes }, ..self };
        let (turn, texels) = (Turn::new(&self.map.transform), textures.size(self.map.texture));
        mesh.colors.iter().all(is_part).then_some(MaskedMesh { cut, mesh, uvs, turn, texels })
    }
}

/// Highest 8-bit code of a map that makes a gap in a material, if there is one.
fn most(material: &Material) -> Option<u8> {
    match material.alpha_mode {
        AlphaMode::Opaque => None,
        AlphaMode::Blend => Some(0),
        AlphaMode::Mask { cutoff } => {
            /// Far more than the rounding of the mean of four texels.
            const ROUNDED: f32 = 1e-3;
            let is_hole = |code: &u8| material.opacity * (f32::from(*code) / 255.0 + ROUNDED) < cutoff;
            (0..=u8::MAX).take_while(is_hole).last()
        }
    }
}

/// Cones around rays, by index.
#[derive(Clone, Copy)]
pub(super) enum Cones<'r> {
    /// Widths and growths of primary rays.
    PrimaryRays([&'r [f32]; 2]),
    /// Paths of rays that start, and the hits that they start from.
    Starting(&'r [Path], &'r [Hit]),
    /// Paths of rays of a wave that go on.
    Continuing(&'r [Path]),
}

impl<'r> From<&'r Wave> for Cones<'r> {
    fn from(Wave { starts, paths, after, .. }: &'r Wave) -> Self {
        if *starts { Self::Starting(paths, after) } else { Self::Continuing(paths) }
    }
}

/// Filter that passes gaps, for rays that look for surfaces.
pub(super) struct AlphaFilter<'r, 'a> {
    alpha_voids: &'r AlphaVoids<'a>,
    rays: &'r [Ray],
    cones: Cones<'r>,
}

impl AlphaFilter<'_, '_> {
    /// A ray with its cone.
    #[inline]
    fn sight(&self, ray: usize) -> Sight<'_> {
        let of = |path: &Path, before: &Hit| {
            let Ray { origin, .. } = &self.rays[ray];
            let near = (before.t.abs() + origin.abs().max_element()) * NEAR;
            let from = if before.is_some() { before.t + near } else { f32::NEG_INFINITY };
            (path.cone_width, path.cone_spread, from)
        };
        let (width, spread, from) = match self.cones {
            Cones::PrimaryRays([width, spread]) => (width[ray], spread[ray], f32::NEG_INFINITY),
            Cones::Starting(paths, after) => of(&paths[ray], &after[ray]),
            Cones::Continuing(paths) => of(&paths[ray], &paths[ray].crossed),
        };
        Sight { ray: &self.rays[ray], cone: [width, spread], from }
    }
}

impl IntersectFilter for AlphaFilter<'_, '_> {
    fn rejects(&self, ray: usize, prim: u32) -> bool {
        self.alpha_voids.rejects(&self.sight(ray), prim)
    }

    fn rejects_of(&self, first: usize, rays: u32, prim: u32) -> u32 {
        let (mut left, mut passing) = (rays, 0);
        let known = self.alpha_voids.face(prim, rays.count_ones() as usize);
        let Some((face, map)) = known.filter(|(_, map)| map.has_gaps()) else { return 0 };
        while left != 0 {
            // The next eight rays, adjacent or not.
            let (mut numbers, mut count) = ([left.trailing_zeros(); LANES], 0);
            while left != 0 && count < LANES {
                numbers[count] = left.trailing_zeros();
                left &= left - 1;
                count += 1;
            }
            let clear = if count == 1 {
                face.sure(map, &Rays::new([self.sight(first + numbers[0] as usize)], true)).clear
            } else {
                let rays = Rays::new(numbers.map(|number| self.sight(first + number as usize)), true);
                Level::best().run_narrow(Eight(&face, map, rays)).clear
            };
            for (i, number) in numbers.iter().enumerate().take(count) {
                passing |= (clear >> i & 1) << number;
            }
        }
        passing
    }
}
