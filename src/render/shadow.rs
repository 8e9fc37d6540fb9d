//! Shadow rays: one for each light that a point could see, traced in waves.

use super::absorption::Absorption;
use super::asking::Asking;
use super::context::{Context, coverage};
use super::curve::Feelers;
use super::observer::Observer;
use super::optics::transmittance;
use super::seam::is_same_crossing;
use super::shade::{Reader, has_inside, shadow_filter};
use super::surface::{Surface, Target};
use super::tail::Tail;
use super::wave::{Media, Medium};
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;
use bytemuck::{Pod, Zeroable};

/// Shadow rays that wait, each with the light it lets through. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Shadows {
    rays: Tail<Ray>,
    light: Tail<Bound>,
    /// What each is inside of; empty where nothing absorbs light.
    inside: Vec<Inside>,
    /// The ways up to where some of the rays start, and which those are.
    risers: Vec<Ray>,
    raised: Vec<usize>,
    blocked: Vec<bool>,
    /// The hit that each ray has passed last.
    after: Vec<Hit>,
    /// The same for the rays that go on, while they are picked out.
    kept: Vec<Hit>,
    hits: Vec<Hit>,
}

/// Light that arrives if nothing is in the way.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Bound {
    pub radiance: Vec3,
    /// Where it arrives: its ray's sample, or what else whoever sent it says.
    pub tag: u32,
}

/// What a ray is inside of.
#[derive(Clone, Copy, Debug)]
struct Inside {
    media: Media,
    /// Up to this t of the ray its light has been lessened by what absorbs it there.
    since: f32,
}

impl Shadows {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a ray; `light` is what its sample sees if nothing is in the way, `media` what it starts inside of: of all rays of
    /// an image, or of none.
    pub(crate) fn push(&mut self, ray: Ray, light: Vec3, media: Option<Media>) {
        self.push_bound(ray, Bound { radiance: light, tag: ray.sample }, media);
    }

    /// The same of a ray that may start above its surface.
    pub(crate) fn push_feelers(&mut self, feelers: &Feelers, light: Vec3, media: Option<Media>) {
        if let Some(riser) = feelers.riser {
            self.raised.push(self.rays.len());
            self.risers.push(riser);
        }
        self.push(feelers.ray, light, media);
    }

    /// The same as [`Self::push`] of light that need not be bound for the ray's sample.
    pub(crate) fn push_bound(&mut self, ray: Ray, light: Bound, media: Option<Media>) {
        self.rays.push(ray);
        self.light.push(light);
        self.inside.extend(media.map(|media| Inside { media, since: 0.0 }));
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
        self.inside.extend(media.map(|media| Inside { media, since: 0.0 }));
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.light.clear();
        self.inside.clear();
        self.risers.clear();
        self.raised.clear();
    }

