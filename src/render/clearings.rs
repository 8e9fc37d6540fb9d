//! Gaps of what is cut out or blended, known without shading: rays pass them on their way.
//!
//! Most of what rays meet in a tree are the clear parts of its leaves. Where a map is clear as far around as a lookup may read
//! ([`Clear`]) it need not be read, and the ray need not stop there. What is not that sure is shaded, with the same outcome: a
//! gap is passed as if it were not there, so that pictures are the same bit by bit. Whoever counts rays hears of all of them.

use super::patch::Turn;
use super::texture::{Clear, TextureStore};
use super::wave::{Path, Wave};
use super::world::World;
use crate::accel::{Gaps, Hit, Ray};
use crate::math::simd::{Kernel, LANES, Level, Simd};
use crate::math::{DVec2, DVec3, Vec2, Vec3};
use crate::scene::{AlphaMode, Instance, Material, Mesh, Scene, TextureRef};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

/// Rays that meet faces before it is worth finding out where maps are clear: some, and one for so many faces, and for so many
/// texels.
const ENOUGH: usize = 1 << 12;
const FACES: usize = 8;
const TEXELS: usize = 1 << 10;

/// No more faces are looked at.
const MOST: usize = 1 << 20;

/// Where a ray goes so much farther along a face than across its cone nothing is known: how wide it is there depends on
/// roundings.
const GRAZING: f32 = 50.0;

/// Error of a place on a face that a ray meets under a right angle, in parts of the largest number it is made from; more
/// than all roundings.
const ROUNDING: f32 = 4e-6;

/// Nothing is known of a triangle with this part of the area of one of the same edges, or less.
const SLENDER: f64 = 500.0;

/// So near, in parts of what places are computed from, a surface may be met once more.
const NEAR: f32 = 1e-3;

/// Error of coordinates, texels, beside that.
const BLUR: f32 = 0.05;

/// What of a scene has gaps, and where.
#[derive(Debug)]
pub(crate) struct Clearings<'a> {
    scene: &'a Scene,
    world: &'a World,
    textures: &'a TextureStore<'a>,
    /// By material: what cuts it out.
    cuts: Vec<Option<Cut<'a>>>,
    /// The prims that are faces of such materials, in order, and how many come before each of these runs.
    runs: Vec<(Range<u32>, usize)>,
    count: usize,
    /// So many rays must have met them before it is worth finding out where gaps are.
    enough: usize,
    asked: AtomicUsize,
    taken: AtomicBool,
    found: OnceLock<Found>,
}

/// The map that decides where a material is.
#[derive(Clone, Copy, Debug)]
struct Cut<'a> {
    map: &'a TextureRef,
    channel: usize,
    /// What is stored there at most where the material is not.
    most: u8,
    one_sided: bool,
}

#[derive(Debug, Default)]
struct Found {
    /// Where each map is clear.
    maps: Vec<Arc<Option<Clear>>>,
    /// In the order of their prims.
    faces: Vec<Face>,
}

/// A face and how coordinates run along it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
struct Face {
    /// Outward, of unit length, and where its plane is.
    normal: Vec3,
    place: f32,
    /// How both coordinates grow, texels by world units, and what they are at the origin.
    along: [Vec3; 2],
    at: Vec2,
    /// How fast they grow at most.
    growth: f32,
    /// The number of its map, from 1 on; 0: nothing is known.
    map: u32,
    /// 1 where it is seen from its front alone.
    one_sided: u32,
    /// Error of coordinates, texels, by the sizes of the numbers that they are made from.
    error: f32,
}

impl<'a> Clearings<'a> {
    /// `None` for a scene in which no map cuts anything out, or so much that it would take long to find out.
    pub(crate) fn of(scene: &'a Scene, world: &'a World, textures: &'a TextureStore<'a>) -> Option<Self> {
        let cuts: Vec<_> = scene.materials.iter().map(Cut::of).collect();
        if cuts.iter().all(Option::is_none) || !world.kept.is_empty() {
            return None;
        }
        let of_instance = |(i, instance): (u32, &Instance)| {
            let mesh = &scene.meshes[instance.mesh as usize];
            cuts[mesh.material as usize]?.coordinates(mesh)?;
            Some(world.triangles_of(i)).filter(|prims| !prims.is_empty())
        };
        let (mut runs, mut count): (Vec<(Range<u32>, usize)>, _) = (Vec::new(), 0);
        for prims in (0..).zip(&scene.instances).filter_map(of_instance) {
            let more = prims.len();
            match runs.last_mut() {
                Some((last, _)) if last.end == prims.start => last.end = prims.end,
                _ => runs.push((prims, count)),
            }
            count += more;
        }
        let mut maps: Vec<u32> = cuts.iter().flatten().map(|cut| cut.map.texture).collect();
        maps.sort_unstable();
        maps.dedup();
        let texels = maps.into_iter().map(|map| textures.size(map)).map(|size| (size.x * size.y) as usize);
        let enough = ENOUGH + count / FACES + texels.sum::<usize>() / TEXELS;
        (count > 0 && count <= MOST).then(|| Self {
            scene,
            world,
            textures,
            cuts,
            runs,
            count,
            enough,
            asked: AtomicUsize::new(0),
            taken: AtomicBool::new(false),
            found: OnceLock::new(),
        })
    }

