//! Blocks as packets from one place see them, kept from packet to packet: those that follow each other visit the same
//! leaves, and what is found of eight triangles before a ray is looked at is the same for all.

use super::node::Block;
use crate::math::Vec3;
use crate::math::fan::{Fan, FanReady};
use crate::math::sight::Rows;
use crate::math::simd::{LANES, Lanewise, Row, Simd};

/// Blocks that are kept, each in the place that its number says: as much as stays in the first cache beside a packet.
const PLACES: usize = 16;

/// No block.
const NONE: u32 = u32::MAX;

/// From where blocks are seen: the origin, the main axis and the octant.
type CacheKey = (Vec3, usize, usize);

/// Blocks that were visited lately.
#[derive(Clone, Debug)]
pub(super) struct BlockCache {
    key: CacheKey,
    /// Which block is in a place.
    blocks: [u32; PLACES],
    kept: Box<[CachedBlock; PLACES]>,
}

/// A block.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct CachedBlock {
    /// The boxes of its triangles: planes in the order of a node's.
    pub planes: [Row; 6],
    /// What a fan sees of them.
    pub ready: FanReady,
}

impl Default for BlockCache {
    fn default() -> Self {
        let kept = CachedBlock { planes: [[0.0; LANES]; 6], ready: FanReady::EMPTY };
        Self { key: (Vec3::ZERO, 0, 0), blocks: [NONE; PLACES], kept: Box::new([kept; PLACES]) }
    }
}

impl BlockCache {
    /// Forgets all blocks.
    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.blocks = [NONE; PLACES];
    }

    /// From now on blocks are seen from here; those that were seen from elsewhere are forgotten.
    #[inline(always)]
    pub(super) fn sit(&mut self, key: CacheKey) {
        if self.key != key {
            self.key = key;
            self.clear();
        }
    }

    /// Puts a block into its place, if it is not there.
    #[inline(always)]
    pub(super) fn place<S: Simd, T: Lanewise<N>, const N: usize>(
        &mut self,
        s: S,
        (index, block): (u32, &Block),
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

    /// What is in a place.
    #[inline(always)]
    pub(super) fn at(&self, place: usize) -> &CachedBlock {
        &self.kept[place % PLACES]
    }
}
