//! Checks what the primitives of meshes declare about their accessors, before any data is read.
//!
//! Works on the JSON: the typed document keeps only attribute names that it knows.

use super::codes::Code;
use super::document::is_semantic;
use super::report::Report;
use super::schema::{list, position, whole};
use super::tree::{Map, Value};
use super::variants;
use std::collections::HashMap;

/// Component types (glTF 2.0, §3.6.2.2).
const BYTE: u64 = 5120;
const UNSIGNED_BYTE: u64 = 5121;
const SHORT: u64 = 5122;
const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
const FLOAT: u64 = 5126;

/// Targets of buffer views (§5.11.5): vertex attributes and vertex indices.
const ARRAY_BUFFER: u64 = 34962;
const ELEMENT_ARRAY_BUFFER: u64 = 34963;

/// Checks every primitive, together with the material that it has in a variant.
pub(super) fn check(root: &Value, variant: Option<usize>, report: &mut Report) {
    let quantized = list(root, "extensionsUsed").iter().any(|e| e.as_str() == Some("KHR_mesh_quantization"));
    let mut check = Check { root, variant, quantized, views: HashMap::new(), maps: HashMap::new(), report };
    for (i, mesh) in list(root, "meshes").iter().enumerate() {
        let targets: Vec<usize> = list(mesh, "primitives").iter().map(|p| list(p, "targets").len()).collect();
        for (k, primitive) in list(mesh, "primitives").iter().enumerate() {
            let place = format!("meshes[{i}].primitives[{k}]");
            check.primitive(primitive, &place);
            if targets[k] != targets[0] {
                let text = format!("{} morph targets, but the first primitive has {}", targets[k], targets[0]);
                check.report.add(Code::MeshPrimitivesUnequalTargetsCount, place, text);
            }
        }
        let weights = mesh.get("weights").and_then(Value::as_array).map(Vec::len);
        if let Some(weights) = weights.filter(|&w| targets.first().is_some_and(|&t| t != w)) {
            let text = format!("{weights} weights for {} morph targets", targets[0]);
            check.report.add(Code::MeshInvalidWeightsCount, format!("meshes[{i}].weights"), text);
        }
    }
}

/// Properties of an accessor that matter to a primitive.
struct Shape<'a> {
    index: u64,
    component: u64,
    kind: &'a str,
    normalized: bool,
    count: u64,
    offset: u64,
    view: Option<(usize, &'a Value<'a>)>,
    bounded: bool,
}

/// Maps of one material that share a set of texture coordinates.
struct Layout<'a> {
    /// Name of the attribute, such as `TEXCOORD_1`.
    coordinates: String,
    names: Vec<&'a str>,
}

struct Check<'a> {
    root: &'a Value<'a>,
    /// Index of the requested material variant.
    variant: Option<usize>,
    quantized: bool,
    /// Accessor of the first attribute in each buffer view.
    views: HashMap<usize, u64>,
    /// Texture coordinates that the maps of each material need, filled on demand.
    maps: HashMap<usize, Vec<Layout<'a>>>,
    report: &'a mut Report,
}

impl<'a> Check<'a> {
    fn primitive(&mut self, primitive: &'a Value<'a>, place: &str) {
        let empty = Map::default();
        let attributes = primitive.get("attributes").and_then(Value::as_object).unwrap_or(&empty);
        let at = format!("{place}.attributes");
        if !attributes.is_empty() && !attributes.contains_key("POSITION") {
            self.report.add(Code::MeshPrimitiveNoPosition, &at, "there are no positions");
        }
        if attributes.contains_key("TANGENT") && !attributes.contains_key("NORMAL") {
            self.report.add(
                Code::MeshPrimitiveTangentWithoutNormal,
                format!("{at}.TANGENT"),
                "tangents without normals",
            );
        }
        self.sets(attributes, &at);
        let is_compressed = primitive.pointer("/extensions/KHR_draco_mesh_compression").is_some();
        let position = attributes.get("POSITION").and_then(|index| self.shape(index));
        let mut vertices = position.map(|shape| shape.count);
        for (name, index) in attributes.iter() {
            let place = format!("{at}.{}", crate::load::paths::shorten(name));
            let Some(shape) = self.shape(index) else { continue };
            self.attribute(name, &shape, &place, false);
            match vertices {
                None => vertices = Some(shape.count),
                // For compressed attributes the stream decides the count.
                Some(count) if count != shape.count && !is_compressed => {
                    let text = format!("{} elements for {count} vertices", shape.count);
                    self.report.add(Code::MeshPrimitiveUnequalAccessorCount, place, text);
                }
                Some(_) => {}
            }
        }
        let corners = self.indices(primitive, place).or(vertices);
        self.mode(primitive, corners.filter(|_| !is_compressed), place);
        for (k, target) in list(primitive, "targets").iter().enumerate() {
            let place = format!("{place}.targets[{k}]");
            self.target(target, attributes, vertices, &place);
        }
        self.material(primitive, attributes, place);
    }

