//! `auto`: whichever fast structure costs less for a fixed sample of rays.
//!
//! After M. Hapala, O. Karlík, V. Havran, *When It Makes Sense to Use Uniform Grids for Ray Tracing*, 2011: both structures
//! are built, some rays are traced through each, and the cheaper one wins. Here the cost is counted, never timed, so that the
//! choice depends on neither the machine nor the number of threads; and only a sample of the prims is judged, to keep the
//! choice cheap.
//!
//! Ray origins are distributed over the surface by area, as light would be. A ray must visit the nodes that contain its
//! origin, and where large faces make boxes overlap, their number separates the structures better than any other measure
//! (after T. Aila, T. Karras, S. Laine, *On Quality Metrics of Bounding Volume Hierarchies*, 2013). A reversed eye ray is one
//! of these rays, too. Faces larger than one ray's share of the surface are always in the sample. A ray that starts on such a
//! face, with its origin rounded to the other side, hits that face at once: it counts only the nodes around its origin, not a
//! way through a scene of which most is left out.
//!
//! Both structures build equally fast and mostly cost nearly the same; where fine detail stands in a wide scene the octree
//! may cost much less. So the hierarchy must save more than a sample may show by chance, and a little more, because sampling
//! prims favours it: of five large samples each of two meshes for which both structures do equally well, none differed by a
//! twentieth. Few shapes are split alike by both, and small scenes take no sample: a proportional one would show nothing, and
//! a larger one takes longer than it could save. The same holds for pictures with few pixels.

use std::fmt;
use std::str::FromStr;

use super::instances::Object;
use super::shapes::Prim;
use super::wide::ALIKE;
use super::{
    Accel, AccelKind, AccelParams, AnyAccel, BitSet, Hit, InstancedObjects, Ray, RayCounts, Shapes, Splitting, Wide,
};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::math::triangle;
use crate::named::{Named, UnknownName};
use rayon::prelude::*;

/// One prim in this many is sampled: the choice must cost less than it can save.
const SHARE: u32 = 32;
/// Smallest sample, in prims; below it the octree is taken.
const FEWEST: u32 = 1 << 10;
/// Largest sample, in prims.
const MOST: u32 = 1 << 13;

/// Length of the runs of neighbouring prims in a sample: longer runs leave out more of the scene.
const RUN: u32 = 4;

/// Prims of one part of the sample, roughly. Splits of a tree over few prims depend on chance: the mean of several trees
/// tells more than one tree over all.
const PART: u32 = 1 << 11;

/// Number of rays in the sample.
const RAYS: usize = 1 << 10;

/// Prims per partial sum of areas.
const CHUNK: u32 = 1 << 12;

/// Share of the octree's cost that the hierarchy must save.
const WORTH: f64 = 1.0 / 20.0;

/// Fewest eye rays of a picture per sampled prim: judging one prim takes as long as tracing a dozen eye rays and their
/// secondary rays, and the better structure saves only a part of that.
const RAYS_A_PRIM: u64 = 64;

/// Cost of a block of eight triangles, in nodes of eight boxes.
const BLOCK: f64 = 1.5;

/// Structure asked for: a given kind, or an automatic choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum AccelChoice {
    /// The cheaper of the fast structures.
    #[default]
    Auto,
    /// The given kind.
    Kind(AccelKind),
}

impl AccelChoice {
    /// Name of [`Self::Auto`] on the command line.
    pub const AUTO: &'static str = "auto";

    /// Name on the command line and in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => Self::AUTO,
            Self::Kind(kind) => kind.name(),
        }
    }

    /// Structures that may be built.
    pub const fn kinds(&self) -> &[AccelKind] {
        match self {
            Self::Auto => &[AccelKind::FastOctree, AccelKind::FastBvh],
            Self::Kind(kind) => std::slice::from_ref(kind),
        }
    }
}

impl fmt::Display for AccelChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for AccelChoice {
    type Err = UnknownName;

    fn from_str(name: &str) -> Result<Self, UnknownName> {
        if name == Self::AUTO { Ok(Self::Auto) } else { name.parse().map(Self::Kind) }
    }
}

impl Named for AccelChoice {
    const WHAT: &'static str = AccelKind::WHAT;

    fn names() -> impl Iterator<Item = &'static str> {
        std::iter::once(Self::AUTO).chain(AccelKind::names())
    }
}

/// Chosen structure, and the reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reason {
    /// Chosen kind.
    pub kind: AccelKind,
    /// Number of prims judged: those of a sample, else all.
    pub prims: usize,
    /// Ground of the choice.
    pub why: Why,
}

