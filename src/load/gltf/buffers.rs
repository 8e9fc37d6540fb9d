//! Bytes of buffers and buffer views.

use super::codes::Code;
use super::meshopt::{self, Decoded};
use super::named::{Reader, Unread};
use super::report::Report;
use crate::load::Diagnostic;
use crate::load::diagnostic::DAMAGED;
use crate::load::limits::{Budget, OverBudget};
use crate::load::paths::{FileFault, Resolver, shorten};
use base64::Engine as _;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::{Index, Root, buffer};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Bytes of every buffer, or the reason why they are missing.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    slots: Vec<Slot<'a>>,
    /// Contents of compressed views, decoded.
    decoded: Decoded,
}

enum Slot<'a> {
    Bytes(Cow<'a, [u8]>),
    /// The bytes of another buffer that names the same file; its index.
    Same(usize),
    /// The file does not say where the bytes are, which the format allows; whatever needs them is left out.
    Nowhere(Diagnostic),
    Failed(Diagnostic),
}

impl<'a> Buffers<'a> {
    /// Reads all buffers and decodes compressed views. An unreadable buffer is a warning until something needs it.
    pub(super) fn load(
        root: &'a Root,
        bin: Option<&'a [u8]>,
        file: &Path,
        resolver: &mut Resolver,
        budget: &mut Budget,
        report: &mut Report,
    ) -> Self {
        let mut buffers = Self { root, slots: Vec::with_capacity(root.buffers.len()), decoded: Decoded::new() };
        let mut known: HashMap<&str, usize> = HashMap::new();
        let files = Reader { file, resolver, missed: 0 };
        let mut find = Find { bin, files, budget, report };
        let stand_ins = stand_ins(root);
        for (i, buffer) in root.buffers.iter().enumerate() {
            let named = buffer.uri.as_deref().filter(|uri| !is_data(uri));
            let slot = match named.and_then(|uri| known.get(uri)) {
                _ if stand_ins.contains(&i) => find.nowhere(i),
                Some(&other) => Slot::Same(other),
                None => find.one(i, buffer),
            };
            // Each name is looked up only once, found or not.
            let named = named.filter(|_| !stand_ins.contains(&i));
            named.into_iter().for_each(|uri| _ = known.entry(uri).or_insert(i));
            buffers.slots.push(slot);
            if let Some(bytes) = buffers.bytes(i) {
                check_length(i, buffer, bytes, find.report);
            }
        }
        buffers.decoded = meshopt::decode_views(root, &buffers, file, find.budget);
        if !meshopt::is_required(root) {
            buffers.stand_in(&stand_ins, &mut find);
        }
        buffers
    }

    /// Replaces views that could not be decoded by the uncompressed fallback in the file.
    fn stand_in(&mut self, stand_ins: &HashSet<usize>, find: &mut Find<'a, '_>) {
        let mut failed: Vec<usize> = self.decoded.iter().filter(|(_, bytes)| bytes.is_err()).map(|(i, _)| *i).collect();
        failed.sort_unstable();
        for i in failed {
            let Some(view) = self.root.buffer_views.get(i) else { continue };
            let from = view.buffer.value();
            let skipped = stand_ins.contains(&from) && matches!(self.slots.get(from), Some(Slot::Nowhere(_)));
            if let (true, Some(buffer)) = (skipped, self.root.buffers.get(from)) {
                self.slots[from] = find.one(from, buffer);
            }
            let whole = self.plain(view).is_ok_and(|bytes| bytes.len() as u64 == view.byte_length.0);
            if let (true, Some(Err(why))) = (whole, self.decoded.get(&i)) {
                find.report.warnings.push(why.clone().remedy("the uncompressed data in the file is drawn"));
                self.decoded.remove(&i);
            }
        }
    }

    /// Bytes of all buffers, each file counted once, and of all decoded views.
    pub(super) fn len(&self) -> u64 {
        let bytes = |slot: &Slot| if let Slot::Bytes(bytes) = slot { bytes.len() as u64 } else { 0 };
        let decoded = self.decoded.values().flatten().map(|bytes| bytes.len() as u64);
        self.slots.iter().map(bytes).chain(decoded).sum()
    }

