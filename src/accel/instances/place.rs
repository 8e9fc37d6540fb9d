//! Placement of an object: transforms of its corners into the scene's frame, and of rays into its own.

use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::bounds::{PLACED_CONDITION, PLACED_ROOM, PLACED_SCALE};
use crate::math::simd::{Kernel, LANES, Level, Row, Simd};
use crate::math::triangles::Corners8;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};

/// Corner of an object in the scene's frame: transformed in `f64` and rounded once. Flattening uses this function, and so do
/// instanced objects each time a ray comes near: both give the same triangle, bit for bit.
#[inline]
pub fn placed(frame_from_object: &DAffine3, corner: Vec3) -> Vec3 {
    frame_from_object.transform_point3(corner.as_dvec3()).as_vec3()
}

/// Transform of a placed object.
///
/// # Why no hit is lost
/// Let c be the translation, N the inverse of the matrix as computed, whatever its error. A ray o + t d that hits a placed
/// triangle at t hits a convex combination of its placed corners v'. So N (o − c) + t N d, with the same t, is the same
/// combination of the points N (v' − c), and those are within `room` of the object's own corners v, on each axis: that is how
/// `room` is measured, corner by corner. The boxes of the object, widened by `room`, contain that point. What remains is the
/// rounding of N (o − c) and N d: [`PLACED_PAD`](crate::math::bounds::PLACED_PAD) and
/// [`PLACED_DRIFT`](crate::math::bounds::PLACED_DRIFT).
#[derive(Clone, Debug)]
pub struct ObjectTransform {
    frame_from_object: DAffine3,
    /// The inverse matrix N.
    object_from_frame: DMat3,
    /// Largest distance on each axis between an object's corners and the same corners placed and transformed back.
    pub room: Vec3,
    /// Exact box around all placed corners.
    pub bounds: Aabb,
}

impl ObjectTransform {
    /// Creates the transform of `object`, all of whose corners count; `None` if it is too inexact to be of use: singular or
    /// nearly so, far too large or small, or so far away that rounding moves the corners by a significant part of the
    /// object's size.
    pub fn new(frame_from_object: DAffine3, object: &Shapes) -> Option<Self> {
        let (m, n) = (frame_from_object.matrix3, frame_from_object.matrix3.inverse());
        let (grows, shrinks) = (row_sum(&m), row_sum(&n));
        // False for NaN.
        let ordinary = |scale: f64| (1.0 / PLACED_SCALE..=PLACED_SCALE).contains(&scale);
        if !(ordinary(grows) && ordinary(shrinks) && grows * shrinks <= PLACED_CONDITION) {
            return None;
        }
        let mut place = Self { frame_from_object, object_from_frame: n, room: Vec3::ZERO, bounds: Aabb::EMPTY };
        let Measured { room, bounds, own } =
            Level::best().run_narrow(Measure { place: &place, corners: &object.vertices });
        if !(bounds.lo.is_finite() && bounds.hi.is_finite() && room.is_finite()) {
            return None;
        }
        (place.room, place.bounds) = (room.as_vec3().map(f32::next_up), bounds);
        let size = (own.hi - own.lo).max_element();
        (place.room.max_element() <= size * PLACED_ROOM).then_some(place)
    }

    /// Corner of the object in the scene's frame, by [`placed`].
    #[inline]
    pub fn corner(&self, corner: Vec3) -> Vec3 {
        placed(&self.frame_from_object, corner)
    }

    /// Eight triangles of the object in the scene's frame, each corner by [`placed`], operation by operation.
    #[inline(always)]
    pub(in crate::accel) fn block<S: Simd>(&self, s: S, corners: &Corners8) -> Corners8 {
        [self.row(s, &corners[0]), self.row(s, &corners[1]), self.row(s, &corners[2])]
    }

    #[inline(always)]
    fn row<S: Simd>(&self, s: S, corner: &[Row; 3]) -> [Row; 3] {
        let DAffine3 { matrix3: m, translation: c } = self.frame_from_object;
        let x = s.widen(s.load(&corner[0]));
        let y = s.widen(s.load(&corner[1]));
        let z = s.widen(s.load(&corner[2]));
        let mut there = [[0.0; LANES]; 3];
        for k in 0..3 {
            let xy = s.add_f64(s.mul_f64(s.splat_f64(m.x_axis[k]), x), s.mul_f64(s.splat_f64(m.y_axis[k]), y));
            let xyz = s.add_f64(xy, s.mul_f64(s.splat_f64(m.z_axis[k]), z));
            there[k] = s.store(s.narrow(s.add_f64(xyz, s.splat_f64(c[k]))));
        }
        there
    }

    /// Transforms a point of the scene's frame into the object's.
    #[inline]
    pub fn carried(&self, point: Vec3) -> DVec3 {
        self.object_from_frame * (point.as_dvec3() - self.frame_from_object.translation)
    }

    /// Transforms a direction of the scene's frame into the object's; its length scales as distances do, so that t stays the
    /// same.
    #[inline]
    pub fn carried_dir(&self, dir: Vec3) -> DVec3 {
        self.object_from_frame * dir.as_dvec3()
    }

    /// Box around a box of the object in the scene's frame; for display only.
    #[expect(clippy::cast_possible_truncation, reason = "a box to be looked at")]
    pub(in crate::accel) fn around(&self, bounds: &Aabb) -> Aabb {
        let corner = |i: usize| {
            let pick = |k: usize| if i >> k & 1 == 0 { bounds.lo[k] } else { bounds.hi[k] };
            let there = self.frame_from_object.transform_point3(DVec3::from([0, 1, 2].map(|k| f64::from(pick(k)))));
            Vec3::new(there.x as f32, there.y as f32, there.z as f32)
        };
        Aabb::around((0..8).map(corner))
    }
}

