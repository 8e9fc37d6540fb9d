//! Gaps of materials that are cut out or blended, known without shading: rays from the eye pass them on their way.
//!
//! Most of what rays meet in a tree are the clear parts of its leaves. Where a map is clear all around ([`Clear`]) it need not
//! be read, and the ray need not stop there. What is not that sure is shaded, with the same outcome.

use super::patch::{Footprint, Gradients, Turn};
use super::texture::{Clear, TextureStore};
use super::wave::Path;
use super::world::World;
use crate::accel::{Gaps, Ray};
use crate::math::{Vec2, Vec3};
use crate::scene::{AlphaMode, Instance, Material, Mesh, Scene, TextureRef};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Questions before it is worth finding out where maps are clear: some, and one for so many faces.
const ENOUGH: usize = 1 << 12;
const SHARE: usize = 8;

/// No more faces are looked at.
const MOST: usize = 1 << 20;

/// Where a ray grazes a face more than this, the cosine, nothing is known: how wide its cone is there depends on roundings.
const GRAZING: f32 = 0.02;

/// Error of a place on a face that a ray meets under a right angle, in parts of the largest number it is made from; more
/// than all roundings.
const ROUNDING: f32 = 4e-6;

/// Error of coordinates, texels, beside that.
const BLUR: f32 = 0.05;

/// What of a scene has gaps, and where.
#[derive(Debug)]
pub(crate) struct Clearings<'a> {
    scene: &'a Scene,
    world: &'a World,
    textures: &'a TextureStore<'a>,
    /// By material: what cuts it out.
    cuts: Vec<Option<Cut<'a>>>,
    /// Faces of such materials, and the prims among which they are.
    count: usize,
    prims: Range<u32>,
    asked: AtomicUsize,
    taken: AtomicBool,
    found: OnceLock<Found>,
}

/// The map that decides where a material is.
#[derive(Clone, Copy, Debug)]
struct Cut<'a> {
    map: &'a TextureRef,
    channel: usize,
    /// What is stored there at most where the material is not.
    most: u8,
    one_sided: bool,
}

/// What is known of a material.
#[derive(Debug)]
struct Known {
    clear: Clear,
    one_sided: bool,
}

#[derive(Debug)]
struct Found {
    /// By material.
    known: Vec<Option<Known>>,
    /// By prim, from the first of them on.
    faces: Vec<Face>,
}

/// A face and how coordinates run along it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Face {
    /// Outward, of unit length, and where its plane is.
    normal: Vec3,
    place: f32,
    /// How both coordinates grow, texels by world units, and what they are at the origin.
    along: [Vec3; 2],
    at: Vec2,
    /// How fast they grow at most.
    growth: f32,
    /// Its material and one; 0: nothing is known.
    material: u32,
}

impl<'a> Clearings<'a> {
    /// `None` for a scene in which no map cuts anything out, or so much that it would take long to find out.
    pub(crate) fn of(scene: &'a Scene, world: &'a World, textures: &'a TextureStore<'a>) -> Option<Self> {
        let cuts: Vec<_> = scene.materials.iter().map(Cut::of).collect();
        if cuts.iter().all(Option::is_none) || !world.kept.is_empty() {
            return None;
        }
        let of_instance = |(i, instance): (u32, &Instance)| {
            let mesh = &scene.meshes[instance.mesh as usize];
            cuts[mesh.material as usize]?.coordinates(mesh)?;
            Some(world.triangles_of(i)).filter(|prims| !prims.is_empty())
        };
        let all: Vec<Range<u32>> = (0..).zip(&scene.instances).filter_map(of_instance).collect();
        let (first, last) = (all.first()?.start, all.last()?.end);
        let count = all.iter().map(Range::len).sum();
        (count > 0 && count <= MOST).then(|| Self {
            scene,
            world,
            textures,
            cuts,
            count,
            prims: first..last,
            asked: AtomicUsize::new(0),
            taken: AtomicBool::new(false),
            found: OnceLock::new(),
        })
    }