    /// Numbered sets must be 0, 1, 2, …, and joints need as many sets as weights.
    fn sets(&mut self, attributes: &Map, at: &str) {
        let mut counts = Vec::new();
        for prefix in ["TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_"] {
            let known = attributes.iter().map(|(name, _)| name).filter(|name| is_semantic(name));
            let sets: Vec<u16> = known.filter_map(|name| name.strip_prefix(prefix)?.parse::<u16>().ok()).collect();
            if sets.iter().max().is_some_and(|&max| usize::from(max) + 1 != sets.len()) {
                let text = format!("the {prefix} sets are not numbered 0, 1, 2, …");
                self.report.add(Code::MeshPrimitiveIndexedSemanticContinuity, at, text);
            }
            counts.push(sets.len());
        }
        if counts[2] != counts[3] {
            let text = format!("{} sets of joints, {} of weights", counts[2], counts[3]);
            self.report.add(Code::MeshPrimitiveJointsWeightsMismatch, at, text);
        }
    }

    fn attribute(&mut self, name: &str, shape: &Shape, place: &str, morph: bool) {
        let is_own = name.starts_with('_');
        if shape.component == UNSIGNED_INT {
            self.report.add(
                Code::MeshPrimitiveAttributesAccessorUnsignedInt,
                place,
                "32-bit integers are no vertex data",
            );
        } else if !is_own && !is_semantic(name) {
            let text = format!("'{}' is no attribute", crate::load::paths::shorten(name));
            self.report.add(Code::MeshPrimitiveInvalidAttribute, place, text);
            return;
        } else if !is_own {
            self.format(name, shape, place, morph);
        }
        if name == "POSITION" && !shape.bounded {
            self.report.add(Code::MeshPrimitivePositionAccessorWithoutBounds, place, "positions without min and max");
        }
        self.layout(shape, place);
    }

    fn format(&mut self, name: &str, shape: &Shape, place: &str, morph: bool) {
        let fit = fit(name, shape, morph);
        if fit == Fit::Core || (fit == Fit::Quantized && self.quantized) {
            return;
        }
        let norm = if shape.normalized { ", normalized" } else { "" };
        let text = format!("{name} cannot be {} of {}{norm}", shape.kind, component_name(shape.component));
        // Other formats cannot be read; floats marked as normalized can.
        if name == "POSITION" && !morph && shape.kind != "VEC3" {
            self.report.add(Code::MeshPrimitiveAttributesAccessorInvalidFormat, place, text);
        } else {
            self.report.warn(Code::MeshPrimitiveAttributesAccessorInvalidFormat, place, text);
        }
    }

    /// Checks alignment, stride and target of the view.
    fn layout(&mut self, shape: &Shape, place: &str) {
        let Some((index, view)) = shape.view else { return };
        let stride = view.get("byteStride").and_then(whole);
        let start = view.get("byteOffset").and_then(whole).unwrap_or(0);
        let packed = shape.width() * component_size(shape.component);
        if (start.wrapping_add(shape.offset)) % 4 != 0 || stride.unwrap_or(packed) % 4 != 0 {
            self.report.add(
                Code::MeshPrimitiveAccessorUnaligned,
                place,
                "elements do not start at multiples of 4 bytes",
            );
        }
        if view.get("target").and_then(whole) == Some(ELEMENT_ARRAY_BUFFER) {
            self.report.add(Code::BufferViewTargetOverride, place, "vertices in a view of indices");
        }
        let first = *self.views.entry(index).or_insert(shape.index);
        if first != shape.index && stride.is_none() {
            let text = "several attributes share a view without a stride";
            self.report.add(Code::MeshPrimitiveAccessorWithoutByteStride, place, text);
        }
    }

