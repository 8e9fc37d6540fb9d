//! Limits that are checked before memory is allocated.

use super::diagnostic::RAISE_MEMORY;

/// Largest sizes that a file may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes that loading may take altogether (`--max-memory`).
    pub memory: u64,
    /// Bytes of one file.
    pub file: u64,
    /// Pixels of one image.
    pub image_pixels: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 8 << 30, file: 4 << 30, image_pixels: 1 << 28 }
    }
}

impl Limits {
    /// Remedy for a file that is too large: more memory, unless the limit of a file does not depend on it.
    pub(super) fn remedy_for_file(&self) -> &'static str {
        if self.file == self.memory { RAISE_MEMORY } else { "split it" }
    }
}

/// Memory that may still be allocated.
///
/// Loaders take from it before they allocate anything whose size a file decides; a file of a few bytes cannot make them
/// allocate gigabytes beyond the limit.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    total: u64,
    left: u64,
}

/// A request that exceeded the budget.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{asked} bytes are needed where {left} of {total} are left")]
pub struct OverBudget {
    /// Bytes requested.
    pub asked: u64,
    /// Bytes that were left.
    pub left: u64,
    /// The whole budget.
    pub total: u64,
}

impl Budget {
    /// Budget of [`Limits::memory`] bytes.
    pub fn new(limits: &Limits) -> Self {
        Self { total: limits.memory, left: limits.memory }
    }

    /// Bytes left.
    pub fn left(&self) -> u64 {
        self.left
    }

    /// Takes `count` elements of `size` bytes from the budget.
    pub fn take(&mut self, count: u64, size: u64) -> Result<(), OverBudget> {
        let asked = count.saturating_mul(size);
        let over = OverBudget { asked, left: self.left, total: self.total };
        self.left = self.left.checked_sub(asked).ok_or(over)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_spent_once_and_never_overflows() {
        let mut budget = Budget::new(&Limits { memory: 100, ..Limits::default() });
        assert!(budget.take(6, 10).is_ok());
        assert_eq!(budget.take(6, 10), Err(OverBudget { asked: 60, left: 40, total: 100 }));
        assert!(budget.take(u64::MAX, u64::MAX).is_err());
        assert!(budget.take(4, 10).is_ok());
        assert!(budget.take(1, 1).is_err());
    }
}
