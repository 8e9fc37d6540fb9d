//! Shadow rays, to lights and to the surroundings, traced in waves.

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

/// Shadow rays that wait, each with the light it lets through. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct ShadowQueue {
    rays: Tail<Ray>,
    light: Tail<Bound>,
    /// What each is inside of; empty where nothing absorbs light.
    ray_media: Vec<RayMedia>,
    /// Of rays that end at what would bend or spread them the hit that each has left, with `t` as far as it may meet the same
    /// surface again.
    unbent: Vec<Hit>,
    /// The ways up to where some of the rays start, and which those are.
    risers: Vec<Ray>,
    raised: Vec<usize>,
    occluded: Vec<bool>,
    /// What they meet that lets light through in part, and that of one of them in order.
    filter_hits: RefCell<FilterHits>,
    in_order: Vec<FilterHit>,
    /// Those that go on from surface to surface: their numbers, the rays, the hit that each has passed last, the last that was
    /// no hole, and the one behind.
    going: Vec<usize>,
    on_way: Vec<Ray>,
    after: Vec<Hit>,
    crossed: Vec<Hit>,
    hits: Vec<Hit>,
}

/// Light that arrives if nothing is in the way.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Bound {
    pub radiance: Vec3,
    /// Where it arrives: its ray's sample, or what else its sender has said.
    pub tag: u32,
}

impl ShadowQueue {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a ray; `light` is what its sample sees if nothing is in the way, `media` what it starts inside of: of all rays of
    /// an image, or of none.
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

    /// Adds a ray that ends at glass, and has left this hit, with `t` as far as it may meet the same surface again: all rays, or
    /// none.
    pub(crate) fn push_unbent(&mut self, ray: Ray, left: Hit, light: Vec3, media: Option<Media>) {
        self.push(ray, light, media);
        self.unbent.push(left);
    }

    /// Adds a ray whose light need not be bound for its sample.
    pub(crate) fn push_bound(&mut self, ray: Ray, light: Bound, media: Option<Media>) {
        self.rays.push(ray);
        self.light.push(light);
        self.ray_media.extend(media.map(RayMedia::of));
    }

    /// Room for `N` more rays, and for the light of each; [`Self::take`] takes those that came.
    pub(crate) fn room<const N: usize>(&mut self) -> (&mut [Ray; N], &mut [Bound; N]) {
        (self.rays.room(Ray::zeroed()), self.light.room(Bound::zeroed()))
    }

    /// Takes the first so many of the rays that were written into the [`Self::room`], with what each starts inside of where
    /// something absorbs light.
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

    /// Traces all rays and hands what arrives to `arrive`, as (sample or tag, light) in the order of the rays.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        (context, media): (&Context, &mut MediaTable),
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
        self.go_through((context, media), caster, probe);
        let open = self.light.iter().zip(&self.occluded).filter(|(_, occluded)| !**occluded);
        open.for_each(|(light, _)| arrive(light.tag, light.radiance));
        self.clear();
    }

    /// Weakens the light of rays by all that they have met, in the order of the hits; of those that have met too much to note
    /// it all, tells that they go on by themselves.
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
                    (&self.rays[i], self.unbent.get(i)),
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

    /// Walks through what is on the way of those that go on, one surface of each ray a time.
    fn go_through<A: Accel, P: Observer>(
        &mut self,
        (context, media): (&Context, &mut MediaTable),
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

    /// Blocks the rays whose starts are cut off from their surfaces, and weakens those that are so in part.
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
        // What they meet is asked itself, so that it does not matter of what it is known that it stops light.
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

    /// Weakens the light of rays that have met something more, and blocks those it leaves dark; the others go on.
    fn filter(&mut self, context: &Context, media: &mut MediaTable) {
        let mut kept = 0;
        for k in 0..self.going.len() {
            let (i, hit) = (self.going[k], self.hits[k]);
            if !hit.is_some() {
                continue;
            }
            let (ray, light, mut crossed) = (self.on_way[k], &mut self.light[i].radiance, self.crossed[k]);
            let ray_media = self.ray_media.get_mut(i).map(|ray_media| (ray_media, &mut *media));
            weaken(context, (&ray, self.unbent.get(i)), &mut crossed, &hit.into(), light, ray_media);
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

/// Whether nothing is left of light, or nothing that is a number.
fn is_dark(light: Vec3) -> bool {
    let shines = light.max_element() > 0.0;
    !shines
}
