//! Reading pictures back, for differences and checks: PNG and EXR.

use super::metadata::kind_of;
use super::{FileKind, ImageError, Picture, exr, png};
use std::path::Path;

/// Pixels that [`read_picture`] takes at most.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Reads a PNG or EXR file into premultiplied linear pixels.
pub fn read_picture(path: &Path) -> Result<Picture, ImageError> {
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    decode(&bytes, MAX_PIXELS)
}

/// Reads the bytes of a PNG or EXR file, the kind found by content; more than `max_pixels` are refused before memory
/// is taken for them.
pub fn decode(bytes: &[u8], max_pixels: u64) -> Result<Picture, ImageError> {
    match kind_of(bytes) {
        Some(FileKind::Png) => png::decode(bytes, max_pixels),
        Some(FileKind::Exr) => exr::decode(bytes, max_pixels),
        _ => Err(ImageError::NotAPicture),
    }
}

pub(super) fn check_size(kind: FileKind, width: u32, height: u32, max_pixels: u64) -> Result<(), ImageError> {
    if u64::from(width) * u64::from(height) > max_pixels {
        let reason = format!("{width}×{height} are more than the {max_pixels} pixels allowed");
        return Err(ImageError::decode(kind, reason));
    }
    Ok(())
}
