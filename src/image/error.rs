//! Errors of reading and writing pictures.

use super::FileKind;
use std::path::PathBuf;

/// Why a picture could not be encoded or read. One line each; the caller adds the file where none is named.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The extension names no picture type that is written here.
    #[error("{}: picture type {extension} is not known; use {}", path.display(), FileKind::extensions())]
    UnknownKind {
        /// The output path as given.
        path: PathBuf,
        /// Extension of the path with the dot and quotes, or `(no extension)`.
        extension: String,
    },
    /// More columns or rows than the format can hold.
    #[error("{kind} holds at most {limit}×{limit} pixels, the picture has {width}×{height}; use .png or .exr")]
    TooLarge {
        /// The format.
        kind: FileKind,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
        /// Largest side that the format holds.
        limit: u32,
    },
    /// An array of the picture does not fit its size.
    #[error("the picture is {width}×{height}, but {array} has {len} values")]
    Shape {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Name of the array.
        array: &'static str,
        /// Length of the array.
        len: usize,
    },
    /// The metadata does not fit the format.
    #[error("{kind} holds at most {limit} bytes of metadata, there are {len}; use .png or .exr")]
    MetadataTooLong {
        /// The format.
        kind: FileKind,
        /// Size of the metadata, in bytes.
        len: usize,
        /// Largest size, in bytes.
        limit: usize,
    },
    /// The encoder failed.
    #[error("could not encode {kind}: {reason}")]
    Encode {
        /// The format.
        kind: FileKind,
        /// Message of the encoder.
        reason: String,
    },
    /// The bytes are not a picture of this kind, or are damaged.
    #[error("not a readable {kind} picture: {reason}")]
    Decode {
        /// The format.
        kind: FileKind,
        /// Message of the decoder, or what is wrong.
        reason: String,
    },
    /// The bytes are not a picture of any kind that is read here.
    #[error("neither a PNG, EXR, JPEG nor a WebP picture")]
    NotAPicture,
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The I/O error.
        source: std::io::Error,
    },
}

impl ImageError {
    pub(super) fn encode(kind: FileKind, reason: impl std::fmt::Display) -> Self {
        Self::Encode { kind, reason: reason.to_string() }
    }

    pub(super) fn decode(kind: FileKind, reason: impl std::fmt::Display) -> Self {
        Self::Decode { kind, reason: reason.to_string() }
    }
}
