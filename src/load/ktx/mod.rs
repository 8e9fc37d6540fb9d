//! KTX 2.0 pictures (Khronos, *KTX File Format Specification*, version 2) -> [`Bitmap`]: flat ones, their largest level.
//!
//! Pixels are Basis Universal (ETC1S, UASTC), blocks (BC1, BC3, BC7) or plain bytes; levels may be packed with Zstandard. Every
//! length is compared with the size of the picture before anything is unpacked. Values stay as stored: whoever uses a picture
//! decides whether they are sRGB-coded.
//!
//! Four libraries decode the pixels, behind the feature `basisu`; their panics on damaged files that pass our checks are caught.

#[cfg(feature = "basisu")]
mod blocks;
#[cfg(feature = "basisu")]
mod container;
#[cfg(all(test, feature = "basisu"))]
pub(super) mod tests;

use crate::scene::Bitmap;

/// First bytes of a KTX 2.0 file.
const START: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Returns whether these are the bytes of a KTX 2.0 file.
pub(super) fn is(bytes: &[u8]) -> bool {
    bytes.starts_with(START)
}

/// Size of a picture, and memory that decoding takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bytes of intermediate data between the file and the pixels.
    pub between: u64,
}

/// Reads only the header.
///
/// # Errors
/// What is wrong with the header, or why the pixels cannot be read.
#[cfg(feature = "basisu")]
pub(super) fn size(bytes: &[u8]) -> Result<Size, String> {
    caught(|| container::Container::read(bytes).map(|container| container.size()))
}

/// Decodes the largest level; the caller has checked [`size`].
///
/// # Errors
/// What is wrong with the file.
#[cfg(feature = "basisu")]
pub(super) fn decode(name: &str, bytes: &[u8]) -> Result<Bitmap, String> {
    caught(|| {
        let container = container::Container::read(bytes)?;
        let Size { width, height, .. } = container.size();
        Ok(Bitmap { name: name.into(), width, height, pixels: container.pixels()? })
    })
}

/// Turns a panic of one of the libraries into a fault of the file.
#[cfg(feature = "basisu")]
fn caught<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    crate::catch_panic::attempt(work).unwrap_or_else(|| Err("it is KTX2, and damaged".into()))
}

#[cfg(not(feature = "basisu"))]
const MISSING: &str = "it is KTX2 (compressed for GPUs); build meshray with the feature 'basisu' to read it";

/// Stub without the feature: names it in the error.
#[cfg(not(feature = "basisu"))]
pub(super) fn size(_: &[u8]) -> Result<Size, String> {
    Err(MISSING.into())
}

/// Stub without the feature: names it in the error.
#[cfg(not(feature = "basisu"))]
pub(super) fn decode(_: &str, _: &[u8]) -> Result<Bitmap, String> {
    Err(MISSING.into())
}
