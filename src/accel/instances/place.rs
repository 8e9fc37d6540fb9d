//! Where an object stands: the way of its corners into the scene's frame, and of rays into its own.

use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::bounds::{PLACED_CONDITION, PLACED_ROOM, PLACED_SCALE};
use crate::math::simd::{LANES, Row, Simd};
use crate::math::triangles::Corners8;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};

/// A corner of an object in the scene's frame: moved in `f64` and rounded once. What is flattened is placed by this, and
/// so is what is kept, each time a ray comes near: both are the same triangle, bit for bit.
#[inline]
pub fn placed(frame_from_object: &DAffine3, corner: Vec3) -> Vec3 {
    frame_from_object.transform_point3(corner.as_dvec3()).as_vec3()
}

/// Where an object stands.
///
/// # Why no hit is lost
/// Let c be the translation, N the inverse of the matrix as computed, whatever its error. A ray o + t d that hits a placed
/// triangle at t hits a mean of its placed corners v'. So N (o − c) + t N d, with the same t, is the same mean of the
/// points N (v' − c), and those are within `room` of the object's own corners v, on each axis: that is how `room` is
/// measured, corner by corner. The boxes of the object, larger by `room`, hold that point. What is left is the rounding of
/// N (o − c) and N d: [`PLACED_PAD`](crate::math::bounds::PLACED_PAD) and
/// [`PLACED_DRIFT`](crate::math::bounds::PLACED_DRIFT).
#[derive(Clone, Debug)]
pub struct Place {
    frame_from_object: DAffine3,
    /// N.
    object_from_frame: DMat3,
    /// How far corners that were placed and carried back may be from where they were.
    pub room: Vec3,
    /// Around all placed corners, exactly.
    pub bounds: Aabb,
}

impl Place {
    /// A place from which rays can be carried to the corners of `object`, all of which count; `None` where that is too
    /// inexact to be of use: singular or nearly so, far too large or small, or so far away that rounding moves the corners
    /// by a part of the object's size that matters.
    pub fn new(frame_from_object: DAffine3, object: &Shapes) -> Option<Self> {
        let (m, n) = (frame_from_object.matrix3, frame_from_object.matrix3.inverse());
        let (grows, shrinks) = (row_sum(&m), row_sum(&n));
        // False for NaN.
        let ordinary = |scale: f64| (1.0 / PLACED_SCALE..=PLACED_SCALE).contains(&scale);
        if !(ordinary(grows) && ordinary(shrinks) && grows * shrinks <= PLACED_CONDITION) {
            return None;
        }
        let mut place = Self { frame_from_object, object_from_frame: n, room: Vec3::ZERO, bounds: Aabb::EMPTY };
        let (mut room, mut own) = (DVec3::ZERO, Aabb::EMPTY);
        for &corner in &object.vertices {
            let there = place.corner(corner);
            if !there.is_finite() {
                return None;
            }
            room = room.max((place.carried(there) - corner.as_dvec3()).abs());
            place.bounds = place.bounds.union(Aabb { lo: there, hi: there });
            own = own.union(Aabb { lo: corner, hi: corner });
        }
        place.room = room.as_vec3().map(f32::next_up);
        let size = (own.hi - own.lo).max_element();
        (place.room.max_element() <= size * PLACED_ROOM).then_some(place)
    }

    /// [`placed`].
    #[inline]
    pub fn corner(&self, corner: Vec3) -> Vec3 {
        placed(&self.frame_from_object, corner)
    }

    /// Eight triangles of the object where they stand, each corner by [`placed`], operation by operation.
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

    /// A point of the scene's frame in that of the object.
    #[inline]
    pub fn carried(&self, point: Vec3) -> DVec3 {
        self.object_from_frame * (point.as_dvec3() - self.frame_from_object.translation)
    }

    /// A direction likewise; its length changes as those of distances do, so that t stays what it was.
    #[inline]
    pub fn carried_dir(&self, dir: Vec3) -> DVec3 {
        self.object_from_frame * dir.as_dvec3()
    }

    /// A box of the object where it stands, as a box around it: to be looked at.
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

/// The largest sum of the sizes of a row: how much the largest coordinate may grow.
fn row_sum(m: &DMat3) -> f64 {
    (m.x_axis.abs() + m.y_axis.abs() + m.z_axis.abs()).max_element()
}
