//! Panoramas of surroundings: Radiance HDR, OpenEXR, and 8- or 16-bit pictures, decoded from sRGB and turned upright by EXIF.

use super::diagnostic::CUT_OFF;
use super::limits::{Budget, Limits};
use super::texture::{cut_off, format_of, within};
use super::{Diagnostic, LoadError, Source};
use crate::catch_panic::attempt;
use crate::math::primaries::Primaries;
use crate::math::{DMat3, DVec3};
use crate::scene::Panorama;
use crate::scene::color::from_srgb;
use crate::threads;
use ::exr::meta::MetaData;
use ::exr::meta::header::Header;
use ::exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel, read};
use ::image::codecs::hdr::HdrDecoder;
use ::image::error::DecodingError;
use ::image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, ImageResult, Rgb, Rgb32FImage};
use rayon::prelude::*;
use std::borrow::Cow;
use std::io::{Cursor, ErrorKind};
use std::path::Path;
use std::sync::Arc;
use xxhash_rust::xxh3::xxh3_128;

/// A loaded panorama.
#[derive(Clone, Debug)]
pub struct LoadedPanorama {
    /// The picture.
    pub panorama: Panorama,
    /// Warnings about its contents.
    pub warnings: Vec<Diagnostic>,
    /// xxh3-128 of the file's bytes.
    pub hash: u128,
}

/// Bytes that a pixel takes while it is decoded, converted to radiance, and copied at all sizes.
pub(crate) const PER_PIXEL: u64 = 48;

/// Loads an equirectangular picture. Colours of HDR files are taken as linear Rec. 709, those of EXR files are converted
/// from their primaries; negative parts of colours outside of the gamut of Rec. 709 are clamped to 0.
///
/// # Errors
/// [`LoadError::Read`] when the file cannot be read, [`LoadError::Input`] when it is not a picture of a supported kind or larger
/// than `limits` allow.
pub fn load(path: &Path, limits: &Limits) -> Result<LoadedPanorama, LoadError> {
    decode(&super::read_file(path, limits)?, limits)
}

/// Reads a panorama from memory.
///
/// # Errors
/// As [`load`].
pub fn decode(source: &Source, limits: &Limits) -> Result<LoadedPanorama, LoadError> {
    let fault = |text: String| {
        let remedy = "name an equirectangular picture (.hdr, .exr, .png, .jpg), or `studio`, `white`, `black`";
        LoadError::from(Diagnostic::new("env-unusable", &source.path, "", text).remedy(remedy))
    };
    let bytes = &*as_radiance(&source.bytes);
    let format = format_of(&source.path.to_string_lossy(), bytes)
        .ok_or_else(|| fault("is no picture that can surround a scene: its kind is unknown".into()))?;
    let reader = |memory| {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(within(memory));
        reader
    };
    let meta = if format == ImageFormat::OpenExr { MetaData::read_from_buffered(bytes, false).ok() } else { None };
    let luminance = meta.as_ref().and_then(of_luminance);
    let size = luminance.map_or_else(|| reader(limits.memory).into_dimensions(), |part| Ok(size_of(part)));
    let size = size.map_err(|e| fault(format!("cannot be decoded: {e}")))?;
    // All pixels of an EXR's data window are decoded, whatever part of them is shown.
    for part in meta.iter().flat_map(|meta| &meta.headers) {
        memory_of(size_of(part), limits, &source.path, fault)?;
    }
    let most = memory_of(size, limits, &source.path, fault)?;
    let decode = || if luminance.is_some() { grey(bytes) } else { upright(reader(most)) };
    // The EXR decoder panics on some damaged files.
    let picture = match attempt(|| threads::anywhere(decode)) {
        Some(Ok(picture)) => picture,
        Some(Err(ImageError::IoError(why))) if why.kind() == ErrorKind::UnexpectedEof => {
            let fault = Diagnostic::new("env-unusable", &source.path, "", format!("cannot be decoded: {why}"));
            return Err(fault.remedy(CUT_OFF).into());
        }
        Some(Err(e)) => return Err(fault(format!("cannot be decoded: {e}"))),
        None => return Err(fault("cannot be decoded: it is damaged".into())),
    };
    let (width, height) = (picture.width(), picture.height());
    let mut warnings: Vec<Diagnostic> =
        cut_off(&source.path.to_string_lossy(), bytes, &source.path, "").into_iter().collect();
    if u64::from(width) != 2 * u64::from(height) {
        let text =
            format!("is {width}×{height}: a panorama of all around is twice as wide as high, so it is stretched");
        warnings.push(Diagnostic::new("env-shape", &source.path, "", text));
    }
    let turned = meta.as_ref().and_then(|meta| other_colors(meta, &source.path, &mut warnings));
    let (mut texels, odd) = radiance(picture, format, turned);
    if format == ImageFormat::Hdr
        && let Some(exposure) = exposure(bytes)
    {
        texels.iter_mut().flatten().for_each(|c| *c /= exposure);
    }
    let parts = meta.map_or(1, |meta| meta.headers.len());
    warnings.extend(left_out(&source.path, parts, odd));
    let name = source.path.to_string_lossy().into_owned();
    let panorama = Panorama { name, width, height, texels: Arc::new(texels), ..Panorama::default() };
    Ok(LoadedPanorama { panorama, warnings, hash: xxh3_128(&source.bytes) })
}

