//! Elements of a PLY file -> vertices and faces.

use super::body::{Body, Missing};
use super::header::{Element, Encoding, Header, Kind, Property};
use crate::load::geometry::bare::Bare;
use crate::load::limits::Budget;
use crate::load::paths::shorten;
use crate::load::{Diagnostic, Source};
use crate::math::{DVec2, DVec3, Vec3};
use std::path::Path;

/// Reads every element in the order of the file.
///
/// # Errors
/// At the first value that is missing or makes no sense, or when memory would exceed the budget.
pub(super) fn read(header: &Header, source: &Source, budget: &mut Budget) -> Result<Bare, Diagnostic> {
    let body = Body::new(header, source);
    let vertices = header.element("vertex").map_or(0, |element| element.count);
    let mut reader = Reader { source, body, vertices, budget, bare: Bare::default(), torn: None };
    for element in &header.elements {
        if let Err(fault) = reader.element(element) {
            // What makes no sense may come of a line far before it.
            return Err(reader.torn.take().unwrap_or(fault));
        }
    }
    let Reader { body, mut bare, torn, .. } = reader;
    let behind = body.behind();
    bare.places = (header.encoding == Encoding::Text).then_some(body.places);
    bare.comments.clone_from(&header.comments);
    bare.told = passed_over(header, &source.path);
    // Rows may share lines; where they do by mistake, numbers are left in the end.
    bare.told.extend(torn.filter(|_| behind.is_some()));
    bare.told.extend(behind);
    bare.told.extend(body.respelled.told("ply-number", &source.path));
    Ok(bare)
}

/// Warnings of what would change the look, and is not read.
fn passed_over(header: &Header, file: &Path) -> Vec<Diagnostic> {
    let faces = || header.elements.iter().filter(|element| element.name == "face" && element.count > 0);
    let has = |list: bool, names: &[&str]| {
        let mut properties = faces().flat_map(|element| &element.properties);
        properties.any(|property| property.length.is_some() == list && names.contains(&property.name.as_str()))
    };
    let warning = |code, text: String, remedy: &str| Diagnostic::new(code, file, "", text).remedy(remedy);
    let mut told = Vec::new();
    if SLOTS[RED..RED + 3].iter().any(|names| has(false, names)) {
        told.push(warning("ply-face-colors", "colours of faces are not drawn".into(), "give the vertices colours"));
    }
    if has(true, &["texcoord"]) {
        let text = "texture coordinates of faces (texcoord) are not read".into();
        told.push(warning("ply-face-texcoords", text, "export it as OBJ or glTF"));
    }
    let colored = |element: &&Element| element.properties.iter().any(|p| SLOTS[RED].contains(&p.name.as_str()));
    if header.elements.iter().filter(|e| e.name == "edge" && e.count > 0).any(|e| colored(&e)) {
        told.push(warning("ply-edge-colors", "colours of edges are not drawn".into(), "give the vertices colours"));
    }
    if header.elements.iter().any(|element| element.name == "vertex" && are_splats(element)) {
        let text = "Gaussian splats are drawn as points of their colours, opaque and of one size".into();
        told.push(warning("ply-splats", text, "--line-width sets the size"));
    }
    let is_read = |element: &Element| match element.name.as_str() {
        "face" | "tristrips" => list_of(element).is_some(),
        name => name == "vertex",
    };
    for element in header.elements.iter().filter(|element| element.count > 0 && !is_read(element)) {
        // Numbers of vertices, under other names.
        let mut lists = element.properties.iter().filter(|property| property.length.is_some());
        let Some(list) = lists.find(|list| list.kind.is_whole()) else { continue };
        let (name, list) = (shorten(&element.name), shorten(&list.name));
        let text = format!("element `{name}` ({}) with a list `{list}` is not read", element.count);
        let remedy = "faces are those of an element `face` with a list `vertex_indices`";
        told.push(warning("ply-unread-element", text, remedy));
    }
    let vertices = header.elements.iter().find(|element| element.name == "vertex" && element.count > 0);
    for [first, again] in vertices.map(|element| Meanings::of(element).twice).unwrap_or_default() {
        let text = match first == again {
            true => format!("'{again}' of a vertex is there twice, and the second is not read"),
            false => format!("'{again}' of a vertex says what '{first}' has said, and is not read"),
        };
        told.push(warning("ply-property-twice", text, "keep one of them"));
    }
    let pictures = header.comments.iter().filter_map(|comment| comment.strip_prefix("TextureFile"));
    for name in pictures.map(str::trim).filter(|name| !name.is_empty()) {
        let text = format!("picture '{}' (comment TextureFile) is not drawn", shorten(name));
        told.push(warning("ply-picture", text, "export it as OBJ or glTF"));
    }
    told
}