    /// Checks the indices and returns their count.
    fn indices(&mut self, primitive: &'a Value<'a>, place: &str) -> Option<u64> {
        let place = format!("{place}.indices");
        let shape = self.shape(primitive.get("indices")?)?;
        if shape.kind != "SCALAR"
            || ![UNSIGNED_BYTE, UNSIGNED_SHORT, UNSIGNED_INT].contains(&shape.component)
            || shape.normalized
        {
            let text = format!("indices cannot be {} of {}", shape.kind, component_name(shape.component));
            self.report.add(Code::MeshPrimitiveIndicesAccessorInvalidFormat, &place, text);
        }
        if let Some((_, view)) = shape.view {
            if view.get("byteStride").is_some() {
                self.report.add(
                    Code::MeshPrimitiveIndicesAccessorWithByteStride,
                    &place,
                    "a stride on a view of indices",
                );
            }
            if view.get("target").and_then(whole) == Some(ARRAY_BUFFER) {
                self.report.add(Code::BufferViewTargetOverride, &place, "indices in a view of vertices");
            }
        }
        Some(shape.count)
    }

    fn mode(&mut self, primitive: &Value, corners: Option<u64>, place: &str) {
        let mode = primitive.get("mode").map_or(Some(4), whole).unwrap_or(4);
        let Some(count) = corners else { return };
        let fits = match mode {
            1 => count >= 2 && count % 2 == 0,
            2 | 3 => count >= 2,
            4 => count >= 3 && count % 3 == 0,
            5 | 6 => count >= 3,
            _ => true,
        };
        if !fits {
            let text = format!("{count} corners do not make whole faces in mode {mode}");
            self.report.add(Code::MeshPrimitiveIncompatibleMode, place, text);
        }
    }

    fn target(&mut self, target: &'a Value<'a>, base: &Map, vertices: Option<u64>, place: &str) {
        for (name, index) in target.as_object().into_iter().flat_map(Map::iter) {
            let place = format!("{place}.{}", crate::load::paths::shorten(name));
            let morphable = !["JOINTS_", "WEIGHTS_"].iter().any(|p| name.starts_with(p));
            if !(name.starts_with('_') || is_semantic(name) && morphable) {
                let text = format!("'{}' is no attribute that can be morphed", crate::load::paths::shorten(name));
                self.report.add(Code::MeshPrimitiveInvalidAttribute, &place, text);
            } else if !base.contains_key(name) {
                let text = format!("the primitive has no {}", crate::load::paths::shorten(name));
                self.report.add(Code::MeshPrimitiveMorphTargetNoBaseAccessor, &place, text);
            }
            let Some(shape) = self.shape(index) else { continue };
            if is_semantic(name) {
                self.attribute(name, &shape, &place, true);
            }
            if vertices.is_some_and(|count| count != shape.count) {
                let text = format!("{} elements for {} vertices", shape.count, vertices.unwrap_or(0));
                self.report.add(Code::MeshPrimitiveMorphTargetInvalidAttributeCount, place, text);
            }
        }
    }

    /// Checks that the primitive has the attributes that its material needs.
    fn material(&mut self, primitive: &Value, attributes: &Map, place: &str) {
        let place = format!("{place}.material");
        let index = variants::material_in(primitive, self.variant);
        let Some(material) = index.and_then(|i| list(self.root, "materials").get(i)) else { return };
        let layouts = self.maps.entry(index.unwrap_or_default()).or_insert_with(|| layouts(material));
        // Reporting only the first missing set bounds the work by the number of attributes.
        if let Some(layout) = layouts.iter().find(|layout| !attributes.contains_key(&layout.coordinates)) {
            let text = format!("the {} of its material needs {}", layout.names.join(", "), layout.coordinates);
            self.report.add(Code::MeshPrimitiveTooFewTexcoords, &place, text);
        }
        let extension = |name: &str| material.get("extensions").and_then(|e| e.get(name));
        let oriented = extension("KHR_materials_anisotropy").is_some()
            || extension("KHR_materials_clearcoat").is_some_and(|c| c.get("clearcoatNormalTexture").is_some());
        if oriented && !attributes.contains_key("TANGENT") && material.get("normalTexture").is_none() {
            self.report.add(
                Code::MeshPrimitiveNoTangentSpace,
                &place,
                "its material needs tangents, and there are none",
            );
        }
    }

