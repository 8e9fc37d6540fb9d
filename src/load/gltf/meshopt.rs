//! Compressed buffer views: EXT_meshopt_compression and KHR_meshopt_compression.
//!
//! The extension of a view names a stream in another buffer, which decodes to `count` elements of `byteStride` bytes: the
//! contents of the view. Accessors and images read these as if they had been in the file. The streams are those of A.
//! Kapoulkine's meshoptimizer, which also decodes them.

use super::buffers::Buffers;
use super::meshopt_codec::{Filter, Mode, Shape, decode};
use super::schema::whole;
use crate::load::Diagnostic;
use crate::load::limits::Budget;
use gltf::json::{Root, buffer};
use rayon::prelude::*;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::path::Path;

/// The extension and its predecessor, with the same properties.
const NAMES: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// Remedy for a stream that cannot be decoded.
const REMEDY: &str = "get the file again, or export it without meshopt compression";

/// Contents of compressed views by view index, or the reason why they could not be decoded.
pub(super) type Decoded = HashMap<usize, Result<Vec<u8>, Diagnostic>>;

/// Returns the extension of a view, with its name, if it has one.
pub(super) fn extension(view: &buffer::View) -> Option<(&'static str, &Map<String, Value>)> {
    let others = &view.extensions.as_ref()?.others;
    NAMES.iter().find_map(|name| Some((*name, others.get(*name)?.as_object()?)))
}

/// Returns whether a buffer is declared as the fallback of compressed views.
pub(super) fn is_stand_in(buffer: &buffer::Buffer) -> bool {
    let flag = |name: &str| buffer.extensions.as_ref()?.others.get(name)?.get("fallback")?.as_bool();
    NAMES.iter().any(|name| flag(name) == Some(true))
}

/// Returns whether the file declares that it cannot be drawn without decoding.
pub(super) fn is_required(root: &Root) -> bool {
    root.extensions_required.iter().any(|name| NAMES.contains(&name.as_str()))
}

/// Decodes every compressed view, in parallel, within `budget`.
pub(super) fn decode_views(root: &Root, buffers: &Buffers, file: &Path, budget: &mut Budget) -> Decoded {
    let views = root.buffer_views.iter().enumerate();
    let compressed = views.filter_map(|(i, view)| Some((Task { buffers, file, i, view }, extension(view)?)));
    let planned: Vec<_> =
        compressed.map(|(task, (name, properties))| (task.i, task.plan(name, properties, budget))).collect();
    let decoded = planned.into_par_iter().map(|(i, plan)| (i, plan.and_then(Plan::run)));
    decoded.collect()
}

/// One view to decode.
struct Task<'a> {
    buffers: &'a Buffers<'a>,
    file: &'a Path,
    i: usize,
    view: &'a buffer::View,
}

/// A stream that passed the checks before decoding.
struct Plan<'a> {
    bytes: &'a [u8],
    shape: Shape,
    /// Diagnostic for a stream that turns out to be damaged.
    fault: Diagnostic,
}

impl<'a> Task<'a> {
    /// Checks everything that can be checked before decoding, and charges the memory.
    fn plan(
        &self,
        name: &'static str,
        properties: &Map<String, Value>,
        budget: &mut Budget,
    ) -> Result<Plan<'a>, Diagnostic> {
        let bytes = self.stream(name, properties)?;
        let shape = self.shape(name, properties)?;
        let size = shape.size().ok_or_else(|| self.fault(name, ".count", "more elements than can be counted"))?;
        if size != self.view.byte_length.0 {
            let (count, stride, length) = (shape.count, shape.stride, self.view.byte_length.0);
            let text = format!("{count} elements of {stride} bytes are {size} bytes, but the view has {length}");
            return Err(self.fault(name, ".count", text));
        }
        if size > shape.largest(bytes.len() as u64) {
            let text = format!("{} bytes cannot decode to {size}", bytes.len());
            return Err(self.fault(name, ".count", text));
        }
        // Once as decoded elements, and once as bytes.
        budget.take(size, 2).map_err(|over| {
            let Diagnostic { file, place, text, .. } =
                self.fault(name, "", format!("the decoded view is too large: {over}"));
            Diagnostic::over_memory(file, place, text)
        })?;
        let text = format!("the stream does not decode to {} elements of {} bytes", shape.count, shape.stride);
        Ok(Plan { bytes, shape, fault: self.fault(name, "", text) })
    }

    /// Returns the compressed bytes.
    fn stream(&self, name: &str, properties: &Map<String, Value>) -> Result<&'a [u8], Diagnostic> {
        let number = |key: &str| properties.get(key).and_then(whole);
        let (Some(buffer), Some(length)) = (number("buffer"), number("byteLength")) else {
            return Err(self.fault(name, "", "nothing says which bytes are compressed"));
        };
        let offset = number("byteOffset").unwrap_or(0);
        let all = match usize::try_from(buffer).map(|i| self.buffers.buffer(i)) {
            Ok(Ok(bytes)) => bytes,
            Ok(Err(Some(why))) => return Err(why),
            Ok(Err(None)) | Err(_) => {
                return Err(self.fault(name, ".buffer", format!("buffer {buffer} has no bytes")));
            }
        };
        let end = offset.checked_add(length).and_then(|end| usize::try_from(end).ok());
        let range = usize::try_from(offset).ok().zip(end).and_then(|(start, end)| all.get(start..end));
        range.ok_or_else(|| {
            let text = format!("{length} bytes from byte {offset} on, but buffer {buffer} has only {}", all.len());
            self.fault(name, ".byteLength", text)
        })
    }

    /// Returns the shape of the decoded data, checked against the rules of the extension.
    fn shape(&self, name: &str, properties: &Map<String, Value>) -> Result<Shape, Diagnostic> {
        let number = |key: &str| properties.get(key).and_then(whole).unwrap_or(0);
        let word = |key: &str| properties.get(key).and_then(Value::as_str).unwrap_or_default();
        let mode = Mode::of(word("mode")).ok_or_else(|| self.fault(name, ".mode", "an unknown mode"))?;
        let filter = Filter::of(word("filter")).ok_or_else(|| self.fault(name, ".filter", "an unknown filter"))?;
        let shape = Shape { mode, filter, stride: number("byteStride"), count: number("count") };
        shape.check().map_err(|(part, text)| self.fault(name, part, text))?;
        Ok(shape)
    }

    fn fault(&self, name: &str, part: &str, text: impl Into<String>) -> Diagnostic {
        let place = format!("bufferViews[{}].extensions.{name}{part}", self.i);
        Diagnostic::new("gltf-meshopt", self.file, place, text).remedy(REMEDY)
    }
}

impl Plan<'_> {
    fn run(self) -> Result<Vec<u8>, Diagnostic> {
        decode(self.bytes, &self.shape).map_err(|why| {
            let text = format!("{}: {why}", self.fault.text);
            Diagnostic { text, ..self.fault }
        })
    }
}
