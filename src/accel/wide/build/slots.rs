//! Assignment of the children of a node to slots.

use crate::math::Vec3;
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;

/// Slot of each of up to eight children: greedily takes the best pair of child and slot first. A child suits a slot the
/// better, the farther it lies from the centre in the slot's direction.
pub(super) fn slots(children: &[Aabb]) -> [usize; LANES] {
    let all = children.iter().fold(Aabb::EMPTY, |b, c| b.union(*c));
    // Halves, so that no sum overflows.
    let middle = |b: &Aabb| b.lo * 0.5 + b.hi * 0.5;
    let center = middle(&all);
    let suits = |child: usize| {
        let from_center = children.get(child).map_or(Vec3::ZERO, |b| middle(b) - center);
        let [x, y, z] = from_center.to_array().map(|d| [-d, d]);
        std::array::from_fn(|slot| x[slot & 1] + y[slot >> 1 & 1] + z[slot >> 2])
    };
    let table: [[f32; LANES]; LANES] = std::array::from_fn(suits);
    let best_of = |child: usize, free: u32| {
        let slots = (0..LANES).filter(|slot| free >> slot & 1 == 1);
        // The first of equal ones.
        slots.map(|slot| (table[child][slot], slot)).reduce(|a, b| if b.0 > a.0 { b } else { a })
    };

    let (mut slots, mut free, mut open) = ([0; LANES], (1u32 << LANES) - 1, (1u32 << children.len()) - 1);
    let mut best: [Option<(f32, usize)>; LANES] = std::array::from_fn(|child| best_of(child, free));
    while open != 0 {
        let waiting = (0..LANES).filter(|child| open >> child & 1 == 1);
        let next = waiting.filter_map(|child| best[child].map(|(value, slot)| (value, slot, child)));
        let Some((_, slot, child)) = next.reduce(|a, b| if b.0 > a.0 { b } else { a }) else { break };
        slots[child] = slot;
        free &= !(1 << slot);
        open &= !(1 << child);
        for other in (0..LANES).filter(|other| open >> other & 1 == 1) {
            if best[other].is_some_and(|(_, taken)| taken == slot) {
                best[other] = best_of(other, free);
            }
        }
    }
    slots
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slots_of(middles: &[Vec3]) -> Vec<usize> {
        let children: Vec<Aabb> = middles.iter().map(|&m| Aabb { lo: m - 0.1, hi: m + 0.1 }).collect();
        slots(&children)[..children.len()].to_vec()
    }

    #[test]
    fn eight_corners_stand_in_the_slots_of_their_signs() {
        let corner = |slot: usize| Vec3::from([0, 1, 2].map(|k: usize| if slot >> k & 1 == 1 { 1.0 } else { -1.0 }));
        let order = [3, 0, 7, 5, 1, 6, 2, 4];
        assert_eq!(slots_of(&order.map(corner)), order);
    }

    #[test]
    fn every_child_has_a_slot_of_its_own_and_those_along_an_axis_stand_in_its_order() {
        let row: Vec<Vec3> = (0..8).map(|i| Vec3::Y * i as f32).collect();
        let along = slots_of(&row);
        let mut sorted = along.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [0, 1, 2, 3, 4, 5, 6, 7]);
        assert!(along[..4].iter().all(|s| s >> 1 & 1 == 0) && along[4..].iter().all(|s| s >> 1 & 1 == 1), "{along:?}");
        for copies in 1..=8 {
            let mut slots = slots_of(&vec![Vec3::ONE; copies]);
            slots.sort_unstable();
            slots.dedup();
            assert_eq!(slots.len(), copies);
        }
        // NaN middles do no harm.
        let far = Aabb { lo: Vec3::splat(-f32::MAX), hi: Vec3::splat(f32::MAX) };
        let [a, b, c, ..] = slots(&[far; 3]);
        assert!(a != b && b != c && a != c);
    }
}
