//! Tests that each margin of the walk is needed: with the derived margins every answer equals brute force, and without any
//! one of them some answers do not.

use std::marker::PhantomData;

use super::slabs::{BoxMargins, Derived};
use super::walk::Stack;
use super::{Splitting, TraceMode, Wide};
use crate::accel::query::{Culling, Goal, Query};
use crate::accel::query_batch::QueryBatch;
use crate::accel::tests::scenes::{lattice, mesh, moved, ray, rays, soup};
use crate::accel::tests::{far_rays, wrong};
use crate::accel::{Probe, Ray, RayCounts, Shapes};
use crate::math::Vec3;
use crate::math::random::Random;

/// A tree walked with other margins.
struct Walked<'a, B> {
    wide: Wide<'a>,
    /// Whether each ray takes the counting walk.
    counted: bool,
    margins: PhantomData<fn() -> B>,
}

impl<B: BoxMargins> Culling for Walked<'_, B> {
    type Scratch = Stack;

    fn shapes(&self) -> &Shapes {
        self.wide.shapes()
    }

    fn new_scratch(&self) -> Stack {
        self.wide.new_scratch()
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        self.wide.walk_within::<B, _, _>(query, stack, probe);
    }

    fn trace<W: QueryBatch, P: Probe>(&self, batch: &mut W, stack: &mut Stack, probe: &mut P) {
        if self.counted {
            return self.wide.trace_within::<B, _, _>(batch, stack, &mut RayCounts::default());
        }
        self.wide.trace_within::<B, _, _>(batch, stack, probe);
    }
}

struct NoSlab;
impl BoxMargins for NoSlab {
    const SLAB: f32 = 0.0;
}

struct NoPad;
impl BoxMargins for NoPad {
    const PAD: f32 = 0.0;
}

struct NoRange;
impl BoxMargins for NoRange {
    const RANGE: f32 = 0.0;
}

struct NoUnderflow;
impl BoxMargins for NoUnderflow {
    const UNDERFLOW: f32 = 0.0;
}

struct AnyCoordinates;
impl BoxMargins for AnyCoordinates {
    const COORDINATES: f32 = f32::INFINITY;
}

/// Number of wrong answers of both trees, in every trace mode, and by the counting walk.
fn wrong_with<B: BoxMargins>(shapes: &Shapes, rays: &[Ray]) -> usize {
    let ways = [TraceMode::OneByOne, TraceMode::InFlight, TraceMode::Packets];
    let of = |splitting| {
        let of = |way, counted| {
            let wide = Wide::build(shapes, splitting).with_rays(way);
            wrong(&Walked::<B> { wide, counted, margins: PhantomData }, shapes, rays)
        };
        of(TraceMode::OneByOne, true) + ways.map(|way| of(way, false)).iter().sum::<usize>()
    };
    of(Splitting::Octree) + of(Splitting::SurfaceArea)
}

/// Asserts that nothing is wrong with the derived margins and something is with the others.
fn assert_needed<B: BoxMargins>(shapes: &Shapes, rays: &[Ray]) {
    assert_eq!(wrong_with::<Derived>(shapes, rays), 0, "as derived");
    assert!(wrong_with::<B>(shapes, rays) > 0, "nothing goes wrong without it");
}

#[test]
fn without_the_error_of_distances_rays_through_edges_of_boxes_miss_what_is_inside() {
    let shapes = lattice(250);
    let rays = rays(&shapes, 40);
    assert_needed::<NoSlab>(&shapes, &rays);
    assert_needed::<NoPad>(&shapes, &rays);
}

#[test]
fn boxes_behind_the_best_hit_may_hold_another_as_near() {
    let shapes = soup(1500, 1.0);
    let rays = far_rays(&shapes, 300, 1e4..1e7);
    assert_needed::<NoRange>(&shapes, &rays);
}

/// Rays through corners of boxes, so fast that their distances have few bits left.
#[test]
fn among_the_smallest_numbers_distances_to_boxes_underflow() {
    let mut r = Random::new(15);
    let scale = 1.0 / 1024.0;
    let shapes = moved(lattice(250), scale, Vec3::ZERO);
    let aim = |_| {
        let origin = (r.cube() * 8.0).round() * scale;
        let target = shapes.vertices[r.below(shapes.vertices.len())];
        // Exactly towards the corner: its distance is 1 / (m 2¹²⁰).
        let m = 2.0 * (r.unit() * 2048.0).floor() + 1.0;
        ray(origin, (target - origin) * m * 2.0f32.powi(120))
    };
    let rays: Vec<Ray> = (0..3000).map(aim).filter(|r| r.dir != Vec3::ZERO).collect();
    assert_needed::<NoUnderflow>(&shapes, &rays);
}

/// Differences of coordinates near the largest float are infinite, and so are distances computed from them.
#[test]
fn boxes_near_the_largest_float_are_not_asked() {
    let at = |x: f32, y: f32| [Vec3::new(x, y - 1e37, -1e37), Vec3::new(x, y + 1e37, -1e37), Vec3::new(x, y, 1e37)];
    let faces: Vec<[Vec3; 3]> = (0..40).map(|i| at(3e38 - 1e37 * (i % 16) as f32, 3e37 * (i % 5) as f32)).collect();
    let shapes = mesh(faces.concat(), (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let start = Vec3::new(-3e38, 0.0, 0.0);
    let rays: Vec<Ray> =
        (0..5).map(|i| Ray { t_max: 20.0, ..ray(start + Vec3::Y * (3e37 * i as f32), Vec3::X * 5e37) }).collect();
    assert_needed::<AnyCoordinates>(&shapes, &rays);
}
