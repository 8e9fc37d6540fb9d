//! The picture types that are written, and how a path names one.

use super::ImageError;
use std::fmt;
use std::path::Path;

/// A picture type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FileKind {
    /// PNG: sRGB, 8 or 16 bit, straight alpha, lossless.
    Png,
    /// OpenEXR: linear, half or float, premultiplied alpha, layers.
    Exr,
    /// JPEG: sRGB, 8 bit, no alpha, lossy.
    Jpeg,
    /// WebP: sRGB, 8 bit, straight alpha, lossless.
    Webp,
}

impl FileKind {
    /// Every kind.
    pub const ALL: [Self; 4] = [Self::Png, Self::Exr, Self::Jpeg, Self::Webp];

    /// Kind named by a path's extension, in upper or lower case.
    pub fn from_path(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let known = extension.as_deref().and_then(Self::from_extension);
        known.ok_or_else(|| ImageError::UnknownKind {
            path: path.to_owned(),
            extension: extension.map_or_else(|| "(no extension)".to_owned(), |e| format!("\".{e}\"")),
        })
    }

    /// Kind of a lower-case extension without its dot.
    pub fn from_extension(extension: &str) -> Option<Self> {
        match extension {
            "png" => Some(Self::Png),
            "exr" => Some(Self::Exr),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            "webp" => Some(Self::Webp),
            _ => None,
        }
    }

    /// The usual extension, without a dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
            Self::Jpeg => "jpg",
            Self::Webp => "webp",
        }
    }

    /// Checks that the format can hold a picture of this size.
    ///
    /// # Errors
    /// [`ImageError::TooLarge`] with the largest side that the format's size fields hold.
    pub fn fits(self, width: u32, height: u32) -> Result<(), ImageError> {
        let limit = match self {
            Self::Png | Self::Exr => return Ok(()),
            Self::Jpeg => 65_535,
            Self::Webp => 16_384,
        };
        if width > limit || height > limit {
            return Err(ImageError::TooLarge { kind: self, width, height, limit });
        }
        Ok(())
    }

    /// Whether the format keeps transparency.
    pub fn has_alpha(self) -> bool {
        self != Self::Jpeg
    }

    /// Every known extension, for messages.
    pub fn extensions() -> &'static str {
        ".png, .exr, .jpg, .jpeg or .webp"
    }
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Exr => "EXR",
            Self::Jpeg => "JPEG",
            Self::Webp => "WebP",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_decides_whatever_its_case() {
        for (name, kind) in [
            ("a.png", FileKind::Png),
            ("dir.exr/a.PNG", FileKind::Png),
            ("a.b.Exr", FileKind::Exr),
            ("a.jpg", FileKind::Jpeg),
            ("a.JPEG", FileKind::Jpeg),
            ("a.webp", FileKind::Webp),
        ] {
            assert_eq!(FileKind::from_path(Path::new(name)).unwrap(), kind, "{name}");
        }
    }

    #[test]
    fn an_unknown_extension_lists_the_known_ones() {
        for (name, said) in [("a.tif", "\".tif\""), ("png", "(no extension)"), (".png", "(no extension)")] {
            let message = FileKind::from_path(Path::new(name)).unwrap_err().to_string();
            assert!(message.contains(said) && message.contains(".webp"), "{message}");
        }
    }
}