/// Ground on which a structure is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Why {
    /// Both structures would be the same tree.
    OneTree,
    /// There are too few prims for a sample.
    FewPrims,
    /// Too few eye rays, this many, for a sample.
    FewRays(u64),
    /// No surface from which sample rays could start.
    NoSurface,
    /// The cost of sample rays.
    Sample(Sample),
}

/// Cost of the sample rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Number of rays.
    pub rays: usize,
    /// Mean cost of a ray through `fast-octree`, in nodes.
    pub octree: f64,
    /// Mean cost of a ray through `fast-bvh`, in nodes.
    pub bvh: f64,
}

impl Reason {
    /// Cost of the sample rays, if a sample was taken.
    pub fn sample(&self) -> Option<Sample> {
        if let Why::Sample(sample) = self.why { Some(sample) } else { None }
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, prims, why } = *self;
        write!(f, "{kind}: ")?;
        match why {
            Why::OneTree => write!(f, "{prims} shapes, and up to {ALIKE} are cut alike by fast-octree and fast-bvh"),
            Why::FewPrims => {
                let fewest = SHARE * FEWEST;
                write!(f, "{prims} shapes, and with fewer than {fewest} a sample would take longer than it may save")
            }
            Why::FewRays(rays) => write!(
                f,
                "{prims} shapes, and for what begins with {rays} eye rays a sample would take longer than it may save"
            ),
            Why::NoSurface => write!(f, "{prims} shapes without an area from which rays of a sample could start"),
            Why::Sample(Sample { rays, octree, bvh }) => write!(
                f,
                "{rays} rays through a sample of {prims} shapes cost {octree:.1} nodes each with fast-octree, {bvh:.1} with \
                 fast-bvh, which must save {:.1} %, more than chance in such a sample",
                WORTH * 100.0
            ),
        }
    }
}

/// Builds the chosen structure, for any number of rays; also returns the reason if there was a choice. The result does not
/// depend on the number of threads.
pub fn build<'a>(choice: AccelChoice, shapes: &'a Shapes, params: &AccelParams) -> (AnyAccel<'a>, Option<Reason>) {
    build_for(u64::MAX, choice, shapes, params)
}

fn build_for<'a>(
    eye_rays: u64,
    choice: AccelChoice,
    shapes: &'a Shapes,
    params: &AccelParams,
) -> (AnyAccel<'a>, Option<Reason>) {
    if let AccelChoice::Kind(kind) = choice {
        return (AnyAccel::build(kind, shapes, params), None);
    }
    let reason = judge(shapes, eye_rays);
    (AnyAccel::build(reason.kind, shapes, params), Some(reason))
}

/// Builds a structure like [`build`] over `shapes` and `instanced` objects, for the given number of eye rays. The largest set
/// of prims, `shapes` or one object, is judged.
pub fn build_with<'a>(
    eye_rays: u64,
    choice: AccelChoice,
    shapes: &'a Shapes,
    instanced: &'a InstancedObjects,
    params: &AccelParams,
) -> (AnyAccel<'a>, Option<Reason>) {
    if instanced.is_empty() {
        return build_for(eye_rays, choice, shapes, params);
    }
    let (kind, reason) = match choice {
        AccelChoice::Kind(kind) => (kind, None),
        AccelChoice::Auto => {
            let reason = reason(shapes, instanced, eye_rays);
            (reason.kind, Some(reason))
        }
    };
    (AnyAccel::build_with(kind, shapes, instanced, params), reason)
}

/// Choice of [`build_with`], and its reason, judged by the largest set of prims over which a tree is built.
pub fn reason(shapes: &Shapes, instanced: &InstancedObjects, eye_rays: u64) -> Reason {
    let objects = instanced.objects().iter().map(Object::shapes);
    let largest = objects.fold(shapes, |a, b| if b.bounded() >= a.bounded() { b } else { a });
    judge(largest, eye_rays)
}

