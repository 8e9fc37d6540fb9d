//! What can go wrong between pixels and files.

use super::FileKind;
use std::path::PathBuf;

/// Why a picture could not be encoded or read. One line each; the caller adds the file where none is named.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The extension names no picture type we write.
    #[error("{}: picture type {extension} is not known; use {}", path.display(), FileKind::extensions())]
    UnknownKind {
        /// The output path as given.
        path: PathBuf,
        /// Its extension with the dot and quotes, or `(no extension)`.
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
        /// Largest side of the format.
        limit: u32,
    },
    /// The arrays of the picture do not fit its size.
    #[error("the picture is {width}×{height}, but {array} has {len} values")]
    Shape {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Which array.
        array: &'static str,
        /// Its length.
        len: usize,
    },
    /// The metadata do not fit the format.
    #[error("{kind} holds at most {limit} bytes of metadata, there are {len}; use .png or .exr")]
    MetadataTooLong {
        /// The format.
        kind: FileKind,
        /// Bytes wanted.
        len: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// The encoder refused.
    #[error("could not encode {kind}: {reason}")]
    Encode {
        /// The format.
        kind: FileKind,
        /// What the encoder said.
        reason: String,
    },
    /// The bytes are not a picture of this kind, or a broken one.
    #[error("not a readable {kind} picture: {reason}")]
    Decode {
        /// The format.
        kind: FileKind,
        /// What is wrong.
        reason: String,
    },
    /// The bytes are no picture that can be read here.
    #[error("neither a PNG, EXR, JPEG nor a WebP picture")]
    NotAPicture,
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
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
