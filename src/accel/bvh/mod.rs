//! A hierarchy of bounding boxes as a binary tree; of two children the nearer is visited first.
//!
//! S. Rubin, T. Whitted, *A 3-Dimensional Representation for Fast Rendering of Complex Scenes*, 1980; the order by
//! distance is T. Kay's and J. Kajiya's, *Ray Tracing Complex Scenes*, 1986. Boxes are cut in two by the surface area
//! heuristic in bins ([`Splitting::SurfaceArea`](super::Splitting)) until a leaf is small enough. One ray, one box and one
//! prim at a time: `fast-bvh` is the same with eight of each.

mod check;
pub mod tree;

use self::tree::{Stack, Tree};
use super::query::{Culling, Goal, Query};
use super::slabs::BoxRay;
use super::wide::split::Item;
use super::{Probe, Shapes};

/// Prims of a leaf where nothing else is asked for.
pub const LEAF_SIZE: u32 = 2;

/// The hierarchy.
#[derive(Clone, Debug)]
pub struct Bvh<'a> {
    shapes: &'a Shapes,
    /// Its root is node 0; there is none without bounded prims.
    tree: Tree,
}

impl<'a> Bvh<'a> {
    /// Builds it over the bounded prims, leaves of at most `leaf_size`; the same for every number of threads.
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
