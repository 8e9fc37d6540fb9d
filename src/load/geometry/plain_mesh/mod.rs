//! Vertices and faces without statements, as in PLY and STL files -> scene.
//!
//! They are processed like an OBJ's: centred and rounded, cut or kept whole, turned upright. Attributes of faces and corners
//! move to vertices (`wedges`); their material shows a picture (`pictures`), or is plain.

mod pictures;
mod wedges;

use super::finish::{Kind, finish};
use super::{Corner, Face, Geometry, LARGEST, NONE, Run, Soup, WireStatement, color};
use crate::load::limits::{Budget, OverBudget};
use crate::load::paths::shorten;
use crate::load::{Diagnostic, LoadError, LoadOptions, Loaded, Source, Warnings};
use crate::math::{DVec2, DVec3, Vec3};
use crate::scene::UpAxis;
use bytemuck::allocation::try_cast_vec;
use rayon::prelude::*;
use std::path::Path;

/// Contents of a file of bare geometry. Lists of vertex attributes are as long as [`Self::positions`], or empty.
#[derive(Clone, Debug, Default)]
pub(in crate::load) struct PlainMesh {
    pub positions: Vec<DVec3>,
    /// Normals of any length; zero for none.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, v upwards.
    pub uvs: Vec<DVec2>,
    /// Colours, sRGB-coded, and opacity: 0…1 where the file has integers, floats as written.
    pub colors: Vec<[f32; 4]>,
    /// Vertices of all faces, one face after another; all in range.
    pub corners: Vec<u32>,
    /// Number of corners of each face, at least 3.
    pub arities: Vec<u32>,
    /// Texture coordinates of corners, up to the last corner that has some. If not empty, those of vertices are
    /// ignored.
    corner_uvs: Vec<[f64; 2]>,
    /// Colours of faces and of edges, encoded as those of vertices, which are empty then; up to the last face or edge
    /// that has one.
    face_colors: Vec<[f32; 4]>,
    edge_colors: Vec<[f32; 4]>,
    /// Pictures that the file names, with their lines.
    pub pictures: Vec<(u32, String)>,
    /// Index of the picture of each face, or [`NONE`], up to the last face that names one; the others show the first.
    face_pictures: Vec<u32>,
    /// Number of faces with fewer than 3 corners.
    pub few_corners: u64,
    /// Vertices at both ends of each edge; all in range.
    pub edges: Vec<[u32; 2]>,
    /// Decimal places of the finest coordinate; `None` where coordinates are not written in digits.
    pub places: Option<i32>,
    /// Comments of the file.
    pub comments: Vec<String>,
    /// Warnings, besides those about faces.
    pub told: Vec<Diagnostic>,
}

/// Marks a missing colour: not mistaken for a colour of the file, and recognizable after colours have been settled.
const UNSAID: [f32; 4] = [f32::NAN, f32::NAN, f32::NAN, f32::NEG_INFINITY];

/// Attributes of a face besides its corners.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::load) struct FaceAttributes<'a> {
    /// Texture coordinates of its corners, v upwards; empty, or one per corner.
    pub uvs: &'a [[f64; 2]],
    /// Colour, encoded as those of vertices.
    pub color: Option<[f32; 4]>,
    /// Index of its picture in [`PlainMesh::pictures`]; [`NONE`] for none.
    pub picture: Option<u32>,
}

impl PlainMesh {
    /// Bytes that a vertex takes until it is part of a mesh: its attributes, twice in `f64`, in the mesh, and
    /// its entries in tables.
    const VERTEX: u64 = 192;
    /// Bytes that a corner takes: here, as that of a face, and in the mesh.
    const CORNER: u64 = 40;
    /// Bytes that a face takes: here, twice as a statement, and its number in the mesh.
    const FACE: u64 = 56;
    /// Bytes that an edge takes as a statement, with its corners and their vertices.
    const STROKE: u64 = 192;
    /// Bytes that the colour of a face or edge takes.
    pub(in crate::load) const COLOR: u64 = 16;
    /// Bytes that the texture coordinates of a corner take: as read, and as those of a vertex, looked for in a table.
    pub(in crate::load) const CORNER_UV: u64 = 112;
    /// Largest number of vertices, corners or faces.
    pub(in crate::load) const LARGEST: u64 = LARGEST as u64;