/// Numbers of a vertex that have a meaning here.
const SLOTS: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
    &["red", "r", "diffuse_red", SPLAT[0]],
    &["green", "g", "diffuse_green", SPLAT[1]],
    &["blue", "b", "diffuse_blue", SPLAT[2]],
    &["alpha", "a", "opacity", "diffuse_alpha"],
];

/// Where what belongs together stands in [`SLOTS`].
const PLACE: [usize; 3] = [0, 1, 2];
const NORMAL: [usize; 3] = [3, 4, 5];
const UV: [usize; 2] = [6, 7];
const COLOR: [usize; 3] = [RED, RED + 1, RED + 2];
const RED: usize = 8;
const ALPHA: usize = 11;

/// Colours of Gaussian splats, as the constant part of spherical harmonics (B. Kerbl and others, "3D Gaussian Splatting for
/// Real-Time Radiance Field Rendering", 2023).
const SPLAT: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];

/// Whether vertices are Gaussian splats. Their normals are 0, and their opacities are of a haze.
fn are_splats(vertex: &Element) -> bool {
    SPLAT.iter().all(|name| vertex.properties.iter().any(|property| property.name == *name))
}

/// What properties of a vertex mean.
struct Meanings<'a> {
    /// Of each property the place in [`SLOTS`]; of several with one meaning the first has it.
    slots: Vec<Option<usize>>,
    /// For each meaning that several have, the names of the first two.
    twice: Vec<[&'a str; 2]>,
}

impl<'a> Meanings<'a> {
    fn of(vertex: &'a Element) -> Self {
        let (splats, hazy) = (are_splats(vertex), [NORMAL[0], NORMAL[1], NORMAL[2], ALPHA]);
        let mut said: [Vec<&str>; SLOTS.len()] = Default::default();
        let slot = |property: &'a Property| {
            let name = property.name.as_str();
            let found = SLOTS.iter().position(|names| names.contains(&name));
            let slot = found.filter(|slot| property.length.is_none() && !(splats && hazy.contains(slot)))?;
            if said[slot].len() < 2 {
                said[slot].push(name);
            }
            (said[slot].len() == 1).then_some(slot)
        };
        let slots = vertex.properties.iter().map(slot).collect();
        let twice = said.iter().filter_map(|names| names.as_slice().try_into().ok());
        Self { slots, twice: twice.collect() }
    }
}

/// A part of a colour, 0…1, as a property says it.
fn light(property: &Property, value: f64) -> f64 {
    /// 1 / (2 √π), the spherical harmonic that is the same all around.
    const EVEN: f64 = 0.282_094_791_773_878_14;
    if SPLAT.contains(&property.name.as_str()) {
        (0.5 + EVEN * value).clamp(0.0, 1.0)
    } else {
        value / unit(property.kind)
    }
}

struct Reader<'a, 'b> {
    source: &'a Source,
    body: Body<'a>,
    /// How many vertices the header claims; faces may come before them.
    vertices: u64,
    budget: &'b mut Budget,
    bare: Bare,
    /// A line that has not the numbers of one row.
    torn: Option<Diagnostic>,
}

/// The rows of an element of a text, which programs write a line each, although blanks of any kind part numbers.
#[derive(Default)]
struct Rows {
    /// Where the row begins that is read.
    start: u32,
    /// Whether two rows have shared a line from the beginning on: then lines mean nothing.
    is_free: bool,
}

/// Which property lists the corners of faces.
fn list_of(element: &Element) -> Option<usize> {
    let lists = |property: &Property| {
        property.length.is_some()
            && matches!(property.name.as_str(), "vertex_indices" | "vertex_index" | "vertex_idx" | "vertex_ids")
    };
    element.properties.iter().position(lists)
}

impl Reader<'_, '_> {
    fn element(&mut self, element: &Element) -> Result<(), Diagnostic> {
        self.body.check_count(element)?;
        match (element.name.as_str(), list_of(element)) {
            ("vertex", _) if self.bare.positions.is_empty() => self.vertices(element),
            ("face", Some(list)) => self.faces(element, list, false),
            ("tristrips", Some(list)) => self.faces(element, list, true),
            ("edge", _) if ends(element).is_some() => self.edges(element),
            _ => {
                // Without properties there is nothing to pass over, however many there are.
                if element.properties.is_empty() { Ok(()) } else { self.pass(element) }
            }
        }
    }

