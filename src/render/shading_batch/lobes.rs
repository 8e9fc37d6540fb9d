//! Points with lobes beyond their microfacets (anisotropy, film, sheen or clear coat), with maps of their reflectance, or with
//! diffuse transmission: surface and view are computed side by side, BSDFs one by one, unless all their lobes are
//! [overlays](super::overlays).

use super::PlacedMesh;
use super::columns::{POINTS, ShadingBatch, get};
use super::constants::{Lobes, MaterialConstants};
use super::material_maps::MaterialMaps;
use crate::accel::NO_PRIM;
use crate::math::{Vec3, Vec4};
use crate::render::context::Context;
use crate::render::glint;
use crate::render::lobe_frame::LobeFrame;
use crate::render::patch::Patch;
use crate::render::shade::{Bsdf, CoatLobe, Known, Reader};
use crate::render::shade_hits::TracedRays;
use crate::render::surface::{HitPrim, side_of};
use crate::render::whitted::SPREAD;
use crate::render::world::Placement;
use crate::scene::MetalRough;

impl ShadingBatch {
    /// Computes the BSDFs of the points of a placed mesh, once their common maps have been read and cones bent.
    pub(crate) fn complete(
        &mut self,
        context: &Context,
        traced: TracedRays,
        placed: PlacedMesh,
        constants: &MaterialConstants,
    ) {
        let metal_rough = context.scene.materials[placed.mesh.material as usize].metal_rough();
        let (Some(m), Some(lobes)) = (metal_rough, constants.lobes.filter(|lobes| !lobes.are_overlays)) else { return };
        let mut point_bsdfs = std::mem::take(&mut self.point_bsdfs);
        self.each_lobe_frame(context, traced, placed, constants, lobes, |i, on, reader| {
            let outside = self.found.front[i] == 1 || !constants.has_inside();
            let base_bsdf = self.base_bsdf(i, &constants.bsdf, outside);
            let Some(on) = on else { return point_bsdfs.push(base_bsdf) };
            let below = if lobes.reads_reflectance { base_bsdf.tinted(m, reader) } else { base_bsdf };
            let below = below.thinned(m, reader);
            let mut bsdf = if outside { below.with_lobes(m, on, reader) } else { below };
            let scattered = traced.path(self.rays[i] as usize).scattered;
            if scattered > SPREAD {
                bsdf.blur(scattered);
            }
            self.widen_highlights(i, context, m, &mut bsdf, on.patch);
            point_bsdfs.push(bsdf);
        });
        self.point_bsdfs = point_bsdfs;
    }

    /// Passes the frame of each point's lobes to `tell`, or `None` where the tracer must shade the point itself, with the reader
    /// of their maps.
    pub(super) fn each_lobe_frame(
        &self,
        context: &Context,
        traced: TracedRays,
        PlacedMesh { mesh, placement }: PlacedMesh,
        constants: &MaterialConstants,
        lobes: Lobes,
        mut tell: impl FnMut(usize, Option<&LobeFrame>, &Reader),
    ) {
        let side_by_side = constants
            .material_maps
            .as_ref()
            .filter(|material_maps| material_maps.covers(mesh))
            .map_or(&[][..], MaterialMaps::lobes);
        let unread = |&(map, space): &_| Known { map, space, texel: Vec4::ONE };
        let mut known: Vec<Known> = side_by_side.iter().map(unread).collect();
        let reads_mesh = lobes.reads_mesh || lobes.reads_maps && known.is_empty();
        let placement = (!mesh.normals.is_empty()).then_some(placement);
        let (mut prim, mut patch) = (NO_PRIM, None);
        for i in 0..self.count.min(POINTS) {
            if self.found.certain[i] != 1 {
                tell(i, None, &Reader { store: context.textures, patch: None, known: &[] });
                continue;
            }
            if reads_mesh {
                let hit = &traced.hits()[self.rays[i] as usize];
                if prim != hit.prim {
                    prim = hit.prim;
                    patch =
                        HitPrim::new(context.scene, context.world, prim).patch(context.world, hit.u, hit.v, Vec3::ZERO);
                }
                if let Some(patch) = &mut patch {
                    patch.move_to([1.0 - hit.u - hit.v, hit.u, hit.v], self.cones.footprint(i));
                }
            }
            known.iter_mut().zip(&*self.of_lobes).for_each(|(known, texels)| known.texel = texels[i]);
            let reader = Reader { store: context.textures, patch: patch.as_ref(), known: &known };
            tell(i, Some(&self.lobe_frame(i, placement, patch.as_ref())), &reader);
        }
    }

    /// BSDF of point `i` with all its lobes, if it has more than one.
    pub(crate) fn point_bsdf(&self, i: usize) -> Option<&Bsdf> {
        self.point_bsdfs.get(i)
    }

    /// Frame of the lobes at point `i` of a patch of a mesh; `placement` is given where the mesh has vertex normals.
    fn lobe_frame<'a>(&self, i: usize, placement: Option<&Placement>, patch: Option<&'a Patch<'a>>) -> LobeFrame<'a> {
        let own = placement.map_or(self.given.faces.outward(i), |placement| self.given.own_normal(placement, i));
        let geometric = get(&self.found.geometric, i);
        let side = side_of(own, geometric);
        let (normal, view) = (get(&self.found.normal, i), get(&self.found.view, i));
        LobeFrame { patch, smooth: own * side, side, geometric, normal, view }
    }

    /// Widens highlights at point `i` so that rays hit them.
    fn widen_highlights(&self, i: usize, context: &Context, m: &MetalRough, bsdf: &mut Bsdf, patch: Option<&Patch>) {
        if context.lights.is_empty() {
            return;
        }
        if bsdf.has_narrow_highlight() {
            bsdf.widen_highlight(self.least_square(i, context, self.cones.turning[i]));
        }
        if let Some(coat) = &mut bsdf.coat {
            self.widen_coat(i, context, m, coat, patch);
        }
    }

    /// Widens highlights of the clear coat at point `i` so that rays hit them.
    pub(super) fn widen_coat(
        &self,
        i: usize,
        context: &Context,
        m: &MetalRough,
        coat: &mut CoatLobe,
        patch: Option<&Patch>,
    ) {
        if context.lights.is_empty() || !coat.has_narrow_highlight() {
            return;
        }
        let map = m.coat.as_ref().and_then(|coat| Some((coat.normal_map.as_ref()?, coat.normal_scale)));
        let reach = context.highlight_reach;
        let turning = |(patch, (map, scale)): (&Patch, _)| patch.turning_of_map(map, scale, context.textures, reach);
        coat.widen_highlight(self.least_square(i, context, patch.zip(map).map_or(0.0, turning)));
    }

    /// Lower bound of α² in narrow highlights at point `i`, with the squared angles by which a normal map turns the surface.
    fn least_square(&self, i: usize, context: &Context, turning: f32) -> f32 {
        let (reach, cones) = (context.highlight_reach, &self.cones);
        glint::least_of(cones.bend[i] * (reach * reach) + turning, cones.spread[i], reach)
    }
}
