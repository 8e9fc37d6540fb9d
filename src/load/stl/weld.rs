//! Welds corners at equal positions into one vertex each, numbered in the order of first occurrence.
//!
//! Corners are partitioned by a hash of their position into tables that fit a processor's own cache, and threads fill the
//! tables in parallel: a single table would miss the cache at nearly every corner. The hash has a random seed in each run, so
//! that no file can be crafted whose positions collide; vertex numbers do not depend on it.

use crate::load::geometry::plain_mesh::PlainMesh;
use bytemuck::Pod;
use rayon::prelude::*;
use std::hash::{BuildHasher, RandomState};
use std::ops::Range;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// The vertices of all corners.
#[derive(Clone, Debug, Default)]
pub(super) struct Welded {
    /// First corner of each vertex.
    pub firsts: Vec<u32>,
    /// Vertex of each corner.
    pub vertices: Vec<u32>,
}

/// Largest number of corners.
pub(super) const LARGEST: usize = PlainMesh::LARGEST as usize;

/// Marks the vertex number of a first corner; entries without it are the number of the first corner at the same position.
const FIRST: u32 = 1 << 31;

/// Corners that one task partitions.
const DEALT: usize = 1 << 16;

/// Average number of corners of a table.
const TABLE: usize = 1 << 13;

/// Base-two logarithm of the largest number of tables.
const TABLES: u32 = 12;

/// Bytes that a corner takes during welding; the slots take little beside, since tables are many.
pub(super) const fn cost<P>() -> u64 {
    (size_of::<PositionEntry<P>>() + 3 * size_of::<u32>()) as u64
}

/// Makes one vertex of all corners with equal positions. There are at most [`LARGEST`] corners.
pub(super) fn weld<P: Pod + Eq + Send + Sync>(corners: usize, place: impl Fn(usize) -> P + Sync) -> Welded {
    let hash = Hash { seed: RandomState::new().hash_one(0), bits: (corners / TABLE).max(1).ilog2().min(TABLES) };
    let hands: Vec<SortedRun<P>> = (0..corners.div_ceil(DEALT))
        .into_par_iter()
        .map(|part| SortedRun::deal(part * DEALT..corners.min((part + 1) * DEALT), &place, &hash))
        .collect();
    let first: Vec<AtomicU32> = (0..corners).into_par_iter().map(|_| AtomicU32::new(0)).collect();
    let fill = |slots: &mut Slots<P>, table| {
        slots.clear();
        for card in hands.iter().flat_map(|hand| hand.of_table(table)) {
            first[card.corner as usize].store(slots.first(*card, &hash), Relaxed);
        }
    };
    (0..1 << hash.bits).into_par_iter().for_each_init(|| Slots::new(corners), fill);
    drop(hands);
    number(&first)
}

/// Maps positions to tables and slots.
struct Hash {
    seed: u64,
    /// Number of bits of a table's number.
    bits: u32,
}

impl Hash {
    fn of<P: Pod>(&self, place: &P) -> u64 {
        xxh3_64_with_seed(bytemuck::bytes_of(place), self.seed)
    }

    /// Table of a position.
    fn table<P: Pod>(&self, place: &P) -> usize {
        // For a single table the shift is by all bits, and leaves 0.
        self.of(place).checked_shr(u64::BITS - self.bits).unwrap_or(0) as usize
    }

    /// First slot to probe among `slots`, a power of two; uses other bits of the hash than the table.
    #[expect(clippy::cast_possible_truncation, reason = "what is cut off is masked anyway")]
    fn slot<P: Pod>(&self, place: &P, slots: usize) -> usize {
        self.of(place) as usize & (slots - 1)
    }
}

/// A position, and a corner there.
#[derive(Clone, Copy)]
struct PositionEntry<P> {
    place: P,
    corner: u32,
}

impl<P: Pod> PositionEntry<P> {
    /// Marks an empty slot.
    fn none() -> Self {
        Self { place: P::zeroed(), corner: u32::MAX }
    }

    fn is_none(&self) -> bool {
        self.corner == u32::MAX
    }
}

/// Consecutive corners, sorted by table.
struct SortedRun<P> {
    cards: Vec<PositionEntry<P>>,
    /// Start of the cards of each table, and the end.
    starts: Vec<u32>,
}

impl<P: Pod> SortedRun<P> {
    #[expect(clippy::cast_possible_truncation, reason = "corners are few enough")]
    fn deal(corners: Range<usize>, place: &impl Fn(usize) -> P, hash: &Hash) -> Self {
        let places = corners.clone().map(place);
        let tables: Vec<u16> = places.clone().map(|place| hash.table(&place) as u16).collect();
        let mut starts = vec![0u32; (1 << hash.bits) + 1];
        tables.iter().for_each(|&table| starts[table as usize + 1] += 1);
        let mut sum = 0;
        starts.iter_mut().for_each(|start| {
            sum += *start;
            *start = sum;
        });
        let mut next = starts.clone();
        let mut cards = vec![PositionEntry::none(); tables.len()];
        for ((place, corner), table) in places.zip(corners).zip(tables) {
            let at = &mut next[table as usize];
            cards[*at as usize] = PositionEntry { place, corner: corner as u32 };
            *at += 1;
        }
        Self { cards, starts }
    }

