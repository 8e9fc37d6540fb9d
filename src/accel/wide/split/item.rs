//! Prims on their way into a tree, and boxes in registers of four lanes.

use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::{Vec3, Vec4};
use bytemuck::Zeroable;

/// A box whose fourth lanes mean nothing.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(in crate::accel) struct Bounds {
    pub lo: Vec4,
    pub hi: Vec4,
}

/// A prim and its box, 32 bytes. The fourth lanes hold its number in the lowest bits of two ordinary numbers: the
/// processor is slow with the tiny numbers that most integers are as floats.
#[derive(Clone, Copy, Debug, Zeroable)]
pub(in crate::accel) struct Item(Bounds);

impl Bounds {
    pub(in crate::accel) const EMPTY: Self = Self { lo: Vec4::INFINITY, hi: Vec4::NEG_INFINITY };

    #[inline(always)]
    pub(in crate::accel) fn join(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// With another point.
    #[inline(always)]
    pub(in crate::accel) fn with(self, point: Vec4) -> Self {
        Self { lo: self.lo.min(point), hi: self.hi.max(point) }
    }

    /// What a box costs: half its surface. Nothing sensible where it is empty.
    #[inline(always)]
    pub(in crate::accel) fn area(&self) -> f32 {
        let d = self.hi - self.lo;
        d.x * d.y + d.z * (d.x + d.y)
    }

    /// The same box in memory.
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

/// Bits of a prim's number beside the lower corner; the others are beside the upper one.
const LOW_BITS: u32 = 23;
const LOW: u32 = (1 << LOW_BITS) - 1;

impl Item {
    #[inline]
    pub(in crate::accel) fn new(bounds: Aabb, prim: u32) -> Self {
        Self::numbered(bounds.into(), prim)
    }

    /// Prim `prim` in the box around it.
    #[inline(always)]
    pub(in crate::accel) fn of(shapes: &Shapes, prim: u32) -> Self {
        let Some(corners) = shapes.triangles.get(prim as usize) else { return Self::new(shapes.bounds(prim), prim) };
        // Corners are finite: registers need not take care of what is no number, as `Aabb` does.
        let [a, b, c] = shapes.corners(*corners).map(|corner| corner.extend(0.0));
        Self::numbered(Bounds { lo: a.min(b).min(c), hi: a.max(b).max(c) }, prim)
    }

    #[inline(always)]
    fn numbered(mut bounds: Bounds, prim: u32) -> Self {
        let number = |bits: u32| f32::from_bits(1f32.to_bits() | bits);
        (bounds.lo.w, bounds.hi.w) = (number(prim & LOW), number(prim >> LOW_BITS));
        Self(bounds)
    }

    #[inline(always)]
    pub(in crate::accel) fn bounds(&self) -> Bounds {
        self.0
    }

    #[inline(always)]
    pub(in crate::accel) fn prim(&self) -> u32 {
        let bits = |number: f32| number.to_bits() & LOW;
        bits(self.0.lo.w) | bits(self.0.hi.w) << LOW_BITS
    }

    /// The middle of the box, doubled.
    #[inline(always)]
    pub(in crate::accel) fn middle(&self) -> Vec4 {
        self.0.lo + self.0.hi
    }
}

/// The box around all items.
pub(in crate::accel) fn around(items: &[Item]) -> Bounds {
    items.iter().fold(Bounds::EMPTY, |b, i| b.join(i.bounds()))
}

/// The box around the middles, doubled.
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
        for prim in [0, 1, LOW, LOW + 1, 123_456_789, u32::MAX - 1] {
            let item = Item::new(bounds, prim);
            assert_eq!((item.prim(), item.bounds().aabb()), (prim, bounds));
            assert!(item.bounds().lo.w.is_normal() && item.bounds().hi.w.is_normal());
        }
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
