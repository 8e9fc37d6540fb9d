//! Environment light that the points of a batch reflect, and the light they emit.

use super::columns::{Column, Columns, Found, POINTS, ShadingBatch, get, padded, put};
use super::constants::MaterialConstants;
use super::overlays::Overlays;
use super::painted::Painted;
use crate::math::Vec3;
use crate::math::simd::{Kernel, LANES, Simd};
use crate::render::shade::{
    AlbedoRow, Bsdf, EnvironmentTerms, MetalRoughBsdf, Model, PhongBsdf, albedo_of_each, mean_albedo, open,
};
use crate::render::sky::Sky;
use crate::render::studio;
use crate::scene::UpAxis;

/// Environment light: of the sky, and the ambient term.
#[derive(Clone, Copy)]
pub(super) struct EnvironmentLight<'a> {
    pub sky: &'a Sky,
    pub ambient: Vec3,
}

/// Environment light at each point.
pub(super) struct Surroundings {
    /// Cosine of the view, and the shares of f0 and f90 there.
    n_v: Column,
    shares: [Column; 2],
    /// Mean albedo over the hemisphere.
    mean: Column,
    /// Unoccluded share of the mirrored light.
    open: Column,
    /// Directions of the mirrored lookups, in the studio.
    mirrored_dir: Columns,
    diffuse: Columns,
    mirrored: Columns,
    pub(super) radiance: Columns,
}

impl Default for Surroundings {
    fn default() -> Self {
        let (one, three) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
        Self {
            n_v: one,
            shares: [one; 2],
            mean: one,
            open: one,
            mirrored_dir: three,
            diffuse: three,
            mirrored: three,
            radiance: three,
        }
    }
}

impl ShadingBatch {
    /// Computes the light of `sky` and ambient light reflected by each point of a material; backs of one with an inside are seen
    /// from inside.
    pub(crate) fn shade_environment(&mut self, constants: &MaterialConstants, sky: &Sky, ambient: Vec3) {
        let (bsdf, has_inside) = (&constants.bsdf, constants.has_inside());
        let (found, painted, to, points) = (&self.found, &self.painted, &mut self.surroundings, padded(self.count));
        let overlays = self.overlays.as_deref_mut().filter(|over| over.any());
        self.level.run(ReflectEnvironment { found, painted, overlays, to, points, bsdf, has_inside, sky, ambient });
        if let Some(weights) = &self.weights {
            self.level.run(Weigh { weights, radiance: &mut self.surroundings.radiance, points });
        }
    }

    /// Samples of the points, with their radiance.
    pub(crate) fn shown(&self) -> impl Iterator<Item = (u32, Vec3)> {
        let (found, surroundings) = (&self.found, &self.surroundings);
        let certain = (0..self.count.min(POINTS)).filter(|&i| found.certain[i] == 1);
        certain.map(|i| (self.samples[i], get(&surroundings.radiance, i)))
    }
}

/// Kernel that multiplies the radiance of points by the weights of their rays.
pub(super) struct Weigh<'a> {
    pub weights: &'a Columns,
    pub radiance: &'a mut Columns,
    pub points: usize,
}

impl Kernel for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { weights, radiance, points } = self;
        for i in 0..points.min(POINTS) {
            put(radiance, i, get(weights, i) * get(radiance, i));
        }
    }
}

struct ReflectEnvironment<'a> {
    found: &'a Found,
    painted: &'a Painted,
    overlays: Option<&'a mut Overlays>,
    to: &'a mut Surroundings,
    points: usize,
    bsdf: &'a Bsdf,
    has_inside: bool,
    sky: &'a Sky,
    ambient: Vec3,
}

