//! A cut-out face, and lookups where rays hit it: in one cache line.

use crate::accel::Ray;
use crate::math::bounds::FACE_COORDINATE;
use crate::math::simd::{Kernel, LANES, Simd};
use crate::math::{DVec2, DVec3, Vec2, Vec3};
use crate::render::texture::Survey;
use bytemuck::{Pod, Zeroable};

/// Where a ray travels more than this many times as far along a face as across its cone, nothing is known: the width of its cone
/// there depends on rounding.
const GRAZING: f32 = 50.0;

/// A triangle is skipped if the product of two edge lengths is more than this many times twice its area: so normal and gradients,
/// computed in `f64`, are exact to far more than the digits that are stored.
const SLENDER: f64 = 500.0;

/// Error of coordinates, in texels, beside that of [`FACE_COORDINATE`]: rounding of positions between texels in a lookup.
const BLUR: f32 = 0.05;

/// Flag: the face is visible from its front only.
const ONE_SIDED: u32 = 1;

/// Flag: the map is read at full resolution, whatever the cone.
const SHARP: u32 = 2;

/// Plane of a face and the map's coordinates on it.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub(super) struct Face {
    /// Outward unit normal, and the plane's offset.
    normal: Vec3,
    place: f32,
    /// Gradients of both coordinates, texels per world unit, and their values at the origin.
    along: [Vec3; 2],
    at: Vec2,
    /// Upper bound of the gradient.
    growth: f32,
    /// Number of the map, from 1 on; 0: nothing is known.
    pub(super) map: u32,
    /// Combination of [`ONE_SIDED`] and [`SHARP`].
    flags: u32,
    /// Error of the coordinates, in texels, from the sizes of the numbers that they are computed from.
    error: f32,
}

#[expect(clippy::cast_possible_truncation, reason = "what is too large becomes infinite, and is not used")]
fn narrow(x: f64) -> f32 {
    x as f32
}

impl Face {
    /// Face of a triangle with these coordinates, in texels, at its corners, to which an offset is added; `None` where they are
    /// too inexact to be of use.
    pub(super) fn new(corners: [Vec3; 3], uv: [Vec2; 3], offset: Vec2, outward: f32) -> Option<Self> {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let normal = e1.cross(e2);
        let twice = normal.length();
        if e1.length() * e2.length() > twice * SLENDER {
            return None;
        }
        let (second, third) = (e2.cross(normal) / (twice * twice), normal.cross(e1) / (twice * twice));
        let [first, of_second, of_third] = uv.map(|uv| uv.as_dvec2());
        let edges = [of_second - first, of_third - first];
        let along = [0, 1].map(|k: usize| second * edges[0][k] + third * edges[1][k]);
        let at = first + offset.as_dvec2() - DVec2::new(along[0].dot(a), along[1].dot(a));
        // Major axis of the ellipse that a unit circle maps to.
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
            flags: 0,
            error: narrow(error) * FACE_COORDINATE,
        };
        let is_known = face.growth > 0.0 && (face.growth + face.error + face.place).is_finite();
        (is_known && face.at.is_finite() && face.normal.is_finite()).then_some(face)
    }

    /// This face with the map that cuts it out.
    pub(super) fn cut_by(self, map: u32, [one_sided, sharp]: [bool; 2]) -> Self {
        Self { map, flags: (u32::from(one_sided) * ONE_SIDED) | (u32::from(sharp) * SHARP), ..self }
    }

    /// What is certain where some rays hit the plane; maps are read at full resolution where cones have no width, or for
    /// [`SHARP`] faces.
    #[inline(always)]
    pub(super) fn sure<const N: usize>(&self, map: &Survey, rays: &Rays<N>) -> KnownOpacity {
        let backs_count = rays.looks & (self.flags & ONE_SIDED != 0);
        let growth = if self.flags & SHARP == 0 { self.growth } else { 0.0 };
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
            let error = BLUR + self.error + (largest * self.growth * longer + largest_at) * FACE_COORDINATE;
            let across = (width + spread * t) * growth;
            let reach = map.reach(across, across * longer) + error;
            // Backs of one-sided faces are passed, too, but not as gaps of the map.
            let unknown = (longer > GRAZING) | (t <= rays.from[i]) | (backs_count & (slope > 0.0));
            *needed = if unknown { f32::INFINITY } else { reach };
        }
        let room = map.room(&at);
        // NaN compares as false.
        (0..N).fold(KnownOpacity { clear: 0, solid: 0 }, |KnownOpacity { clear, solid }, i| KnownOpacity {
            clear: clear | u32::from(needed[i] <= room[i]) << i,
            solid: solid | u32::from(needed[i] <= -room[i]) << i,
        })
    }
}

/// A ray that hits faces.
#[derive(Clone, Copy)]
pub(super) struct Sight<'r> {
    pub(super) ray: &'r Ray,
    /// Width of the cone at the start, and its growth.
    pub(super) cone: [f32; 2],
    /// Distance up to which the ray may hit again a surface it has crossed or starts from: nothing is skipped up to there, as
    /// that decides about later hits.
    pub(super) from: f32,
}

/// Masks of rays that hit a face where its opacity is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownOpacity {
    /// Rays that hit a gap.
    pub(super) clear: u32,
    /// Rays that hit a solid part; for rays that look for surfaces this is unused: the hit is shaded in any case.
    pub(super) solid: u32,
}

/// Rays in lanes.
pub(super) struct Rays<const N: usize> {
    origin: [[f32; N]; 3],
    dir: [[f32; N]; 3],
    /// Widths of the cones at the start, and their growths.
    cone: [[f32; N]; 2],
    from: [f32; N],
    /// Whether the rays look for surfaces, and see one-sided faces from the front only.
    looks: bool,
}

impl<const N: usize> Rays<N> {
    #[inline(always)]
    pub(super) fn new(of: [Sight; N], looks: bool) -> Self {
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

/// Kernel for eight rays that hit a face.
pub(super) struct Eight<'r>(pub(super) &'r Face, pub(super) &'r Survey, pub(super) Rays<LANES>);

impl Kernel for Eight<'_> {
    type Output = KnownOpacity;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> KnownOpacity {
        let Self(face, map, rays) = self;
        face.sure(map, &rays)
    }
}
