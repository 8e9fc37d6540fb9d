//! Traversal of the tree of a placed object by a ray of the scene.
//!
//! Boxes are tested in the object's frame, triangles in the scene's: [`ObjectTransform`] has the proof that no hit is lost.

use super::node::{Block, Child, Tree};
use super::padded::PaddedSlabs;
use super::slabs::{BoxMargins, Derived};
use super::walk::{Entry, Stack, nearest, pop};
use super::{Culling, Wide};
use crate::accel::Probe;
use crate::accel::instances::ObjectTransform;
use crate::accel::probe::{Extent, NodeId, Visit};
use crate::accel::query::{Goal, Query};
use crate::math::bounds::{BOX_RANGE, PARALLEL, PLACED_DRIFT, PLACED_PAD};
use crate::math::shear::RaySpace;
use crate::math::simd::{Kernel, LANES, Simd};
use crate::math::triangles::{RayLanes, reach};

impl Wide<'_> {
    /// Tests at least every triangle that the ray hits within its reach, of an object of triangles at `place` whose triangles
    /// are numbered from `first` on; returns whether that answered the query. Uses the exact test, and does not ask whether a
    /// triangle is wanted.
    pub(in crate::accel) fn walk_placed<G: Goal, P: Probe>(
        &self,
        place: &ObjectTransform,
        first: u32,
        query: &mut Query<G>,
        stack: &mut Stack,
        probe: &mut P,
    ) -> bool {
        let (tree, stack) = (&self.tree(), &mut *stack.entries);
        if tree.nodes.is_empty() {
            return false;
        }
        let slabs = slabs_of(tree, place, &query.ray, query.t_min);
        let (spot, shapes) = (Spot { place, first }, self.shapes());
        let visit = |child: u32| {
            let visit = tree.visit(child, shapes);
            let extent = match &visit.extent {
                Extent::Box(bounds) => Extent::Box(place.around(bounds)),
                other => *other,
            };
            let at = match visit.place {
                NodeId::Block(block) => NodeId::PlacedBlock(first, block),
                NodeId::Node(node) => NodeId::PlacedNode(first, node),
                other => other,
            };
            Visit { place: at, extent, ..visit }
        };
        self.level.run_narrow(Descent { tree, spot, slabs, query, stack, probe, visit })
    }
}

/// Place of an object, and the number of its first triangle.
#[derive(Clone, Copy)]
struct Spot<'w> {
    place: &'w ObjectTransform,
    first: u32,
}

/// Padded slabs of a ray of the scene in the frame of a placed object; `None` if its numbers are too large or too small
/// there.
fn slabs_of(tree: &Tree, place: &ObjectTransform, ray: &RaySpace, t_min: f32) -> Option<PaddedSlabs> {
    let (origin, dir) = (place.carried(ray.origin).as_vec3(), place.carried_dir(ray.dir).as_vec3());
    let (far, size) = (origin.abs(), dir.abs());
    let extent = tree.extent + place.room.max_element();
    let (whole, length) = (extent + far.element_sum(), size.element_sum());
    // False for NaN.
    let within = |x: f32| (1.0 / BOX_RANGE..=BOX_RANGE).contains(&x);
    if !(within(whole) && within(length) && t_min >= 0.0) {
        return None;
    }
    let parallel = size.max_element() * PARALLEL;
    let mut slabs = PaddedSlabs { from: Derived::started(t_min).max(0.0), ..PaddedSlabs::default() };
    for k in 0..3 {
        let inverse = 1.0 / size[k].max(parallel).copysign(dir[k]);
        let pad = place.room[k] + (extent + far[k]) * PLACED_PAD + whole * PLACED_DRIFT;
        let (middle, pad) = (-origin[k] * inverse, pad * inverse.abs());
        (slabs.inverse[k], slabs.first[k], slabs.last[k]) = (inverse, middle - pad, middle + pad);
        slabs.octant |= u32::from(dir[k].is_sign_negative()) << k;
    }
    Some(slabs)
}

struct Descent<'w, 'q, G: Goal, P, V> {
    tree: &'w Tree<'w>,
    spot: Spot<'w>,
    slabs: Option<PaddedSlabs>,
    query: &'w mut Query<'q, G>,
    stack: &'w mut [Entry],
    probe: &'w mut P,
    /// Makes the record of a visit to a child.
    visit: V,
}

impl<G: Goal, P: Probe, V: Fn(u32) -> Visit> Kernel for Descent<'_, '_, G, P, V> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Self { tree, spot, slabs, query, stack, probe, visit } = self;
        let lanes = RayLanes::new(s, &query.ray, reach(query.ray.origin, &spot.place.bounds));
        let Some(slabs) = slabs else {
            for block in tree.blocks {
                if test(s, spot, block, &lanes, query, probe) {
                    return true;
                }
            }
            return false;
        };
        let slabs = slabs.spread(s);
        let mut limit = Derived::widened(query.reach());
        let (mut node, mut top) = (0, 0);
        loop {
            probe.step();
            probe.visit(|| visit(node));
            probe.volume_tests(LANES);
            let (near, met) = slabs.meets(s, &tree.nodes[node as usize], limit);
            let mut child = if met != 0 {
                nearest(s, &tree.nodes[node as usize], near, met, stack, &mut top)
            } else {
                pop(stack, &mut top, limit).unwrap_or(Child::END)
            };
            while Child::is_leaf(child) {
                let Some(block) = tree.blocks.get(Child::block(child).0 as usize) else { return false };
                probe.step();
                probe.visit(|| visit(child));
                probe.cell(false);
                if test(s, spot, block, &lanes, query, probe) {
                    return true;
                }
                limit = Derived::widened(query.reach());
                child = pop(stack, &mut top, limit).unwrap_or(Child::END);
            }
            node = child;
        }
    }
}

/// Tests the triangles of a block in the scene's frame, and returns whether the query is answered.
#[inline(always)]
fn test<S: Simd, G: Goal, P: Probe>(
    s: S,
    Spot { place, first }: Spot,
    block: &Block,
    lanes: &RayLanes<S>,
    query: &mut Query<G>,
    probe: &mut P,
) -> bool {
    let corners = place.block(s, &block.corners);
    let verdicts = lanes.verdicts(s, &corners);
    let mut prims = block.prims;
    let mut count = 0;
    for prim in &mut prims {
        // Unused lanes come last.
        count += u32::from(*prim != crate::accel::NO_PRIM);
        *prim = prim.wrapping_add(first);
    }
    probe.transforms(3 * count as usize);
    query.test_wanted_block(&prims, &corners, count, verdicts, probe)
}