impl Kernel for ReflectEnvironment<'_> {
    type Output = ();

    // Whether maps change the material is tested outside the loops, which are then branch-free.
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { found, painted, overlays, to, points, bsdf, has_inside, sky, ambient } = self;
        let (points, emission) = (points.min(POINTS), bsdf.emission);
        let everywhere = EnvironmentLight { sky, ambient };
        match &bsdf.model {
            Model::Unlit(_) if painted.any => {
                (0..points).for_each(|i| put(&mut to.radiance, i, painted.emission(i) + painted.unlit(i)));
            }
            Model::Unlit(color) => (0..points).for_each(|i| put(&mut to.radiance, i, emission + *color)),
            Model::Phong(m) => {
                let m = *m;
                spread(sky, &found.normal, points, &mut to.diffuse);
                if painted.any {
                    scatter(to, points, ambient, |i| (painted.emission(i), painted.phong(i, &m)));
                } else {
                    scatter(to, points, ambient, |_| (emission, m));
                }
            }
            Model::MetalRough(m) if painted.any => {
                let (mapped, emission) = (Mapped { m: *m, painted }, |i| painted.emission(i));
                if let Some(overlays) = overlays {
                    look(s, &mapped, (found, |_| true), to, points, everywhere, |_| Vec3::ZERO);
                    overlays.show(s, found, to, points, everywhere, emission);
                } else if has_inside {
                    look(s, &mapped, (found, |i| found.front[i] == 1), to, points, everywhere, emission);
                } else {
                    look(s, &mapped, (found, |_| true), to, points, everywhere, emission);
                }
            }
            Model::MetalRough(m) => {
                let even = Even { m: m.in_the_open(), row: m.shares(), mean: mean_albedo(m.roughness()) };
                if let Some(overlays) = overlays {
                    look(s, &even, (found, |_| true), to, points, everywhere, |_| Vec3::ZERO);
                    overlays.show(s, found, to, points, everywhere, |_| emission);
                } else if has_inside {
                    look(s, &even, (found, |i| found.front[i] == 1), to, points, everywhere, |_| emission);
                } else {
                    look(s, &even, (found, |_| true), to, points, everywhere, |_| emission);
                }
            }
        }
    }
}

/// Ambient and environment light reflected by Phong's model.
#[inline(always)]
fn scatter(to: &mut Surroundings, points: usize, ambient: Vec3, bsdf: impl Fn(usize) -> (Vec3, PhongBsdf)) {
    for i in 0..points.min(POINTS) {
        let (emission, m) = bsdf(i);
        put(&mut to.radiance, i, emission + (m.ambient * ambient + m.diffuse * get(&to.diffuse, i)));
    }
}

/// A metallic-rough material at each point.
trait MetalRoughPoints {
    fn bsdf(&self, i: usize) -> MetalRoughBsdf;
    /// Computes the shares of f0 and f90 in the lobe's albedo at these cosines of the view.
    fn find_shares<S: Simd>(&self, s: S, points: usize, n_v: &Column, to: &mut [Column; 2]);
    /// Computes the mean albedos of white lobes over the hemisphere, where they differ by point.
    fn find_means(&self, points: usize, means: &mut Column);
    /// Mean albedo at a point.
    fn mean_albedo(&self, means: &Column, i: usize) -> f32;
    /// Unoccluded share of the mirrored light.
    fn open(&self, i: usize, n_v: f32) -> f32;
    /// Whether mirrored light is looked up.
    fn looks_up(&self) -> bool;
}

/// A material that is the same everywhere.
struct Even {
    m: MetalRoughBsdf,
    row: AlbedoRow,
    mean: f32,
}

impl MetalRoughPoints for Even {
    #[inline(always)]
    fn bsdf(&self, _: usize) -> MetalRoughBsdf {
        self.m
    }

    #[inline(always)]
    fn find_shares<S: Simd>(&self, s: S, points: usize, n_v: &Column, [scale, bias]: &mut [Column; 2]) {
        let eights = scale.as_chunks_mut().0.iter_mut().zip(bias.as_chunks_mut().0);
        for (n_v, (scale, bias)) in n_v.as_chunks().0.iter().zip(eights).take(points.div_ceil(LANES)) {
            [*scale, *bias] = self.row.at_each(s, n_v);
        }
    }

    #[inline(always)]
    fn find_means(&self, _: usize, _: &mut Column) {}

    #[inline(always)]
    fn mean_albedo(&self, _: &Column, _: usize) -> f32 {
        self.mean
    }

    #[inline(always)]
    fn open(&self, _: usize, _: f32) -> f32 {
        1.0
    }

    #[inline(always)]
    fn looks_up(&self) -> bool {
        self.m.looks_up()
    }
}

/// A material changed by maps.
struct Mapped<'a> {
    m: MetalRoughBsdf,
    painted: &'a Painted,
}

