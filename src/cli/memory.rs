//! How the process deals with memory that it gave back.

use std::hint::black_box;

/// Has the C library keep what is freed, to be used again, up to 64 MiB of it in each of its arenas.
///
/// Loading, building and tracing each work in large buffers of their own, and a buffer of more than 128 KiB is a mapping that
/// glibc hands back to the system when it is freed: the next one comes as new pages that the system must clear, a tenth of
/// the time of a picture of 200,000 triangles with a sample a pixel. How large a buffer must be for that grows with those
/// that are freed, up to 32 MiB (`M_MMAP_THRESHOLD` in the manual page of `mallopt`); so one of that size, of which no page
/// is ever touched, is freed first. With any other C library this is one reservation.
pub(super) fn keep_freed() {
    /// The largest that counts, with room for what the library notes beside it.
    const LARGEST: usize = (32 << 20) - (64 << 10);
    let mut untouched = Vec::<u8>::new();
    // Where so much cannot be had, memory is handed back as before.
    let _ = untouched.try_reserve_exact(LARGEST);
    drop(black_box(untouched));
}