/// Kernel that transforms all corners of a placed object to the scene and back.
struct Measure<'a> {
    place: &'a ObjectTransform,
    corners: &'a [Vec3],
}

/// Result of [`Measure`].
#[derive(Debug, PartialEq)]
struct Measured {
    /// Largest distance, on each axis, between a corner and its transformed and transformed-back copy; not finite if any is
    /// not.
    room: DVec3,
    /// Box around all placed corners.
    bounds: Aabb,
    /// Box around all corners in the object's own frame.
    own: Aabb,
}

impl Kernel for Measure<'_> {
    type Output = Measured;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Measured {
        let Self { place, corners } = self;
        let (translation, n) = (place.frame_from_object.translation, place.object_from_frame);
        let (mut lo, mut hi) = ([s.splat(f32::INFINITY); 6], [s.splat(f32::NEG_INFINITY); 6]);
        let (mut room, mut finite) = ([s.splat_f64(0.0); 3], (1 << LANES) - 1);
        // Loops, because closures would be compiled without the vector instructions.
        for run in corners.chunks(LANES) {
            let mut corner = [[0.0; LANES]; 3];
            // The last corner fills the remaining lanes.
            let eight: [Vec3; LANES] = match run.first_chunk() {
                Some(eight) => *eight,
                None => std::array::from_fn(|lane| run[lane.min(run.len() - 1)]),
            };
            for (lane, p) in eight.iter().enumerate() {
                (corner[0][lane], corner[1][lane], corner[2][lane]) = (p.x, p.y, p.z);
            }
            let there = place.row(s, &corner);
            let mut from = [s.splat_f64(0.0); 3];
            for k in 0..3 {
                from[k] = s.sub_f64(s.widen(s.load(&there[k])), s.splat_f64(translation[k]));
            }
            for k in 0..3 {
                // The same operations as `carried`.
                let x = s.mul_f64(s.splat_f64(n.x_axis[k]), from[0]);
                let y = s.mul_f64(s.splat_f64(n.y_axis[k]), from[1]);
                let z = s.mul_f64(s.splat_f64(n.z_axis[k]), from[2]);
                let back = s.add_f64(s.add_f64(x, y), z);
                let off = s.sub_f64(back, s.widen(s.load(&corner[k])));
                room[k] = s.greater_f64(s.abs_f64(off), room[k]);
            }
            for k in 0..3 {
                let (there, own) = (s.load(&there[k]), s.load(&corner[k]));
                finite &= s.at_most(s.abs(own), s.splat(f32::MAX));
                (lo[k], hi[k]) = (s.smaller(there, lo[k]), s.greater(there, hi[k]));
                (lo[k + 3], hi[k + 3]) = (s.smaller(own, lo[k + 3]), s.greater(own, hi[k + 3]));
            }
        }
        let (mut least, mut greatest) = ([0.0; 6], [0.0; 6]);
        for side in 0..6 {
            (least[side], greatest[side]) = (s.least(lo[side]), s.greatest(hi[side]));
        }
        let of = |first: usize| Aabb {
            lo: Vec3::from_slice(&least[first..first + 3]),
            hi: Vec3::from_slice(&greatest[first..first + 3]),
        };
        let mut furthest = DVec3::ZERO;
        for k in 0..3 {
            furthest[k] = s.store_f64(room[k]).into_iter().fold(0.0, f64::max);
        }
        Measured { room: if finite == (1 << LANES) - 1 { furthest } else { DVec3::NAN }, bounds: of(0), own: of(3) }
    }
}

/// Largest absolute row sum: the factor by which the largest coordinate may grow.
fn row_sum(m: &DMat3) -> f64 {
    (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_measured_eight_at_a_time_as_one_by_one() {
        let at = |i: usize| Vec3::new(libm::sinf(i as f32), libm::cosf(i as f32 * 1.7) * 3.0, 0.1 + i as f32 * 0.01);
        let matrix = DAffine3 {
            matrix3: DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(2.3) * 1.9,
            translation: DVec3::new(0.3, -17.7, 5.1),
        };
        for len in [3, 8, 9, 64, 101] {
            let object = Shapes { vertices: (0..len).map(at).collect(), ..Shapes::default() };
            let place = ObjectTransform::new(matrix, &object).expect("an ordinary place");
            let there = || object.vertices.iter().map(|&corner| place.corner(corner));
            let off = |(there, corner): (Vec3, &Vec3)| (place.carried(there) - corner.as_dvec3()).abs();
            let expected = Measured {
                room: there().zip(&object.vertices).map(off).fold(DVec3::ZERO, DVec3::max),
                bounds: Aabb::around(there()),
                own: Aabb::around(object.vertices.iter().copied()),
            };
            assert!(place.room.cmpgt(Vec3::ZERO).all() && place.bounds == expected.bounds);
            for level in Level::all() {
                let found = level.run(Measure { place: &place, corners: &object.vertices });
                assert_eq!(found, expected, "{len} {}", level.name());
            }
        }
    }

    #[test]
    fn a_corner_that_is_nowhere_has_no_place() {
        for far in [f32::NAN, f32::INFINITY, f32::MAX] {
            let object = Shapes { vertices: vec![Vec3::ZERO, Vec3::X, Vec3::splat(far)], ..Shapes::default() };
            assert!(ObjectTransform::new(DAffine3::from_scale(DVec3::splat(2.0)), &object).is_none(), "{far}");
        }
    }
}
