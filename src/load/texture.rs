//! Encoded pictures -> [`Bitmap`]s, for every loader.
//!
//! The kind of a picture is detected by its bytes, whatever its name or declared type, except for TGA, which has no magic
//! bytes. Colour profiles, gamma chunks and EXIF orientation are ignored, as glTF demands. A picture that is missing or
//! broken costs a warning, and the material goes without that map; a truncated JPEG costs a warning, and is used.

use super::diagnostic::{CUT_OFF, RAISE_MEMORY};
use super::limits::{Budget, Limits};
use super::{Diagnostic, Warnings, ktx};
use crate::huge_pages::Paged;
use crate::jpeg;
use crate::scene::{Bitmap, Pixels};
use crate::stopwatch::{Spent, Stopwatch};
use ::image::{ColorType, DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
use bytemuck::Pod;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::io::{Cursor, ErrorKind};
use std::path::Path;
use std::time::Instant;

/// A picture to decode.
#[derive(Debug, Default)]
pub struct Encoded<'a> {
    /// Name in messages and in the [`Bitmap`].
    pub name: String,
    /// Where the model names the picture (line or JSON path).
    pub place: String,
    /// The file's bytes.
    pub bytes: std::borrow::Cow<'a, [u8]>,
}

/// Decodes all pictures in parallel; `None` for each that failed. Warnings about `file` report those, and truncated ones. Also
/// returns the time spent, of all threads together.
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
    let sized = images.iter().map(|image| (image, check_size(image, limits, budget)));
    let mut waiting: Vec<_> = sized.enumerate().collect();
    // The largest files first, so that no thread is left alone with a long one at the end.
    waiting.sort_by_key(|(_, (image, _))| Reverse(image.bytes.len()));
    let decoded = waiting.into_iter().par_bridge().map(|(i, (image, kind))| {
        let watch = Stopwatch::of_this_thread();
        let decoded = kind.and_then(|kind| decode(&image.name, &image.bytes, kind));
        (i, decoded, watch.read().cpu)
    });
    let mut decoded: Vec<_> = decoded.collect();
    decoded.sort_unstable_by_key(|(i, ..)| *i);
    let spent = Spent { wall: start.elapsed(), cpu: decoded.iter().map(|d| d.2).sum() };
    let mut bitmaps = Vec::with_capacity(images.len());
    for (image, (_, result, _)) in images.iter().zip(decoded) {
        let (bitmap, told) = match result {
            Ok(bitmap) => (Some(bitmap), cut_off(&image.name, &image.bytes, file, &image.place)),
            Err(why) => (None, Some(why.warning(&image.name, file, &image.place))),
        };
        told.into_iter().for_each(|told| warnings.push(told));
        bitmaps.push(bitmap);
    }
    (bitmaps, spent)
}

/// Warning about a picture that decodes although its file is truncated; `file` names the picture at `place`.
pub(super) fn cut_off(name: &str, bytes: &[u8], file: &Path, place: &str) -> Option<Diagnostic> {
    let is_jpeg = ::image::guess_format(bytes).is_ok_and(|format| format == ImageFormat::Jpeg);
    if !is_jpeg || !jpeg::is_cut_off(bytes) {
        return None;
    }
    let (name, len) = (super::paths::shorten(name), bytes.len());
    let text = format!("image '{name}' is cut off: its {len} bytes have no end, and what is missing is grey or coarse");
    Some(Diagnostic::new("image-cut-off", file, place, text).remedy("get it again"))
}

/// Why a picture cannot be used, and the remedy.
#[derive(Debug)]
pub(super) struct Unusable {
    pub why: String,
    remedy: &'static str,
}

impl Unusable {
    fn new(why: impl Into<String>) -> Self {
        Self { why: why.into(), remedy: "convert it to PNG or JPEG" }
    }

    pub(super) fn too_large(why: impl Into<String>) -> Self {
        Self { why: why.into(), remedy: RAISE_MEMORY }
    }

