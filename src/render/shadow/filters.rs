//! Transmission of light through see-through surfaces along shadow rays.
//!
//! While a structure searches for an occluder, it asks this filter about each prim that is not opaque ([`ShadowFilter`]). A prim
//! that blocks the light ends the search; holes are passed; all others are recorded ([`FilterHits`]) and attenuate the light
//! afterwards, in the order of the hits.

use crate::accel::shapes::Prim;
use crate::accel::{Hit, OccludedFilter, Ray};
use crate::math::shear::RaySpace;
use crate::math::{Vec3, triangle};
use crate::render::Settings;
use crate::render::context::Context;
use crate::render::media::absorption::Absorption;
use crate::render::media::{Media, MediaTable, Medium};
use crate::render::optics::transmittance;
use crate::render::seam::{is_same_crossing, is_same_surface};
use crate::render::shade::{Reader, has_inside, shadow_filter};
use crate::render::surface::{HitPrim, Surface};
use crate::render::texture::TextureStore;
use crate::render::world::World;
use crate::scene::Scene;
use std::cell::RefCell;
use std::ops::Range;

/// Media that a ray is inside of.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct RayMedia {
    media: Media,
    /// Parameter t up to which absorption has been applied to the ray's light.
    since: f32,
}

/// Attenuates light at the next hit on its way, behind the surface `crossed`, which the hit replaces unless it is a hole. Light
/// that must arrive unrefracted ends at glass, except for the surface that it has left.
pub(in crate::render) fn weaken(
    context: &Context,
    ray: &Ray,
    unbent: Option<&Hit>,
    crossed: &mut Hit,
    FilterHit { hit, left }: &FilterHit,
    light: &mut Vec3,
    ray_media: Option<(&mut RayMedia, &mut MediaTable)>,
) {
    if unbent.is_some_and(|left| hit.t <= left.t && is_same_surface(|prim| context.face(prim), ray, left, hit)) {
        return;
    }
    let is_repeated = is_same_crossing(|prim| context.face(prim), ray, crossed, hit);
    let (filter, is_hole) = match *left {
        Some(part) => (Vec3::splat(part), false),
        None => {
            let target = HitPrim::new(context.scene, context.world, hit.prim);
            let filter = match unbent.is_some() && context.turns(target.material) {
                true => Vec3::ZERO,
                false => filter_at(context, &target, ray, hit, ray_media.filter(|_| !is_repeated)),
            };
            let may_have_holes = !target.material.reflection.transmits() && hit.prim < context.world.triangles();
            (filter, may_have_holes && filter == Vec3::ONE)
        }
    };
    // A surface that blocks the light does so even among coincident ones.
    if !is_repeated || filter.max_element() <= 0.0 {
        *light *= filter;
    }
    if !is_hole {
        *crossed = *hit;
    }
}

/// A hit that light passes.
#[derive(Clone, Copy, Debug)]
pub(in crate::render) struct FilterHit {
    pub hit: Hit,
    /// Transmitted fraction of the light, where it is known: neither 0 nor 1.
    pub left: Option<f32>,
}

impl From<Hit> for FilterHit {
    fn from(hit: Hit) -> Self {
        Self { hit, left: None }
    }
}

/// Partially transmitting hits, each linked to the previous one of the same ray.
#[derive(Debug, Default)]
pub(in crate::render) struct FilterHits {
    passed: Vec<(FilterHit, u32)>,
    /// The last hit of each ray.
    last: Vec<u32>,
}

impl FilterHits {
    /// Marks rays without hits.
    pub(in crate::render) const NOTHING: u32 = u32::MAX;
    /// Marks rays whose hits must be found again.
    pub(in crate::render) const OVERFLOW: u32 = u32::MAX - 1;
    /// Maximum number of recorded hits: 7 MB.
    const MOST: usize = 1 << 18;

    pub(in crate::render) fn begin(&mut self, rays: usize) {
        self.passed.clear();
        self.last.clear();
        self.last.resize(rays, Self::NOTHING);
    }

