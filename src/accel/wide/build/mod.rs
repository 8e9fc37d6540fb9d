//! Building a tree over shapes.
//!
//! A binary tree ([`build_nodes`]) is grown top-down ([`grow`]), improved where large and small faces are mixed
//! ([`reinsert`]) and collapsed into 8-wide nodes ([`collapse`]). Its leaves become blocks. Large parts are built by several
//! threads and joined in order, so that the tree does not depend on their number.
//!
//! Children are put into slots by position: bit k of a slot's number is set if its child lies on the positive side of axis k,
//! as far as the eight slots allow. `slot ^ octant` is then roughly the order in which a ray enters them, where bit k of
//! `octant` is set for a ray that runs backwards along axis k. Slots in between may be empty.

mod build_nodes;
mod cell;
mod collapse;
mod grow;
mod reinsert;
mod slots;

use rayon::prelude::*;

use self::build_nodes::{BuildNode, TreeBuilder};
use self::collapse::Nodes;
pub(in crate::accel) use self::grow::ALIKE;
use self::grow::{Grower, Work};
use super::node::{Arrays, Block, Child, index};
use super::split::item::around_middles;
use super::split::{Bounds, Item, Splitting, around};
use crate::accel::Shapes;
use crate::math::aabb::Aabb;
use crate::math::simd::LANES;
use crate::math::triangles::set_corners;
use crate::parts::joined;

/// Largest number of prims in a run: they cost more than a triangle, and are tested one by one.
const RUN: u32 = 2;

/// Items or leaves per task.
const CHUNK: usize = 1024;

/// Build nodes per task.
const BUILD_NODES: usize = 1 << 14;

/// Levels by which an improved tree may exceed twice its original depth: recursion must not overflow the stack.
const ROOM: usize = 32;

/// Builds the tree over all bounded prims, split as if there were `times` as many.
///
/// Panics if there are more blocks than indices, which takes hundreds of millions of triangles.
pub(super) fn build(shapes: &Shapes, splitting: Splitting, times: usize) -> Arrays {
    if shapes.bounded() == 0 {
        return Nodes::default().into_arrays(0, Aabb::EMPTY);
    }
    let triangles = shapes.triangles.len();
    let Binary { build_nodes: grown, depth: grown_depth, prims } = binary_tree(shapes, splitting, times);
    let (mut build_nodes, improved_depth) = reinsert::improve(grown);
    if improved_depth.is_some_and(|depth| depth > deepest(grown_depth)) {
        // Where boxes hardly have an area, rounding makes positions look better, and build nodes may form a long chain.
        build_nodes = binary_tree(shapes, splitting, times).build_nodes;
    }
    let leaves = Leaves::list(&mut build_nodes, index(triangles));
    let most = leaves.blocks.len().max(leaves.runs.len());
    assert!(most <= Child::MOST, "the scene is too large: {most} blocks, where a tree has room for {}", Child::MOST);
    let bounds = build_nodes.first().map_or(Aabb::EMPTY, BuildNode::bounds);
    let nodes = Nodes::over(&build_nodes);
    drop(build_nodes);
    // Empty slots lead to block 0, and so does a ray that no box can reject.
    let mut arrays = nodes.into_arrays(leaves.blocks.len().max(1), bounds);
    leaves.fill(arrays.blocks_mut(), shapes, &prims);
    arrays.with_runs(leaves.runs, prims[triangles..].to_vec())
}

/// Largest depth of an improved tree that had depth `depth` before.
fn deepest(depth: usize) -> usize {
    2 * depth + ROOM
}

/// A binary tree over all bounded prims.
struct Binary {
    build_nodes: Vec<BuildNode>,
    /// Number of build nodes on the longest path.
    depth: usize,
    /// Prims of the leaves, in order, triangles before others. A leaf holds triangles or other prims, never both.
    prims: Vec<u32>,
}

fn binary_tree(shapes: &Shapes, splitting: Splitting, times: usize) -> Binary {
    let first_other = index(shapes.triangles.len());
    let mut prims = vec![0; shapes.bounded() as usize];
    let (triangle_prims, other_prims) = prims.split_at_mut(shapes.triangles.len());
    let grow = |items: Items, prims: &mut [u32], first: u32, leaf: u32, builder: &mut TreeBuilder| {
        let Items { mut all, bounds, middles } = items;
        // Untouched pages are mapped by the threads that first write there.
        let spare = if splitting == Splitting::Octree { all.len() } else { 0 };
        let mut spare = bytemuck::zeroed_vec(spare);
        let grower = Grower::new(splitting, all.len(), times, &bounds, leaf);
        grower.grow(Work { items: &mut all, spare: &mut spare, prims, first }, bounds, Some(middles), builder);
    };
    let (triangles, others) = (Items::of_triangles(shapes), Items::of_others(shapes));
    let bounds = triangles.bounds.join(others.bounds).aabb();
    let lack = [&triangles, &others].map(|items| items.all.is_empty());
    let grow_triangles = |g: &mut TreeBuilder| grow(triangles, triangle_prims, 0, LANES as u32, g);
    let grow_others = |g: &mut TreeBuilder| grow(others, other_prims, first_other, RUN, g);
    let mut builder = TreeBuilder::default();
    match lack {
        [false, false] => builder.fork_shared(bounds, grow_triangles, grow_others),
        [false, true] => grow_triangles(&mut builder),
        [true, _] => grow_others(&mut builder),
    }
    let (build_nodes, depth) = builder.finish();
    Binary { build_nodes, depth, prims }
}

