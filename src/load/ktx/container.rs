//! The container: its header, and the bytes of its largest level.

use super::Size;
use super::blocks::{Layout, pixels_of};
use crate::scene::Pixels;
use ::basisu::{DecodeFlags, TargetFormat, Transcoder};
use ::ktx2::{ColorModel, Format, Reader, SupercompressionScheme};
use std::borrow::Cow;
use std::io::Read;

/// A file whose header is valid.
pub(super) struct Container<'a> {
    reader: Reader<&'a [u8]>,
    width: u32,
    height: u32,
    content: Content,
    is_packed: bool,
}

/// How pixels are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    /// Basis Universal; the library reads the container itself.
    Basis,
    /// Pixels or blocks in this layout, once unpacked.
    Plain(Layout),
}

impl<'a> Container<'a> {
    /// Reads the header and checks the lengths that it states.
    ///
    /// # Errors
    /// What is wrong with the header, or why the pixels cannot be read.
    pub(super) fn read(bytes: &'a [u8]) -> Result<Self, String> {
        let reader = Reader::new(bytes).map_err(|e| format!("its KTX2 header is damaged: {e}"))?;
        let header = reader.header();
        let (width, height) = (header.pixel_width, header.pixel_height);
        if height == 0 || header.pixel_depth > 0 || header.layer_count > 1 || header.face_count != 1 {
            return Err("it is KTX2, but no flat picture: a row, a volume, a list or a cube".into());
        }
        let (content, layout) = content(&reader)?;
        let is_packed = match (header.supercompression_scheme, layout.is_some()) {
            (None, true) | (Some(SupercompressionScheme::BasisLZ), false) => false,
            (Some(SupercompressionScheme::Zstandard), true) => true,
            (None, false) => return Err("its ETC1S data is not packed by BasisLZ, as it must be".into()),
            (Some(other), _) => return Err(format!("it is KTX2 packed by {other:?}, which is not supported")),
        };
        let first = reader.levels().next().ok_or("it holds no picture")?;
        if let Some(expected) = layout.map(|layout| layout.bytes(width, height)) {
            let found = if is_packed { first.uncompressed_byte_length } else { first.data.len() as u64 };
            if found != expected {
                return Err(format!("it has {found} bytes of pixels where {width}×{height} take {expected}"));
            }
        }
        Ok(Self { width, height, content, is_packed, reader })
    }

    /// Size of the picture, and memory that decoding takes.
    pub(super) fn size(&self) -> Size {
        let (width, height) = (self.width, self.height);
        let stored = match self.content {
            // The unpacked blocks, and the decoded pixels before they are copied.
            Content::Basis => Layout::Blocks16.bytes(width, height) + u64::from(width) * u64::from(height) * 4,
            Content::Plain(layout) => layout.bytes(width, height),
        };
        Size { width, height, between: stored }
    }

    /// Decodes the largest level.
    pub(super) fn pixels(&self) -> Result<Pixels, String> {
        match self.content {
            Content::Basis => self.transcoded(),
            Content::Plain(layout) => {
                let expected = layout.bytes(self.width, self.height);
                pixels_of(layout, &self.unpacked(expected)?, self.width, self.height)
            }
        }
    }

    fn transcoded(&self) -> Result<Pixels, String> {
        let fault = |e: ::basisu::Error| format!("its Basis data cannot be read: {e:?}");
        let transcoder = Transcoder::new(self.reader.data()).map_err(fault)?;
        let texels = transcoder.transcode(0, TargetFormat::Rgba32, DecodeFlags::NONE).map_err(fault)?;
        if texels.len() as u64 != u64::from(self.width) * u64::from(self.height) * 4 {
            return Err("its Basis data is damaged".into());
        }
        let texels = texels.as_chunks::<4>().0;
        Ok(match transcoder.has_alpha() {
            true => Pixels::Rgba8(texels.to_vec().into()),
            false => Pixels::Rgb8(texels.iter().flat_map(|&[r, g, b, _]| [r, g, b]).collect()),
        })
    }

    /// Returns the bytes of the largest level, unpacked: `expected` bytes.
    fn unpacked(&self, expected: u64) -> Result<Cow<'_, [u8]>, String> {
        let level = self.reader.levels().next().map_or(&[][..], |level| level.data);
        if !self.is_packed {
            return Ok(Cow::Borrowed(level));
        }
        let fault = |e: &dyn std::fmt::Display| format!("its Zstandard data cannot be read: {e}");
        let decoder = ::ruzstd::StreamingDecoder::new(level).map_err(|e| fault(&e))?;
        let mut out = Vec::new();
        decoder.take(expected.saturating_add(1)).read_to_end(&mut out).map_err(|e| fault(&e))?;
        if out.len() as u64 == expected {
            return Ok(Cow::Owned(out));
        }
        Err(format!("its Zstandard data gives not the {expected} bytes that its header claims"))
    }
}

/// Content of a file, and layout of its level once unpacked; `None` for ETC1S, whose length depends on the data.
fn content(reader: &Reader<&[u8]>) -> Result<(Content, Option<Layout>), String> {
    let Some(format) = reader.header().format else {
        return match reader.color_model() {
            Some(ColorModel::ETC1S) => Ok((Content::Basis, None)),
            Some(ColorModel::UASTC) => Ok((Content::Basis, Some(Layout::Blocks16))),
            Some(other) => Err(format!("it is KTX2 of the colour model {other:?}, which is not supported")),
            None => Err("it is KTX2 that does not say of what colour model it is".into()),
        };
    };
    let layout = match format {
        Format::R8G8B8_UNORM | Format::R8G8B8_SRGB => Layout::Rgb,
        Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => Layout::Rgba,
        Format::BC1_RGB_UNORM_BLOCK | Format::BC1_RGB_SRGB_BLOCK => Layout::Bc1 { alpha: false },
        Format::BC1_RGBA_UNORM_BLOCK | Format::BC1_RGBA_SRGB_BLOCK => Layout::Bc1 { alpha: true },
        Format::BC3_UNORM_BLOCK | Format::BC3_SRGB_BLOCK => Layout::Bc3,
        Format::BC7_UNORM_BLOCK | Format::BC7_SRGB_BLOCK => Layout::Bc7,
        other => return Err(format!("it is KTX2 of the format {other:?}, which is not supported")),
    };
    Ok((Content::Plain(layout), Some(layout)))
}
