//! Cache of blocks as seen by packets from one origin: consecutive packets visit the same leaves, and the data prepared from
//! eight triangles before any ray is tested is the same for all of them.

use super::node::Block;
use crate::math::Vec3;
use crate::math::fan::{Fan, FanReady};
use crate::math::sight::Rows;
use crate::math::simd::{LANES, Lanewise, Row, Simd};

/// Number of cached blocks, direct-mapped by their indices: as many as stay in the first-level cache beside a packet.
const PLACES: usize = 16;

/// Marks an empty slot.
const NONE: u32 = u32::MAX;

/// Viewpoint of the cached blocks: origin, main axis and octant.
type CacheKey = (Vec3, usize, usize);

/// Recently visited blocks.
#[derive(Clone, Debug)]
pub(super) struct BlockCache {
    key: CacheKey,
    /// Index of the block in each slot.
    blocks: [u32; PLACES],
    kept: Box<[CachedBlock; PLACES]>,
}

/// A prepared block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct CachedBlock {
    /// Boxes of its triangles: planes in the order of a node's.
    pub planes: [Row; 6],
    /// Block data prepared for a fan.
    pub ready: FanReady,
}

impl Default for BlockCache {
    fn default() -> Self {
        let kept = CachedBlock { planes: [[0.0; LANES]; 6], ready: FanReady::EMPTY };
        Self { key: (Vec3::ZERO, 0, 0), blocks: [NONE; PLACES], kept: Box::new([kept; PLACES]) }
    }
}

impl BlockCache {
    /// Removes all blocks.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.blocks = [NONE; PLACES];
    }

    /// Sets the viewpoint, and removes blocks prepared for another one.
    #[inline(always)]
    pub(super) fn set_viewpoint(&mut self, key: CacheKey) {
        if self.key != key {
            self.key = key;
            self.clear();
        }
    }

    /// Prepares a block in its slot, unless it is already there, and returns the slot.
    #[inline(always)]
    pub(super) fn place<S: Simd, T: Lanewise<N>, const N: usize>(
        &mut self,
        s: S,
        index: u32,
        block: &Block,
        fan: &Fan<T, N>,
    ) -> usize {
        let place = index as usize % PLACES;
        if self.blocks[place] != index {
            self.blocks[place] = index;
            let kept = &mut self.kept[place];
            let [a, b, c] = &block.corners;
            for k in 0..3 {
                let (a, b, c) = (s.load(&a[k]), s.load(&b[k]), s.load(&c[k]));
                kept.planes[2 * k] = s.store(s.smaller(a, s.smaller(b, c)));
                kept.planes[2 * k + 1] = s.store(s.greater(a, s.greater(b, c)));
            }
            kept.ready = fan.ready(s, &block.corners);
        }
        place
    }

    /// Block in a slot.
    #[inline(always)]
    pub(super) fn at(&self, place: usize) -> &CachedBlock {
        &self.kept[place % PLACES]
    }
}