    fn of_table(&self, table: usize) -> &[PositionEntry<P>] {
        &self.cards[self.starts[table] as usize..self.starts[table + 1] as usize]
    }
}

/// Hash table with open addressing: the first card of each position of a table; at most half full.
struct Slots<P> {
    slots: Vec<PositionEntry<P>>,
    places: usize,
}

impl<P: Pod + Eq> Slots<P> {
    /// Table with room for [`TABLE`] corners, or for `corners` if fewer.
    fn new(corners: usize) -> Self {
        let room = 2 * corners.clamp(1, TABLE).next_power_of_two();
        Self { slots: vec![PositionEntry::none(); room], places: 0 }
    }

    fn clear(&mut self) {
        self.slots.fill(PositionEntry::none());
        self.places = 0;
    }

    /// First corner at the position of this card; the card's own if there was none before.
    fn first(&mut self, card: PositionEntry<P>, hash: &Hash) -> u32 {
        let at = self.find(&card, hash);
        if !self.slots[at].is_none() {
            return self.slots[at].corner;
        }
        self.slots[at] = card;
        self.places += 1;
        if 2 * self.places > self.slots.len() {
            self.double(hash);
        }
        card.corner
    }

    /// Slot of a position, or the empty slot where it belongs.
    fn find(&self, card: &PositionEntry<P>, hash: &Hash) -> usize {
        let mut at = hash.slot(&card.place, self.slots.len());
        while !self.slots[at].is_none() && self.slots[at].place != card.place {
            at = (at + 1) & (self.slots.len() - 1);
        }
        at
    }

    fn double(&mut self, hash: &Hash) {
        let twice = vec![PositionEntry::none(); 2 * self.slots.len()];
        let before = std::mem::replace(&mut self.slots, twice);
        for card in before.into_iter().filter(|card| !card.is_none()) {
            let at = self.find(&card, hash);
            self.slots[at] = card;
        }
    }
}

/// Numbers the first corners of all positions, and gives the other corners the number of their first.
#[expect(clippy::cast_possible_truncation, reason = "corners are few enough")]
fn number(first: &[AtomicU32]) -> Welded {
    let firsts_of = |(part, corners): (usize, &[AtomicU32])| -> Vec<u32> {
        let own = (part * DEALT) as u32..;
        own.zip(corners).filter(|(corner, first)| first.load(Relaxed) == *corner).map(|(corner, _)| corner).collect()
    };
    let parts: Vec<Vec<u32>> = first.par_chunks(DEALT).enumerate().map(firsts_of).collect();
    let firsts = parts.concat();
    firsts.par_iter().zip(0..firsts.len() as u32).for_each(|(&corner, number)| {
        first[corner as usize].store(FIRST | number, Relaxed);
    });
    let vertex = |own: &AtomicU32| {
        let own = own.load(Relaxed);
        let marked = if own & FIRST == 0 { first[own as usize].load(Relaxed) } else { own };
        marked & !FIRST
    };
    let vertices = first.par_iter().map(vertex).collect();
    Welded { firsts, vertices }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use std::collections::HashMap;

    #[test]
    fn vertices_are_numbered_as_they_are_first_met_whatever_the_number_of_corners() {
        let mut random = Random::new(5);
        // 15,000 positions are more than a table initially has room for.
        for (corners, places) in
            [(0, 1), (1, 1), (5, 2), (1000, 1), (15_000, 1 << 24), (70_000, 40_000), (300_000, 1 << 20)]
        {
            let place: Vec<[u32; 3]> = (0..corners).map(|_| [(random.unit() * places as f32) as u32, 7, 0]).collect();
            let mut known = HashMap::new();
            let (mut firsts, mut vertices) = (Vec::new(), Vec::new());
            for (corner, place) in (0..).zip(&place) {
                let new = firsts.len() as u32;
                let number = *known.entry(*place).or_insert(new);
                if number == new {
                    firsts.push(corner);
                }
                vertices.push(number);
            }
            let welded = weld(corners, |corner| place[corner]);
            assert!(welded.firsts == firsts && welded.vertices == vertices, "{corners} {places}");
            let wide = weld(corners, |corner| place[corner].map(u64::from));
            assert!(wide.firsts == firsts && wide.vertices == vertices, "{corners} {places}");
        }
    }
}
