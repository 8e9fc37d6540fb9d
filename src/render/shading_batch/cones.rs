//! Footprints of ray cones at the points of a batch, and the curvature of the surface within: they determine the width of narrow
//! highlights, and the cones of mirror rays.

use super::columns::{Column, Columns, Found, HitData, POINTS, ShadingBatch, get, leave, padded, put};
use super::constants::MaterialConstants;
use super::painted::Painted;
use crate::accel::{Hit, NO_PRIM, Ray};
use crate::math::Vec3;
use crate::math::simd::{Kernel, Simd};
use crate::render::context::Context;
use crate::render::glint;
use crate::render::patch::Footprint;
use crate::render::shade::{Bsdf, Model};
use crate::render::shade_hits::TracedRays;
use crate::render::wave::{Path, Queue, RayClass};
use crate::render::world::Placement;

/// Cones of the rays, by point.
pub(crate) struct Cones {
    /// Width at the point, and growth.
    pub(super) width: Column,
    pub(super) spread: Column,
    /// Axes of the ellipse where the cone meets the surface.
    along: Columns,
    across: Columns,
    /// Squared angles by which the mesh's own normal turns along both axes, summed, …
    pub(super) bend: Column,
    /// … and of those by which a normal map turns it within reach.
    pub(super) turning: Column,
    /// Lower bound of α² in highlights of lights.
    pub(super) least_square: Column,
    mirrored: Mirrored,
}

/// Mirror rays.
struct Mirrored {
    /// 1 where the mirror ray weighs enough to be sent.
    alive: [u32; POINTS],
    weight: Columns,
    origin: Columns,
    dir: Columns,
    spread: Column,
}

/// Weights of eye rays.
pub(super) const ONES: Columns = [[1.0; POINTS]; 3];

impl Default for Cones {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        let mirrored = Mirrored { alive: [0; POINTS], weight: three, origin: three, dir: three, spread: one };
        Self {
            width: one,
            spread: one,
            along: three,
            across: three,
            bend: one,
            turning: one,
            least_square: one,
            mirrored,
        }
    }
}

impl Cones {
    /// Footprint of the cone at point `i`.
    #[inline(always)]
    pub(super) fn footprint(&self, i: usize) -> Footprint {
        Footprint { along: get(&self.along, i), across: get(&self.across, i) }
    }
}

impl ShadingBatch {
    /// Computes the footprints of the rays' cones.
    pub(crate) fn widen(&mut self, traced: TracedRays) {
        let count = self.count.min(POINTS);
        let Self { cones, found, rays, .. } = self;
        cones.turning.fill(0.0);
        for (i, &ray) in rays[..count].iter().enumerate() {
            let (Path { cone_width, cone_spread, .. }, hit) = (traced.path(ray as usize), &traced.hits()[ray as usize]);
            (cones.width[i], cones.spread[i]) = (cone_width + cone_spread * hit.t, cone_spread);
        }
        self.level.run(Footprints { found, cones, points: padded(count) });
    }

    /// Computes the curvature of the surface within the cones, and the width of highlights, unless that is done when points are
    /// completed; `placement` is given where the mesh has vertex normals.
    pub(crate) fn bend(&mut self, context: &Context, constants: &MaterialConstants, placement: Option<&Placement>) {
        let bsdf = &constants.bsdf;
        let Self { cones, painted, given, found, .. } = self;
        let (points, reach) = (padded(self.count), context.highlight_reach);
        match placement {
            Some(placement) => self.level.run(Bend { given, found, cones, points, placement }),
            None => cones.bend.fill(0.0),
        }
        if !context.lights.is_empty() && !constants.is_completed() {
            self.level.run(WidenHighlights { painted, cones, points, bsdf, reach });
        }
    }

    /// Queues the mirror rays of a surface of `bsdf`.
    pub(crate) fn mirror(
        &mut self,
        context: &Context,
        bsdf: &Bsdf,
        traced: TracedRays,
        goes_on: impl Fn(u32, &mut Path) -> bool,
        to: &mut Queue,
    ) {
        let Self { cones, painted, found, given, weights, .. } = self;
        let (points, cutoff) = (padded(self.count), context.least_cutoff());
        let weights = weights.as_ref().unwrap_or(&ONES);
        self.level.run(Mirror { painted, found, cones, points, bsdf, weights, cutoff });
        let Mirrored { alive, weight, origin, dir, spread } = &cones.mirrored;
        let prims = given.faces.prims();
        for i in (0..self.count.min(POINTS)).filter(|&i| alive[i] == 1) {
            let path = traced.path(self.rays[i] as usize);
            if path.depth >= context.depth || !context.is_alive(get(weight, i), path.part) {
                continue;
            }
            let (exclude, sample) = (prims[i], self.samples[i]);
            let (origin, dir) = (get(origin, i), get(dir, i));
            let ray = Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude, sample };
            debug_assert_ne!(exclude, NO_PRIM);
            let (cone_width, cone_spread, weight) = (cones.width[i], spread[i], get(weight, i));
            let depth = path.depth + 1;
            let path = Path {
                weight,
                depth,
                straight: false,
                skips_hotspot: false,
                since: 0.0,
                cone_width,
                cone_spread,
                ..path
            };
            let mut path = path.turned(RayClass::Reflected, 0);
            if goes_on(sample, &mut path) {
                to.push(ray, path, Hit::MISS);
            }
        }
    }
}

