//! From shapes to a tree, from the root down.
//!
//! A node starts with everything below it as one part; the part with the largest box is cut, and cut again, until there
//! are eight or nothing is left to cut. Large parts are built by several threads; what they make is joined in order, so
//! that the tree does not depend on their number.
//!
//! Children stand in slots by where they are: the bit k of a slot's number is set where its child lies on the positive side
//! of axis k, as far as the eight slots allow. `slot ^ octant` is then about the order in which a ray meets them, where
//! bit k of `octant` is set for a ray that runs backwards along axis k. Slots between may be empty.

use rayon::prelude::*;

use super::node::{Block, Child, Node, Tree, index};
use super::split::{Item, LEVELS, Splitting, area, around};
use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;
use crate::math::triangles::set_corners;
use crate::math::{DVec3, Vec3};

/// Items that are worth a thread's while.
const PARALLEL: usize = 4096;

/// Prims of a run at most: they cost more than a triangle, and are tested one by one.
const RUN: usize = 2;

/// Visiting another child costs so many block tests.
const STEP_COST: f32 = 0.3;

/// Builds the tree over all bounded prims.
pub(super) fn build(shapes: &Shapes, splitting: Splitting) -> Tree {
    let mut items = items(shapes);
    if items.is_empty() {
        return Tree::default();
    }
    // A leaf holds triangles or other prims, never both.
    let (triangles, others) = items.split_at_mut(shapes.triangles.len());
    let parts: Vec<Part> = [triangles, others].into_iter().filter(|i| !i.is_empty()).map(Part::new).collect();
    let all = parts.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds));
    let mut tree = Tree { extent: all.lo.abs().max(all.hi.abs()).max_element(), ..Tree::default() };
    Builder { shapes, splitting }.node(parts, &mut tree);
    if tree.blocks.is_empty() {
        // Empty slots lead to block 0, and a ray that no box can turn away goes there too.
        tree.blocks.push(Block::EMPTY);
    }
    tree
}

/// All bounded prims with their boxes and cells.
fn items(shapes: &Shapes) -> Vec<Item> {
    let bounds: Vec<Aabb> = (0..shapes.bounded()).into_par_iter().map(|prim| shapes.bounds(prim)).collect();
    let all = bounds.iter().fold(Aabb::EMPTY, |b, o| b.union(*o));
    let lo = all.lo.as_dvec3();
    let side = (all.hi.as_dvec3() - lo).max_element();
    // Twice the middle goes from 0 to twice the side.
    let scale = if side > 0.0 { f64::from(1u32 << (LEVELS - 1)) / side } else { 0.0 };
    let cell = |b: &Aabb| {
        let place: DVec3 = (b.lo.as_dvec3() - lo + (b.hi.as_dvec3() - lo)) * scale;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates")]
        place.to_array().map(|x| (x as u32).min((1 << LEVELS) - 1))
    };
    (0..shapes.bounded())
        .into_par_iter()
        .zip(&bounds)
        .map(|(prim, b)| Item { bounds: *b, prim, cell: cell(b) })
        .collect()
}

/// Items that go below one slot of a node.
struct Part<'i> {
    items: &'i mut [Item],
    bounds: Aabb,
    /// Whether it stays as it is.
    whole: bool,
}

impl<'i> Part<'i> {
    fn new(items: &'i mut [Item]) -> Self {
        let bounds = around(items);
        Self { items, bounds, whole: false }
    }
}

/// The slot of each part: of all pairs the one that suits best is taken first. A part suits a slot the better the
/// farther it lies from the middle in the slot's direction.
fn slots(parts: &[Part]) -> [usize; LANES] {
    let all = parts.iter().fold(Aabb::EMPTY, |b, p| b.union(p.bounds));
    // Halves, so that no sum overflows.
    let middle = |b: &Aabb| b.lo * 0.5 + b.hi * 0.5;
    let center = middle(&all);
    let from_center: [Vec3; LANES] =
        std::array::from_fn(|i| parts.get(i).map_or(Vec3::ZERO, |p| middle(&p.bounds) - center));
    let suits = |i: usize, slot: usize| {
        (0..3).map(|k| if slot >> k & 1 == 1 { from_center[i][k] } else { -from_center[i][k] }).sum::<f32>()
    };
    let best_of = |i: usize, free: u32| {
        let free = (0..LANES).filter(|slot| free >> slot & 1 == 1);
        // The first of equals.
        free.map(|slot| (suits(i, slot), slot)).reduce(|a, b| if b.0 > a.0 { b } else { a })
    };

    let (mut slots, mut free, mut open) = ([0; LANES], (1u32 << LANES) - 1, (1u32 << parts.len()) - 1);
    let mut best: [Option<(f32, usize)>; LANES] = std::array::from_fn(|i| best_of(i, free));
    while open != 0 {
        let waiting = (0..LANES).filter(|i| open >> i & 1 == 1);
        let next = waiting.filter_map(|i| best[i].map(|(value, slot)| (value, slot, i)));
        let Some((_, slot, i)) = next.reduce(|a, b| if b.0 > a.0 { b } else { a }) else { break };
        slots[i] = slot;
        free &= !(1 << slot);
        open &= !(1 << i);
        for other in (0..LANES).filter(|other| open >> other & 1 == 1) {
            if best[other].is_some_and(|(_, taken)| taken == slot) {
                best[other] = best_of(other, free);
            }
        }
    }
    slots
}

