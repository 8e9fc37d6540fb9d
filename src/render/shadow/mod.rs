//! Shadow rays, to lights and to the environment, traced in waves.

pub(super) mod curve;
pub(super) mod filters;

use super::context::Context;
use super::media::{Media, MediaTable};
use super::observer::Observer;
use super::ray_caster::RayCaster;
use super::shadow::curve::ShadowRays;
use super::shadow::filters::{FilterHit, FilterHits, RayMedia, ShadowFilter, filter_at, weaken};
use super::surface::HitPrim;
use super::tail::Tail;
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;
use bytemuck::{Pod, Zeroable};
use std::cell::RefCell;

/// Queued shadow rays, each with the light it carries. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct ShadowQueue {
    rays: Tail<Ray>,
    light: Tail<Bound>,
    /// Media of each ray; empty where nothing absorbs light.
    ray_media: Vec<RayMedia>,
    /// For rays that end at refracting or scattering surfaces: the hit that each has left, with `t` as far as it may hit the same
    /// surface again.
    unbent: Vec<Hit>,
    /// Rays up to the raised starts of some of the rays, and the indices of these rays.
    risers: Vec<Ray>,
    raised: Vec<usize>,
    occluded: Vec<bool>,
    /// Partially transmitting hits, and those of one ray in order.
    filter_hits: RefCell<FilterHits>,
    in_order: Vec<FilterHit>,
    /// Rays that go on from surface to surface: their indices, the rays, the hit that each has passed last, the last one that was
    /// no hole, and the next hit.
    going: Vec<usize>,
    on_way: Vec<Ray>,
    after: Vec<Hit>,
    crossed: Vec<Hit>,
    hits: Vec<Hit>,
}

/// Light that arrives if the ray is unoccluded.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Bound {
    pub radiance: Vec3,
    /// Destination of the light: the sample of its ray, or a tag of the sender's.
    pub tag: u32,
}

impl ShadowQueue {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a ray; `light` is the contribution to its sample if it is unoccluded, `media` those it starts inside of: given for
    /// all rays of an image, or for none.
    pub(crate) fn push(&mut self, ray: Ray, light: Vec3, media: Option<Media>) {
        self.push_bound(ray, Bound { radiance: light, tag: ray.sample }, media);
    }

    /// Queues a shadow ray that may start above its surface.
    pub(crate) fn push_pair(&mut self, shadow_rays: &ShadowRays, light: Vec3, media: Option<Media>) {
        if let Some(riser) = shadow_rays.riser {
            self.raised.push(self.rays.len());
            self.risers.push(riser);
        }
        self.push(shadow_rays.ray, light, media);
    }

    /// Adds a ray that ends at glass, and has left this hit, with `t` as far as it may hit the same surface again: used for all
    /// rays, or for none.
    pub(crate) fn push_unbent(&mut self, ray: Ray, left: Hit, light: Vec3, media: Option<Media>) {
        self.push(ray, light, media);
        self.unbent.push(left);
    }

    /// Adds a ray whose light may go elsewhere than to its sample.
    pub(crate) fn push_bound(&mut self, ray: Ray, light: Bound, media: Option<Media>) {
        self.rays.push(ray);
        self.light.push(light);
        self.ray_media.extend(media.map(RayMedia::of));
    }

    /// Room for `N` more rays, and for the light of each; [`Self::take`] appends those written.
    pub(crate) fn room<const N: usize>(&mut self) -> (&mut [Ray; N], &mut [Bound; N]) {
        (self.rays.room(Ray::zeroed()), self.light.room(Bound::zeroed()))
    }

    /// Appends the first `count` rays that were written into the [`Self::room`], with the media each starts inside of where
    /// anything absorbs light.
    pub(crate) fn take(&mut self, count: usize, media: impl Iterator<Item = Media>) {
        self.rays.grow(count);
        self.light.grow(count);
        self.ray_media.extend(media.map(RayMedia::of));
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.light.clear();
        self.ray_media.clear();
        self.unbent.clear();
        self.risers.clear();
        self.raised.clear();
    }

