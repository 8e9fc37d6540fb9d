//! Reference hits of a ray: exact for the `f32` ray and triangles, over all of them, with independent arithmetic.
//!
//! Every triangle is tested in `f64` with error bounds; where those are inconclusive, adaptive predicates and rational numbers
//! decide ([`rational`](crate::math::rational)). To be affordable on large meshes, runs of triangles are skipped when the ray
//! misses their bounding box by more than a millionth of its size: nothing else is shared with the structures under test.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use dashu::rational::RBig;

use crate::accel::{Ray, Shapes};
use crate::math::rational::{cross, exact, hit, minus, point};
use crate::math::triangle::Triangle;
use crate::math::{DVec3, Vec3};

/// Triangles per run.
const RUN: usize = 32;

/// Error bound of a sum of products of differences in `f64`, relative to the sum of its terms' sizes: fewer than 16 roundings.
const DOUBT: f64 = 16.0 * f64::EPSILON;

/// Margin around a run's bounding box, relative to the coordinates of box and ray.
const ROOM: f64 = 1e-6;

/// Nearest hit.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Triangle hit; the lowest index of those at the same distance.
    pub prim: u32,
    /// Distance, to a relative error of 2⁻⁴⁰.
    pub t: f64,
}

/// Finds reference hits over one set of triangles; other prims are ignored.
#[derive(Clone, Debug)]
pub struct Oracle<'a> {
    shapes: &'a Shapes,
    /// Triangles with an area, in runs of neighbours; no ray hits one without. Of identical triangles only the lowest index.
    prims: Vec<u32>,
    /// Second lowest index of identical triangles, by the lowest: rays that exclude the lowest hit it.
    second: HashMap<u32, u32>,
    boxes: Vec<(DVec3, DVec3)>,
}

/// Possible nearest hit.
struct Candidate {
    prim: u32,
    t: f64,
    /// Bound on |t − exact|.
    error: f64,
}

impl<'a> Oracle<'a> {
    /// Oracle over all triangles of `shapes`.
    pub fn new(shapes: &'a Shapes) -> Self {
        let all = 0..u32::try_from(shapes.triangles.len()).unwrap_or(u32::MAX);
        let mut prims: Vec<u32> = all.filter(|&prim| has_area(&shapes.triangle(prim))).collect();
        let (mut lowest, mut second) = (HashMap::new(), HashMap::new());
        prims.retain(|&prim| match lowest.entry(corners(&shapes.triangle(prim))) {
            Entry::Vacant(place) => {
                place.insert(prim);
                true
            }
            Entry::Occupied(first) => {
                second.entry(*first.get()).or_insert(prim);
                false
            }
        });
        sort_by_place(&mut prims, shapes);
        let grow = |(lo, hi): (DVec3, DVec3), p: DVec3| (lo.min(p), hi.max(p));
        let of_run = |run: &[u32]| {
            let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            run.iter().flat_map(|&prim| shapes.triangle(prim)).map(|p| p.as_dvec3()).fold(none, grow)
        };
        let boxes = prims.chunks(RUN).map(of_run).collect();
        Self { shapes, prims, second, boxes }
    }

    /// Nearest hit in the ray's range.
    pub fn nearest(&self, ray: &Ray) -> Option<Truth> {
        let mut best: Option<Candidate> = None;
        for (run, (lo, hi)) in self.prims.chunks(RUN).zip(&self.boxes) {
            let limit = best.as_ref().map_or(f64::INFINITY, |b| b.t + b.error);
            if !may_meet(*lo, *hi, ray, limit) {
                continue;
            }
            for &prim in run.iter().filter(|&&prim| prim != ray.exclude) {
                if let Some(found) = self.candidate(ray, prim)
                    && best.as_ref().is_none_or(|b| self.before(ray, &found, b))
                {
                    best = Some(found);
                }
            }
        }
        if let Some(found) = self.second.get(&ray.exclude).and_then(|&prim| self.candidate(ray, prim))
            && best.as_ref().is_none_or(|b| self.before(ray, &found, b))
        {
            best = Some(found);
        }
        best.map(|b| Truth { prim: b.prim, t: b.t })
    }

    /// Distance at which the ray, within its range, hits one triangle.
    pub fn meets(&self, ray: &Ray, prim: u32) -> Option<f64> {
        self.candidate(ray, prim).map(|c| c.t)
    }

    /// Triangles within `radius` of a point, in the maximum norm, and possibly more.
    pub fn near(&self, point: Vec3, radius: f32) -> impl Iterator<Item = u32> {
        let (p, radius) = (point.as_dvec3(), f64::from(radius));
        let touches = move |lo: DVec3, hi: DVec3| (lo - radius).cmple(p).all() && (hi + radius).cmpge(p).all();
        let runs = self.prims.chunks(RUN).zip(&self.boxes).filter(move |(_, (lo, hi))| touches(*lo, *hi));
        runs.flat_map(|(run, _)| run).copied().filter(move |&prim| {
            let corners = self.shapes.triangle(prim).map(Vec3::as_dvec3);
            let (lo, hi) = corners.iter().fold((corners[0], corners[0]), |(lo, hi), &c| (lo.min(c), hi.max(c)));
            touches(lo, hi)
        })
    }

