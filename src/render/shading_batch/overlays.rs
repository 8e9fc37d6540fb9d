//! Sheen and clear coat over the points of a batch.
//!
//! They do not change the layers below: these are computed side by side as if there were no overlays, and so is the light that
//! the overlays remove and add.

use super::PlacedMesh;
use super::columns::{Column, Columns, Found, POINTS, ShadingBatch, get, put};
use super::constants::MaterialConstants;
use super::environment::{EnvironmentLight, Surroundings, blur};
use super::lit::Lit;
use crate::math::Vec3;
use crate::math::simd::{LANES, Simd};
use crate::render::context::Context;
use crate::render::shade::{CoatLobe, Model, SheenLobe, albedo_of_each, overlays, terminator};
use crate::render::shade_hits::TracedRays;

/// Sheen and clear coat of each point: the parameters that maps and views change.
pub(super) struct Overlays {
    /// Whether the material has sheen, or clear coat; if not, its columns are meaningless.
    has_sheen: bool,
    has_coat: bool,
    /// [`SheenLobe`]; black where there is none.
    color: Columns,
    sheen_roughness: Column,
    albedo: Column,
    /// [`CoatLobe`]; strength 0 where there is none.
    strength: Column,
    coat_roughness: Column,
    normal: Columns,
    n_v: Column,
    taken: Column,
    occlusion: Column,
    least_square: Column,
    /// Directions of the mirrored lookups of one of them, and the light found there; shares of f0 and f90 in the albedo of the
    /// clear coat.
    dirs: Columns,
    light: Columns,
    shares: [Column; 2],
}

impl Default for Overlays {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        Self {
            has_sheen: false,
            has_coat: false,
            color: three,
            sheen_roughness: one,
            albedo: one,
            strength: one,
            coat_roughness: one,
            normal: three,
            n_v: one,
            taken: one,
            occlusion: one,
            least_square: one,
            dirs: three,
            light: three,
            shares: [one; 2],
        }
    }
}

impl ShadingBatch {
    /// Computes sheen and clear coat at the points of a placed mesh, once their common maps have been read and cones bent, if
    /// they are its only further lobes.
    pub(crate) fn overlay(
        &mut self,
        context: &Context,
        traced: TracedRays,
        placed: PlacedMesh,
        constants: &MaterialConstants,
    ) {
        let metal_rough = context.scene.materials[placed.mesh.material as usize].metal_rough();
        let (Some(m), Some(lobes)) = (metal_rough, constants.lobes.filter(|lobes| lobes.are_overlays)) else { return };
        let Model::MetalRough(unmapped) = &constants.bsdf.model else { return };
        let occlusion_of_all = unmapped.inputs().occlusion;
        let mut over = self.overlays.take().unwrap_or_default();
        (over.has_sheen, over.has_coat) = (m.sheen.is_some(), m.coat.is_some());
        self.each_lobe_frame(context, traced, placed, constants, lobes, |i, on, reader| {
            let Some(on) = on else { return over.put(i, &(None, None)) };
            let occlusion = if self.painted.any { self.painted.occlusion[i] } else { occlusion_of_all };
            let (sheen, mut coat) = overlays(m, on, occlusion, reader);
            if let Some(coat) = &mut coat {
                self.widen_coat(i, context, m, coat, on.patch);
            }
            over.put(i, &(sheen, coat));
        });
        self.overlays = Some(over);
    }
}

impl Overlays {
    /// Removes all overlays.
    pub(super) fn clear(&mut self) {
        (self.has_sheen, self.has_coat) = (false, false);
    }

    /// Whether the material has any.
    pub(super) fn any(&self) -> bool {
        self.has_sheen || self.has_coat
    }

    fn put(&mut self, i: usize, (sheen, coat): &(Option<SheenLobe>, Option<CoatLobe>)) {
        let SheenLobe { color, roughness, albedo } = *sheen.as_ref().unwrap_or(&SheenLobe::NONE);
        put(&mut self.color, i, color);
        (self.sheen_roughness[i], self.albedo[i]) = (roughness, albedo);
        let coat = coat.as_ref().unwrap_or(&CoatLobe::NONE);
        let CoatLobe { strength, roughness, normal, n_v, taken, occlusion, least_square } = *coat;
        put(&mut self.normal, i, normal);
        (self.strength[i], self.coat_roughness[i], self.n_v[i]) = (strength, roughness, n_v);
        (self.taken[i], self.occlusion[i], self.least_square[i]) = (taken, occlusion, least_square);
    }

    #[inline(always)]
    fn sheen(&self, i: usize) -> SheenLobe {
        SheenLobe { color: get(&self.color, i), roughness: self.sheen_roughness[i], albedo: self.albedo[i] }
    }

    #[inline(always)]
    fn coat(&self, i: usize) -> CoatLobe {
        CoatLobe {
            strength: self.strength[i],
            roughness: self.coat_roughness[i],
            normal: get(&self.normal, i),
            n_v: self.n_v[i],
            taken: self.taken[i],
            occlusion: self.occlusion[i],
            least_square: self.least_square[i],
        }
    }

