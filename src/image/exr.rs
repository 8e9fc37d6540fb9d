//! OpenEXR files: scene-linear Rec. 709, premultiplied alpha, one part, ZIP-compressed scan lines.
//!
//! | channel | type | what |
//! |---|---|---|
//! | `R G B A` | half or float | beauty |
//! | `albedo.R albedo.G albedo.B` | half or float | surface colour without light |
//! | `N.X N.Y N.Z` | half or float | unit shading normal, world space |
//! | `P.X P.Y P.Z` | float | position, world space |
//! | `Z` | float | distance along the view axis; infinite where nothing was hit |
//! | `id.prim id.instance` | uint | prim and instance; 4294967295 where nothing was hit |
//! | such as `tests.shadow` | uint or float | every other [`Channel`] |
//!
//! Layers are name prefixes within one flat part, no name is a bare number, and the beauty has the plain names: the
//! convention that compositing programs and libraries agree on. Equal pictures and metadata give equal bytes.

mod window;

use self::window::Window;
use super::metadata::MAX_TEXT;
use super::{Channel, ExrSamples, FileKind, ImageError, Layers, Metadata, Output, Picture, Values};
use crate::catch_panic::attempt;
use crate::math::primaries::Primaries;
use crate::math::{DMat3, DVec3};
use crate::threads;
use ::exr::image::{Blocks, Encoding, FlatSamples, Image, Layer};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::{AttributeValue, Chromaticities, LineOrder, Text};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Compression, LayerAttributes, ReadChannels, ReadLayers, SmallVec, Vec2, WritableImage, f16,
};
use std::io::{BufRead, Cursor};

/// Red, green, blue and white of Rec. 709 (ITU-R BT.709, 1990) in CIE x, y.
const REC_709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Names of three channels of one layer.
type Triple = [&'static str; 3];

const ALBEDO: Triple = ["albedo.R", "albedo.G", "albedo.B"];
const NORMAL: Triple = ["N.X", "N.Y", "N.Z"];
const POSITION: Triple = ["P.X", "P.Y", "P.Z"];

/// Encodes a picture as the bytes of an EXR file.
pub(super) fn encode(picture: &Picture, output: &Output, metadata: &Metadata) -> Result<Vec<u8>, ImageError> {
    let channels = AnyChannels::sort(channels(picture, output));
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let mut attributes = LayerAttributes::default();
    if !metadata.is_empty() {
        attributes.software_name = Some(text(&metadata.software()));
    }
    for (key, value) in metadata.iter() {
        attributes.other.insert(text(key), AttributeValue::Text(text(value)));
    }
    let size = (picture.width as usize, picture.height as usize);
    let mut image = Image::from_layer(Layer::new(size, attributes, encoding, channels));
    image.attributes.chromaticities = Some(REC_709);

    let mut file = Cursor::new(Vec::new());
    // The encoder would start threads of its own, as many as there are cores.
    let one_thread = rayon::current_num_threads() == 1;
    let writer = if one_thread { image.write().non_parallel() } else { image.write() };
    threads::anywhere(|| writer.to_buffered(&mut file)).map_err(|e| ImageError::encode(FileKind::Exr, e))?;
    let mut bytes = file.into_inner();
    sort_attributes(&mut bytes)
        .ok_or_else(|| ImageError::encode(FileKind::Exr, "the encoder's header is not understood"))?;
    Ok(bytes)
}

fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

fn channels(picture: &Picture, output: &Output) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
    let floats = |name: &str, values: Vec<f32>| AnyChannel::new(text(name), FlatSamples::F32(values));
    let color = |name: &str, values: Vec<f32>| match output.exr_samples {
        ExrSamples::Float => floats(name, values),
        ExrSamples::Half => AnyChannel::new(text(name), FlatSamples::F16(values.into_iter().map(half).collect())),
    };
    let ids = |name: &str, values: &[u32]| AnyChannel::new(text(name), FlatSamples::U32(values.to_vec()));

    let mut list = SmallVec::new();
    let beauty = match output.exr_samples {
        ExrSamples::Float => beauty(picture, output.background, |x| x).map(FlatSamples::F32),
        ExrSamples::Half => beauty(picture, output.background, half).map(FlatSamples::F16),
    };
    list.extend(
        ["R", "G", "B", "A"].into_iter().zip(beauty).map(|(name, samples)| AnyChannel::new(text(name), samples)),
    );
    let Some(layers) = &picture.layers else { return list };
    let axis = |values: &[[f32; 3]], i: usize| values.iter().map(|v| v[i]).collect::<Vec<f32>>();
    for i in 0..3 {
        if !layers.albedo.is_empty() {
            list.push(color(ALBEDO[i], axis(&layers.albedo, i)));
        }
        if !layers.normal.is_empty() {
            list.push(color(NORMAL[i], axis(&layers.normal, i)));
        }
        if !layers.position.is_empty() {
            list.push(floats(POSITION[i], axis(&layers.position, i)));
        }
    }
    if !layers.depth.is_empty() {
        list.push(floats("Z", layers.depth.clone()));
    }
    if !layers.prim.is_empty() {
        list.push(ids("id.prim", &layers.prim));
    }
    if !layers.instance.is_empty() {
        list.push(ids("id.instance", &layers.instance));
    }
    list.extend(layers.channels.iter().map(|channel| match &channel.values {
        Values::U32(values) => ids(&channel.name, values),
        Values::F32(values) => floats(&channel.name, values.clone()),
    }));
    list
}

