//! Shadow rays: one for each light that a point could see, traced in waves.

use super::asking::Asking;
use super::context::Context;
use super::observer::Observer;
use super::optics::transmittance;
use super::seam::is_same_crossing;
use super::shade::{Reader, shadow_filter};
use super::surface::{Footprint, Surface, Target};
use crate::accel::{Accel, Hit, Ray};
use crate::math::Vec3;

/// Shadow rays that wait, each with the light it lets through. Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Shadows {
    rays: Vec<Ray>,
    light: Vec<Vec3>,
    inside: Vec<Inside>,
    blocked: Vec<bool>,
    /// The hit that each ray has passed last.
    after: Vec<Hit>,
    /// The same for the rays that go on, while they are picked out.
    kept: Vec<Hit>,
    hits: Vec<Hit>,
}

/// What absorbs the light of a ray.
#[derive(Clone, Copy, Debug)]
struct Inside {
    /// 1 / unit of length.
    absorption: Vec3,
    /// From this t of the ray on.
    since: f32,
}

impl Shadows {
    pub(crate) fn len(&self) -> usize {
        self.rays.len()
    }

    /// Adds a ray; `light` is what its sample sees if nothing is in the way, `absorption` the coefficient of what it starts
    /// inside of.
    pub(crate) fn push(&mut self, ray: Ray, light: Vec3, absorption: Vec3) {
        self.rays.push(ray);
        self.light.push(light);
        self.inside.push(Inside { absorption, since: 0.0 });
    }

    pub(crate) fn clear(&mut self) {
        self.rays.clear();
        self.light.clear();
        self.inside.clear();
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

    /// Hands over the light of rays that met nothing more, weakens that of the others, and drops those it leaves dark.
    fn filter(&mut self, context: &Context, arrive: &mut impl FnMut(u32, Vec3)) {
        let hits = std::mem::take(&mut self.hits);
        let after = std::mem::take(&mut self.after);
        let mut kept = std::mem::take(&mut self.kept);
        self.keep(|i, ray, light, inside| {
            let hit = &hits[i];
            if !hit.is_some() {
                arrive(ray.sample, *light);
                return false;
            }
            if !after.get(i).is_some_and(|before| is_same_crossing(&context.world.shapes, ray, before, hit)) {
                *light *= filter_at(context, ray, hit, inside);
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

    /// Drops the rays for which `wanted` (index, ray, light, what they are inside of) is false; the others keep their order.
    fn keep(&mut self, mut wanted: impl FnMut(usize, &Ray, &mut Vec3, &mut Inside) -> bool) {
        let mut kept = 0;
        for i in 0..self.rays.len() {
            let (mut light, mut inside) = (self.light[i], self.inside[i]);
            if wanted(i, &self.rays[i], &mut light, &mut inside) {
                self.rays[kept] = self.rays[i];
                self.light[kept] = light;
                self.inside[kept] = inside;
                kept += 1;
            }
        }
        self.rays.truncate(kept);
        self.light.truncate(kept);
        self.inside.truncate(kept);
    }
}

/// What the surface at `hit` lets through. Maps are read at full sharpness: the shadow's own distance is unknown here.
fn filter_at(context: &Context, ray: &Ray, hit: &Hit, inside: &mut Inside) -> Vec3 {
    let target = Target::new(context.scene, context.world, hit.prim);
    let absorbed = match context.absorption_by(target.material_id) {
        Some(absorption) => {
            let target = Target::new(context.scene, context.world, hit.prim);
            inside.cross(absorption, ray, hit, Surface::new(context.world, target, ray, hit, 0.0).front)
        }
        None => Vec3::ONE,
    };
    let patch = target.patch(context.world, hit.u, hit.v, ray.origin + ray.dir * hit.t);
    let footprint = Footprint::default();
    let reader = Reader { store: context.textures, patch: patch.as_ref(), footprint: &footprint };
    shadow_filter(target.material, &reader) * absorbed
}

impl Inside {
    /// Goes in or out through the surface of what absorbs with this coefficient: what is left of the light before that.
    fn cross(&mut self, absorption: Vec3, ray: &Ray, hit: &Hit, entering: bool) -> Vec3 {
        let length = (hit.t - self.since) * ray.dir.length();
        // What was never entered and is left must have been all around from the start.
        let before = if !entering && self.absorption == Vec3::ZERO { absorption } else { self.absorption };
        *self = Self { absorption: if entering { absorption } else { Vec3::ZERO }, since: hit.t };
        transmittance(before, length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;

    /// What is left where a ray of length 2 for each t meets these faces of one volume: (t, whether it enters).
    fn left(absorption: Vec3, crossings: &[(f32, bool)]) -> Vec3 {
        let dir = Vec3::new(0.0, 0.0, 2.0);
        let ray = Ray { origin: Vec3::ZERO, t_min: 0.0, dir, t_max: 9.0, exclude: NO_PRIM, sample: 0 };
        let mut inside = Inside { absorption: Vec3::ZERO, since: 0.0 };
        let hit = |t| Hit { t, ..Hit::MISS };
        crossings.iter().map(|&(t, entering)| inside.cross(absorption, &ray, &hit(t), entering)).product()
    }

    #[test]
    fn a_volume_before_a_light_absorbs_by_the_length_between_its_faces() {
        let absorption = Vec3::new(0.0, 0.1, 1.0);
        let after = |length: f32| transmittance(absorption, length);
        let near = |a: Vec3, b: Vec3| (a - b).length() < 1e-6;
        assert!(near(left(absorption, &[(1.0, true), (2.5, false)]), after(3.0)));
        assert!(near(left(absorption, &[(1.0, true), (2.0, false), (4.0, true), (4.5, false)]), after(3.0)));
        assert!(near(left(absorption, &[(1.5, false)]), after(3.0)), "from inside");
        assert_eq!(left(Vec3::ZERO, &[(1.0, true), (2.0, false)]), Vec3::ONE);
    }
}
