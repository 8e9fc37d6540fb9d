//! What maps and colours of vertices say at the points of a strip.
//!
//! They are read point by point, as [`Surface`](crate::render::surface::Surface) reads them; what follows from them is
//! computed side by side.

use super::columns::{Column, Columns, Found, POINTS, Strip, get, padded, put};
use super::common::Common;
use crate::accel::NO_PRIM;
use crate::math::Vec3;
use crate::math::simd::{Kernel, Simd};
use crate::render::context::Context;
use crate::render::eyes::Eyes;
use crate::render::patch::{Footprint, Patch};
use crate::render::shade::{Matter, MetalRoughMatter, MetalRoughPaint, Model, PhongMatter, PhongPaint, Reader};
use crate::render::surface::{Target, mapped_normal, side_of};
use crate::scene::Material;

/// A material at each point: those of its numbers that maps change.
pub(super) struct Painted {
    /// Whether they do; else nothing here counts.
    pub any: bool,
    base: Columns,
    emission: Columns,
    metallic: Column,
    pub(super) roughness: Column,
    pub(super) occlusion: Column,
    ambient: Columns,
    specular: Columns,
    shininess: Column,
    /// How wide the ray's cone is, and the axes of the ellipse in which it meets the surface.
    width: Column,
    along: Columns,
    across: Columns,
}

impl Default for Painted {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        Self {
            any: false,
            base: three,
            emission: three,
            metallic: one,
            roughness: one,
            occlusion: one,
            ambient: three,
            specular: three,
            shininess: one,
            width: one,
            along: three,
            across: three,
        }
    }
}

impl Painted {
    fn put(&mut self, i: usize, matter: &Matter) {
        put(&mut self.emission, i, matter.emission);
        match &matter.model {
            Model::Unlit(color) => put(&mut self.base, i, *color),
            Model::Phong(m) => {
                let PhongPaint { ambient, diffuse, specular, shininess } = m.paint();
                put(&mut self.ambient, i, ambient);
                put(&mut self.base, i, diffuse);
                put(&mut self.specular, i, specular);
                self.shininess[i] = shininess;
            }
            Model::MetalRough(m) => {
                let MetalRoughPaint { base, metallic, roughness, occlusion } = m.paint();
                put(&mut self.base, i, base);
                (self.metallic[i], self.roughness[i], self.occlusion[i]) = (metallic, roughness, occlusion);
            }
        }
    }

    #[inline(always)]
    pub(super) fn emission(&self, i: usize) -> Vec3 {
        get(&self.emission, i)
    }

    /// What is seen of a material that no light changes.
    #[inline(always)]
    pub(super) fn unlit(&self, i: usize) -> Vec3 {
        get(&self.base, i)
    }

    #[inline(always)]
    pub(super) fn phong(&self, i: usize, of: &PhongMatter) -> PhongMatter {
        of.painted(PhongPaint {
            ambient: get(&self.ambient, i),
            diffuse: get(&self.base, i),
            specular: get(&self.specular, i),
            shininess: self.shininess[i],
        })
    }

    #[inline(always)]
    pub(super) fn metal_rough(&self, i: usize, of: &MetalRoughMatter) -> MetalRoughMatter {
        of.painted(MetalRoughPaint {
            base: get(&self.base, i),
            metallic: self.metallic[i],
            roughness: self.roughness[i],
            occlusion: self.occlusion[i],
        })
    }
}

/// How many points of a material were read, and how many of them in vain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tried {
    points: u32,
    in_vain: u32,
    skipped: u32,
}

impl Tried {
    /// One strip of so many is taken to find out whether that pays.
    const PAUSE: u32 = 16;

    /// Whether the next points had better be shaded one by one: most of the last could not be shaded beside others.
    fn skips(&mut self) -> bool {
        self.skipped = if 2 * self.in_vain > self.points { (self.skipped + 1) % Self::PAUSE } else { 0 };
        self.skipped != 0
    }

    fn note(&mut self, points: usize, in_vain: usize) {
        // What was long ago counts less and less.
        let add = |sum: u32, new: usize| sum - sum.div_ceil(8) + u32::try_from(new).unwrap_or(0);
        (self.points, self.in_vain) = (add(self.points, points), add(self.in_vain, in_vain));
    }
}

