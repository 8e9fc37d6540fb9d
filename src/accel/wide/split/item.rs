//! Items of the tree builder, and boxes in registers of four lanes.

use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::{Vec3, Vec4};
use bytemuck::Zeroable;
use std::ops::Range;

/// A box with unused fourth lanes.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(in crate::accel) struct Bounds {
    pub lo: Vec4,
    pub hi: Vec4,
}

/// A prim, or two consecutive ones, with their box, in 32 bytes. The fourth lanes hold the number of the first prim in the
/// lowest bits of two normal floats: the processor is slow with the subnormal numbers that most integers are as floats.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(in crate::accel) struct Item(Bounds);

impl Bounds {
    pub(in crate::accel) const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline(always)]
    pub(in crate::accel) fn join(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// Extends the box to a point.
    #[inline(always)]
    pub(in crate::accel) fn with(self, point: Vec4) -> Self {
        Self { lo: self.lo.min(point), hi: self.hi.max(point) }
    }

    /// Cost of a box: half its surface area. Meaningless for an empty box.
    #[inline(always)]
    pub(in crate::accel) fn area(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + d.z * (d.x + d.y)
    }

    /// Volume of the box.
    #[inline(always)]
    pub(in crate::accel) fn volume(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y * d.z
    }

    /// The box as structures store it.
    #[inline]
    pub(in crate::accel) fn aabb(&self) -> Aabb {
        Aabb { lo: self.lo.truncate(), hi: self.hi.truncate() }
    }
}

impl From<Aabb> for Bounds {
    #[inline]
    fn from(b: Aabb) -> Self {
        let lanes = |v: Vec3| v.extend(0.0);
        Self { lo: lanes(b.lo), hi: lanes(b.hi) }
    }
}

/// Number of bits of a prim's number beside the lower corner; the rest is beside the upper one.
const LOW_BITS: u32 = 23;
const LOW: u32 = (1 << LOW_BITS) - 1;

/// Bit beside the upper corner that marks an item of two prims.
const TWO: u32 = 1 << (LOW_BITS - 1);

/// Two prims are joined if their common box has at most this fraction of the areas of both boxes.
const TOGETHER: f32 = 0.75;

impl Item {
    #[inline]
    pub(in crate::accel) fn new(bounds: Aabb, prim: u32) -> Self {
        Self::numbered(bounds.into(), prim, 0)
    }

    /// Item of prim `prim`, with its box.
    #[inline(always)]
    pub(in crate::accel) fn of(shapes: &Shapes, prim: u32) -> Self {
        match shapes.triangles.get(prim as usize) {
            Some(corners) => Self::numbered(around_triangle(shapes, *corners), prim, 0),
            None => Self::new(shapes.bounds(prim), prim),
        }
    }

    /// Makes items of neighbouring triangles, numbered from `first` on, at the front of as many `places`; returns their
    /// count.
    ///
    /// Neighbours in a file are mostly neighbours in space, and many are the halves of a quad. Pairing them halves the work,
    /// and leaves are as good.
    pub(in crate::accel) fn in_pairs(
        shapes: &Shapes,
        first: u32,
        triangles: &[[u32; 3]],
        places: &mut [Self],
    ) -> usize {
        let mut boxes = triangles.iter().map(|corners| around_triangle(shapes, *corners));
        let (mut count, mut prim, mut next) = (0, first, boxes.next());
        while let Some(bounds) = next {
            next = boxes.next();
            let pair = next.map(|other| (bounds.join(other), (bounds.area() + other.area()) * TOGETHER));
            (places[count], prim) = match pair {
                Some((both, most)) if both.area() <= most => {
                    next = boxes.next();
                    (Self::numbered(both, prim, TWO), prim + 2)
                }
                _ => (Self::numbered(bounds, prim, 0), prim + 1),
            };
            count += 1;
        }
        count
    }

    #[inline(always)]
    fn numbered(mut bounds: Bounds, prim: u32, two: u32) -> Self {
        let number = |bits: u32| f32::from_bits(1f32.to_bits() | bits);
        (bounds.lo.w, bounds.hi.w) = (number(prim & LOW), number(prim >> LOW_BITS | two));
        Self(bounds)
    }

    #[inline(always)]
    pub(in crate::accel) fn bounds(&self) -> Bounds {
        self.0
    }

    #[inline(always)]
    pub(in crate::accel) fn prim(&self) -> u32 {
        let bits = |number: f32| number.to_bits() & LOW;
        bits(self.0.lo.w) | (bits(self.0.hi.w) & !TWO) << LOW_BITS
    }

