//! Equal places -> one vertex each, numbered in the order in which they are first met.
//!
//! Corners are dealt by a hash of their place to tables that fit a processor's own cache, and threads fill these side by
//! side: a table for all would miss the cache at nearly every corner. The hash has a seed of its own in each run, so that no
//! file can be made whose places meet in one slot; numbers do not depend on it.

use crate::load::geometry::plain_mesh::PlainMesh;
use bytemuck::Pod;
use rayon::prelude::*;
use std::hash::{BuildHasher, RandomState};
use std::ops::Range;
use std::sync::atomic::AtomicU32;
use std::sync::atomic::Ordering::Relaxed;
use xxhash_rust::xxh3::xxh3_64_with_seed;

/// The vertices that places become.
#[derive(Clone, Debug, Default)]
pub(super) struct Welded {
    /// The corner where each vertex is first met.
    pub firsts: Vec<u32>,
    /// The vertex of each corner.
    pub vertices: Vec<u32>,
}

/// The most corners.
pub(super) const LARGEST: usize = PlainMesh::LARGEST as usize;

/// Marks the number of a vertex at the corner where it is first met; without it a number is that of such a corner.
const FIRST: u32 = 1 << 31;

/// Corners that one thread deals at a time.
const DEALT: usize = 1 << 16;

/// Corners of a table, about.
const TABLE: usize = 1 << 13;

/// The most tables, as powers of two.
const TABLES: u32 = 12;

/// Bytes that a corner takes until vertices are known; slots take little beside, since tables are many.
pub(super) const fn cost<P>() -> u64 {
    (size_of::<Card<P>>() + 3 * size_of::<u32>()) as u64
}

/// Makes one vertex of all corners whose places are equal. There are at most [`LARGEST`].
pub(super) fn weld<P: Pod + Eq + Send + Sync>(corners: usize, place: impl Fn(usize) -> P + Sync) -> Welded {
    let hash = Hash { seed: RandomState::new().hash_one(0), bits: (corners / TABLE).max(1).ilog2().min(TABLES) };
    let hands: Vec<Hand<P>> = (0..corners.div_ceil(DEALT))
        .into_par_iter()
        .map(|part| Hand::deal(part * DEALT..corners.min((part + 1) * DEALT), &place, &hash))
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

/// Where a place belongs.
struct Hash {
    seed: u64,
    /// Of the number of a table.
    bits: u32,
}

impl Hash {
    fn of<P: Pod>(&self, place: &P) -> u64 {
        xxh3_64_with_seed(bytemuck::bytes_of(place), self.seed)
    }

    /// The table of a place.
    fn table<P: Pod>(&self, place: &P) -> usize {
        // As wide as it may be, the shift leaves nothing.
        self.of(place).checked_shr(u64::BITS - self.bits).unwrap_or(0) as usize
    }

    /// Where it is looked for first among so many slots, a power of two; by other bits than those of the table.
    #[expect(clippy::cast_possible_truncation, reason = "what is cut off is masked anyway")]
    fn slot<P: Pod>(&self, place: &P, slots: usize) -> usize {
        self.of(place) as usize & (slots - 1)
    }
}

/// A place, and a corner there.
#[derive(Clone, Copy)]
struct Card<P> {
    place: P,
    corner: u32,
}

impl<P: Pod> Card<P> {
    /// That of no corner.
    fn none() -> Self {
        Self { place: P::zeroed(), corner: u32::MAX }
    }

    fn is_none(&self) -> bool {
        self.corner == u32::MAX
    }
}

/// Corners that follow each other, sorted by table.
struct Hand<P> {
    cards: Vec<Card<P>>,
    /// Where the cards of each table begin, and the end.
    starts: Vec<u32>,
}

impl<P: Pod> Hand<P> {
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
        let mut cards = vec![Card::none(); tables.len()];
        for ((place, corner), table) in places.zip(corners).zip(tables) {
            let at = &mut next[table as usize];
            cards[*at as usize] = Card { place, corner: corner as u32 };
            *at += 1;
        }
        Self { cards, starts }
    }

    fn of_table(&self, table: usize) -> &[Card<P>] {
        &self.cards[self.starts[table] as usize..self.starts[table + 1] as usize]
    }
}

/// The first card of each place of a table, where it is looked for; never more than half full.
struct Slots<P> {
    slots: Vec<Card<P>>,
    places: usize,
}

impl<P: Pod + Eq> Slots<P> {
    /// With room for a table, or for so many corners.
    fn new(corners: usize) -> Self {
        let room = 2 * corners.clamp(1, TABLE).next_power_of_two();
        Self { slots: vec![Card::none(); room], places: 0 }
    }

    fn clear(&mut self) {
        self.slots.fill(Card::none());
        self.places = 0;
    }

    /// The corner that was first met where this card is; its own if none was.
    fn first(&mut self, card: Card<P>, hash: &Hash) -> u32 {
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

    /// The slot of a place, or the empty one where it belongs.
    fn find(&self, card: &Card<P>, hash: &Hash) -> usize {
        let mut at = hash.slot(&card.place, self.slots.len());
        while !self.slots[at].is_none() && self.slots[at].place != card.place {
            at = (at + 1) & (self.slots.len() - 1);
        }
        at
    }

    fn double(&mut self, hash: &Hash) {
        let twice = vec![Card::none(); 2 * self.slots.len()];
        let before = std::mem::replace(&mut self.slots, twice);
        for card in before.into_iter().filter(|card| !card.is_none()) {
            let at = self.find(&card, hash);
            self.slots[at] = card;
        }
    }
}

/// Numbers the corners that are the first in their places, and gives the others the same numbers.
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
        // 15,000 different ones are more than a table has room for at first.
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