    /// Empty mesh of a file that names these pictures.
    pub(in crate::load) fn showing(pictures: Vec<(u32, String)>) -> Self {
        Self { pictures, ..Self::default() }
    }

    /// Takes the memory of `count` vertices from a budget, before they are read.
    pub(in crate::load) fn charge_vertices(budget: &mut Budget, count: u64) -> Result<(), OverBudget> {
        budget.take(count, Self::VERTEX)
    }

    /// Takes the memory of `count` faces of `arity` corners each from a budget, before they are added.
    pub(in crate::load) fn charge_faces(budget: &mut Budget, count: u64, arity: u64) -> Result<(), OverBudget> {
        budget.take(count, Self::FACE.saturating_add(Self::CORNER.saturating_mul(arity)))
    }

    /// Mesh of triangles, three corners each, with one colour per triangle, or none.
    pub(in crate::load) fn of_triangles(positions: Vec<DVec3>, corners: Vec<u32>, colors: Vec<[f32; 4]>) -> Self {
        Self { arities: vec![3; corners.len() / 3], positions, corners, face_colors: colors, ..Self::default() }
    }

    /// Whether nothing joins the vertices: then they are points.
    fn is_cloud(&self) -> bool {
        self.arities.is_empty() && self.edges.is_empty() && self.few_corners == 0
    }

    /// Whether there are only triangles, without attributes except positions and colours of vertices.
    fn is_of_plain_triangles(&self) -> bool {
        let is_plain = self.normals.is_empty() && self.uvs.is_empty() && self.corner_uvs.is_empty();
        let triangles = self.corners.as_chunks::<3>().0.len();
        is_plain
            && self.pictures.is_empty()
            && self.edges.is_empty()
            && triangles > 0
            && triangles == self.arities.len()
            && self.arities.par_iter().with_min_len(MANY).all(|&arity| arity == 3)
    }

    /// Adds a face, or counts one with too few corners.
    #[expect(clippy::cast_possible_truncation, reason = "memory for 2^32 corners was not granted")]
    pub(in crate::load) fn face(&mut self, corners: &[u32], said: &FaceAttributes) {
        if corners.len() < 3 {
            self.few_corners += 1;
            return;
        }
        if !said.uvs.is_empty() {
            self.corner_uvs.resize(self.corners.len(), [f64::NAN; 2]);
            self.corner_uvs.extend_from_slice(said.uvs);
        }
        if let Some(color) = said.color {
            self.face_colors.resize(self.arities.len(), UNSAID);
            self.face_colors.push(color);
        }
        if let Some(picture) = said.picture {
            self.face_pictures.resize(self.arities.len(), 0);
            self.face_pictures.push(picture);
        }
        self.arities.push(corners.len() as u32);
        self.corners.extend_from_slice(corners);
    }

    /// Adds triangles without attributes.
    pub(in crate::load) fn triangles(&mut self, corners: &[u32]) {
        self.arities.resize(self.arities.len() + corners.len() / 3, 3);
        self.corners.extend_from_slice(corners);
    }

    /// Adds an edge.
    pub(in crate::load) fn edge(&mut self, ends: [u32; 2], color: Option<[f32; 4]>) {
        if let Some(color) = color {
            self.edge_colors.resize(self.edges.len(), UNSAID);
            self.edge_colors.push(color);
        }
        self.edges.push(ends);
    }
}

