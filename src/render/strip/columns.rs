//! Points by number and place: what is known of them, and the surface that is found from it.

use super::around::Surroundings;
use super::lit::Lit;
use super::sorted::Face;
use crate::accel::refine::Facet;
use crate::accel::{Hit, Ray};
use crate::math::inset::Rim;
use crate::math::simd::{Kernel, Level, Simd};
use crate::math::triangle::Flat;
use crate::math::{DVec3, Vec3};
use crate::render::patch::{differ, smooth_normal};
use crate::render::shade::Seen;
use crate::render::surface::facing;
use crate::render::world::Placement;

/// Points of a strip at most.
pub(crate) const POINTS: usize = 64;

/// Points are computed so many at a time.
const LANES: usize = 8;

/// One number of every point.
pub(super) type Column = [f32; POINTS];

/// Three numbers of every point.
pub(super) type Columns = [Column; 3];

/// A place or direction of every point.
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

/// Points of one instance.
pub(crate) struct Strip {
    pub(super) count: usize,
    pub(super) level: Level,
    /// The place of each point's ray in its wave.
    pub(super) rays: [u32; POINTS],
    given: Given,
    pub(super) found: Found,
    pub(super) surroundings: Surroundings,
    pub(super) lit: Lit,
}

/// What hits say.
struct Given {
    origin: Columns,
    dir: Columns,
    weights: [Column; 2],
    corner: [[f64; POINTS]; 3],
    normal: [[f64; POINTS]; 3],
    sizes: [[f64; POINTS]; 3],
    area2: [f64; POINTS],
    edges2: [[f64; POINTS]; 3],
    outward: Columns,
    /// Of the three corners; only of meshes that have any.
    normals: [Columns; 3],
    /// 1 where those differ.
    curved: [u32; POINTS],
}

/// The surface at each point.
pub(super) struct Found {
    /// 1 where that is all, 0 where the tracer must look itself.
    pub certain: [u32; POINTS],
    /// 1 where the front is seen.
    pub front: [u32; POINTS],
    /// 1 where the mesh stands for something round.
    pub curved: [u32; POINTS],
    pub position: Columns,
    pub error: Columns,
    pub view: Columns,
    pub geometric: Columns,
    pub normal: Columns,
}

const EMPTY: Columns = [[0.0; POINTS]; 3];
const WIDE: [[f64; POINTS]; 3] = [[0.0; POINTS]; 3];

impl Default for Strip {
    fn default() -> Self {
        let given = Given {
            origin: EMPTY,
            dir: EMPTY,
            weights: [[0.0; POINTS]; 2],
            corner: WIDE,
            normal: WIDE,
            sizes: WIDE,
            area2: [0.0; POINTS],
            edges2: WIDE,
            outward: EMPTY,
            normals: [EMPTY; 3],
            curved: [0; POINTS],
        };
        let found = Found {
            certain: [0; POINTS],
            front: [0; POINTS],
            curved: [0; POINTS],
            position: EMPTY,
            error: EMPTY,
            view: EMPTY,
            geometric: EMPTY,
            normal: EMPTY,
        };
        Self {
            count: 0,
            level: Level::best(),
            rays: [0; POINTS],
            given,
            found,
            surroundings: Surroundings::default(),
            lit: Lit::default(),
        }
    }
}

impl Strip {
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes the hit of the `index`th ray of a wave; at most [`POINTS`].
    #[inline]
    pub(crate) fn push(&mut self, index: u32, ray: &Ray, hit: &Hit, face: &Face) {
        let i = self.count % POINTS;
        self.count = i + 1;
        self.rays[i] = index;
        let given = &mut self.given;
        put(&mut given.origin, i, ray.origin);
        put(&mut given.dir, i, ray.dir);
        given.weights[0][i] = hit.u;
        given.weights[1][i] = hit.v;
        let Facet { flat, rim } = &face.facet;
        put_wide(&mut given.corner, i, flat.corner);
        put_wide(&mut given.normal, i, flat.normal);
        put_wide(&mut given.sizes, i, flat.sizes);
        given.area2[i] = rim.area2;
        put_wide(&mut given.edges2, i, DVec3::from_array(rim.edges2));
        put(&mut given.outward, i, face.outward);
        given.curved[i] = u32::from(face.normals.is_some_and(differ));
        if let Some(normals) = &face.normals {
            for (columns, &normal) in given.normals.iter_mut().zip(normals) {
                put(columns, i, normal);
            }
        }
    }

    /// Finds the surface at each point; `placement` where the mesh has normals of its own.
    pub(crate) fn find(&mut self, placement: Option<&Placement>) {
        let points = padded(self.count);
        let (given, found) = (&self.given, &mut self.found);
        match placement {
            Some(placement) => self.level.run(Smooth { given, found, points, placement }),
            None => self.level.run(Faceted { given, found, points }),
        }
    }
}

impl Strip {
    /// The rays whose points must be shaded one by one, from now on left out here.
    pub(crate) fn left_out(&mut self, one_sided: bool) -> impl Iterator<Item = u32> {
        let found = &mut self.found;
        let count = self.count.min(POINTS);
        let out = (0..count).filter(move |&i| {
            let wanted = (found.certain[i] == 1) & (!one_sided | (found.front[i] == 1));
            found.certain[i] = u32::from(wanted);
            !wanted
        });
        out.map(|i| self.rays[i])
    }
}

/// The number of points that are computed: whole registers.
#[inline(always)]
pub(super) fn padded(count: usize) -> usize {
    count.next_multiple_of(LANES).min(POINTS)
}

#[inline(always)]
fn get_wide(columns: &[[f64; POINTS]; 3], i: usize) -> DVec3 {
    DVec3::new(columns[0][i], columns[1][i], columns[2][i])
}

