//! JPEG (lossy, opaque) and WebP (lossless) files, 8-bit sRGB.

use super::develop::{Raster, raster};
use super::{FileKind, ImageError, Metadata, Output, Picture, exif, srgb};
use crate::jpeg;
use ::image::codecs::jpeg::JpegEncoder;
use ::image::codecs::webp::WebPEncoder;
use ::image::metadata::Orientation;
use ::image::{DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat, ImageReader};
use std::io::Cursor;

/// Room for EXIF in a JPEG's APP1 segment: 65 535 bytes less the length field and the six-byte identifier.
const JPEG_EXIF: usize = 65_535 - 2 - 6;

/// Encodes a JPEG file; transparent pictures are composited over white when no background is given.
pub(super) fn encode_jpeg(picture: &Picture, output: &Output, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    FileKind::Jpeg.fits(picture.width, picture.height)?;
    let exif = exif::write(metadata);
    if exif.len() > JPEG_EXIF {
        return Err(ImageError::MetadataTooLong { kind: FileKind::Jpeg, len: exif.len(), limit: JPEG_EXIF });
    }
    let opaque = Output { background: output.background.or(Some([1.0; 3])), ..output.clone() };
    let mut file = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut file, output.jpeg_quality.clamp(1, 100));
    finish(encoder, &raster(picture, &opaque), exif, FileKind::Jpeg)?;
    Ok(file)
}

/// Encodes a lossless WebP file.
pub(super) fn encode_webp(picture: &Picture, output: &Output, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    FileKind::Webp.fits(picture.width, picture.height)?;
    let mut file = Vec::new();
    let encoder = WebPEncoder::new_lossless(&mut file);
    finish(encoder, &raster(picture, output), exif::write(metadata), FileKind::Webp)?;
    Ok(file)
}

/// Reads a JPEG or WebP file, upright; at most `max_pixels`. A truncated JPEG is refused, as the decoder would invent the
/// missing part.
pub(super) fn decode(bytes: &[u8], kind: FileKind, max_pixels: u64) -> Result<Picture, ImageError> {
    if kind == FileKind::Jpeg && jpeg::is_cut_off(bytes) {
        let reason = format!("its {} bytes have no end; it was cut off", bytes.len());
        return Err(ImageError::decode(kind, reason));
    }
    let fail = |e: ::image::ImageError| ImageError::decode(kind, e);
    let format = if kind == FileKind::Webp { ImageFormat::WebP } else { ImageFormat::Jpeg };
    // Four bytes a pixel; the size is compared with `max_pixels` before any pixel is read.
    let mut limits = ::image::Limits::no_limits();
    limits.max_alloc = Some(max_pixels.saturating_mul(4));
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(limits.clone());
        reader
    };
    let (width, height) = reader().into_dimensions().map_err(fail)?;
    super::read::check_size(kind, width, height, max_pixels)?;
    let mut decoder = reader().into_decoder().map_err(fail)?;
    // Cameras record how they were held.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut upright = DynamicImage::from_decoder(decoder).map_err(fail)?;
    upright.apply_orientation(orientation);
    let pixels = upright.into_rgba8();
    let premultiplied = |[r, g, b, a]: [u8; 4]| {
        let part = f32::from(a) / 255.0;
        let [r, g, b] = [r, g, b].map(|c| srgb::decode8(c) * part);
        [r, g, b, part]
    };
    let (width, height) = pixels.dimensions();
    Ok(Picture::of(width, height, pixels.pixels().map(|p| premultiplied(p.0)).collect()))
}