    /// Traces all rays and passes arriving light to `arrive`, as (sample or tag, light) in the order of the rays.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        media: &mut MediaTable,
        caster: &mut RayCaster<A>,
        probe: &mut P,
        mut arrive: impl FnMut(u32, Vec3),
    ) {
        self.occluded.clear();
        self.occluded.resize(self.rays.len(), false);
        self.going.clear();
        if context.asks_filters() {
            self.filter_hits.get_mut().begin(self.rays.len());
            let shadow_filter = ShadowFilter::new(context, &self.rays, &self.filter_hits);
            caster.stopped(&shadow_filter, &mut self.occluded, probe);
            self.climb(context, caster, probe);
            self.pass(context, media);
        } else {
            caster.occluded(&self.rays, &mut self.occluded, probe);
            self.climb(context, caster, probe);
            if context.has_filters {
                let occluded = &self.occluded;
                self.going.extend((0..self.rays.len()).filter(|&i| !occluded[i]));
            }
        }
        self.go_through(context, media, caster, probe);
        let open = self.light.iter().zip(&self.occluded).filter(|(_, occluded)| !**occluded);
        open.for_each(|(light, _)| arrive(light.tag, light.radiance));
        self.clear();
    }

    /// Attenuates the light of rays by all their recorded hits, in order; rays with too many hits to record are added to those
    /// that go on by themselves.
    fn pass(&mut self, context: &Context, media: &mut MediaTable) {
        let filter_hits = self.filter_hits.get_mut();
        for i in 0..self.rays.len() {
            let noted = filter_hits.last(i);
            if noted == FilterHits::NOTHING || self.occluded[i] {
                continue;
            }
            if noted == FilterHits::OVERFLOW {
                self.going.push(i);
                continue;
            }
            filter_hits.list(noted, &mut self.in_order);
            let (light, mut crossed) = (&mut self.light[i].radiance, Hit::MISS);
            for passed in &self.in_order {
                weaken(
                    context,
                    &self.rays[i],
                    self.unbent.get(i),
                    &mut crossed,
                    passed,
                    light,
                    self.ray_media.get_mut(i).map(|ray_media| (ray_media, &mut *media)),
                );
                self.occluded[i] = is_dark(*light);
                if self.occluded[i] {
                    break;
                }
            }
        }
    }

    /// Traces the rays that go on, one surface of each at a time.
    fn go_through<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        media: &mut MediaTable,
        caster: &mut RayCaster<A>,
        probe: &mut P,
    ) {
        if self.going.is_empty() {
            return;
        }
        self.on_way.clear();
        self.on_way.extend(self.going.iter().map(|&i| self.rays[i]));
        self.after.clear();
        self.after.resize(self.going.len(), Hit::MISS);
        self.crossed.clone_from(&self.after);
        self.hits.clone_from(&self.after);
        caster.closest(&self.on_way, &mut self.hits, probe);
        while !self.going.is_empty() {
            self.filter(context, media);
            self.hits.clear();
            self.hits.resize(self.going.len(), Hit::MISS);
            caster.next(&self.on_way, &self.after, &mut self.hits, probe);
        }
    }

    /// Blocks the rays whose starts are cut off from their surfaces, and attenuates those that partly are.
    fn climb<A: Accel, P: Observer>(&mut self, context: &Context, caster: &mut RayCaster<A>, probe: &mut P) {
        if self.risers.is_empty() {
            return;
        }
        if !context.has_filters {
            let mut cut_off = vec![false; self.risers.len()];
            caster.occluded(&self.risers, &mut cut_off, probe);
            self.raised.iter().zip(cut_off).for_each(|(&i, cut_off)| self.occluded[i] |= cut_off);
            return;
        }
        // Each hit is evaluated itself, so prims known to be opaque need no special case.
        let (mut rays, mut raised) = (self.risers.clone(), self.raised.clone());
        let mut hits = vec![Hit::MISS; rays.len()];
        caster.closest(&rays, &mut hits, probe);
        while !rays.is_empty() && !caster.cancelled {
            let mut after = Vec::new();
            for k in 0..rays.len() {
                let (ray, i) = (rays[k], raised[k]);
                if !hits[k].is_some() {
                    continue;
                }
                let light = &mut self.light[i].radiance;
                let target = HitPrim::new(context.scene, context.world, hits[k].prim);
                *light *= filter_at(context, &target, &ray, &hits[k], None);
                self.occluded[i] |= is_dark(*light);
                if !self.occluded[i] {
                    (rays[after.len()], raised[after.len()]) = (ray, i);
                    after.push(hits[k]);
                }
            }
            rays.truncate(after.len());
            raised.truncate(after.len());
            hits.truncate(after.len());
            caster.next(&rays, &after, &mut hits, probe);
        }
    }

    /// Attenuates the light of rays at their next hits, and drops those left dark; the others go on.
    fn filter(&mut self, context: &Context, media: &mut MediaTable) {
        let mut kept = 0;
        for k in 0..self.going.len() {
            let (i, hit) = (self.going[k], self.hits[k]);
            if !hit.is_some() {
                continue;
            }
            let (ray, light, mut crossed) = (self.on_way[k], &mut self.light[i].radiance, self.crossed[k]);
            let ray_media = self.ray_media.get_mut(i).map(|ray_media| (ray_media, &mut *media));
            weaken(context, &ray, self.unbent.get(i), &mut crossed, &hit.into(), light, ray_media);
            self.occluded[i] = is_dark(*light);
            if self.occluded[i] {
                continue;
            }
            (self.going[kept], self.on_way[kept], self.after[kept], self.crossed[kept]) = (i, ray, hit, crossed);
            kept += 1;
        }
        self.going.truncate(kept);
        self.on_way.truncate(kept);
        self.after.truncate(kept);
        self.crossed.truncate(kept);
    }
}

/// Whether light is black or NaN.
fn is_dark(light: Vec3) -> bool {
    let shines = light.max_element() > 0.0;
    !shines
}
