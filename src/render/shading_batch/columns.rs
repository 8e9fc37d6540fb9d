//! The points of a batch as columns: data of the hits, and the surface computed from them.

use super::area_lights::Drawn;
use super::cones::Cones;
use super::environment::Surroundings;
use super::faces::Faces;
use super::hits_by_instance::HitsByInstance;
use super::lit::Lit;
use super::material_maps::{LOBE_MAPS, LobeTexels};
use super::overlays::Overlays;
use super::painted::Painted;
use crate::math::bounds::offset_origin;
use crate::math::simd::{Kernel, Level, Simd};
use crate::math::{Vec3, Vec4};
use crate::render::media::MediaTable;
use crate::render::media::absorption::Absorption;
use crate::render::patch::{BakedFrame, smooth_normal};
use crate::render::shade::{Bsdf, ShadingFrame};
use crate::render::shade_hits::TracedRays;
use crate::render::surface::{faces, facing, side_of};
use crate::render::texture::Places;
use crate::render::world::Placement;
use std::ops::{Add, Mul};

/// Maximum number of points of a batch.
pub(crate) const POINTS: usize = 64;

pub(super) use crate::math::simd::LANES;

/// One value of every point.
pub(super) type Column = [f32; POINTS];

/// Three values of every point.
pub(super) type Columns = [Column; 3];

/// Position or direction of point `i`.
#[inline(always)]
pub(super) fn get(columns: &Columns, i: usize) -> Vec3 {
    Vec3::new(columns[0][i], columns[1][i], columns[2][i])
}

#[inline(always)]
pub(super) fn put(columns: &mut Columns, i: usize, v: Vec3) {
    columns[0][i] = v.x;
    columns[1][i] = v.y;
    columns[2][i] = v.z;
}

/// Origin of a ray from point `i` in this direction.
#[inline(always)]
pub(super) fn leave(found: &Found, i: usize, dir: Vec3) -> Vec3 {
    offset_origin(get(&found.position, i), get(&found.error, i), get(&found.geometric, i), dir)
}

/// Points of one instance. Columns fill whole cache lines.
#[repr(C, align(64))]
pub(crate) struct ShadingBatch {
    pub(super) count: usize,
    pub(super) level: Level,
    /// Index of each point's ray in its wave.
    pub(super) rays: [u32; POINTS],
    /// Sample of each point.
    pub(super) samples: [u32; POINTS],
    /// Weight of each point; `None` where all are 1.
    pub(super) weights: Option<Columns>,
    pub(super) given: HitData,
    pub(super) found: Found,
    pub(super) painted: Painted,
    /// Texels of the maps of lobes, where they are read side by side.
    pub(super) of_lobes: Box<LobeTexels>,
    pub(super) cones: Cones,
    pub(super) places: Places,
    pub(super) surroundings: Surroundings,
    pub(super) lit: Lit,
    pub(super) drawn: Drawn,
    /// Whole BSDF of each point, where columns cannot describe it; else empty.
    pub(super) point_bsdfs: Vec<Bsdf>,
    /// Overlays of each point, where they are the only further lobes; the allocation is kept between batches.
    pub(super) overlays: Option<Box<Overlays>>,
}

/// Data of the hits.
#[repr(C, align(64))]
pub(super) struct HitData {
    origin: Columns,
    dir: Columns,
    /// Barycentric coordinates of the second and third corner.
    weights: [Column; 2],
    pub faces: Faces,
}

/// Surface at each point.
#[repr(C, align(64))]
pub(super) struct Found {
    /// 1 where this suffices, 0 where the tracer must shade the point itself.
    pub certain: [u32; POINTS],
    /// 1 where the front is seen.
    pub front: [u32; POINTS],
    /// 1 where the mesh stands for a round surface.
    pub curved: [u32; POINTS],
    pub position: Columns,
    pub error: Columns,
    pub view: Columns,
    pub geometric: Columns,
    /// Normal of the plane that lights must be above: where the mesh stands for a round surface, not that of the triangle.
    pub horizon: Columns,
    pub normal: Columns,
}

const EMPTY: Columns = [[0.0; POINTS]; 3];

