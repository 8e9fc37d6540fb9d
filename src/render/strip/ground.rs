//! Points of a strip one by one, for what no column knows: rays that go on through glass, and rays to the surroundings.

use super::columns::{Strip, get, leave};
use crate::accel::{NO_PRIM, Ray};
use crate::math::Vec3;
use crate::render::branch::Ground;
use crate::render::context::Context;
use crate::render::shade::{Matter, Model, Seen};
use crate::scene::Material;

/// One of the points, as rays that go on ask for it.
pub(crate) struct Spot<'a> {
    strip: &'a Strip,
    i: usize,
    material: (u32, &'a Material),
    /// Whether it is seen from outside.
    outside: bool,
}

impl Strip {
    /// The points that are shaded here.
    pub(crate) fn certain(&self) -> impl Iterator<Item = usize> {
        (0..self.count).filter(|&i| self.found.certain[i] == 1)
    }

    /// The place of the ray of point `i` in what was traced, its weight there, and the width of its cone.
    pub(crate) fn ray(&self, i: usize) -> (usize, Vec3, f32) {
        let weight = self.weights.as_ref().map_or(Vec3::ONE, |weights| get(weights, i));
        (self.rays[i] as usize, weight, self.cones.width[i])
    }

    /// The ground at point `i` of this material, by number too, the back of which is seen from inside if it `has_inside`.
    pub(crate) fn ground<'a>(&'a self, i: usize, material: (u32, &'a Material), has_inside: bool) -> Spot<'a> {
        Spot { strip: self, i, material, outside: self.found.front[i] == 1 || !has_inside }
    }
}

impl Spot<'_> {
    /// The material there, which is `even` where maps do not change it.
    pub(crate) fn matter(&self, even: &Matter) -> Matter {
        let (painted, i) = (&self.strip.painted, self.i);
        let (model, emission) = match &even.model {
            Model::Unlit(_) if painted.any => (Model::Unlit(painted.unlit(i)), painted.emission(i)),
            Model::Phong(m) if painted.any => (Model::Phong(painted.phong(i, m)), painted.emission(i)),
            Model::MetalRough(m) if painted.any => (Model::MetalRough(painted.metal_rough(i, m)), painted.emission(i)),
            Model::Unlit(color) => (Model::Unlit(*color), even.emission),
            Model::Phong(m) => (Model::Phong(*m), even.emission),
            Model::MetalRough(m) => (Model::MetalRough(*m), even.emission),
        };
        Matter::bare(model, emission, self.outside)
    }
}

impl Ground for Spot<'_> {
    fn material(&self) -> (u32, &Material) {
        self.material
    }

    fn seen(&self) -> Seen {
        Seen { outside: self.outside, ..self.strip.found.seen(self.i) }
    }

    fn is_front(&self) -> bool {
        self.strip.found.front[self.i] == 1
    }

    fn bend(&self, _: &Context) -> f32 {
        self.strip.cones.bend[self.i]
    }

    fn ray(&self, dir: Vec3, sample: u32) -> Ray {
        let (exclude, origin) = (self.strip.given.faces.prims()[self.i], leave(&self.strip.found, self.i, dir));
        debug_assert_ne!(exclude, NO_PRIM);
        Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude, sample }
    }
}
