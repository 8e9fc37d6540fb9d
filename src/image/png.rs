//! PNG files: sRGB-coded, 8 or 16 bit, straight alpha; opaque pictures have no alpha channel.

use super::develop::{Raster, raster};
use super::metadata::MAX_TEXT;
use super::{FileKind, ImageError, Metadata, Output, Picture, PngDepth, srgb};
use ::png::{BitDepth, ColorType, Compression, Decoder, Encoder, Filter, SrgbRenderingIntent, Transformations};
use std::io::{BufRead, Cursor, Seek};

/// Encodes a PNG file.
pub(super) fn encode(picture: &Picture, output: &Output, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    match output.png_depth {
        PngDepth::Eight => {
            let raster: Raster<u8> = raster(picture, output);
            write_bytes(&raster, metadata)
        }
        PngDepth::Sixteen => {
            let raster: Raster<u16> = raster(picture, output);
            let bytes: Vec<u8> = raster.samples.iter().flat_map(|s| s.to_be_bytes()).collect();
            write(&raster, &bytes, BitDepth::Sixteen, metadata)
        }
    }
    .map_err(|e| ImageError::encode(FileKind::Png, e))
}

/// Encodes a PNG file of 8-bit samples that are already coded.
pub(super) fn write_bytes(raster: &Raster<u8>, metadata: &Metadata) -> Result<Vec<u8>, ::png::EncodingError> {
    write(raster, &raster.samples, BitDepth::Eight, metadata)
}

fn write<T>(
    raster: &Raster<T>,
    bytes: &[u8],
    depth: BitDepth,
    metadata: &Metadata,
) -> Result<Vec<u8>, ::png::EncodingError> {
    let mut file = Vec::with_capacity(bytes.len() / 2 + 4096);
    let mut encoder = Encoder::new(&mut file, raster.width, raster.height);
    encoder.set_color(if raster.channels == 4 { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(depth);
    // The slower levels take 50 times as long for a quarter less.
    encoder.set_compression(Compression::Fast);
    // Rendered pictures come out no larger than with the best filter for each row, in half the time.
    encoder.set_filter(Filter::Paeth);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    if !metadata.is_empty() {
        encoder.add_text_chunk("Software".to_owned(), metadata.software())?;
    }
    for (key, value) in metadata.iter() {
        encoder.add_itxt_chunk(key.to_owned(), value.to_owned())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(file)
}

/// Entries of meshray among the texts before the pixels.
pub(super) fn read_metadata(file: impl BufRead + Seek) -> Result<Metadata, ImageError> {
    let decode = |e: ::png::DecodingError| ImageError::decode(FileKind::Png, e);
    let reader = Decoder::new(file).read_info().map_err(decode)?;
    let mut metadata = Metadata::default();
    for text in &reader.info().utf8_text {
        let mut text = text.clone();
        text.decompress_text_with_limit(MAX_TEXT).map_err(decode)?;
        let value = text.get_text().map_err(decode)?;
        if value.len() <= MAX_TEXT {
            metadata.insert(&text.keyword, &value);
        }
    }
    Ok(metadata)
}

/// Reads a PNG of any colour type back into premultiplied linear pixels; at most `max_pixels` of them.
pub(super) fn decode(bytes: &[u8], max_pixels: u64) -> Result<Picture, ImageError> {
    let fail = |e: ::png::DecodingError| ImageError::decode(FileKind::Png, e);
    let mut decoder = Decoder::new(Cursor::new(bytes));
    let header = decoder.read_header_info().map_err(fail)?;
    let (width, height) = (header.width, header.height);
    super::read::check_size(FileKind::Png, width, height, max_pixels)?;
    decoder.set_transformations(Transformations::EXPAND | Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(fail)?;
    let size = reader.output_buffer_size().ok_or_else(|| ImageError::decode(FileKind::Png, "too large"))?;
    let mut buffer = vec![0; size];
    let info = reader.next_frame(&mut buffer).map_err(fail)?;
    buffer.truncate(info.buffer_size());

    let samples: Vec<(f32, f32)> = match info.bit_depth {
        BitDepth::Sixteen => {
            let code = |b: &[u8]| u16::from_be_bytes([b[0], b[1]]);
            buffer.chunks_exact(2).map(code).map(|c| (srgb::decode16(c), f32::from(c) / 65_535.0)).collect()
        }
        _ => buffer.iter().map(|&c| (srgb::decode8(c), f32::from(c) / 255.0)).collect(),
    };
    let channels = info.color_type.samples();
    let premultiplied = |r: f32, g: f32, b: f32, a: f32| [r * a, g * a, b * a, a];
    let beauty = samples
        .chunks_exact(channels)
        .map(|p| match *p {
            [grey] => premultiplied(grey.0, grey.0, grey.0, 1.0),
            [grey, a] => premultiplied(grey.0, grey.0, grey.0, a.1),
            [r, g, b] => premultiplied(r.0, g.0, b.0, 1.0),
            [r, g, b, a, ..] => premultiplied(r.0, g.0, b.0, a.1),
            [] => [0.0; 4],
        })
        .collect();
    Ok(Picture::of(width, height, beauty))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::ToneMap;

    /// A ramp through colour and coverage.
    fn ramp(width: u32, height: u32) -> Picture {
        let pixel = |i: u32| {
            let a = (i % 5 + 1) as f32 / 5.0;
            [i as f32 * 0.01 % 1.0 * a, 0.5 * a, 0.25 * a, a]
        };
        Picture::of(width, height, (0..width * height).map(pixel).collect())
    }

    fn output(png_depth: PngDepth) -> Output {
        Output { tone_map: ToneMap::None, png_depth, ..Output::default() }
    }

    #[test]
    fn pixels_come_back_within_half_a_code() {
        for (depth, tolerance) in [(PngDepth::Eight, 0.005), (PngDepth::Sixteen, 0.00002)] {
            let picture = ramp(17, 9);
            let bytes = encode(&picture, &output(depth), &Metadata::new()).unwrap();
            let back = decode(&bytes, 1000).unwrap();
            assert_eq!((back.width, back.height), (17, 9));
            for (a, b) in picture.beauty.iter().zip(&back.beauty) {
                assert!((0..4).all(|i| (a[i] - b[i]).abs() <= tolerance), "{depth:?}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn an_opaque_picture_is_rgb_and_says_srgb() {
        let picture = Picture::of(1, 1, vec![[0.5, 0.5, 0.5, 1.0]]);
        let bytes = encode(&picture, &output(PngDepth::Eight), &Metadata::default()).unwrap();
        let reader = Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
        assert_eq!(reader.info().color_type, ColorType::Rgb);
        assert_eq!(reader.info().srgb, Some(SrgbRenderingIntent::Perceptual));
        assert!(reader.info().uncompressed_latin1_text.is_empty());
    }

    #[test]
    fn a_picture_larger_than_allowed_is_refused_before_memory_is_taken() {
        let bytes = encode(&ramp(20, 20), &output(PngDepth::Eight), &Metadata::default()).unwrap();
        assert!(decode(&bytes, 399).unwrap_err().to_string().contains("20×20"));
    }

    #[test]
    fn broken_pixels_are_an_error() {
        let bytes = encode(&ramp(20, 20), &output(PngDepth::Eight), &Metadata::default()).unwrap();
        for cut in 0..bytes.len() - 12 {
            assert!(decode(&bytes[..cut], 1000).is_err(), "cut at {cut} of {}", bytes.len());
        }
        for at in 0..bytes.len() {
            let mut copy = bytes.clone();
            copy[at] ^= 0x55;
            let _ = decode(&copy, 1000);
        }
    }
}