    /// Warning about the picture called `name`, which `file` names at `place`.
    pub(super) fn warning(self, name: &str, file: &Path, place: &str) -> Diagnostic {
        let text = format!("image '{}' cannot be used: {}", super::paths::shorten(name), self.why);
        let remedy = format!("the material is drawn without it; {}", self.remedy);
        Diagnostic::new("image-unusable", file, place, text).remedy(remedy)
    }
}

impl From<String> for Unusable {
    fn from(why: String) -> Self {
        Self::new(why)
    }
}

impl From<ImageError> for Unusable {
    fn from(error: ImageError) -> Self {
        match error {
            ImageError::Limits(_) => Self::too_large("it needs more memory than is left"),
            ImageError::IoError(why) if why.kind() == ErrorKind::UnexpectedEof => {
                Self { why: why.to_string(), remedy: CUT_OFF }
            }
            other => Self::new(other.to_string()),
        }
    }
}

/// Decoder of a picture.
#[derive(Clone, Copy)]
enum Kind {
    Image {
        format: ImageFormat,
        /// Bytes that decoding may take.
        bytes: u64,
    },
    Ktx,
}

/// Bytes that a decoder may take beside the pixels: for rows, colour profiles and texts. The latter may be compressed, and
/// are skipped where they take more.
const BESIDE: u64 = 1 << 26;

/// Bytes of a texel in the mip levels of a picture, which hold a third as many texels together.
const COPIED: u64 = 8;

/// Limits of a decoder that may take `bytes` bytes.
pub(super) fn within(bytes: u64) -> ::image::Limits {
    let mut limits = ::image::Limits::no_limits();
    limits.max_alloc = Some(bytes);
    limits
}

/// Format of a picture: by its bytes, or by the extension of its name where the bytes are of no known format and could be
/// a TGA's, which has no magic bytes.
pub(super) fn format_of(name: &str, bytes: &[u8]) -> Option<ImageFormat> {
    let by_name = || (is_named_tga(name) && is_tga_header(bytes)).then_some(ImageFormat::Tga);
    ::image::guess_format(bytes).ok().or_else(by_name)
}