/// Bytes that a panorama of this size may take while it is loaded.
///
/// # Errors
/// Where it has no pixels (by `fault`), or more than `limits` allow; a lack of memory has a code of its own.
fn memory_of(
    (width, height): (u32, u32),
    limits: &Limits,
    path: &Path,
    fault: impl Fn(String) -> LoadError,
) -> Result<u64, LoadError> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels == 0 || pixels > limits.image_pixels {
        let text = format!("is {width}×{height} pixels where 1 to {} are allowed", limits.image_pixels);
        // The limit of pixels shrinks with the memory.
        let fits = (1..=Limits::default().image_pixels).contains(&pixels);
        let too_large = |text| Diagnostic::new("env-unusable", path, "", text).remedy("scale it down").into();
        return Err(match pixels {
            0 => fault(text),
            _ if fits => Diagnostic::over_memory(path, "", text).into(),
            _ => too_large(text),
        });
    }
    Budget::new(limits)
        .take(pixels, PER_PIXEL)
        .map_err(|over| LoadError::from(Diagnostic::over_memory(path, "", over.to_string())))?;
    Ok(pixels * PER_PIXEL)
}

/// Warnings that only one of `parts` parts is shown, and that `odd` pixels are taken as 0.
fn left_out(path: &Path, parts: usize, odd: usize) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    if parts > 1 {
        let text = format!("has {parts} parts, of which one is shown");
        warnings.push(Diagnostic::new("env-parts", path, "", text).remedy("keep only the panorama in it"));
    }
    if odd > 0 {
        let pixels = if odd == 1 { "1 pixel has".into() } else { format!("{odd} pixels have") };
        let text = format!("{pixels} numbers that are negative or not finite, which are taken as 0");
        warnings.push(Diagnostic::new("env-pixels", path, "", text));
    }
    warnings
}

/// Radiance picture with the first line that its decoder expects: files name the program that wrote them there, mostly
/// `#?RADIANCE` or `#?RGBE`. Other files are returned unchanged.
fn as_radiance(bytes: &[u8]) -> Cow<'_, [u8]> {
    /// Longest first line.
    const LINE: usize = 80;
    let end = bytes.iter().take(LINE).position(|&byte| byte == b'\n');
    match end {
        Some(end) if bytes.starts_with(b"#?") && bytes[..end].trim_ascii_end() != b"#?RADIANCE" => {
            [b"#?RADIANCE".as_slice(), &bytes[end..]].concat().into()
        }
        _ => bytes.into(),
    }
}