    fn note(&mut self, ray: usize, passed: FilterHit) {
        let last = &mut self.last[ray];
        if *last == Self::OVERFLOW || self.passed.len() >= Self::MOST {
            *last = Self::OVERFLOW;
            return;
        }
        // −0 is not a distance of its own.
        let hit = Hit { t: passed.hit.t + 0.0, ..passed.hit };
        self.passed.push((FilterHit { hit, ..passed }, *last));
        *last = self.passed.len() as u32 - 1;
    }

    /// Last recorded hit of a ray.
    pub(in crate::render) fn last(&self, ray: usize) -> u32 {
        self.last[ray]
    }

    /// Lists the hits of a ray, from the last recorded one, in order along the ray, without duplicates.
    pub(in crate::render) fn list(&self, mut noted: u32, list: &mut Vec<FilterHit>) {
        list.clear();
        while let Some(&(passed, before)) = self.passed.get(noted as usize) {
            list.push(passed);
            noted = before;
        }
        list.sort_unstable_by(|FilterHit { hit: a, .. }, FilterHit { hit: b, .. }| {
            a.t.total_cmp(&b.t).then(a.prim.cmp(&b.prim))
        });
        list.dedup_by_key(|passed| (passed.hit.t.to_bits(), passed.hit.prim));
    }
}

/// See-through surfaces of a picture's scene, for shadow rays that are traced again.
pub struct Filters<'a>(Context<'a>);

/// Reusable buffer for the hits of rays that are traced again.
#[derive(Debug, Default)]
pub struct FilterScratch(RefCell<FilterHits>);

impl<'a> Filters<'a> {
    /// `None` where queries ask for opaque occluders alone: where all prims are opaque, and with [`Settings::no_prune`].
    pub fn of(scene: &'a Scene, world: &'a World, textures: &'a TextureStore<'a>, settings: &Settings) -> Option<Self> {
        let context = Context::new(scene, world, textures, settings);
        context.asks_filters().then_some(Self(context))
    }

    /// Filter for these rays.
    pub fn for_rays<'r>(&'r self, rays: &'r [Ray], noted: &'r mut FilterScratch) -> ShadowFilter<'r> {
        noted.0.get_mut().begin(rays.len());
        ShadowFilter::new(&self.0, rays, &noted.0)
    }
}

/// Decides which prims block shadow rays, and records those that let some light through.
#[derive(Clone, Copy)]
pub struct ShadowFilter<'a> {
    context: &'a Context<'a>,
    pub(in crate::render) rays: &'a [Ray],
    /// Index of the first ray.
    first: usize,
    filter_hits: &'a RefCell<FilterHits>,
}

impl<'a> ShadowFilter<'a> {
    /// Filter for all these rays, for whose hits `filter_hits` has room.
    pub(in crate::render) fn new(
        context: &'a Context<'a>,
        rays: &'a [Ray],
        filter_hits: &'a RefCell<FilterHits>,
    ) -> Self {
        Self { context, rays, first: 0, filter_hits }
    }

    /// Filter for a range of the rays.
    pub(in crate::render) fn part(&self, rays: Range<usize>) -> Self {
        Self { first: self.first + rays.start, rays: &self.rays[rays], ..*self }
    }

    fn note(&self, ray: usize, passed: FilterHit) {
        self.filter_hits.borrow_mut().note(self.first + ray, passed);
    }
}