impl MetalRoughPoints for Mapped<'_> {
    #[inline(always)]
    fn bsdf(&self, i: usize) -> MetalRoughBsdf {
        self.painted.metal_rough(i, &self.m)
    }

    #[inline(always)]
    fn find_shares<S: Simd>(&self, s: S, points: usize, n_v: &Column, [scale, bias]: &mut [Column; 2]) {
        let at = self.painted.roughness.as_chunks().0.iter().zip(n_v.as_chunks().0);
        let eights = scale.as_chunks_mut().0.iter_mut().zip(bias.as_chunks_mut().0);
        for ((roughness, n_v), (scale, bias)) in at.zip(eights).take(points.div_ceil(LANES)) {
            [*scale, *bias] = albedo_of_each(s, roughness, n_v);
        }
    }

    #[inline(always)]
    fn find_means(&self, points: usize, means: &mut Column) {
        for (mean, &roughness) in means.iter_mut().zip(&self.painted.roughness).take(points) {
            *mean = mean_albedo(roughness);
        }
    }

    #[inline(always)]
    fn mean_albedo(&self, means: &Column, i: usize) -> f32 {
        means[i]
    }

    #[inline(always)]
    fn open(&self, i: usize, n_v: f32) -> f32 {
        open(n_v, self.painted.occlusion[i], self.painted.roughness[i])
    }

    #[inline(always)]
    fn looks_up(&self) -> bool {
        self.m.looks_up()
    }
}

/// Computes the environment light of a metallic-rough material, plus emission; `outside` returns whether a point is seen from
/// outside.
#[inline(always)]
fn look<S: Simd>(
    s: S,
    m: &impl MetalRoughPoints,
    (found, outside): (&Found, impl Fn(usize) -> bool),
    to: &mut Surroundings,
    points: usize,
    EnvironmentLight { sky, ambient }: EnvironmentLight,
    emission: impl Fn(usize) -> Vec3,
) {
    for i in 0..points.min(POINTS) {
        let seen = found.seen(i);
        to.n_v[i] = seen.normal.dot(seen.view).clamp(0.0, 1.0);
    }
    m.find_shares(s, points, &to.n_v, &mut to.shares);
    m.find_means(points, &mut to.mean);
    spread(sky, &found.normal, points, &mut to.diffuse);
    if m.looks_up() {
        for i in 0..points.min(POINTS) {
            to.open[i] = m.open(i, to.n_v[i]);
        }
        if sky.studio().is_some() {
            for i in 0..points.min(POINTS) {
                put(&mut to.mirrored_dir, i, found.seen(i).mirrored());
            }
        }
        blur(sky, |i| m.bsdf(i).roughness(), &to.mirrored_dir, points, &mut to.mirrored);
    } else {
        (to.open, to.mirrored) = ([0.0; POINTS], [[0.0; POINTS]; 3]);
    }
    for i in 0..points.min(POINTS) {
        let terms = EnvironmentTerms {
            n_v: to.n_v[i],
            shares: (to.shares[0][i], to.shares[1][i]),
            diffuse: get(&to.diffuse, i) + ambient,
            mirrored: get(&to.mirrored, i) + ambient,
            open: to.open[i],
            outside: outside(i),
            // Materials that scatter light inside are not batched.
            turned_back: 0.0,
        };
        let bsdf = m.bsdf(i);
        put(&mut to.radiance, i, emission(i) + bsdf.around(&terms, bsdf.rebound(m.mean_albedo(&to.mean, i))).0);
    }
}

/// Mean radiance over the hemispheres around these normals.
#[inline(always)]
fn spread(sky: &Sky, normals: &Columns, points: usize, to: &mut Columns) {
    match sky.studio() {
        Some(UpAxis::Y) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::diffuse(studio::from_world(UpAxis::Y, get(normals, i))));
            }
        }
        Some(UpAxis::Z) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::diffuse(studio::from_world(UpAxis::Z, get(normals, i))));
            }
        }
        None => fill(to, points, sky.diffuse(Vec3::Z)),
    }
}

/// Mean radiance around these mirrored directions, blurred by the roughness.
#[inline(always)]
pub(super) fn blur(sky: &Sky, roughness: impl Fn(usize) -> f32, dirs: &Columns, points: usize, to: &mut Columns) {
    match sky.studio() {
        Some(UpAxis::Y) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::blurred(studio::from_world(UpAxis::Y, get(dirs, i)), roughness(i)));
            }
        }
        Some(UpAxis::Z) => {
            for i in 0..points.min(POINTS) {
                put(to, i, studio::blurred(studio::from_world(UpAxis::Z, get(dirs, i)), roughness(i)));
            }
        }
        None => fill(to, points, sky.radiance(Vec3::Z, 0.0)),
    }
}

/// Sets one radiance for all points: such environments look alike in all directions.
#[inline(always)]
fn fill(to: &mut Columns, points: usize, radiance: Vec3) {
    (0..points.min(POINTS)).for_each(|i| put(to, i, radiance));
}