    /// Number of prims: 1 or 2.
    #[inline(always)]
    pub(in crate::accel) fn count(&self) -> u32 {
        1 + u32::from(self.0.hi.w.to_bits() & TWO != 0)
    }

    /// The prims of the item.
    #[inline(always)]
    pub(in crate::accel) fn prims(&self) -> Range<u32> {
        self.prim()..self.prim() + self.count()
    }

    /// Centre of the box, doubled.
    #[inline(always)]
    pub(in crate::accel) fn middle(&self) -> Vec4 {
        self.0.lo + self.0.hi
    }
}

/// Box of a triangle. Corners are finite: NaN needs no care, unlike in `Aabb`.
#[inline(always)]
fn around_triangle(shapes: &Shapes, corners: [u32; 3]) -> Bounds {
    let [a, b, c] = shapes.corners(corners).map(|corner| corner.extend(0.0));
    Bounds { lo: a.min(b).min(c), hi: a.max(b).max(c) }
}

/// Number of prims in the items.
pub(in crate::accel) fn count(items: &[Item]) -> usize {
    items.iter().map(|item| item.count() as usize).sum()
}

/// Box around all items.
pub(in crate::accel) fn around(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |b, i| b.join(i.bounds()))
}

/// Box around the doubled middles of all items.
pub(in crate::accel) fn around_middles(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |b, i| b.with(i.middle()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;

    #[test]
    fn an_item_keeps_its_prim_and_its_box() {
        let bounds = Aabb { lo: Vec3::new(-1.0, 2.0, 3.0), hi: Vec3::new(4.0, 5.0, 6.5) };
        for prim in [0, 1, LOW, LOW + 1, 123_456_789, u32::MAX - 2] {
            let item = Item::new(bounds, prim);
            assert_eq!((item.prim(), item.bounds().aabb()), (prim, bounds));
            assert!(item.bounds().lo.w.is_normal() && item.bounds().hi.w.is_normal());
            let pair = Item::numbered(bounds.into(), prim, TWO);
            assert_eq!((item.prims(), pair.prims()), (prim..prim + 1, prim..prim + 2));
        }
    }

    /// First prim and number of prims of each item made of these triangles, which are numbered from 7 on.
    fn paired(corners: &[[Vec3; 3]]) -> Vec<(u32, u32)> {
        let shapes =
            scenes::mesh(corners.concat(), (0..).step_by(3).map(|v| [v, v + 1, v + 2]).take(corners.len()).collect());
        let mut places = vec![Item::zeroed(); corners.len()];
        let count = Item::in_pairs(&shapes, 7, &shapes.triangles, &mut places);
        for item in &places[..count] {
            let bounds = item.prims().map(|prim| shapes.bounds(prim - 7)).fold(Aabb::EMPTY, Aabb::union);
            assert_eq!(item.bounds().aabb(), bounds, "{:?}", item.prims());
            assert_eq!(item.count(), item.prims().len() as u32);
        }
        assert_eq!(super::count(&places[..count]), corners.len());
        places[..count].iter().map(|item| (item.prim(), item.count())).collect()
    }

    #[test]
    fn halves_of_quads_are_taken_together_and_what_lies_apart_is_not() {
        let [a, b] = [[Vec3::ZERO, Vec3::X, Vec3::Y], [Vec3::X, Vec3::ONE - Vec3::Z, Vec3::Y]];
        let away = |triangle: [Vec3; 3]| triangle.map(|corner| corner + Vec3::X * 9.0);
        assert_eq!(paired(&[a, b]), [(7, 2)]);
        assert_eq!(paired(&[a, away(b)]), [(7, 1), (8, 1)]);
        assert_eq!(paired(&[away(b), a, b]), [(7, 1), (8, 2)]);
        assert_eq!(paired(&[a, b, away(a), away(b), a]), [(7, 2), (9, 2), (11, 1)]);
        // Of three triangles that lie together the first two are paired.
        assert_eq!(paired(&[a, b, a]), [(7, 2), (9, 1)]);
        assert_eq!(paired(&[]), []);
    }

    #[test]
    fn the_item_of_a_prim_has_its_box_whatever_shape_it_is() {
        for (name, shapes) in scenes::all() {
            for prim in 0..shapes.bounded() {
                let item = Item::of(&shapes, prim);
                assert_eq!((item.prim(), item.bounds().aabb()), (prim, shapes.bounds(prim)), "{name}");
            }
        }
    }
}