    /// What rays with these cones around them find.
    pub(super) fn before<'r>(&'r self, rays: &'r [Ray], cones: Cones<'r>) -> Before<'r, 'a> {
        Before { clearings: self, rays, cones }
    }

    /// Whether a ray meets prim `prim`, if it does, where nothing is for certain. One that looks sees the fronts of what is
    /// one-sided alone.
    fn is_clear(&self, sight: &Sight, looks: bool, prim: u32) -> bool {
        self.face(prim, 1).is_some_and(|(face, map)| face.clear(map, &Rays::new([*sight], looks)) == 1)
    }

    /// Whether a ray to a light meets prim `prim`, if it does, where nothing is for certain, of maps as sharp as they are.
    pub(super) fn lets_through(&self, ray: &Ray, prim: u32) -> bool {
        self.is_clear(&Sight { ray, cone: [0.0; 2], from: f32::NEG_INFINITY }, false, prim)
    }

    /// What is known of a prim that so many rays meet, and its map.
    #[inline]
    fn face(&self, prim: u32, rays: usize) -> Option<(&Face, &Clear)> {
        let Found { maps, faces } = self.find(rays)?;
        let (run, before) = self.runs.get(self.runs.partition_point(|(run, _)| run.end <= prim))?;
        let face = faces.get(before + prim.checked_sub(run.start)? as usize)?;
        let map = (**maps.get((face.map as usize).checked_sub(1)?)?).as_ref()?;
        Some((face, map))
    }

    /// Where gaps are, once it was asked of enough rays, of which these are some.
    fn find(&self, rays: usize) -> Option<&Found> {
        if let Some(found) = self.found.get() {
            return Some(found);
        }
        if self.taken.load(Ordering::Relaxed)
            || self.asked.fetch_add(rays, Ordering::Relaxed) < self.enough
            || self.taken.swap(true, Ordering::Relaxed)
        {
            return None;
        }
        Some(self.found.get_or_init(|| self.survey()))
    }

    fn survey(&self) -> Found {
        let Self { scene, world, textures, .. } = self;
        let (mut faces, mut known, mut maps) = (Vec::with_capacity(self.count), Vec::new(), Vec::new());
        for (instance, placed) in (0..).zip(&scene.instances) {
            let mesh = &scene.meshes[placed.mesh as usize];
            let Some(cut) = self.cuts[mesh.material as usize] else { continue };
            let Some(uvs) = cut.coordinates(mesh) else { continue };
            let what = (cut.map.texture, cut.channel, cut.most);
            let map = known.iter().position(|known| *known == what).unwrap_or_else(|| {
                known.push(what);
                maps.push(textures.clear(cut.map.texture, cut.channel, cut.most));
                maps.len() - 1
            });
            let (map, one_sided) = (map as u32 + 1, u32::from(cut.one_sided));
            let (turn, size) = (Turn::new(&cut.map.transform), textures.size(cut.map.texture));
            let outward = if world.placement(instance).mirrored { -1.0 } else { 1.0 };
            for (prim, corners) in world.triangles_of(instance).zip(&mesh.triangles) {
                let uv = corners.map(|i| uvs.get(i as usize).map_or(Vec2::NAN, |&uv| turn.apply(uv)) * size);
                let face = Face::new(world.triangle(prim), uv, cut.map.transform.offset * size, outward);
                faces.push(face.map_or(Face::zeroed(), |face| Face { map, one_sided, ..face }));
            }
        }
        Found { maps, faces }
    }
}

impl<'a> Cut<'a> {
    fn of(material: &'a Material) -> Option<Self> {
        let most = most(material)?;
        let is_number = material.opacity.is_finite() && material.base_color.is_finite();
        if material.reflection.transmits() || !is_number {
            return None;
        }
        // Each says so by itself, whatever the other says.
        let (map, channel) = match (&material.opacity_map, &material.base_color_map) {
            (Some(map), _) => (map, 0),
            (None, Some(map)) => (map, 3),
            (None, None) => return None,
        };
        Some(Self { map, channel, most, one_sided: !material.double_sided })
    }

