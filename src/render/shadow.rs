//! Shadow rays: one for each light that a point could see, traced in waves.

use super::asking::Asking;
use super::context::Context;
use super::observer::Observer;
use super::seam::is_same_crossing;
use super::shade::{Reader, shadow_filter};
use super::surface::{Footprint, Target};
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;

/// Shadow rays that wait, each with the light it lets through. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Shadows {
    rays: Vec<Ray>,
    light: Vec<Vec3>,
    blocked: Vec<bool>,
    /// The hit that each ray has passed last.
    after: Vec<Hit>,
    /// The same for the rays that go on, while they are picked out.
    kept: Vec<Hit>,
    hits: Vec<Hit>,
}

impl Shadows {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a ray; `light` is what its sample sees if nothing is in the way.
    pub(crate) fn push(&mut self, ray: Ray, light: Vec3) {
        self.rays.push(ray);
        self.light.push(light);
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.light.clear();
    }

    /// Traces all rays and hands what arrives to `arrive`, as (sample, light) in an order that is always the same.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        asking: &mut Asking<A>,
        probe: &mut P,
        mut arrive: impl FnMut(u32, Vec3),
    ) {
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        asking.occluded(&self.rays, &mut self.blocked, probe);
        if !context.has_filters {
            let open = self.rays.iter().zip(&self.light).zip(&self.blocked).filter(|(_, blocked)| !**blocked);
            open.for_each(|((ray, light), _)| arrive(ray.sample, *light));
            return self.clear();
        }

        // What is left meets nothing opaque: walk through everything else on the way, one surface of each ray a time.
        let blocked = std::mem::take(&mut self.blocked);
        self.keep(|i, _, _| !blocked[i]);
        self.blocked = blocked;
        self.after.clear();
        self.hits.clear();
        self.hits.resize(self.rays.len(), Hit::MISS);
        asking.closest(&self.rays, &mut self.hits, probe);
        while !self.rays.is_empty() {
            self.filter(context, &mut arrive);
            self.hits.clear();
            self.hits.resize(self.rays.len(), Hit::MISS);
            asking.next(&self.rays, &self.after, &mut self.hits, probe);
        }
        self.clear();
    }

    /// Hands over the light of rays that met nothing more, weakens that of the others, and drops those it leaves dark.
    fn filter(&mut self, context: &Context, arrive: &mut impl FnMut(u32, Vec3)) {
        let hits = std::mem::take(&mut self.hits);
        let after = std::mem::take(&mut self.after);
        let mut kept = std::mem::take(&mut self.kept);
        self.keep(|i, ray, light| {
            let hit = &hits[i];
            if !hit.is_some() {
                arrive(ray.sample, *light);
                return false;
            }
            if !after.get(i).is_some_and(|before| is_same_crossing(&context.world.shapes, ray, before, hit)) {
                *light *= filter_at(context, ray, hit);
            }
            let goes_on = light.max_element() > 0.0;
            if goes_on {
                kept.push(*hit);
            }
            goes_on
        });
        self.after = kept;
        self.kept = after;
        self.kept.clear();
        self.hits = hits;
    }

    /// Drops the rays for which `wanted` (index, ray, light) is false; the others keep their order.
    fn keep(&mut self, mut wanted: impl FnMut(usize, &Ray, &mut Vec3) -> bool) {
        let mut kept = 0;
        for i in 0..self.rays.len() {
            let mut light = self.light[i];
            if wanted(i, &self.rays[i], &mut light) {
                self.rays[kept] = self.rays[i];
                self.light[kept] = light;
                kept += 1;
            }
        }
        self.rays.truncate(kept);
        self.light.truncate(kept);
    }
}

/// What the surface at `hit` lets through. Maps are read at full sharpness: the shadow's own distance is unknown here.
fn filter_at(context: &Context, ray: &Ray, hit: &Hit) -> Vec3 {
    let target = Target::new(context.scene, context.world, hit.prim);
    let patch = target.patch(context.world, hit.u, hit.v, ray.origin + ray.dir * hit.t);
    let footprint = Footprint::default();
    let reader = Reader { store: context.textures, patch: patch.as_ref(), footprint: &footprint };
    shadow_filter(target.material, &reader)
}
