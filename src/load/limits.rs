//! Bounds that are checked before memory is taken.

/// Largest sizes a file may ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes all of loading may take (`--max-memory`).
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