    fn before(&self, ray: &Ray, a: &Candidate, b: &Candidate) -> bool {
        let gap = a.t - b.t;
        if gap.abs() > a.error + b.error {
            return gap < 0.0;
        }
        (self.exactly(ray, a.prim), a.prim) < (self.exactly(ray, b.prim), b.prim)
    }

    fn exactly(&self, ray: &Ray, prim: u32) -> Option<RBig> {
        hit(&point(ray.origin), &point(ray.dir), &self.shapes.triangle(prim))
    }

    fn candidate(&self, ray: &Ray, prim: u32) -> Option<Candidate> {
        let triangle = self.shapes.triangle(prim);
        let verdict = in_f64(ray, &triangle);
        match verdict {
            Verdict::Miss => None,
            Verdict::Hit { t, error } if certainly_within(ray, t, error) => Some(Candidate { prim, t, error }),
            _ => {
                let t = self.exactly(ray, prim)?;
                let within = t >= exact(ray.t_min) && (ray.t_max.is_infinite() || t <= exact(ray.t_max));
                let t = t.to_f64().value();
                within.then_some(Candidate { prim, t, error: t.abs() * f64::EPSILON })
            }
        }
    }
}

/// Key of a triangle by its corners, in any order.
fn corners(triangle: &Triangle) -> [[u32; 3]; 3] {
    // Adding 0 turns −0 into +0.
    let mut corners = triangle.map(|p| (p + 0.0).to_array().map(f32::to_bits));
    corners.sort_unstable();
    corners
}

/// Sorts triangles so that neighbours are adjacent: by grid cells along G. Morton's curve (1966).
fn sort_by_place(prims: &mut [u32], shapes: &Shapes) {
    let middle = |prim: u32| shapes.triangle(prim).into_iter().map(|p| p.as_dvec3()).sum::<DVec3>() / 3.0;
    let (lo, hi) = prims
        .iter()
        .map(|&prim| middle(prim))
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let cell = |prim: u32| {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates, NaN is 0")]
        let place = ((middle(prim) - lo) / (hi - lo) * 1023.0).to_array().map(|x| x as u32);
        (0..10).fold(0u32, |code, bit| code | (0..3).fold(0, |c, k| c | (place[k] >> bit & 1) << (3 * bit + k)))
    };
    prims.sort_by_cached_key(|&prim| cell(prim));
}

/// Whether the corners are not collinear, exactly.
fn has_area(triangle: &Triangle) -> bool {
    let [a, b, c] = triangle.map(|p| p.as_dvec3());
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let certain = axes.into_iter().map(|v| bounded_dot(b - a, c - a, v)).any(|(value, error)| value.abs() > error);
    certain || {
        let [a, b, c] = triangle.map(point);
        cross(&minus(&b, &a), &minus(&c, &a)).iter().any(|x| !x.is_zero())
    }
}

/// Whether t is certainly within the ray's range, given its error.
fn certainly_within(ray: &Ray, t: f64, error: f64) -> bool {
    t - error > f64::from(ray.t_min) && t + error < f64::from(ray.t_max)
}

enum Verdict {
    Hit { t: f64, error: f64 },
    Miss,
    Unknown,
}

fn in_f64(ray: &Ray, triangle: &Triangle) -> Verdict {
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let [a, b, c] = triangle.map(|p| p.as_dvec3() - o);
    // Triple products (6 times the signed volumes) of the line and each edge: their signs say on which side the line passes.
    let sides = [(b, c), (c, a), (a, b)].map(|(p, q)| bounded_dot(p, q, d));
    let certain = |s: &(f64, f64), sign: f64| s.0 * sign > s.1;
    if sides.iter().any(|s| certain(s, 1.0)) && sides.iter().any(|s| certain(s, -1.0)) {
        return Verdict::Miss;
    }
    let mut inside = sides.iter().all(|s| certain(s, 1.0)) || sides.iter().all(|s| certain(s, -1.0));
    if !inside && let Some(signs) = exact_signs(o, d, triangle) {
        inside = signs.iter().all(|&s| s >= 0.0) || signs.iter().all(|&s| s <= 0.0);
        if !inside {
            return Verdict::Miss;
        }
    }
    let (top, bottom) = (bounded_dot(b - a, c - a, a), bounded_dot(b - a, c - a, d));
    let doubt = top.1 / top.0.abs() + bottom.1 / bottom.0.abs();
    // Also false for NaN.
    if inside && doubt < 1e-13 {
        let t = top.0 / bottom.0;
        return Verdict::Hit { t, error: t.abs() * (2.0 * doubt + f64::EPSILON) };
    }
    Verdict::Unknown
}

