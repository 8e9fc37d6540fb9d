//! Rows of a binary file that all take the same bytes, which threads read side by side.

use super::header::{Element, Encoding, Kind};
use rayon::prelude::*;

/// Rows that one thread reads at a time.
const ROWS: usize = 1 << 12;

/// The rows of an element.
pub(super) struct Packed<'a> {
    bytes: &'a [u8],
    big: bool,
    /// Where each property begins in a row; behind them its length.
    starts: Vec<usize>,
}

impl<'a> Packed<'a> {
    /// Those at the beginning of `bytes`, if every list had `in_lists` values (`None`: no lists). `None` of a text, and where
    /// there are not so many bytes.
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

    /// Bytes of all of them.
    pub(super) fn length(&self) -> usize {
        self.bytes.len()
    }

    /// Where in each row this property begins.
    pub(super) fn start(&self, property: usize) -> usize {
        self.starts[property]
    }

    /// What is made of each row.
    pub(super) fn each<T: Send>(&self, make: impl Fn(Record) -> T + Sync + Send) -> Vec<T> {
        self.rows().map(make).collect()
    }

    /// Whether all rows are so.
    pub(super) fn all(&self, are: impl Fn(Record) -> bool + Sync + Send) -> bool {
        self.rows().all(are)
    }

    fn rows(&self) -> impl IndexedParallelIterator<Item = Record<'a>> {
        let (big, size) = (self.big, self.starts[self.starts.len() - 1]);
        self.bytes.par_chunks_exact(size).with_min_len(ROWS).map(move |bytes| Record { bytes, big })
    }
}

/// The bytes of one row.
#[derive(Clone, Copy)]
pub(super) struct Record<'a> {
    bytes: &'a [u8],
    big: bool,
}

impl Record<'_> {
    /// The number that begins there; it lies in the row.
    #[inline]
    pub(super) fn value(self, at: usize, kind: Kind) -> f64 {
        self.bytes.get(at..).and_then(|bytes| kind.value(bytes, self.big)).unwrap_or(f64::NAN)
    }
}
