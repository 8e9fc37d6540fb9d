//! Primitives that are compressed as a whole: KHR_draco_mesh_compression.
//!
//! The extension names a stream, and for each attribute in it an accessor that says how many values of what type the
//! attribute has. Decoded values are kept by accessor, so that whatever reads the accessor sees them; attributes that
//! the extension does not list, and morph targets, are ordinary accessors. The order of vertices is that of the stream.

use super::accessor::Format;
use super::buffers::Buffers;
use super::draco_codec::{self, Output, Wanted};
use super::draco_stream;
use super::report::Report;
use super::schema::whole;
use crate::load::Diagnostic;
use crate::load::limits::Budget;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use rayon::prelude::*;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::path::Path;

const NAME: &str = "KHR_draco_mesh_compression";

/// What to do about a file that cannot be read as it is.
const REMEDY: &str = "get the file again, or export it without Draco compression";

/// The decoded bytes of accessors, packed, in the type that each accessor declares.
#[derive(Default)]
pub(super) struct Decoded(HashMap<usize, Vec<u8>>);

impl Decoded {
    /// Decodes every compressed primitive, in parallel, within `budget`.
    ///
    /// One that cannot be decoded refuses the file, unless the file has the same data uncompressed.
    pub(super) fn load(root: &Root, buffers: &Buffers, file: &Path, budget: &mut Budget, report: &mut Report) -> Self {
        let mut plans = Vec::new();
        let mut owners = HashMap::new();
        for (i, mesh) in root.meshes.iter().enumerate() {
            for (k, primitive) in mesh.primitives.iter().enumerate() {
                let Some(properties) = extension(primitive) else { continue };
                let place = format!("meshes[{i}].primitives[{k}].extensions.{NAME}");
                let task = Task { root, buffers, file, primitive, properties, place };
                match task.plan(&mut owners, budget) {
                    Ok(plan) => plans.extend(plan),
                    Err(why) => task.failed(why, report),
                }
            }
        }
        let outputs: Vec<_> = plans.into_par_iter().map(|plan| (plan.run(), plan)).collect();
        let mut decoded = Self::default();
        for (output, plan) in outputs {
            match output {
                Ok(output) => decoded.keep(plan, output),
                Err(text) => plan.task.failed(plan.task.fault("", text), report),
            }
        }
        decoded
    }

    /// The values of an accessor, if it was decoded.
    pub(super) fn of(&self, accessor: usize) -> Option<&[u8]> {
        self.0.get(&accessor).map(Vec::as_slice)
    }

    /// Bytes that were decoded.
    pub(super) fn len(&self) -> u64 {
        self.0.values().map(|bytes| bytes.len() as u64).sum()
    }

    fn keep(&mut self, plan: Plan, output: Output) {
        self.0.insert(plan.indices, output.indices);
        self.0.extend(plan.accessors.into_iter().zip(output.attributes));
    }
}

/// The extension of a primitive, if it has one.
fn extension(primitive: &Primitive) -> Option<&Map<String, Value>> {
    primitive.extensions.as_ref()?.others.get(NAME)?.as_object()
}

/// One primitive to decode.
struct Task<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    file: &'a Path,
    primitive: &'a Primitive,
    properties: &'a Map<String, Value>,
    /// JSON path of the extension.
    place: String,
}

/// A stream whose sizes have been found to fit.
struct Plan<'a> {
    task: Task<'a>,
    bytes: &'a [u8],
    /// The accessor of the indices, and how these are kept.
    indices: usize,
    index_type: ComponentType,
    /// The accessors of the attributes, and what is wanted of each.
    accessors: Vec<usize>,
    wanted: Vec<Wanted>,
}

/// What an accessor shows: the number of a compressed view, and in its stream an attribute, or the indices (`None`).
type Part = (usize, Option<u64>);

