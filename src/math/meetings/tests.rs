//! Intersections in lanes equal those of the scalar form.

use super::*;
use crate::math::random::Random;
use crate::math::shear::RaySpace;
use crate::math::sight::{RowSight, Rows};
use crate::math::simd::WIDE;
use crate::math::simd::{Kernel, Level};
use crate::math::triangle::{self, Triangle};
use crate::math::triangles::{NO_CORNERS, Verdicts, set_corners};
use crate::math::{DVec3, Vec3};

/// Eight rays against a triangle: the verdicts, and the intersections with its plane.
struct Row8<'a>(&'a [RaySpace; LANES], &'a Triangle, Option<Vec3>);

impl Kernel for Row8<'_> {
    type Output = (Verdicts, Meetings<Row>);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let Self(rays, triangle, from) = self;
        let (mut origin, mut dir) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, ray) in rays.iter().enumerate() {
            for k in 0..3 {
                (origin[k][lane], dir[k][lane]) = (ray.origin[k], ray.dir[k]);
            }
        }
        let mut corners = NO_CORNERS;
        set_corners(&mut corners, 3, triangle);
        let per_length = s.store(s.div(s.splat(1.0), s.load(&dir[rays[0].z])));
        let sight = RowSight::<S, LANES>::new(s, &origin, &dir, rays[0].z, &per_length);
        let (verdicts, _) = sight.test(s, &sight.ready(s, &corners), 3);
        let plane = Plane::of(triangle);
        let (least, most) = (
            |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::min).unwrap(),
            |f: fn(&RaySpace) -> DVec3| rays.iter().map(f).reduce(DVec3::max).unwrap(),
        );
        let bounds = RowBounds {
            low: least(|r| r.origin.as_dvec3()),
            high: most(|r| r.origin.as_dvec3()),
            from: from.map(Vec3::as_dvec3),
            dir: most(|r| r.dir.as_dvec3().abs()).max_element(),
        };
        let Meetings { t, weights: [u, v], sure } = plane.meet(s, &origin, &dir, &bounds);
        (verdicts, Meetings { t: s.store(t), weights: [s.store(u), s.store(v)], sure })
    }
}

#[test]
fn eight_rays_side_by_side_meet_a_triangle_as_each_does_alone() {
    let mut random = Random::new(21);
    let (mut hits, mut sure) = (0, 0);
    for _ in 0..3000 {
        let triangle = [random.cube(), random.cube(), random.cube()];
        let origin = random.cube() * 4.0;
        let aim = |_| triangle::within(&triangle, random.unit() * 1.2, random.unit());
        let rays: Vec<RaySpace> = (0..LANES).map(aim).filter_map(|p| RaySpace::new(origin, p - origin)).collect();
        let Ok(rays) = <[RaySpace; LANES]>::try_from(rays) else { continue };
        if rays.iter().any(|r| r.z != rays[0].z) {
            continue;
        }
        // All rays start there, whether the row is told so or not.
        for (level, from) in Level::all().into_iter().flat_map(|l| [(l, None), (l, Some(origin))]) {
            let (verdicts, met) = level.run(Row8(&rays, &triangle, from));
            let [u, v] = met.weights;
            for (lane, ray) in rays.iter().enumerate() {
                let (bit, hit) = (1 << lane, triangle::is_hit(ray, &triangle));
                assert!(verdicts.unsure & bit != 0 || (verdicts.hit & bit != 0) == hit, "{}", level.name());
                if !hit || met.sure & bit == 0 {
                    continue;
                }
                let alone = triangle::meet(ray, &triangle);
                assert_eq!(met.t[lane].to_bits(), alone.t.to_bits());
                assert_eq!((u[lane], v[lane]), triangle::barycentrics(ray, &triangle));
                sure += 1;
            }
            hits += rays.iter().filter(|r| triangle::is_hit(r, &triangle)).count();
        }
    }
    assert!(sure > 10_000 && sure > hits * 9 / 10, "{sure} of {hits}");
}

struct Meet<'a>(&'a Pairs);