/// Red, green, blue and alpha of all pixels as planes, each value converted by `stored`.
fn beauty<T>(picture: &Picture, background: Option<[f32; 3]>, stored: impl Fn(f32) -> T) -> [Vec<T>; 4] {
    let mut planes = [(); 4].map(|()| Vec::with_capacity(picture.beauty.len()));
    for (at, &pixel) in picture.beauty.iter().enumerate() {
        let pixel = over(pixel, background, picture.veil.get(at));
        // With few rays, noise around zero falls below it; programs that read pictures do not expect negative light.
        planes.iter_mut().zip(pixel).for_each(|(plane, x)| plane.push(stored(if x < 0.0 { 0.0 } else { x })));
    }
    planes
}

/// Largest finite half float.
pub const LARGEST_HALF: f32 = 65_504.0;

/// Nearest half float; light beyond the largest is clamped to it, as infinities spread through every later filter.
fn half(x: f32) -> f16 {
    f16::from_f32(if x.is_finite() { x.clamp(-LARGEST_HALF, LARGEST_HALF) } else { x })
}

/// Number of pixels that are brighter than half floats hold.
pub fn beyond_half(picture: &Picture) -> usize {
    let is_beyond = |pixel: &&[f32; 4]| pixel.iter().any(|&c| c.is_finite() && c > LARGEST_HALF);
    picture.beauty.iter().filter(is_beyond).count()
}

/// Composites a premultiplied pixel over a background.
fn over(pixel: [f32; 4], background: Option<[f32; 3]>, veil: Option<&[f32; 4]>) -> [f32; 4] {
    let Some(behind) = background else { return pixel };
    let (through, veil) = (1.0 - pixel[3], veil.copied().unwrap_or_default());
    let [r, g, b] = [0, 1, 2].map(|c| pixel[c] + behind[c] * through + veil[c]);
    [r, g, b, 1.0]
}

/// Sorts the header's attributes by name. The encoder keeps ours in a hash map, whose order
/// changes from run to run; the length stays, so that the offsets of the pixels stay right.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    /// Size of the magic number and the version, in bytes.
    const HEAD: usize = 8;
    let word = |at: usize| file[at..].iter().position(|&b| b == 0).map(|len| at + len + 1);
    let mut attributes = Vec::new();
    let mut at = HEAD;
    while *file.get(at)? != 0 {
        let size_at = word(word(at)?)?;
        let size = i32::from_le_bytes(file.get(size_at..size_at + 4)?.try_into().ok()?);
        let end = size_at + 4 + usize::try_from(size).ok()?;
        attributes.push(file.get(at..end)?.to_vec());
        at = end;
    }
    // Names end in a zero byte, so that comparing whole attributes compares names first.
    attributes.sort();
    file.get_mut(HEAD..at)?.copy_from_slice(&attributes.concat());
    Some(())
}