/// Decodes a picture upright: cameras record how they were held.
fn upright(reader: ImageReader<Cursor<&[u8]>>) -> ImageResult<DynamicImage> {
    let mut decoder = reader.into_decoder()?;
    let orientation = decoder.orientation()?;
    let mut picture = DynamicImage::from_decoder(decoder)?;
    picture.apply_orientation(orientation);
    Ok(picture)
}

/// Header of the first part of an EXR, if it has luminance instead of colours, which the usual decoder refuses.
fn of_luminance(meta: &MetaData) -> Option<&Header> {
    let part = meta.headers.first()?;
    let has = |name: &str| part.channels.find_index_of_channel(&name.into()).is_some();
    (has("Y") && !["R", "G", "B"].into_iter().any(has)).then_some(part)
}

/// Columns and rows of the data.
fn size_of(part: &Header) -> (u32, u32) {
    let pixels = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    (pixels(part.layer_size.width()), pixels(part.layer_size.height()))
}

/// Luminance of an EXR file, copied to all three channels.
fn grey(bytes: &[u8]) -> ImageResult<DynamicImage> {
    let blank = |size: ::exr::math::Vec2<usize>, _: &_| Rgb32FImage::new(size.width() as u32, size.height() as u32);
    let set = |picture: &mut Rgb32FImage, at: ::exr::math::Vec2<usize>, (y,): (f32,)| {
        picture.put_pixel(at.x() as u32, at.y() as u32, Rgb([y; 3]));
    };
    let layer = read().no_deep_data().largest_resolution_level().specific_channels().required("Y");
    let read = layer.collect_pixels(blank, set).first_valid_layer().all_attributes().from_buffered(Cursor::new(bytes));
    let decoding = |e| ImageError::Decoding(DecodingError::new(ImageFormat::OpenExr.into(), e));
    Ok(DynamicImage::ImageRgb32F(read.map_err(decoding)?.layer_data.channel_data.pixels))
}

/// Matrix from the colours of an EXR file to Rec. 709; `None` where they are Rec. 709, or invalid, which costs a warning.
fn other_colors(meta: &MetaData, file: &Path, warnings: &mut Vec<Diagnostic>) -> Option<DMat3> {
    let said = meta.headers.first()?.shared_attributes.chromaticities?;
    let primaries = Primaries::of([said.red, said.green, said.blue, said.white].map(|at| [at.x(), at.y()]));
    if primaries.are_near(&Primaries::REC_709) {
        return None;
    }
    let turned = primaries.to_rec_709();
    if turned.is_none() {
        let text = "its chromaticities are those of no colours: it is taken as Rec. 709";
        warnings.push(Diagnostic::new("env-colors", file, "", text));
    }
    turned
}

#[expect(clippy::cast_possible_truncation, reason = "radiance is stored so")]
fn in_rec_709(turned: DMat3, texel: [f32; 3]) -> [f32; 3] {
    let color = turned * DVec3::from(texel.map(f64::from));
    color.to_array().map(|c| (c as f32).min(f32::MAX))
}

/// Factor that the values of a Radiance picture have been multiplied by, if known and not 1.
fn exposure(bytes: &[u8]) -> Option<f32> {
    let exposure = HdrDecoder::new(Cursor::new(bytes)).ok()?.metadata().exposure?;
    Some(exposure).filter(|e| e.is_finite() && *e > 0.0 && *e != 1.0)
}

