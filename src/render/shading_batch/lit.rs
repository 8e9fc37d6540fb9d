//! Direct light at the points of a batch, and the shadow rays that test it.

use super::area_lights::Drawn;
use super::columns::{Column, Columns, Found, LANES, POINTS, ShadingBatch, get, leave, padded, put};
use super::cones::Cones;
use super::constants::MaterialConstants;
use super::environment::Weigh;
use super::formulas::{
    Diffuse, Formula, Mapped, MetalRough, Phong, PointBsdf, SidedMetalRough, Uniform, WidenedMetalRough,
};
use super::overlays::Overlays;
use super::painted::Painted;
use crate::accel::Ray;
use crate::math::Vec3;
use crate::math::simd::{Kernel, Simd};
use crate::render::media::Media;
use crate::render::shade::{Bsdf, Incident, LocalLight, MetalRoughBsdf, Model, PhongBsdf, shadow_segment, terminator};
use crate::render::shade_hits::TracedRays;
use crate::render::shadow::curve::STEEP;
use crate::render::shadow::{Bound, ShadowQueue};

/// Marks light whose shadow ray starts on the triangle.
const PLAIN: u32 = 1;

/// Marks light at such a grazing angle that [`Surface`](crate::render::surface::Surface) must compute the shadow ray.
const GRAZING: u32 = 2;

/// Contribution of one light at each point.
#[repr(C, align(64))]
pub(super) struct Lit {
    /// [`PLAIN`] or [`GRAZING`] where the light is seen, else 0.
    pub seen: [u32; POINTS],
    pub to_light: Columns,
    /// Its strength, or irradiance, depending on the model.
    pub light: Columns,
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
            to_light: empty,
            light: empty,
            radiance: empty,
            origin: empty,
            dir: empty,
            end: [0.0; POINTS],
        }
    }
}

impl ShadingBatch {
    /// Computes the contribution of `light` at each point of a material; backs of one with an inside are seen from inside. For an
    /// area light, `place` is the index of each point's sample.
    pub(crate) fn shade_light(&mut self, constants: &MaterialConstants, light: &LocalLight, place: Option<u32>) {
        let (bsdf, has_inside) = (&constants.bsdf, constants.has_inside());
        let (found, lit, points) = (&self.found, &mut self.lit, padded(self.count));
        let (painted, point_bsdfs) = (&self.painted, &self.point_bsdfs);
        let overlays = self.overlays.as_deref().filter(|over| over.any());
        let cones = constants.needs_cones.then_some(&self.cones);
        let drawn = place.map(|place| (&mut self.drawn, place));
        let direct =
            DirectLight { found, lit, points, bsdf, painted, point_bsdfs, overlays, cones, has_inside, light, drawn };
        if place.is_some() {
            self.level.run(FromArea(direct))
        } else {
            self.level.run(FromPoint(direct))
        }
        if let Some(weights) = &self.weights {
            self.level.run(Weigh { weights, radiance: &mut self.lit.radiance, points });
        }
        if place.is_some() {
            for i in 0..points.min(POINTS) {
                let part = get(&self.lit.radiance, i) * self.drawn.part(i);
                put(&mut self.lit.radiance, i, part);
            }
        }
        if self.weights.is_some() || place.is_some() {
            for i in 0..points.min(POINTS) {
                let radiance = get(&self.lit.radiance, i);
                self.lit.seen[i] *= u32::from(radiance.is_finite() & (radiance.max_element() > 0.0));
            }
        }
    }

    /// Points that the light reaches: the sample of each, and the contribution.
    pub(crate) fn lit_samples(&self) -> impl Iterator<Item = (u32, Vec3)> {
        self.lit_as(|seen| seen != 0).map(|(i, radiance)| (self.samples[i], radiance))
    }

    /// Lit points whose shadow rays [`Self::send`] does not send: indices and contributions.
    pub(crate) fn grazing_points(&self) -> impl Iterator<Item = (usize, Vec3)> {
        let any = self.lit.seen[..padded(self.count)].iter().fold(0, |all, seen| all | seen) & GRAZING != 0;
        self.lit_as(move |seen| any && seen == GRAZING)
    }

    fn lit_as(&self, wanted: impl Fn(u32) -> bool) -> impl Iterator<Item = (usize, Vec3)> {
        let points = (0..self.count.min(POINTS)).filter(move |&i| wanted(self.lit.seen[i]));
        points.map(|i| (i, get(&self.lit.radiance, i)))
    }