/// Entries of meshray among the attributes of the first part.
pub(super) fn read_metadata(file: impl BufRead) -> Result<Metadata, ImageError> {
    let meta = MetaData::read_from_buffered(file, false).map_err(|e| ImageError::decode(FileKind::Exr, e))?;
    let mut metadata = Metadata::default();
    for header in meta.headers.iter().take(1) {
        for (key, value) in header.own_attributes.other.iter().chain(&header.shared_attributes.other) {
            if let AttributeValue::Text(value) = value
                && value.as_slice().len() <= MAX_TEXT
            {
                metadata.insert(&String::from_utf8_lossy(key.as_slice()), &String::from_utf8_lossy(value.as_slice()));
            }
        }
    }
    Ok(metadata)
}

/// Reads the first part of an EXR, at most `max_pixels`: beauty, the layers named in this module, and every other channel.
/// Also returns descriptions of what else the file holds and is not read.
///
/// Colours of other primaries are converted to Rec. 709. A picture of luminance alone (`Y`) is grey. Its chroma, which
/// has fewer values than there are pixels, is left out.
///
/// The stored pixels are placed in the display window as the file says; the rest of that window is clear, and its layers
/// say that nothing was hit.
pub(super) fn decode(bytes: &[u8], max_pixels: u64) -> Result<(Picture, Vec<String>), ImageError> {
    let fail = |e: ::exr::error::Error| ImageError::decode(FileKind::Exr, e);
    let meta = MetaData::read_from_buffered(bytes, false).map_err(fail)?;
    for header in &meta.headers {
        let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let Vec2(width, height) = header.layer_size;
        super::read::check_size(FileKind::Exr, side(width), side(height), max_pixels)?;
        let Vec2(width, height) = header.shared_attributes.display_window.size;
        super::read::check_size(FileKind::Exr, side(width), side(height), max_pixels)?;
        if header.deep {
            return Err(ImageError::decode(FileKind::Exr, "deep pixels are not supported"));
        }
    }
    let reader = ::exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel();
    let image = attempt(|| reader.from_buffered(Cursor::new(bytes)))
        .ok_or_else(|| ImageError::decode(FileKind::Exr, "it is damaged"))?
        .map_err(fail)?;
    let layer = &image.layer_data;
    let window = Window::of(layer.size, layer.attributes.layer_position, image.attributes.display_window);
    let channels = Channels { list: &layer.channel_data.list, len: layer.size.area(), window };
    let Vec2(width, height) = channels.window.size;
    let as_u32 = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (mut beauty, layers) = (channels.beauty()?, channels.layers());
    let mut left_out = channels.too_short();
    left_out.extend(channels.window.is_cropped().then(|| "pixels outside of the display window".to_owned()));
    match other_primaries(&meta).map(|primaries| primaries.to_rec_709()) {
        Some(Some(turned)) => beauty.iter_mut().for_each(|pixel| turn(turned, pixel)),
        Some(None) => left_out.push("chromaticities, which are those of no colours".into()),
        None => {}
    }
    left_out.extend(match meta.headers.len() {
        0 | 1 => None,
        2 => Some("part 2".to_owned()),
        parts => Some(format!("parts 2 to {parts}")),
    });
    Ok((Picture { layers, ..Picture::of(as_u32(width), as_u32(height), beauty) }, left_out))
}

/// Primaries of a file; `None` where it names none, or those of Rec. 709.
fn other_primaries(meta: &MetaData) -> Option<Primaries> {
    let said = meta.headers.first()?.shared_attributes.chromaticities?;
    let primaries = Primaries::of([said.red, said.green, said.blue, said.white].map(|at| [at.x(), at.y()]));
    (!primaries.are_near(&Primaries::REC_709)).then_some(primaries)
}

/// Transforms the colour of a pixel; premultiplication commutes with that.
#[expect(clippy::cast_possible_truncation, reason = "colours are stored so")]
fn turn(turned: DMat3, pixel: &mut [f32; 4]) {
    let [r, g, b, _] = pixel.map(f64::from);
    let color = turned * DVec3::new(r, g, b);
    [pixel[0], pixel[1], pixel[2]] = color.to_array().map(|c| c as f32);
}

/// The channels of a part, by name.
struct Channels<'a> {
    list: &'a [AnyChannel<FlatSamples>],
    /// Number of stored pixels.
    len: usize,
    window: Window,
}

