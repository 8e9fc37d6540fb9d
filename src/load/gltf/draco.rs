//! Compressed primitives: KHR_draco_mesh_compression.
//!
//! The extension names a stream, and for each attribute in it an accessor that declares the count and type of its values.
//! Decoded values are stored by accessor, so that every reader of the accessor gets them; attributes that the extension does not
//! list, and morph targets, are ordinary accessors. The order of vertices is that of the stream.

use super::accessor::Format;
use super::buffers::Buffers;
use super::draco_codec::{self, Output, WantedAttribute};
use super::draco_stream;
use super::report::Report;
use super::schema::whole;
use crate::load::Diagnostic;
use crate::load::limits::Budget;
use gltf::json::accessor::{Accessor, Type};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};
use rayon::prelude::*;
use serde_json::{Map, Value};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

const NAME: &str = "KHR_draco_mesh_compression";

/// Remedy for a stream that cannot be decoded.
const REMEDY: &str = "get the file again, or export it without Draco compression";

/// Contents of the accessors that streams define.
#[derive(Default)]
pub(super) struct Decoded {
    /// Packed vertex values, in the type that each accessor declares, and their count.
    values: HashMap<usize, (Vec<u8>, u64)>,
    indices: HashMap<usize, Vec<u32>>,
}

impl Decoded {
    /// Decodes every compressed primitive, in parallel, within `budget`.
    ///
    /// A primitive that cannot be decoded refuses the file, unless the file contains the same data uncompressed.
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
                Ok(output) => {
                    plan.compare(&output, report);
                    decoded.keep(plan, output);
                }
                Err(text) => plan.task.failed(plan.task.fault("", text), report),
            }
        }
        decoded
    }

    /// Decoded vertex values of an accessor, if there are any.
    pub(super) fn values(&self, accessor: usize) -> Option<&[u8]> {
        self.values.get(&accessor).map(|(bytes, _)| bytes.as_slice())
    }

    /// Decoded triangle corners of an accessor, if there are any.
    pub(super) fn indices(&self, accessor: usize) -> Option<&[u32]> {
        self.indices.get(&accessor).map(Vec::as_slice)
    }

    /// Number of decoded elements of an accessor, if there are any.
    pub(super) fn count(&self, accessor: usize) -> Option<u64> {
        let values = self.values.get(&accessor).map(|&(_, count)| count);
        values.or_else(|| self.indices(accessor).map(|corners| corners.len() as u64))
    }

    /// Total of decoded bytes.
    pub(super) fn len(&self) -> u64 {
        let values: u64 = self.values.values().map(|(bytes, _)| bytes.len() as u64).sum();
        values + self.indices.values().map(|corners| 4 * corners.len() as u64).sum::<u64>()
    }

    fn keep(&mut self, plan: Plan, output: Output) {
        self.indices.insert(plan.indices.0, output.indices);
        let counted = output.attributes.into_iter().map(|bytes| (bytes, output.vertices));
        self.values.extend(plan.accessors.into_iter().zip(counted));
    }
}

/// Returns the extension of a primitive, if it has one.
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

/// A stream that passed the checks before decoding.
struct Plan<'a> {
    task: Task<'a>,
    bytes: &'a [u8],
    /// Accessor of the indices, and its declared count.
    indices: (usize, u64),
    /// Accessors of the attributes, the requests to the decoder, and the declared counts.
    accessors: Vec<usize>,
    wanted: Vec<WantedAttribute>,
    declared: Vec<u64>,
}

/// Contents of an accessor: index of the compressed view, and id of an attribute in its stream, or `None` for the indices.
type Part = (usize, Option<u64>);

