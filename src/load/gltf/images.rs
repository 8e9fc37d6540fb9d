//! The encoded pictures of a file: located, checked against their declarations, and decoded where they are drawn.

use super::buffers::{Buffers, decode_data, is_data, media_type};
use super::codes::Code;
use super::gloss;
use super::named::{Reader, Unread};
use super::report::Report;
use super::schema::position;
use super::textures::Picture;
use crate::load::limits::{Budget, Limits, OverBudget};
use crate::load::paths::Resolver;
use crate::load::texture::{Encoded, Unusable, decode_all, format_of, take_memory};
use crate::load::{Diagnostic, ktx};
use crate::scene::{Bitmap, Pixels};
use crate::stopwatch::Spent;
use ::image::ImageFormat;
use gltf::json::{Index, Root, image::Image, texture::Texture};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Bytes of every image that is drawn or embedded in the file.
pub(super) struct Images<'a> {
    bytes: Vec<Option<Cow<'a, [u8]>>>,
    /// Images that name the same file as an earlier one, and the index of that one, which holds the bytes.
    same: HashMap<usize, usize>,
}

impl<'a> Images<'a> {
    /// Loads the bytes; external files are read only for images that are drawn or declare their type.
    pub(super) fn load(
        root: &Root,
        buffers: &'a Buffers<'a>,
        drawn: &[Picture],
        file: &Path,
        resolver: &mut Resolver,
        budget: &mut Budget,
        report: &mut Report,
    ) -> Self {
        let mut images = Self { bytes: Vec::new(), same: HashMap::new() };
        let drawn: HashSet<usize> = drawn.iter().map(|picture| picture.image).collect();
        let mut known: HashMap<&str, usize> = HashMap::new();
        let mut find = Find { buffers, files: Reader { file, resolver, missed: 0 }, budget, report };
        for (i, image) in root.images.iter().enumerate() {
            let named = image.uri.as_deref().filter(|uri| !is_data(uri));
            let drawn = drawn.contains(&i);
            if let Some(&other) = named.and_then(|uri| known.get(uri)) {
                images.same.insert(i, other);
                images.bytes.push(None);
            } else {
                images.bytes.push(find.bytes(i, image, drawn));
                // Each name is looked up only once, found or not.
                known.extend(named.filter(|_| is_wanted(image, drawn)).map(|uri| (uri, i)));
            }
            if let Some(bytes) = images.of(i) {
                check_kind(root, i, image, bytes, find.report);
            }
        }
        check_textures(root, &images, report);
        images
    }

    /// Bytes of an image, if they were loaded.
    fn of(&self, i: usize) -> Option<&[u8]> {
        self.bytes.get(self.same.get(&i).copied().unwrap_or(i)).and_then(Option::as_deref)
    }

    /// Makes the requested pictures, decoding each image once; also returns the time that took.
    pub(super) fn decode(
        &self,
        root: &Root,
        drawn: &[Picture],
        file: &Path,
        limits: &Limits,
        budget: &mut Budget,
        report: &mut Report,
    ) -> (Vec<Option<Bitmap>>, Spent) {
        let (mut encoded, mut places) = (Vec::new(), HashMap::new());
        for &Picture { image: i, .. } in drawn {
            let Some(bytes) = self.of(i).filter(|_| !places.contains_key(&i)) else { continue };
            places.insert(i, encoded.len());
            let name = root.images.get(i).map(|image| name_of(i, image)).unwrap_or_default();
            encoded.push(Encoded { name, place: format!("images[{i}]"), bytes: Cow::Borrowed(bytes) });
        }
        let (mut bitmaps, spent) = decode_all(&encoded, file, limits, budget, &mut report.warnings);
        let mut made: Vec<Option<Bitmap>> = drawn.iter().map(|_| None).collect();
        let place = |picture: &Picture| places.get(&picture.image).copied();
        for (made, picture) in made.iter_mut().zip(drawn) {
            let decoded = place(picture).and_then(|at| bitmaps[at].as_ref());
            let (Some(gloss), Some(bitmap)) = (picture.gloss(), decoded) else { continue };
            match charge(bitmap, limits, budget) {
                Ok(()) => *made = Some(gloss::roughness(bitmap, gloss)),
                Err(why) => {
                    let place = format!("images[{}]", picture.image);
                    report.warnings.push(why.warning(&bitmap.name, file, &place));
                }
            }
        }
        // Unchanged bitmaps are taken last, when no roughness map is derived from them any more.
        for (made, picture) in made.iter_mut().zip(drawn).filter(|(_, picture)| picture.gloss().is_none()) {
            *made = place(picture).and_then(|at| bitmaps[at].take());
        }
        (made, spent)
    }
}