    /// Drops the points whose shadow rays `sends` rejects; it gets the index of the traced ray that hit the point, the point's
    /// sample and its contribution.
    pub(crate) fn choose(&mut self, mut sends: impl FnMut(usize, u32, &mut Vec3) -> bool) {
        for i in 0..self.count.min(POINTS) {
            if self.lit.seen[i] == 0 {
                continue;
            }
            let mut radiance = get(&self.lit.radiance, i);
            if sends(self.rays[i] as usize, self.samples[i], &mut radiance) {
                put(&mut self.lit.radiance, i, radiance);
            } else {
                self.lit.seen[i] = 0;
            }
        }
    }

    /// Sends the shadow rays that start on their triangles, outside of all media where that matters.
    pub(crate) fn send(&self, shadows: &mut ShadowQueue, absorbs: bool) {
        let count = self.write(shadows);
        shadows.take(count, std::iter::repeat_n(Media::OUTSIDE, if absorbs { count } else { 0 }));
    }

    /// Sends the shadow rays, each starting in the media that the ray of its point is in.
    pub(crate) fn send_within(&self, shadows: &mut ShadowQueue, traced: TracedRays) {
        let count = self.write(shadows);
        let rays = self.rays.iter().zip(&self.lit.seen).filter(|(_, seen)| **seen == PLAIN);
        shadows.take(count, rays.map(|(&ray, _)| traced.path(ray as usize).media).take(count));
    }

    /// Writes the shadow rays that start on their triangles; returns their number.
    fn write(&self, shadows: &mut ShadowQueue) -> usize {
        let (rays, light) = shadows.room();
        let (prims, samples, lit) = (self.given.faces.prims(), &self.samples, &self.lit);
        self.level.run(Send { points: self.count.min(POINTS), prims, samples, lit, rays, light })
    }
}

struct Send<'a> {
    points: usize,
    prims: &'a [u32],
    samples: &'a [u32; POINTS],
    lit: &'a Lit,
    rays: &'a mut [Ray; POINTS],
    light: &'a mut [Bound; POINTS],
}

impl Kernel for Send<'_> {
    /// Number of rays written.
    type Output = usize;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> usize {
        let Self { points, prims, samples, lit, rays, light: bound } = self;
        let mut count = 0;
        let eights = prims.as_chunks::<LANES>().0.iter().zip(samples.as_chunks::<LANES>().0);
        for (k, (prims, samples)) in eights.enumerate().take(padded(points) / LANES) {
            let eight = |column: &Column| column.as_chunks::<LANES>().0[k];
            let three = |columns: &Columns| [eight(&columns[0]), eight(&columns[1]), eight(&columns[2])];
            let there = (1 << (points - k * LANES).min(LANES)) - 1;
            let which = s.find_word(PLAIN, &lit.seen.as_chunks().0[k]) & there;
            if which == 0 {
                continue;
            }
            let ([ox, oy, oz], [dx, dy, dz], end) = (three(&lit.origin), three(&lit.dir), eight(&lit.end));
            let from = s.rows([s.load(&ox), s.load(&oy), s.load(&oz), s.splat(0.0)]);
            let to = s.rows([s.load(&dx), s.load(&dy), s.load(&dz), s.load(&end)]);
            let [r, g, b] = three(&lit.radiance);
            // Sample indices only pass through the lanes, as bits.
            let light = s.rows([s.load(&r), s.load(&g), s.load(&b), s.load(bytemuck::cast_ref(samples))]);
            let mut put = |at: usize, i: usize| {
                rays[at % POINTS] = Ray::from_fours([from[i], to[i]], prims[i], samples[i]);
                bound[at % POINTS] = bytemuck::cast(light[i]);
            };
            if which == (1 << LANES) - 1 {
                (0..LANES).for_each(|i| put(count + i, i));
            } else {
                (0..LANES).filter(|i| which >> i & 1 == 1).enumerate().for_each(|(j, i)| put(count + j, i));
            }
            count += which.count_ones() as usize;
        }
        count
    }
}

/// Contribution of one light at the points.
struct DirectLight<'a> {
    found: &'a Found,
    lit: &'a mut Lit,
    points: usize,
    bsdf: &'a Bsdf,
    painted: &'a Painted,
    /// BSDFs of the points, where columns cannot describe them.
    point_bsdfs: &'a [Bsdf],
    /// Overlays of the points.
    overlays: Option<&'a Overlays>,
    /// Cones, where highlights may be narrow.
    cones: Option<&'a Cones>,
    has_inside: bool,
    light: &'a LocalLight,
    /// Samples of an area light, and the index of the current one.
    drawn: Option<(&'a mut Drawn, u32)>,
}

/// Kernel for a light without extent.
struct FromPoint<'a>(DirectLight<'a>);

impl Kernel for FromPoint<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.0.find::<false>();
    }
}