/// Items over which a tree is grown.
struct Items {
    all: Vec<Item>,
    bounds: Bounds,
    /// Box around the doubled middles.
    middles: Bounds,
}

impl Items {
    /// All triangles, in their order.
    fn of_triangles(shapes: &Shapes) -> Self {
        // Each chunk has as many places as triangles; untouched pages cost nothing.
        let mut all: Vec<Item> = bytemuck::zeroed_vec(shapes.triangles.len());
        let chunks = all.par_chunks_mut(CHUNK).zip(shapes.triangles.par_chunks(CHUNK)).enumerate();
        let paired = chunks.map(|(i, (places, chunk))| {
            let count = Item::in_pairs(shapes, index(i * CHUNK), chunk, places);
            let items = &places[..count];
            (count, around(items), around_middles(items))
        });
        let parts: Vec<(usize, Bounds, Bounds)> = paired.collect();
        let (mut len, mut bounds, mut middles) = (0, Bounds::EMPTY, Bounds::EMPTY);
        for (i, part) in parts.into_iter().enumerate() {
            let (start, count) = (i * CHUNK, part.0);
            if start > len {
                all.copy_within(start..start + count, len);
            }
            len += count;
            (bounds, middles) = (bounds.join(part.1), middles.join(part.2));
        }
        all.truncate(len);
        Self { all, bounds, middles }
    }

    /// Items of all other bounded prims.
    fn of_others(shapes: &Shapes) -> Self {
        let others = (index(shapes.triangles.len())..shapes.bounded()).into_par_iter().with_min_len(CHUNK);
        let all: Vec<Item> = others.map(|prim| Item::of(shapes, prim)).collect();
        let chunks = all.par_chunks(CHUNK);
        let bounds = chunks.clone().map(around).reduce(|| Bounds::EMPTY, Bounds::join);
        let middles = chunks.map(around_middles).reduce(|| Bounds::EMPTY, Bounds::join);
        Self { all, bounds, middles }
    }
}

/// Index of a leaf's first prim, and their number.
type Listed = (u32, u32);

fn part(prims: &[u32], (first, count): Listed) -> &[u32] {
    &prims[first as usize..(first + count) as usize]
}

/// All leaves, in order.
#[derive(Default)]
struct Leaves {
    blocks: Vec<Listed>,
    /// Runs; indices count from the first prim that is not a triangle.
    runs: Vec<Listed>,
}

impl Leaves {
    /// Lists the leaves among `build_nodes`, over prims of which the first `triangles` are triangles, and replaces the first
    /// prim of each leaf by its packed child.
    fn list(build_nodes: &mut [BuildNode], triangles: u32) -> Self {
        let count = |chunk: &[BuildNode]| {
            let leaves = chunk.iter().filter(|build_node| build_node.is_leaf());
            leaves.fold([0, 0], |[blocks, runs], leaf| {
                let block = u32::from(leaf.at < triangles);
                [blocks + block, runs + 1 - block]
            })
        };
        let counts: Vec<[u32; 2]> = build_nodes.par_chunks(BUILD_NODES).map(count).collect();
        let starts = counts.iter().scan([0, 0], |next, [blocks, runs]| {
            let start = *next;
            *next = [start[0] + blocks, start[1] + runs];
            Some(start)
        });
        let chunks: Vec<(&mut [BuildNode], [u32; 2])> = build_nodes.chunks_mut(BUILD_NODES).zip(starts).collect();
        let lists: Vec<Self> = chunks.into_par_iter().map(|(c, start)| Self::list_from(start, c, triangles)).collect();
        let (blocks, runs) = lists.into_iter().map(|list| (list.blocks, list.runs)).unzip();
        Self { blocks: joined(blocks), runs: joined(runs) }
    }

    /// Lists the leaves of some build nodes after the given numbers of blocks and runs.
    fn list_from([blocks, runs]: [u32; 2], build_nodes: &mut [BuildNode], triangles: u32) -> Self {
        let mut all = Self::default();
        for build_node in build_nodes.iter_mut().filter(|build_node| build_node.is_leaf()) {
            let BuildNode { at, count, .. } = *build_node;
            let child = if at < triangles {
                all.blocks.push((at, count));
                Child::Block(blocks + index(all.blocks.len() - 1), count)
            } else {
                all.runs.push((at - triangles, count));
                Child::Run(runs + index(all.runs.len() - 1))
            };
            build_node.at = child.pack();
        }
        all
    }

    /// Fills in the blocks; without any leaves, a single empty one.
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
    use super::build_nodes::tests::{depth, leaves};
    use super::*;
    use crate::accel::tests::scenes::mesh;
    use crate::accel::{SpherePrim, Wide};
    use crate::math::Vec3;