impl Strip {
    /// Whether points of a material had better not be taken, because most would be left out once they are read.
    pub(crate) fn reads_in_vain(&mut self, material: u32) -> bool {
        self.tried.get_mut(material as usize).is_some_and(Tried::skips)
    }

    /// Reads what maps and vertices say at the points that eye rays have hit, of a mesh of `material`, and leaves out those
    /// that cannot be shaded beside others then.
    pub(crate) fn read(&mut self, context: &Context, eyes: &Eyes, material: u32, common: &Common) {
        let (count, id) = (self.count.min(POINTS), material as usize);
        let material = &context.scene.materials[id];
        let Self { painted, found, rays, .. } = self;
        painted.any = true;
        for (width, &ray) in painted.width.iter_mut().zip(&rays[..count]) {
            let (path, hit) = (eyes.path(ray as usize), &eyes.hits[ray as usize]);
            *width = path.cone_width + path.cone_spread * hit.t;
        }
        self.level.run(Print { found, painted, points: padded(count) });
        let (mut prim, mut patch, mut points, mut in_vain) = (NO_PRIM, None, 0, 0);
        for i in 0..count {
            if self.found.certain[i] != 1 || common.one_sided && self.found.front[i] != 1 {
                continue;
            }
            let hit = &eyes.hits[self.rays[i] as usize];
            if prim != hit.prim {
                prim = hit.prim;
                patch = Target::new(context.scene, context.world, prim).patch(context.world, hit.u, hit.v, Vec3::ZERO);
            }
            let Some(patch) = &mut patch else {
                self.found.certain[i] = 0;
                continue;
            };
            let print = Footprint { along: get(&self.painted.along, i), across: get(&self.painted.across, i) };
            patch.move_to([1.0 - hit.u - hit.v, hit.u, hit.v], print);
            points += 1;
            in_vain += usize::from(!self.read_at(i, context, material, common, patch));
        }
        if self.tried.len() <= id {
            self.tried.resize(id + 1, Tried::default());
        }
        self.tried[id].note(points, in_vain);
    }

    /// Whether the point can be shaded beside others.
    fn read_at(&mut self, i: usize, context: &Context, material: &Material, common: &Common, patch: &Patch) -> bool {
        let reader = Reader { store: context.textures, patch: Some(patch) };
        let matter = Matter::read(material, reader.base(material).truncate(), &reader);
        if !common.can_be_beside(&matter) {
            self.found.certain[i] = 0;
            return false;
        }
        self.painted.put(i, &matter);
        if material.normal_map.is_some() || material.bump_map.is_some() {
            let (view, geometric) = (get(&self.found.view, i), get(&self.found.geometric, i));
            let outward = if self.found.front[i] == 1 { geometric } else { -geometric };
            let own = patch.normal().unwrap_or(outward);
            let normal = mapped_normal(patch, material, context.textures, own, side_of(own, geometric), view);
            put(&mut self.found.normal, i, normal);
        }
        true
    }
}

/// What maps are read for at each point.
struct Print<'a> {
    found: &'a Found,
    painted: &'a mut Painted,
    points: usize,
}

impl Kernel for Print<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { found, painted, points } = self;
        for i in 0..points.min(POINTS) {
            let (view, geometric) = (get(&found.view, i), get(&found.geometric, i));
            let Footprint { along, across } = Footprint::new(-view, geometric, painted.width[i]);
            put(&mut painted.along, i, along);
            put(&mut painted.across, i, across);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_material_that_was_read_in_vain_is_tried_again_and_taken_once_that_pays() {
        let mut tried = Tried::default();
        assert!(!tried.skips(), "nothing is known yet");
        (0..9).for_each(|_| tried.note(1, 1));
        let taken = |tried: &mut Tried, strips: usize| (0..strips).filter(|_| !tried.skips()).count();
        assert_eq!(taken(&mut tried, 160), 10);
        // However few points a strip has.
        (0..20).for_each(|_| tried.note(1, 0));
        assert_eq!(taken(&mut tried, 160), 160);
    }
}