impl Default for ShadingBatch {
    fn default() -> Self {
        let given = HitData { origin: EMPTY, dir: EMPTY, weights: [[0.0; POINTS]; 2], faces: Faces::EMPTY };
        let found = Found {
            certain: [0; POINTS],
            front: [0; POINTS],
            curved: [0; POINTS],
            position: EMPTY,
            error: EMPTY,
            view: EMPTY,
            geometric: EMPTY,
            horizon: EMPTY,
            normal: EMPTY,
        };
        Self {
            count: 0,
            level: Level::best(),
            rays: [0; POINTS],
            samples: [0; POINTS],
            weights: None,
            given,
            found,
            painted: Painted::default(),
            of_lobes: Box::new([[Vec4::ONE; POINTS]; LOBE_MAPS]),
            cones: Cones::default(),
            places: Places::default(),
            surroundings: Surroundings::default(),
            lit: Lit::default(),
            drawn: Drawn::default(),
            point_bsdfs: Vec::new(),
            overlays: None,
        }
    }
}

impl ShadingBatch {
    /// Takes hits, at most [`POINTS`], each as the index of its ray in the traced ones and that of its face, with the normals of
    /// its corners if the mesh is `smooth`. Absorption on the way reduces the weights of the rays.
    pub(crate) fn take(
        &mut self,
        hit: &[(u32, u32)],
        sorted: &HitsByInstance,
        traced: TracedRays,
        absorption: &Absorption,
        media: &MediaTable,
        smooth: bool,
    ) {
        self.count = hit.len().min(POINTS);
        for ((at, sample), (ray, _)) in self.rays.iter_mut().zip(&mut self.samples).zip(hit) {
            (*at, *sample) = (*ray, *ray);
        }
        self.weights = None;
        self.point_bsdfs.clear();
        self.overlays.iter_mut().for_each(|overlays| overlays.clear());
        if traced.has_weights() {
            let weights = self.weights.insert(EMPTY);
            for (i, &ray) in self.rays[..self.count].iter().enumerate() {
                let at = ray as usize;
                let (ray, path, hit) = (&traced.rays()[at], &traced.path(at), &traced.hits()[at]);
                self.samples[i] = ray.sample;
                let absorbs = absorption.is_some();
                put(
                    weights,
                    i,
                    if absorbs { absorption.attenuated(media, ray, path, hit).weight } else { path.weight },
                );
            }
        }
        self.level.run(Gather { given: &mut self.given, hit: &hit[..self.count], sorted, traced, smooth });
    }

    /// Computes the surface at each point; `placement` is given where the mesh has vertex normals.
    pub(crate) fn find(&mut self, placement: Option<&Placement>) {
        let points = padded(self.count);
        let (given, found) = (&self.given, &mut self.found);
        self.painted.any = false;
        match placement {
            Some(placement) => self.level.run(Smooth { given, found, points, placement }),
            None => self.level.run(Faceted { given, found, points }),
        }
    }

    /// Drops the points whose rays, given by index, are not wanted.
    pub(crate) fn retain(&mut self, wanted: impl Fn(usize) -> bool) {
        for (certain, &ray) in self.found.certain.iter_mut().zip(&self.rays).take(self.count) {
            *certain &= u32::from(wanted(ray as usize));
        }
    }

    /// Whether all points show the backs of their faces.
    pub(crate) fn sees_backs_alone(&self) -> bool {
        self.certain().all(|i| self.found.front[i] == 0)
    }

    /// Rays whose points must be shaded one by one: those that are not certain.
    pub(crate) fn left_out(&self) -> impl Iterator<Item = u32> {
        let certain = &self.found.certain[..self.count.min(POINTS)];
        // Hardly ever any.
        let all = certain.iter().fold(1, |all, one| all & one) == 1;
        let points = if all { 0..0 } else { 0..certain.len() };
        points.filter(|&i| certain[i] != 1).map(|i| self.rays[i])
    }
}

/// Number of points that are computed: whole SIMD registers.
#[inline(always)]
pub(super) fn padded(count: usize) -> usize {
    count.next_multiple_of(LANES).min(POINTS)
}

struct Gather<'a> {
    given: &'a mut HitData,
    hit: &'a [(u32, u32)],
    sorted: &'a HitsByInstance,
    traced: TracedRays<'a>,
    smooth: bool,
}

