//! The light that arrives at the points of a strip, and the shadow rays that ask whether it does.

use super::columns::{Column, Columns, Found, POINTS, Strip, get, padded, put};
use crate::accel::Ray;
use crate::math::Vec3;
use crate::math::bounds::offset_origin;
use crate::math::simd::{Kernel, Simd};
use crate::render::curve::STEEP;
use crate::render::shade::{LocalLight, Matter, Model, terminator, way};

/// What one light does at each point.
pub(super) struct Lit {
    /// 1 where it is seen.
    pub seen: [u32; POINTS],
    /// 1 where its light is so flat that shadow rays do not start on the triangle.
    pub grazes: [u32; POINTS],
    to_light: Columns,
    /// Its strength, or irradiance, as the model wants it.
    light: Columns,
    pub radiance: Columns,
    /// The shadow ray.
    pub origin: Columns,
    pub dir: Columns,
    pub end: Column,
}

impl Default for Lit {
    fn default() -> Self {
        let empty = [[0.0; POINTS]; 3];
        Self {
            seen: [0; POINTS],
            grazes: [0; POINTS],
            to_light: empty,
            light: empty,
            radiance: empty,
            origin: empty,
            dir: empty,
            end: [0.0; POINTS],
        }
    }
}

/// A point that a light shines on.
pub(crate) struct Shone {
    /// The place of its ray in the wave.
    pub index: u32,
    pub radiance: Vec3,
    /// Whether the light is so flat that the shadow ray must be found by [`Surface`](crate::render::surface::Surface).
    pub grazes: bool,
    /// Start, direction and end of the shadow ray.
    pub origin: Vec3,
    pub dir: Vec3,
    pub end: f32,
}

impl Shone {
    /// The shadow ray, from prim `prim`.
    #[inline(always)]
    pub(crate) fn ray(&self, sample: u32, prim: u32) -> Ray {
        Ray { origin: self.origin, t_min: 0.0, dir: self.dir, t_max: self.end, exclude: prim, sample }
    }
}

impl Strip {
    /// Finds what `light` does at each point of a surface of `matter`.
    pub(crate) fn shine(&mut self, matter: &Matter, light: &LocalLight) {
        let (found, lit, points) = (&self.found, &mut self.lit, padded(self.count));
        self.level.run(Shine { found, lit, points, matter, light });
    }

    /// The points that it shines on.
    pub(crate) fn shone(&self) -> impl Iterator<Item = Shone> {
        let (found, lit) = (&self.found, &self.lit);
        (0..self.count.min(POINTS)).filter(|&i| lit.seen[i] & found.certain[i] == 1).map(|i| Shone {
            index: self.rays[i],
            radiance: get(&lit.radiance, i),
            grazes: lit.grazes[i] == 1,
            origin: get(&lit.origin, i),
            dir: get(&lit.dir, i),
            end: lit.end[i],
        })
    }
}

struct Shine<'a> {
    found: &'a Found,
    lit: &'a mut Lit,
    points: usize,
    matter: &'a Matter,
    light: &'a LocalLight,
}

impl Kernel for Shine<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { found, lit, points, matter, light } = self;
        let (points, light) = (points.min(POINTS), *light);
        let in_lux = matches!(matter.model, Model::MetalRough(_));
        light.arriving_at(
            points,
            |i| get(&found.position, i),
            |i, (incident, arrives)| {
                put(&mut lit.to_light, i, incident.to_light);
                put(&mut lit.light, i, if in_lux { incident.irradiance() } else { incident.strength() });
                lit.seen[i] = u32::from(arrives);
            },
        );
        // The model is chosen outside the loop, which then is a formula.
        match &matter.model {
            Model::Unlit(_) => lit.seen.fill(0),
            Model::Phong(m) => {
                let m = m.clone();
                reflect(found, lit, points, |normal, view, to_light| m.lit(normal, view, to_light));
            }
            Model::MetalRough(m) => {
                let m = m.clone();
                reflect(found, lit, points, |normal, view, to_light| m.lit(normal, view, to_light));
            }
        }
        match light.position() {
            Some(position) => start(found, lit, points, Some(position)),
            None => start(found, lit, points, None),
        }
    }
}

/// What the points reflect of the light that arrives.
#[inline(always)]
fn reflect(found: &Found, lit: &mut Lit, points: usize, share: impl Fn(Vec3, Vec3, Vec3) -> Vec3) {
    for i in 0..points.min(POINTS) {
        let (geometric, normal, to_light) = (get(&found.geometric, i), get(&found.normal, i), get(&lit.to_light, i));
        let curved = found.curved[i] == 1;
        let horizon = if curved { normal } else { geometric };
        let above = horizon.dot(to_light) > 0.0;
        let smooth = terminator(horizon, normal, to_light);
        let radiance = share(normal, get(&found.view, i), to_light) * get(&lit.light, i) * smooth;
        lit.seen[i] &= u32::from(above & radiance.is_finite() & (radiance.max_element() > 0.0));
        lit.grazes[i] = u32::from(curved & (geometric.dot(to_light) < STEEP));
        put(&mut lit.radiance, i, radiance);
    }
}

/// Where shadow rays start, and where they go.
#[inline(always)]
fn start(found: &Found, lit: &mut Lit, points: usize, light: Option<Vec3>) {
    for i in 0..points.min(POINTS) {
        let (position, error, geometric) = (get(&found.position, i), get(&found.error, i), get(&found.geometric, i));
        let to_light = get(&lit.to_light, i);
        let (dir, end) = way(offset_origin(position, error, geometric, to_light), to_light, light);
        put(&mut lit.origin, i, offset_origin(position, error, geometric, dir));
        put(&mut lit.dir, i, dir);
        lit.end[i] = end;
    }
}
