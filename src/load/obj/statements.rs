//! OBJ text -> checked statements: vertices, faces with the corners they name, and the state between them
//! (names, materials, smoothing groups, colours).
//!
//! The text is cut into runs of whole lines (`split`), which are read in parallel (`chunk`) and joined as if they had
//! been read in sequence (`join`). The text's own errors are reported here, with their line (`faults`): later stages
//! see valid indices only.

use super::chunk::{self, Chunk};
use super::join::{Joined, join};
use super::{faults, split};
use crate::load::geometry::{FaceSpan, Geometry, LARGEST, Run};
use crate::load::limits::{Budget, OverBudget};
use crate::load::text::encoding::decode_name;
use crate::load::wires::Wires;
use crate::load::{Diagnostic, LoadError, Warnings};
use crate::scene::{Instance, Material, Mesh};
use rayon::prelude::*;
use std::mem::size_of;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of occurrences of an oddity, and the first of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Tally {
    pub count: u32,
    line: u32,
    word: String,
}

impl Tally {
    /// Adds occurrences from further on, where `lines` lines precede.
    fn append(&mut self, more: Self, lines: u32) {
        if self.count == 0 && more.count > 0 {
            (self.line, self.word) = (more.line.saturating_add(lines), more.word);
        }
        self.count = self.count.saturating_add(more.count);
    }

    pub(super) fn note(&mut self, line: u32, word: &[u8]) {
        if self.count == 0 {
            self.line = line;
            self.word = crate::load::paths::shorten(&decode_name(word));
        }
        self.count = self.count.saturating_add(1);
    }
}

/// Counts of oddities.
#[derive(Clone, Debug, Default)]
pub(super) struct Oddities {
    pub wire_statements: Tally,
    pub curves: Tally,
    /// Statements that stand for others (`call`, `csh`).
    pub calls: Tally,
    pub few_corners: Tally,
    pub unknown: Tally,
    pub number: Tally,
    /// Normals that are not three numbers.
    pub normal: Tally,
    pub short: Tally,
    pub weight: Tally,
    pub columns: Tally,
    /// Opacities of vertices.
    pub alpha: Tally,
    pub smoothing: Tally,
    /// Corners that name texture coordinate or normal 0.
    pub zero: Tally,
    absent: Tally,
}

/// The statements of a whole file.
#[derive(Clone, Debug, Default)]
pub(super) struct Statements {
    pub geometry: Geometry,
    pub odd: Oddities,
}

/// Reads the whole text.
///
/// # Errors
/// When a face names data that does not exist, its corners cannot be read, or memory would exceed the budget.
pub(super) fn read(text: &[u8], file: &Path, budget: &mut Budget) -> Result<Statements, LoadError> {
    read_in_runs(text, RUN, file, budget)
}

/// Bytes of a run of lines: enough to keep a thread busy, few enough that all threads end together.
const RUN: usize = 1 << 18;

fn read_in_runs(text: &[u8], run: usize, file: &Path, budget: &mut Budget) -> Result<Statements, LoadError> {
    let chunks =
        read_side_by_side(&split::runs(text, run), budget).map_err(|over| Diagnostic::over_budget(file, over))?;
    let Joined { mut statements, faulty } = join(chunks).map_err(|largest| {
        let text = format!("{largest} vertices, corners or faces are more than {LARGEST}");
        Diagnostic::new("obj-too-large", file, "", text).remedy("split the file")
    })?;
    if faulty {
        statements.odd.absent = faults::find(text, file)?;
    }
    if statements.is_cloud() {
        budget
            .take(statements.geometry.soup.positions.len() as u64, POINT)
            .map_err(|over| Diagnostic::over_budget(file, over))?;
        statements.geometry.draw_points();
    } else {
        let Geometry { soup, triangles, .. } = &mut statements.geometry;
        soup.leave_out_unused(triangles);
    }
    statements.geometry.few_corners = statements.odd.few_corners.count;
    Ok(statements)
}

/// Bytes of a point: its vertex, and the two ends of the line without length that it is stored as.
const POINT: u64 = 48;

