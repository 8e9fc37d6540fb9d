//! Reading whole files into memory.

use std::fs::File;
use std::io::{self, Read};

/// Size from which on files are read by all threads, in bytes.
const LARGE: u64 = 1 << 22;

/// Reads a file whose length was `length` and may have grown: at most `most` + 1 bytes, so that the caller can detect excess.
///
/// # Errors
/// I/O errors.
pub(super) fn read(file: File, length: u64, most: u64) -> io::Result<Vec<u8>> {
    if (LARGE..=most).contains(&length)
        && rayon::current_num_threads() > 1
        && let Some(bytes) = read_in_parts(&file, length)
    {
        return Ok(bytes);
    }
    read_in_turn(file, length, most)
}

/// Reads a whole file by this thread alone; parameters as for [`read`].
///
/// # Errors
/// I/O errors.
pub(super) fn read_in_turn(file: File, length: u64, most: u64) -> io::Result<Vec<u8>> {
    // Capacity for one byte more than the file has, so that reading to the end does not reallocate.
    let mut bytes = Vec::with_capacity(usize::try_from(length).map_or(0, |length| length.saturating_add(1)));
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads all parts of a file in parallel; `None` where it must be read sequentially.
#[cfg(unix)]
fn read_in_parts(file: &File, length: u64) -> Option<Vec<u8>> {
    use rayon::prelude::*;
    use std::os::unix::fs::FileExt;
    /// Bytes that one thread reads at a time.
    const PART: usize = 1 << 20;

    let mut bytes = vec![0; usize::try_from(length).ok()?];
    let starts = (0..).step_by(PART);
    let parts: Vec<(u64, &mut [u8])> = starts.zip(bytes.chunks_mut(PART)).collect();
    let read = |(start, part): (u64, &mut [u8])| file.read_exact_at(part, start).is_ok();
    let complete = parts.into_par_iter().with_max_len(1).all(read);
    // A file that is being written may have grown.
    let ends = matches!(file.read_at(&mut [0], length), Ok(0));
    (complete && ends).then_some(bytes)
}

#[cfg(not(unix))]
fn read_in_parts(_: &File, _: u64) -> Option<Vec<u8>> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn a_large_file_is_read_in_parts_as_it_is_from_start_to_end() {
        let bytes: Vec<u8> = (0..LARGE as u32 + 12_345).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(&bytes).unwrap();
        let length = bytes.len() as u64;
        let read = |threads, length, most| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| super::read(File::open(file.path()).unwrap(), length, most)).unwrap()
        };
        for threads in [1, 3] {
            assert!(read(threads, length, u64::MAX) == bytes);
            // The file grew or shrank after its length was read.
            assert!(read(threads, length - 7, u64::MAX) == bytes);
            assert!(read(threads, length + 7, u64::MAX) == bytes);
            assert!(read(threads, length, length - 9) == bytes[..bytes.len() - 8]);
        }
    }
}
