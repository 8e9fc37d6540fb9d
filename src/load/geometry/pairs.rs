//! Numbers pairs of (position, key) in the order met: turns corners into vertices, mostly without hashing.

use std::collections::HashMap;
use std::hash::Hash;

/// A table from (position, key) to 0, 1, 2, …
///
/// Keys of one position form a chain, short because few different corners meet at one position; where very many do, as at
/// the pole of a fan, the later ones are hashed.
#[derive(Debug)]
pub(super) struct Pairs<K> {
    /// First entry of each position's chain.
    head: Vec<u32>,
    /// Position, key, and the next entry of the chain.
    entries: Vec<(u32, K, u32)>,
    /// Numbers of the pairs whose positions had a full chain of [`LONGEST`] entries.
    hashed: HashMap<(u32, K), u32>,
}

const END: u32 = u32::MAX;

/// Largest length of a chain.
const LONGEST: usize = 64;

impl<K: Copy + Eq + Hash> Pairs<K> {
    /// An empty table for positions below `positions`.
    pub(super) fn new(positions: usize) -> Self {
        Self { head: vec![END; positions], entries: Vec::new(), hashed: HashMap::new() }
    }

    /// Number of a pair; a new pair gets the next number.
    pub(super) fn number(&mut self, position: u32, key: K) -> u32 {
        let mut at = self.head[position as usize];
        let mut length = 0;
        while at != END {
            let (_, known, next) = self.entries[at as usize];
            if known == key {
                return at;
            }
            (at, length) = (next, length + 1);
        }
        #[expect(clippy::cast_possible_truncation, reason = "there are fewer pairs than corners, which fit into u32")]
        let new = self.entries.len() as u32;
        if length >= LONGEST {
            let number = *self.hashed.entry((position, key)).or_insert(new);
            if number == new {
                self.entries.push((position, key, END));
            }
            return number;
        }
        self.entries.push((position, key, self.head[position as usize]));
        self.head[position as usize] = new;
        new
    }

    /// All pairs, in the order of their numbers.
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, K)> {
        self.entries.iter().map(|&(position, key, _)| (position, key))
    }

    /// Number of pairs.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Removes all pairs, in time proportional to their number.
    pub(super) fn clear(&mut self) {
        for (position, ..) in self.entries.drain(..) {
            self.head[position as usize] = END;
        }
        self.hashed.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pairs_share_a_number_until_the_table_is_cleared() {
        let mut pairs = Pairs::new(3);
        let numbers: Vec<_> = [(2, 'a'), (0, 'a'), (2, 'b'), (2, 'a')].map(|(p, k)| pairs.number(p, k)).into();
        assert_eq!(numbers, [0, 1, 2, 0]);
        assert_eq!(pairs.iter().collect::<Vec<_>>(), [(2, 'a'), (0, 'a'), (2, 'b')]);
        pairs.clear();
        assert_eq!((pairs.len(), pairs.number(2, 'b')), (0, 0));
    }

    #[test]
    fn a_position_of_very_many_keys_takes_little_time_and_keeps_their_order() {
        let mut pairs = Pairs::new(2);
        let start = std::time::Instant::now();
        for _ in 0..2 {
            for key in 0..300_000 {
                assert_eq!(pairs.number(1, key), key);
            }
        }
        assert_eq!(pairs.iter().nth(200_000), Some((1, 200_000)));
        assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
        pairs.clear();
        assert_eq!((pairs.number(1, 299_999), pairs.number(0, 5)), (0, 1));
    }
}