/// Judges a scene by a sample of its prims, if it is large and the number of eye rays is worth it.
fn judge(shapes: &Shapes, eye_rays: u64) -> Reason {
    let bounded = shapes.bounded();
    let judged = (bounded / SHARE).min(MOST);
    let without = |why| Reason { kind: AccelKind::FastOctree, prims: bounded as usize, why };
    if judged < FEWEST {
        return without(if bounded as usize <= ALIKE { Why::OneTree } else { Why::FewPrims });
    }
    if eye_rays < RAYS_A_PRIM * u64::from(judged) {
        return without(Why::FewRays(eye_rays));
    }
    let starts = over_surface(shapes, RAYS);
    if starts.is_empty() {
        return without(Why::NoSurface);
    }
    let rays = sample(shapes, &starts);
    let count = (judged / PART).max(1);
    // Each part is traced with its share of the rays, from all over the surface.
    let of_part = |k: u32| {
        let part = part(shapes, judged / count, u64::from(k), &starts);
        let rays: Vec<Ray> = rays.iter().skip(k as usize).step_by(count as usize).copied().collect();
        let times = (bounded / part.bounded()) as usize;
        let cost = |splitting| cost(&Wide::build_sample(&part, splitting, times), &rays);
        let (octree, bvh) = rayon::join(|| cost(Splitting::Octree), || cost(Splitting::SurfaceArea));
        (octree / f64::from(count), bvh / f64::from(count), part.bounded() as usize)
    };
    let costs: Vec<(f64, f64, usize)> = (0..count).into_par_iter().map(of_part).collect();
    let (octree, bvh, prims) = costs.iter().fold((0.0, 0.0, 0), |(o, b, n), of| (o + of.0, b + of.1, n + of.2));
    let kind = if bvh < octree * (1.0 - WORTH) { AccelKind::FastBvh } else { AccelKind::FastOctree };
    Reason { kind, prims, why: Why::Sample(Sample { rays: rays.len(), octree, bvh }) }
}

/// Mean cost of a ray, in nodes.
fn cost(accel: &Wide, rays: &[Ray]) -> f64 {
    let mut counts = RayCounts::default();
    accel.closest(rays, &mut vec![Hit::MISS; rays.len()], &mut accel.scratch(), &mut counts);
    nodes(&counts)
}

/// Mean cost of a ray in nodes, the measure of the choice.
pub fn nodes(counts: &RayCounts) -> f64 {
    let blocks = counts.n_ets as f64;
    (counts.n_ts as f64 - blocks + blocks * BLOCK) / counts.queries.max(1) as f64
}

/// Samples at most about `judged` prims, in runs of neighbours spread over all of them, different ones for each `time`; prims
/// that occur more than once in `starts` are always included.
fn part(shapes: &Shapes, judged: u32, time: u64, starts: &[u32]) -> Shapes {
    let bounded = shapes.bounded();
    let stride = bounded.div_ceil(judged / RUN);
    let (mut part, mut random) = (Shapes::default(), Random::new(time));
    let mut large = starts.chunk_by(|a, b| a == b).filter(|same| same.len() > 1).map(|same| same[0]).peekable();
    for start in (0..bounded).step_by(stride as usize) {
        // At random: files repeat patterns, and even steps would always hit the same part of them.
        let room = stride.saturating_sub(RUN) as usize + 1;
        let first = start.saturating_add(u32::try_from(random.below(room)).unwrap_or(0));
        let run = first..bounded.min(first.saturating_add(RUN));
        while let Some(prim) = large.next_if(|prim| *prim < run.end) {
            if !run.contains(&prim) {
                copy(shapes, prim, &mut part);
            }
        }
        run.for_each(|prim| copy(shapes, prim, &mut part));
    }
    large.for_each(|prim| copy(shapes, prim, &mut part));
    part.opaque = BitSet::filled(part.len(), true);
    part
}

fn copy(shapes: &Shapes, prim: u32, part: &mut Shapes) {
    let base = u32::try_from(part.vertices.len()).unwrap_or(0);
    match shapes.prim(prim) {
        Prim::Triangle(corners) => {
            part.vertices.extend(corners);
            part.triangles.push([base, base + 1, base + 2]);
        }
        Prim::Polygon(polygon) => {
            part.vertices.extend(polygon.points());
            let first = u32::try_from(part.polygon_corners.len()).unwrap_or(0);
            let len = u32::try_from(polygon.corners.len()).unwrap_or(0);
            part.polygon_corners.extend(base..base + len);
            part.polygons.push((first, len));
        }
        Prim::Sphere(sphere) => part.spheres.push(sphere),
        Prim::Cone(cone) => part.cones.push(*cone),
        Prim::Plane(..) => {}
    }
}

/// Twice the area of a triangle, or half the surface of another prim's box; 0 if that is not finite.
fn area(shapes: &Shapes, prim: u32) -> f32 {
    let area = match shapes.triangles.get(prim as usize) {
        Some(&corners) => {
            let [a, b, c] = shapes.corners(corners);
            (b - a).cross(c - a).length()
        }
        None => {
            let size = shapes.bounds(prim).hi - shapes.bounds(prim).lo;
            size.x * size.y + size.y * size.z + size.z * size.x
        }
    };
    if area.is_finite() { area } else { 0.0 }
}