    /// Where a mesh has its map, if nothing else says how opaque it is.
    fn coordinates<'m>(&self, mesh: &'m Mesh) -> Option<&'m [Vec2]> {
        let uvs = mesh.uvs.get(self.map.uv_set as usize).filter(|_| mesh.colors.is_empty())?;
        Some(uvs.as_slice())
    }
}

/// Of 8 bits the highest code of a map with which a material is not there, if there is one.
fn most(material: &Material) -> Option<u8> {
    match material.alpha_mode {
        AlphaMode::Opaque => None,
        AlphaMode::Blend => Some(0),
        AlphaMode::Mask { cutoff } => {
            /// Means in smaller copies are rounded, at most by this.
            const ROUNDED: f32 = 1e-3;
            let is_hole = |code: &u8| material.opacity * (f32::from(*code) / 255.0 + ROUNDED) < cutoff;
            (0..=u8::MAX).take_while(is_hole).last()
        }
    }
}

#[expect(clippy::cast_possible_truncation, reason = "what is too large becomes infinite, and is not used")]
fn narrow(x: f64) -> f32 {
    x as f32
}

impl Face {
    /// That of a triangle with these coordinates, texels, at its corners, to which an offset is added; `None` where they tell
    /// nothing of use.
    fn new(corners: [Vec3; 3], uv: [Vec2; 3], offset: Vec2, outward: f32) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let normal = e1.cross(e2);
        let twice = normal.length();
        // Of slivers rounding makes too much.
        if e1.length() * e2.length() > twice * SLENDER {
            return None;
        }
        let (second, third) = (e2.cross(normal) / (twice * twice), normal.cross(e1) / (twice * twice));
        let [first, of_second, of_third] = uv.map(|uv| uv.as_dvec2());
        let edges = [of_second - first, of_third - first];
        let along = [0, 1].map(|k: usize| second * edges[0][k] + third * edges[1][k]);
        let at = first + offset.as_dvec2() - DVec2::new(along[0].dot(a), along[1].dot(a));
        // The longer axis of the ellipse that a unit circle becomes.
        let (u, v, both) = (along[0].length_squared(), along[1].length_squared(), along[0].dot(along[1]));
        let growth = (0.5 * (u + v) + (0.25 * (u - v) * (u - v) + both * both).sqrt()).sqrt();
        let largest = |v: [DVec3; 3]| v.into_iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);
        let coordinates = uv.map(|uv| uv.as_dvec2().extend(0.0));
        let error = growth * largest([a, b, c]) + largest(coordinates) + offset.as_dvec2().abs().max_element();
        let normal = normal / twice * f64::from(outward);
        let face = Self {
            normal: normal.as_vec3(),
            place: narrow(normal.dot(a)),
            along: along.map(|along| along.as_vec3()),
            at: at.as_vec2(),
            growth: narrow(growth),
            map: 0,
            one_sided: 0,
            error: narrow(error) * ROUNDING,
        };
        let is_known = face.growth > 0.0 && (face.growth + face.error + face.place).is_finite();
        (is_known && face.at.is_finite() && face.normal.is_finite()).then_some(face)
    }

    /// Those of some rays around which a map is clear where they meet the plane; of maps as sharp as they are where cones have
    /// no width.
    #[inline(always)]
    fn clear<const N: usize>(&self, map: &Clear, rays: &Rays<N>) -> u32 {
        let backs_count = rays.looks & (self.one_sided == 1);
        let (mut at, mut needed) = ([[0.0; N]; 2], [0.0; N]);
        for (i, needed) in needed.iter_mut().enumerate() {
            let [origin, dir] = [&rays.origin, &rays.dir].map(|rows| Vec3::new(rows[0][i], rows[1][i], rows[2][i]));
            let (slope, length) = (self.normal.dot(dir), dir.length());
            let t = (self.place - self.normal.dot(origin)) / slope;
            let position = origin + dir * t;
            (at[0][i], at[1][i]) = (self.along[0].dot(position) + self.at.x, self.along[1].dot(position) + self.at.y);
            let longer = length / slope.abs();
            let [width, spread] = [rays.cone[0][i], rays.cone[1][i]];
            let largest = origin.abs().max_element() + t.abs() * length + self.place.abs();
            let largest_at = at[0][i].abs().max(at[1][i].abs());
            let error = BLUR + self.error + (largest * self.growth * longer + largest_at) * ROUNDING;
            let across = (width + spread * t) * self.growth;
            let reach = map.reach(across, across * longer) + error;
            // Backs of one-sided faces are passed, too, but as something that is there.
            let unknown = (longer > GRAZING) | (t <= rays.from[i]) | (backs_count & (slope > 0.0));
            *needed = if unknown { f32::INFINITY } else { reach };
        }
        let room = map.room(&at);
        // False for what is no number.
        (0..N).fold(0, |clear, i| clear | u32::from(needed[i] <= room[i]) << i)
    }
}

