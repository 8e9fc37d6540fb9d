//! Single points of a batch, for data not held in columns: rays that go on through glass and off several lobes, rays to the
//! environment, and the layers of a picture.

use super::columns::{ShadingBatch, get, leave};
use crate::accel::{NO_PRIM, Ray};
use crate::math::{DVec3, Vec3};
use crate::render::branch::ShadingPoint;
use crate::render::context::Context;
use crate::render::layers::FirstSurface;
use crate::render::shade::{Bsdf, ShadingFrame};
use crate::scene::Material;

/// One of the points, for rays that go on from it.
pub(crate) struct BatchPoint<'a> {
    batch: &'a ShadingBatch,
    i: usize,
    material: (u32, &'a Material),
    /// Whether it is seen from outside.
    outside: bool,
}

impl ShadingBatch {
    /// Points that are shaded here.
    pub(crate) fn certain(&self) -> impl Iterator<Item = usize> {
        (0..self.count).filter(|&i| self.found.certain[i] == 1)
    }

    /// Index of the traced ray that hit point `i`, its weight there, and the width of its cone.
    pub(crate) fn arrival(&self, i: usize) -> (usize, Vec3, f32) {
        let weight = self.weights.as_ref().map_or(Vec3::ONE, |weights| get(weights, i));
        (self.rays[i] as usize, weight, self.cones.width[i])
    }

    /// For each point that is shaded here: the index of its traced ray, its sample, and its data for the picture's layers;
    /// `unmapped` is the material without maps.
    pub(crate) fn firsts(
        &self,
        instance: u32,
        unmapped: &Bsdf,
        center: DVec3,
    ) -> impl Iterator<Item = (usize, u32, FirstSurface)> {
        let prims = self.given.faces.prims();
        self.certain().map(move |i| {
            let at = (get(&self.found.position, i), get(&self.found.normal, i));
            let albedo = self.base_bsdf(i, unmapped, true).model.base();
            (self.rays[i] as usize, self.samples[i], FirstSurface::new((prims[i], instance), at, albedo, center))
        })
    }

    /// Material at point `i` without its overlays; `unmapped` is the material without maps.
    pub(super) fn base_bsdf(&self, i: usize, unmapped: &Bsdf, outside: bool) -> Bsdf {
        if self.painted.any {
            return Bsdf::base_layer(self.painted.model(i, &unmapped.model), self.painted.emission(i), outside);
        }
        Bsdf::base_layer(unmapped.model, unmapped.emission, outside)
    }

    /// Point `i` of this material, given with its index; its back is seen from inside if the material `has_inside`.
    pub(crate) fn point<'a>(&'a self, i: usize, material: (u32, &'a Material), has_inside: bool) -> BatchPoint<'a> {
        BatchPoint { batch: self, i, material, outside: self.found.front[i] == 1 || !has_inside }
    }
}

impl BatchPoint<'_> {
    /// Material at the point with its overlays; `unmapped` is the material without maps.
    pub(crate) fn bsdf(&self, unmapped: &Bsdf) -> Bsdf {
        let base_bsdf = self.batch.base_bsdf(self.i, unmapped, self.outside);
        match self.batch.overlays.as_ref().filter(|over| over.any()) {
            Some(over) => base_bsdf.under(over.at(self.i)),
            None => base_bsdf,
        }
    }
}

impl ShadingPoint for BatchPoint<'_> {
    fn material(&self) -> (u32, &Material) {
        self.material
    }

    fn seen(&self) -> ShadingFrame {
        ShadingFrame { outside: self.outside, ..self.batch.found.seen(self.i) }
    }

    fn is_front(&self) -> bool {
        self.batch.found.front[self.i] == 1
    }

    fn bend(&self, _: &Context) -> f32 {
        self.batch.cones.bend[self.i]
    }

    fn ray(&self, dir: Vec3, sample: u32) -> Ray {
        let (exclude, origin) = (self.batch.given.faces.prims()[self.i], leave(&self.batch.found, self.i, dir));
        debug_assert_ne!(exclude, NO_PRIM);
        Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude, sample }
    }

    fn set_off(&self, dir: Vec3) -> [Vec3; 2] {
        [leave(&self.batch.found, self.i, dir), get(&self.batch.found.position, self.i)]
    }

    fn excluded(&self) -> u32 {
        self.batch.given.faces.prims()[self.i]
    }
}
