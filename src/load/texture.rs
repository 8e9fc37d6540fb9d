//! Encoded pictures -> [`Bitmap`]s, for every loader.
//!
//! The kind of picture is found by its bytes, whatever its name or declared type says. Colour profiles, gamma chunks
//! and EXIF orientation are ignored, as glTF demands. A picture that is missing or broken costs a warning; the
//! material goes on without that map.

use super::limits::{Budget, Limits};
use super::{Diagnostic, Warnings, ktx};
use crate::scene::{Bitmap, Pixels};
use crate::stopwatch::{Spent, Stopwatch};
use ::image::{ColorType, DynamicImage, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;
use std::time::Instant;

/// A picture to decode.
#[derive(Debug, Default)]
pub struct Encoded<'a> {
    /// Its name in messages and in the [`Bitmap`].
    pub name: String,
    /// Where the model names it (line or JSON path).
    pub place: String,
    /// The file's bytes.
    pub bytes: std::borrow::Cow<'a, [u8]>,
}

/// Decodes all, in parallel; `None` for each that could not be, with a warning about `file`. And the time that took, of
/// all threads together.
///
/// Sizes are checked against `limits` and `budget` before anything is decoded.
pub fn decode_all(
    images: &[Encoded],
    file: &Path,
    limits: &Limits,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> (Vec<Option<Bitmap>>, Spent) {
    if images.is_empty() {
        return Default::default();
    }
    let start = Instant::now();
    let sized: Vec<_> = images.iter().map(|image| check_size(&image.bytes, limits, budget)).collect();
    let decoded: Vec<_> = images
        .par_iter()
        .zip(sized)
        .map(|(image, kind)| {
            let watch = Stopwatch::of_this_thread();
            let decoded = kind.and_then(|kind| decode(&image.name, &image.bytes, kind));
            (decoded, watch.read().cpu)
        })
        .collect();
    let spent = Spent { wall: start.elapsed(), cpu: decoded.iter().map(|d| d.1).sum() };
    let mut warn = |image: &Encoded, why: String| {
        let text = format!("image '{}' cannot be used: {why}", super::paths::shorten(&image.name));
        let remedy = "the material is drawn without it; convert it to PNG or JPEG";
        warnings.push(Diagnostic::new("image-unusable", file, &image.place, text).remedy(remedy));
    };
    let usable =
        |(image, (result, _)): (&Encoded, (Result<Bitmap, String>, _))| result.map_err(|why| warn(image, why)).ok();
    (images.iter().zip(decoded).map(usable).collect(), spent)
}

/// What reads a picture.
#[derive(Clone, Copy)]
enum Kind {
    Image(ImageFormat),
    Ktx,
}

/// Reads only the header; refuses what is too large.
fn check_size(bytes: &[u8], limits: &Limits, budget: &mut Budget) -> Result<Kind, String> {
    let (kind, width, height, between) = if ktx::is(bytes) {
        let ktx::Size { width, height, between } = ktx::size(bytes)?;
        (Kind::Ktx, width, height, between)
    } else {
        let format = ::image::guess_format(bytes).map_err(|_| unknown_kind(bytes))?;
        if matches!(format, ImageFormat::Hdr | ImageFormat::OpenExr) {
            return Err("it holds radiance (HDR or EXR), not colours of a surface".into());
        }
        let reader = ImageReader::with_format(Cursor::new(bytes), format);
        let (width, height) = reader.into_dimensions().map_err(|e| e.to_string())?;
        (Kind::Image(format), width, height, 0)
    };
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return Err("it has no pixels".into());
    }
    if pixels > limits.image_pixels {
        return Err(format!("{width}×{height} pixels where {} are allowed", limits.image_pixels));
    }
    budget.take(pixels, 4).and_then(|()| budget.take(between, 1)).map_err(|over| over.to_string())?;
    Ok(kind)
}

/// What bytes that no decoder knows look like.
fn unknown_kind(bytes: &[u8]) -> String {
    let kind = match bytes {
        [] => "an empty file",
        [0xab, b'K', b'T', b'X', ..] => "KTX 1 (compressed for GPUs)",
        [b'D', b'D', b'S', b' ', ..] => "DDS (compressed for GPUs)",
        [b's', b'B', ..] => "Basis (compressed for GPUs)",
        [b'<', ..] => "a text or SVG file",
        _ => "of an unknown kind",
    };
    format!("it is {kind}")
}