    /// Sheen and clear coat of point `i`.
    pub(super) fn at(&self, i: usize) -> (Option<SheenLobe>, Option<CoatLobe>) {
        let sheen = self.has_sheen.then(|| self.sheen(i)).filter(|sheen| sheen.color != Vec3::ZERO);
        (sheen, self.has_coat.then(|| self.coat(i)).filter(|coat| coat.strength > 0.0))
    }

    /// Shares of the light that pass through the clear coat, and through both.
    #[inline(always)]
    fn clear_at(&self, i: usize) -> [f32; 2] {
        let below_coat = if self.has_coat { self.coat(i).clear() } else { 1.0 };
        let sheen = if self.has_sheen { self.sheen(i).clear() } else { 1.0 };
        [below_coat, below_coat * sheen]
    }

    /// Attenuates the direct light that points below them reflect, and adds their own.
    #[inline(always)]
    pub(super) fn reflect(&self, found: &Found, lit: &mut Lit, points: usize) {
        for i in 0..points.min(POINTS) {
            let [_, clear] = self.clear_at(i);
            let all = get(&lit.radiance, i) * clear;
            put(&mut lit.radiance, i, all);
        }
        if self.has_sheen {
            for i in 0..points.min(POINTS) {
                let [below_coat, _] = self.clear_at(i);
                let (normal, view, to_light) = (get(&found.normal, i), get(&found.view, i), get(&lit.to_light, i));
                let sheen = self.sheen(i).lit(normal, view, to_light) * get(&lit.light, i) * below_coat;
                let all = get(&lit.radiance, i) + sheen;
                put(&mut lit.radiance, i, all);
            }
        }
        for i in 0..points.min(POINTS) {
            let smooth = terminator(get(&found.horizon, i), get(&found.normal, i), get(&lit.to_light, i));
            let all = get(&lit.radiance, i) * smooth;
            put(&mut lit.radiance, i, all);
        }
        if self.has_coat {
            for i in 0..points.min(POINTS) {
                let (coat, view, to_light) = (self.coat(i), get(&found.view, i), get(&lit.to_light, i));
                let smooth = terminator(get(&found.horizon, i), coat.normal, to_light);
                let all = get(&lit.radiance, i) + get(&lit.light, i) * (coat.lit(view, to_light) * smooth);
                put(&mut lit.radiance, i, all);
            }
        }
    }

    /// Attenuates the environment light that points below them reflect, and adds their own and emission.
    #[inline(always)]
    pub(super) fn show<S: Simd>(
        &mut self,
        s: S,
        found: &Found,
        to: &mut Surroundings,
        points: usize,
        everywhere: EnvironmentLight,
        emission: impl Fn(usize) -> Vec3,
    ) {
        let points = points.min(POINTS);
        for i in 0..points {
            let [_, clear] = self.clear_at(i);
            let all = get(&to.radiance, i) * clear;
            put(&mut to.radiance, i, all);
        }
        if self.has_sheen {
            self.show_sheen(found, to, points, everywhere);
        }
        if self.has_coat {
            self.show_coat(s, found, to, points, everywhere);
        }
        for i in 0..points {
            let [below_coat, _] = self.clear_at(i);
            let all = emission(i) * below_coat + get(&to.radiance, i);
            put(&mut to.radiance, i, all);
        }
    }

    #[inline(always)]
    fn show_sheen(&mut self, found: &Found, to: &mut Surroundings, points: usize, everywhere: EnvironmentLight) {
        for i in 0..points {
            put(&mut self.dirs, i, found.seen(i).mirrored());
        }
        let Self { dirs, light, sheen_roughness, .. } = self;
        blur(everywhere.sky, |i| SheenLobe::blur(sheen_roughness[i]), dirs, points, light);
        for i in 0..points {
            let [below_coat, _] = self.clear_at(i);
            let sheen = self.sheen(i).around(get(&self.light, i) + everywhere.ambient) * below_coat;
            let all = get(&to.radiance, i) + sheen;
            put(&mut to.radiance, i, all);
        }
    }

    #[inline(always)]
    fn show_coat<S: Simd>(
        &mut self,
        s: S,
        found: &Found,
        to: &mut Surroundings,
        points: usize,
        everywhere: EnvironmentLight,
    ) {
        // Coats are mostly so smooth that rays show all of their reflection.
        let looked_up = (0..points).fold(false, |any, i| any | (self.coat(i).looked_up() > 0.0));
        if !looked_up {
            return;
        }
        for i in 0..points {
            let seen = found.seen(i);
            let dir = self.coat(i).mirrored_from(&seen);
            put(&mut self.dirs, i, dir);
        }
        let Self { dirs, light, coat_roughness, n_v, shares: [scale, bias], .. } = self;
        blur(everywhere.sky, |i| coat_roughness[i], dirs, points, light);
        let at = coat_roughness.as_chunks().0.iter().zip(n_v.as_chunks().0);
        let eights = scale.as_chunks_mut().0.iter_mut().zip(bias.as_chunks_mut().0);
        for ((roughness, n_v), (scale, bias)) in at.zip(eights).take(points.div_ceil(LANES)) {
            [*scale, *bias] = albedo_of_each(s, roughness, n_v);
        }
        for i in 0..points {
            let share = self.coat(i).share_looked_up((self.shares[0][i], self.shares[1][i]));
            let all = get(&to.radiance, i) + (get(&self.light, i) + everywhere.ambient) * share;
            put(&mut to.radiance, i, all);
        }
    }
}