    fn slot(&self, i: usize) -> Option<&Slot<'a>> {
        match self.slots.get(i) {
            Some(Slot::Same(other)) => self.slots.get(*other),
            slot => slot,
        }
    }

    fn bytes(&self, i: usize) -> Option<&[u8]> {
        match self.slot(i) {
            Some(Slot::Bytes(bytes)) => Some(bytes),
            _ => None,
        }
    }

    /// Bytes of a view, decoded if compressed, as far as they exist.
    ///
    /// # Errors
    /// The reason why there are none; `None` if the file does not say where they are.
    pub(super) fn view(&self, index: Index<buffer::View>) -> Result<&[u8], Option<Diagnostic>> {
        match self.decoded.get(&index.value()) {
            Some(decoded) => decoded.as_deref().map_err(|why| Some(why.clone())),
            None => self.plain(self.root.buffer_views.get(index.value()).ok_or(None)?),
        }
    }

    /// Bytes of a view as stored in its buffer.
    fn plain(&self, view: &buffer::View) -> Result<&[u8], Option<Diagnostic>> {
        let bytes = self.buffer(view.buffer.value())?;
        let offset = clamp(view.byte_offset.unwrap_or_default().0, bytes.len());
        let length = clamp(view.byte_length.0, bytes.len() - offset);
        Ok(&bytes[offset..offset + length])
    }

    /// Bytes of a buffer, at most its declared length.
    ///
    /// # Errors
    /// The reason why there are none; `None` if the file does not say where they are.
    pub(super) fn buffer(&self, i: usize) -> Result<&[u8], Option<Diagnostic>> {
        let bytes = match self.slot(i) {
            Some(Slot::Bytes(bytes)) => bytes,
            Some(Slot::Failed(why)) => return Err(Some(why.clone())),
            Some(Slot::Nowhere(_) | Slot::Same(_)) | None => return Err(None),
        };
        let declared = self.root.buffers.get(i).map_or(0, |b| b.byte_length.0);
        Ok(&bytes[..clamp(declared, bytes.len())])
    }

    /// Diagnostic for a view whose buffer has no stated location; `None` for other views.
    pub(super) fn nowhere(&self, index: Index<buffer::View>) -> Option<Diagnostic> {
        match self.slots.get(self.root.buffer_views.get(index.value())?.buffer.value()) {
            Some(Slot::Nowhere(why)) => Some(why.clone()),
            _ => None,
        }
    }
}

/// Indices of fallback buffers, which are read only when a compressed view cannot be decoded.
fn stand_ins(root: &Root) -> HashSet<usize> {
    let declared = root.buffers.iter().enumerate().filter(|(_, buffer)| meshopt::is_stand_in(buffer));
    let mut found: HashSet<usize> = declared.map(|(i, _)| i).collect();
    let plain = root.buffer_views.iter().filter(|view| meshopt::extension(view).is_none());
    plain.for_each(|view| _ = found.remove(&view.buffer.value()));
    found
}

/// Minimum of both, as `usize`.
fn clamp(wanted: u64, end: usize) -> usize {
    usize::try_from(wanted).map_or(end, |wanted| wanted.min(end))
}

/// Sources of buffers' bytes.
struct Find<'a, 'b> {
    bin: Option<&'a [u8]>,
    files: Reader<'b>,
    budget: &'b mut Budget,
    report: &'b mut Report,
}