struct Footprints<'a> {
    found: &'a Found,
    cones: &'a mut Cones,
    points: usize,
}

impl Kernel for Footprints<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { found, cones, points } = self;
        for i in 0..points.min(POINTS) {
            let (view, geometric) = (get(&found.view, i), get(&found.geometric, i));
            let Footprint { along, across } = Footprint::new(-view, geometric, cones.width[i]);
            put(&mut cones.along, i, along);
            put(&mut cones.across, i, across);
        }
    }
}

struct Bend<'a> {
    given: &'a HitData,
    found: &'a Found,
    cones: &'a mut Cones,
    points: usize,
    placement: &'a Placement,
}

impl Kernel for Bend<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { given, found, cones, points, placement } = self;
        let placement = *placement;
        for i in 0..points.min(POINTS) {
            let (faces, weights) = (&given.faces, given.corner_weights(i));
            let Footprint { along, across } = cones.footprint(i);
            let [along, across] = faces.gradients(i).of_normal(&placement, faces.normals(i), weights, [along, across]);
            let bend = along.length_squared() + across.length_squared();
            cones.bend[i] = if found.curved[i] == 1 { bend } else { 0.0 };
        }
    }
}

struct WidenHighlights<'a> {
    painted: &'a Painted,
    cones: &'a mut Cones,
    points: usize,
    bsdf: &'a Bsdf,
    reach: f32,
}

impl Kernel for WidenHighlights<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { painted, cones, points, bsdf, reach } = self;
        let Model::MetalRough(m) = &bsdf.model else { return };
        let (any, even) = (painted.any, *m);
        for i in 0..points.min(POINTS) {
            let m = if any { painted.metal_rough(i, &even) } else { even };
            let turning = cones.bend[i] * (reach * reach) + cones.turning[i];
            cones.least_square[i] = m.least_square_where_narrow(glint::least_of(turning, cones.spread[i], reach));
        }
    }
}

struct Mirror<'a> {
    painted: &'a Painted,
    found: &'a Found,
    cones: &'a mut Cones,
    points: usize,
    bsdf: &'a Bsdf,
    weights: &'a Columns,
    cutoff: f32,
}

impl Kernel for Mirror<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { painted, found, cones, points, bsdf, weights, cutoff } = self;
        let any = painted.any;
        match &bsdf.model {
            Model::Unlit(_) => cones.mirrored.alive.fill(0),
            Model::Phong(m) if any => {
                let m = *m;
                mirror(found, cones, points, weights, cutoff, |i, cosine| painted.phong(i, &m).reflected(cosine));
            }
            Model::Phong(m) => {
                let m = *m;
                mirror(found, cones, points, weights, cutoff, |_, cosine| m.reflected(cosine));
            }
            Model::MetalRough(m) if any => {
                let m = *m;
                mirror(found, cones, points, weights, cutoff, |i, cosine| painted.metal_rough(i, &m).reflected(cosine));
            }
            Model::MetalRough(m) => {
                let m = *m;
                mirror(found, cones, points, weights, cutoff, |_, cosine| m.reflected(cosine));
            }
        }
    }
}

/// Computes mirror rays of points that reflect `share` at the cosine of the view; they follow rays with these weights, and are
/// sent if above the cutoff.
#[inline(always)]
fn mirror(
    found: &Found,
    cones: &mut Cones,
    points: usize,
    weights: &Columns,
    cutoff: f32,
    share: impl Fn(usize, f32) -> Vec3,
) {
    let Cones { mirrored: to, bend, spread, .. } = cones;
    for i in 0..points.min(POINTS) {
        let seen = found.seen(i);
        let weight = get(weights, i) * share(i, seen.normal.dot(seen.view));
        let dir = seen.mirrored();
        put(&mut to.weight, i, weight);
        put(&mut to.dir, i, dir);
        put(&mut to.origin, i, leave(found, i, dir));
        to.spread[i] = glint::behind(bend[i], spread[i], glint::MIRROR);
        to.alive[i] = u32::from((weight.max_element() >= cutoff) & (found.certain[i] == 1));
    }
}
