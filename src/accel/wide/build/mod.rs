//! From shapes to a tree.
//!
//! A binary tree is grown from the root down ([`grow`]), improved where large and small faces are mixed ([`reinsert`]) and
//! fused into nodes of eight ([`collapse`]). Its leaves become blocks. Large parts are worked on by several threads; what
//! they make is joined in order, so that the tree does not depend on their number.
//!
//! Children stand in slots by where they are: the bit k of a slot's number is set where its child lies on the positive side
//! of axis k, as far as the eight slots allow. `slot ^ octant` is then about the order in which a ray meets them, where
//! bit k of `octant` is set for a ray that runs backwards along axis k. Slots between may be empty.

mod cell;
mod collapse;
mod grow;
mod reinsert;
mod slots;

use rayon::prelude::*;

pub(in crate::accel) use self::grow::ALIKE;
use self::grow::{Grower, Knot, Work};
use super::node::{Arrays, Block, Child, index};
use super::split::item::around_middles;
use super::split::{Bounds, Item, Splitting, around};
use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;
use crate::math::triangles::set_corners;

/// Prims of a run at most: they cost more than a triangle, and are tested one by one.
const RUN: u32 = 2;

/// Items or leaves that one thread takes at a time.
const CHUNK: usize = 1024;

/// How much more than twice as deep an improved tree may be: what is recursive must not run out of stack.
const ROOM: usize = 32;

/// Builds the tree over all bounded prims, cut as if there were `times` as many.
pub(super) fn build(shapes: &Shapes, splitting: Splitting, times: usize) -> Arrays {
    if shapes.bounded() == 0 {
        return Arrays::new(&[], 0, Aabb::EMPTY);
    }
    let triangles = shapes.triangles.len();
    let (grown, prims) = binary_tree(shapes, splitting, times);
    let deep = 2 * depth(&grown) + ROOM;
    let (mut knots, moved) = reinsert::improve(grown);
    if moved && depth(&knots) > deep {
        // Where boxes hardly have an area rounding makes places better, and knots may be hung one below the other.
        knots = binary_tree(shapes, splitting, times).0;
    }
    let leaves = Leaves::list(&mut knots, &prims, index(triangles));
    let bounds = knots.first().map_or(Aabb::EMPTY, Knot::bounds);
    let nodes = collapse::nodes(&knots);
    drop(knots);
    // Empty slots lead to block 0, and a ray that no box can turn away goes there too.
    let mut arrays = Arrays::new(&nodes, leaves.blocks.len().max(1), bounds);
    drop(nodes);
    leaves.fill(arrays.blocks_mut(), shapes, &prims);
    arrays.with_runs(leaves.runs, prims[triangles..].to_vec())
}

/// Knots on the longest way down.
fn depth(knots: &[Knot]) -> usize {
    // Not all the way down: a tree may be too deep for that.
    depth_from(knots, 6)
}

/// The same, both sides at once as long as knots are worth it and `levels` are left.
fn depth_from(knots: &[Knot], levels: u32) -> usize {
    if let [root, below @ ..] = knots
        && !root.is_leaf()
        && knots.len() > CHUNK
        && levels > 0
    {
        let (first, second) = below.split_at(root.at as usize - 1);
        let (first, second) = rayon::join(|| depth_from(first, levels - 1), || depth_from(second, levels - 1));
        return 1 + first.max(second);
    }
    let (mut left, mut most) = (vec![(0, 1)], 0);
    while let Some((i, depth)) = left.pop() {
        let Some(knot) = knots.get(i) else { continue };
        most = most.max(depth);
        if !knot.is_leaf() {
            left.push((i + knot.at as usize, depth + 1));
            left.push((i + 1, depth + 1));
        }
    }
    most
}

/// The binary tree over all bounded prims, and the prims of its leaves. A leaf holds triangles or other prims, never both.
fn binary_tree(shapes: &Shapes, splitting: Splitting, times: usize) -> (Vec<Knot>, Vec<u32>) {
    let first_other = index(shapes.triangles.len());
    let mut triangles = items_of_triangles(shapes);
    let others = (first_other..shapes.bounded()).into_par_iter().with_min_len(CHUNK);
    let mut others: Vec<Item> = others.map(|prim| Item::of(shapes, prim)).collect();
    let mut prims = vec![0; shapes.bounded() as usize];
    let (triangle_prims, other_prims) = prims.split_at_mut(shapes.triangles.len());
    let parts =
        [(&mut triangles[..], triangle_prims, 0, LANES as u32), (&mut others[..], other_prims, first_other, RUN)];

    let mut knots = Vec::new();
    let mut both = Bounds::EMPTY;
    for (items, prims, first, leaf) in parts {
        if items.is_empty() {
            continue;
        }
        let chunks = items.par_chunks(CHUNK);
        let bounds = chunks.clone().map(around).reduce(|| Bounds::EMPTY, Bounds::join);
        let middles = chunks.map(around_middles).reduce(|| Bounds::EMPTY, Bounds::join);
        // Pages that nothing was written to are made by the threads that write there.
        let spare = if splitting == Splitting::Octree { items.len() } else { 0 };
        let mut spare = bytemuck::zeroed_vec(spare);
        let second = !knots.is_empty();
        both = both.join(bounds);
        if second {
            // One knot over both.
            knots.insert(0, Knot::fork(both.aabb(), index(knots.len() + 1)));
        }
        let grower = Grower::new(splitting, items.len(), times, &bounds, leaf);
        grower.grow(Work { items, spare: &mut spare, prims, first }, bounds, Some(middles), &mut knots);
    }
    (knots, prims)
}