/// Picks `count` prims at even steps of surface area, in order: a prim larger than a step occurs several times.
fn over_surface(shapes: &Shapes, count: usize) -> Vec<u32> {
    let bounded = shapes.bounded();
    let chunk = |i: u32| i * CHUNK..bounded.min((i + 1).saturating_mul(CHUNK));
    let measured = |i: u32| {
        let areas: Vec<f32> = chunk(i).map(|prim| area(shapes, prim)).collect();
        let sum: f64 = areas.iter().copied().map(f64::from).sum();
        (areas, sum)
    };
    let measured: Vec<(Vec<f32>, f64)> = (0..bounded.div_ceil(CHUNK)).into_par_iter().map(measured).collect();
    let all: f64 = measured.iter().map(|(_, sum)| sum).sum();
    #[expect(clippy::cast_precision_loss, reason = "a small number")]
    let step = all / count as f64;
    if step <= 0.0 {
        return Vec::new();
    }
    let mut chunks = Vec::with_capacity(measured.len());
    let mut before = 0.0;
    for (i, (areas, sum)) in (0..).zip(measured) {
        chunks.push((i, areas, before, before + sum));
        before += sum;
    }
    // Samples lie half a step off whole steps.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to count")]
    let first = |area: f64| ((area / step + 0.5) as usize).min(count);
    let found = |(i, areas, before, end): (u32, Vec<f32>, f64, f64)| {
        let (mut at, mut so_far) = (chunk(i).start, before);
        let mut prims = chunk(i).zip(areas);
        let place = |k: usize| {
            #[expect(clippy::cast_precision_loss, reason = "a small number")]
            let place = (k as f64 + 0.5) * step;
            while so_far <= place
                && let Some((prim, area)) = prims.next()
            {
                (at, so_far) = (prim, so_far + f64::from(area));
            }
            at
        };
        (first(before)..first(end)).map(place).collect::<Vec<u32>>()
    };
    chunks.into_par_iter().flat_map_iter(found).collect()
}

/// Rays in random directions from random points on the given prims.
fn sample(shapes: &Shapes, starts: &[u32]) -> Vec<Ray> {
    let mut random = Random::new(0);
    let mut ray = |&prim: &u32| {
        let (origin, dir) = (place(shapes, prim, &mut random), random.direction());
        Ray::new(origin, dir)
    };
    starts.iter().map(&mut ray).collect()
}

