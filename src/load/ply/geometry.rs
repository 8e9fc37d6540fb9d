//! Elements of a PLY file -> vertices and faces.

use super::body::{Body, Missing};
use super::header::{Element, Encoding, Header, Kind, Property};
use super::meaning::{
    ALPHA, COLOR, Light, Meanings, NORMAL, PLACE, RED, SLOTS, UV, Use, WantedProperties, ends, list_of, uses_in_edges,
    uses_in_faces,
};
use super::packed::Record;
use super::told::passed_over;
use crate::load::diagnostic::DAMAGED;
use crate::load::geometry::NONE;
use crate::load::geometry::plain_mesh::{FaceAttributes, PlainMesh};
use crate::load::limits::Budget;
use crate::load::paths::shorten;
use crate::load::{Diagnostic, Source};
use crate::math::{DVec2, DVec3, Vec3};
use std::path::Path;

/// Reads every element in the order of the file.
///
/// # Errors
/// At the first value that is missing or invalid, or when memory would exceed the budget.
pub(super) fn read(header: &Header, source: &Source, budget: &mut Budget) -> Result<PlainMesh, Diagnostic> {
    let body = Body::new(header, source);
    let vertices = header.element("vertex").map_or(0, |element| element.count);
    // Each name is kept here, in the header and as a material's, and in paths.
    let names: usize = header.pictures.iter().map(|(_, name)| name.len()).sum();
    budget.take(names as u64, 4).map_err(|over| Diagnostic::over_budget(&source.path, over))?;
    let (wanted, bare) = (WantedProperties::of(header), PlainMesh::showing(header.pictures.clone()));
    let mut reader = Reader { source, body, vertices, wanted, budget, bare, torn: None, odd: OddFaces::default() };
    for element in &header.elements {
        if let Err(fault) = reader.element(element) {
            // An invalid value may result from a malformed line far before it.
            return Err(reader.torn.take().unwrap_or(fault));
        }
    }
    let Reader { body, mut bare, torn, odd, .. } = reader;
    let behind = body.behind();
    bare.places = (header.encoding == Encoding::Text).then_some(body.words.places);
    bare.comments.clone_from(&header.comments);
    bare.told.splice(..0, passed_over(header, &source.path));
    bare.told.extend(odd.told(&source.path));
    // Rows may share lines on purpose; where they do by mistake, numbers are left over at the end.
    bare.told.extend(torn.filter(|_| behind.is_some()));
    bare.told.extend(behind);
    bare.told.extend(body.words.respelled.told("ply-number", &source.path));
    Ok(bare)
}

struct Reader<'a, 'b> {
    source: &'a Source,
    body: Body<'a>,
    /// Number of vertices that the header claims; faces may come before them.
    vertices: u64,
    wanted: WantedProperties,
    budget: &'b mut Budget,
    bare: PlainMesh,
    /// Warning about a line whose count of numbers does not match its row.
    torn: Option<Diagnostic>,
    odd: OddFaces,
}

/// Faces whose texture coordinates or picture are invalid: number of faces, and index of the first.
#[derive(Default)]
struct OddFaces {
    /// Faces without two coordinates per corner.
    uneven: (u32, u64),
    /// Faces that name a picture that does not exist.
    no_picture: (u32, u64),
}

impl OddFaces {
    fn count((count, first): &mut (u32, u64), face: u64) {
        if *count == 0 {
            *first = face;
        }
        *count = count.saturating_add(1);
    }

    fn told(&self, file: &Path) -> impl Iterator<Item = Diagnostic> {
        let of = |(count, first): (u32, u64), code, text: &str| {
            let warning = Diagnostic::new(code, file, format!("face {first}"), text).remedy("it is drawn plain");
            (count > 0).then_some(Diagnostic { count, ..warning })
        };
        let uneven = "a face has not two texture coordinates for each corner";
        let no_picture = "a face names a picture (texnumber) of which there is no comment TextureFile";
        [of(self.uneven, "ply-uneven-texcoords", uneven), of(self.no_picture, "ply-no-such-picture", no_picture)]
            .into_iter()
            .flatten()
    }
}