impl<'a> Find<'a, '_> {
    fn one(&mut self, i: usize, buffer: &buffer::Buffer) -> Slot<'a> {
        let place = format!("buffers[{i}]");
        match (&buffer.uri, self.bin) {
            (None, Some(bin)) if i == 0 => Slot::Bytes(Cow::Borrowed(bin)),
            (None, _) => self.nowhere(i),
            (Some(uri), _) if is_data(uri) => self.data(uri, &format!("{place}.uri")),
            (Some(uri), _) => self.named(uri, &format!("{place}.uri")),
        }
    }

    /// Slot of a buffer without a stated location, or of a fallback buffer that is not needed yet.
    fn nowhere(&self, i: usize) -> Slot<'a> {
        let text = "nothing says where its bytes are; what needs them is left out";
        Slot::Nowhere(Diagnostic::new("gltf-buffer-nowhere", self.files.file, format!("buffers[{i}]"), text))
    }

    fn data(&mut self, uri: &str, place: &str) -> Slot<'a> {
        let kind = media_type(uri);
        if !["", "application/octet-stream", "application/gltf-buffer"].contains(&kind) {
            let text = format!("a data URI of type '{}' where bytes should be", shorten(kind));
            self.report.add(Code::BufferDataUriMimeTypeInvalid, place, text);
        }
        // Decoded data is no longer than the URI.
        if let Err(over) = self.budget.take(uri.len() as u64, 1) {
            return self.too_large(place, over);
        }
        match decode_data(uri) {
            Ok(bytes) => Slot::Bytes(Cow::Owned(bytes)),
            Err(why) => {
                let text = format!("the data URI '{}' cannot be decoded: {}", shorten(uri), why.trim_end_matches('.'));
                self.report.refuse_with(Code::InvalidUri, place, text.clone(), DAMAGED);
                Slot::Failed(Diagnostic::new(Code::InvalidUri.name(), self.files.file, place, text).remedy(DAMAGED))
            }
        }
    }

    fn named(&mut self, uri: &str, place: &str) -> Slot<'a> {
        match self.files.read(uri, place, self.budget, &mut self.report.warnings) {
            Ok(bytes) => Slot::Bytes(Cow::Owned(bytes)),
            Err(Unread::TooLarge(over)) => self.too_large(place, over),
            Err(Unread::Fault(why)) => self.failed(&why, place),
        }
    }

    fn failed(&mut self, why: &FileFault, place: &str) -> Slot<'a> {
        let fault = why.diagnose(self.files.file, place);
        match why {
            FileFault::BadUri(_) => self.report.add(Code::InvalidUri, &fault.place, fault.text.clone()),
            _ => self.report.warnings.push(fault.clone()),
        }
        Slot::Failed(fault)
    }

    fn too_large(&mut self, place: &str, over: OverBudget) -> Slot<'a> {
        let fault = Diagnostic::over_memory(self.files.file, place, format!("the buffer is too large: {over}"));
        self.report.warnings.push(fault.clone());
        Slot::Failed(fault)
    }
}

fn check_length(i: usize, buffer: &buffer::Buffer, bytes: &[u8], report: &mut Report) {
    let declared = buffer.byte_length.0;
    if (bytes.len() as u64) < declared {
        let uri = buffer.uri.as_deref().filter(|uri| !is_data(uri));
        let file = uri.map_or(String::new(), |uri| format!(" in '{}'", shorten(uri)));
        let text = format!("{declared} bytes are declared, {} are there{file}", bytes.len());
        report.add(Code::BufferByteLengthMismatch, format!("buffers[{i}]"), text);
    }
}

/// Returns whether a URI contains its data.
pub(super) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// Decodes a `data:` URI (RFC 2397), base64 or percent-encoded, with or without padding.
pub(super) fn decode_data(uri: &str) -> Result<Vec<u8>, String> {
    const LENIENT: GeneralPurpose = GeneralPurpose::new(
        &alphabet::STANDARD,
        GeneralPurposeConfig::new()
            .with_decode_padding_mode(DecodePaddingMode::Indifferent)
            .with_decode_allow_trailing_bits(true),
    );
    let (kind, data) = uri.get(5..).and_then(|rest| rest.split_once(',')).ok_or("there is no comma")?;
    let raw: Cow<[u8]> =
        if data.contains('%') { percent_encoding::percent_decode_str(data).into() } else { data.as_bytes().into() };
    let is_base64 = kind.rsplit(';').next().is_some_and(|last| last.trim().eq_ignore_ascii_case("base64"));
    if !is_base64 {
        return Ok(raw.into_owned());
    }
    let decoded = if raw.iter().any(u8::is_ascii_whitespace) {
        LENIENT.decode(raw.iter().copied().filter(|b| !b.is_ascii_whitespace()).collect::<Vec<_>>())
    } else {
        LENIENT.decode(&raw)
    };
    decoded.map_err(|e| e.to_string())
}

/// The media type of a `data:` URI.
pub(super) fn media_type(uri: &str) -> &str {
    let head = uri.get(5..).and_then(|rest| rest.split(',').next()).unwrap_or_default();
    head.split(';').next().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_uris_may_be_base64_or_percent_encoded() {
        for uri in [
            "data:application/octet-stream;base64,AQID/w==",
            "data:;base64,AQID/w",
            "DATA:a/b;base64,AQID%2Fw==",
            "data:a/b;charset=x;base64,AQ ID/w==",
            "data:,%01%02%03%FF",
        ] {
            assert_eq!(decode_data(uri).unwrap(), [1, 2, 3, 255], "{uri}");
        }
        assert!(decode_data("data:").is_err());
        assert!(decode_data("data:;base64,a*b=").is_err());
        assert_eq!(media_type("data:image/png;base64,AA"), "image/png");
    }
}