    /// What rays with these cones around them find.
    pub(super) fn before<'r>(&'r self, rays: &'r [Ray], cones: Cones<'r>) -> Before<'r, 'a> {
        Before { clearings: self, rays, cones }
    }

    /// Whether a ray meets prim `prim`, if it does, where nothing is for certain; of a cone, its width at the start and its
    /// growth, or of maps as sharp as they are.
    pub(super) fn is_clear(&self, ray: &Ray, prim: u32, cone: Option<[f32; 2]>) -> bool {
        let Some(i) = prim.checked_sub(self.prims.start) else { return false };
        let Some(Found { known, faces }) = self.find() else { return false };
        let Some(face) = faces.get(i as usize) else { return false };
        let known = known.get((face.material as usize).wrapping_sub(1)).and_then(Option::as_ref);
        known.is_some_and(|known| face.is_clear(known, ray, cone))
    }

    /// Where gaps are, once it was asked often enough.
    fn find(&self) -> Option<&Found> {
        if let Some(found) = self.found.get() {
            return Some(found);
        }
        let asked = self.asked.fetch_add(1, Ordering::Relaxed);
        if asked < ENOUGH + self.count / SHARE || self.taken.swap(true, Ordering::Relaxed) {
            return None;
        }
        Some(self.found.get_or_init(|| self.survey()))
    }

    fn survey(&self) -> Found {
        let Self { scene, world, textures, .. } = self;
        let of_cut = |cut: &Option<Cut>| {
            let Cut { map, channel, most, one_sided } = (*cut)?;
            Some(Known { clear: Clear::of(textures, map.texture, channel, most)?, one_sided })
        };
        let known: Vec<Option<Known>> = self.cuts.iter().map(of_cut).collect();
        // What nothing is written to takes no memory.
        let mut faces: Vec<Face> = bytemuck::zeroed_vec(self.prims.len());
        for (instance, placed) in (0..).zip(&scene.instances) {
            let mesh = &scene.meshes[placed.mesh as usize];
            let (Some(cut), Some(known)) = (self.cuts[mesh.material as usize], &known[mesh.material as usize]) else {
                continue;
            };
            let Some(uvs) = cut.coordinates(mesh) else { continue };
            let (turn, size) = (Turn::new(&cut.map.transform), known.clear.size());
            let outward = if world.placement(instance).mirrored { -1.0 } else { 1.0 };
            for (prim, corners) in world.triangles_of(instance).zip(&mesh.triangles) {
                let uv = corners.map(|i| uvs.get(i as usize).map_or(Vec2::NAN, |&uv| turn.apply(uv)) * size);
                if let Some(face) = Face::new(world.triangle(prim), uv, cut.map.transform.offset * size, outward) {
                    faces[(prim - self.prims.start) as usize] = Face { material: mesh.material + 1, ..face };
                }
            }
        }
        Found { known, faces }
    }
}

impl<'a> Cut<'a> {
    fn of(material: &'a Material) -> Option<Self> {
        let most = most(material)?;
        if material.reflection.transmits() {
            return None;
        }
        // Each says so by itself, whatever the other says.
        let (map, channel) = match (&material.opacity_map, &material.base_color_map) {
            (Some(map), _) => (map, 0),
            (None, Some(map)) => (map, 3),
            (None, None) => return None,
        };
        Some(Self { map, channel, most, one_sided: !material.double_sided })
    }

    /// Where a mesh has its map, if nothing else says how opaque it is.
    fn coordinates<'m>(&self, mesh: &'m Mesh) -> Option<&'m [Vec2]> {
        let uvs = mesh.uvs.get(self.map.uv_set as usize).filter(|_| mesh.colors.is_empty())?;
        Some(uvs.as_slice())
    }
}

