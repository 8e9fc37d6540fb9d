//! Material parameters from maps and vertex colours at the points of a batch.
//!
//! Maps are mostly read side by side ([`MaterialMaps`](super::material_maps::MaterialMaps)), else point by point, as
//! [`Surface`](crate::render::surface::Surface) reads them; the parameters are computed from them side by side. So is the blur by
//! rough surfaces on the way, which makes any material rougher.

use super::PlacedMesh;
use super::columns::{Column, Columns, POINTS, ShadingBatch, get, padded, put};
use super::constants::MaterialConstants;
use crate::accel::NO_PRIM;
use crate::math::Vec3;
use crate::render::context::Context;
use crate::render::patch::Patch;
use crate::render::shade::{
    Bsdf, MetalRoughBsdf, MetalRoughInputs, Model, PhongBsdf, PhongInputs, Reader, blurred, is_narrow,
};
use crate::render::shade_hits::TracedRays;
use crate::render::surface::{HitPrim, mapped_normal, side_of};
use crate::render::whitted::SPREAD;
use crate::scene::Material;

/// Material at each point: the parameters that maps change.
pub(super) struct Painted {
    /// Whether maps change any; if not, the columns are meaningless.
    pub any: bool,
    /// Coverage of each point, where maps or vertices were read.
    pub(super) coverage: Column,
    base: Columns,
    emission: Columns,
    metallic: Column,
    pub(super) roughness: Column,
    pub(super) occlusion: Column,
    transmission: Column,
    ambient: Columns,
    specular: Columns,
    mirror: Columns,
    shininess: Column,
    /// Texel of a normal map that was read side by side.
    normal: Columns,
}

impl Default for Painted {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        Self {
            any: false,
            coverage: one,
            base: three,
            emission: three,
            metallic: one,
            roughness: one,
            occlusion: one,
            transmission: one,
            ambient: three,
            specular: three,
            mirror: three,
            shininess: one,
            normal: three,
        }
    }
}

impl Painted {
    fn put(&mut self, i: usize, bsdf: &Bsdf) {
        self.put_emission(i, bsdf.emission);
        match &bsdf.model {
            Model::Unlit(color) => self.put_unlit(i, *color),
            Model::Phong(m) => self.put_phong(i, m.inputs()),
            Model::MetalRough(m) => self.put_metal_rough(i, m.inputs()),
        }
    }

    #[inline(always)]
    pub(super) fn put_emission(&mut self, i: usize, emission: Vec3) {
        put(&mut self.emission, i, emission);
    }

    #[inline(always)]
    pub(super) fn put_unlit(&mut self, i: usize, color: Vec3) {
        put(&mut self.base, i, color);
    }

    #[inline(always)]
    pub(super) fn put_phong(&mut self, i: usize, inputs: PhongInputs) {
        let PhongInputs { ambient, diffuse, specular, mirror, shininess } = inputs;
        put(&mut self.ambient, i, ambient);
        put(&mut self.base, i, diffuse);
        put(&mut self.specular, i, specular);
        put(&mut self.mirror, i, mirror);
        self.shininess[i] = shininess;
    }

    #[inline(always)]
    pub(super) fn put_metal_rough(&mut self, i: usize, inputs: MetalRoughInputs) {
        let MetalRoughInputs { base, metallic, roughness, occlusion, transmission } = inputs;
        put(&mut self.base, i, base);
        (self.metallic[i], self.roughness[i], self.occlusion[i]) = (metallic, roughness, occlusion);
        self.transmission[i] = transmission;
    }

    #[inline(always)]
    pub(super) fn put_normal_texel(&mut self, i: usize, texel: Vec3) {
        put(&mut self.normal, i, texel);
    }

    #[inline(always)]
    pub(super) fn normal_texel(&self, i: usize) -> Vec3 {
        get(&self.normal, i)
    }

    /// Whether a metallic-rough material has narrow highlights of lights.
    pub(super) fn has_narrow_highlight(&self, i: usize) -> bool {
        is_narrow(self.roughness[i])
    }

    #[inline(always)]
    pub(super) fn emission(&self, i: usize) -> Vec3 {
        get(&self.emission, i)
    }

    /// Colour of an unlit material.
    #[inline(always)]
    pub(super) fn unlit(&self, i: usize) -> Vec3 {
        get(&self.base, i)
    }

    #[inline(always)]
    pub(super) fn phong(&self, i: usize, of: &PhongBsdf) -> PhongBsdf {
        of.painted(PhongInputs {
            ambient: get(&self.ambient, i),
            diffuse: get(&self.base, i),
            specular: get(&self.specular, i),
            mirror: get(&self.mirror, i),
            shininess: self.shininess[i],
        })
    }

