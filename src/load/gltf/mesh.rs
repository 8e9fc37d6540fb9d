//! One primitive of a mesh -> a [`Mesh`] of the scene: morphed, skinned, cleaned.

use super::accessor::{Format, Pick, Reader, Unreadable};
use super::codes::Code;
use super::faces::{self, Dropped};
use super::morphs::Change;
use super::report::Report;
use super::skin::{self, Influences, Skin};
use crate::load::tangents;
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{Mesh, TexCoords};
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf::json::validation::Checked;
use std::ops::AddAssign;

/// A primitive to read, and how.
pub(super) struct Job<'a> {
    pub(super) primitive: &'a Primitive,
    /// JSON path of the primitive.
    pub(super) place: String,
    pub(super) name: &'a str,
    /// Morph weights; missing ones are zero.
    pub(super) weights: &'a [f32],
    /// Changes of colours and texture coordinates by morph targets, ordered by target.
    pub(super) changes: &'a [Change],
    pub(super) skin: Option<&'a Skin>,
    pub(super) needs: Needs,
    /// Whether any of it is drawn; otherwise it is read only to be checked.
    pub(super) drawn: bool,
    /// Whether missing normals will be smoothed; tangents are then generated later.
    pub(super) smooths: bool,
}

/// Vertex attributes that a material reads.
#[derive(Clone, Debug, Default)]
pub(super) struct Needs {
    /// Texture coordinate sets.
    pub(super) uv_sets: Vec<u32>,
    /// Texture coordinates that tangents follow: those of a normal map.
    pub(super) tangents: Option<TexCoords>,
}

impl Job<'_> {
    fn weight(&self, target: usize) -> f32 {
        self.weights.get(target).copied().filter(|w| w.is_finite()).unwrap_or(0.0)
    }

    /// Returns whether a morph target is read: it has weight, or the primitive is only checked.
    fn reads_target(&self, target: usize) -> bool {
        self.weight(target) != 0.0 || !self.drawn
    }
}

/// Result of reading a primitive.
#[derive(Default)]
pub(super) struct Read {
    pub(super) mesh: Mesh,
    /// Centre of the skin, to which positions are relative; `None` without a skin.
    pub(super) center: Option<DVec3>,
    pub(super) dropped: Dropped,
    /// Lines, as [`crate::load::wires::Wires::ends`]; there are no triangles then.
    pub(super) lines: Vec<[u32; 2]>,
}

/// Reads one primitive; `None` when nothing in it can be drawn.
pub(super) fn read(reader: Reader, job: &Job, report: &mut Report) -> Option<Read> {
    let Checked::Valid(mode) = job.primitive.mode else { return None };
    let positions = job.primitive.attributes.get(&Checked::Valid(Semantic::Positions))?;
    let vertices = reader.count(*positions);
    let mut task = Task { reader, job, report, vertices, used: None };
    task.run(mode)
}

/// Memory for reading a primitive, in bytes, by the declared counts.
///
/// Only vertices that the indices name are read, so at most as many as there are indices.
pub(super) fn cost(reader: Reader, job: &Job) -> u64 {
    /// Largest vertex attribute: four floats.
    const VALUE: u64 = 16;
    let primitive = job.primitive;
    let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let vertices = positions.map_or(0, |&index| reader.count(index));
    let corners = primitive.indices.map_or(vertices, |index| reader.count(index));
    let used = vertices.min(corners);
    let targets = primitive.targets.iter().flatten().enumerate().filter(|(k, _)| job.reads_target(*k));
    let morphs = targets.flat_map(|(_, t)| [t.positions, t.normals, t.tangents].into_iter().flatten()).count();
    let morphs = (morphs + job.changes.iter().filter(|change| job.reads_target(change.target)).count()) as u64;
    let values = primitive.attributes.len() as u64;
    let faces = match primitive.mode {
        // Nearly every corner starts a triangle.
        Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => 36,
        _ => 24,
    };
    let tangents = if job.needs.tangents.is_some() { tangents::OF_CORNER + values * VALUE } else { 0 };
    let set = |semantic: &Checked<Semantic>| match semantic {
        Checked::Valid(Semantic::TexCoords(set)) => Some(*set as usize + 1),
        _ => None,
    };
    // Texture coordinate sets are stored at their index, after empty sets for unused indices.
    let sets = primitive.attributes.keys().filter_map(set).max().unwrap_or(0);
    let fixed = (size_of::<Read>() + job.name.len() + sets * size_of::<Vec<Vec2>>()) as u64;
    let bytes = used.saturating_mul((values + morphs) * VALUE).saturating_add(corners.saturating_mul(faces + tangents));
    bytes.saturating_add(fixed)
}

