//! Arrays with random access, in large pages where the system grants them.
//!
//! Rays visit the nodes of a tree in no order, and lookups the texels of a texture. A processor caches the addresses of some
//! thousand pages (its TLB): an array of many megabytes misses there almost always, and pages of two megabytes instead of
//! four kilobytes avoid that. Linux grants them on request where `/sys/kernel/mm/transparent_hugepage/enabled` says
//! `madvise` or `always`; elsewhere these are ordinary arrays.
//!
//! For arrays that are written and read once from end to end large pages do not pay (measured: loading and building took
//! longer): two megabytes are cleared at once, long before the last of them is written. Pictures are decoded into them all
//! the same, since rays look up their texels until the render ends.
//!
//! Nor do they pay where memory must first be fetched: a virtual machine that reports free memory to its host (Linux, free
//! page reporting) has given away exactly the memory that large pages are made of, and gets it back in small pieces. That
//! takes 20 times as long as clearing it (measured: 4.5 ms a page instead of 0.2), whereas small pages are made of memory that
//! was in use before. So a few large pages of an array are made first as a trial, and no more of any once slow ones have taken
//! longer than [`allow`] permits: what they are worth depends on how many rays will be sent.

use std::fmt;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use bytemuck::Pod;
use memmap2::MmapMut;

/// Size of a large page, in bytes.
const PAGE: usize = 1 << 21;

/// Smallest number of bytes that a large page is requested for, also for the remainder at the end: at most twice the memory is
/// used.
const WORTH_PAGE: usize = PAGE / 2;

/// Processor time beyond which making a large page counts as dear: twice as long as making small ones in its place.
const DEAR: Duration = Duration::from_micros(1500);

/// Largest number of pages of an array that are made before it is written to: every eighth, or fewer of a larger one. Making
/// all of them takes longer, as they have left the caches by the time they are written, and takes memory that may stay unused.
#[cfg(target_os = "linux")]
const TRIED: usize = 16;

/// Processor time that dear pages may still take, in nanoseconds.
static ALLOWANCE: AtomicU64 = AtomicU64::new(20_000_000);

/// Sets the processor time that dear large pages may take from now on, all of them together; 20 ms until the first call.
pub fn allow(time: Duration) {
    let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
    ALLOWANCE.store(nanoseconds.max(1), Ordering::Relaxed);
}

/// Array of a fixed number of `T`.
pub struct Paged<T> {
    memory: Memory<T>,
    len: usize,
}

enum Memory<T> {
    Usual(Vec<T>),
    Large(Large),
}

impl<T: Pod> Paged<T> {
    /// Array of `len` zeros.
    pub fn zeroed(len: usize) -> Self {
        let is_worth_it = |bytes: &usize| *bytes >= WORTH_PAGE && ALLOWANCE.load(Ordering::Relaxed) > 0;
        let bytes = len.checked_mul(size_of::<T>()).filter(is_worth_it);
        let large = bytes.and_then(|bytes| Large::new(bytes, DEAR, &ALLOWANCE));
        Self { memory: large.map_or_else(|| Memory::Usual(bytemuck::zeroed_vec(len)), Memory::Large), len }
    }
}

/// Memory map with large pages.
struct Large {
    map: MmapMut,
    /// Offset of the first large page in the map, in bytes.
    start: usize,
}