    /// Row `i` begins: tells when it begins in a line that belongs to the one before it, as all behind it will, then.
    fn row(&mut self, rows: &mut Rows, element: &Element, i: u64) {
        let Some([line, last]) = self.body.lines() else { return };
        let start = std::mem::replace(&mut rows.start, line);
        if i == 0 || line != last || rows.is_free || self.torn.is_some() {
            return;
        }
        if i == 1 {
            rows.is_free = true;
            return;
        }
        let (name, row) = (shorten(&element.name), i - 1);
        let how = if start == last { "more" } else { "fewer" };
        let text = format!(
            "{name} {row} has {how} numbers than the header says, so that all behind it are read from wrong places"
        );
        let torn = Diagnostic::new("ply-torn-line", &self.source.path, start.to_string(), text);
        self.torn = Some(torn.remedy("repair that line"));
    }

    fn vertices(&mut self, element: &Element) -> Result<(), Diagnostic> {
        if element.count > Bare::LARGEST {
            let text = format!("{} vertices are more than {}", element.count, Bare::LARGEST);
            return Err(self.body.fault(text, "split the file"));
        }
        let slots = Meanings::of(element).slots;
        let has = |wanted: &[usize]| wanted.iter().all(|slot| slots.contains(&Some(*slot)));
        if !has(&PLACE) {
            return Err(self.body.fault("vertices have no x, y and z", "export it again"));
        }
        let (has_normals, has_uvs, has_colors) = (has(&NORMAL), has(&UV), has(&COLOR));
        Bare::charge_vertices(self.budget, element.count)
            .map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;

        // The budget has room for so many, so memory has.
        self.bare.positions.reserve_exact(element.count as usize);
        let mut rows = Rows::default();
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            let mut values = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            for (property, slot) in element.properties.iter().zip(&slots) {
                match slot {
                    Some(slot) => {
                        let value = self.value(element, i, property)?;
                        values[*slot] = if *slot < RED { value } else { light(property, value) };
                    }
                    None => self.pass_property(element, i, property)?,
                }
            }
            let [x, y, z, nx, ny, nz, u, v, color @ ..] = values;
            self.bare.positions.push(DVec3::new(x, y, z));
            if has_normals {
                self.bare.normals.push(Vec3::new(nx as f32, ny as f32, nz as f32));
            }
            if has_uvs {
                self.bare.uvs.push(DVec2::new(u, v));
            }
            if has_colors {
                self.bare.colors.push(color.map(|c| c as f32));
            }
        }
        Ok(())
    }

    /// Lines.
    fn edges(&mut self, element: &Element) -> Result<(), Diagnostic> {
        let Some(slots) = ends(element) else { return self.pass(element) };
        let mut rows = Rows::default();
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            let mut edge = [0; 2];
            for (k, property) in element.properties.iter().enumerate() {
                match slots.iter().position(|&slot| slot == k) {
                    Some(end) => {
                        let value = self.value(element, i, property)?;
                        edge[end] = self.index(value, end as u64, element, i)?;
                    }
                    None => self.pass_property(element, i, property)?,
                }
            }
            // An edge takes what a face of two corners would.
            Bare::charge_face(self.budget, 2).map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;
            self.bare.edges.push(edge);
        }
        Ok(())
    }

    /// Polygons, or strips of triangles.
    fn faces(&mut self, element: &Element, list: usize, strips: bool) -> Result<(), Diagnostic> {
        let (mut corners, mut rows) = (Vec::new(), Rows::default());
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            for (k, property) in element.properties.iter().enumerate() {
                if k == list {
                    self.corners(element, i, property, strips, &mut corners)?;
                } else {
                    self.pass_property(element, i, property)?;
                }
            }
            if strips {
                for strip in corners.split(|&corner| corner == RESTART) {
                    self.strip(strip)?;
                }
            } else {
                self.face(&corners)?;
            }
        }
        Ok(())
    }

    /// Reads a list of vertices into `corners`.
    fn corners(
        &mut self,
        element: &Element,
        i: u64,
        property: &Property,
        strips: bool,
        corners: &mut Vec<u32>,
    ) -> Result<(), Diagnostic> {
        let length = self.length(element, i, property)?;
        self.take_list(length, element, i, property, strips)?;
        corners.clear();
        corners.reserve_exact(usize::try_from(length).unwrap_or(usize::MAX));
        for k in 0..length {
            let value = self.value(element, i, property)?;
            // Where numbers have no sign, −1 is the greatest of them, if no vertex is.
            let greatest = match property.kind {
                Kind::U8 => f64::from(u8::MAX),
                Kind::U16 => f64::from(u16::MAX),
                Kind::U32 => f64::from(u32::MAX),
                _ => -1.0,
            };
            let is_end = value == -1.0 || value == greatest && value >= self.vertices as f64;
            if strips && is_end {
                corners.push(RESTART);
                continue;
            }
            corners.push(self.index(value, k, element, i)?);
        }
        Ok(())
    }

    /// Asks for the memory of a list before it is read: that of a face, or, of strips, of what is forgotten with the next.
    fn take_list(
        &mut self,
        length: u64,
        element: &Element,
        i: u64,
        property: &Property,
        strips: bool,
    ) -> Result<(), Diagnostic> {
        // Lengths fit into 32 bits.
        if length * self.body.least(property.kind) > self.body.left() {
            return Err(self.missing(&Missing::End, element, i, property));
        }
        let mut for_now = *self.budget;
        let granted =
            if strips { for_now.take(length, size_of::<u32>() as u64) } else { Bare::charge_face(self.budget, length) };
        granted.map_err(|over| Diagnostic::over_budget(&self.source.path, over))
    }

    /// The number of a vertex that is there.
    fn index(&self, value: f64, corner: u64, element: &Element, i: u64) -> Result<u32, Diagnostic> {
        // Below the number of vertices, which fits.
        let is_there = value >= 0.0 && value < self.vertices as f64 && value.fract() == 0.0;
        if !is_there {
            let (name, vertices) = (shorten(&element.name), self.vertices);
            let text = format!("corner {corner} of {name} {i} is vertex {value}, but only {vertices} vertices exist");
            return Err(self.body.fault(text, "it is damaged; export it again"));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        Ok(value as u32)
    }

    fn strip(&mut self, strip: &[u32]) -> Result<(), Diagnostic> {
        for (i, window) in strip.windows(3).enumerate() {
            let &[a, b, c] = window else { continue };
            // Two equal corners only turn the strip.
            if a != b && b != c && c != a {
                let [a, b] = if i % 2 == 0 { [a, b] } else { [b, a] };
                Bare::charge_face(self.budget, 3).map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;
                self.face(&[a, b, c])?;
            }
        }
        Ok(())
    }

    /// Adds a face whose memory was granted.
    fn face(&mut self, corners: &[u32]) -> Result<(), Diagnostic> {
        let most = self.bare.corners.len().max(self.bare.arities.len()) as u64 + corners.len() as u64;
        if most > Bare::LARGEST {
            let text = format!("more than {} faces or corners", Bare::LARGEST);
            return Err(self.body.fault(text, "split the file"));
        }
        self.bare.face(corners);
        Ok(())
    }

    fn value(&mut self, element: &Element, i: u64, property: &Property) -> Result<f64, Diagnostic> {
        self.body.value(property.kind).map_err(|why| self.missing(&why, element, i, property))
    }

    /// How long a list is.
    fn length(&mut self, element: &Element, i: u64, property: &Property) -> Result<u64, Diagnostic> {
        let kind = property.length.unwrap_or(Kind::U8);
        let value = self.body.value(kind).map_err(|why| self.missing(&why, element, i, property))?;
        if value.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&value) {
            let text = format!("{value} is no length of a list, in {}", named(element, i, property));
            return Err(self.body.fault(text, "it is damaged; export it again"));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        Ok(value as u64)
    }

    fn missing(&self, why: &Missing, element: &Element, i: u64, property: &Property) -> Diagnostic {
        self.body.missing(why, &named(element, i, property))
    }

    /// Passes over a whole element.
    fn pass(&mut self, element: &Element) -> Result<(), Diagnostic> {
        for i in 0..element.count {
            for property in &element.properties {
                self.pass_property(element, i, property)?;
            }
        }
        Ok(())
    }

    fn pass_property(&mut self, element: &Element, i: u64, property: &Property) -> Result<(), Diagnostic> {
        let count = if property.length.is_some() { self.length(element, i, property)? } else { 1 };
        self.body.pass(count, property.kind).map_err(|why| self.missing(&why, element, i, property))
    }
}

/// Which properties of an edge are its ends.
fn ends(element: &Element) -> Option<[usize; 2]> {
    let number = |property: &Property, name: &str| property.length.is_none() && property.name == name;
    let slot = |name| element.properties.iter().position(|property| number(property, name));
    Some([slot("vertex1")?, slot("vertex2")?])
}

/// Stands between two strips; more than there can be vertices.
const RESTART: u32 = u32::MAX;

/// What stands for full light.
fn unit(kind: Kind) -> f64 {
    match kind {
        Kind::F32 | Kind::F64 => 1.0,
        Kind::U16 => 65535.0,
        _ => 255.0,
    }
}

fn named(element: &Element, i: u64, property: &Property) -> String {
    format!("`{}` of {} {i}", shorten(&property.name), shorten(&element.name))
}