/// Makes a scene of faces and edges, or else of all vertices as points. `format` is the name for reports;
/// `otherwise` the default up axis, and the reason.
///
/// # Errors
/// When points and lines would exceed the budget.
pub(in crate::load) fn load(
    mut bare: PlainMesh,
    format: &str,
    otherwise: (UpAxis, &str),
    source: &Source,
    options: &LoadOptions,
    budget: &mut Budget,
) -> Result<Loaded, LoadError> {
    let file = source.path.as_path();
    let mut warnings = Warnings::default();
    std::mem::take(&mut bare.told).into_iter().for_each(|told| warnings.push(told));
    for colors in [&mut bare.colors, &mut bare.face_colors, &mut bare.edge_colors] {
        let told = color::settle(colors).warning(["color-bytes", "color-range"], file);
        told.into_iter().for_each(|told| warnings.push(told));
    }
    bare.color_vertices(budget).map_err(|over| Diagnostic::over_budget(file, over))?;
    if color::are_all_clear(&bare.colors) {
        let text = "all opacities of vertices are 0: they are taken to mean something else, and the model is opaque";
        warnings.push(Diagnostic::new("color-clear", file, "", text));
    }
    if bare.few_corners > 0 {
        let count = u32::try_from(bare.few_corners).unwrap_or(u32::MAX);
        let text = "a face is dropped: it has fewer than 3 corners";
        warnings.push(Diagnostic { count, ..Diagnostic::new("face-few-corners", file, "", text) });
    }
    budget.take(bare.edges.len() as u64, PlainMesh::STROKE).map_err(|over| Diagnostic::over_budget(file, over))?;
    let kind = Kind {
        format,
        of_faces: ["face-not-finite", "face-degenerate", "face-rounded", "face-crossing", "face-turned"],
        no_faces: "no-faces",
        place: |face| format!("face {face}"),
        otherwise,
        materials: pictures::load,
    };
    let geometry = geometry(bare, file, &mut warnings);
    let mut loaded = finish(geometry, &kind, source, options, warnings, budget)?;
    let told = pictures::leave_out_colors(&mut loaded, file);
    loaded.warnings.extend(told);
    Ok(loaded)
}

/// [`geometry`] for plain triangles, without making statements.
fn plain_triangles(bare: PlainMesh) -> Geometry {
    let (colors, alphas) = split_opacity(bare.colors);
    let mut soup = Soup { positions: bare.positions, colors, alphas, ..Soup::default() };
    // A list with spare capacity is copied.
    let triangles = try_cast_vec(bare.corners).unwrap_or_else(|(_, corners)| corners.as_chunks().0.to_vec());
    soup.leave_out_unused(&triangles);
    Geometry {
        soup,
        triangles,
        runs: vec![Run::default()],
        names: vec![String::new()],
        places: bare.places.unwrap_or(EXACT),
        comments: bare.comments,
        few_corners: u32::try_from(bare.few_corners).unwrap_or(u32::MAX),
        ..Geometry::default()
    }
}

/// Splits colours from opacities, which are empty where all are opaque.
fn split_opacity(colors: Vec<[f32; 4]>) -> (Vec<[f32; 3]>, Vec<f32>) {
    let alphas = color::opacities(&colors);
    (colors.into_par_iter().with_min_len(MANY).map(|[r, g, b, _]| [r, g, b]).collect(), alphas)
}

/// Number of digits so large that only the rounding to `f32` counts.
const EXACT: i32 = 30;

/// Warning that no face shows a picture, though some may have texture coordinates.
fn picture_unused((line, name): &(u32, String), has_places: bool, file: &Path) -> Diagnostic {
    let why = if has_places { "no face shows it" } else { "no face says where it shows which part of it" };
    let text = format!("picture '{}' is not drawn: {why}", shorten(name));
    Diagnostic::new("picture-unused", file, line.to_string(), text)
}

