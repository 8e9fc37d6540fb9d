//! Lists that are written in place before it is known how many of the written items count.

use std::ops::{Deref, DerefMut};

/// A list with spare room behind its end, left over from earlier use, so that making room costs nothing.
#[derive(Debug)]
pub(super) struct Tail<T> {
    /// The items that count, and the spare room.
    items: Vec<T>,
    len: usize,
}

impl<T> Default for Tail<T> {
    fn default() -> Self {
        Self { items: Vec::new(), len: 0 }
    }
}

impl<T: Copy> Tail<T> {
    /// Returns room for `N` more items, of which [`Self::grow`] keeps some; new room is filled with `empty`.
    pub(super) fn room<const N: usize>(&mut self, empty: T) -> &mut [T; N] {
        let end = self.len + N;
        if self.items.len() < end {
            self.items.resize(end.next_power_of_two(), empty);
        }
        // The resize above has made sure of `N` items.
        let Some(room) = self.items[self.len..].first_chunk_mut() else { unreachable!("{end} are there") };
        room
    }

    /// Keeps the first `count` items of the room, at most all of it.
    pub(super) fn grow(&mut self, count: usize) {
        self.len = (self.len + count).min(self.items.len());
    }

    pub(super) fn push(&mut self, item: T) {
        let [place] = self.room(item);
        *place = item;
        self.len += 1;
    }

    pub(super) fn clear(&mut self) {
        self.len = 0;
    }
}

impl<T> Deref for Tail<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.items[..self.len]
    }
}

impl<T> DerefMut for Tail<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.items[..self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_taken_of_the_room_stays_and_the_rest_is_written_again() {
        let mut tail = Tail::default();
        tail.push(1);
        tail.room::<4>(0).copy_from_slice(&[2, 3, 4, 5]);
        tail.grow(2);
        tail.push(6);
        assert_eq!(*tail, [1, 2, 3, 6]);
        tail.clear();
        assert!(tail.is_empty());
        tail.push(7);
        assert_eq!(*tail, [7]);
    }
}
