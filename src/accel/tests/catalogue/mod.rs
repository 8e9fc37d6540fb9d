//! Test catalogue: known failures of ray tracers, each checked against its own oracle and with every structure.
//!
//! Letters: C connectivity, D degenerate input, G grids, P precision; each test names its case. Counts are small, so that all
//! tests take seconds; the environment variable `MESHRAY_LONG=1` raises them to the full catalogue, for a release build:
//! `MESHRAY_LONG=1 cargo test --release --lib catalogue`.

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

/// Whether `MESHRAY_LONG=1` asks for the full counts.
fn is_long() -> bool {
    std::env::var("MESHRAY_LONG").is_ok_and(|v| v == "1")
}

/// Everyday count, or the full one.
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

/// All hits of one ray in order, up to the final miss.
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

/// Asserts that every structure is sound and answers all three queries like brute force, bit for bit.
fn assert_all_agree(what: &str, shapes: &Shapes, rays: &[Ray]) {
    let expected = answers(&Unculled::new(shapes), rays);
    let every = |n: usize| {
        let pairs = rays.iter().zip(&expected).step_by(n);
        pairs.map(|(ray, answer)| (*ray, *answer)).unzip::<_, _, Vec<Ray>, Vec<_>>()
    };
    // Slow structures get only some of the rays.
    let (all, some) = (every(1), every(5));
    with_every_kind(shapes, |kind, accel| {
        assert!(accel.check().is_ok(), "{what}, {kind}: {:?}", accel.check());
        let (rays, expected) = if kind.is_slow() { &some } else { &all };
        assert_same(&format!("{what}, {kind}"), rays, &answers(accel, rays), expected);
    });
}

/// Asserts that every structure finds the first hit of exact arithmetic, its distance within `most` ulp; returns the number
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
            // Different distances can be equal when rounded; then the lowest prim is hit.
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

/// Ray from one point towards another.
fn towards(origin: Vec3, target: Vec3) -> Ray {
    ray(origin, target - origin)
}