/// A ray that meets faces.
#[derive(Clone, Copy)]
struct Sight<'r> {
    ray: &'r Ray,
    /// Width of its cone at the start, and its growth.
    cone: [f32; 2],
    /// Where it may meet what it has crossed, or comes from, once more: up to here nothing is passed, for that matters to what
    /// comes next.
    from: f32,
}

/// Rays in lanes.
struct Rays<const N: usize> {
    origin: [[f32; N]; 3],
    dir: [[f32; N]; 3],
    /// Widths of their cones at the start, and their growths.
    cone: [[f32; N]; 2],
    from: [f32; N],
    /// Whether they look, and see fronts alone of what is one-sided.
    looks: bool,
}

impl<const N: usize> Rays<N> {
    #[inline(always)]
    fn new(of: [Sight; N], looks: bool) -> Self {
        let mut rays = Self { origin: [[0.0; N]; 3], dir: [[0.0; N]; 3], cone: [[0.0; N]; 2], from: [0.0; N], looks };
        for (i, Sight { ray, cone, from }) in of.into_iter().enumerate() {
            for k in 0..3 {
                (rays.origin[k][i], rays.dir[k][i]) = (ray.origin[k], ray.dir[k]);
            }
            (rays.cone[0][i], rays.cone[1][i], rays.from[i]) = (cone[0], cone[1], from);
        }
        rays
    }
}

/// Eight rays that meet a face.
struct Eight<'r>(&'r Face, &'r Clear, Rays<LANES>);

impl Kernel for Eight<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> u32 {
        let Self(face, map, rays) = self;
        face.clear(map, &rays)
    }
}

/// The cones around rays, by number.
#[derive(Clone, Copy)]
pub(super) enum Cones<'r> {
    /// Widths and growths.
    Eyes([&'r [f32]; 2]),
    /// What rays carry that start, and what each comes from.
    Starting(&'r [Path], &'r [Hit]),
    /// Or that go on.
    Continuing(&'r [Path]),
}

impl<'r> From<&'r Wave> for Cones<'r> {
    fn from(Wave { starts, paths, after, .. }: &'r Wave) -> Self {
        if *starts { Self::Starting(paths, after) } else { Self::Continuing(paths) }
    }
}

/// Rays that look for what is there.
pub(super) struct Before<'r, 'a> {
    clearings: &'r Clearings<'a>,
    rays: &'r [Ray],
    cones: Cones<'r>,
}

impl Before<'_, '_> {
    /// A ray and its cone.
    #[inline]
    fn sight(&self, ray: usize) -> Sight<'_> {
        let of = |path: &Path, before: &Hit| {
            let Ray { origin, .. } = &self.rays[ray];
            let near = (before.t.abs() + origin.abs().max_element()) * NEAR;
            let from = if before.is_some() { before.t + near } else { f32::NEG_INFINITY };
            (path.cone_width, path.cone_spread, from)
        };
        let (width, spread, from) = match self.cones {
            Cones::Eyes([width, spread]) => (width[ray], spread[ray], f32::NEG_INFINITY),
            Cones::Starting(paths, after) => of(&paths[ray], &after[ray]),
            Cones::Continuing(paths) => of(&paths[ray], &paths[ray].crossed),
        };
        Sight { ray: &self.rays[ray], cone: [width, spread], from }
    }
}

impl Gaps for Before<'_, '_> {
    fn is_gap(&self, ray: usize, prim: u32) -> bool {
        self.clearings.is_clear(&self.sight(ray), true, prim)
    }

    fn gaps(&self, first: usize, rays: u32, prim: u32) -> u32 {
        let (mut left, mut passing) = (rays, 0);
        let Some((face, map)) = self.clearings.face(prim, rays.count_ones() as usize) else { return 0 };
        while left != 0 {
            // The next eight, be they neighbours or not.
            let (mut numbers, mut count) = ([left.trailing_zeros(); LANES], 0);
            while left != 0 && count < LANES {
                numbers[count] = left.trailing_zeros();
                left &= left - 1;
                count += 1;
            }
            let clear = if count == 1 {
                face.clear(map, &Rays::new([self.sight(first + numbers[0] as usize)], true))
            } else {
                let rays = Rays::new(numbers.map(|number| self.sight(first + number as usize)), true);
                Level::best().run_narrow(Eight(face, map, rays))
            };
            for (i, number) in numbers.iter().enumerate().take(count) {
                passing |= (clear >> i & 1) << number;
            }
        }
        passing
    }
}