    #[inline(always)]
    pub(super) fn metal_rough(&self, i: usize, of: &MetalRoughBsdf) -> MetalRoughBsdf {
        of.painted(MetalRoughInputs {
            base: get(&self.base, i),
            metallic: self.metallic[i],
            roughness: self.roughness[i],
            occlusion: self.occlusion[i],
            transmission: self.transmission[i],
        })
    }
}

impl Painted {
    /// Model at point `i`; `unmapped` is the model without maps.
    pub(super) fn model(&self, i: usize, unmapped: &Model) -> Model {
        match unmapped {
            Model::Unlit(_) => Model::Unlit(self.unlit(i)),
            Model::Phong(m) => Model::Phong(self.phong(i, m)),
            Model::MetalRough(m) => Model::MetalRough(self.metal_rough(i, m)),
        }
    }
}

impl ShadingBatch {
    /// Roughens a surface of `bsdf` at points seen along paths that rough surfaces have spread, after its maps were read.
    pub(crate) fn blur(&mut self, traced: TracedRays, bsdf: &Bsdf) {
        let (Model::MetalRough(m), TracedRays::Wave(..)) = (&bsdf.model, traced) else { return };
        let rays = &self.rays[..self.count.min(POINTS)];
        let scattered = |ray: u32| traced.path(ray as usize).scattered;
        if rays.iter().all(|&ray| scattered(ray) <= SPREAD) {
            return;
        }
        let painted = &mut self.painted;
        if !painted.any {
            painted.any = true;
            for i in 0..padded(self.count) {
                painted.put_emission(i, bsdf.emission);
                painted.put_metal_rough(i, m.inputs());
            }
        }
        for (roughness, &ray) in painted.roughness.iter_mut().zip(rays).filter(|(_, ray)| scattered(**ray) > SPREAD) {
            *roughness = roughness.max(blurred(scattered(ray)));
        }
    }

    /// Reads maps and vertex colours at the points of a placed mesh.
    pub(crate) fn read(
        &mut self,
        context: &Context,
        traced: TracedRays,
        placed: PlacedMesh,
        constants: &MaterialConstants,
    ) {
        let material = &context.scene.materials[placed.mesh.material as usize];
        self.painted.any = true;
        let widens = !context.lights.is_empty() && material.metal_rough().is_some();
        if let Some(material_maps) =
            constants.material_maps.as_ref().filter(|material_maps| material_maps.covers(placed.mesh))
        {
            self.read_material_maps(context, material, material_maps, placed, widens);
            return;
        }
        let (mut prim, mut patch) = (NO_PRIM, None);
        for i in 0..self.count.min(POINTS) {
            if self.found.certain[i] != 1 || constants.one_sided && self.found.front[i] != 1 {
                continue;
            }
            let hit = &traced.hits()[self.rays[i] as usize];
            if prim != hit.prim {
                prim = hit.prim;
                patch = HitPrim::new(context.scene, context.world, prim).patch(context.world, hit.u, hit.v, Vec3::ZERO);
            }
            let Some(patch) = &mut patch else {
                self.found.certain[i] = 0;
                continue;
            };
            patch.move_to([1.0 - hit.u - hit.v, hit.u, hit.v], self.cones.footprint(i));
            self.read_at(i, context, material, patch, widens);
        }
    }

    fn read_at(&mut self, i: usize, context: &Context, material: &Material, patch: &Patch, widens: bool) {
        let reader = Reader { store: context.textures, patch: Some(patch), known: &[] };
        let base = reader.base(material);
        self.painted.coverage[i] = material.alpha_mode.covers(base.w);
        if self.painted.coverage[i] <= 0.0 {
            return;
        }
        self.painted.put(i, &Bsdf::read(material, base.truncate(), &reader));
        if material.normal_map.is_some() || material.bump_map.is_some() {
            let (view, geometric) = (get(&self.found.view, i), get(&self.found.geometric, i));
            let outward = if self.found.front[i] == 1 { geometric } else { -geometric };
            let own = patch.normal().unwrap_or(outward);
            let normal =
                mapped_normal(patch, material, context.textures, own, side_of(own, geometric), geometric, view);
            put(&mut self.found.normal, i, normal);
        }
        if let Some(map) = material.normal_map.as_ref().filter(|_| widens && self.painted.has_narrow_highlight(i)) {
            let reach = context.highlight_reach;
            self.cones.turning[i] = patch.turning_of_map(map, material.normal_scale, context.textures, reach);
        }
    }
}
