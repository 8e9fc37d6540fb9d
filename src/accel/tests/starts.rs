//! Rays that start on a surface: they neither hit the face they start on nor slip through neighbouring faces.

use super::scenes::{mesh, ray};
use crate::accel::{Accel, AccelKind, AccelParams, AnyAccel, BitSet, Hit, NoProbe, Ray, Shapes};
use crate::math::Vec3;
use crate::math::random::Random;
use crate::math::triangle;

/// A mesh with a structure over it.
struct Surface<'a> {
    shapes: &'a Shapes,
    accel: AnyAccel<'a>,
}

impl<'a> Surface<'a> {
    fn new(shapes: &'a Shapes) -> Self {
        Self { shapes, accel: AnyAccel::build(AccelKind::DEFAULT, shapes, &AccelParams::DEFAULT) }
    }

    fn closest(&self, ray: &Ray) -> Hit {
        let mut hit = [Hit::MISS];
        self.accel.closest(&[*ray], &mut hit, &mut self.accel.scratch(), &mut NoProbe);
        hit[0]
    }

    /// Ray towards `dir` from the hit of another ray.
    fn leave(&self, from: &Ray, hit: &Hit, dir: Vec3) -> Ray {
        Ray { exclude: hit.prim, ..ray(self.shapes.refine(from, hit).origin(dir), dir) }
    }

    fn is_occluded(&self, ray: &Ray) -> bool {
        let mut occluded = [false];
        self.accel.occluded(&[*ray], &mut occluded, &mut self.accel.scratch(), &mut NoProbe);
        occluded[0]
    }

    /// Number of points at which a ray crosses the surface.
    fn crossings(&self, ray: &Ray) -> usize {
        let (mut hit, mut count) = (self.closest(ray), 0);
        while hit.is_some() {
            count += 1;
            let before = [hit];
            let mut next = [hit];
            self.accel.next(&[*ray], &before, &mut next, &mut self.accel.scratch(), &mut NoProbe);
            // At an edge two faces are hit at the same distance.
            while next[0].is_some() && next[0].t == hit.t {
                let before = next;
                self.accel.next(&[*ray], &before, &mut next, &mut self.accel.scratch(), &mut NoProbe);
            }
            hit = next[0];
        }
        count
    }
}

fn opaque(mut shapes: Shapes) -> Shapes {
    shapes.opaque = BitSet::filled(shapes.len(), true);
    shapes
}