/// Items of all triangles, in their order.
fn items_of_triangles(shapes: &Shapes) -> Vec<Item> {
    // Each chunk has as many places as triangles; pages that nothing is written to cost nothing.
    let mut items: Vec<Item> = bytemuck::zeroed_vec(shapes.triangles.len());
    let chunks = items.par_chunks_mut(CHUNK).zip(shapes.triangles.par_chunks(CHUNK)).enumerate();
    let counts: Vec<usize> =
        chunks.map(|(i, (places, chunk))| Item::in_pairs(shapes, index(i * CHUNK), chunk, places)).collect();
    let mut len = 0;
    for (i, count) in counts.into_iter().enumerate() {
        let start = i * CHUNK;
        if start > len {
            items.copy_within(start..start + count, len);
        }
        len += count;
    }
    items.truncate(len);
    items
}

/// Where the prims of a leaf are, and how many.
type Listed = (u32, u32);

fn part(prims: &[u32], (first, count): Listed) -> &[u32] {
    &prims[first as usize..(first + count) as usize]
}

/// All leaves, in their order.
#[derive(Default)]
struct Leaves {
    blocks: Vec<Listed>,
    /// Counted from the first prim that is no triangle.
    runs: Vec<Listed>,
}

impl Leaves {
    /// Lists the leaves among `knots`. Each then has the child that it is, packed, in place of its first prim.
    fn list(knots: &mut [Knot], prims: &[u32], triangles: u32) -> Self {
        let mut all = Self::default();
        for knot in knots.iter_mut().filter(|knot| knot.is_leaf()) {
            let Knot { at, count, .. } = *knot;
            let child = if prims[at as usize] < triangles {
                all.blocks.push((at, count));
                Child::Block(index(all.blocks.len() - 1), count)
            } else {
                all.runs.push((at - triangles, count));
                Child::Run(index(all.runs.len() - 1))
            };
            knot.at = child.pack();
        }
        all
    }

    /// Makes the blocks; where there are none, one without triangles.
    fn fill(&self, blocks: &mut [Block], shapes: &Shapes, prims: &[u32]) {
        if self.blocks.is_empty() {
            return blocks.fill(Block::EMPTY);
        }
        let places = blocks.par_iter_mut().with_min_len(CHUNK).zip(&self.blocks);
        places.for_each(|(place, &of)| *place = block(shapes, part(prims, of)));
    }
}

fn block(shapes: &Shapes, prims: &[u32]) -> Block {
    let mut block = Block::EMPTY;
    for (lane, &prim) in prims.iter().enumerate() {
        set_corners(&mut block.corners, lane, &shapes.triangle(prim));
        block.prims[lane] = prim;
    }
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes::mesh;
    use crate::math::Vec3;

    #[test]
    fn every_triangle_is_in_one_item_however_many_pairs_there_are() {
        let mut random = crate::math::random::Random::new(5);
        for (count, near) in [(1, 0), (CHUNK, 0), (3 * CHUNK + 1, 1), (5 * CHUNK + 7, 2), (4 * CHUNK, 3)] {
            // Of three triangles so many are near the one before.
            let (mut corner, mut vertices) = (Vec3::ZERO, Vec::new());
            for i in 0..count {
                corner = if i % 3 < near { corner } else { random.cube() * 100.0 };
                vertices.extend([corner, corner + Vec3::new(1.0, 0.2, 0.1), corner + Vec3::new(0.1, 1.0, 0.3)]);
            }
            let faces = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let items = items_of_triangles(&mesh(vertices, faces));
            assert!(items.iter().flat_map(Item::prims).eq(0..count as u32), "{count} {near}");
            assert_eq!(items.len() < count, near > 0);
        }
    }

    /// A mesh so far away that rounding leaves a few points of it.
    #[test]
    fn triangles_that_collapsed_to_points_make_no_deep_tree() {
        let side = 120;
        let at = |i: usize| Vec3::new((i % side) as f32, (i / side) as f32, 0.0) * 0.01 + Vec3::splat(1e7);
        let vertices: Vec<Vec3> = (0..side * side).map(at).collect();
        let faces = (0..side * (side - 1) - 1).map(|i| [i, i + 1, i + side].map(|v| v as u32)).collect();
        let shapes = mesh(vertices, faces);
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let (knots, _) = binary_tree(&shapes, splitting, 1);
            let deep = 2 * depth(&knots) + ROOM;
            let improved = depth(&reinsert::improve(knots).0);
            assert!(improved <= deep, "{splitting:?}: {improved}, places as good as another were taken for better");
            let arrays = build(&shapes, splitting, 1);
            let tree = arrays.tree();
            assert!(tree.depth as usize <= deep, "{splitting:?}: {}", tree.depth);
        }
    }
}