#[cfg(target_os = "linux")]
impl Large {
    /// Allocates `bytes` bytes if the system has large pages. A page that takes longer than `dear` to make is dear; once dear
    /// pages have used up the allowance, the array gets small pages.
    fn new(bytes: usize, dear: Duration, allowance: &AtomicU64) -> Option<Self> {
        use crate::stopwatch::Stopwatch;
        use memmap2::Advice;
        let whole = if bytes % PAGE >= WORTH_PAGE { bytes.checked_next_multiple_of(PAGE)? } else { bytes };
        // The bytes before the first large page and behind the last are never written, so they take no memory.
        let mut map = MmapMut::map_anon(whole.checked_add(PAGE)?).ok()?;
        let start = map.as_ptr().align_offset(PAGE);
        map.advise_range(Advice::HugePage, start, whole).ok()?;
        let apart = (whole / PAGE / TRIED).max(8);
        let are_dear = map[start..][..whole].chunks_exact_mut(PAGE).step_by(apart).any(|page| {
            let watch = Stopwatch::of_this_thread();
            // The system makes a page on the first write to it.
            page[0] = 0;
            let took = watch.read().cpu;
            took > dear && !spend(allowance, took)
        });
        if are_dear {
            map.advise_range(Advice::NoHugePage, start, whole).ok()?;
        }
        Some(Self { map, start })
    }
}

/// Takes `time` out of an allowance; returns whether any is left.
#[cfg(target_os = "linux")]
fn spend(allowance: &AtomicU64, time: Duration) -> bool {
    let nanoseconds = u64::try_from(time.as_nanos()).unwrap_or(u64::MAX);
    let less = |left: u64| Some(left.saturating_sub(nanoseconds));
    allowance.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_ok_and(|left| left > nanoseconds)
}

#[cfg(not(target_os = "linux"))]
impl Large {
    fn new(_bytes: usize, _dear: Duration, _allowance: &AtomicU64) -> Option<Self> {
        None
    }
}

impl<T> From<Vec<T>> for Paged<T> {
    /// Wraps the vector without copying it.
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
            // `start` is a multiple of the page size and the length fits the items: the cast cannot fail.
            Memory::Large(Large { map, start }) => {
                bytemuck::cast_slice(&map[*start..*start + self.len * size_of::<T>()])
            }
        }
    }
}

impl<T: Pod> DerefMut for Paged<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.memory {
            Memory::Usual(items) => items,
            Memory::Large(Large { map, start }) => {
                bytemuck::cast_slice_mut(&mut map[*start..*start + self.len * size_of::<T>()])
            }
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

    /// Item as large as a node.
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
            if let Memory::Large(_) = bytes.memory {
                assert_eq!(bytes.as_ptr().align_offset(PAGE), 0);
            }
        }
        assert!(matches!(Paged::<u8>::zeroed(WORTH_PAGE - 1).memory, Memory::Usual(_)));
    }

    /// Size of the part of the map that is in large pages, in kibibytes.
    #[cfg(target_os = "linux")]
    fn kibibytes_in_large_pages(large: &Large) -> u64 {
        let from = format!("{:x}-", large.map.as_ptr().addr() + large.start);
        let maps = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let of_map = maps.lines().skip_while(|line| !line.starts_with(&from));
        let found = of_map.into_iter().find_map(|line| line.strip_prefix("AnonHugePages:")).unwrap();
        found.trim().strip_suffix("kB").unwrap().trim().parse().unwrap()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn where_the_allowance_ends_pages_are_small() {
        let allowance = AtomicU64::new(1);
        // A kernel without large pages refuses.
        let Some(mut dear) = Large::new(4 * PAGE, Duration::ZERO, &allowance) else { return };
        assert_eq!(allowance.load(Ordering::Relaxed), 0);
        dear.map[dear.start..].chunks_mut(4096).for_each(|page| page[0] = 1);
        assert!(kibibytes_in_large_pages(&dear) <= 2048);
        let allowance = AtomicU64::new(u64::MAX);
        let Some(mut cheap) = Large::new(4 * PAGE, Duration::ZERO, &allowance) else { return };
        assert!((1..u64::MAX).contains(&allowance.load(Ordering::Relaxed)));
        cheap.map[cheap.start..].chunks_mut(4096).for_each(|page| page[0] = 1);
        let [made, granted] = [&cheap, &dear].map(kibibytes_in_large_pages);
        assert!(made == 4 * 2048 || granted == 0, "{made} where {granted} were granted");
    }
}
