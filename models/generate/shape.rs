//! Surfaces as formulas: lathes, tubes, balls and blocks, cut into triangles.

use libm::{cos, sin};
use meshray::math::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Triangles with normals and texture coordinates (or none).
#[derive(Clone, Default)]
pub(crate) struct Shape {
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) normals: Vec<[f32; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) indices: Vec<u32>,
}

impl Shape {
    fn vertex(&mut self, position: DVec3, normal: DVec3, uv: DVec2) {
        self.positions.push(position.as_vec3().to_array());
        self.normals.push(normal.normalize_or(DVec3::Y).as_vec3().to_array());
        self.uvs.push(uv.as_vec2().to_array());
    }

    /// Joins the last `(columns + 1) × (rows + 1)` vertices to a sheet, leaving out triangles without area.
    fn sheet(&mut self, columns: u32, rows: u32) {
        let first = self.positions.len() as u32 - (columns + 1) * (rows + 1);
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let a = first + j * (columns + 1) + i;
            let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
            for triangle in [[a, b, c], [a, c, d]] {
                let [p, q, r] = triangle.map(|i| self.positions[i as usize]);
                if p != q && q != r && r != p {
                    self.indices.extend(triangle);
                }
            }
        }
    }

    /// Drops the texture coordinates, which only textured materials need.
    pub(crate) fn plain(mut self) -> Self {
        self.uvs.clear();
        self
    }

    /// Texture coordinates from above, one repeat in `size`, going on down the sides as if they were folded out.
    pub(crate) fn mapped_from_above(mut self, size: f32) -> Self {
        let top = self.positions.iter().map(|p| p[1]).fold(f32::NEG_INFINITY, f32::max);
        let folded_out = |&[x, y, z]: &[f32; 3]| {
            let reach = (x * x + z * z).sqrt();
            let scale = if reach > 0.0 { (1.0 + (top - y) / reach) / size } else { 0.0 };
            [x * scale + 0.5, z * scale + 0.5]
        };
        self.uvs = self.positions.iter().map(folded_out).collect();
        self
    }

    /// Adds the triangles of another shape.
    pub(crate) fn with(mut self, other: Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.uvs.extend(other.uvs);
        self.indices.extend(other.indices.iter().map(|i| i + first));
        self
    }
}

/// The outline of a lathe: points (radius, height) with the direction of travel there; outsides lie to the right.
#[derive(Default)]
pub(crate) struct Outline {
    points: Vec<(DVec2, DVec2)>,
}

impl Outline {
    /// A straight piece; corners between pieces stay sharp.
    pub(crate) fn line(mut self, from: (f64, f64), to: (f64, f64)) -> Self {
        let (from, to) = (DVec2::from(from), DVec2::from(to));
        self.points.extend([(from, to - from), (to, to - from)]);
        self
    }

    /// A piece of a circle around `center`, from angle `start` to `end` (radians from +radius towards +height).
    pub(crate) fn arc(mut self, center: (f64, f64), radius: f64, start: f64, end: f64, pieces: u32) -> Self {
        for i in 0..=pieces {
            let angle = start + (end - start) * f64::from(i) / f64::from(pieces);
            let out = DVec2::new(cos(angle), sin(angle));
            let travel = DVec2::new(-out.y, out.x) * (end - start).signum();
            self.points.push((DVec2::from(center) + out * radius, travel));
        }
        self
    }

    /// A smooth curve through points (a Catmull-Rom spline), `pieces` between each two.
    pub(crate) fn curve(mut self, through: &[(f64, f64)], pieces: u32) -> Self {
        let point = |i: isize| {
            let last = through.len() as isize - 1;
            let at = |i: isize| DVec2::from(through[i.clamp(0, last) as usize]);
            // Beyond an end the curve goes on straight.
            if i < 0 {
                at(0) * 2.0 - at(1)
            } else if i > last {
                at(last) * 2.0 - at(last - 1)
            } else {
                at(i)
            }
        };
        for i in 0..through.len() as isize - 1 {
            let [a, b, c, d] = [point(i - 1), point(i), point(i + 1), point(i + 2)];
            let first = if i == 0 { 0 } else { 1 };
            for k in first..=pieces {
                let t = f64::from(k) / f64::from(pieces);
                let (p, q, r) = ((c - a) * 0.5, a - b * 2.5 + c * 2.0 - d * 0.5, (d - a) * 0.5 + (b - c) * 1.5);
                let travel = p + q * (2.0 * t) + r * (3.0 * t * t);
                self.points.push((b + p * t + q * (t * t) + r * (t * t * t), travel));
            }
        }
        self
    }