impl Statements {
    /// Whether no statement joins vertices or was meant to: then they are points, as scanners write them.
    fn is_cloud(&self) -> bool {
        let odd = &self.odd;
        let others = [&odd.wire_statements, &odd.curves, &odd.calls, &odd.few_corners, &odd.absent];
        let Geometry { faces, triangles, wire_statements, .. } = &self.geometry;
        faces.is_empty()
            && triangles.is_empty()
            && wire_statements.is_empty()
            && others.iter().all(|tally| tally.count == 0)
    }
}

/// Reads every run in parallel; stops soon after the memory exceeds the budget.
fn read_side_by_side(runs: &[&[u8]], budget: &mut Budget) -> Result<Vec<Chunk>, OverBudget> {
    let taken = AtomicU64::new(0);
    let most = *budget;
    let read = |text: &&[u8]| {
        let mut left = most;
        left.take(taken.load(Ordering::Relaxed), 1)?;
        let chunk = chunk::read(text);
        taken.fetch_add(bytes(&chunk), Ordering::Relaxed);
        Ok(chunk)
    };
    let chunks = runs.par_iter().map(read).collect::<Result<Vec<_>, OverBudget>>()?;
    budget.take(taken.into_inner(), 1)?;
    Ok(chunks)
}

/// Bytes that a run takes until it has become part of a mesh.
fn bytes(chunk: &Chunk) -> u64 {
    /// A face, and its number in the mesh.
    const FACE: u64 = 24 + 4;
    /// Twice: in the run of lines and in the whole.
    const STRETCH: u64 = 2 * size_of::<FaceSpan>() as u64;
    /// Numbers, indices, those of the mesh, and their vertex.
    const CORNER: u64 = 12 + 12 + 12 + 16;
    /// Twice in `f64`, then in `f32`, and in the mesh.
    const VERTEX: u64 = 2 * 24 + 12 + 12;
    /// Four times a name with its table entry: in the run of lines and in the whole.
    const NAME: u64 = 4 * 56;
    /// A mesh and its instance, or points and lines, with a few lists of their own.
    const RUN: u64 =
        2 * (size_of::<Run>() + size_of::<Mesh>() + size_of::<Instance>() + size_of::<Wires>() + 100) as u64;
    let vertices =
        chunk.positions.len() + chunk.uvs.len() + chunk.normals.len() + chunk.colors.len() + chunk.paint.len();
    let corners = chunk.corners.len() + chunk.wire_corners.len();
    let faces = chunk.face_count as usize + chunk.wire_statements.len();
    let texts = chunk.names.iter().chain(chunk.libraries.iter().map(|(_, names)| names));
    let names: u64 = texts.map(|name| NAME + 4 * name.len() as u64).sum();
    // Each may have a material of its own.
    let materials = chunk.runs.iter().filter(|run| run.material.is_some()).count() * size_of::<Material>();
    let runs = chunk.runs.len() as u64 * RUN + materials as u64;
    faces as u64 * FACE
        + chunk.faces.len() as u64 * STRETCH
        + corners as u64 * CORNER
        + vertices as u64 * VERTEX
        + names
        + runs
}

impl Oddities {
    /// Adds oddities from further on, where `lines` lines precede.
    pub(super) fn append(&mut self, more: Self, lines: u32) {
        self.wire_statements.append(more.wire_statements, lines);
        self.curves.append(more.curves, lines);
        self.calls.append(more.calls, lines);
        self.few_corners.append(more.few_corners, lines);
        self.unknown.append(more.unknown, lines);
        self.number.append(more.number, lines);
        self.normal.append(more.normal, lines);
        self.short.append(more.short, lines);
        self.weight.append(more.weight, lines);
        self.columns.append(more.columns, lines);
        self.alpha.append(more.alpha, lines);
        self.smoothing.append(more.smoothing, lines);
        self.zero.append(more.zero, lines);
    }