/// Kernel for an area light: separate, so that the other one stays vectorised.
struct FromArea<'a>(DirectLight<'a>);

impl Kernel for FromArea<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.0.find::<true>();
    }
}

impl DirectLight<'_> {
    #[inline(always)]
    fn find<const AREA: bool>(self) {
        let Self { found, lit, points, bsdf, painted, point_bsdfs, overlays, cones, has_inside, light, mut drawn } =
            self;
        let (points, light) = (points.min(POINTS), *light);
        let in_lux = matches!(bsdf.model, Model::MetalRough(_));
        debug_assert_eq!(AREA, drawn.is_some());
        let position = |i| get(&found.position, i);
        match &mut drawn {
            Some((drawn, place)) if AREA => {
                let [x, y] = drawn.places(*place, points);
                light.arriving_at(
                    points,
                    position,
                    |i| Some([x[i], y[i]]),
                    |i, (incident, arrives)| {
                        arrive(lit, i, incident, arrives & drawn.has(i, *place), in_lux);
                        put(&mut drawn.ends, i, incident.position.unwrap_or(Vec3::ZERO));
                    },
                );
            }
            _ => light.arriving_at(
                points,
                position,
                |_| None,
                |i, (incident, arrives)| arrive(lit, i, incident, arrives, in_lux),
            ),
        }
        // The model is matched outside the loops, which then need not branch on it.
        match bsdf.model {
            _ if !point_bsdfs.is_empty() => reflect_with_lobes(found, lit, point_bsdfs),
            Model::Unlit(_) => lit.seen.fill(0),
            Model::Phong(m) if painted.any => reflect_phong(found, lit, points, &Mapped { painted, unmapped: m }),
            Model::Phong(m) if m.glows() => reflect_phong(found, lit, points, &Uniform(m)),
            Model::Phong(m) => reflect(found, lit, points, &Diffuse(m)),
            Model::MetalRough(m) => {
                if painted.any {
                    let mapped = Mapped { painted, unmapped: m };
                    reflect_metal_rough(found, lit, points, mapped, overlays, cones, has_inside);
                } else {
                    reflect_metal_rough(found, lit, points, Uniform(m), overlays, cones, has_inside);
                }
            }
        }
        if !light.shadows {
            return;
        }
        match (light.position(), drawn) {
            (None, _) => start(found, lit, points, |_| None),
            (_, Some((drawn, _))) if AREA => start(found, lit, points, |i| Some(get(&drawn.ends, i))),
            (Some(position), _) => start(found, lit, points, |_| Some(position)),
        }
    }
}

/// Stores the light that arrives at a point.
#[inline(always)]
fn arrive(lit: &mut Lit, i: usize, incident: Incident, arrives: bool, in_lux: bool) {
    put(&mut lit.to_light, i, incident.to_light);
    put(&mut lit.light, i, if in_lux { incident.irradiance() } else { incident.strength() });
    lit.seen[i] = u32::from(arrives);
}

/// Computes the light that points of Phong's model reflect.
#[inline(always)]
fn reflect_phong(found: &Found, lit: &mut Lit, points: usize, bsdfs: &impl PointBsdf<Bsdf = PhongBsdf>) {
    let highlights = &highlights(found, lit, points, bsdfs);
    reflect(found, lit, points, &Phong { bsdfs, highlights });
}

/// Computes the light that metallic-rough points reflect. Points with overlays, or with an inside, always have cones.
#[inline(always)]
fn reflect_metal_rough(
    found: &Found,
    lit: &mut Lit,
    points: usize,
    bsdfs: impl PointBsdf<Bsdf = MetalRoughBsdf>,
    overlays: Option<&Overlays>,
    cones: Option<&Cones>,
    has_inside: bool,
) {
    let Some(Cones { least_square, .. }) = cones else { return reflect(found, lit, points, &MetalRough(bsdfs)) };
    let widened = WidenedMetalRough { bsdfs, least_square };
    match overlays {
        Some(overlays) => {
            reflect_below(found, lit, points, &widened);
            overlays.reflect(found, lit, points);
            keep_all(found, lit, points);
        }
        None if has_inside => reflect(found, lit, points, &SidedMetalRough { widened, front: &found.front }),
        None => reflect(found, lit, points, &widened),
    }
}