/// Index of the first corner of each face.
fn first_corners(arities: &[u32]) -> Vec<u32> {
    let mut next = 0;
    let first = |&arity: &u32| {
        let first = next;
        next += arity;
        first
    };
    arities.iter().map(first).collect()
}

/// Number of vertices, corners or faces per parallel task.
const MANY: usize = 1 << 12;

/// Geometry like that of an OBJ's statements: a run of plain faces, points and lines, and a run for the faces of each
/// picture.
#[expect(clippy::cast_possible_truncation, reason = "readers keep below PlainMesh::LARGEST")]
fn geometry(mut bare: PlainMesh, file: &Path, warnings: &mut Warnings) -> Geometry {
    if bare.is_of_plain_triangles() {
        return plain_triangles(bare);
    }
    let is_cloud = bare.is_cloud();
    let is_by_corner = !bare.corner_uvs.is_empty();
    let numbers = bare.number_uvs();
    let PlainMesh { positions, normals, uvs, colors, corners, arities, edges, pictures, face_pictures, .. } = bare;
    let unit = |n: Vec3| n.as_dvec3().normalize_or_zero().as_vec3();
    let normals: Vec<Vec3> = normals.into_par_iter().with_min_len(MANY).map(unit).collect();
    let corner = |i: u32| {
        let (uv, normal) = (uvs.get(i as usize), normals.get(i as usize));
        Corner {
            position: i,
            uv: if uv.is_some_and(|uv| uv.is_finite()) { i } else { NONE },
            normal: if normal.is_some_and(|n| *n != Vec3::ZERO) { i } else { NONE },
        }
    };
    let end = |&i: &u32| if is_by_corner { Corner { uv: NONE, ..corner(i) } } else { corner(i) };
    let wire_statements = edges.iter().map(|_| WireStatement { run: 0, line: 0, arity: 2, joined: true }).collect();
    let wire_corners = edges.iter().flatten().map(end).collect();
    let numbered = corners.par_iter().zip(&numbers).with_min_len(MANY);
    let corners = numbered.map(|(&i, &uv)| Corner { uv, ..corner(i) }).collect();
    let (colors, alphas) = split_opacity(colors);
    let mut soup = Soup { positions, uvs, normals, colors, alphas, corners, wire_corners };
    if !is_cloud {
        soup.leave_out_unused(&[]);
    }

    let firsts = first_corners(&arities);
    let face = |(number, (&arity, &first)): (usize, (&u32, &u32))| {
        let number = number as u32;
        let picture = face_pictures.get(number as usize).copied().unwrap_or(0);
        let is_shown = (picture as usize) < pictures.len();
        let shows = is_shown && numbers[first as usize..][..arity as usize].iter().all(|&uv| uv != NONE);
        let run = if shows { picture + 1 } else { 0 };
        Face { run, smoothing: 0, arity, line: number, number, first }
    };
    let faces: Vec<Face> = arities.par_iter().zip(&firsts).with_min_len(MANY).enumerate().map(face).collect();
    let is_plain = faces.par_iter().all(|face| face.run == 0);
    if let Some(picture) = pictures.first().filter(|_| is_plain) {
        let has_places = numbers.iter().any(|&uv| uv != NONE);
        warnings.push(picture_unused(picture, has_places, file));
    }
    let of_picture = |number| Run { material: Some(number), ..Run::default() };
    let shown = if is_plain { 0 } else { pictures.len() as u32 };
    Geometry {
        soup,
        faces,
        wire_statements,
        is_cloud,
        runs: std::iter::once(Run::default()).chain((1..=shown).map(of_picture)).collect(),
        names: std::iter::once(String::new()).chain(pictures.iter().map(|(_, name)| name.clone())).collect(),
        sources: pictures,
        triangles: Vec::new(),
        face_spans: Vec::new(),
        places: bare.places.unwrap_or(EXACT),
        comments: bare.comments,
        few_corners: u32::try_from(bare.few_corners).unwrap_or(u32::MAX),
    }
}