struct Builder<'a> {
    shapes: &'a Shapes,
    splitting: Splitting,
}

impl Builder<'_> {
    /// Adds the node of these parts, and all below, to `tree`; its index.
    fn node(&self, mut parts: Vec<Part>, tree: &mut Tree) -> u32 {
        while parts.len() < LANES && self.cut_largest(&mut parts) {}
        let at = tree.nodes.len();
        tree.nodes.push(Node::EMPTY);

        let large = parts.iter().map(|p| p.items.len()).sum::<usize>() > PARALLEL;
        let mut built: Vec<Option<Tree>> = if large {
            let subtree = |part: &mut Part| {
                (part.items.len() > self.leaf_size(part.items)).then(|| {
                    let mut tree = Tree::default();
                    self.node(vec![Part { items: part.items, bounds: part.bounds, whole: false }], &mut tree);
                    tree
                })
            };
            parts.par_iter_mut().map(subtree).collect()
        } else {
            Vec::new()
        };
        let slots = slots(&parts);
        for (i, part) in parts.into_iter().enumerate() {
            let (bounds, slot) = (part.bounds, slots[i]);
            let child = match built.get_mut(i).and_then(Option::take) {
                Some(subtree) => tree.append(subtree),
                None if part.items.len() > self.leaf_size(part.items) => Child::Node(self.node(vec![part], tree)),
                None => self.leaf(part.items, tree),
            };
            tree.nodes[at].set(slot, &bounds, child);
        }
        index(at)
    }

    /// Cuts the part with the largest box of those that should be cut; whether there was one.
    fn cut_largest(&self, parts: &mut Vec<Part>) -> bool {
        let open = parts.iter().enumerate().filter(|(_, p)| !p.whole && p.items.len() > 1);
        let Some((i, _)) = open.max_by(|(_, a), (_, b)| area(&a.bounds).total_cmp(&area(&b.bounds))) else {
            return false;
        };
        let Part { items, bounds, .. } = parts.swap_remove(i);
        let fits = items.len() <= self.leaf_size(items);
        let cut = self.splitting.cut(items);
        let [first, second] = cut.bounds;
        if fits && STEP_COST * area(&bounds) + area(&first) + area(&second) >= area(&bounds) {
            parts.push(Part { items, bounds, whole: true });
            return true;
        }
        let (a, b) = items.split_at_mut(cut.at);
        parts.push(Part { items: a, bounds: first, whole: false });
        parts.push(Part { items: b, bounds: second, whole: false });
        true
    }

    fn leaf_size(&self, items: &[Item]) -> usize {
        if self.is_triangle(items) { LANES } else { RUN }
    }

    fn is_triangle(&self, items: &[Item]) -> bool {
        items.first().is_some_and(|i| (i.prim as usize) < self.shapes.triangles.len())
    }

    fn leaf(&self, items: &[Item], tree: &mut Tree) -> Child {
        let mut prims: Vec<u32> = items.iter().map(|i| i.prim).collect();
        prims.sort_unstable();
        if !self.is_triangle(items) {
            tree.runs.push((index(tree.prims.len()), index(prims.len())));
            tree.prims.extend(prims);
            return Child::Run(index(tree.runs.len() - 1));
        }
        let mut block = Block::EMPTY;
        for (lane, &prim) in prims.iter().enumerate() {
            let corners: [Vec3; 3] = self.shapes.triangles[prim as usize].map(|i| self.shapes.vertices[i as usize]);
            set_corners(&mut block.corners, lane, &corners);
            block.prims[lane] = prim;
        }
        tree.blocks.push(block);
        Child::Block(index(tree.blocks.len() - 1), index(prims.len()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slots_of(middles: &[Vec3]) -> Vec<usize> {
        let part = |&m: &Vec3| Part { items: &mut [], bounds: Aabb { lo: m - 0.1, hi: m + 0.1 }, whole: true };
        let parts: Vec<Part> = middles.iter().map(part).collect();
        slots(&parts)[..parts.len()].to_vec()
    }

    #[test]
    fn eight_corners_stand_in_the_slots_of_their_signs() {
        let corner = |slot: usize| Vec3::from([0, 1, 2].map(|k: usize| if slot >> k & 1 == 1 { 1.0 } else { -1.0 }));
        let order = [3, 0, 7, 5, 1, 6, 2, 4];
        assert_eq!(slots_of(&order.map(corner)), order);
    }

    #[test]
    fn every_part_has_a_slot_of_its_own_and_those_along_an_axis_stand_in_its_order() {
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
        // Middles that are no numbers do no harm.
        let far = Aabb { lo: Vec3::splat(-f32::MAX), hi: Vec3::splat(f32::MAX) };
        let parts: Vec<Part> = (0..3).map(|_| Part { items: &mut [], bounds: far, whole: true }).collect();
        let slots = slots(&parts);
        assert!(slots[0] != slots[1] && slots[1] != slots[2] && slots[0] != slots[2], "{slots:?}");
    }
}