/// Phong's highlight at each point. Powers are computed one by one, and only for visible highlights.
#[inline(always)]
fn highlights(found: &Found, lit: &Lit, points: usize, bsdfs: &impl PointBsdf<Bsdf = PhongBsdf>) -> Column {
    let mut highlights = [0.0; POINTS];
    for (i, highlight) in highlights.iter_mut().enumerate().take(points) {
        let (normal, to_light) = (get(&found.normal, i), get(&lit.to_light, i));
        let agreement = PhongBsdf::agreement(normal, get(&found.view, i), to_light);
        *highlight = if normal.dot(to_light) > 0.0 { agreement } else { 0.0 };
    }
    for (i, highlight) in highlights.iter_mut().enumerate().take(points) {
        let m = bsdfs.at(i);
        if lit.seen[i] != 0 && m.glows() {
            *highlight = m.highlight(*highlight);
        }
    }
    highlights
}

/// Stores the contribution of a light at a point, if it `counts`; `above` tells whether it lies above the horizon.
#[inline(always)]
fn keep(found: &Found, lit: &mut Lit, i: usize, radiance: Vec3, counts: bool, above: bool) {
    let grazes = above & (found.curved[i] == 1) & (get(&found.geometric, i).dot(get(&lit.to_light, i)) < STEEP);
    let seen = counts & radiance.is_finite() & (radiance.max_element() > 0.0) & (found.certain[i] == 1);
    let how = if grazes { GRAZING } else { PLAIN };
    lit.seen[i] *= if seen { how } else { 0 };
    put(&mut lit.radiance, i, radiance);
}

/// Computes the light that points below overlays reflect.
#[inline(always)]
fn reflect_below(found: &Found, lit: &mut Lit, points: usize, formula: &impl Formula) {
    for i in 0..points.min(POINTS) {
        let (normal, view, to_light) = (get(&found.normal, i), get(&found.view, i), get(&lit.to_light, i));
        let radiance = formula.reflected(i, normal, view, to_light) * get(&lit.light, i);
        put(&mut lit.radiance, i, radiance);
    }
}

/// Keeps the contributions of light from above the horizon at all points.
#[inline(always)]
fn keep_all(found: &Found, lit: &mut Lit, points: usize) {
    for i in 0..points.min(POINTS) {
        let above = get(&found.horizon, i).dot(get(&lit.to_light, i)) > 0.0;
        let radiance = get(&lit.radiance, i);
        keep(found, lit, i, radiance, above, above);
    }
}

/// Computes the light that points with further lobes reflect and transmit.
fn reflect_with_lobes(found: &Found, lit: &mut Lit, point_bsdfs: &[Bsdf]) {
    for (i, bsdf) in point_bsdfs.iter().enumerate().take(POINTS) {
        let (horizon, normal, view) = (get(&found.horizon, i), get(&found.normal, i), get(&found.view, i));
        let (to_light, light) = (get(&lit.to_light, i), get(&lit.light, i));
        let counts = (lit.seen[i] != 0) & (found.certain[i] == 1);
        let above = horizon.dot(to_light) > 0.0;
        let radiance = match (counts, above) {
            (true, true) => bsdf.lit_with_lobes(horizon, normal, view, to_light, light),
            (true, false) => bsdf.lit_through_lobes(normal, view, to_light, light),
            (false, _) => Vec3::ZERO,
        };
        keep(found, lit, i, radiance, counts, above);
    }
    lit.seen[point_bsdfs.len().min(POINTS)..].fill(0);
}

/// Computes the light that the points reflect.
#[inline(always)]
fn reflect(found: &Found, lit: &mut Lit, points: usize, formula: &impl Formula) {
    for i in 0..points.min(POINTS) {
        let (horizon, normal, to_light) = (get(&found.horizon, i), get(&found.normal, i), get(&lit.to_light, i));
        let above = horizon.dot(to_light) > 0.0;
        let smooth = terminator(horizon, normal, to_light);
        let reflected = formula.reflected(i, normal, get(&found.view, i), to_light);
        let radiance = reflected * get(&lit.light, i) * smooth;
        keep(found, lit, i, radiance, above, above);
    }
}

/// Computes origins and directions of the shadow rays.
#[inline(always)]
fn start(found: &Found, lit: &mut Lit, points: usize, light: impl Fn(usize) -> Option<Vec3>) {
    let mut turned = 0;
    for i in 0..points.min(POINTS) {
        let (geometric, to_light) = (get(&found.geometric, i), get(&lit.to_light, i));
        let origin = leave(found, i, to_light);
        let (dir, end) = shadow_segment(origin, to_light, light(i));
        put(&mut lit.origin, i, origin);
        put(&mut lit.dir, i, dir);
        lit.end[i] = end;
        turned |= u32::from((geometric.dot(to_light) < 0.0) != (geometric.dot(dir) < 0.0));
    }
    // A ray leaves on the side it goes to; that is hardly ever another side than the light's.
    if turned == 1 {
        for i in 0..points.min(POINTS) {
            put(&mut lit.origin, i, leave(found, i, get(&lit.dir, i)));
        }
    }
}