/// `n` × `n` squares of side `cell` with corner (i, j) at height `z(i, j)`, moved by `offset`.
fn grid(n: u32, cell: f32, offset: Vec3, z: impl Fn(u32, u32) -> f32) -> Shapes {
    let corners = (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let vertices = corners.map(|(i, j)| Vec3::new(i as f32 * cell, j as f32 * cell, z(i, j)) + offset).collect();
    let at = |i: u32, j: u32| j * (n + 1) + i;
    let square =
        |i: u32, j: u32| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let triangles = (0..n).flat_map(|j| (0..n).flat_map(move |i| square(i, j))).collect();
    opaque(mesh(vertices, triangles))
}

/// Counts the pixels of a grid seen from above, and those that a light just above its horizon does not reach, at corners,
/// edges and faces.
fn shadowed(shapes: &Shapes, cell: f32, up: Vec3) -> (usize, usize) {
    let surface = Surface::new(shapes);
    let (lo, hi) =
        shapes.vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let size = (hi - lo).max_element();
    let (mut seen, mut dark) = (0, 0);
    let mut random = Random::new(4);
    for pixel in 0..3000 {
        let steps = ((hi - lo) / cell).map(f32::floor);
        let lattice = Vec3::new(random.unit() * steps.x, random.unit() * steps.y, 0.0);
        // On corners of the squares, on their edges, and at random.
        let place = match pixel % 3 {
            0 => lattice.map(f32::round),
            1 => Vec3::new(lattice.x.round(), lattice.y, 0.0),
            _ => lattice,
        };
        let target = lo + place * cell;
        let eye = ray(Vec3::new(target.x, target.y, hi.z + size), Vec3::NEG_Z);
        let hit = surface.closest(&eye);
        if !hit.is_some() {
            continue;
        }
        seen += 1;
        // 89.9° from the vertical.
        let turn = random.unit() * std::f32::consts::TAU;
        let along = up.any_orthonormal_vector() * turn.cos() + up.cross(up.any_orthonormal_vector()) * turn.sin();
        let to_light = (along + up * 0.001_745_3).normalize();
        dark += usize::from(surface.is_occluded(&surface.leave(&eye, &hit, to_light)));
    }
    (seen, dark)
}

/// S1 (acne).
#[test]
fn no_part_of_a_surface_in_grazing_light_shadows_itself() {
    let ripples = |i: u32, j: u32| ((i * 7 + j * 13) % 11) as f32 * 5e-5;
    for (name, offset) in [("as it is", 0.0), ("1e3 away", 1e3), ("1e5 away", 1e5), ("1e7 away", 1e7)] {
        let offset = Vec3::new(offset, offset * 0.5, -offset);
        // Large enough that its corners are accurate even at that offset.
        let flat = grid(16, 64.0, offset, |_, _| 0.0);
        assert_eq!(shadowed(&flat, 64.0, Vec3::Z).1, 0, "flat, {name}");
        let tilted = grid(16, 64.0, offset, |i, j| 16.0 * i as f32 + 32.0 * j as f32);
        let up = triangle::normal(&tilted.triangle(0));
        let (seen, dark) = shadowed(&tilted, 64.0, up);
        assert!(seen > 2500 && dark == 0, "tilted, {name}: {dark} of {seen}");
        // Slopes below the light's height: every point sees it. When a transform moves the mesh, its frame is centred again.
        if offset == Vec3::ZERO {
            let rippled = grid(16, 1.0, offset, ripples);
            let (seen, dark) = shadowed(&rippled, 1.0, Vec3::Z);
            assert!(seen > 2500 && dark == 0, "displaced: {dark} of {seen}");
        }
    }
}

/// A closed box, corners at ±`half` around `center`.
fn room(center: Vec3, half: Vec3) -> Shapes {
    let corner = |i: u32| center + half * Vec3::from([0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 }));
    let side = |a: u32, b: u32, c: u32, d: u32| [[a, b, c], [a, c, d]];
    let sides =
        [side(0, 2, 3, 1), side(4, 5, 7, 6), side(0, 1, 5, 4), side(2, 6, 7, 3), side(0, 4, 6, 2), side(1, 3, 7, 5)];
    opaque(mesh((0..8).map(corner).collect(), sides.concat()))
}

/// S2 (leaks). Run with `MESHRAY_LONG=1` for ten million rays.
#[test]
fn no_light_from_outside_gets_into_a_closed_room() {
    let count = if std::env::var_os("MESHRAY_LONG").is_some() { 1_250_000 } else { 4000 };
    for (center, half) in [
        (Vec3::ZERO, Vec3::ONE),
        (Vec3::ZERO, Vec3::new(3.7, 0.013, 1.9)),
        (Vec3::new(1e3, -7e2, 1.3e3), Vec3::new(1.0, 2.0, 1.0)),
        (Vec3::ZERO, Vec3::splat(1e-20)),
    ] {
        for closed in [room(center, half), star_at(center, half)] {
            let surface = Surface::new(&closed);
            let mut random = Random::new(8);
            let leaks = (0..count).filter(|&i| leaks(&surface, center, half, i, &mut random)).count();
            assert_eq!(leaks, 0, "{center} {half}");
        }
    }
}

fn star_at(center: Vec3, half: Vec3) -> Shapes {
    let star = crate::bench::star::star(24, 12);
    Shapes { vertices: star.vertices.iter().map(|p| center + *p * half).collect(), ..star }
}

/// Whether light from outside reaches a point that is seen from inside.
fn leaks(surface: &Surface, center: Vec3, half: Vec3, i: usize, random: &mut Random) -> bool {
    let [a, b, c] = surface.shapes.triangle(random.below(surface.shapes.triangles.len()) as u32);
    let target = match i % 4 {
        0 => a,
        1 => a + (b - a) * random.unit(),
        2 => (b + c) * 0.5,
        _ => (a + b + c) / 3.0,
    };
    let eye = center + half * 0.5 * random.cube();
    let eye = ray(eye, target - eye);
    let hit = surface.closest(&eye);
    if !hit.is_some() {
        return true;
    }
    let position = surface.shapes.refine(&eye, &hit).position;
    let light = center + half * 9.0 * random.direction();
    let to_light = light - position;
    let normal = triangle::normal(&surface.shapes.triangle(hit.prim));
    let facing = normal.dot(to_light.normalize());
    // A surface gets no light from behind, and no shadow ray is traced there; nor along the surface, where the rounded normal
    // does not separate the sides: less than a millionth of the light.
    let same_side = facing * normal.dot(eye.dir) < 0.0;
    // Exactly at an edge behind which a face turns away, the eye sees the outside of that face.
    let from_inside = normal.dot(eye.dir) > 0.0;
    from_inside && same_side && facing.abs() > 1e-6 && !surface.is_occluded(&surface.leave(&eye, &hit, to_light))
}