impl<'a> Task<'a> {
    /// Checks everything that can be known before decoding, and takes the memory; `None`: an earlier primitive shows
    /// the same.
    fn plan(&self, owners: &mut HashMap<usize, Part>, budget: &mut Budget) -> Result<Option<Plan<'a>>, Diagnostic> {
        let (view, bytes) = self.stream()?;
        let (indices, index_type, corners) = self.indices()?;
        let (accessors, wanted) = self.attributes();
        let shown = accessors.iter().zip(&wanted).map(|(&accessor, w)| (accessor, (view, Some(w.id))));
        if !self.claim(shown.chain([(indices, (view, None))]).collect(), owners)? {
            return Ok(None);
        }
        let (counts, ..) = draco_stream::start(bytes).map_err(|text| self.fault("", text))?;
        let vertices = wanted.first().map_or(0, |w| w.count);
        counts.agree(corners, vertices).map_err(|text| self.fault("", text))?;
        let kept = wanted.iter().map(Wanted::size).fold(corners.saturating_mul(4), u64::saturating_add);
        self.charge(counts.cost(vertices, (wanted.len() + draco_codec::SPARE) as u64).saturating_add(kept), budget)?;
        let task = Task { place: self.place.clone(), ..*self };
        Ok(Some(Plan { task, bytes, indices, index_type, accessors, wanted }))
    }

    /// Notes what each accessor shows; `false`: all of it was noted before.
    fn claim(&self, shown: Vec<(usize, Part)>, owners: &mut HashMap<usize, Part>) -> Result<bool, Diagnostic> {
        let mut new = false;
        for (accessor, part) in shown {
            match owners.insert(accessor, part) {
                Some(other) if other != part => {
                    let text = format!("accessor {accessor} stands for two different parts of Draco streams");
                    return Err(self.fault("", text));
                }
                known => new |= known.is_none(),
            }
        }
        Ok(new)
    }

    fn charge(&self, bytes: u64, budget: &mut Budget) -> Result<(), Diagnostic> {
        budget.take(bytes, 1).map_err(|over| {
            let Diagnostic { file, place, text, .. } =
                self.fault("", format!("the decoded primitive is too large: {over}"));
            Diagnostic::over_memory(file, place, text)
        })
    }

    /// The number of the compressed view, and its bytes.
    fn stream(&self) -> Result<(usize, &'a [u8]), Diagnostic> {
        let number = self.properties.get("bufferView").and_then(whole).and_then(|i| u32::try_from(i).ok());
        let view = number.ok_or_else(|| self.fault(".bufferView", "nothing says which bytes are compressed"))?;
        match self.buffers.view(Index::new(view)) {
            Ok(bytes) => Ok((view as usize, bytes)),
            Err(Some(why)) => Err(why),
            Err(None) => Err(self.fault(".bufferView", format!("view {view} has no bytes"))),
        }
    }

    /// The accessor of the indices, their type and their number.
    fn indices(&self) -> Result<(usize, ComponentType, u64), Diagnostic> {
        let Checked::Valid(Mode::Triangles) = self.primitive.mode else {
            return Err(self.fault("", "only triangles can be decoded, and the primitive has another mode"));
        };
        let index = self.primitive.indices.ok_or_else(|| self.fault("", "the primitive has no indices"))?.value();
        let accessor = self.root.accessors.get(index);
        match accessor.and_then(|accessor| Some((Format::of(accessor)?, accessor.count.0))) {
            Some((Format { component, shape: Type::Scalar, .. }, count)) => Ok((index, component, count)),
            _ => Err(self.fault("", "the accessor of its indices has an unknown type")),
        }
    }

    /// The accessors of the attributes that are compressed, and what is wanted for each.
    fn attributes(&self) -> (Vec<usize>, Vec<Wanted>) {
        let listed = self.properties.get("attributes").and_then(Value::as_object);
        let attribute = |(semantic, index): (&Checked<Semantic>, &Index<Accessor>)| {
            let Checked::Valid(semantic) = semantic else { return None };
            let name = semantic.to_string();
            let id = listed?.get(&name).and_then(whole)?;
            let accessor = self.root.accessors.get(index.value())?;
            let format = Format::of(accessor)?;
            let (component, width) = (format.component, format.width());
            Some((index.value(), Wanted { id, name, component, width, count: accessor.count.0 }))
        };
        self.primitive.attributes.iter().filter_map(attribute).unzip()
    }

    /// Tells of a primitive that cannot be decoded.
    fn failed(&self, why: Diagnostic, report: &mut Report) {
        let required = self.root.extensions_required.iter().any(|name| name == NAME);
        let plain = |index: &Index<_>| self.root.accessors.get(index.value()).is_some_and(|a| a.buffer_view.is_some());
        let mut accessors = self.primitive.attributes.values().chain(&self.primitive.indices);
        if !required && accessors.all(plain) {
            report.warnings.push(why.remedy("the uncompressed data in the file is drawn"));
        } else {
            report.fault(why);
        }
    }

    fn fault(&self, part: &str, text: impl Into<String>) -> Diagnostic {
        Diagnostic::new("gltf-draco", self.file, format!("{}{part}", self.place), text).remedy(REMEDY)
    }
}

impl Plan<'_> {
    fn run(&self) -> Result<Output, String> {
        draco_codec::decode(self.bytes, self.index_type, &self.wanted)
    }
}