impl Kernel for Meet<'_> {
    type Output = Meetings<Row>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Meetings<Row> {
        self.0.meet(s)
    }
}

fn set(pairs: &mut Pairs, lane: usize, ray: &RaySpace, triangle: &Triangle) {
    for k in 0..3 {
        (pairs.origin[k][lane], pairs.dir[k][lane]) = (ray.origin[k], ray.dir[k]);
    }
    set_corners(&mut pairs.corners, lane, triangle);
}

/// Configuration of a ray and a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Ordinary,
    /// The ray runs nearly in the triangle's plane.
    Grazing,
    /// The ray starts many sizes away.
    Far,
    Tiny,
    /// The ray starts next to the triangle, or on it.
    Near,
    /// The ray hits the triangle at a corner or an edge.
    Edge,
}

const KINDS: [Kind; 6] = [Kind::Ordinary, Kind::Grazing, Kind::Far, Kind::Tiny, Kind::Near, Kind::Edge];

fn pair(random: &mut Random, kind: Kind) -> (Vec3, Vec3, Triangle) {
    let (place, e1, e2) = (random.cube(), random.cube(), random.cube());
    let size = if kind == Kind::Tiny { 2.0f32.powi(-20) } else { 1.0 };
    let triangle = [place, place + e1 * size, place + e2 * size];
    let (r, s) = (random.unit(), random.unit());
    let target = match kind {
        Kind::Edge if r < 0.5 => triangle[1],
        Kind::Edge => triangle::within(&triangle, s, 0.0),
        _ => triangle::within(&triangle, r, s),
    };
    let away = match kind {
        Kind::Grazing => e1 * random.unit() - e2 * random.unit() + random.cube() * 1e-2,
        Kind::Far => random.direction() * 1e5,
        Kind::Near => random.cube() * 1e-2,
        _ => random.cube() * 4.0,
    };
    (target - away, away * (0.1 + random.unit()), triangle)
}

/// Generates a ray of this kind that hits its triangle.
fn hit(random: &mut Random, kind: Kind) -> (RaySpace, Triangle) {
    loop {
        let (origin, dir, triangle) = pair(random, kind);
        if let Some(ray) = RaySpace::new(origin, dir).filter(|ray| triangle::is_hit(ray, &triangle)) {
            return (ray, triangle);
        }
    }
}

fn assert_met_as_alone(met: &Meetings<Row>, lane: usize, (ray, triangle): &(RaySpace, Triangle), context: &str) {
    let alone = triangle::meet(ray, triangle);
    assert_eq!(met.t[lane].to_bits(), alone.t.to_bits(), "{context}: {} for {}", met.t[lane], alone.t);
    let (u, v) = triangle::barycentrics_at(ray, triangle, alone.t_f64, alone.normal);
    assert_eq!(met.weights.map(|w| w[lane].to_bits()), [u, v].map(f32::to_bits), "{context}: {u}, {v}");
}

#[test]
fn eight_rays_meet_eight_triangles_as_each_does_alone() {
    let mut random = Random::new(41);
    for kind in KINDS {
        let (mut sure, mut lanes) = (0, 0);
        for _ in 0..250 {
            let hits: [_; LANES] = std::array::from_fn(|_| hit(&mut random, kind));
            let mut pairs = Pairs::EMPTY;
            (0..LANES).for_each(|lane| set(&mut pairs, lane, &hits[lane].0, &hits[lane].1));
            for level in Level::all() {
                let met = level.run(Meet(&pairs));
                (sure, lanes) = (sure + met.sure.count_ones(), lanes + LANES as u32);
                for lane in (0..LANES).filter(|lane| met.sure >> lane & 1 == 1) {
                    assert_met_as_alone(&met, lane, &hits[lane], &format!("{kind:?} on {}", level.name()));
                }
            }
        }
        let enough = if kind == Kind::Ordinary { lanes * 9 / 10 } else { lanes / 20 };
        assert!(sure > enough, "{kind:?}: {sure} of {lanes}");
    }
}

/// Sixteen rays, made from two pairs of eight.
struct MeetWide<'a>([&'a Pairs; 2]);