struct Task<'a, 'b> {
    reader: Reader<'a>,
    job: &'b Job<'b>,
    report: &'b mut Report,
    /// Number of vertices that can be indexed.
    vertices: u64,
    /// Vertices that the indices use, unless all are used.
    used: Option<Vec<u32>>,
}

impl Task<'_, '_> {
    fn run(&mut self, mode: Mode) -> Option<Read> {
        let positions = self.attribute(Semantic::Positions)?;
        let mut mesh = Mesh { name: self.job.name.into(), ..Mesh::default() };
        let corners = match self.job.primitive.indices {
            Some(index) => Some(self.corners(index)?),
            None => None,
        };
        mesh.positions = self.floats::<3>(positions, "attributes.POSITION")?.into_iter().map(Vec3::from).collect();
        let corners = match corners {
            Some(corners) => corners,
            None => (0..u32::try_from(mesh.positions.len()).ok()?).collect(),
        };
        let lines = faces::lines(mode, &corners);
        mesh.triangles = faces::triangles(mode, corners).unwrap_or_default();
        self.attributes(&mut mesh);
        self.morph(&mut mesh);
        self.directions(&mut mesh);
        let center = self.pose(&mut mesh);
        if !lines.is_empty() {
            return Some(Read { mesh, center, lines, dropped: Dropped::default() });
        }
        let dropped = faces::clean(&mut mesh, mode == Mode::TriangleStrip);
        if let Some(along) = self.job.needs.tangents.filter(|_| mesh.tangents.is_empty()) {
            if self.job.smooths && mesh.normals.is_empty() {
                mesh.tangents_along = Some(along);
            } else {
                tangents::generate(&mut mesh, along);
            }
        }
        Some(Read { mesh, center, dropped, lines })
    }

    /// Accessor of an attribute, if its format is readable and it has one value per vertex.
    fn attribute(&self, semantic: Semantic) -> Option<Index<Accessor>> {
        let index = self.job.primitive.attributes.get(&Checked::Valid(semantic.clone())).copied()?;
        let format = self.reader.root.accessors.get(index.value()).and_then(Format::of)?;
        (is_readable(&semantic, format) && self.reader.count(index) == self.vertices).then_some(index)
    }

    /// Index of the index accessor; an invalid one if the primitive has no indices.
    fn indices(&self) -> usize {
        self.job.primitive.indices.map_or(usize::MAX, |index| index.value())
    }

    fn place(&self, part: &str) -> String {
        format!("{}.{part}", self.job.place)
    }

    /// Unwraps read data; a fault refuses the file, except that data without a stated location only costs a warning, and none
    /// where it is not drawn.
    fn sort_out<T>(&mut self, result: Result<T, Unreadable>, part: &str) -> Option<T> {
        let place = self.place(part);
        match result {
            Ok(values) => return Some(values),
            Err(Unreadable::Nowhere(why)) if self.job.drawn => self.report.warnings.push(why),
            Err(Unreadable::Nowhere(_) | Unreadable::Unknown) => {}
            Err(Unreadable::Buffer(why)) => self.report.fault(why),
            Err(Unreadable::Data(code, text)) => self.report.add(code, place, text),
        }
        None
    }

    fn floats<const N: usize>(&mut self, index: Index<Accessor>, part: &str) -> Option<Vec<[f32; N]>> {
        let result = self.reader.floats::<N>(index, self.pick());
        self.sort_out(result, part)
    }

