//! Reading pictures back, for differences and checks.

use super::metadata::kind_of;
use super::{FileKind, ImageError, Picture, exr, photo, png};
use std::path::Path;

/// Largest number of pixels that [`read_picture`] takes.
pub const MAX_PIXELS: u64 = 1 << 28;

/// A decoded picture file.
#[derive(Clone, Debug)]
pub struct PictureFile {
    /// Premultiplied linear pixels, and the layers of an EXR.
    pub picture: Picture,
    /// Kind of the file.
    pub kind: FileKind,
    /// Contents that were not read, in words: parts and channels of an EXR.
    pub left_out: Vec<String>,
}

/// Reads a picture file into premultiplied linear pixels.
pub fn read_picture(path: &Path) -> Result<Picture, ImageError> {
    read_picture_file(path).map(|file| file.picture)
}

/// Reads a picture file, with its kind and descriptions of what was not read.
pub fn read_picture_file(path: &Path) -> Result<PictureFile, ImageError> {
    let bytes = std::fs::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    decode_file(&bytes, MAX_PIXELS)
}

/// Decodes the bytes of a picture file, its kind found by content; more than `max_pixels` are refused before memory is
/// allocated for them.
pub fn decode(bytes: &[u8], max_pixels: u64) -> Result<Picture, ImageError> {
    decode_file(bytes, max_pixels).map(|file| file.picture)
}

fn decode_file(bytes: &[u8], max_pixels: u64) -> Result<PictureFile, ImageError> {
    let kind = kind_of(bytes).ok_or(ImageError::NotAPicture)?;
    let (picture, left_out) = match kind {
        FileKind::Png => (png::decode(bytes, max_pixels)?, Vec::new()),
        FileKind::Exr => exr::decode(bytes, max_pixels)?,
        FileKind::Jpeg | FileKind::Webp => (photo::decode(bytes, kind, max_pixels)?, Vec::new()),
    };
    Ok(PictureFile { picture, kind, left_out })
}

pub(super) fn check_size(kind: FileKind, width: u32, height: u32, max_pixels: u64) -> Result<(), ImageError> {
    if u64::from(width) * u64::from(height) > max_pixels {
        let reason = format!("{width}×{height} are more than the {max_pixels} pixels allowed");
        return Err(ImageError::decode(kind, reason));
    }
    Ok(())
}