fn finish(
    mut encoder: impl ImageEncoder,
    raster: &Raster<u8>,
    exif: Vec<u8>,
    kind: FileKind,
) -> Result<(), ImageError> {
    if !exif.is_empty() {
        encoder.set_exif_metadata(exif).map_err(|e| ImageError::encode(kind, e))?;
    }
    let color = if raster.channels == 4 { ExtendedColorType::Rgba8 } else { ExtendedColorType::Rgb8 };
    encoder.write_image(&raster.samples, raster.width, raster.height, color).map_err(|e| ImageError::encode(kind, e))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::ToneMap;
    use ::image::ImageFormat;

    fn picture() -> Picture {
        let beauty = (0..64 * 48).map(|i| if i % 64 < 32 { [0.5, 0.0, 0.0, 1.0] } else { [0.0; 4] }).collect();
        Picture::of(64, 48, beauty)
    }

    fn output() -> Output {
        Output { tone_map: ToneMap::None, ..Output::default() }
    }

    #[test]
    fn webp_gives_back_every_code() {
        let bytes = encode_webp(&picture(), &output(), &Metadata::new()).unwrap();
        let back = ::image::load_from_memory_with_format(&bytes, ImageFormat::WebP).unwrap().to_rgba8();
        assert_eq!(back.get_pixel(3, 7).0, [188, 0, 0, 255]);
        assert_eq!(back.get_pixel(60, 7).0, [0, 0, 0, 0]);
    }

    #[test]
    fn a_jpeg_that_was_cut_off_is_no_picture_to_compare_with() {
        let bytes = encode_jpeg(&picture(), &output(), &Metadata::new()).unwrap();
        assert!(decode(&bytes, FileKind::Jpeg, 1 << 20).is_ok());
        for length in [bytes.len() / 2, bytes.len() - 1] {
            let fault = decode(&bytes[..length], FileKind::Jpeg, 1 << 20).unwrap_err().to_string();
            assert!(fault.ends_with(&format!("its {length} bytes have no end; it was cut off")), "{fault}");
        }
    }

    #[test]
    fn jpeg_lays_a_transparent_picture_on_white_or_what_is_asked() {
        for (background, right) in [(None, [255, 255, 255]), (Some([0.0, 0.0, 1.0]), [0, 0, 255])] {
            let output = Output { background, ..output() };
            let bytes = encode_jpeg(&picture(), &output, &Metadata::new()).unwrap();
            let back = ::image::load_from_memory_with_format(&bytes, ImageFormat::Jpeg).unwrap().to_rgb8();
            let near = |x: u32, want: [u8; 3]| {
                let got = back.get_pixel(x, 20).0;
                assert!((0..3).all(|i| got[i].abs_diff(want[i]) <= 6), "{got:?} for {want:?}");
            };
            near(3, [188, 0, 0]);
            near(60, right);
        }
    }

    #[test]
    fn a_photo_is_turned_as_its_camera_says() {
        // Little-endian TIFF with one entry: orientation (0x112), a short, upside down.
        let exif = [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".as_slice(), &[3, 0, 0, 0, 0, 0, 0, 0]].concat();
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
        encoder.set_exif_metadata(exif).unwrap();
        let rows = [[250_u8; 16 * 8 * 3], [5; 16 * 8 * 3]].concat();
        encoder.write_image(&rows, 16, 16, ExtendedColorType::Rgb8).unwrap();
        let picture = decode(&bytes, FileKind::Jpeg, 256).unwrap();
        assert!(picture.beauty[0][0] < 0.1 && picture.beauty[255][0] > 0.9);
    }

    #[test]
    fn lower_quality_makes_smaller_files() {
        let size = |jpeg_quality| {
            let output = Output { jpeg_quality, ..output() };
            encode_jpeg(&picture(), &output, &Metadata::default()).unwrap().len()
        };
        assert!(size(20) < size(98));
    }

    #[test]
    fn sizes_the_format_cannot_hold_are_refused_with_a_remedy() {
        let wide = Picture::of(16_385, 1, vec![[0.0; 4]; 16_385]);
        let message = encode_webp(&wide, &output(), &Metadata::default()).unwrap_err().to_string();
        assert!(message.contains("16385×1") && message.contains(".png"), "{message}");
        let long = Metadata::new().with(Metadata::COUNTS, "x".repeat(70_000));
        let message = encode_jpeg(&picture(), &output(), &long).unwrap_err().to_string();
        assert!(message.contains("metadata"), "{message}");
    }
}