fn decode(name: &str, bytes: &[u8], kind: Kind) -> Result<Bitmap, String> {
    let Kind::Image(format) = kind else { return ktx::decode(name, bytes) };
    let image = ImageReader::with_format(Cursor::new(bytes), format).decode().map_err(|e| e.to_string())?;
    let (width, height) = (image.width(), image.height());
    Ok(Bitmap { name: name.into(), width, height, pixels: pixels_of(image) })
}

fn pixels_of(image: DynamicImage) -> Pixels {
    use ColorType::{L16, La16, Rgb16, Rgba16};
    match image {
        // What most pictures are: they stay as the decoder left them.
        DynamicImage::ImageRgb8(image) => Pixels::Rgb8(image.into_raw()),
        image if matches!(image.color(), L16 | La16 | Rgb16 | Rgba16) => {
            Pixels::Rgba16(image.into_rgba16().pixels().map(|p| p.0).collect())
        }
        image => Pixels::Rgba8(image.into_rgba8().as_raw().as_chunks::<4>().0.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    fn png(image: DynamicImage) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, ImageFormat::Png).unwrap();
        out.into_inner()
    }

    fn decode_one(bytes: &[u8], limits: &Limits) -> (Option<Bitmap>, Vec<Diagnostic>) {
        let image = Encoded { name: "a.png".into(), place: "7".into(), bytes: Cow::Borrowed(bytes) };
        let mut warnings = Warnings::default();
        let mut budget = Budget::new(limits);
        let bitmap = decode_all(&[image], Path::new("m.obj"), limits, &mut budget, &mut warnings).0.remove(0);
        (bitmap, warnings.into_vec())
    }

    #[test]
    fn eight_and_sixteen_bits_and_grey_become_rgba() {
        let limits = Limits::default();
        let grey = DynamicImage::ImageLuma8(::image::ImageBuffer::from_pixel(2, 1, ::image::Luma([7u8])));
        let bitmap = decode_one(&png(grey), &limits).0.unwrap();
        assert_eq!((bitmap.width, bitmap.height), (2, 1));
        assert!(matches!(&bitmap.pixels, Pixels::Rgba8(p) if p[..] == [[7, 7, 7, 255]; 2]));

        let colors = DynamicImage::ImageRgb8(::image::ImageBuffer::from_pixel(2, 1, ::image::Rgb([1u8, 2, 3])));
        let bitmap = decode_one(&png(colors), &limits).0.unwrap();
        assert!(matches!(&bitmap.pixels, Pixels::Rgb8(p) if p[..] == [1, 2, 3, 1, 2, 3]));

        let deep = DynamicImage::ImageRgb16(::image::ImageBuffer::from_pixel(1, 1, ::image::Rgb([1u16, 2, 40000])));
        let bitmap = decode_one(&png(deep), &limits).0.unwrap();
        assert!(matches!(&bitmap.pixels, Pixels::Rgba16(p) if p[..] == [[1, 2, 40000, 65535]]));
    }

    #[test]
    fn broken_and_foreign_pictures_are_one_warning_each() {
        let whole = png(DynamicImage::new_rgb8(8, 8));
        for bytes in [&b""[..], b"not a picture", b"\xabKTX 20\xbb\r\n\x1a\n", &whole[..20], &whole[..whole.len() / 2]]
        {
            let (bitmap, warnings) = decode_one(bytes, &Limits::default());
            assert!(bitmap.is_none());
            assert_eq!(warnings.len(), 1);
            assert!(warnings[0].to_string().starts_with("m.obj:7: image 'a.png' cannot be used: "), "{}", warnings[0]);
        }
    }

    #[test]
    fn sizes_are_checked_before_decoding() {
        let bytes = png(DynamicImage::new_rgb8(100, 100));
        let (bitmap, warnings) = decode_one(&bytes, &Limits { image_pixels: 9_999, ..Limits::default() });
        assert!(bitmap.is_none());
        assert!(warnings[0].text.contains("100×100 pixels where 9999 are allowed"));
        assert!(decode_one(&bytes, &Limits { memory: 30_000, ..Limits::default() }).0.is_none());
    }
}
