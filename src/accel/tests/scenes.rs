//! Generated shapes and rays, identical in every run.

use crate::accel::{BitSet, Cone, NO_PRIM, Ray, Shapes, SpherePrim};
use crate::math::Vec3;
use crate::math::aabb::Aabb;
use crate::math::random::Random;

pub(crate) fn mesh(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Shapes {
    seal(Shapes { vertices, triangles, ..Shapes::default() })
}

/// Makes every third prim non-opaque.
pub(crate) fn seal(mut shapes: Shapes) -> Shapes {
    shapes.opaque = BitSet::filled(shapes.len(), true);
    for i in (0..shapes.len() as u32).step_by(3) {
        shapes.opaque.set(i, false);
    }
    shapes
}

/// Random triangles of many sizes.
pub(crate) fn soup(n: u32, size: f32) -> Shapes {
    let mut r = Random::new(1);
    let mut vertices = Vec::new();
    for _ in 0..n {
        let center = r.cube();
        let scale = size * r.unit() * r.unit();
        for _ in 0..3 {
            vertices.push(center + r.cube() * scale);
        }
    }
    mesh(vertices, (0..n).map(|i| [i * 3, i * 3 + 1, i * 3 + 2]).collect())
}

/// [`bench::star`](crate::bench::star) with some prims that are not opaque.
pub(crate) fn star(columns: u32, rows: u32) -> Shapes {
    seal(crate::bench::star::star(columns, rows))
}

/// `n` triangles around one corner.
pub(crate) fn fan(n: u32) -> Shapes {
    let ring = (0..n).map(|i| {
        let turn = std::f32::consts::TAU * i as f32 / n as f32;
        Vec3::new(turn.cos(), turn.sin(), 0.25 * (i % 3) as f32)
    });
    let vertices = std::iter::once(Vec3::new(0.1, -0.05, 0.5)).chain(ring).collect();
    mesh(vertices, (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect())
}

/// Axis-parallel unit squares on an integer lattice: faces in cell planes, corners at lattice points.
pub(crate) fn lattice(n: u32) -> Shapes {
    let mut r = Random::new(3);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for _ in 0..n {
        let axis = r.below(3);
        let corner = (r.cube() * 4.0).round();
        let (mut a, mut b) = (Vec3::ZERO, Vec3::ZERO);
        a[(axis + 1) % 3] = 1.0;
        b[(axis + 2) % 3] = 1.0;
        let base = vertices.len() as u32;
        vertices.extend([corner, corner + a, corner + a + b, corner + b]);
        triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    }
    mesh(vertices, triangles)
}

/// Triangles, concave polygons, spheres, cones and planes together.
pub(crate) fn mix() -> Shapes {
    let mut r = Random::new(4);
    let mut shapes = soup(60, 0.5);
    for _ in 0..40 {
        let (center, u, v) = (r.cube(), r.cube() * 0.3, r.cube() * 0.3);
        let base = shapes.vertices.len() as u32;
        let outline = [(0.0, 0.0), (1.0, -1.0), (0.0, 1.0), (-1.0, -1.0), (-0.5, -0.2)];
        shapes.vertices.extend(outline.map(|(x, y)| center + u * x + v * y));
        shapes.polygons.push((shapes.polygon_corners.len() as u32, 5));
        shapes.polygon_corners.extend(base..base + 5);
    }
    for i in 0..40 {
        shapes.spheres.push(SpherePrim { center: r.cube(), radius: 0.02 + 0.01 * i as f32 });
    }
    for i in 0..40 {
        let apex_radius = [0.0, 0.02, 0.005 * i as f32][i % 3];
        let (base, apex) = (r.cube(), r.cube());
        shapes.cones.push(Cone { base, base_radius: 0.005 * i as f32 + 0.001, apex, apex_radius });
    }
    shapes.planes = vec![(Vec3::Y, -1.5), (Vec3::new(0.6, 0.0, -0.8), -2.0)];
    seal(shapes)
}

/// Cones and cylinders alone: parallel to the axes and oblique, from needles to discs, nested, and a huge one.
pub(crate) fn pipes() -> Shapes {
    let mut r = Random::new(6);
    let mut shapes = Shapes::default();
    let mut add = |base, base_radius, apex, apex_radius| {
        shapes.cones.push(Cone { base, base_radius, apex, apex_radius });
    };
    for i in 0..120 {
        let (base, size) = (r.cube(), 0.3 * r.unit() * r.unit());
        let mut axis = Vec3::ZERO;
        axis[i % 3] = 0.5;
        let apex = base + if i % 2 == 0 { axis } else { r.cube() * r.unit() };
        add(base, size, apex, [size, 0.0, size * r.unit()][i % 3]);
        add(base, size * 2.0, base.lerp(apex, 1e-3), size * r.unit());
    }
    add(Vec3::new(-9.0, 0.1, -8.0), 0.7, Vec3::new(9.0, -0.2, 8.0), 3.0);
    seal(shapes)
}

/// One huge triangle through many tiny ones.
pub(crate) fn huge_and_tiny() -> Shapes {
    let mut shapes = soup(300, 0.003);
    let base = shapes.vertices.len() as u32;
    shapes.vertices.extend([Vec3::new(-1e3, -0.1, -9e2), Vec3::new(1e3, 0.1, -8e2), Vec3::new(0.0, 0.0, 1.2e3)]);
    shapes.triangles.push([base, base + 1, base + 2]);
    seal(shapes)
}

/// `n` copies of the same triangle.
pub(crate) fn copies(n: usize) -> Shapes {
    mesh(vec![Vec3::ZERO, Vec3::X, Vec3::new(0.3, 0.9, 0.2)], vec![[0, 1, 2]; n])
}

/// Scales all vertices, then moves them.
pub(crate) fn moved(mut shapes: Shapes, scale: f32, offset: Vec3) -> Shapes {
    for v in &mut shapes.vertices {
        *v = *v * scale + offset;
    }
    for s in &mut shapes.spheres {
        (s.center, s.radius) = (s.center * scale + offset, s.radius * scale);
    }
    for c in &mut shapes.cones {
        (c.base, c.base_radius) = (c.base * scale + offset, c.base_radius * scale);
        (c.apex, c.apex_radius) = (c.apex * scale + offset, c.apex_radius * scale);
    }
    shapes
}

/// Every scene, with a name for messages.
pub(crate) fn all() -> Vec<(&'static str, Shapes)> {
    let far = Vec3::new(1.0, 0.7, 1.3);
    let point = mesh(vec![Vec3::splat(0.5); 3], vec![[0, 1, 2]; 4]);
    let flat = moved(soup(100, 0.3), 1.0, Vec3::ZERO);
    let squash = |mut s: Shapes, by: Vec3| {
        s.vertices.iter_mut().for_each(|v| *v *= by);
        s
    };
    vec![
        ("empty", Shapes::default()),
        ("one triangle", copies(1)),
        ("a thousand copies", copies(1000)),
        ("a point", point),
        ("flat", squash(flat.clone(), Vec3::new(1.0, 0.0, 1.0))),
        ("a line", squash(flat, Vec3::new(0.0, 1.0, 0.0))),
        ("soup", soup(700, 0.4)),
        ("dust", soup(2000, 0.02)),
        ("star", star(24, 16)),
        ("fan", fan(17)),
        ("lattice", lattice(250)),
        ("mix", mix()),
        ("pipes", pipes()),
        ("pipes far away", moved(pipes(), 1.0, far * 1e3)),
        ("tiny pipes", moved(pipes(), 1e-38, Vec3::ZERO)),
        ("huge and tiny", huge_and_tiny()),
        ("far away", moved(star(16, 12), 1.0, far * 1e3)),
        ("very far away", moved(soup(200, 0.6), 1.0, far * 1e5)),
        ("tiny numbers", moved(soup(200, 0.6), 1e-38, Vec3::ZERO)),
        ("denormal numbers", moved(star(12, 8), 1e-41, Vec3::ZERO)),
        ("huge numbers", moved(mix(), 1e37, Vec3::ZERO)),
    ]
}

/// `n` rays of each kind that is difficult for a scene.
pub(crate) fn rays(shapes: &Shapes, n: usize) -> Vec<Ray> {
    let mut r = Random::new(5);
    let fallback = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let ends = shapes.cones.iter().flat_map(|c| [c.base, c.apex]);
    let Aabb { lo, hi } = Aabb::around(shapes.vertices.iter().copied().chain(ends));
    let (lo, hi) = if lo.x <= hi.x { (lo, hi) } else { (Vec3::NEG_ONE, Vec3::ONE) };
    let (middle, half) = (lo * 0.5 + hi * 0.5, (hi * 0.5 - lo * 0.5).max(Vec3::splat(1e-44)));
    // Of a cone: a point of its rim, its apex, and one beside it.
    let of_cone = |c: &Cone| {
        let out = (c.apex - c.base).any_orthonormal_vector();
        [c.base + out * c.base_radius, c.apex, c.apex + out * c.apex_radius]
    };
    let corners = |r: &mut Random| match shapes.triangles.get(r.below(shapes.triangles.len())) {
        Some(t) => t.map(|i| shapes.vertices[i as usize]),
        None => shapes.cones.get(r.below(shapes.cones.len())).map_or(fallback, of_cone),
    };
    let signs = |r: &mut Random| [1.0f32, -1.0, 0.0, -0.0][r.below(4)];

    let mut rays = Vec::new();
    for i in 0..n {
        let inside = middle + r.cube() * half;
        let outside = middle + r.cube() * half * 3.0;
        let start = if i % 2 == 0 { inside } else { outside };
        let [a, b, c] = corners(&mut r);
        let s = r.unit();
        let on_edge = a + (b - a) * s;
        let axes = Vec3::new(signs(&mut r), signs(&mut r), signs(&mut r));
        let lattice = Vec3::from_array([a.x, b.y, c.z]);
        let tiny = Vec3::new(f32::from_bits(1), -1e-38, 1.0);
        rays.extend([
            ray(start, r.cube()),
            ray(start, a - start),
            ray(start, (a * 0.5 + b * 0.5) - start),
            ray(start, on_edge - start),
            ray(start, (a + b + c) / 3.0 - start),
            // From a corner, an edge, a lattice point; along an edge; in the plane of a face.
            ray(a, r.cube()),
            ray(on_edge, axes),
            ray(lattice - axes * half * 2.0, axes),
            ray(a - (b - a) * 2.0, b - a),
            ray(a + (c - b) * 1.5, (b - a) * s + (c - a)),
            ray(a - axes * half, axes),
            ray(start, r.cube() * tiny),
            ray(a - tiny * half * 2.0, tiny),
        ]);
    }
    // Some rays get ranges and exclusions.
    for (i, ray) in rays.iter_mut().enumerate() {
        match i % 7 {
            3 => ray.t_min = r.unit(),
            4 => ray.t_max = r.unit() * 2.0,
            5 => ray.exclude = r.below(shapes.len()) as u32,
            6 => ray.t_min = -r.unit(),
            _ => {}
        }
    }
    rays
}

pub(crate) fn ray(origin: Vec3, dir: Vec3) -> Ray {
    Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 }
}

/// Rays that cannot hit anything.
pub(crate) fn broken_rays() -> Vec<Ray> {
    let good = ray(Vec3::ZERO, Vec3::X);
    let mut rays = vec![
        Ray { dir: Vec3::ZERO, ..good },
        Ray { dir: Vec3::splat(-0.0), ..good },
        Ray { t_min: 1.0, t_max: 0.5, ..good },
        Ray { t_min: f32::NAN, ..good },
        Ray { t_max: f32::NAN, ..good },
    ];
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for k in 0..3 {
            let mut ray = good;
            ray.origin[k] = bad;
            rays.push(ray);
            let mut ray = good;
            ray.dir[k] = bad;
            rays.push(ray);
        }
    }
    rays
}