    /// Adds one warning for each kind of oddity.
    pub(super) fn warn(&self, file: &Path, warnings: &mut Warnings) {
        let mut warn = |code, tally: &Tally, text: String, remedy: &str| {
            if tally.count > 0 {
                let warning = Diagnostic::new(code, file, tally.line.to_string(), text).remedy(remedy);
                warnings.push(Diagnostic { count: tally.count, ..warning });
            }
        };
        let wire = format!("'{}' names no vertices of this file and is left out", self.wire_statements.word);
        warn("obj-bad-line", &self.wire_statements, wire, "export the model again");
        let curve = format!("free-form geometry ('{}') is not drawn", self.curves.word);
        warn("obj-free-form", &self.curves, curve, "export it as polygons");
        let call = format!("what '{}' stands for is not read", self.calls.word);
        warn("obj-call", &self.calls, call, "put the statements into this file");
        let few = "a face with fewer than 3 corners is dropped";
        warn("obj-few-corners", &self.few_corners, few.into(), "");
        warn("obj-unknown-statement", &self.unknown, format!("'{}' is not an OBJ statement", self.unknown.word), "");
        let odd = format!("'{}' is not a number as OBJ writes them", self.number.word);
        warn(
            "obj-odd-number",
            &self.number,
            odd,
            "of numbers what can be read counts, of places without any no face is drawn",
        );
        let normal = format!("'{}' is not the three numbers of a normal, which is not used", self.normal.word);
        warn("obj-odd-normal", &self.normal, normal, "");
        let short = format!("too few numbers: '{}'", self.short.word);
        warn("obj-short-vector", &self.short, short, "the missing ones count as 0");
        let weight = "a vertex weight (fourth number) is ignored: it is for rational curves";
        warn("obj-vertex-weight", &self.weight, weight.into(), "");
        let columns = "numbers after the coordinates are neither a weight nor a colour and are ignored";
        warn("obj-vertex-columns", &self.columns, columns.into(), "");
        let alpha = "the opacity of a vertex is left out: its colour is opaque";
        warn(
            "obj-vertex-alpha",
            &self.alpha,
            alpha.into(),
            "write the mesh as PLY or glTF, where vertices have opacities",
        );
        let absent = format!("a corner names {}, but the file has none; it is drawn without", self.absent.word);
        warn("obj-absent-attribute", &self.absent, absent, "");
        let zero = format!("a corner names {} 0, but numbers start at 1; it is drawn without", self.zero.word);
        warn("obj-absent-attribute", &self.zero, zero, "");
        let smoothing = format!("smoothing group '{}' is not a number; faces are flat", self.smoothing.word);
        warn("obj-smoothing-group", &self.smoothing, smoothing, "");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Limits;
    use crate::load::geometry::{Face, NONE, WireStatement, color};
    use crate::math::{DVec2, DVec3, Vec3};

    fn read_with(text: &str, memory: u64) -> Result<Statements, LoadError> {
        read(text.as_bytes(), Path::new("m.obj"), &mut Budget::new(&Limits { memory, ..Limits::default() }))
    }

    /// Statements with faces and corners written out, also for plain triangles.
    fn of(text: &str) -> Statements {
        let mut statements = read_with(text, u64::MAX).unwrap();
        if !statements.geometry.triangles.is_empty() {
            statements.geometry.spell_out();
        }
        statements
    }

    fn fault(text: &str) -> String {
        read_with(text, u64::MAX).unwrap_err().to_string()
    }

    /// Numbers of vertices, coordinates and normals as the text counts them; 0: none.
    fn corners(s: &Statements) -> Vec<[u32; 3]> {
        let number = |index: u32| if index == NONE { 0 } else { index + 1 };
        s.geometry.soup.corners.iter().map(|c| [c.position, c.uv, c.normal].map(number)).collect()
    }

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

    #[test]
    fn negative_numbers_count_back_from_the_last_vertex_read() {
        let s = of(&format!("{TRIANGLE}vt 0 0\nf -3/-1 -2 -1//\n{TRIANGLE}f -3 -2 -1"));
        assert_eq!(corners(&s), [[1, 1, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0], [5, 0, 0], [6, 0, 0]]);
    }

    #[test]
    fn a_face_may_name_a_vertex_that_comes_later() {
        assert_eq!(of(&format!("f 1 2 3\n{TRIANGLE}")).geometry.soup.corners.len(), 3);
    }

    #[test]
    fn numbers_of_what_is_not_there_are_told_with_line_and_corner() {
        let start = "m.obj:4: corner 2 of the face names";
        assert!(fault(&format!("{TRIANGLE}f 1 0 3")).starts_with(&format!("{start} vertex 0, but numbers start at 1")));
        assert!(fault(&format!("{TRIANGLE}f 1 9 3")).starts_with(&format!("{start} vertex 9, but there are 3")));
        assert!(
            fault(&format!("{TRIANGLE}f 1 -4 3")).starts_with(&format!("{start} vertex -4, but 3 stand before it"))
        );
        let start = format!("{TRIANGLE}vt 0 0\nvn 0 0 1\n");
        assert!(fault(&format!("{start}f 1/2 2 3")).contains("texture coordinate 2, but there are 1"));
        assert!(fault(&format!("{start}f 1//2 2 3\nf 1//3 2 3")).contains("normal 2, but there are 1 (×2)"));
        assert!(fault(&format!("{TRIANGLE}f 1 x 3")).contains("corner 2 of the face is 'x'"));
        assert!(fault(&format!("{TRIANGLE}f 1 1/1/1/1 3")).contains("not of the form"));
        assert!(fault(&format!("{TRIANGLE}f 1 99999999999999999999 3")).contains("not of the form"));
    }

    #[test]
    fn coordinates_and_normals_left_out_as_a_whole_are_only_a_warning() {
        let s = of(&format!("{TRIANGLE}f 1/1/1 2/2/1 3/3/1"));
        assert_eq!(corners(&s), [[1, 0, 0], [2, 0, 0], [3, 0, 0]]);
        assert_eq!(s.odd.absent.count, 6);
    }

    #[test]
    fn zero_is_no_coordinate_and_no_normal_but_a_fault_as_a_vertex() {
        let s = of(&format!("{TRIANGLE}vt 0 0\nvn 0 0 1\nf 1/0/1 2/1/0 3/0/0\nl 1/0 2"));
        assert_eq!(corners(&s), [[1, 0, 1], [2, 1, 0], [3, 0, 0]]);
        assert_eq!((s.geometry.wire_statements.len(), s.odd.zero.count), (1, 5));
        let mut warnings = Warnings::default();
        s.odd.warn(Path::new("m.obj"), &mut warnings);
        let told: Vec<String> = warnings.into_vec().iter().map(ToString::to_string).collect();
        let text = "m.obj:6: a corner names texture coordinate 0, but numbers start at 1; it is drawn without (×5)";
        assert_eq!(told, [text]);
        assert!(fault(&format!("{TRIANGLE}f 1/0 0/0 3/0")).contains("corner 2 of the face names vertex 0"));
        // Beside numbers of missing data, which trigger another pass over the text.
        assert_eq!(of(&format!("{TRIANGLE}f 1/0/1 2/0/1 3/0/1")).odd.absent.count, 3);
    }

    #[test]
    fn runs_with_the_same_names_and_material_are_one() {
        let text = "o a\nusemtl r\nf 1 2 3\nusemtl b\nf 1 2 3\nusemtl r\nf 1 2 3\ng x\nf 1 2 3\no b\nf 1 2 3";
        let s = of(&format!("{TRIANGLE}{text}"));
        assert_eq!(s.geometry.faces.iter().map(|f| f.run).collect::<Vec<_>>(), [0, 1, 0, 2, 3]);
        let named = |run: usize| {
            let Run { object, group, material } = s.geometry.runs[run];
            let name = |id: u32| s.geometry.names[id as usize].as_str();
            (name(object), name(group), name(material.unwrap()))
        };
        assert_eq!((named(2), named(3)), (("a", "x", "r"), ("b", "", "r")));
    }

    #[test]
    fn smoothing_groups_are_numbers_on_or_off() {
        let s = of(&format!("{TRIANGLE}f 1 2 3\ns 7\nf 1 2 3\ns off\nf 1 2 3\ns on\nf 1 2 3\ns x\nf 1 2 3"));
        assert_eq!(s.geometry.faces.iter().map(|f| f.smoothing).collect::<Vec<_>>(), [0, 7, 0, 1, 0]);
        assert_eq!(s.odd.smoothing.count, 1);
    }

    #[test]
    fn colors_on_some_vertices_leave_the_others_white() {
        let mut s = of("v 0 0 0\nv 1 0 0 1 0.5 0\nv 2 0 0\nv 3 0 0 0 0 1 0.5\nv 4 0 0 0.5");
        assert_eq!(color::settle(&mut s.geometry.soup.colors), color::Coding::Units);
        assert_eq!(s.geometry.soup.colors, [[1.0; 3], [1.0, 0.5, 0.0], [1.0; 3], [0.0, 0.0, 1.0], [1.0; 3]]);
        assert_eq!(s.odd.weight.count, 1);
        assert!(of("v 0 0 0\nv 1 1 1").geometry.soup.colors.is_empty());
    }

    #[test]
    fn curves_are_counted_and_short_faces_dropped() {
        let s = of(&format!("{TRIANGLE}p 1 2 3\nl 1 2 3\nsurf 0 1 0 1 1\nf 1 2\nf\nf 1 2 3\nhello"));
        assert_eq!((s.odd.wire_statements.count, s.odd.curves.count), (0, 1));
        assert_eq!((s.odd.few_corners.count, s.odd.unknown.count), (2, 1));
        assert_eq!(s.geometry.faces, [Face { run: 0, smoothing: 0, arity: 3, line: 9, number: 2, first: 0 }]);
    }

    #[test]
    fn statements_of_other_files_and_commands_are_told_and_not_read() {
        let s = of(&format!("{TRIANGLE}call other.obj 1\ncsh -rm x\nf 1 2 3"));
        let mut warnings = Warnings::default();
        s.odd.warn(Path::new("m.obj"), &mut warnings);
        let told: Vec<String> = warnings.into_vec().iter().map(ToString::to_string).collect();
        assert_eq!(told, ["m.obj:4: what 'call' stands for is not read (×2); put the statements into this file"]);
    }

    #[test]
    fn points_and_lines_name_vertices_like_faces_and_bad_ones_are_left_out() {
        let text = format!("l 1/1 2 3 # side\n{TRIANGLE}vt 0 0\np -1 1\nl 1\nl 1 9\np x\np\nl 1 -4\nf 1 2 3\nl 2 3");
        let s = of(&text);
        let wire = |line, arity, joined| WireStatement { run: 0, line, arity, joined };
        assert_eq!(s.geometry.wire_statements, [wire(1, 3, true), wire(6, 2, false), wire(13, 2, true)]);
        let numbers: Vec<_> = s.geometry.soup.wire_corners.iter().map(|c| (c.position, c.uv == NONE)).collect();
        let at = |i| (i, true);
        assert_eq!(numbers, [(0, false), at(1), at(2), at(2), at(0), at(1), at(2)]);
        assert_eq!(s.odd.wire_statements.count, 5);
    }

    #[test]
    fn odd_and_missing_numbers_are_read_and_counted() {
        let s = of("v 1,5 0 # hi\nvt 0.5\nvn 1 0\nv 1 2 3 # hi\nvt 1 2 3\nf 1 2 1");
        assert_eq!(s.geometry.soup.positions, [DVec3::new(1.5, 0.0, 0.0), DVec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(
            (s.geometry.soup.uvs, s.geometry.soup.normals),
            (vec![DVec2::new(0.5, 0.0), DVec2::new(1.0, 2.0)], vec![Vec3::ZERO])
        );
        assert_eq!((s.odd.short.count, s.odd.number.count, s.odd.normal.count), (1, 1, 1));
    }

    #[test]
    fn memory_over_the_budget_is_refused() {
        let text = format!("{TRIANGLE}f 1 2 3");
        assert!(read_with(&text, 200).unwrap_err().to_string().contains("--max-memory"));
        assert!(read_with(&text, 10_000).is_ok());
        // Groups without faces leave names, those with faces leave meshes.
        let empty: String = (0..1000).map(|i| format!("g {i}\n")).collect();
        let full: String = (0..1000).map(|i| format!("g {i}\nf 1 2 3\n")).collect();
        for (groups, memory) in [(empty, 200_000), (full, 800_000)] {
            assert!(read_with(&format!("{TRIANGLE}{groups}"), memory).is_err());
            assert!(read_with(&format!("{TRIANGLE}{groups}"), 10 * memory).is_ok());
        }
    }

    /// Every kind of statement, so that each kind of state has to cross from one run of lines to the next.
    fn all_kinds() -> String {
        let mut text = String::from("# first\nmtllib a.mtl\n");
        for i in 0..60 {
            text += &format!("v {i} 0.5 {}\nv {i}.25 1 0 0.1 0.2 0.3\nvt 0 {i} 0\nvn 0 {} 1\n", i * i, i % 5);
            match i % 12 {
                1 => text += "o a\n",
                2 => text += "usemtl m\nf 1 2 -1\n",
                3 => text += "g left # side\ns 4\n",
                4 => text += "f -1 -2/-1 \\\n 2//1\n",
                5 => text += "s off\nf 1 2\nhello\n# C:\\\n",
                6 => text += "v 1,5 2\nl 1 2\np 1 2\n",
                7 => text += "o b\r\nf 1/1/1\t2/2/2 3/3/1 \r\n",
                8 => text += "usemtl n\n\n  f 4 3 2 1\n",
                9 => text += "curv 0 1 1 2\ncall a.obj\nv 1 2 3 4\nmtllib b.mtl\n# more\n",
                _ => text += "f 1 2 3\nf 1//1 2//1 100//60\n",
            }
        }
        text
    }

    fn in_runs(text: &str, run: usize) -> Statements {
        let mut budget = Budget::new(&Limits::default());
        read_in_runs(text.as_bytes(), run, Path::new("m.obj"), &mut budget).unwrap()
    }

    /// Plain triangles, with blank lines and comments between them, some with numbers that count back.
    fn plain_triangles() -> String {
        let faces = (0..40).map(|i| match i % 9 {
            3 => "f 3 1 4\n\n".into(),
            5 => "v 1 2 3\nf 1 2 -1\n".into(),
            7 => "# half\nf 4 2 1 \n".into(),
            _ => format!("f {} {} 4\n", 1 + i % 2, 3 - i % 2),
        });
        format!("o a\n{TRIANGLE}v 0 0 1\n{}", faces.collect::<String>())
    }

    #[test]
    fn triangles_of_which_nothing_is_said_are_those_that_are_spelt_out() {
        let text = plain_triangles();
        for run in [1 << 30, 1, 20, 77] {
            let mut plain = in_runs(&text, run);
            // One texture coordinate is enough, even if no corner names it.
            let spelt = in_runs(&format!("{text}vt 0 0\n"), run);
            assert_eq!((plain.geometry.triangles.len(), spelt.geometry.triangles.len()), (40, 0));
            assert!(plain.geometry.faces.is_empty() && plain.geometry.soup.corners.is_empty());
            plain.geometry.spell_out();
            assert_eq!(plain.geometry.faces, spelt.geometry.faces, "in runs of {run} bytes");
            assert_eq!(plain.geometry.soup.corners, spelt.geometry.soup.corners, "in runs of {run} bytes");
        }
    }

    #[test]
    fn a_line_that_cannot_be_read_after_all_leaves_no_corner() {
        // The corner that names more than a vertex comes before what is wrong with the line.
        let s = of(&format!("{TRIANGLE}vt 0 0\nf 1 2 3\nf 3 2 1/1 \\\n1\nf 2 3"));
        assert_eq!(corners(&s), [[1, 0, 0], [2, 0, 0], [3, 0, 0], [3, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 0]]);
        assert!(fault(&format!("{TRIANGLE}vt 0 0\nf 1 2 3\nf 1 2 3/1 x")).contains("corner 4 of the face is 'x'"));
    }

    #[test]
    fn what_says_more_of_triangles_has_them_spelt_out() {
        let plain = |more: &str| !in_runs(&format!("{TRIANGLE}f 1 2 3\n{more}"), 1 << 30).geometry.triangles.is_empty();
        assert!(plain("") && plain("f 3 2 1\n# end\n"));
        for more in [
            "f 1 2 3 1\n",
            "f 1 2\n",
            "f\n",
            "l 1 2\n",
            "s 1\nf 1 2 3\n",
            "g b\nf 1 2 3\n",
            "v 0 0 0 1 0 0\n",
            "vn 0 0 1\n",
        ] {
            assert!(!plain(more), "{more}");
        }
    }

    #[test]
    fn runs_of_lines_read_side_by_side_make_the_same_whole() {
        let text = all_kinds();
        let read = |run: usize| {
            let s = in_runs(&text, run);
            let mut warnings = Warnings::default();
            s.odd.warn(Path::new("m.obj"), &mut warnings);
            format!("{s:?} {:?}", warnings.into_vec())
        };
        let whole = read(1 << 30);
        assert!(whole.contains("obj-few-corners") && whole.contains("b.mtl"), "{whole}");
        for run in [1, 20, 50, 137, 1000] {
            let parts = read(run);
            let same = parts.bytes().zip(whole.bytes()).take_while(|(a, b)| a == b).count();
            assert!(parts == whole, "runs of {run} bytes: {} for {}", &parts[same..], &whole[same..]);
        }
    }
}