impl Channels<'_> {
    fn find(&self, name: &str) -> Option<&FlatSamples> {
        let named = |c: &&AnyChannel<FlatSamples>| c.name.as_slice() == name.as_bytes();
        // Subsampled channels have fewer values and are skipped.
        self.list.iter().find(named).map(|c| &c.sample_data).filter(|s| s.len() == self.len)
    }

    /// Values of a channel in the display window, 0 where none are stored.
    fn floats(&self, name: &str) -> Option<Vec<f32>> {
        self.floats_or(name, 0.0)
    }

    /// Values of a channel in the display window, `outside` where none are stored.
    fn floats_or(&self, name: &str, outside: f32) -> Option<Vec<f32>> {
        self.find(name).map(|samples| self.window.shown(samples.values_as_f32().collect(), outside))
    }

    fn ids(&self, name: &str) -> Vec<u32> {
        match self.find(name) {
            Some(FlatSamples::U32(ids)) => self.window.shown(ids.clone(), u32::MAX),
            _ => Vec::new(),
        }
    }

    /// Names of the three colour channels: those of R, G and B that exist, or luminance for all three.
    fn colors(&self) -> Option<Triple> {
        let colors = ["R", "G", "B"];
        let is_there = |name: &&str| self.find(name).is_some();
        if colors.iter().any(is_there) { Some(colors) } else { is_there(&"Y").then_some(["Y"; 3]) }
    }

    fn beauty(&self) -> Result<Vec<[f32; 4]>, ImageError> {
        let Some(colors) = self.colors() else {
            let names: Vec<String> = self.list.iter().map(|c| c.name.to_string()).collect();
            let reason = format!("it has no colours (R, G, B or Y); its channels are {}", names.join(", "));
            return Err(ImageError::decode(FileKind::Exr, reason));
        };
        let all = |value: f32| self.window.shown(vec![value; self.len], 0.0);
        let or = |name: &str, default: f32| self.floats(name).unwrap_or_else(|| all(default));
        let ([r, g, b], a) = (colors.map(|name| or(name, 0.0)), or("A", 1.0));
        Ok((0..a.len()).map(|i| [r[i], g[i], b[i], a[i]]).collect())
    }

    fn triples(&self, names: Triple) -> Vec<[f32; 3]> {
        let [Some(x), Some(y), Some(z)] = names.map(|name| self.floats(name)) else { return Vec::new() };
        (0..x.len()).map(|i| [x[i], y[i], z[i]]).collect()
    }

    /// Names of the channels that are part of the beauty or of an array of [`Layers`].
    fn taken(&self) -> Vec<&'static str> {
        let whole = |names: Triple| names.iter().all(|name| self.find(name).is_some());
        let triples = [ALBEDO, NORMAL, POSITION].into_iter().filter(|names| whole(*names));
        let ids = ["id.prim", "id.instance"].into_iter();
        let ids = ids.filter(|name| matches!(self.find(name), Some(FlatSamples::U32(_))));
        self.colors().into_iter().chain(triples).flatten().chain(["A", "Z"]).chain(ids).collect()
    }

    /// Channels that have no array of their own in [`Layers`].
    fn others(&self) -> Vec<Channel> {
        let taken = self.taken();
        let other = |channel: &AnyChannel<FlatSamples>| {
            let name = channel.name.to_string();
            if taken.contains(&name.as_str()) || channel.sample_data.len() != self.len {
                return None;
            }
            let values = match &channel.sample_data {
                FlatSamples::U32(values) => Values::U32(self.window.shown(values.clone(), 0)),
                other => Values::F32(self.window.shown(other.values_as_f32().collect(), 0.0)),
            };
            Some(Channel { name, values })
        };
        self.list.iter().filter_map(other).collect()
    }

    /// Descriptions of the channels with fewer values than there are pixels.
    fn too_short(&self) -> Vec<String> {
        let short = self.list.iter().filter(|channel| channel.sample_data.len() != self.len);
        short.map(|channel| format!("channel {}, which is subsampled", channel.name)).collect()
    }

    fn layers(&self) -> Option<Layers> {
        let layers = Layers {
            albedo: self.triples(ALBEDO),
            normal: self.triples(NORMAL),
            position: self.triples(POSITION),
            depth: self.floats_or("Z", f32::INFINITY).unwrap_or_default(),
            prim: self.ids("id.prim"),
            instance: self.ids("id.instance"),
            channels: self.others(),
        };
        (layers != Layers::default()).then_some(layers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::meta::attribute::IntegerBounds;

    fn picture() -> Picture {
        let n = 35_u32;
        let triple = |k: f32| (0..n).map(|i| [i as f32 * k, -k, 1.0 / (i + 1) as f32]).collect::<Vec<_>>();
        let layers = Layers {
            albedo: triple(0.1),
            normal: triple(0.2),
            position: triple(1e7 + 0.5),
            depth: (0..n).map(|i| if i == 3 { f32::INFINITY } else { i as f32 * 1.000_1 }).collect(),
            prim: (0..n).map(|i| if i == 3 { u32::MAX } else { 16_777_217 + i }).collect(),
            instance: (0..n).collect(),
            channels: vec![
                Channel { name: "ms.shadow".into(), values: Values::F32((0..n).map(|i| i as f32 * 0.01).collect()) },
                Channel { name: "tests.shadow".into(), values: Values::U32((0..n).map(|i| 16_777_217 + i).collect()) },
            ],
        };
        let beauty = (0..n).map(|i| [i as f32 * 0.123, 1e-3, 70_000.0, 0.7]).collect();
        Picture { layers: Some(layers), ..Picture::of(7, 5, beauty) }
    }

    fn output(exr_samples: ExrSamples) -> Output {
        Output { exr_samples, exposure: 3.0, ..Output::default() }
    }

    #[test]
    fn pixels_that_half_floats_cannot_hold_are_counted() {
        let beauty =
            vec![[LARGEST_HALF, 0.0, 0.0, 1.0], [0.0, 65_505.0, 0.0, 1.0], [f32::INFINITY; 4], [1e9, 1e9, 0.0, 1.0]];
        assert_eq!(beyond_half(&Picture::of(2, 2, beauty)), 2);
    }

    #[test]
    fn floats_and_ids_come_back_bit_for_bit_whatever_the_tone_map_and_exposure() {
        let bytes = encode(&picture(), &output(ExrSamples::Float), &Metadata::new()).unwrap();
        assert_eq!(decode(&bytes, 35).unwrap(), (picture(), Vec::new()));
    }

    #[test]
    fn halves_are_near_and_never_infinite() {
        let bytes = encode(&picture(), &output(ExrSamples::Half), &Metadata::new()).unwrap();
        let (back, _) = decode(&bytes, 35).unwrap();
        for (a, b) in picture().beauty.iter().zip(&back.beauty) {
            assert!((a[0] - b[0]).abs() <= a[0] * 0.000_5 && b[2] == 65_504.0, "{a:?} {b:?}");
        }
        let (was, is) = (picture().layers.unwrap(), back.layers.unwrap());
        assert_eq!((was.position, was.depth, was.prim), (is.position, is.depth, is.prim));
    }

    #[test]
    fn channels_have_the_names_and_types_other_programs_read() {
        let bytes = encode(&picture(), &output(ExrSamples::Half), &Metadata::default()).unwrap();
        let meta = MetaData::read_from_buffered(bytes.as_slice(), true).unwrap();
        assert_eq!(meta.headers.len(), 1);
        let header = &meta.headers[0];
        let listed: Vec<String> =
            header.channels.list.iter().map(|c| format!("{}:{:?}", c.name, c.sample_type)).collect();
        let expected = "A:F16 B:F16 G:F16 N.X:F16 N.Y:F16 N.Z:F16 P.X:F32 P.Y:F32 P.Z:F32 R:F16 Z:F32 albedo.B:F16 \
                        albedo.G:F16 albedo.R:F16 id.instance:U32 id.prim:U32 ms.shadow:F32 tests.shadow:U32";
        assert_eq!(listed.join(" "), expected);
        assert_eq!(header.compression, Compression::ZIP16);
        assert!(header.own_attributes.software_name.is_none());
    }

    #[test]
    fn equal_pictures_are_equal_files() {
        let metadata = Metadata::new()
            .with(Metadata::INPUT, "a")
            .with(Metadata::INPUT_HASH, "b")
            .with(Metadata::SETTINGS, "c")
            .with(Metadata::COUNTS, "d");
        let encode = || encode(&picture(), &output(ExrSamples::Float), &metadata).unwrap();
        let first = encode();
        for _ in 0..8 {
            assert!(encode() == first);
        }
        assert_eq!(decode(&first, 35).unwrap().0, picture());
    }

    #[test]
    fn no_light_is_less_than_none_and_what_is_no_number_stays_so() {
        let picture = Picture::of(1, 1, vec![[-0.25, f32::NAN, 0.5, 1.0]]);
        let bytes = encode(&picture, &output(ExrSamples::Float), &Metadata::new()).unwrap();
        let [r, g, b, _] = decode(&bytes, 35).unwrap().0.beauty[0];
        assert!(r == 0.0 && g.is_nan() && b == 0.5, "{r} {g} {b}");
    }

    #[test]
    fn a_background_is_laid_behind_in_linear_light() {
        let picture = Picture::of(1, 1, vec![[2.0, 0.0, 0.25, 0.5]]);
        let output = Output { background: Some([1.0, 0.5, 0.0]), ..output(ExrSamples::Float) };
        let bytes = encode(&picture, &output, &Metadata::default()).unwrap();
        assert_eq!(decode(&bytes, 1).unwrap().0.beauty, vec![[2.5, 0.25, 0.25, 1.0]]);
    }

    /// Builds a foreign EXR with the given channels, two by two pixels, a part for each list.
    fn foreign(parts: &[&[(&str, FlatSamples)]]) -> Vec<u8> {
        foreign_in(None, parts)
    }

    fn foreign_in(chromaticities: Option<Chromaticities>, parts: &[&[(&str, FlatSamples)]]) -> Vec<u8> {
        let layer = |(number, channels): (usize, &&[(&str, FlatSamples)])| {
            let channel = |(name, samples): &(&str, FlatSamples)| AnyChannel::new(text(name), samples.clone());
            let channels = AnyChannels::sort(channels.iter().map(channel).collect());
            let attributes = LayerAttributes::named(text(&format!("part {number}")));
            Layer::new((2, 2), attributes, Encoding::UNCOMPRESSED, channels)
        };
        let layers: SmallVec<[_; 2]> = parts.iter().enumerate().map(layer).collect();
        let mut attributes = ::exr::meta::header::ImageAttributes::with_size((2, 2));
        attributes.chromaticities = chromaticities;
        let mut file = Cursor::new(Vec::new());
        Image::from_layers(attributes, layers).write().to_buffered(&mut file).unwrap();
        file.into_inner()
    }

    #[test]
    fn colors_of_other_primaries_become_those_of_rec_709() {
        let p3 = Chromaticities { red: Vec2(0.68, 0.32), green: Vec2(0.265, 0.69), ..REC_709 };
        let channels =
            [("R", 1.0), ("G", 0.0), ("B", 0.0)].map(|(name, value)| (name, FlatSamples::F32(vec![value; 4])));
        let of = |said| decode(&foreign_in(said, &[&channels]), 4).unwrap();
        let [plain, same, wider] = [None, Some(REC_709), Some(p3)].map(|said| of(said).0.beauty[0]);
        assert_eq!([plain, same], [[1.0, 0.0, 0.0, 1.0]; 2]);
        assert!(wider[0] > 1.2 && wider[1] < -0.04 && wider[3] == 1.0, "{wider:?}");
        let nowhere = Chromaticities { red: REC_709.white, green: REC_709.white, blue: REC_709.white, ..REC_709 };
        let (picture, left_out) = of(Some(nowhere));
        assert_eq!((picture.beauty[0], left_out.len()), (plain, 1));
    }

    #[test]
    fn pixels_lie_where_the_windows_say_and_what_is_not_shown_is_named() {
        let numbers = |n: usize| FlatSamples::F32((1..=n).map(|i| i as f32).collect());
        let of = |at: (i32, i32), (position, size): ((i32, i32), (usize, usize))| {
            let ids = FlatSamples::U32(vec![7; 6]);
            let channels = [("A", numbers(6)), ("R", numbers(6)), ("Z", numbers(6)), ("id.prim", ids)];
            let channels = channels.map(|(name, samples)| AnyChannel::new(text(name), samples));
            let mut attributes = LayerAttributes::named(text("part"));
            attributes.layer_position = Vec2(at.0, at.1);
            let channels = AnyChannels::sort(channels.into_iter().collect());
            let layer = Layer::new((3, 2), attributes, Encoding::UNCOMPRESSED, channels);
            let window = IntegerBounds::new(Vec2(position.0, position.1), Vec2(size.0, size.1));
            let attributes = ::exr::meta::header::ImageAttributes::new(window);
            let mut file = Cursor::new(Vec::new());
            Image::from_layers(attributes, SmallVec::from_elem(layer, 1)).write().to_buffered(&mut file).unwrap();
            let (picture, left_out) = decode(&file.into_inner(), 100).unwrap();
            let reds: Vec<f32> = picture.beauty.iter().map(|pixel| pixel[0]).collect();
            (picture, reds, left_out)
        };
        let (same, reds, left_out) = of((-4, 9), ((-4, 9), (3, 2)));
        assert_eq!(((same.width, same.height), reds), ((3, 2), vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        assert!(left_out.is_empty());

        let (within, reds, left_out) = of((-3, 10), ((-4, 9), (5, 3)));
        assert_eq!((within.width, within.height), (5, 3));
        let clear = 0.0;
        assert_eq!(reds[..5], [clear; 5]);
        assert_eq!(reds[5..], [clear, 1.0, 2.0, 3.0, clear, clear, 4.0, 5.0, 6.0, clear]);
        let layers = within.layers.unwrap();
        assert_eq!((within.beauty[6], within.beauty[4]), ([1.0, 0.0, 0.0, 1.0], [0.0; 4]));
        assert_eq!((layers.depth[6], layers.depth[4], layers.prim[6]), (1.0, f32::INFINITY, 7));
        assert_eq!((layers.prim[4], left_out.len()), (u32::MAX, 0));

        let (across, reds, left_out) = of((1, -1), ((0, 0), (2, 2)));
        assert_eq!((across.width, reds), (2, vec![clear, 4.0, clear, clear]));
        assert_eq!(left_out, ["pixels outside of the display window"]);
    }

    #[test]
    fn luminance_is_grey_and_a_file_without_colours_is_refused() {
        let grey = foreign(&[&[("Y", FlatSamples::F32(vec![0.0, 0.25, 0.5, 2.0]))]]);
        let (picture, left_out) = decode(&grey, 4).unwrap();
        assert_eq!((picture.beauty[3], picture.layers, left_out), ([2.0, 2.0, 2.0, 1.0], None, Vec::new()));
        let depth = foreign(&[&[("Z", FlatSamples::F32(vec![1.0; 4])), ("mask", FlatSamples::F32(vec![1.0; 4]))]]);
        let error = decode(&depth, 4).unwrap_err().to_string();
        assert!(error.contains("no colours") && error.ends_with("Z, mask"), "{error}");
    }

    #[test]
    fn every_channel_of_the_first_part_is_kept_and_what_is_not_read_is_named() {
        let halves = FlatSamples::F16([0.5, 1.0, 2.0, 4.0].map(f16::from_f32).to_vec());
        let floats = FlatSamples::F32(vec![3.0; 4]);
        let names = ["AO", "N.X", "R", "diffuse.R", "id.prim"];
        let first = names.map(|name| (name, if name == "diffuse.R" { halves.clone() } else { floats.clone() }));
        let (picture, left_out) = decode(&foreign(&[&first, &[("R", floats)]]), 4).unwrap();
        let channels = picture.layers.unwrap().channels;
        let kept: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
        assert_eq!(kept, ["AO", "N.X", "diffuse.R", "id.prim"]);
        assert_eq!(channels[2].values, Values::F32(vec![0.5, 1.0, 2.0, 4.0]));
        assert_eq!(left_out, ["part 2"]);
    }

    #[test]
    fn broken_files_are_errors_and_large_ones_refused() {
        let bytes = encode(&picture(), &output(ExrSamples::Half), &Metadata::new()).unwrap();
        assert!(decode(&bytes, 34).unwrap_err().to_string().contains("7×5"));
        for cut in 0..bytes.len() {
            assert!(decode(&bytes[..cut], 1000).is_err(), "cut at {cut}");
        }
        for at in 0..bytes.len() {
            let mut copy = bytes.clone();
            copy[at] ^= 0x41;
            let _ = decode(&copy, 1000);
        }
    }
}