/// Buffers of the face being read, reused for every face.
#[derive(Default)]
struct Row {
    corners: Vec<u32>,
    /// u and v of each corner.
    uvs: Vec<f64>,
    color: Option<[f32; 4]>,
    picture: Option<f64>,
}

/// Line bookkeeping of a text element: programs write a row per line, although any white space separates numbers.
#[derive(Default)]
struct Rows {
    /// First line of the current row.
    start: u32,
    /// Whether the first two rows shared a line: then lines mean nothing.
    is_free: bool,
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
                // Rows without properties take no bytes, however many there are.
                if element.properties.is_empty() { Ok(()) } else { self.pass(element) }
            }
        }
    }

    /// Starts row `i`. Records a warning if it begins on the last line of the row before, as all later rows will be shifted, too.
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
        if element.count > PlainMesh::LARGEST {
            let text = format!("{} vertices are more than {}", element.count, PlainMesh::LARGEST);
            return Err(self.body.fault(text, "split the file"));
        }
        let slots = Meanings::of(element).slots;
        let has = |wanted: &[usize]| wanted.iter().all(|slot| slots.contains(&Some(*slot)));
        if !has(&PLACE) {
            return Err(self.body.fault("vertices have no x, y and z", "export it again"));
        }
        let (has_normals, has_uvs, has_colors) = (has(&NORMAL), has(&UV), has(&COLOR));
        PlainMesh::charge_vertices(self.budget, element.count)
            .map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;

        if self.packed_vertices(element, &slots, [has_normals, has_uvs, has_colors]) {
            self.brighten(element, &slots);
            return Ok(());
        }
        // The budget has room for that many vertices.
        self.bare.positions.reserve_exact(element.count as usize);
        let mut rows = Rows::default();
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            let mut values = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
            for (property, slot) in element.properties.iter().zip(&slots) {
                match slot {
                    Some(slot) => {
                        let value = self.value(element, i, property)?;
                        values[*slot] = if *slot < RED { value } else { Light::said_by(property).part(value) };
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
        self.brighten(element, &slots);
        Ok(())
    }

    /// Rescales 16-bit colours that are all below 256, as bytes: some programs write bytes into wider numbers, and no scan
    /// is as dark as that.
    fn brighten(&mut self, element: &Element, slots: &[Option<usize>]) {
        /// Ratio of the 16-bit code to the 8-bit code of a colour.
        const WIDER: f32 = 257.0;
        /// Smallest brightest colour; below it the values may be noise in the dark.
        const LEAST: f32 = 8.0 / 255.0 / WIDER;
        /// Half a step above 255 of 65535, to allow for rounding.
        const BYTE: f32 = 255.5 / 65535.0;
        let of_slot = |slot: usize| element.properties.iter().zip(slots).find(|(_, s)| **s == Some(slot));
        let is_wide = |slot: usize| of_slot(slot).is_some_and(|(property, _)| property.kind == Kind::U16);
        let greatest = self.bare.colors.iter().flat_map(|color| &color[..3]).copied().fold(0.0, f32::max);
        let are_bytes = (LEAST..BYTE).contains(&greatest);
        if !are_bytes || !COLOR.into_iter().all(is_wide) {
            return;
        }
        let most_opaque = self.bare.colors.iter().map(|color| color[3]).fold(0.0, f32::max);
        let parts = if is_wide(ALPHA) && most_opaque < BYTE { 4 } else { 3 };
        self.bare.colors.iter_mut().flat_map(|color| &mut color[..parts]).for_each(|part| *part *= WIDER);
        let text = "colours of 16 bits, all of them below 256, are taken as 0 … 255";
        self.bare.told.push(Diagnostic::new("color-bytes", &self.source.path, "", text));
    }

    /// Reads the vertices of a binary file in parallel, if they have no lists; `has` tells whether they have normals, texture
    /// coordinates and colours. Returns whether they were read.
    fn packed_vertices(&mut self, element: &Element, slots: &[Option<usize>], has: [bool; 3]) -> bool {
        let Some(rows) = self.body.packed(element, None) else { return false };
        let mut said = [None; SLOTS.len()];
        for (k, (property, slot)) in element.properties.iter().zip(slots).enumerate() {
            if let Some(slot) = slot {
                said[*slot] = Some((rows.start(k), property.kind, Light::said_by(property)));
            }
        }
        let value = |row: Record, slot: usize| match said[slot] {
            Some((at, kind, _)) if slot < RED => row.value(at, kind),
            Some((at, kind, light)) => light.part(row.value(at, kind)),
            // Vertices without opacity are opaque.
            None => f64::from(u8::from(slot == ALPHA)),
        };
        self.bare.positions = rows.each(|row| DVec3::from(PLACE.map(|slot| value(row, slot))));
        let [has_normals, has_uvs, has_colors] = has;
        if has_normals {
            self.bare.normals = rows.each(|row| Vec3::from(NORMAL.map(|slot| value(row, slot) as f32)));
        }
        if has_uvs {
            self.bare.uvs = rows.each(|row| DVec2::from(UV.map(|slot| value(row, slot))));
        }
        if has_colors {
            let [r, g, b] = COLOR;
            self.bare.colors = rows.each(|row| [r, g, b, ALPHA].map(|slot| value(row, slot) as f32));
        }
        self.body.pass_packed(&rows);
        true
    }

    /// Reads edges as lines.
    fn edges(&mut self, element: &Element) -> Result<(), Diagnostic> {
        let Some(ends) = ends(element) else { return self.pass(element) };
        let (uses, mut rows) = (uses_in_edges(element, ends, self.wanted), Rows::default());
        self.take_colors(element.count, &uses)?;
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            let (mut edge, mut color) = ([0; 2], None);
            for (property, used) in element.properties.iter().zip(&uses) {
                match *used {
                    Use::End(end) => {
                        let value = self.value(element, i, property)?;
                        edge[end] = self.index(value, end as u64, element, i)?;
                    }
                    Use::Light(part) => self.light(element, i, property, part, &mut color)?,
                    _ => self.pass_property(element, i, property)?,
                }
            }
            // An edge takes the memory of a face with two corners.
            PlainMesh::charge_faces(self.budget, 1, 2)
                .map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;
            self.bare.edge(edge, color);
        }
        Ok(())
    }

    /// Reads polygons, or strips of triangles.
    fn faces(&mut self, element: &Element, list: usize, strips: bool) -> Result<(), Diagnostic> {
        let uses = uses_in_faces(element, list, strips, self.wanted);
        if !strips {
            if self.packed_triangles(element, list, &uses)? {
                return Ok(());
            }
            self.take_colors(element.count, &uses)?;
        }
        let (mut row, mut rows) = (Row::default(), Rows::default());
        for i in 0..element.count {
            self.row(&mut rows, element, i);
            (row.color, row.picture) = (None, None);
            for (property, used) in element.properties.iter().zip(&uses) {
                match *used {
                    Use::Corners => self.corners(element, i, property, strips, &mut row.corners)?,
                    Use::Uvs => self.uvs(element, i, property, &mut row.uvs)?,
                    Use::Picture => row.picture = Some(self.value(element, i, property)?),
                    Use::Light(part) => self.light(element, i, property, part, &mut row.color)?,
                    Use::End(_) | Use::Nothing => self.pass_property(element, i, property)?,
                }
            }
            if strips {
                for strip in row.corners.split(|&corner| corner == RESTART) {
                    self.strip(strip, row.color)?;
                }
            } else {
                self.polygon(i, &row)?;
            }
        }
        Ok(())
    }

    /// Reads the faces of a binary file in parallel, if all are triangles of existing vertices without other used properties.
    /// Returns whether they were read.
    fn packed_triangles(&mut self, element: &Element, list: usize, uses: &[Use]) -> Result<bool, Diagnostic> {
        let lists = element.properties.iter().filter(|property| property.length.is_some()).count();
        let is_plain = lists == 1 && uses.iter().all(|used| matches!(used, Use::Corners | Use::Nothing));
        let Some(rows) = self.body.packed(element, Some(3)).filter(|_| is_plain) else { return Ok(false) };
        let Property { kind, length: Some(length), .. } = element.properties[list] else { return Ok(false) };
        let (start, vertices) = (rows.start(list), self.vertices as f64);
        let corners = |row: Record| [0, 1, 2].map(|k| row.value(start + length.size() + k * kind.size(), kind));
        let is_there = |corner: f64| corner >= 0.0 && corner < vertices && corner.fract() == 0.0;
        let is_sound = |row: Record| row.value(start, length) == 3.0 && corners(row).into_iter().all(is_there);
        let most = (self.bare.corners.len() as u64).saturating_add(element.count.saturating_mul(3));
        if most > PlainMesh::LARGEST || !rows.all(is_sound) {
            return Ok(false);
        }
        PlainMesh::charge_faces(self.budget, element.count, 3)
            .map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole numbers below that of vertices"
        )]
        let triangles = rows.each(|row| corners(row).map(|corner| corner as u32));
        self.bare.triangles(triangles.as_flattened());
        self.body.pass_packed(&rows);
        Ok(true)
    }

    /// Adds a face that was read, with its colour, texture coordinates and picture.
    fn polygon(&mut self, i: u64, row: &Row) -> Result<(), Diagnostic> {
        let uvs = match row.uvs.as_chunks() {
            (uvs, []) if uvs.is_empty() || uvs.len() == row.corners.len() => uvs,
            _ => {
                OddFaces::count(&mut self.odd.uneven, i);
                &[]
            }
        };
        let picture = row.picture.map(|number| self.picture(i, number));
        self.face(&row.corners, &FaceAttributes { uvs, color: row.color, picture })
    }

    /// Index of the picture that face `i` names; none for numbers below 0.
    fn picture(&mut self, i: u64, number: f64) -> u32 {
        let is_there = number >= 0.0 && number < self.bare.pictures.len() as f64 && number.fract() == 0.0;
        if !is_there {
            if number >= 0.0 || number.is_nan() {
                OddFaces::count(&mut self.odd.no_picture, i);
            }
            return NONE;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        let number = number as u32;
        number
    }

    /// Reads a colour channel; channels not read are white.
    fn light(
        &mut self,
        element: &Element,
        i: u64,
        property: &Property,
        part: usize,
        color: &mut Option<[f32; 4]>,
    ) -> Result<(), Diagnostic> {
        let value = Light::said_by(property).part(self.value(element, i, property)?);
        color.get_or_insert([1.0; 4])[part] = value as f32;
        Ok(())
    }

    /// Reads a list of texture coordinates.
    fn uvs(&mut self, element: &Element, i: u64, property: &Property, uvs: &mut Vec<f64>) -> Result<(), Diagnostic> {
        let length = self.length(element, i, property)?;
        if length * self.body.least(property.kind) > self.body.left() {
            return Err(self.missing(&Missing::End, element, i, property));
        }
        self.take(length, PlainMesh::CORNER_UV / 2)?;
        uvs.clear();
        for _ in 0..length {
            uvs.push(self.value(element, i, property)?);
        }
        Ok(())
    }

    /// Takes the memory of the colours of `count` faces or edges, if they have colours.
    fn take_colors(&mut self, count: u64, uses: &[Use]) -> Result<(), Diagnostic> {
        let is_colored = uses.iter().any(|used| matches!(used, Use::Light(_)));
        self.take(if is_colored { count } else { 0 }, PlainMesh::COLOR)
    }

    fn take(&mut self, count: u64, bytes: u64) -> Result<(), Diagnostic> {
        self.budget.take(count, bytes).map_err(|over| Diagnostic::over_budget(&self.source.path, over))
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
            // In unsigned types, −1 is the largest value, unless a vertex has that index.
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

    /// Takes the memory of a list before it is read: that of a face, or, for a strip, checks that of its temporary list.
    fn take_list(
        &mut self,
        length: u64,
        element: &Element,
        i: u64,
        property: &Property,
        strips: bool,
    ) -> Result<(), Diagnostic> {
        // Lengths fit into 32 bits, so the product cannot overflow.
        if length * self.body.least(property.kind) > self.body.left() {
            return Err(self.missing(&Missing::End, element, i, property));
        }
        let mut for_now = *self.budget;
        let granted = if strips {
            for_now.take(length, size_of::<u32>() as u64)
        } else {
            PlainMesh::charge_faces(self.budget, 1, length)
        };
        granted.map_err(|over| Diagnostic::over_budget(&self.source.path, over))
    }

    /// Checks the index of a vertex.
    fn index(&self, value: f64, corner: u64, element: &Element, i: u64) -> Result<u32, Diagnostic> {
        // Less than the number of vertices, so it fits.
        let is_there = value >= 0.0 && value < self.vertices as f64 && value.fract() == 0.0;
        if !is_there {
            let (name, vertices) = (shorten(&element.name), self.vertices);
            let exist = if vertices == 0 {
                "there are none before it".into()
            } else {
                format!("only {vertices} vertices exist")
            };
            let text = format!("corner {corner} of {name} {i} is vertex {value}, but {exist}");
            return Err(self.body.fault(text, DAMAGED));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        Ok(value as u32)
    }

    fn strip(&mut self, strip: &[u32], color: Option<[f32; 4]>) -> Result<(), Diagnostic> {
        for (i, window) in strip.windows(3).enumerate() {
            let &[a, b, c] = window else { continue };
            // A window with two equal corners only flips the winding.
            if a != b && b != c && c != a {
                let [a, b] = if i % 2 == 0 { [a, b] } else { [b, a] };
                PlainMesh::charge_faces(self.budget, 1, 3)
                    .map_err(|over| Diagnostic::over_budget(&self.source.path, over))?;
                if color.is_some() {
                    self.take(1, PlainMesh::COLOR)?;
                }
                self.face(&[a, b, c], &FaceAttributes { color, ..FaceAttributes::default() })?;
            }
        }
        Ok(())
    }

    /// Adds a face whose memory was taken.
    fn face(&mut self, corners: &[u32], said: &FaceAttributes) -> Result<(), Diagnostic> {
        let most = self.bare.corners.len().max(self.bare.arities.len()) as u64 + corners.len() as u64;
        if most > PlainMesh::LARGEST {
            let text = format!("more than {} faces or corners", PlainMesh::LARGEST);
            return Err(self.body.fault(text, "split the file"));
        }
        self.bare.face(corners, said);
        Ok(())
    }

    fn value(&mut self, element: &Element, i: u64, property: &Property) -> Result<f64, Diagnostic> {
        self.body.value(property.kind).map_err(|why| self.missing(&why, element, i, property))
    }

    /// Reads the length of a list.
    fn length(&mut self, element: &Element, i: u64, property: &Property) -> Result<u64, Diagnostic> {
        let kind = property.length.unwrap_or(Kind::U8);
        let value = self.body.value(kind).map_err(|why| self.missing(&why, element, i, property))?;
        if value.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&value) {
            let text = format!("{value} is no length of a list, in {}", named(element, i, property));
            return Err(self.body.fault(text, DAMAGED));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked just before")]
        Ok(value as u64)
    }

    fn missing(&self, why: &Missing, element: &Element, i: u64, property: &Property) -> Diagnostic {
        self.body.missing(why, &named(element, i, property))
    }

    /// Skips a whole element.
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

/// Separates two strips; greater than any vertex index.
const RESTART: u32 = u32::MAX;

fn named(element: &Element, i: u64, property: &Property) -> String {
    format!("`{}` of {} {i}", shorten(&property.name), shorten(&element.name))
}
