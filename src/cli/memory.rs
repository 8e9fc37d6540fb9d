//! Handling of freed memory in the process.

use std::hint::black_box;

/// Makes the C library keep freed memory for reuse, up to 64 MiB in each of its arenas.
///
/// Loading, building and tracing each work in large buffers of their own. glibc maps a buffer of more than 128 KiB separately and
/// returns it to the system when it is freed; the next one then consists of new pages that the system must clear, a tenth of the
/// time of a picture of 200,000 triangles with one sample per pixel. The threshold grows with the size of freed buffers, up to 32
/// MiB (`M_MMAP_THRESHOLD` in the manual page of `mallopt`); so a buffer of that size, of which no page is ever touched, is freed
/// first. With any other C library this is one reservation.
pub(super) fn keep_freed() {
    /// Largest size that raises the threshold, with room for the library's own bookkeeping.
    const LARGEST: usize = (32 << 20) - (64 << 10);
    let mut untouched = Vec::<u8>::new();
    // If the reservation fails, freed memory is returned to the system as before.
    let _ = untouched.try_reserve_exact(LARGEST);
    drop(black_box(untouched));
}