/// Linear radiance of all pixels, converted to Rec. 709 by `turned`, and the number of pixels that had to be repaired. Values
/// negative in other primaries need not be so in Rec. 709.
fn radiance(picture: DynamicImage, format: ImageFormat, turned: Option<DMat3>) -> (Vec<[f32; 3]>, usize) {
    if !matches!(format, ImageFormat::Hdr | ImageFormat::OpenExr) {
        return (linear(picture), 0);
    }
    let picture = picture.into_rgb32f();
    let texels = picture.as_raw().as_chunks::<3>().0.iter();
    let mut odd = 0;
    let mend = |texel: &[f32; 3]| {
        let usable = texel.iter().all(|c| c.is_finite() && (*c >= 0.0 || turned.is_some()));
        odd += usize::from(!usable);
        let finite = texel.map(|c| if c.is_finite() { c } else { 0.0 });
        turned.map_or(finite, |turned| in_rec_709(turned, finite)).map(|c| c.max(0.0))
    };
    let texels = texels.map(mend).collect();
    (texels, odd)
}

/// Linear colours of a picture for screens.
fn linear(picture: DynamicImage) -> Vec<[f32; 3]> {
    /// Linear value of every code up to `most`.
    fn table(most: u16) -> Vec<f32> {
        (0..=most).map(|code| from_srgb([f32::from(code) / f32::from(most); 3]).x).collect()
    }
    let color = picture.color();
    match color.bytes_per_pixel() / color.channel_count() {
        1 => {
            let (picture, table) = (picture.into_rgb8(), table(255));
            let texels = picture.as_raw().as_chunks::<3>().0.par_iter();
            texels.map(|codes| codes.map(|code| table[usize::from(code)])).collect()
        }
        2 => {
            let (picture, table) = (picture.into_rgb16(), table(u16::MAX));
            let texels = picture.as_raw().as_chunks::<3>().0.par_iter();
            texels.map(|codes| codes.map(|code| table[usize::from(code)])).collect()
        }
        _ => {
            let picture = picture.into_rgb32f();
            let texels = picture.as_raw().as_chunks::<3>().0.par_iter();
            texels.map(|&codes| from_srgb(codes).to_array()).collect()
        }
    }
}

#[cfg(feature = "cli")]
impl LoadedPanorama {
    /// Bytes of the panorama and its copies for rendering.
    pub(crate) fn bytes(&self) -> u64 {
        self.panorama.texels.len() as u64 * PER_PIXEL
    }