impl Kernel for Gather<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { given, hit, sorted, traced, smooth } = self;
        let (faces, skins) = (sorted.faces(), sorted.skins());
        let (rays, hits) = (traced.rays(), traced.hits());
        for (k, eight) in hit.chunks(LANES).enumerate() {
            let index: [usize; LANES] = std::array::from_fn(|lane| eight[lane.min(eight.len() - 1)].0 as usize);
            let [ox, oy, oz, _] = s.columns(std::array::from_fn(|lane| rays[index[lane]].in_fours()[0]));
            let [dx, dy, dz, _] = s.columns(std::array::from_fn(|lane| rays[index[lane]].in_fours()[1]));
            let [_, u, v, _] = s.columns(std::array::from_fn(|lane| hits[index[lane]].as_four()));
            let rows =
                [s.store(ox), s.store(oy), s.store(oz), s.store(dx), s.store(dy), s.store(dz), s.store(u), s.store(v)];
            let columns = given.origin.iter_mut().chain(&mut given.dir).chain(&mut given.weights);
            for (column, row) in columns.zip(rows) {
                column.as_chunks_mut().0[k] = row;
            }
        }
        let mut at = 0;
        for same in hit.chunk_by(|(_, a), (_, b)| a == b) {
            let (points, face) = (at..at + same.len(), &faces[same[0].1 as usize]);
            given.faces.set(&points, &face.numbers);
            if smooth {
                given.faces.set_normals(&points, &face.numbers);
            }
            if let Some(skin) = skins.get(face.skin as usize) {
                given.faces.set_skin(&points, skin);
            }
            at += same.len();
        }
    }
}

struct Faceted<'a> {
    given: &'a HitData,
    found: &'a mut Found,
    points: usize,
}

impl Kernel for Faceted<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { given, found, points } = self;
        for i in 0..points.min(POINTS) {
            given.place(found, i);
        }
        for i in 0..points.min(POINTS) {
            given.turn(found, i);
            found.curved[i] = 0;
            found.shade(i, given.faces.outward(i));
        }
        found.turn_to_view(points);
    }
}

struct Smooth<'a> {
    given: &'a HitData,
    found: &'a mut Found,
    points: usize,
    placement: &'a Placement,
}

impl Kernel for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { given, found, points, placement } = self;
        let placement = *placement;
        for i in 0..points.min(POINTS) {
            given.place(found, i);
        }
        for i in 0..points.min(POINTS) {
            given.turn(found, i);
            // Not all at once, which would compile to a call.
            found.curved[i] = given.faces.curved(i);
            found.shade(i, given.own_normal(&placement, i));
        }
        found.turn_to_view(points);
    }
}

impl HitData {
    /// Computes position and error bound.
    #[inline(always)]
    fn place(&self, found: &mut Found, i: usize) {
        let plane = self.faces.plane(i);
        let weights = (self.weights[0][i], self.weights[1][i]);
        let (position, error, certain) = plane.place(get(&self.origin, i), get(&self.dir, i), weights);
        put(&mut found.position, i, position);
        put(&mut found.error, i, error);
        found.certain[i] = u32::from(certain);
    }

    /// Barycentric coordinates of all corners.
    #[inline(always)]
    pub(super) fn corner_weights(&self, i: usize) -> [f32; 3] {
        let (u, v) = (self.weights[0][i], self.weights[1][i]);
        [1.0 - u - v, u, v]
    }

    /// Interpolates an attribute of the corners.
    #[inline(always)]
    pub(super) fn mix<T: Mul<f32, Output = T> + Add<Output = T>>(&self, i: usize, [a, b, c]: [T; 3]) -> T {
        let [wa, wb, wc] = self.corner_weights(i);
        a * wa + b * wb + c * wc
    }

    /// Interpolated vertex normal, of unit length.
    #[inline(always)]
    pub(super) fn own_normal(&self, placement: &Placement, i: usize) -> Vec3 {
        smooth_normal(placement, self.mix(i, self.faces.normals(i))).unwrap_or(self.faces.outward(i))
    }

    /// Interpolated tangent frame.
    #[inline(always)]
    pub(super) fn baked_frame(&self, i: usize) -> BakedFrame {
        BakedFrame::new(self.mix(i, self.faces.normals(i)), self.mix(i, self.faces.tangents(i)))
    }