    /// Selects the vertices to read.
    fn pick(&self) -> Pick<'_> {
        self.used.as_deref().map_or(Pick::All, Pick::Only)
    }

    /// Reads the vertex of every corner, renumbered by the vertices in use.
    fn corners(&mut self, index: Index<Accessor>) -> Option<Vec<u32>> {
        let format = self.reader.root.accessors.get(index.value()).and_then(Format::of)?;
        if format.shape != Type::Scalar || !is_unsigned(format.component) {
            return None;
        }
        let result = self.reader.indices(index);
        let mut corners = self.sort_out(result, "indices")?;
        let restart = match format.component {
            ComponentType::U8 => 0xff,
            ComponentType::U16 => 0xffff,
            _ => u32::MAX,
        };
        let vertices = self.vertices;
        let Some(at) = corners.iter().position(|&c| u64::from(c) >= vertices) else {
            let is_decoded = self.reader.decoded.indices(index.value()).is_some();
            if u64::from(restart) < vertices && !is_decoded && corners.contains(&restart) {
                let place = self.place("indices");
                let text = format!("index {restart} asks for a restart elsewhere; here it is a vertex");
                self.report.warn(Code::AccessorIndexPrimitiveRestart, place, text);
            }
            self.used = faces::gather(&mut corners, vertices);
            return Some(corners);
        };
        let (code, text) = if corners[at] == restart {
            let text = format!("index {restart} at position {at} asks for a restart, which glTF forbids");
            (Code::AccessorIndexPrimitiveRestart, text)
        } else {
            let text = format!("index {} at position {at}, but only {vertices} vertices exist", corners[at]);
            (Code::AccessorIndexOob, text)
        };
        let place = self.place("indices");
        self.report.add(code, place, text);
        None
    }

    /// Reads the other attributes.
    fn attributes(&mut self, mesh: &mut Mesh) {
        let count = mesh.positions.len();
        if mesh.positions.iter().any(|p| !p.is_finite()) {
            let place = self.place("attributes.POSITION");
            self.report.add(Code::AccessorInvalidFloat, place, "positions that are not finite numbers");
        }
        if let Some(index) = self.attribute(Semantic::Normals).filter(|&i| !self.reader.is_blank(i)) {
            // A zero vector is not a direction.
            let normals = self.floats::<3>(index, "attributes.NORMAL").filter(|n| n.len() == count);
            mesh.normals = normals.into_iter().flatten().map(Vec3::from).collect();
        }
        let wanted = (self.job.needs.tangents.is_some() || !self.job.drawn) && !mesh.normals.is_empty();
        if let Some(index) = self.attribute(Semantic::Tangents).filter(|_| wanted) {
            let tangents = self.floats::<4>(index, "attributes.TANGENT").filter(|t| t.len() == count);
            mesh.tangents = tangents.into_iter().flatten().map(Vec4::from).collect();
        }
        self.colors(mesh, count);
        self.uvs(mesh, count);
    }

    fn colors(&mut self, mesh: &mut Mesh, count: usize) {
        let Some(index) = self.attribute(Semantic::Colors(0)) else { return };
        let opaque =
            self.reader.root.accessors.get(index.value()).is_some_and(|a| a.type_ == Checked::Valid(Type::Vec3));
        let colors = self.floats::<4>(index, "attributes.COLOR_0").filter(|c| c.len() == count);
        let color = |[r, g, b, a]: [f32; 4]| Vec4::new(r, g, b, if opaque { 1.0 } else { a });
        mesh.colors = colors.into_iter().flatten().map(color).collect();
        if faces::clamp_colors(&mut mesh.colors) {
            let place = self.place("attributes.COLOR_0");
            self.report.add(Code::AccessorNonClamped, place, "colours outside 0…1");
        }
    }

    fn uvs(&mut self, mesh: &mut Mesh, count: usize) {
        let sets: Vec<u32> = if self.job.drawn { self.job.needs.uv_sets.clone() } else { (0..8).collect() };
        for set in sets {
            let Some(index) = self.attribute(Semantic::TexCoords(set)) else { continue };
            let part = format!("attributes.TEXCOORD_{set}");
            let uvs = self.floats::<2>(index, &part).filter(|uvs| uvs.len() == count);
            let mut uvs: Vec<Vec2> = uvs.into_iter().flatten().map(Vec2::from).collect();
            if faces::finite_uvs(&mut uvs) {
                let place = self.place(&part);
                self.report.add(Code::AccessorInvalidFloat, place, "texture coordinates that are not finite numbers");
            }
            // Set indices have 16 bits, and `cost` includes the empty sets.
            let slot = set as usize;
            if mesh.uvs.len() <= slot {
                mesh.uvs.resize(slot + 1, Vec::new());
            }
            mesh.uvs[slot] = uvs;
        }
    }

    /// Adds the morph targets, multiplied by their weights.
    fn morph(&mut self, mesh: &mut Mesh) {
        let primitive = self.job.primitive;
        let mut changed = false;
        for (k, target) in primitive.targets.iter().flatten().enumerate() {
            if self.job.reads_target(k) {
                self.add_target(mesh, target, k, self.job.weight(k));
                changed |= self.job.weight(k) != 0.0;
            }
        }
        // Weighted sums are neither unit vectors nor within the range of colours any more; that is no fault of the file.
        if changed {
            faces::clamp_colors(&mut mesh.colors);
            mesh.uvs.iter_mut().for_each(|uvs| _ = faces::finite_uvs(uvs));
            mesh.normals.iter_mut().for_each(|n| *n = n.try_normalize().unwrap_or(*n));
            let unit = |t: &mut Vec4| *t = t.truncate().try_normalize().map_or(*t, |d| d.extend(t.w));
            mesh.tangents.iter_mut().for_each(unit);
        }
    }

    fn add_target(&mut self, mesh: &mut Mesh, target: &MorphTarget, k: usize, weight: f32) {
        let parts = [
            (target.positions, Semantic::Positions),
            (target.normals, Semantic::Normals),
            (target.tangents, Semantic::Tangents),
        ];
        let parts = parts.into_iter().filter_map(|(accessor, attribute)| Some((accessor?, attribute)));
        let of_target = self.job.changes.partition_point(|change| change.target < k);
        let changes = self.job.changes[of_target..].iter().take_while(|change| change.target == k);
        for (index, attribute) in parts.chain(changes.map(|change| (change.accessor, change.attribute.clone()))) {
            let part = format!("targets[{k}].{}", attribute.to_string());
            if !self.is_change(index, &attribute, &part) {
                continue;
            }
            match attribute {
                Semantic::Positions => {
                    add(&mut mesh.positions, self.floats(index, &part), |d| Vec3::from_array(d) * weight);
                }
                Semantic::Normals => {
                    add(&mut mesh.normals, self.floats(index, &part), |d| Vec3::from_array(d) * weight);
                }
                Semantic::Tangents => {
                    let change = |d| (Vec3::from_array(d) * weight).extend(0.0);
                    add(&mut mesh.tangents, self.floats(index, &part), change);
                }
                // For RGB the fourth component, alpha, reads as zero.
                Semantic::Colors(_) => {
                    add(&mut mesh.colors, self.floats(index, &part), |d| Vec4::from_array(d) * weight);
                }
                Semantic::TexCoords(set) => {
                    let uvs = mesh.uvs.get_mut(set as usize).map_or(&mut [][..], Vec::as_mut_slice);
                    add(uvs, self.floats(index, &part), |d| Vec2::from_array(d) * weight);
                }
                Semantic::Joints(_) | Semantic::Weights(_) | Semantic::Extras(_) => {}
            }
        }
    }

    /// Returns whether an accessor of a morph target is readable and has one value per vertex.
    fn is_change(&mut self, index: Index<Accessor>, attribute: &Semantic, part: &str) -> bool {
        let format = self.reader.root.accessors.get(index.value()).and_then(Format::of);
        if !format.is_some_and(|format| can_change(attribute, format)) {
            return false;
        }
        let (has, vertices) = (self.reader.count(index), self.vertices);
        // Other mismatches were reported when the JSON was checked.
        if has != vertices && self.reader.decoded.indices(self.indices()).is_some() {
            let (place, text) = (self.place(part), format!("{has} elements for {vertices} vertices"));
            self.report.add(Code::MeshPrimitiveMorphTargetInvalidAttributeCount, place, text);
        }
        has == vertices
    }

    /// Poses a skinned mesh by its joints; returns the centre of the skin.
    fn pose(&mut self, mesh: &mut Mesh) -> Option<DVec3> {
        let skin = self.job.skin?;
        let mut influences = Influences::default();
        for set in 0.. {
            let (Some(joints), Some(weights)) =
                (self.attribute(Semantic::Joints(set)), self.attribute(Semantic::Weights(set)))
            else {
                break;
            };
            if self.reader.is_blank(weights) {
                break;
            }
            let result = self.reader.integers::<4>(joints, self.pick());
            influences.joints.push(self.sort_out(result, &format!("attributes.JOINTS_{set}"))?);
            influences.weights.push(self.floats::<4>(weights, &format!("attributes.WEIGHTS_{set}"))?);
        }
        if influences.joints.is_empty() {
            return None;
        }
        let odd = skin::pose(mesh, &influences, skin);
        let faults = [
            (odd.outside, Code::AccessorJointsIndexOob, "attributes.JOINTS_0", "joints that the skin does not have"),
            (odd.negative, Code::AccessorWeightsNegative, "attributes.WEIGHTS_0", "negative weights"),
            (odd.unequal, Code::AccessorWeightsNonNormalized, "attributes.WEIGHTS_0", "weights that do not sum to 1"),
        ];
        for (_, code, part, text) in faults.into_iter().filter(|f| f.0) {
            let place = self.place(part);
            self.report.add(code, place, text);
        }
        Some(skin.center)
    }

    /// Repairs normals and tangents, with warnings.
    fn directions(&mut self, mesh: &mut Mesh) {
        let normals = faces::repair_normals(mesh);
        if normals.length || normals.none {
            let text = if normals.none { "normals without a direction" } else { "normals that are not of unit length" };
            let place = self.place("attributes.NORMAL");
            self.report.add(Code::AccessorVector3NonUnit, place, text);
        }
        let tangents = faces::repair_tangents(&mut mesh.tangents);
        let place = self.place("attributes.TANGENT");
        if tangents.length {
            self.report.add(Code::AccessorVector3NonUnit, &place, "tangents that are not of unit length");
        }
        if tangents.sign {
            self.report.add(Code::AccessorInvalidSign, &place, "tangents whose w is neither 1 nor -1");
        }
        if tangents.none {
            mesh.tangents.clear();
        }
    }
}