    /// Whether the panorama fits within `limits`.
    pub(crate) fn fits(&self, limits: &Limits) -> bool {
        let Panorama { width, height, .. } = self.panorama;
        memory_of((width, height), limits, Path::new(""), |_| LoadError::Input(Vec::new())).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::diagnostic::OVER_MEMORY;
    use ::image::ImageBuffer;

    fn file(picture: &DynamicImage, format: ImageFormat) -> Source {
        let mut out = Cursor::new(Vec::new());
        picture.write_to(&mut out, format).unwrap();
        Source::new("sky.exr".into(), out.into_inner())
    }

    fn bright(width: u32, height: u32) -> DynamicImage {
        let picture: Rgb32FImage = ImageBuffer::from_fn(width, height, |x, _| Rgb([x as f32 * 100.0, 0.5, 0.25]));
        DynamicImage::ImageRgb32F(picture)
    }

    #[test]
    fn a_radiance_picture_may_name_any_program_and_is_as_bright_as_before_its_exposure() {
        let Source { bytes, .. } = file(&bright(4, 2), ImageFormat::Hdr);
        let texels = |head: &str| {
            let bytes = [head.as_bytes(), &bytes["#?RADIANCE\n".len()..]].concat();
            let source = Source::new("sky.hdr".into(), bytes);
            decode(&source, &Limits::default()).map(|loaded| loaded.panorama.texels.to_vec())
        };
        let plain = texels("#?RADIANCE\n").unwrap();
        assert_eq!(texels("#?RGBE\n").unwrap(), plain);
        assert_eq!(texels("#?AUTOPANO pro 2\r\n").unwrap(), plain);
        let halved: Vec<[f32; 3]> = plain.iter().map(|texel| texel.map(|c| c / 2.0)).collect();
        assert_eq!(texels("#?RGBE\nEXPOSURE=4\nEXPOSURE= 0.5\n").unwrap(), halved, "all of them count");
        assert!(texels("RGBE\n").is_err());
    }

    #[test]
    fn hdr_and_exr_keep_light_that_is_brighter_than_white() {
        for format in [ImageFormat::Hdr, ImageFormat::OpenExr] {
            let loaded = decode(&file(&bright(4, 2), format), &Limits::default()).unwrap();
            let panorama = loaded.panorama;
            assert_eq!((panorama.width, panorama.height, panorama.texels.len()), (4, 2, 8));
            for (texel, expected) in panorama.texels[3].iter().zip([300.0, 0.5, 0.25]) {
                assert!((texel - expected).abs() <= expected / 100.0 + 1.0, "{format:?}: {texel}");
            }
            assert!(loaded.warnings.is_empty());
        }
    }

    #[test]
    fn pictures_for_screens_are_decoded_from_srgb() {
        let grey = DynamicImage::ImageRgb8(ImageBuffer::from_pixel(2, 1, Rgb([188u8, 255, 0])));
        let loaded = decode(&file(&grey, ImageFormat::Png), &Limits::default()).unwrap();
        let texel = loaded.panorama.texels[0];
        assert!((texel[0] - 0.5).abs() < 0.01 && texel[1] == 1.0 && texel[2] == 0.0);
    }

    #[test]
    fn every_code_of_8_and_16_bits_is_the_colour_that_the_formula_gives() {
        let narrow: Vec<u8> = (0..=255).flat_map(|code: u8| [code, 255 - code, code / 2]).collect();
        let wide: Vec<u16> = (0..=u16::MAX).flat_map(|code| [code, u16::MAX - code, code / 3]).collect();
        let pictures = [
            DynamicImage::ImageRgb8(ImageBuffer::from_raw(16, 16, narrow).unwrap()),
            DynamicImage::ImageRgb16(ImageBuffer::from_raw(256, 256, wide).unwrap()),
            DynamicImage::ImageRgba16(ImageBuffer::from_fn(2, 2, |x, y| ::image::Rgba([x as u16, 9000, y as u16, 7]))),
        ];
        for picture in pictures {
            let codes = picture.to_rgb32f();
            let expected = codes.as_raw().as_chunks::<3>().0.iter().map(|&codes| from_srgb(codes).to_array());
            assert!(linear(picture).into_iter().eq(expected));
        }
    }

    /// Builds an EXR of one colour in other primaries, repeated in each part.
    fn exr(colors: [[f32; 2]; 3], [r, g, b]: [f32; 3], parts: usize) -> Source {
        exr_of(colors, &[("R", r), ("G", g), ("B", b)], parts)
    }

    /// Builds an EXR of one or several parts with the given channels.
    fn exr_of(colors: [[f32; 2]; 3], channels: &[(&str, f32)], parts: usize) -> Source {
        use ::exr::prelude::*;
        let layer = |i: usize| {
            let channel = |(name, value): &(&str, f32)| AnyChannel::new(*name, FlatSamples::F32(vec![*value; 8]));
            let channels = AnyChannels::sort(channels.iter().map(channel).collect());
            Layer::new((4, 2), LayerAttributes::named(i.to_string().as_str()), Encoding::UNCOMPRESSED, channels)
        };
        let layers: Vec<_> = (0..parts).map(layer).collect();
        let [red, green, blue] = colors.map(|[x, y]| Vec2(x, y));
        let mut attributes = ImageAttributes::new(IntegerBounds::from_dimensions((4, 2)));
        attributes.chromaticities =
            Some(::exr::meta::attribute::Chromaticities { red, green, blue, white: Vec2(0.3127, 0.329) });
        let mut out = Cursor::new(Vec::new());
        Image::from_layers(attributes, layers).write().non_parallel().to_buffered(&mut out).unwrap();
        Source::new("sky.exr".into(), out.into_inner())
    }

    #[test]
    fn colours_of_other_primaries_become_rec_709() {
        let usual = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
        let p3 = [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]];
        let texel = |colors, color| decode(&exr(colors, color, 1), &Limits::default()).unwrap().panorama.texels[3];
        assert_eq!(texel(usual, [3.0, 0.5, 0.25]), [3.0, 0.5, 0.25]);
        let white = texel(p3, [2.0; 3]);
        assert!(white.iter().all(|c| (c - 2.0).abs() < 1e-5), "{white:?}");
        let red = texel(p3, [1.0, 0.0, 0.0]);
        assert!((red[0] - 1.2249).abs() < 1e-3 && red[1..] == [0.0, 0.0], "{red:?}");
    }