/// Sides of the ray on which the edges pass, by J. R. Shewchuk's adaptive predicate (1997); `None` where the ray's second point
/// is not exact in `f64`.
fn exact_signs(o: DVec3, d: DVec3, triangle: &Triangle) -> Option<[f64; 3]> {
    let end = o + d;
    if end - o != d || end - d != o {
        return None;
    }
    let coord = |p: DVec3| robust::Coord3D { x: p.x, y: p.y, z: p.z };
    let [a, b, c] = triangle.map(|p| coord(p.as_dvec3()));
    Some([(b, c), (c, a), (a, b)].map(|(p, q)| robust::orient3d(coord(o), coord(end), p, q)))
}

/// (p × q) · v and a bound on its error.
fn bounded_dot(p: DVec3, q: DVec3, v: DVec3) -> (f64, f64) {
    let sizes = DVec3::new(
        (p.y * q.z).abs() + (p.z * q.y).abs(),
        (p.z * q.x).abs() + (p.x * q.z).abs(),
        (p.x * q.y).abs() + (p.y * q.x).abs(),
    );
    (p.cross(q).dot(v), sizes.dot(v.abs()) * DOUBT)
}

/// Whether the ray may hit the box before `limit`.
fn may_meet(lo: DVec3, hi: DVec3, ray: &Ray, limit: f64) -> bool {
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let room = (o.abs().max(lo.abs()).max(hi.abs()).max_element()) * ROOM + f64::from(f32::MIN_POSITIVE);
    let (mut near, mut far) = (f64::from(ray.t_min), f64::from(ray.t_max));
    for k in 0..3 {
        let (a, b) = (lo[k] - room - o[k], hi[k] + room - o[k]);
        if d[k] == 0.0 {
            if a > 0.0 || b < 0.0 {
                return false;
            }
            continue;
        }
        let (a, b) = (a / d[k], b / d[k]);
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far && near <= limit
}

/// Distance of `t` from `truth`, in units in the last place of the nearest `f32`.
pub fn ulps(t: f32, truth: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, reason = "the float whose spacing is wanted")]
    let nearest = (truth as f32).abs();
    let spacing = f64::from(nearest.next_up()) - f64::from(nearest);
    (f64::from(t) - truth).abs() / spacing
}

/// Exact position of a hit.
pub fn place(ray: &Ray, triangle: &Triangle) -> Option<[RBig; 3]> {
    let (o, d) = (point(ray.origin), point(ray.dir));
    let t = hit(&o, &d, triangle)?;
    Some(crate::math::rational::along(&o, &d, &t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::accel::{Accel, Hit, NoProbe, Unculled};

    #[test]
    fn the_oracle_and_brute_force_find_the_same_first_hits() {
        for (name, shapes) in scenes::all() {
            let triangles =
                Shapes { polygons: Vec::new(), spheres: Vec::new(), cones: Vec::new(), planes: Vec::new(), ..shapes };
            let oracle = Oracle::new(&triangles);
            let brute = Unculled::new(&triangles);
            for ray in scenes::rays(&triangles, 12) {
                let mut hit = [Hit::MISS];
                brute.closest(&[ray], &mut hit, &mut (), &mut NoProbe);
                let truth = oracle.nearest(&ray);
                // Distances beyond the largest float are hits in rational arithmetic only.
                let far = truth.as_ref().is_some_and(|t| t.t > f64::from(f32::MAX));
                assert!(far || hit[0].is_some() == truth.is_some(), "{name} {ray:?} {truth:?} {hit:?}");
                if let Some(truth) = truth.filter(|_| !far) {
                    // By definition a negative distance never rounds to zero.
                    let tiny = truth.t < 0.0 && truth.t > -f64::from(f32::MIN_POSITIVE);
                    assert!(tiny || ulps(hit[0].t, truth.t) <= 0.501, "{name} {ray:?} {truth:?} {hit:?}");
                }
            }
        }
    }

    #[test]
    fn a_ray_that_excludes_a_triangle_hits_its_copy() {
        let shapes = scenes::copies(3);
        let oracle = Oracle::new(&shapes);
        let target = shapes.triangle(0).into_iter().sum::<Vec3>() / 3.0;
        let ray = scenes::ray(target + Vec3::new(0.1, 0.2, 3.0), Vec3::new(-0.1, -0.2, -3.0));
        let hit = |exclude| oracle.nearest(&Ray { exclude, ..ray }).map(|t| t.prim);
        assert_eq!([hit(crate::accel::NO_PRIM), hit(0), hit(1)], [Some(0), Some(1), Some(0)]);
    }

    #[test]
    fn an_ulp_is_the_spacing_of_floats() {
        assert_eq!(ulps(1.0, 1.0), 0.0);
        assert_eq!(ulps(1.0f32.next_up(), 1.0), 1.0);
        assert_eq!(ulps(4.0, 4.0 + f64::from(f32::EPSILON)), 0.25);
    }
}