    #[test]
    fn every_triangle_is_in_one_item_however_many_pairs_there_are() {
        let mut random = crate::math::random::Random::new(5);
        for (count, near) in [(1, 0), (CHUNK, 0), (3 * CHUNK + 1, 1), (5 * CHUNK + 7, 2), (4 * CHUNK, 3)] {
            // `near` of three triangles are near the previous one.
            let (mut corner, mut vertices) = (Vec3::ZERO, Vec::new());
            for i in 0..count {
                corner = if i % 3 < near { corner } else { random.cube() * 100.0 };
                vertices.extend([corner, corner + Vec3::new(1.0, 0.2, 0.1), corner + Vec3::new(0.1, 1.0, 0.3)]);
            }
            let faces = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            let items = Items::of_triangles(&mesh(vertices, faces)).all;
            assert!(items.iter().flat_map(Item::prims).eq(0..count as u32), "{count} {near}");
            assert_eq!(items.len() < count, near > 0);
        }
    }

    #[test]
    fn a_large_tree_of_triangles_and_spheres_is_the_same_for_every_number_of_threads() {
        let mut random = crate::math::random::Random::new(8);
        let mut vertices = Vec::new();
        for _ in 0..150_000 {
            let corner = random.cube() * 50.0;
            vertices.extend([corner, corner + random.cube(), corner + random.cube()]);
        }
        let faces = (0..150_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let mut shapes = mesh(vertices, faces);
        let sphere = |center| SpherePrim { center, radius: 0.5 };
        shapes.spheres = (0..5000).map(|_| sphere(random.cube() * 50.0)).collect();
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let built = [1, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| build(&shapes, splitting, 1))
            });
            let trees = built.each_ref().map(Arrays::tree);
            let bytes = trees.map(|tree| {
                let [nodes, blocks] = [bytemuck::cast_slice::<_, u8>(tree.nodes), bytemuck::cast_slice(tree.blocks)];
                (nodes, blocks, tree.runs, tree.prims, tree.depth)
            });
            assert!(bytes[0] == bytes[1], "{splitting:?}");
            let checked = Wide::build(&shapes, splitting).check();
            assert!(checked.is_ok(), "{splitting:?}: {checked:?}");
            let Binary { build_nodes, depth: grown, .. } = binary_tree(&shapes, splitting, 1);
            assert_eq!(
                (grown, leaves(&build_nodes).len()),
                (depth(&build_nodes), build_nodes.len().div_ceil(2)),
                "{splitting:?}"
            );
        }
    }

    /// Where areas are too small to differ from zero, every split goes through the middle, and takes off one triangle of
    /// those whose distances halve: more than three times the levels of a balanced tree.
    #[test]
    fn a_tree_that_is_far_too_deep_and_that_threads_share_fits_on_their_stacks() {
        let place = |i: i32| -1e-19 * 0.5f32.powi(i.min(80));
        let corners = |x: f32| [Vec3::new(x, 0.0, 0.0), Vec3::new(x, 1e-27, 0.0), Vec3::new(x, 0.0, 1e-27)];
        let vertices: Vec<Vec3> = (0..30_000).flat_map(|i| corners(place(i))).collect();
        let faces = (0..30_000).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let shapes = mesh(vertices, faces);
        let pool = crate::threads::pool(2).unwrap();
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let Binary { build_nodes, depth: grown, .. } = pool.install(|| binary_tree(&shapes, splitting, 1));
            assert_eq!(grown, depth(&build_nodes));
            assert!(grown > 40, "{splitting:?}: {grown} levels are no deep tree");
            let checked = pool.install(|| Wide::build(&shapes, splitting).check());
            assert!(checked.is_ok(), "{splitting:?}, {grown} deep: {checked:?}");
        }
    }

    /// A mesh so far away that rounding collapses it to a few points.
    #[test]
    fn triangles_that_collapsed_to_points_make_no_deep_tree() {
        let side = 120;
        let at = |i: usize| Vec3::new((i % side) as f32, (i / side) as f32, 0.0) * 0.01 + Vec3::splat(1e7);
        let vertices: Vec<Vec3> = (0..side * side).map(at).collect();
        let faces = (0..side * (side - 1) - 1).map(|i| [i, i + 1, i + side].map(|v| v as u32)).collect();
        let shapes = mesh(vertices, faces);
        for splitting in [Splitting::Octree, Splitting::SurfaceArea] {
            let Binary { build_nodes, depth: grown, .. } = binary_tree(&shapes, splitting, 1);
            assert_eq!(grown, depth(&build_nodes), "{splitting:?}");
            let deep = deepest(grown);
            let improved = reinsert::improve(build_nodes).1.unwrap_or(grown);
            assert!(improved <= deep, "{splitting:?}: {improved}, places as good as another were taken for better");
            let arrays = build(&shapes, splitting, 1);
            let tree = arrays.tree();
            assert!(tree.depth as usize <= deep, "{splitting:?}: {}", tree.depth);
        }
    }
}
