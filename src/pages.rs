//! Arrays that are read anywhere, in large pages where the system gives them.
//!
//! Rays visit the nodes of a tree in no order, and lookups the texels of a texture. A processor keeps the places of some
//! thousand pages at hand: of an array of many megabytes it looks up most of them, and pages of two megabytes instead of
//! four kilobytes spare that. Linux grants them on request where `/sys/kernel/mm/transparent_hugepage/enabled` says
//! `madvise` or `always`; elsewhere these are arrays like others.
//!
//! For arrays that are written and read once from end to end large pages do not pay (measured: loading and building took
//! longer): two megabytes are cleared at once, long before the last of them is written. Pictures are decoded into them all
//! the same, since lookups read them for as long as the picture takes.

use std::fmt;
use std::ops::{Deref, DerefMut};

use bytemuck::Pod;
use memmap2::MmapMut;

/// Bytes of a large page.
const PAGE: usize = 1 << 21;

/// A large page is asked for from this many bytes on, and so it is for what is left over at the end: no more than twice the
/// memory.
const WORTH_PAGE: usize = PAGE / 2;

/// A fixed number of `T`.
pub struct Paged<T> {
    memory: Memory<T>,
    len: usize,
}

enum Memory<T> {
    Usual(Vec<T>),
    /// In a map of its own, from this byte on.
    Large(MmapMut, usize),
}

impl<T: Pod> Paged<T> {
    /// So many zeros.
    pub fn zeroed(len: usize) -> Self {
        let large = len.checked_mul(size_of::<T>()).and_then(large);
        let memory = large.unwrap_or_else(|| Memory::Usual(bytemuck::zeroed_vec(len)));
        Self { memory, len }
    }
}

/// Room for so many bytes in large pages, if it takes some and the system has them.
fn large<T>(bytes: usize) -> Option<Memory<T>> {
    if !cfg!(target_os = "linux") || bytes < WORTH_PAGE {
        return None;
    }
    let whole = if bytes % PAGE >= WORTH_PAGE { bytes.checked_next_multiple_of(PAGE)? } else { bytes };
    // Nothing is ever written to what lies before the first large page and behind the last: it takes no memory.
    let map = MmapMut::map_anon(whole.checked_add(PAGE)?).ok()?;
    let start = map.as_ptr().align_offset(PAGE);
    #[cfg(target_os = "linux")]
    map.advise_range(memmap2::Advice::HugePage, start, whole).ok()?;
    Some(Memory::Large(map, start))
}

impl<T> From<Vec<T>> for Paged<T> {
    /// What is there already stays where it is.
    fn from(items: Vec<T>) -> Self {
        Self { len: items.len(), memory: Memory::Usual(items) }
    }
}

impl<T> FromIterator<T> for Paged<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Vec::from_iter(items).into()
    }
}

impl<T> Default for Paged<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T: Pod> Deref for Paged<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        match &self.memory {
            Memory::Usual(items) => items,
            // From a multiple of a page on, and as long as so many items: no cast can fail.
            Memory::Large(map, start) => bytemuck::cast_slice(&map[*start..*start + self.len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> DerefMut for Paged<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.memory {
            Memory::Usual(items) => items,
            Memory::Large(map, start) => bytemuck::cast_slice_mut(&mut map[*start..*start + self.len * size_of::<T>()]),
        }
    }
}

impl<T: Pod> Clone for Paged<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::zeroed(self.len);
        copy.copy_from_slice(self);
        copy
    }
}

impl<T: Pod + fmt::Debug> fmt::Debug for Paged<T> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_list().entries(&self[..]).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As large as a node.
    type Item = [u32; 64];

    #[test]
    fn arrays_of_every_size_hold_what_was_written_and_zeros_before() {
        let per_page = PAGE / size_of::<Item>();
        for len in [0, 1, per_page / 2, per_page * 3 / 4, per_page, per_page + 1, 3 * per_page - 1, 5 * per_page + 7] {
            let mut items = Paged::<Item>::zeroed(len);
            assert_eq!(items.len(), len);
            assert!(items.iter().flatten().all(|&word| word == 0), "{len}");
            (0..).zip(items.iter_mut()).for_each(|(i, item)| item[63] = i);
            let copy = items.clone();
            assert!(copy.iter().map(|item| item[63]).eq(0..len as u32), "{len}");
            assert_eq!(format!("{copy:?}"), format!("{:?}", copy.to_vec()));
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn large_arrays_begin_where_large_pages_do() {
        for bytes in [WORTH_PAGE, PAGE, 3 * PAGE + 5] {
            let bytes = Paged::<u8>::zeroed(bytes);
            // A kernel without large pages refuses.
            if let Memory::Large(..) = bytes.memory {
                assert_eq!(bytes.as_ptr().align_offset(PAGE), 0);
            }
        }
        assert!(matches!(Paged::<u8>::zeroed(WORTH_PAGE - 1).memory, Memory::Usual(_)));
    }
}