/// Adds the changes of a morph target, if their count is that of the values.
fn add<T: AddAssign, const N: usize>(to: &mut [T], changes: Option<Vec<[f32; N]>>, change: impl Fn([f32; N]) -> T) {
    let changes = changes.filter(|changes| changes.len() == to.len()).into_iter().flatten();
    to.iter_mut().zip(changes).for_each(|(value, by)| *value += change(by));
}

fn is_unsigned(component: ComponentType) -> bool {
    matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

/// Returns whether an attribute is valid in this format; [`super::attributes`] has reported the others.
fn is_readable(semantic: &Semantic, format: Format) -> bool {
    let (float, unsigned) = (format.component == ComponentType::F32, is_unsigned(format.component));
    let small = format.component != ComponentType::U32;
    match semantic {
        Semantic::Positions => format.shape == Type::Vec3 && small,
        Semantic::Normals => format.shape == Type::Vec3 && (float || (format.normalized && !unsigned)),
        Semantic::Tangents => format.shape == Type::Vec4 && (float || (format.normalized && !unsigned)),
        Semantic::Colors(_) => {
            matches!(format.shape, Type::Vec3 | Type::Vec4) && (float || (format.normalized && unsigned && small))
        }
        Semantic::TexCoords(_) => format.shape == Type::Vec2 && small,
        Semantic::Joints(_) => format.shape == Type::Vec4 && unsigned && small,
        Semantic::Weights(_) => format.shape == Type::Vec4 && (float || (format.normalized && unsigned && small)),
        Semantic::Extras(_) => false,
    }
}

/// Returns whether a morph target may change an attribute in this format: changes of colours may be negative, and those of
/// tangents have no handedness.
fn can_change(attribute: &Semantic, format: Format) -> bool {
    let small = format.component != ComponentType::U32;
    match attribute {
        Semantic::Tangents => is_readable(&Semantic::Normals, format),
        Semantic::Colors(_) => {
            let is_color = matches!(format.shape, Type::Vec3 | Type::Vec4);
            is_color && (format.component == ComponentType::F32 || (format.normalized && small))
        }
        _ => is_readable(attribute, format),
    }
}
