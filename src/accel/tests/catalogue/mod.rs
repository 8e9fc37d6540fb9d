//! The test catalogue: what has gone wrong in ray tracers, each case against an oracle of its own and with every structure.
//!
//! Letters: C connectivity, D degenerate input, G grids, P precision; each test names its own. Counts are small so that
//! all of it takes seconds; with the environment variable `MESHRAY_LONG=1` they are those of the full catalogue, for a
//! release build: `MESHRAY_LONG=1 cargo test --release --lib catalogue`.

mod connectivity;
mod degenerate;
mod grid;
mod hostile;
mod precision;

use super::scenes::ray;
use super::{answers, assert_same};
use crate::accel::*;
use crate::bench::oracle::{Oracle, ulps};
use crate::math::Vec3;

/// `MESHRAY_LONG=1`: the full counts.
fn is_long() -> bool {
    std::env::var("MESHRAY_LONG").is_ok_and(|v| v == "1")
}

/// A count for every day, and the full one.
fn count(short: usize, long: usize) -> usize {
    if is_long() { long } else { short }
}

/// Calls `check` with every structure over the shapes.
fn with_every_kind(shapes: &Shapes, mut check: impl FnMut(AccelKind, &AnyAccel)) {
    for kind in AccelKind::ALL {
        check(kind, &AnyAccel::build(kind, shapes, &AccelParams::DEFAULT));
    }
}

fn closest<A: Accel>(accel: &A, rays: &[Ray]) -> Vec<Hit> {
    let mut hits = vec![Hit::MISS; rays.len()];
    accel.closest(rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
    hits
}

/// All hits of one ray in order.
fn every_hit<A: Accel>(accel: &A, ray: Ray) -> Vec<Hit> {
    let mut hits = closest(accel, &[ray]);
    while let Some(last) = hits.last().filter(|h| h.is_some()) {
        let mut next = [Hit::MISS];
        accel.next(&[ray], &[*last], &mut next, &mut accel.scratch(), &mut NoProbe);
        hits.extend(next);
    }
    hits.pop();
    hits
}

/// Every structure is sound and gives the answers of brute force, bit for bit, to all three queries.
fn assert_all_agree(what: &str, shapes: &Shapes, rays: &[Ray]) {
    let expected = answers(&Unculled::new(shapes), rays);
    let every = |n: usize| {
        let pairs = rays.iter().zip(&expected).step_by(n);
        pairs.map(|(ray, answer)| (*ray, *answer)).unzip::<_, _, Vec<Ray>, Vec<_>>()
    };
    // Slow ones get some of the rays.
    let (all, some) = (every(1), every(5));
    with_every_kind(shapes, |kind, accel| {
        assert!(accel.check().is_ok(), "{what}, {kind}: {:?}", accel.check());
        let (rays, expected) = if kind.is_slow() { &some } else { &all };
        assert_same(&format!("{what}, {kind}"), rays, &answers(accel, rays), expected);
    });
}

/// Every structure finds the first hit of exact arithmetic, its distance within `most` units in the last place; the number
/// of hits.
fn assert_exact(what: &str, shapes: &Shapes, rays: &[Ray], most: f64) -> usize {
    let oracle = Oracle::new(shapes);
    let truths: Vec<_> = rays.iter().map(|ray| oracle.nearest(ray)).collect();
    with_every_kind(shapes, |kind, accel| {
        for ((ray, hit), truth) in rays.iter().zip(closest(accel, rays)).zip(&truths) {
            let Some(truth) = truth.as_ref().filter(|t| t.t <= f64::from(f32::MAX)) else {
                assert!(!hit.is_some(), "{what}, {kind}: {hit:?} where nothing is, {ray:?}");
                continue;
            };
            assert!(hit.is_some(), "{what}, {kind}: nothing where {truth:?} is, {ray:?}");
            assert!(ulps(hit.t, truth.t) <= most, "{what}, {kind}: {hit:?} for {truth:?}, {ray:?}");
            // Rounded, distances can be equal that are not; then the lowest prim is hit.
            let as_near = || oracle.meets(ray, hit.prim).is_some_and(|t| ulps(hit.t, t) <= most);
            assert!(
                hit.prim == truth.prim || as_near(),
                "{what}, {kind}: {hit:?} for {truth:?} {:?}, {ray:?} {:?}",
                oracle.meets(ray, hit.prim),
                shapes.triangle(hit.prim)
            );
        }
    });
    truths.iter().flatten().count()
}

/// A ray from one point towards another.
fn towards(origin: Vec3, target: Vec3) -> Ray {
    ray(origin, target - origin)
}