    /// Traces all rays and hands what arrives to `arrive`, as (sample or tag, light) in an order that is always the same.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        asking: &mut Asking<A>,
        probe: &mut P,
        mut arrive: impl FnMut(u32, Vec3),
    ) {
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        // Where hardly anything is opaque, what is will be met on the way.
        if !context.world.is_mostly_open() {
            asking.occluded(&self.rays, &mut self.blocked, probe);
        }
        self.climb(context, asking, probe);
        if !context.has_filters {
            let open = self.light.iter().zip(&self.blocked).filter(|(_, blocked)| !**blocked);
            open.for_each(|(light, _)| arrive(light.tag, light.radiance));
            return self.clear();
        }

        // Walk through what is on the way of those that are left, one surface of each ray a time.
        let blocked = std::mem::take(&mut self.blocked);
        self.keep(|i, _, _, _| !blocked[i]);
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

    /// Blocks the rays whose starts are cut off from their surfaces, and weakens those that are so in part.
    fn climb<A: Accel, P: Observer>(&mut self, context: &Context, asking: &mut Asking<A>, probe: &mut P) {
        if self.risers.is_empty() {
            return;
        }
        if !context.has_filters {
            let mut cut_off = vec![false; self.risers.len()];
            asking.occluded(&self.risers, &mut cut_off, probe);
            self.raised.iter().zip(cut_off).for_each(|(&i, cut_off)| self.blocked[i] |= cut_off);
            return;
        }
        // What they meet is asked itself, so that it does not matter of what it is known that it stops light.
        let (mut rays, mut raised) = (self.risers.clone(), self.raised.clone());
        let mut hits = vec![Hit::MISS; rays.len()];
        asking.closest(&rays, &mut hits, probe);
        while !rays.is_empty() && !asking.cancelled {
            let mut after = Vec::new();
            for k in 0..rays.len() {
                let (ray, i) = (rays[k], raised[k]);
                if !hits[k].is_some() {
                    continue;
                }
                let light = &mut self.light[i].radiance;
                *light *= filter_at(context, &ray, &hits[k], None);
                self.blocked[i] |= light.max_element() <= 0.0;
                if !self.blocked[i] {
                    (rays[after.len()], raised[after.len()]) = (ray, i);
                    after.push(hits[k]);
                }
            }
            rays.truncate(after.len());
            raised.truncate(after.len());
            hits.truncate(after.len());
            asking.next(&rays, &after, &mut hits, probe);
        }
    }

    /// Hands over the light of rays that met nothing more, weakens that of the others, and drops those it leaves dark.
    fn filter(&mut self, context: &Context, arrive: &mut impl FnMut(u32, Vec3)) {
        let hits = std::mem::take(&mut self.hits);
        let after = std::mem::take(&mut self.after);
        let mut kept = std::mem::take(&mut self.kept);
        self.keep(|i, ray, light, inside| {
            let hit = &hits[i];
            if !hit.is_some() {
                arrive(light.tag, light.radiance);
                return false;
            }
            if !after.get(i).is_some_and(|before| is_same_crossing(|prim| context.face(prim), ray, before, hit)) {
                light.radiance *= filter_at(context, ray, hit, inside);
            }
            let goes_on = light.radiance.max_element() > 0.0;
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

    /// Drops the rays for which `wanted` (index, ray, light, what they are inside of) is false; the others keep their order.
    fn keep(&mut self, mut wanted: impl FnMut(usize, &Ray, &mut Bound, Option<&mut Inside>) -> bool) {
        let mut kept = 0;
        for i in 0..self.rays.len() {
            let (mut light, mut inside) = (self.light[i], self.inside.get(i).copied());
            if wanted(i, &self.rays[i], &mut light, inside.as_mut()) {
                self.rays[kept] = self.rays[i];
                self.light[kept] = light;
                if let Some(inside) = inside {
                    self.inside[kept] = inside;
                }
                kept += 1;
            }
        }
        self.rays.truncate(kept);
        self.light.truncate(kept);
        self.inside.truncate(kept);
    }
}

/// What the surface at `hit` lets through. Maps are read at full sharpness: the shadow's own distance is unknown here.
fn filter_at(context: &Context, ray: &Ray, hit: &Hit, inside: Option<&mut Inside>) -> Vec3 {
    let target = Target::new(context.scene, context.world, hit.prim);
    if target.material.is_opaque() && !context.everything {
        return Vec3::ZERO;
    }
    if !target.material.surface.transmits()
        && let Some(opacity) = target.opacity(hit, context.textures)
    {
        return Vec3::splat(1.0 - coverage(target.material, opacity));
    }
    let patch = target.patch(context.world, hit.u, hit.v, ray.origin + ray.dir * hit.t);
    let reader = Reader { store: context.textures, patch: patch.as_ref(), known: &[] };
    let filter = shadow_filter(target.material, &reader);
    let Some(inside) = inside.filter(|_| has_inside(target.material)) else { return filter };
    let entering = Surface::new(context.world, target, ray, hit, 0.0).front;
    filter * inside.cross(target.material_id, entering, ray, hit, &context.absorption)
}

impl Inside {
    /// Goes in or out through the surface of a material: what is left of the light before that.
    fn cross(&mut self, material: u32, entering: bool, ray: &Ray, hit: &Hit, absorption: &Absorption) -> Vec3 {
        let crossing = self.media.cross(Medium { material, ior: 1.0 }, entering);
        // What is left without having been entered was all around from the start.
        let before = if !entering && self.media == crossing.beyond {
            absorption.by(material)
        } else {
            absorption.within(&self.media)
        };
        let length = (hit.t - self.since) * ray.dir.length();
        *self = Self { media: crossing.beyond, since: hit.t };
        before.map_or(Vec3::ONE, |absorption| transmittance(absorption, length))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;

    const THIN: Vec3 = Vec3::new(0.0, 0.1, 1.0);
    const DENSE: Vec3 = Vec3::new(2.0, 0.2, 0.0);

    /// What is left where a ray of length 2 for each t meets faces of two volumes: (t, which, whether it enters).
    fn left(crossings: &[(f32, u32, bool)]) -> Vec3 {
        let dir = Vec3::new(0.0, 0.0, 2.0);
        let ray = Ray { origin: Vec3::ZERO, t_min: 0.0, dir, t_max: 9.0, exclude: NO_PRIM, sample: 0 };
        let mut inside = Inside { media: Media::default(), since: 0.0 };
        let absorption = Absorption::from(vec![THIN, DENSE]);
        let cross = |&(t, which, entering): &(f32, u32, bool)| {
            inside.cross(which, entering, &ray, &Hit { t, ..Hit::MISS }, &absorption)
        };
        crossings.iter().map(cross).product()
    }

    #[test]
    fn volumes_before_a_light_absorb_by_the_length_between_their_faces() {
        let near = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
        assert!(near(left(&[(1.0, 0, true), (2.5, 0, false)]), transmittance(THIN, 3.0)));
        assert!(near(
            left(&[(1.0, 0, true), (2.0, 0, false), (4.0, 0, true), (4.5, 0, false)]),
            transmittance(THIN, 3.0)
        ));
        assert!(near(left(&[(1.5, 0, false)]), transmittance(THIN, 3.0)), "from inside");
        // A dense one inside a thin one.
        let nested = left(&[(1.0, 0, true), (2.0, 1, true), (2.25, 1, false), (4.0, 0, false)]);
        assert!(near(nested, transmittance(THIN, 5.5) * transmittance(DENSE, 0.5)), "{nested}");
    }
}