impl<'a> Task<'a> {
    /// Checks everything that can be checked before decoding, and charges the memory; `None`: an earlier primitive defines the
    /// same accessors.
    fn plan(&self, owners: &mut HashMap<usize, Part>, budget: &mut Budget) -> Result<Option<Plan<'a>>, Diagnostic> {
        let (view, bytes) = self.stream()?;
        let indices = self.indices()?;
        let (accessors, mut wanted) = self.attributes();
        let shown = accessors.iter().zip(&wanted).map(|(&accessor, w)| (accessor, (view, Some(w.id))));
        if !self.claim(shown.chain([(indices.0, (view, None))]).collect(), owners)? {
            return Ok(None);
        }
        let (counts, ..) = draco_stream::start(bytes).map_err(|text| self.fault("", text))?;
        let declared: Vec<u64> = wanted.iter().map(|w| w.most).collect();
        let most = counts.most_values(declared.iter().copied().max().unwrap_or(0));
        wanted.iter_mut().for_each(|w| w.most = most);
        let kept = wanted.iter().map(WantedAttribute::size).fold(counts.faces.saturating_mul(12), u64::saturating_add);
        self.charge(counts.cost(most, (wanted.len() + draco_codec::SPARE) as u64).saturating_add(kept), budget)?;
        let task = Task { place: self.place.clone(), ..*self };
        Ok(Some(Plan { task, bytes, indices, accessors, wanted, declared }))
    }

    /// Registers the contents of accessors; returns whether any was new.
    fn claim(&self, shown: Vec<(usize, Part)>, owners: &mut HashMap<usize, Part>) -> Result<bool, Diagnostic> {
        let mut new = false;
        for (accessor, part) in shown {
            match owners.entry(accessor) {
                Entry::Vacant(free) => {
                    free.insert(part);
                    new = true;
                }
                Entry::Occupied(owner) if *owner.get() == part => {}
                Entry::Occupied(_) => {
                    let text = format!("accessor {accessor} stands for two different parts of Draco streams");
                    return Err(self.fault("", text));
                }
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

    /// Index of the compressed view, and its bytes.
    fn stream(&self) -> Result<(usize, &'a [u8]), Diagnostic> {
        let number = self.properties.get("bufferView").and_then(whole).and_then(|i| u32::try_from(i).ok());
        let view = number.ok_or_else(|| self.fault(".bufferView", "nothing says which bytes are compressed"))?;
        match self.buffers.view(Index::new(view)) {
            Ok(bytes) => Ok((view as usize, bytes)),
            Err(Some(why)) => Err(why),
            Err(None) => Err(self.fault(".bufferView", format!("view {view} has no bytes"))),
        }
    }

    /// Accessor of the indices, and its declared count.
    fn indices(&self) -> Result<(usize, u64), Diagnostic> {
        let Checked::Valid(Mode::Triangles) = self.primitive.mode else {
            return Err(self.fault("", "only triangles can be decoded, and the primitive has another mode"));
        };
        let index = self.primitive.indices.ok_or_else(|| self.fault("", "the primitive has no indices"))?.value();
        let accessor = self.root.accessors.get(index);
        match accessor.and_then(|accessor| Some((Format::of(accessor)?, accessor.count.0))) {
            Some((Format { shape: Type::Scalar, .. }, count)) => Ok((index, count)),
            _ => Err(self.fault("", "the accessor of its indices has an unknown type")),
        }
    }

    /// Accessors of the compressed attributes, and the request for each.
    fn attributes(&self) -> (Vec<usize>, Vec<WantedAttribute>) {
        let listed = self.properties.get("attributes").and_then(Value::as_object);
        let attribute = |(semantic, index): (&Checked<Semantic>, &Index<Accessor>)| {
            let Checked::Valid(semantic) = semantic else { return None };
            let name = semantic.to_string();
            let id = listed?.get(&name).and_then(whole)?;
            let accessor = self.root.accessors.get(index.value())?;
            let format = Format::of(accessor)?;
            let (component, width) = (format.component, format.width());
            Some((index.value(), WantedAttribute { id, name, component, width, most: accessor.count.0 }))
        };
        self.primitive.attributes.iter().filter_map(attribute).unzip()
    }

    /// Reports a primitive that cannot be decoded.
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
        draco_codec::decode(self.bytes, &self.wanted)
    }

    /// Warns where the declared counts differ from those of the stream.
    fn compare(&self, output: &Output, report: &mut Report) {
        let (corners, vertices) = (output.indices.len() as u64, output.vertices);
        let other = self.declared.iter().find(|&&declared| declared != vertices);
        if corners != self.indices.1 || other.is_some() {
            let Task { file, place, .. } = &self.task;
            let text = format!(
                "the stream has {vertices} vertices and {corners} indices, but the accessors declare {} and {}",
                other.unwrap_or(&vertices),
                self.indices.1
            );
            let warning = Diagnostic::new("gltf-draco-count", file, place.as_str(), text);
            report.warnings.push(warning.remedy("those of the stream are drawn"));
        }
    }
}
