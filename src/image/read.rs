//! Reading pictures back, for differences and checks.

use super::metadata::kind_of;
use super::{FileKind, ImageError, Picture, exr, photo, png};
use std::path::Path;

/// Pixels that [`read_picture`] takes at most.
pub const MAX_PIXELS: u64 = 1 << 28;

/// Reads a picture file into premultiplied linear pixels.
pub fn read_picture(path: &Path) -> Result<Picture, ImageError> {
    read_picture_and_kind(path).map(|(picture, _)| picture)
}

/// The same, and what kind of file it is.
pub fn read_picture_and_kind(path: &Path) -> Result<(Picture, FileKind), ImageError> {
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    let kind = kind_of(&bytes).ok_or(ImageError::NotAPicture)?;
    decode(&bytes, MAX_PIXELS).map(|picture| (picture, kind))
}

/// Reads the bytes of a picture file, the kind found by content; more than `max_pixels` are refused before memory is
/// taken for them.
pub fn decode(bytes: &[u8], max_pixels: u64) -> Result<Picture, ImageError> {
    match kind_of(bytes).ok_or(ImageError::NotAPicture)? {
        FileKind::Png => png::decode(bytes, max_pixels),
        FileKind::Exr => exr::decode(bytes, max_pixels),
        kind @ (FileKind::Jpeg | FileKind::Webp) => photo::decode(bytes, kind, max_pixels),
    }
}

pub(super) fn check_size(kind: FileKind, width: u32, height: u32, max_pixels: u64) -> Result<(), ImageError> {
    if u64::from(width) * u64::from(height) > max_pixels {
        let reason = format!("{width}×{height} are more than the {max_pixels} pixels allowed");
        return Err(ImageError::decode(kind, reason));
    }
    Ok(())
}
