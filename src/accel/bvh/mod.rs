//! Binary bounding volume hierarchy; the nearer of two children is visited first.
//!
//! S. Rubin, T. Whitted, *A 3-Dimensional Representation for Fast Rendering of Complex Scenes*, 1980; the order by distance
//! is T. Kay's and J. Kajiya's, *Ray Tracing Complex Scenes*, 1986. Nodes are split by the binned surface area heuristic
//! ([`Splitting::SurfaceArea`](super::Splitting)) until a leaf is small enough. The walk tests one ray, one box and one prim
//! at a time: `fast-bvh` is the same with eight of each.

mod check;
pub mod tree;

use self::tree::{Stack, Tree};
use super::query::{Culling, Goal, Query};
use super::slabs::BoxRay;
use super::wide::split::Item;
use super::{Probe, Shapes};

/// Default number of prims in a leaf.
pub const LEAF_SIZE: u32 = 2;

/// Binary hierarchy of boxes over the bounded prims.
#[derive(Clone, Debug)]
pub struct Bvh<'a> {
    shapes: &'a Shapes,
    /// The root is node 0; there is none without bounded prims.
    tree: Tree,
}

impl<'a> Bvh<'a> {
    /// Builds the hierarchy over the bounded prims, with leaves of at most `leaf_size`; the same for every number of threads.
    pub fn build(shapes: &'a Shapes, leaf_size: u32) -> Self {
        let item = |prim| Item::of(shapes, prim);
        let mut items: Vec<Item> = (0..shapes.bounded()).map(item).collect();
        let mut tree = Tree::default();
        if !items.is_empty() {
            tree.add(&mut items, leaf_size as usize);
        }
        Self { shapes, tree }
    }
}

impl Culling for Bvh<'_> {
    type Scratch = Stack;

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) -> Stack {
        Stack::default()
    }

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, stack: &mut Stack, probe: &mut P) {
        let ray = BoxRay::new(query);
        self.tree.walk(0, &ray, query, stack, probe, |prims, query, probe| {
            prims.iter().any(|&prim| query.test(prim, probe))
        });
    }
}