/// Random point on a triangle, or in the box of another prim.
fn place(shapes: &Shapes, prim: u32, random: &mut Random) -> Vec3 {
    match shapes.triangles.get(prim as usize) {
        Some(&corners) => triangle::within(&shapes.corners(corners), random.unit(), random.unit()),
        None => {
            let bounds = shapes.bounds(prim);
            bounds.lo + (bounds.hi - bounds.lo) * Vec3::new(random.unit(), random.unit(), random.unit())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;

    fn chosen(shapes: &Shapes) -> Reason {
        let (accel, reason) = build(AccelChoice::Auto, shapes, &AccelParams::DEFAULT);
        let reason = reason.unwrap();
        assert_eq!(accel.kind(), reason.kind);
        reason
    }

    /// Three clumps along each axis, so that middle planes cut through them, with `each` triangles per clump.
    fn clumps(each: u32) -> Shapes {
        let mut random = Random::new(5);
        let mut vertices = Vec::new();
        for i in 0..27 * each {
            let clump = Vec3::from([i % 3, i / 3 % 3, i / 9 % 3].map(|k| k as f32 - 1.0));
            let corner = clump + random.cube() * 0.1;
            vertices.extend([corner, corner + random.cube() * 0.02, corner + random.cube() * 0.02]);
        }
        scenes::mesh(vertices, (0..27 * each).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
    }

    #[test]
    fn a_choice_that_is_asked_for_is_taken() {
        assert_eq!(AccelChoice::default().name(), "auto");
        let shapes = scenes::copies(9);
        let (accel, reason) = build(AccelChoice::Kind(AccelKind::Grid), &shapes, &AccelParams::DEFAULT);
        assert_eq!((accel.kind(), reason), (AccelKind::Grid, None));
    }

    #[test]
    fn the_hierarchy_is_taken_where_it_saves_enough_and_the_octree_elsewhere() {
        let large = [("clumps", clumps(2000)), ("star", scenes::star(300, 150)), ("copies", scenes::copies(40_000))];
        for (name, shapes) in large {
            let reason = chosen(&shapes);
            let Some(Sample { octree, bvh, .. }) = reason.sample() else { panic!("{name}: {reason}") };
            assert!(reason.prims < shapes.len(), "{name}: {reason}");
            let saves = bvh < octree * (1.0 - WORTH);
            let better = if saves { AccelKind::FastBvh } else { AccelKind::FastOctree };
            assert_eq!(reason.kind, better, "{name}: {reason}");
            match name {
                "clumps" => assert_eq!(reason.kind, AccelKind::FastBvh, "{reason}"),
                // No plane separates copies: both are the same tree.
                "copies" => assert_eq!(octree, bvh, "{reason}"),
                _ => {}
            }
        }
    }

    #[test]
    fn scenes_that_are_not_large_get_the_octree_without_a_sample() {
        for (name, shapes) in scenes::all() {
            let reason = chosen(&shapes);
            assert_eq!((reason.kind, reason.sample()), (AccelKind::FastOctree, None), "{name}: {reason}");
        }
        let why = |each| chosen(&clumps(each)).to_string();
        let clumps = clumps(2000);
        let for_rays = |rays| build_for(rays, AccelChoice::Auto, &clumps, &AccelParams::DEFAULT).1.unwrap();
        let judged = u64::from(clumps.bounded() / SHARE);
        let (few, enough) = (for_rays(RAYS_A_PRIM * judged - 1), for_rays(RAYS_A_PRIM * judged));
        assert_eq!(
            (few.kind, few.why, enough.kind),
            (AccelKind::FastOctree, Why::FewRays(RAYS_A_PRIM * judged - 1), AccelKind::FastBvh),
            "{few}, {enough}"
        );
        assert!(few.to_string().contains(&format!("begins with {} eye rays", RAYS_A_PRIM * judged - 1)), "{few}");
        assert!(why(10).contains("270 shapes") && why(10).contains("cut alike"), "{}", why(10));
        assert!(why(100).contains("2700 shapes") && why(100).contains("fewer than 32768"), "{}", why(100));
    }

    #[test]
    fn up_to_so_few_shapes_both_splittings_give_one_tree() {
        let counts = |shapes: &Shapes| {
            let rays = sample(shapes, &over_surface(shapes, 400));
            [Splitting::Octree, Splitting::SurfaceArea].map(|splitting| cost(&Wide::build(shapes, splitting), &rays))
        };
        let (few, more) = (clumps(u32::try_from(ALIKE).unwrap() / 27), clumps(300));
        let ([a, b], [c, d]) = (counts(&few), counts(&more));
        assert!(a == b && c != d, "{a} {b}, {c} {d}");
    }

    #[test]
    fn a_large_mesh_is_judged_by_a_part_of_it_and_by_any_number_of_threads_alike() {
        let shapes = scenes::star(300, 150);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.map(|pool| pool.install(|| chosen(&shapes))).ok()
        };
        let one = with(1).unwrap();
        let most = shapes.len() / SHARE as usize;
        assert!(one.prims > most * 9 / 10 && one.prims <= most && most > 2 * FEWEST as usize, "{one}");
        assert_eq!([with(2), with(7)], [Some(one); 2]);
    }

    #[test]
    fn rays_start_from_large_faces_as_often_as_these_are_large() {
        let mut random = Random::new(9);
        let mut corners: Vec<Vec3> = (0..3 * 9000).map(|_| random.cube() * 0.5).collect();
        // A triangle as large as all others together.
        let areas: f32 = corners.chunks(3).map(|t| (t[1] - t[0]).cross(t[2] - t[0]).length()).sum();
        corners.extend([Vec3::ZERO, Vec3::X * areas, Vec3::Y]);
        let shapes = scenes::mesh(corners, (0..9001).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
        let starts = over_surface(&shapes, 1000);
        let large = starts.iter().filter(|&&prim| prim == 9000).count();
        assert!(starts.len() == 1000 && large.abs_diff(500) < 3 && starts.is_sorted(), "{large} {}", starts.len());
        let judged = part(&shapes, 512, 3, &starts);
        assert!(judged.triangles.len() <= 513 && judged.vertices.contains(&(Vec3::X * areas)));
    }

    #[test]
    fn a_scene_without_bounded_shapes_is_no_trouble() {
        let shapes = Shapes { planes: vec![(Vec3::Y, 0.0)], opaque: BitSet::filled(1, true), ..Shapes::default() };
        assert_eq!(chosen(&shapes).why, Why::OneTree);
    }

    #[test]
    fn many_shapes_without_an_area_are_told_as_what_they_are() {
        let count = SHARE * FEWEST + 1;
        let along = (0..count + 2).map(|i| Vec3::X * i as f32).collect();
        let shapes = scenes::mesh(along, (0..count).map(|i| [i, i + 1, i + 2]).collect());
        let reason = chosen(&shapes);
        assert!(reason.why == Why::NoSurface && reason.to_string().contains("without an area"), "{reason}");
    }
}