impl OccludedFilter for ShadowFilter<'_> {
    fn stops(&self, number: usize, prim: u32) -> bool {
        let (context, ray) = (self.context, &self.rays[number]);
        if let Some(stops) = context.alpha_voids.as_ref().and_then(|alpha_voids| alpha_voids.stops(ray, prim)) {
            return stops;
        }
        let shape = context.world.prim(prim);
        let space = RaySpace::checked(ray.origin, ray.dir).0;
        let Prim::Triangle(corners) = shape else {
            let within = |t: &f32| (ray.t_min..=ray.t_max.min(f32::MAX)).contains(t);
            let ts = shape.distances(&space, ray.t_min >= 0.0).into_iter().filter(within);
            ts.for_each(|t| self.note(number, Hit { t, u: 0.0, v: 0.0, prim }.into()));
            return false;
        };
        let (t, u, v) = triangle::place(&space, &corners);
        let hit = Hit { t, u, v, prim };
        let left = left_behind(context, &HitPrim::new(context.scene, context.world, prim), &hit);
        let is_said = matches!(left, Some(0.0 | 1.0));
        if !is_said {
            self.note(number, FilterHit { hit, left });
        }
        left == Some(0.0)
    }
}

/// Transmitted fraction of light behind a surface, where it is cheap to compute.
fn left_behind(context: &Context, target: &HitPrim, hit: &Hit) -> Option<f32> {
    if target.material.reflection.transmits() {
        return None;
    }
    Some(1.0 - target.material.alpha_mode.covers(target.opacity(hit, context.textures)?))
}

/// Transmittance of the surface at `hit`. Maps are read at full resolution: the shadow's own distance is unknown here.
pub(in crate::render) fn filter_at(
    context: &Context,
    target: &HitPrim,
    ray: &Ray,
    hit: &Hit,
    ray_media: Option<(&mut RayMedia, &mut MediaTable)>,
) -> Vec3 {
    if target.material.is_opaque() && !context.no_prune {
        return Vec3::ZERO;
    }
    if let Some(left) = left_behind(context, target, hit) {
        return Vec3::splat(left);
    }
    let patch = target.patch(context.world, hit.u, hit.v, ray.origin + ray.dir * hit.t);
    let reader = Reader { store: context.textures, patch: patch.as_ref(), known: &[] };
    let filter = shadow_filter(target.material, &reader);
    let Some((ray_media, table)) = ray_media.filter(|_| has_inside(target.material)) else { return filter };
    let entering = Surface::new(context.world, *target, ray, hit, 0.0).front;
    filter * ray_media.cross(table, &context.absorption, target.material_id, entering, ray, hit)
}

impl RayMedia {
    /// State of a ray that starts inside these media.
    pub(in crate::render) fn of(media: Media) -> Self {
        Self { media, since: 0.0 }
    }

    /// Crosses the surface of a material; returns the transmittance of the medium before it.
    fn cross(
        &mut self,
        table: &mut MediaTable,
        absorption: &Absorption,
        material: u32,
        entering: bool,
        ray: &Ray,
        hit: &Hit,
    ) -> Vec3 {
        let crossing = table.cross(self.media, Medium { material, ior: 1.0 }, entering);
        // A medium left without having been entered was around the ray from the start.
        let before = if !entering && self.media == crossing.beyond {
            absorption.by(material)
        } else {
            absorption.within(table, self.media)
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

    /// Transmittance where a ray of length 2 per unit of t crosses faces of two volumes: (t, which, whether it enters).
    fn left(crossings: &[(f32, u32, bool)]) -> Vec3 {
        let dir = Vec3::new(0.0, 0.0, 2.0);
        let ray = Ray { origin: Vec3::ZERO, t_min: 0.0, dir, t_max: 9.0, exclude: NO_PRIM, sample: 0 };
        let (mut table, mut ray_media) = (MediaTable::default(), RayMedia::of(Media::OUTSIDE));
        let absorption = Absorption::from(vec![THIN, DENSE]);
        let cross = |&(t, which, entering): &(f32, u32, bool)| {
            ray_media.cross(&mut table, &absorption, which, entering, &ray, &Hit { t, ..Hit::MISS })
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
        // A dense volume inside a thin one.
        let nested = left(&[(1.0, 0, true), (2.0, 1, true), (2.25, 1, false), (4.0, 0, false)]);
        assert!(near(nested, transmittance(THIN, 5.5) * transmittance(DENSE, 0.5)), "{nested}");
    }
}
