//! Rows of fixed size in a binary file, which threads read in parallel.

use super::header::{Element, Encoding, Kind};
use rayon::prelude::*;

/// Number of rows per parallel task.
const ROWS: usize = 1 << 12;

/// The rows of an element.
pub(super) struct Packed<'a> {
    bytes: &'a [u8],
    big: bool,
    /// Offset of each property in a row; the last entry is the length of a row.
    starts: Vec<usize>,
}

impl<'a> Packed<'a> {
    /// Rows at the beginning of `bytes`, given that every list has `in_lists` values (`None`: no lists). `None` for text files,
    /// and where `bytes` is too short.
    pub(super) fn of(element: &Element, encoding: Encoding, bytes: &'a [u8], in_lists: Option<usize>) -> Option<Self> {
        if encoding == Encoding::Text || element.properties.is_empty() {
            return None;
        }
        let mut starts = vec![0];
        let mut size = 0usize;
        for property in &element.properties {
            let values = if property.length.is_some() { in_lists? } else { 1 };
            size += property.length.map_or(0, Kind::size) + values * property.kind.size();
            starts.push(size);
        }
        let length = usize::try_from(element.count).ok()?.checked_mul(size)?;
        Some(Self { bytes: bytes.get(..length)?, big: encoding == Encoding::BigEndian, starts })
    }

    /// Length of all rows, in bytes.
    pub(super) fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Offset of a property in each row.
    pub(super) fn start(&self, property: usize) -> usize {
        self.starts[property]
    }

    /// Maps every row.
    pub(super) fn each<T: Send>(&self, make: impl Fn(Record) -> T + Sync + Send) -> Vec<T> {
        self.rows().map(make).collect()
    }

    /// Whether all rows satisfy a predicate.
    pub(super) fn all(&self, are: impl Fn(Record) -> bool + Sync + Send) -> bool {
        self.rows().all(are)
    }

    fn rows(&self) -> impl IndexedParallelIterator<Item = Record<'a>> {
        let (big, size) = (self.big, self.starts[self.starts.len() - 1]);
        self.bytes.par_chunks_exact(size).with_min_len(ROWS).map(move |bytes| Record { bytes, big })
    }
}

/// Bytes of one row.
#[derive(Clone, Copy)]
pub(super) struct Record<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl Record<'_> {
    /// Number at offset `at`, which lies in the row.
    #[inline]
    pub(super) fn value(self, at: usize, kind: Kind) -> f64 {
        self.bytes.get(at..).and_then(|bytes| kind.value(bytes, self.big)).unwrap_or(f64::NAN)
    }
}