fn is_named_tga(name: &str) -> bool {
    let ending = Path::new(name).extension().unwrap_or_default();
    ["tga", "targa", "icb", "vda", "vst"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Whether the bytes could be the header of a TGA: with a known type, known bits per pixel, and pixels.
fn is_tga_header(bytes: &[u8]) -> bool {
    let Some(&[_, map, kind, .., w, wide, h, high, depth, _]) = bytes.first_chunk::<18>() else { return false };
    map <= 1
        && matches!(kind, 1..=3 | 9..=11)
        && matches!(depth, 8 | 15 | 16 | 24 | 32)
        && [[w, wide], [h, high]].into_iter().all(|size| u16::from_le_bytes(size) > 0)
}

/// Reads only the header; refuses a picture that is too large.
///
/// Takes from `budget` the decoded pixels and the mip levels that lookups need: once, as it is not known here which
/// slots will read them, and whether as colours or as data.
fn check_size(image: &Encoded, limits: &Limits, budget: &mut Budget) -> Result<Kind, Unusable> {
    let bytes = image.bytes.as_ref();
    if ktx::is(bytes) {
        let ktx::Size { width, height, between } = ktx::size(bytes)?;
        take_memory(width, height, 4, between, limits, budget)?;
        return Ok(Kind::Ktx);
    }
    let format = format_of(&image.name, bytes).ok_or_else(|| unknown_kind(bytes))?;
    if matches!(format, ImageFormat::Hdr | ImageFormat::OpenExr) {
        return Err(Unusable::new("it holds radiance (HDR or EXR), not colours of a surface"));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(within(BESIDE.min(budget.left())));
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let texel = if is_deep(decoder.color_type()) { 8 } else { 4 };
    let mut beside = match decoder.color_type() {
        ColorType::Rgb8 | ColorType::Rgba8 | ColorType::Rgba16 => 0,
        // Other pixel types are decoded into a buffer first, then converted.
        _ => decoder.total_bytes(),
    };
    // A TGA of 16 bits or with a palette is unpacked from a copy.
    beside += if format == ImageFormat::Tga { 2 * u64::from(width) * u64::from(height) } else { 0 };
    take_memory(width, height, texel, beside, limits, budget)?;
    Ok(Kind::Image { format, bytes: decoder.total_bytes().saturating_add(BESIDE.min(budget.left())) })
}

/// Bytes of the mip levels of a picture of `pixels` pixels.
pub(super) fn smaller_copies(pixels: u64) -> u64 {
    pixels.div_ceil(3).saturating_mul(COPIED)
}

/// Takes the memory of a picture: bytes per pixel, its mip levels, and further bytes while it is decoded.
pub(super) fn take_memory(
    width: u32,
    height: u32,
    texel: u64,
    more: u64,
    limits: &Limits,
    budget: &mut Budget,
) -> Result<(), Unusable> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 {
        return Err(Unusable::new("it has no pixels"));
    }
    if pixels > limits.image_pixels {
        let why = format!("{width}×{height} pixels where {} are allowed", limits.image_pixels);
        let at_most = Limits::default().image_pixels;
        let remedy = if pixels > at_most { "scale it down" } else { RAISE_MEMORY };
        return Err(Unusable { why, remedy });
    }
    let bytes = pixels.saturating_mul(texel).saturating_add(smaller_copies(pixels)).saturating_add(more);
    budget.take(bytes, 1).map_err(|over| Unusable::too_large(over.to_string()))
}

/// Describes bytes that no decoder knows.
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

fn decode(name: &str, bytes: &[u8], kind: Kind) -> Result<Bitmap, Unusable> {
    let Kind::Image { format, bytes: most } = kind else { return Ok(ktx::decode(name, bytes)?) };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    reader.limits(within(most));
    let decoder = reader.into_decoder()?;
    let (width, height) = decoder.dimensions();
    let pixels = match decoder.color_type() {
        // The usual pixel types are decoded in place.
        ColorType::Rgb8 => Pixels::Rgb8(texels_of(decoder)?),
        ColorType::Rgba8 => Pixels::Rgba8(texels_of(decoder)?),
        ColorType::Rgba16 => Pixels::Rgba16(texels_of(decoder)?),
        _ => pixels_of(DynamicImage::from_decoder(decoder)?),
    };
    Ok(Bitmap { name: name.into(), width, height, pixels })
}

/// Texels of type `T` from a decoder.
fn texels_of<T: Pod>(decoder: impl ImageDecoder) -> Result<Paged<T>, Unusable> {
    let mut texels = Paged::zeroed(usize::try_from(decoder.total_bytes()).map_or(0, |bytes| bytes / size_of::<T>()));
    decoder.read_image(bytemuck::cast_slice_mut(&mut texels))?;
    Ok(texels)
}

/// Whether the pixels are kept with 16 bits per channel.
fn is_deep(color: ColorType) -> bool {
    matches!(color, ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16)
}

fn pixels_of(image: DynamicImage) -> Pixels {
    match image {
        image if is_deep(image.color()) => Pixels::Rgba16(fours(image.into_rgba16().into_raw())),
        image => Pixels::Rgba8(fours(image.into_rgba8().into_raw())),
    }
}

/// Groups numbers into texels of four, without copying where possible.
fn fours<T: Pod>(numbers: Vec<T>) -> Paged<[T; 4]>
where
    [T; 4]: Pod,
{
    let fours = bytemuck::allocation::try_cast_vec(numbers);
    fours.unwrap_or_else(|(_, numbers)| numbers.as_chunks().0.to_vec()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    fn file(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        image.write_to(&mut out, format).unwrap();
        out.into_inner()
    }

    fn png(image: DynamicImage) -> Vec<u8> {
        file(&image, ImageFormat::Png)
    }

    fn decode_one(bytes: &[u8], limits: &Limits) -> (Option<Bitmap>, Vec<Diagnostic>) {
        decode_named("a.png", bytes, limits)
    }

    fn decode_named(name: &str, bytes: &[u8], limits: &Limits) -> (Option<Bitmap>, Vec<Diagnostic>) {
        let image = Encoded { name: name.into(), place: "7".into(), bytes: Cow::Borrowed(bytes) };
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
    fn pictures_come_in_the_order_in_which_they_are_asked_for_whichever_takes_longest() {
        let of = |side: u32| {
            let noise = |x: u32, y: u32| [(x * 31 + y * 57) as u8 ^ (x * y) as u8, x as u8, y as u8, 255];
            let image = ::image::RgbaImage::from_fn(side, side, |x, y| ::image::Rgba(noise(x, y)));
            let bytes = Cow::Owned(png(DynamicImage::ImageRgba8(image)));
            Encoded { name: side.to_string(), place: side.to_string(), bytes }
        };
        let mut images: Vec<Encoded> = [3, 40, 1, 17, 25].map(of).into();
        images.insert(2, Encoded { name: "broken".into(), place: "7".into(), bytes: Cow::Borrowed(b"no picture") });
        let (limits, mut warnings) = (Limits::default(), Warnings::default());
        let mut budget = Budget::new(&limits);
        let (decoded, _) = decode_all(&images, Path::new("m.obj"), &limits, &mut budget, &mut warnings);
        let widths: Vec<Option<u32>> = decoded.iter().map(|bitmap| bitmap.as_ref().map(|b| b.width)).collect();
        assert_eq!(widths, [Some(3), Some(40), None, Some(1), Some(17), Some(25)]);
        assert_eq!(warnings.into_vec().len(), 1);
    }

    #[test]
    fn a_bmp_is_known_by_its_bytes_and_a_tga_by_its_name_too() {
        let colors = |image: &DynamicImage| image.to_rgba8().pixels().map(|p| p.0).collect::<Vec<_>>();
        let image = ::image::RgbaImage::from_fn(3, 2, |x, y| ::image::Rgba([x as u8 * 90, y as u8 * 200, 7, 255]));
        let image = DynamicImage::ImageRgba8(image);
        let read = |name: &str, bytes: &[u8]| match decode_named(name, bytes, &Limits::default()).0?.pixels {
            Pixels::Rgba8(texels) => Some(texels.to_vec()),
            other => panic!("{other:?}"),
        };
        let (bmp, tga) = (file(&image, ImageFormat::Bmp), file(&image, ImageFormat::Tga));
        for (name, bytes) in [("a.png", &bmp), ("a.tga", &bmp), ("dir/A.TGA", &tga)] {
            assert_eq!(read(name, bytes), Some(colors(&image)), "{name}");
        }
        assert_eq!(read("a.png", &tga), None);
        assert_eq!(decode_named("a.tga", b"<svg> that is no picture", &Limits::default()).1.len(), 1);
    }

    #[test]
    fn limits_hold_for_pictures_without_compression_too() {
        let image = DynamicImage::new_rgba8(100, 100);
        for (name, format) in [("a.bmp", ImageFormat::Bmp), ("a.tga", ImageFormat::Tga)] {
            let mut bytes = file(&image, format);
            assert!(decode_named(name, &bytes, &Limits::default()).0.is_some());
            for limits in
                [Limits { image_pixels: 9_999, ..Limits::default() }, Limits { memory: 60_000, ..Limits::default() }]
            {
                let (bitmap, warnings) = decode_named(name, &bytes, &limits);
                assert!(bitmap.is_none() && warnings[0].remedy.ends_with("--max-memory"), "{}", warnings[0]);
            }
            // The largest size that the header can express, with next to no data.
            let sides = if format == ImageFormat::Tga { 12..16 } else { 18..26 };
            bytes[sides].fill(if format == ImageFormat::Tga { 0xff } else { 0x7f });
            assert!(decode_named(name, &bytes, &Limits::default()).0.is_none());
        }
    }

    #[test]
    fn damaged_pictures_never_crash() {
        let image =
            DynamicImage::ImageRgba8(::image::RgbaImage::from_fn(9, 7, |x, y| ::image::Rgba([x as u8, 3, y as u8, 9])));
        let limits = Limits { memory: 1 << 24, ..Limits::default() };
        let mut random = crate::math::random::Random::new(5);
        for (name, format) in [("a.bmp", ImageFormat::Bmp), ("a.tga", ImageFormat::Tga)] {
            for image in [image.clone(), image.to_rgb8().into(), image.to_luma8().into()] {
                let whole = file(&image, format);
                for _ in 0..3000 {
                    let mut bytes = whole.clone();
                    for _ in 0..=random.below(5) {
                        // Mostly in the header.
                        let end = if random.below(4) == 0 { bytes.len() } else { 60.min(bytes.len()) };
                        let at = random.below(end);
                        bytes[at] = random.bits().to_le_bytes()[0];
                    }
                    bytes.truncate(random.below(4 * bytes.len()).max(1));
                    decode_named(name, &bytes, &limits);
                }
            }
        }
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
    fn a_jpeg_that_was_cut_off_is_drawn_as_far_as_it_goes_and_told() {
        let noise = |x: u32, y: u32| ::image::Rgb([((x * 37) ^ (y * 91)) as u8, (x * y) as u8, y as u8]);
        let whole = file(&::image::RgbImage::from_fn(64, 64, noise).into(), ImageFormat::Jpeg);
        let (bitmap, warnings) = decode_one(&whole, &Limits::default());
        assert!(bitmap.is_some() && warnings.is_empty());
        let (bitmap, warnings) = decode_one(&whole[..whole.len() * 2 / 3], &Limits::default());
        assert!(bitmap.is_some());
        assert_eq!((warnings.len(), warnings[0].code), (1, "image-cut-off"));
    }

    #[test]
    fn sizes_are_checked_before_decoding() {
        let bytes = png(DynamicImage::new_rgb8(100, 100));
        let (bitmap, warnings) = decode_one(&bytes, &Limits { image_pixels: 9_999, ..Limits::default() });
        assert!(bitmap.is_none());
        assert!(warnings[0].text.contains("100×100 pixels where 9999 are allowed"));
        assert!(decode_one(&bytes, &Limits { memory: 30_000, ..Limits::default() }).0.is_none());
    }

    #[test]
    fn pixels_are_counted_as_they_are_kept_with_smaller_copies_and_what_is_too_large_names_the_remedy() {
        for (image, bytes) in [(DynamicImage::new_rgba8(60, 50), 4), (DynamicImage::new_rgba16(60, 50), 8)] {
            let file = png(image);
            // Mip levels have a third as many texels, of eight bytes each.
            let memory = 60 * 50 * bytes + 1000 * 8;
            let limits = |memory| Limits { memory, ..Limits::default() };
            assert!(decode_one(&file, &limits(memory)).0.is_some());
            let (bitmap, warnings) = decode_one(&file, &limits(memory - 1));
            assert!(bitmap.is_none() && warnings[0].remedy.ends_with("raise --max-memory"), "{}", warnings[0]);
        }
        let small = Limits { image_pixels: 2_999, ..Limits::default() };
        let warnings = decode_one(&png(DynamicImage::new_rgba8(60, 50)), &small).1;
        assert!(warnings[0].remedy.ends_with("--max-memory"), "{}", warnings[0]);
    }

    #[test]
    fn a_picture_that_the_budget_allows_is_not_too_large_for_its_decoder() {
        // 12 000 × 12 000 pixels of four bytes, without any pixel data.
        let mut file = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut file, 12_000, 12_000);
        encoder.set_color(::png::ColorType::Rgba);
        drop(encoder.write_header().unwrap());
        file.truncate(8 + 25);
        file.extend(b"\0\0\0\0IDAT\x35\xaf\x06\x1e");
        let (bitmap, warnings) = decode_one(&file, &Limits::default());
        assert!(bitmap.is_none() && !warnings[0].to_string().contains("memory"), "{}", warnings[0]);
        let warnings = decode_one(&file, &Limits { memory: 575_999_999 + 48_000_000 * 8, ..Limits::default() }).1;
        assert!(warnings[0].remedy.ends_with("--max-memory"), "{}", warnings[0]);
    }
}