    fn shape(&self, index: &Value) -> Option<Shape<'a>> {
        let index = whole(index)?;
        let accessor = list(self.root, "accessors").get(usize::try_from(index).ok()?)?;
        let number = |name| accessor.get(name).and_then(whole);
        let view = accessor.get("bufferView").and_then(position);
        Some(Shape {
            index,
            component: number("componentType")?,
            kind: accessor.get("type")?.as_str()?,
            normalized: accessor.get("normalized").and_then(Value::as_bool).unwrap_or(false),
            count: number("count")?,
            offset: number("byteOffset").unwrap_or(0),
            view: view.and_then(|i| Some((i, list(self.root, "bufferViews").get(i)?))),
            bounded: accessor.get("min").is_some() && accessor.get("max").is_some(),
        })
    }
}

impl Shape<'_> {
    fn width(&self) -> u64 {
        match self.kind {
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            _ => 1,
        }
    }
}

/// Conformance of an attribute's format.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fit {
    /// glTF 2.0 allows it.
    Core,
    /// KHR_mesh_quantization allows it.
    Quantized,
    No,
}

fn fit(name: &str, shape: &Shape, morph: bool) -> Fit {
    let (component, normalized) = (shape.component, shape.normalized);
    let float = component == FLOAT && !normalized;
    let unsigned = component == UNSIGNED_BYTE || component == UNSIGNED_SHORT;
    let signed = component == BYTE || component == SHORT;
    let small = signed || unsigned;
    let (right, core, quantized) = match name.split('_').next().unwrap_or(name) {
        "POSITION" => (shape.kind == "VEC3", float, if morph { signed } else { small }),
        "NORMAL" => (shape.kind == "VEC3", float, signed && normalized),
        "TANGENT" => (shape.kind == if morph { "VEC3" } else { "VEC4" }, float, signed && normalized),
        "TEXCOORD" => {
            (shape.kind == "VEC2", float || (unsigned && normalized) || (morph && signed && normalized), small)
        }
        "COLOR" => {
            let core = float || (unsigned && normalized) || (morph && signed && normalized);
            (shape.kind == "VEC3" || shape.kind == "VEC4", core, false)
        }
        "JOINTS" => (shape.kind == "VEC4", unsigned && !normalized, false),
        "WEIGHTS" => (shape.kind == "VEC4", float || (unsigned && normalized), false),
        _ => (true, true, true),
    };
    match (right, core, quantized) {
        (true, true, _) => Fit::Core,
        (true, false, true) => Fit::Quantized,
        _ => Fit::No,
    }
}

/// Groups the maps of a material by their texture coordinates.
fn layouts<'a>(material: &'a Value<'a>) -> Vec<Layout<'a>> {
    /// Most map names in one message; materials have no more.
    const LISTED: usize = 20;
    let mut slots = Vec::new();
    texture_slots(material, &mut slots);
    slots.sort_by_key(|slot| slot.1);
    let layout = |slots: &[(&'a str, u64)]| Layout {
        coordinates: format!("TEXCOORD_{}", slots[0].1),
        names: slots.iter().take(LISTED).map(|slot| slot.0).collect(),
    };
    slots.chunk_by(|a, b| a.1 == b.1).map(layout).collect()
}

/// Collects every map of a material, extensions included, with its texture coordinate set.
fn texture_slots<'a>(value: &'a Value<'a>, out: &mut Vec<(&'a str, u64)>) {
    for (name, value) in value.as_object().into_iter().flat_map(Map::iter) {
        if name.ends_with("Texture") && value.get("index").is_some() {
            let moved = value.pointer("/extensions/KHR_texture_transform/texCoord");
            let set = moved.or_else(|| value.get("texCoord")).and_then(whole).unwrap_or(0);
            out.push((name, set));
        } else if name != "extras" {
            texture_slots(value, out);
        }
    }
}

fn component_size(component: u64) -> u64 {
    match component {
        BYTE | UNSIGNED_BYTE => 1,
        SHORT | UNSIGNED_SHORT => 2,
        _ => 4,
    }
}

fn component_name(component: u64) -> &'static str {
    match component {
        BYTE => "signed bytes",
        UNSIGNED_BYTE => "unsigned bytes",
        SHORT => "signed shorts",
        UNSIGNED_SHORT => "unsigned shorts",
        UNSIGNED_INT => "unsigned ints",
        FLOAT => "floats",
        _ => "an unknown type",
    }
}