/// S3 (starts on a convex mesh).
#[test]
fn a_ray_that_leaves_a_convex_mesh_is_free_and_one_that_enters_it_crosses_it_once() {
    let octahedron = {
        let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
        let faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        opaque(mesh(axes.to_vec(), faces.to_vec()))
    };
    let turned = Shapes {
        vertices: octahedron
            .vertices
            .iter()
            .map(|p| Vec3::new(p.x * 0.36 - p.y * 0.8, p.z, p.x * 0.8 + p.y * 0.36))
            .collect(),
        ..octahedron.clone()
    };
    for convex in [room(Vec3::ZERO, Vec3::ONE), room(Vec3::splat(100.0), Vec3::ONE), octahedron, turned] {
        let surface = Surface::new(&convex);
        let middle = convex.vertices.iter().sum::<Vec3>() / convex.vertices.len() as f32;
        let mut random = Random::new(6);
        for i in 0..6000 {
            let [a, b, c] = convex.triangle(random.below(convex.triangles.len()) as u32);
            let target = [a, (a + b) * 0.5, a + (b - a) * random.unit(), (a + b + c) / 3.0][i % 4];
            let outside = target + (target - middle) * 3.0 + random.cube();
            let eye = ray(outside, target - outside);
            let hit = surface.closest(&eye);
            if !hit.is_some() {
                continue;
            }
            let normal = triangle::normal(&convex.triangle(hit.prim));
            let dir = random.direction();
            let outwards = normal.dot(dir) * normal.dot(middle - a) < 0.0;
            let expected = usize::from(!outwards);
            let found = surface.crossings(&surface.leave(&eye, &hit, dir));
            assert_eq!(found, expected, "{eye:?} {hit:?} {dir}");
        }
    }
}

/// S4 (narrow gaps).
#[test]
fn a_gap_of_sixteen_units_in_the_last_place_is_resolved() {
    for tilt in [0.0, 0.25, 1.0] {
        for k in 0..6 {
            // Heights in 1..2, where an ulp is 2⁻²³.
            let gap = 16.0 * f32::EPSILON * (1 << k) as f32;
            let slope = |i: u32| 1.0 + tilt * i as f32 / 8.0;
            let lower = grid(4, 0.125, Vec3::ZERO, |i, _| slope(i));
            let upper = grid(4, 0.125, Vec3::ZERO, |i, _| slope(i) + gap);
            let below = lower.vertices.len() as u32;
            let vertices = [lower.vertices, upper.vertices].concat();
            let triangles = [lower.triangles, upper.triangles.iter().map(|t| t.map(|v| v + below)).collect()].concat();
            let shapes = opaque(mesh(vertices, triangles));
            let surface = Surface::new(&shapes);
            let mut random = Random::new(2);
            for _ in 0..500 {
                // From below, so that the lower grid is hit first.
                let at = Vec3::new(random.unit() * 0.5, random.unit() * 0.5, 0.0);
                let (under, above) = (ray(at, Vec3::Z), ray(at + Vec3::Z * 4.0, Vec3::NEG_Z));
                let (low, high) = (surface.closest(&under), surface.closest(&above));
                let sides = [low.prim < upper_first(&shapes), high.prim >= upper_first(&shapes)];
                assert_eq!(sides, [true; 2], "tilt {tilt}, gap {gap:e}");
                assert!(surface.is_occluded(&surface.leave(&under, &low, Vec3::Z)), "tilt {tilt}, gap {gap:e}");
                assert!(!surface.is_occluded(&surface.leave(&above, &high, Vec3::Z)), "tilt {tilt}, gap {gap:e}");
            }
        }
    }
}

fn upper_first(shapes: &Shapes) -> u32 {
    shapes.triangles.len() as u32 / 2
}