#[inline(always)]
fn put_wide(columns: &mut [[f64; POINTS]; 3], i: usize, v: DVec3) {
    columns[0][i] = v.x;
    columns[1][i] = v.y;
    columns[2][i] = v.z;
}

struct Faceted<'a> {
    given: &'a Given,
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
        found.curved = [0; POINTS];
        for i in 0..points.min(POINTS) {
            given.turn(found, i);
            found.shade(i, get(&given.outward, i));
        }
    }
}

struct Smooth<'a> {
    given: &'a Given,
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
        found.curved = given.curved;
        for i in 0..points.min(POINTS) {
            given.place(found, i);
        }
        for i in 0..points.min(POINTS) {
            given.turn(found, i);
            let (u, v) = (given.weights[0][i], given.weights[1][i]);
            let [a, b, c] = [get(&given.normals[0], i), get(&given.normals[1], i), get(&given.normals[2], i)];
            let mixed = a * (1.0 - u - v) + b * u + c * v;
            let own = smooth_normal(&placement, mixed).unwrap_or(get(&given.outward, i));
            found.shade(i, own);
        }
    }
}

impl Given {
    /// Position and error.
    #[inline(always)]
    fn place(&self, found: &mut Found, i: usize) {
        let flat = Flat {
            corner: get_wide(&self.corner, i),
            normal: get_wide(&self.normal, i),
            sizes: get_wide(&self.sizes, i),
        };
        let edges2 = [self.edges2[0][i], self.edges2[1][i], self.edges2[2][i]];
        let facet = Facet { flat, rim: Rim { area2: self.area2[i], edges2 } };
        let weights = (self.weights[0][i], self.weights[1][i]);
        let (position, error, certain) = facet.place(get(&self.origin, i), get(&self.dir, i), weights);
        put(&mut found.position, i, position);
        put(&mut found.error, i, error);
        found.certain[i] = u32::from(certain);
    }

    /// Which side is seen, and from where.
    #[inline(always)]
    fn turn(&self, found: &mut Found, i: usize) {
        let view = -get(&self.dir, i).try_normalize().unwrap_or(Vec3::Z);
        let outward = get(&self.outward, i);
        let front = outward.dot(view) >= 0.0;
        put(&mut found.view, i, view);
        put(&mut found.geometric, i, if front { outward } else { -outward });
        found.front[i] = u32::from(front);
    }
}

impl Found {
    /// How point `i` is seen.
    #[inline(always)]
    pub(super) fn seen(&self, i: usize) -> Seen {
        Seen {
            normal: get(&self.normal, i),
            geometric: get(&self.geometric, i),
            view: get(&self.view, i),
            outside: true,
        }
    }

    /// The shading normal, from the mesh's own.
    #[inline(always)]
    fn shade(&mut self, i: usize, own: Vec3) {
        let side = if own.dot(get(&self.geometric, i)) < 0.0 { -1.0 } else { 1.0 };
        let normal = facing(own * side, get(&self.view, i));
        put(&mut self.normal, i, normal);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;
    use crate::math::DMat3;
    use crate::math::random::Random;
    use crate::render::shade::{LocalLight, Matter};
    use crate::render::texture::TextureStore;
    use crate::scene::{Falloff, Light, LightKind, Material, Scene};

    /// Random triangles hit in their middles.
    fn filled() -> Strip {
        let (mut random, mut strip) = (Random::new(4), Strip::default());
        for i in 0..61 {
            let corners = [random.cube(), random.cube(), random.cube()];
            let (u, v) = (random.unit() * 0.5, random.unit() * 0.5);
            let origin = random.cube() + Vec3::Z * 5.0;
            let dir = corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v - origin;
            let ray = Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 };
            let normals = [random.direction(), random.direction(), random.direction()];
            let face = Face::of_triangle(&corners, Some(normals));
            strip.push(i, &ray, &Hit { t: 1.0, u, v, prim: i }, &face);
        }
        strip
    }

    fn found(level: Level, placement: Option<&Placement>) -> Vec<[u32; 20]> {
        let mut strip = filled();
        strip.level = level;
        strip.find(placement);
        let kind = LightKind::Point { position: DVec3::new(1.0, 3.0, 2.0), falloff: Falloff::None };
        let light = Light { name: String::new(), intensity: Vec3::ONE, kind, shadows: true, size: 0.0 };
        let matter = Matter::without_maps(&Material::plain(), &TextureStore::new(&Scene::default()));
        strip.shine(&matter, &LocalLight::new(&light, DVec3::ZERO));
        let point = |i: usize| {
            let (f, l) = (&strip.found, &strip.lit);
            let columns = [&f.position, &f.error, &f.view, &f.normal, &l.radiance, &l.origin];
            let numbers = columns.map(|c| get(c, i).to_array().map(f32::to_bits));
            let mut all = [f.certain[i]; 20];
            all[..18].copy_from_slice(numbers.as_flattened());
            all[18] = l.seen[i];
            all
        };
        (0..strip.count).map(point).collect()
    }

    #[test]
    fn every_instruction_set_finds_the_same_surfaces_and_light() {
        let turned = Placement::new(DMat3::from_rotation_y(0.4) * DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.5)));
        for placement in [None, Some(&turned)] {
            let plain = found(Level::PORTABLE, placement);
            let count = |k: usize| plain.iter().filter(|p| p[k] == 1).count();
            assert!(count(18) > 0 && count(19) > 30, "{} lit, {} certain", count(18), count(19));
            for level in Level::all() {
                assert!(found(level, placement) == plain, "{}", level.name());
            }
        }
    }
}
