//! Brute force in blocks: every triangle is tested, eight at a time, without any box.
//!
//! Answers like [`none`](crate::accel::none), but several times faster: the reference for other structures over many rays.

use super::node::Block;
use crate::accel::query::{Culling, Goal, Query};
use crate::accel::{Intersector, Probe, Shapes};
use crate::math::aabb::Aabb;
use crate::math::simd::{Kernel, LANES, Level, Simd};
use crate::math::triangles::{RayLanes, reach, set_corners};

/// All triangles, as blocks.
#[derive(Clone, Debug)]
pub struct Listed<'a> {
    shapes: &'a Shapes,
    blocks: Vec<Block>,
    bounds: Aabb,
    level: Level,
}

impl<'a> Listed<'a> {
    /// Creates blocks in the order of the prims.
    pub fn new(shapes: &'a Shapes) -> Self {
        let count = u32::try_from(shapes.triangles.len()).unwrap_or(u32::MAX);
        let block = |first: u32| {
            let mut block = Block::EMPTY;
            for (lane, prim) in (first..count).take(LANES).enumerate() {
                set_corners(&mut block.corners, lane, &shapes.triangle(prim));
                block.prims[lane] = prim;
            }
            block
        };
        let blocks = (0..count).step_by(LANES).map(block).collect();
        Self { shapes, blocks, bounds: Aabb::around(shapes.vertices.iter().copied()), level: Level::best() }
    }
}

impl Culling for Listed<'_> {
    type Scratch = ();

    fn shapes(&self) -> &Shapes {
        self.shapes
    }

    fn new_scratch(&self) {}

    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, (): &mut (), probe: &mut P) {
        self.level.run_narrow(All { listed: self, query, probe });
    }
}

struct All<'w, 'q, G: Goal, P> {
    listed: &'w Listed<'w>,
    query: &'w mut Query<'q, G>,
    probe: &'w mut P,
}

impl<G: Goal, P: Probe> Kernel for All<'_, '_, G, P> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { listed, query, probe } = self;
        let lanes = RayLanes::new(s, &query.ray, reach(query.ray.origin, &listed.bounds));
        let mut left = listed.shapes.triangles.len();
        for block in &listed.blocks {
            let count = left.min(LANES);
            left -= count;
            let answered = if G::Test::EXACT {
                query.test_block(&block.prims, &block.corners, count as u32, lanes.verdicts(s, &block.corners), probe)
            } else {
                block.prims[..count].iter().any(|&prim| query.test(prim, probe))
            };
            if answered {
                return;
            }
        }
        let others = listed.shapes.triangles.len() as u32..listed.shapes.bounded();
        let _ = others.into_iter().any(|prim| query.test(prim, probe));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::accel::{Accel, Hit, NoProbe, Unculled};

    #[test]
    fn blocks_in_a_row_answer_as_brute_force_does() {
        for (name, shapes) in scenes::all() {
            let (listed, brute) = (Listed::new(&shapes), Unculled::new(&shapes));
            let rays = scenes::rays(&shapes, 10);
            let mut hits = [vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]];
            let [a, b] = &mut hits;
            listed.closest(&rays, a, &mut (), &mut NoProbe);
            brute.closest(&rays, b, &mut (), &mut NoProbe);
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{name}");
            let mut occluded = [vec![false; rays.len()], vec![false; rays.len()]];
            let [a, b] = &mut occluded;
            listed.occluded(&rays, a, &mut (), &mut NoProbe);
            brute.occluded(&rays, b, &mut (), &mut NoProbe);
            assert_eq!(a, b, "{name}");
        }
    }
}