/// Of 8 bits the highest code of a map with which a material is not there, if there is one.
fn most(material: &Material) -> Option<u8> {
    match material.alpha_mode {
        AlphaMode::Opaque => None,
        AlphaMode::Blend => Some(0),
        AlphaMode::Mask { cutoff } => {
            /// Means in smaller copies are rounded, at most by this.
            const ROUNDED: f32 = 1e-3;
            let is_hole = |code: &u8| material.opacity * (f32::from(*code) / 255.0 + ROUNDED) < cutoff;
            (0..=u8::MAX).take_while(is_hole).last()
        }
    }
}

impl Face {
    /// That of a triangle with these coordinates, texels, at its corners, to which an offset is added; `None` where they tell
    /// nothing of use.
    fn new(corners: [Vec3; 3], uv: [Vec2; 3], offset: Vec2, outward: f32) -> Option<Self> {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).try_normalize()? * outward;
        let Gradients { second, third } = Gradients::new(corners);
        let edges = [uv[1] - uv[0], uv[2] - uv[0]];
        let along = [0, 1].map(|k: usize| second * edges[0][k] + third * edges[1][k]);
        let at = uv[0] + offset - Vec2::new(along[0].dot(a), along[1].dot(a));
        let growth = (along[0].length_squared() + along[1].length_squared()).sqrt();
        let face = Self { normal, place: normal.dot(a), along, at, growth, material: 0 };
        (growth.is_finite() && at.is_finite() && normal.is_finite()).then_some(face)
    }

    /// Whether a map is clear all around where a ray meets the plane.
    #[inline]
    fn is_clear(&self, Known { clear, one_sided }: &Known, ray: &Ray, cone: Option<[f32; 2]>) -> bool {
        let length = ray.dir.length();
        let (dir, slope) = (ray.dir / length, self.normal.dot(ray.dir) / length);
        // Backs of one-sided faces are passed, too, but as something that is there.
        if slope.abs() < GRAZING || cone.is_some() && *one_sided && slope > 0.0 {
            return false;
        }
        let distance = (self.place - self.normal.dot(ray.origin)) / slope;
        let position = ray.origin + dir * distance;
        let at = Vec2::new(self.along[0].dot(position), self.along[1].dot(position)) + self.at;
        let room = clear.room(at);
        if room <= 0.0 {
            return false;
        }
        let largest = ray.origin.abs().max_element() + distance.abs() + self.place.abs();
        let error = BLUR + (largest * self.growth / slope.abs() + at.abs().max_element()) * ROUNDING;
        let axes = match cone {
            Some([width, spread]) => {
                let print = Footprint::new(dir, self.normal, width + spread * (distance / length));
                let change = |v: Vec3| Vec2::new(self.along[0].dot(v), self.along[1].dot(v));
                [change(print.along), change(print.across)]
            }
            None => [Vec2::ZERO; 2],
        };
        // False for what is no number.
        clear.reach(axes) + error <= room
    }
}

/// The cones around rays, by number.
#[derive(Clone, Copy)]
pub(super) enum Cones<'r> {
    /// Widths and growths.
    Eyes([&'r [f32]; 2]),
    Paths(&'r [Path]),
}

/// Rays that look for what is there.
pub(super) struct Before<'r, 'a> {
    clearings: &'r Clearings<'a>,
    rays: &'r [Ray],
    cones: Cones<'r>,
}

impl Gaps for Before<'_, '_> {
    fn is_gap(&self, ray: usize, prim: u32) -> bool {
        let cone = match self.cones {
            Cones::Eyes([width, spread]) => [width[ray], spread[ray]],
            // Behind what was there a ray may meet the same surface again, which matters to what comes next.
            Cones::Paths(paths) if paths[ray].crossed.is_some() => return false,
            Cones::Paths(paths) => [paths[ray].cone_width, paths[ray].cone_spread],
        };
        self.clearings.is_clear(&self.rays[ray], prim, Some(cone))
    }
}