    /// Computes the view direction and the visible side.
    #[inline(always)]
    fn turn(&self, found: &mut Found, i: usize) {
        let view = -get(&self.dir, i).try_normalize().unwrap_or(Vec3::Z);
        let outward = self.faces.outward(i);
        let front = outward.dot(view) >= 0.0;
        put(&mut found.view, i, view);
        put(&mut found.geometric, i, if front { outward } else { -outward });
        found.front[i] = u32::from(front);
    }
}

impl Found {
    /// View and normals of point `i` for shading.
    #[inline(always)]
    pub(super) fn seen(&self, i: usize) -> ShadingFrame {
        ShadingFrame {
            normal: get(&self.normal, i),
            geometric: get(&self.geometric, i),
            view: get(&self.view, i),
            outside: true,
        }
    }

    /// Sets the shading normal, from the mesh's own, as it is before [`Self::turn_to_view`].
    #[inline(always)]
    fn shade(&mut self, i: usize, own: Vec3) {
        let geometric = get(&self.geometric, i);
        let normal = own * side_of(own, geometric);
        put(&mut self.normal, i, normal);
        put(&mut self.horizon, i, if self.curved[i] == 1 { normal } else { geometric });
    }

    /// Turns normals to face the viewer, which hardly any need.
    #[inline(always)]
    fn turn_to_view(&mut self, points: usize) {
        let mut any = 0;
        for i in 0..points.min(POINTS) {
            any |= u32::from(!faces(get(&self.normal, i), get(&self.view, i)));
        }
        if any == 0 {
            return;
        }
        for i in 0..points.min(POINTS) {
            let normal = facing(get(&self.normal, i), get(&self.geometric, i), get(&self.view, i));
            put(&mut self.normal, i, normal);
            if self.curved[i] == 1 {
                put(&mut self.horizon, i, normal);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::constants::MaterialConstants;
    use super::super::hits_by_instance::Face;
    use super::*;
    use crate::accel::{Hit, NO_PRIM, Ray};
    use crate::math::random::Random;
    use crate::math::{DMat3, DVec3};
    use crate::render::draws::SampleSet;
    use crate::render::media::Media;
    use crate::render::shade::LocalLight;
    use crate::render::sky::Sky;
    use crate::render::sobol::mix;
    use crate::render::texture::TextureStore;
    use crate::render::wave::{Path, RayClass, Wave};
    use crate::scene::{Environment, Falloff, Light, LightKind, Material, Scene};

    /// Random triangles hit in their middles.
    fn filled(level: Level) -> ShadingBatch {
        let (mut random, mut batch) = (Random::new(4), ShadingBatch { level, ..ShadingBatch::default() });
        let (mut rays, mut hits, mut faces) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..61 {
            let corners = [random.cube(), random.cube(), random.cube()];
            let (u, v) = (random.unit() * 0.5, random.unit() * 0.5);
            let origin = random.cube() + Vec3::Z * 5.0;
            let dir = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v - origin;
            rays.push(Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 });
            hits.push(Hit { t: 1.0, u, v, prim: i });
            let normals = [random.direction(), random.direction(), random.direction()];
            faces.push(Face::of_triangle(i, &corners, Some(normals)));
        }
        let hit: Vec<(u32, u32)> = (0..61).map(|i| (i, i)).collect();
        let wave = wave(rays, hits);
        let traced = TracedRays::Wave(RayClass::Reflected, &wave);
        let by_instance = HitsByInstance::of_faces(faces);
        batch.take(&hit, &by_instance, traced, &Absorption::default(), &MediaTable::default(), true);
        batch
    }

    fn wave(rays: Vec<Ray>, hits: Vec<Hit>) -> Wave {
        let paths = vec![Path::from_eye(0.0, 0.0, Media::OUTSIDE); rays.len()];
        Wave { starts: true, after: vec![Hit::MISS; rays.len()], rays, paths, hits }
    }

    fn found(level: Level, placement: Option<&Placement>, size: f64) -> Vec<[u32; 23]> {
        let mut batch = filled(level);
        batch.find(placement);
        let kind = LightKind::Point { position: DVec3::new(1.0, 3.0, 2.0), falloff: Falloff::None };
        let light = Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: true, size };
        let constants = MaterialConstants {
            material: 0,
            bsdf: Bsdf::without_maps(&Material::plain(), &TextureStore::new(&Scene::default())),
            one_sided: true,
            coverage: 1.0,
            mapped: false,
            material_maps: None,
            needs_cones: false,
            glass: None,
            lobes: None,
            spreads: false,
        };
        batch.draw((0..61).map(|i| (i, SampleSet::Part { key: mix(7, i as u32), first: 3 * i as u32 }, 3)));
        let place = (size > 0.0).then_some(1);
        let studio = Scene { environment: Environment::Studio, ..Scene::default() };
        batch.shade_environment(&constants, &Sky::new(&studio), Vec3::ONE);
        batch.shade_light(&constants, &LocalLight::new(&light, DVec3::ZERO), place);
        let point = |i: usize| {
            let (f, l) = (&batch.found, &batch.lit);
            let around = &batch.surroundings.radiance;
            let columns = [&f.position, &f.error, &f.view, &f.normal, &l.radiance, &l.origin, around];
            let numbers = columns.map(|c| get(c, i).to_array().map(f32::to_bits));
            let mut all = [f.certain[i]; 23];
            all[..21].copy_from_slice(numbers.as_flattened());
            all[21] = l.seen[i];
            all
        };
        (0..batch.count).map(point).collect()
    }

    #[test]
    fn every_point_has_the_numbers_of_its_ray_its_hit_and_its_face() {
        let mut random = Random::new(5);
        let number = |i: usize| i as f32;
        let ray = |i: usize| Ray {
            origin: Vec3::new(number(i), number(i) + 0.25, number(i) + 0.5),
            t_min: 0.0,
            dir: -Vec3::new(number(i), number(i) + 0.25, number(i) + 0.5),
            t_max: f32::INFINITY,
            exclude: NO_PRIM,
            sample: i as u32,
        };
        let rays: Vec<Ray> = (0..100).map(ray).collect();
        let hits: Vec<Hit> = (0..100).map(|i| Hit { t: 1.0, u: number(i), v: -number(i), prim: 7 }).collect();
        let wave = wave(rays, hits);
        let face = |prim| {
            let corners = [(); 3].map(|()| random.cube());
            Face::of_triangle(prim, &corners, Some([(); 3].map(|()| random.direction())))
        };
        let sorted = HitsByInstance::of_faces((0..20).map(face).collect());
        // Faces hit by one point, by some, or by more than are written at once.
        let lengths = [1, 2, 9, 1, 17, 8, 3, 23];
        let seen = (0u32..).step_by(2).zip(lengths).flat_map(|(face, length)| std::iter::repeat_n(face, length));
        let hit: Vec<(u32, u32)> = (0..100).rev().zip(seen).collect();
        for level in Level::all() {
            for count in [1, 7, 8, 40, POINTS] {
                let mut batch = ShadingBatch { level, ..ShadingBatch::default() };
                let traced = TracedRays::Wave(RayClass::Reflected, &wave);
                batch.take(&hit[..count], &sorted, traced, &Absorption::default(), &MediaTable::default(), true);
                let given = &batch.given;
                for (i, &(index, face)) in hit[..count].iter().enumerate() {
                    let (ray, of_hit) = (&wave.rays[index as usize], &wave.hits[index as usize]);
                    assert_eq!(batch.samples[i], index);
                    assert_eq!((get(&given.origin, i), get(&given.dir, i)), (ray.origin, ray.dir));
                    assert_eq!((given.weights[0][i], given.weights[1][i]), (of_hit.u, of_hit.v));
                    let numbers = sorted.faces()[face as usize].numbers;
                    assert_eq!(given.faces.at(i), numbers, "{i} of {count} on {}", level.name());
                }
            }
        }
    }

    #[test]
    fn every_instruction_set_finds_the_same_surfaces_and_light() {
        let turned = Placement::new(DMat3::from_rotation_y(0.4) * DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.5)));
        // A light with a single sample, or with one drawn by each point.
        for (placement, size) in [(None, 0.0), (Some(&turned), 0.0), (Some(&turned), 0.7)] {
            let plain = found(Level::PORTABLE, placement, size);
            let count = |k: usize| plain.iter().filter(|p| p[k] == 1).count();
            assert!(plain.iter().all(|p| p[18..21].iter().all(|&light| f32::from_bits(light) > 0.0)));
            assert!(count(21) > 0 && count(22) > 30, "{} lit, {} certain", count(21), count(22));
            for level in Level::all() {
                assert!(found(level, placement, size) == plain, "{}", level.name());
            }
        }
    }
}