/// Charges the memory of a picture's roughness map.
fn charge(bitmap: &Bitmap, limits: &Limits, budget: &mut Budget) -> Result<(), Unusable> {
    let bytes = match bitmap.pixels {
        // Without alpha the map is one texel.
        Pixels::Rgb8(_) => return Ok(()),
        Pixels::Rgba8(_) => 4,
        Pixels::Rgba16(_) => 8,
    };
    take_memory(bitmap.width, bitmap.height, bytes, 0, limits, budget)
}

/// Sources of images' bytes.
struct Find<'a, 'b> {
    buffers: &'a Buffers<'a>,
    files: Reader<'b>,
    budget: &'b mut Budget,
    report: &'b mut Report,
}

impl<'a> Find<'a, '_> {
    fn bytes(&mut self, i: usize, image: &Image, drawn: bool) -> Option<Cow<'a, [u8]>> {
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) if is_data(uri) => self.data(i, uri).map(Cow::Owned),
            (Some(uri), _) if is_wanted(image, drawn) => self.named(i, uri).map(Cow::Owned),
            (None, Some(view)) => {
                let bytes = self.buffers.view(view).ok().map(Cow::Borrowed);
                if bytes.is_none() && drawn {
                    self.report.add(Code::ImageDataInvalid, format!("images[{i}]"), "its bytes are not there");
                }
                bytes
            }
            _ => None,
        }
    }

    fn named(&mut self, i: usize, uri: &str) -> Option<Vec<u8>> {
        let place = format!("images[{i}].uri");
        match self.files.read(uri, &place, self.budget, &mut self.report.warnings) {
            Ok(bytes) => return Some(bytes),
            Err(Unread::TooLarge(over)) => self.leave_out(i, over),
            Err(Unread::Fault(why)) => self.report.warnings.push(why.diagnose(self.files.file, &place)),
        }
        None
    }

    /// Charges `bytes` to the budget; if they exceed it, the image is left out with a warning.
    fn fits(&mut self, i: usize, bytes: usize) -> bool {
        let Err(over) = self.budget.take(bytes as u64, 1) else { return true };
        self.leave_out(i, over);
        false
    }

    fn leave_out(&mut self, i: usize, over: OverBudget) {
        let text = format!("the image is too large: {over}");
        self.report.warnings.push(Diagnostic::over_memory(self.files.file, format!("images[{i}]"), text));
    }

    fn data(&mut self, i: usize, uri: &str) -> Option<Vec<u8>> {
        let place = format!("images[{i}].uri");
        let kind = media_type(uri);
        if !kind.is_empty() && !kind.starts_with("image/") && kind != "application/octet-stream" || kind == "image/gif"
        {
            self.report.add(Code::InvalidUri, &place, format!("a data URI of type '{kind}' is no glTF image"));
        }
        if !self.fits(i, uri.len()) {
            return None;
        }
        match decode_data(uri) {
            Ok(bytes) => Some(bytes),
            Err(why) => {
                self.report.add(Code::InvalidUri, place, format!("it is no data URI: {why}"));
                None
            }
        }
    }
}

/// Returns whether an external file should be read: to be drawn, or to check its declared type.
fn is_wanted(image: &Image, drawn: bool) -> bool {
    drawn || image.mime_type.is_some()
}

fn name_of(i: usize, image: &Image) -> String {
    let uri = image.uri.as_ref().filter(|uri| !is_data(uri));
    uri.or(image.name.as_ref()).filter(|n| !n.is_empty()).cloned().unwrap_or_else(|| format!("images[{i}]"))
}

