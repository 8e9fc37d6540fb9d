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
use crate::accel::shapes::Prim;
use crate::accel::{Accel, Hit, Holes, Ray};
use crate::math::shear::RaySpace;
use crate::math::{Vec3, triangle};
use bytemuck::{Pod, Zeroable};
use std::cell::Cell;
use std::ops::Range;

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
    /// Which of them meet something that lets light through in part.
    in_part: Vec<Cell<bool>>,
    /// Those that go on from surface to surface: their numbers, the rays, the hit that each has passed last and the one behind.
    going: Vec<usize>,
    on_way: Vec<Ray>,
    after: Vec<Hit>,
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

    /// Traces all rays and hands what arrives to `arrive`, as (sample or tag, light) in the order of the rays.
    pub(crate) fn trace<A: Accel, P: Observer>(
        &mut self,
        context: &Context,
        asking: &mut Asking<A>,
        probe: &mut P,
        mut arrive: impl FnMut(u32, Vec3),
    ) {
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        let asks_holes = context.has_holes && P::HEARS_OF_HOLES;
        if asks_holes {
            self.in_part.clear();
            self.in_part.resize(self.rays.len(), Cell::new(false));
            let through = Through { context, rays: &self.rays, in_part: &self.in_part };
            asking.stopped(&through, &mut self.blocked, probe);
        } else if !context.world.is_mostly_clear() {
            // Where hardly anything is opaque, what is will be met on the way.
            asking.occluded(&self.rays, &mut self.blocked, probe);
        }
        self.climb(context, asking, probe);
        if context.has_filters {
            let wanted = |i: &usize| !self.blocked[*i] && (!asks_holes || self.in_part[*i].get());
            self.going.clear();
            self.going.extend((0..self.rays.len()).filter(wanted));
            self.go_through(context, asking, probe);
        }
        let open = self.light.iter().zip(&self.blocked).filter(|(_, blocked)| !**blocked);
        open.for_each(|(light, _)| arrive(light.tag, light.radiance));
        self.clear();
    }

    /// Walks through what is on the way of those that go on, one surface of each ray a time.
    fn go_through<A: Accel, P: Observer>(&mut self, context: &Context, asking: &mut Asking<A>, probe: &mut P) {
        self.on_way.clear();
        self.on_way.extend(self.going.iter().map(|&i| self.rays[i]));
        self.after.clear();
        self.after.resize(self.going.len(), Hit::MISS);
        self.hits.clone_from(&self.after);
        asking.closest(&self.on_way, &mut self.hits, probe);
        while !self.going.is_empty() {
            self.filter(context);
            self.hits.clear();
            self.hits.resize(self.going.len(), Hit::MISS);
            asking.next(&self.on_way, &self.after, &mut self.hits, probe);
        }
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

    /// Weakens the light of rays that have met something more, and blocks those it leaves dark; the others go on.
    fn filter(&mut self, context: &Context) {
        let mut kept = 0;
        for k in 0..self.going.len() {
            let (i, hit) = (self.going[k], self.hits[k]);
            if !hit.is_some() {
                continue;
            }
            let (ray, light) = (self.on_way[k], &mut self.light[i].radiance);
            *light *= if is_same_crossing(|prim| context.face(prim), &ray, &self.after[k], &hit) {
                // What stops light does so among others in its place, too.
                let stops = filter_at(context, &ray, &hit, None).max_element() <= 0.0;
                if stops { Vec3::ZERO } else { Vec3::ONE }
            } else {
                filter_at(context, &ray, &hit, self.inside.get_mut(i))
            };
            if light.max_element() <= 0.0 {
                self.blocked[i] = true;
                continue;
            }
            (self.going[kept], self.on_way[kept], self.after[kept]) = (i, ray, hit);
            kept += 1;
        }
        self.going.truncate(kept);
        self.on_way.truncate(kept);
        self.after.truncate(kept);
    }
}

/// Rays that ask what stops their light, and which of them have met what lets some through.
#[derive(Clone, Copy)]
pub(super) struct Through<'a> {
    context: &'a Context<'a>,
    pub rays: &'a [Ray],
    in_part: &'a [Cell<bool>],
}

impl Through<'_> {
    /// So many of the rays.
    pub(super) fn part(&self, rays: Range<usize>) -> Self {
        Self { rays: &self.rays[rays.clone()], in_part: &self.in_part[rays], ..*self }
    }

    /// What is left of light behind a prim where a ray meets it: all or nothing; `None` where it is neither, or where it
    /// takes more to know.
    fn left(&self, ray: &Ray, prim: u32) -> Option<bool> {
        let target = Target::new(self.context.scene, self.context.world, prim);
        if target.material.surface.transmits() {
            return None;
        }
        let Prim::Triangle(corners) = self.context.world.prim(prim) else { return None };
        let (t, u, v) = triangle::place(&RaySpace::checked(ray.origin, ray.dir).0, &corners);
        let opacity = target.opacity(&Hit { t, u, v, prim }, self.context.textures)?;
        match 1.0 - coverage(target.material, opacity) {
            0.0 => Some(false),
            1.0 => Some(true),
            _ => None,
        }
    }
}

impl Holes for Through<'_> {
    fn stops(&self, ray: usize, prim: u32) -> bool {
        let left = self.left(&self.rays[ray], prim);
        if left.is_none() {
            self.in_part[ray].set(true);
        }
        left == Some(false)
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