    /// The outline turned once around the y axis; u runs around, v down from the end to the start.
    pub(crate) fn lathe(&self, columns: u32) -> Shape {
        let length: f64 = self.points.windows(2).map(|pair| (pair[1].0 - pair[0].0).length()).sum();
        let mut shape = Shape::default();
        let (mut v, mut before) = (1.0, self.points[0].0);
        for &(point, travel) in &self.points {
            v -= (point - before).length() / length;
            before = point;
            for i in 0..=columns {
                let u = f64::from(i) / f64::from(columns);
                let (sin, cos) = (sin(TAU * u), cos(TAU * u));
                let place = DVec3::new(point.x.max(0.0) * sin, point.y, point.x.max(0.0) * cos);
                let normal = DVec3::new(travel.y * sin, -travel.x, travel.y * cos);
                shape.vertex(place, normal, DVec2::new(u, v));
            }
        }
        shape.sheet(columns, self.points.len() as u32 - 1);
        shape
    }
}

/// A round disc with softened edges, standing on y = 0.
pub(crate) fn disc(radius: f64, height: f64, edge: f64, columns: u32) -> Shape {
    Outline::default()
        .line((0.0, 0.0), (radius - edge, 0.0))
        .arc((radius - edge, edge), edge, -FRAC_PI_2, 0.0, 5)
        .arc((radius - edge, height - edge), edge, 0.0, FRAC_PI_2, 5)
        .line((radius - edge, height), (0.0, height))
        .lathe(columns)
}

/// A ball around the origin.
pub(crate) fn ball(radius: f64, columns: u32) -> Shape {
    Outline::default().arc((0.0, 0.0), radius, -FRAC_PI_2, FRAC_PI_2, columns / 2).lathe(columns)
}

/// A tube of radius `thickness` along a closed curve.
pub(crate) fn tube(curve: impl Fn(f64) -> DVec3, thickness: f64, columns: u32, rows: u32) -> Shape {
    let mut shape = Shape::default();
    let step = 1e-4;
    for j in 0..=rows {
        let t = f64::from(j % rows) / f64::from(rows);
        let center = curve(t);
        // The curve's own frame: it closes where the curve does.
        let forward = (curve(t + step) - curve(t - step)).normalize();
        let bend = curve(t + step) + curve(t - step) - center * 2.0;
        let side = (bend - forward * bend.dot(forward)).normalize_or(forward.any_orthonormal_vector());
        let other = forward.cross(side);
        for i in 0..=columns {
            let angle = TAU * f64::from(i % columns) / f64::from(columns);
            let normal = side * cos(angle) + other * sin(angle);
            let uv = DVec2::new(f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            shape.vertex(center + normal * thickness, normal, uv);
        }
    }
    shape.sheet(columns, rows);
    shape
}

/// The torus knot that winds `p` times around the axis and `q` times through the hole, standing upright on y = 0.
pub(crate) fn knot(p: f64, q: f64, size: f64, thickness: f64, columns: u32, rows: u32) -> Shape {
    let curve = |t: f64| {
        let (around, through) = (TAU * p * t, TAU * q * t);
        let radius = size * (0.68 + 0.32 * cos(through));
        DVec3::new(radius * cos(around), radius * sin(around) + size + thickness, size * 0.36 * sin(through))
    };
    tube(curve, thickness, columns, rows)
}

/// A block with sharp edges around the origin; every side has the whole texture.
pub(crate) fn block(half: DVec3) -> Shape {
    let mut shape = Shape::default();
    let sides = [
        (DVec3::X, DVec3::NEG_Z, DVec3::Y),
        (DVec3::NEG_X, DVec3::Z, DVec3::Y),
        (DVec3::Y, DVec3::X, DVec3::NEG_Z),
        (DVec3::NEG_Y, DVec3::X, DVec3::Z),
        (DVec3::Z, DVec3::X, DVec3::Y),
        (DVec3::NEG_Z, DVec3::NEG_X, DVec3::Y),
    ];
    for (normal, right, up) in sides {
        card(&mut shape, (normal * half, normal), right * half, up * half);
    }
    shape
}

/// An upright rectangle facing +z around the origin.
pub(crate) fn panel(half_width: f64, half_height: f64) -> Shape {
    let mut shape = Shape::default();
    card(&mut shape, (DVec3::ZERO, DVec3::Z), DVec3::X * half_width, DVec3::Y * half_height);
    shape
}

fn card(shape: &mut Shape, (center, normal): (DVec3, DVec3), right: DVec3, up: DVec3) {
    for v in [0.0, 1.0] {
        for u in [0.0, 1.0] {
            let place = center + right * (2.0 * u - 1.0) + up * (2.0 * v - 1.0);
            shape.vertex(place, normal, DVec2::new(u, 1.0 - v));
        }
    }
    shape.sheet(1, 1);
}

/// Half a turn, for outlines.
pub(crate) const HALF_TURN: f64 = PI;