    #[test]
    fn what_is_negative_in_narrow_primaries_may_be_a_colour_of_rec_709() {
        let smpte = [[0.63, 0.34], [0.31, 0.595], [0.155, 0.07]];
        let loaded = decode(&exr(smpte, [-0.0554, 1.0364, 0.0044], 1), &Limits::default()).unwrap();
        let green = loaded.panorama.texels[0];
        assert!((green[1] - 1.0).abs() < 2e-3 && green[0].abs() < 2e-3 && green[2].abs() < 2e-3, "{green:?}");
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let xyz = decode(&exr([[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], [0.3, 0.3, 0.3], 1), &Limits::default()).unwrap();
        assert_eq!(xyz.warnings.len(), 0);
        let none = decode(&exr([[0.3, 0.3]; 3], [0.25; 3], 1), &Limits::default()).unwrap();
        assert_eq!((none.panorama.texels[0], none.warnings[0].code), ([0.25; 3], "env-colors"));
    }

    #[test]
    fn luminance_alone_is_grey() {
        let usual = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
        let loaded = decode(&exr_of(usual, &[("A", 0.5), ("Y", 7.25)], 1), &Limits::default()).unwrap();
        let panorama = loaded.panorama;
        assert_eq!((panorama.width, panorama.height, &panorama.texels[..]), (4, 2, &[[7.25; 3]; 8][..]));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let limits = Limits { image_pixels: 7, ..Limits::default() };
        assert!(decode(&exr_of(usual, &[("Y", 1.0)], 1), &limits).unwrap_err().to_string().contains("4×2"));
        assert!(decode(&exr_of(usual, &[("Z", 1.0)], 1), &Limits::default()).is_err());
    }

    #[test]
    fn parts_that_are_not_shown_are_told() {
        let usual = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]];
        let loaded = decode(&exr(usual, [1.0; 3], 2), &Limits::default()).unwrap();
        assert_eq!(
            loaded.warnings[0].to_string(),
            "sky.exr: has 2 parts, of which one is shown; keep only the panorama in it"
        );
    }

    #[test]
    fn a_photo_is_turned_as_its_camera_says() {
        use ::image::ImageEncoder;
        use ::image::codecs::jpeg::JpegEncoder;
        // Little-endian TIFF with one entry: orientation (0x112), a short, upside down.
        let exif = [b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".as_slice(), &[3, 0, 0, 0, 0, 0, 0, 0]].concat();
        let mut bytes = Vec::new();
        let mut encoder = JpegEncoder::new_with_quality(&mut bytes, 100);
        encoder.set_exif_metadata(exif).unwrap();
        let rows = [[250u8; 16 * 8 * 3], [5; 16 * 8 * 3]].concat();
        encoder.write_image(&rows, 16, 16, ::image::ExtendedColorType::Rgb8).unwrap();
        let loaded = decode(&Source::new("sky.jpg".into(), bytes), &Limits::default()).unwrap();
        let texels = &loaded.panorama.texels;
        assert!(texels[0][0] < 0.1 && texels[255][0] > 0.9, "{:?} {:?}", texels[0], texels[255]);
    }

    #[test]
    fn a_picture_that_less_memory_forbids_says_what_to_raise() {
        let whole = file(&bright(64, 32), ImageFormat::OpenExr);
        let limits = Limits { image_pixels: 2047, ..Limits::default() };
        let text = decode(&whole, &limits).unwrap_err().to_string();
        assert!(text.ends_with("where 1 to 2047 are allowed; raise --max-memory"), "{text}");
    }

    #[test]
    fn odd_shapes_and_numbers_are_told_and_mended() {
        let mut picture = Rgb32FImage::new(3, 3);
        picture.put_pixel(1, 1, Rgb([f32::NAN, -1.0, 7.0]));
        picture.put_pixel(2, 1, Rgb([f32::INFINITY, 1.0, 1.0]));
        let source = file(&DynamicImage::ImageRgb32F(picture), ImageFormat::OpenExr);
        let loaded = decode(&source, &Limits::default()).unwrap();
        let codes: Vec<_> = loaded.warnings.iter().map(|w| w.code.to_string()).collect();
        assert_eq!(codes, ["env-shape", "env-pixels"]);
        assert_eq!(loaded.panorama.texels[4..6], [[0.0, 0.0, 7.0], [0.0, 1.0, 1.0]]);
        assert!(loaded.warnings[1].text.starts_with("2 pixels"));
    }

    #[test]
    fn what_is_no_picture_damaged_or_too_large_is_refused_in_one_line() {
        let whole = file(&bright(64, 32), ImageFormat::OpenExr);
        let refused = |bytes: &[u8], limits: &Limits| {
            let source = Source::new("sky.exr".into(), bytes.to_vec());
            let text = decode(&source, limits).unwrap_err().to_string();
            assert!(text.starts_with("sky.exr: ") && !text.trim_end().contains('\n'), "{text}");
        };
        let usual = Limits::default();
        refused(b"", &usual);
        refused(b"o cube\nv 0 0 0\n", &usual);
        refused(&whole.bytes[..40], &usual);
        refused(&whole.bytes[..whole.bytes.len() / 2], &usual);
        refused(&whole.bytes, &Limits { image_pixels: 2047, ..usual });
        refused(&whole.bytes, &Limits { memory: 64 * 32 * 12, ..usual });
    }

    #[test]
    fn an_exr_is_as_large_as_its_data_whatever_part_of_them_it_shows() {
        let mut source = exr([[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], [1.0; 3], 1);
        // The last column of the data window: behind a name, a type and a size come two pairs of integers.
        let name = b"dataWindow\0box2i\0";
        let at = source.bytes.windows(name.len()).position(|bytes| bytes == name).unwrap() + name.len() + 4 + 8;
        assert_eq!(source.bytes[at..at + 4], 3i32.to_le_bytes());
        source.bytes[at..at + 4].copy_from_slice(&600_000_000i32.to_le_bytes());
        let error = decode(&source, &Limits::default()).unwrap_err().to_string();
        assert_eq!(error, "sky.exr: is 600000001×2 pixels where 1 to 268435456 are allowed; scale it down");
    }

    #[test]
    fn damaged_files_never_crash() {
        for format in [ImageFormat::Hdr, ImageFormat::OpenExr] {
            let whole = file(&bright(16, 8), format).bytes;
            let mut random = crate::math::random::Random::new(11);
            for _ in 0..300 {
                let mut bytes = whole.clone();
                for _ in 0..=random.below(4) {
                    let at = random.below(bytes.len());
                    bytes[at] = random.bits().to_le_bytes()[0];
                }
                let limits = Limits { memory: 1 << 24, ..Limits::default() };
                if let Err(error) = decode(&Source::new("sky".into(), bytes), &limits) {
                    let LoadError::Input(faults) = error else { panic!("{error} is told as a fault of reading") };
                    assert!(["env-unusable", OVER_MEMORY].contains(&faults[0].code), "{}", faults[0]);
                }
            }
        }
    }
}