/// Media type of an image by its bytes and name, among the kinds that glTF files contain.
fn kind_of(name: &str, bytes: &[u8]) -> Option<&'static str> {
    match format_of(name, bytes) {
        Some(ImageFormat::Png) => Some("image/png"),
        Some(ImageFormat::Jpeg) => Some("image/jpeg"),
        Some(ImageFormat::WebP) => Some("image/webp"),
        Some(ImageFormat::Bmp) => Some("image/bmp"),
        Some(ImageFormat::Tga) => Some("image/x-tga"),
        _ if ktx::is(bytes) => Some("image/ktx2"),
        _ if bytes.starts_with(b"DDS ") => Some("image/vnd-ms.dds"),
        _ => None,
    }
}

/// Kinds of images that only textures with an extension may use: extension, media type, name.
const EXTENDED: [(&str, &str, &str); 2] =
    [("EXT_texture_webp", "image/webp", "WebP"), ("KHR_texture_basisu", "image/ktx2", "KTX2")];

/// Compares the declared type of an image with its bytes.
fn check_kind(root: &Root, i: usize, image: &Image, bytes: &[u8], report: &mut Report) {
    let place = format!("images[{i}]");
    let Some(kind) = kind_of(&name_of(i, image), bytes) else {
        return report.add(Code::ImageUnrecognizedFormat, place, "its bytes are no image of a known kind");
    };
    let declared = image.mime_type.as_ref().map(|m| m.0.as_str());
    let of_uri = image.uri.as_deref().filter(|uri| is_data(uri)).map(media_type).filter(|m| m.starts_with("image/"));
    if let Some(other) = declared.into_iter().chain(of_uri).find(|d| *d != kind && *d != "image/gif") {
        let text = format!("declared as {}, its bytes are {kind}", crate::load::paths::shorten(other));
        report.add(Code::ImageMimeTypeInvalid, &place, text);
    }
    let is_declared = |extension: &str| root.extensions_used.iter().any(|e| e == extension);
    if let Some((extension, _, name)) = EXTENDED.iter().find(|e| e.1 == kind && !is_declared(e.0)) {
        report.add(Code::ImageNonEnabledMimeType, place, format!("{name} needs {extension}, which is not declared"));
    }
}

/// Checks that each reference of a texture leads to an image of the kind that it requires.
fn check_textures(root: &Root, images: &Images, report: &mut Report) {
    let kind = |i: usize| kind_of(&name_of(i, root.images.get(i)?), images.of(i)?);
    for (i, texture) in root.textures.iter().enumerate() {
        let plain = kind(texture.source.value()).filter(|k| !["image/png", "image/jpeg"].contains(k));
        if let Some(kind) = plain {
            let is_extended = EXTENDED.iter().any(|(_, extended, _)| *extended == kind) || kind == "image/vnd-ms.dds";
            let text = if is_extended { "needs an extension" } else { "is no kind of image that glTF files hold" };
            let place = format!("textures[{i}].source");
            report.add(Code::TextureInvalidImageMimeType, place, format!("{kind} {text}"));
        }
        for (extension, right, name) in EXTENDED {
            if let Some(kind) = extension_source(texture, extension).and_then(kind).filter(|k| *k != right) {
                let place = format!("textures[{i}].extensions.{extension}.source");
                report.add(Code::TextureInvalidImageMimeType, place, format!("{kind} is no {name}"));
            }
        }
    }
}

fn extension_source(texture: &Texture, name: &str) -> Option<usize> {
    let extensions = texture.extensions.as_ref()?;
    position(extensions.others.get(name)?.get("source")?)
}

/// Image of a texture, in order of preference: WebP, the plain one, KTX2, whose compression loses detail, and at last DDS, which
/// cannot be decoded.
pub(super) fn image_of(root: &Root, texture: Index<Texture>) -> Option<usize> {
    let texture = root.textures.get(texture.value())?;
    let plain = Some(texture.source.value()).filter(|&i| i < root.images.len());
    extension_source(texture, "EXT_texture_webp")
        .or(plain)
        .or_else(|| ["KHR_texture_basisu", "MSFT_texture_dds"].iter().find_map(|name| extension_source(texture, name)))
}