impl Kernel for MeetWide<'_> {
    type Output = ([[f32; WIDE]; 3], u32);

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Self::Output {
        let [low, high] = self.0;
        let wide = s.wide();
        let join = |row: fn(&Pairs, usize) -> &Row, k: usize| {
            std::array::from_fn(|lane| row(if lane < LANES { low } else { high }, k)[lane % LANES])
        };
        let rows = |row| loaded(wide, &[join(row, 0), join(row, 1), join(row, 2)]);
        let corners = [rows(|p, k| &p.corners[0][k]), rows(|p, k| &p.corners[1][k]), rows(|p, k| &p.corners[2][k])];
        let met = meet(wide, rows(|p, k| &p.origin[k]), rows(|p, k| &p.dir[k]), corners);
        ([wide.store(met.t), wide.store(met.weights[0]), wide.store(met.weights[1])], met.sure)
    }
}

#[test]
fn sixteen_rays_meet_their_triangles_as_two_times_eight_do() {
    let mut random = Random::new(44);
    for _ in 0..100 {
        let pairs = [(); 2].map(|()| {
            let mut pairs = Pairs::EMPTY;
            for lane in 0..LANES {
                let (ray, triangle) = hit(&mut random, KINDS[lane % KINDS.len()]);
                set(&mut pairs, lane, &ray, &triangle);
            }
            pairs
        });
        for level in Level::all() {
            let (numbers, sure) = level.run(MeetWide([&pairs[0], &pairs[1]]));
            let [low, high] = pairs.each_ref().map(|pairs| level.run(Meet(pairs)));
            assert_eq!(sure, low.sure | high.sure << LANES, "{}", level.name());
            for (lane, eight) in (0..WIDE).map(|lane| (lane, if lane < LANES { &low } else { &high })) {
                let numbers = numbers.map(|row| row[lane].to_bits());
                let expected = [eight.t, eight.weights[0], eight.weights[1]].map(|row| row[lane % LANES].to_bits());
                assert_eq!(numbers, expected, "lane {lane} on {}", level.name());
            }
        }
    }
}

#[test]
fn weights_are_seen_along_every_axis() {
    let (mut random, mut sure) = (Random::new(42), 0);
    for axis in 0..3 {
        let mut squash = Vec3::ONE;
        squash[axis] = 0.0;
        // Also with two equally large components of the normal.
        for slope in [0.0, 0.5, 1.0, -1.0] {
            let mut slanted = |scale: f32| {
                let mut p = random.cube() * squash * scale;
                p[axis] = p[(axis + 1) % 3] * slope;
                p
            };
            let triangle = [slanted(1.0), slanted(1.0), slanted(1.0)];
            let target = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
            let dir = random.cube() + (Vec3::ONE - squash) * 3.0;
            let Some(ray) = RaySpace::new(target - dir, dir).filter(|r| triangle::is_hit(r, &triangle)) else {
                continue;
            };
            let mut pairs = Pairs::EMPTY;
            set(&mut pairs, 5, &ray, &triangle);
            for level in Level::all() {
                let met = level.run(Meet(&pairs));
                if met.sure >> 5 & 1 == 1 {
                    assert_met_as_alone(&met, 5, &(ray, triangle), level.name());
                    sure += 1;
                }
            }
        }
    }
    assert!(sure > 6, "{sure}");
}

#[test]
fn lanes_without_a_triangle_are_not_sure() {
    let (ray, triangle) = hit(&mut Random::new(43), Kind::Ordinary);
    let mut pairs = Pairs::EMPTY;
    (0..LANES).for_each(|lane| set(&mut pairs, lane, &ray, &triangle));
    for lane in 0..LANES - 1 {
        let mut broken = triangle;
        broken[lane % 3][lane / 3] = f32::NAN;
        set_corners(&mut pairs.corners, lane, &broken);
    }
    for level in Level::all() {
        assert_eq!(level.run(Meet(&Pairs::EMPTY)).sure, 0, "{}", level.name());
        assert_eq!(level.run(Meet(&pairs)).sure, 1 << (LANES - 1), "{}", level.name());
    }
}
