//! MTL files -> the materials, textures and bitmaps that a model uses.
//!
//! Own code, because `tobj` stops at `Kd 0.5`, reads two file names as one, and leaves map options to its caller.

mod meaning;
mod options;
mod parse;
mod pictures;
mod textures;
mod writer;

use crate::load::finder::Finder;
use crate::load::limits::{Budget, Limits};
use crate::load::paths::{Found, Resolver, shorten, taken_from};
use crate::load::text::lines::without_comment;
use crate::load::{Diagnostic, LoadOptions, MtlMode, Warnings, detect};
use crate::math::Vec3;
use crate::scene::{Bitmap, Material, Texture};
use crate::stopwatch::Spent;
use meaning::Meaning;
use parse::{Mtl, Slot};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use textures::{Library, Mapper, Textures};
use writer::Writer;

/// Materials of a model, with their textures and bitmaps.
#[derive(Debug, Default)]
pub(super) struct Materials {
    pub materials: Vec<Material>,
    pub textures: Vec<Texture>,
    pub bitmaps: Vec<Bitmap>,
    /// Index into `materials` for each requested name.
    pub of_name: Vec<u32>,
    /// Time spent decoding pictures.
    pub decoding: Spent,
}

/// Context of reading a model's material files.
pub(super) struct Reading<'a> {
    /// Path of the model.
    pub file: &'a Path,
    pub options: &'a LoadOptions,
    /// Whether the model has vertex colours: a surface without a material shows them unchanged.
    pub colored: bool,
    pub resolver: &'a mut Resolver,
    pub budget: &'a mut Budget,
    pub warnings: &'a mut Warnings,
}

/// Reads the material files that a model names, each with its line, and makes a material for each name; `None` stands for
/// surfaces without one.
pub(super) type Make = fn(&[(u32, String)], &[Option<&str>], &mut Reading) -> Materials;

/// A material library as read.
struct Read {
    /// Path of the library, for messages.
    file: PathBuf,
    /// Folder of the library, relative to the model's.
    folder: PathBuf,
    writer: Writer,
    materials: Vec<Mtl>,
}

/// Reads the files that `mtllib` statements name (`libraries`, with their lines) and makes the materials called `names`; `None`
/// is a run of faces before any `usemtl`.
pub(super) fn load(libraries: &[(u32, String)], names: &[Option<&str>], reading: &mut Reading) -> Materials {
    let mut read = read_libraries(libraries, reading);
    if read.is_empty() && names.iter().any(Option::is_some) {
        read.extend(library_beside(reading));
    }
    let found: Vec<Option<(usize, usize)>> = {
        let known = index(&read);
        names.iter().map(|name| name.and_then(|name| lookup(&known, name))).collect()
    };
    warn_of_undefined(names, &found, reading);
    let used: Vec<(usize, usize)> = first_of_each(found.iter().flatten().copied());
    warn_of_redefined(&read, &used, reading.warnings);

    // Read the pictures of the used materials, library by library.
    let (mut textures, mut missed) = (Textures::default(), 0);
    for (number, library) in read.iter().enumerate() {
        let materials = used.iter().filter(|u| u.0 == number).map(|u| &library.materials[u.1]);
        let of = Library { number, file: &library.file, folder: &library.folder };
        let mut finder = Finder { resolver: reading.resolver, missed: &mut missed };
        let limits: (&Limits, &mut Budget) = (&reading.options.limits, reading.budget);
        textures.read(&of, materials, reading.options.mtl, &mut finder, limits, reading.warnings);
    }

    // Make the materials themselves.
    let invisible = |&(l, m): &(usize, usize)| {
        let (mtl, is_opacity) = (&read[l].materials[m], read[l].writer == Writer::Vtk);
        mtl.d.or(mtl.tr.filter(|_| is_opacity)) == Some(0.0)
    };
    let all_invisible = !used.is_empty() && used.iter().all(invisible) && found.iter().all(Option::is_some);
    let mut out = Materials::default();
    let mut made: HashMap<(usize, usize), u32> = HashMap::new();
    let mut plain: HashMap<&str, u32> = HashMap::new();
    for (name, found) in names.iter().zip(found) {
        let next = u32::try_from(out.materials.len()).unwrap_or(u32::MAX);
        let index = match found {
            Some(at) => *made.entry(at).or_insert_with(|| {
                out.materials.push(make(&read, at, all_invisible, &mut textures, reading));
                next
            }),
            None => *plain.entry(name.unwrap_or_default()).or_insert_with(|| {
                out.materials.push(plain_material(name.unwrap_or_default(), reading.colored));
                next
            }),
        };
        out.of_name.push(index);
    }
    out.decoding = textures.decoding;
    (out.textures, out.bitmaps) = textures.finish();
    out
}

fn read_libraries(libraries: &[(u32, String)], reading: &mut Reading) -> Vec<Read> {
    let mut out = Vec::new();
    let (mut seen, mut missed) = (HashSet::new(), 0);
    for (line, names) in libraries {
        let mut finder = Finder { resolver: reading.resolver, missed: &mut missed };
        let mut found = finder.libraries(names);
        let cut = String::from_utf8_lossy(without_comment(names.as_bytes())).into_owned();
        if cut != *names && !found.iter().all(Result::is_ok) {
            found = finder.libraries(&cut);
        }
        for file in found {
            match file {
                Ok(file) if seen.insert(file.path.clone()) => out.push(read_library(file, *line, names, reading)),
                Ok(_) => {}
                Err(fault) => {
                    let warning = fault.diagnose(reading.file, &line.to_string());
                    let text = format!("material library {}", warning.text);
                    reading.warnings.push(Diagnostic { text, ..warning });
                }
            }
        }
    }
    out
}

fn read_library(found: Found, line: u32, names: &str, reading: &mut Reading) -> Read {
    if found.guessed {
        let text = format!("material library {}", taken_from(names, &found.path));
        reading.warnings.push(Diagnostic::new("mtl-file-elsewhere", reading.file, line.to_string(), text));
    }
    let file = folder_of(reading.file).join(&found.path);
    if let Some(other) = detect::other_than_text(&found.bytes) {
        let text = format!("material library '{}' is {other}", found.path.display());
        reading.warnings.push(Diagnostic::new("mtl-no-library", reading.file, line.to_string(), text));
    }
    let mut materials = parse::parse(&found.bytes, &file, reading.budget, reading.warnings);
    let writer = Writer::of(&found.bytes);
    if reading.options.mtl != MtlMode::Literal {
        if writer != Writer::Blender && writer::are_codes(&materials) {
            for mtl in &mut materials {
                mtl.kd = mtl.kd.map(writer::light);
                mtl.ke = mtl.ke.map(|ke| if writer::is_code(ke) { writer::light(ke) } else { ke });
            }
            let text = "Kd is made of numbers of eight bits, and read as screens show it (sRGB), as is such a Ke";
            let warning = Diagnostic::new("mtl-coded-colors", &file, "", text);
            reading.warnings.push(warning.remedy("--mtl literal takes them for linear light"));
        }
        for line in materials.iter_mut().filter_map(Mtl::take_ambient_map) {
            let text = "map_Ka is drawn as map_Kd, which there is none of";
            reading.warnings.push(Diagnostic::new("mtl-ambient-map", &file, line.to_string(), text));
        }
    }
    let folder = found.path.parent().map(Path::to_path_buf).unwrap_or_default();
    Read { file, folder, writer, materials }
}

/// Reads the library with the model's own name, for a model that uses materials but whose named libraries are all missing.
fn library_beside(reading: &mut Reading) -> Option<Read> {
    if reading.options.mtl == MtlMode::Literal {
        return None;
    }
    let name = Path::new(reading.file.file_name()?).with_extension("mtl");
    let bytes = reading.resolver.read_file(&name).ok()?;
    let text = format!("no material library was found by name; '{}' lies beside and is used", name.display());
    reading.warnings.push(Diagnostic::new("mtl-beside-model", reading.file, "", text));
    Some(read_library(Found { path: name, bytes, guessed: false }, 0, "", reading))
}

fn folder_of(file: &Path) -> PathBuf {
    file.parent().map(Path::to_path_buf).unwrap_or_default()
}

/// Indexes materials by name, both as written and without a trailing comment; the first of a name wins, as the OBJ specification
/// says of several libraries.
fn index(read: &[Read]) -> HashMap<&[u8], (usize, usize)> {
    let mut known: HashMap<&[u8], (usize, usize)> = HashMap::new();
    let all = || read.iter().enumerate().flat_map(|(l, read)| read.materials.iter().enumerate().map(move |m| (l, m)));
    for (l, (m, mtl)) in all() {
        known.entry(mtl.name.as_bytes()).or_insert((l, m));
    }
    for (l, (m, mtl)) in all() {
        known.entry(without_comment(mtl.name.as_bytes())).or_insert((l, m));
    }
    known
}

fn lookup(known: &HashMap<&[u8], (usize, usize)>, name: &str) -> Option<(usize, usize)> {
    known.get(name.as_bytes()).or_else(|| known.get(without_comment(name.as_bytes()))).copied()
}

fn first_of_each<T: Copy + Eq + std::hash::Hash>(items: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = HashSet::new();
    items.filter(|&item| seen.insert(item)).collect()
}

/// Warns once of all names that no library defines. A `usemtl` without a name asks for no material.
fn warn_of_undefined(names: &[Option<&str>], found: &[Option<(usize, usize)>], reading: &mut Reading) {
    /// Most names that are listed.
    const LISTED: usize = 4;
    let lost = names.iter().zip(found).filter(|(_, found)| found.is_none()).filter_map(|(name, _)| *name);
    let lost = first_of_each(lost.filter(|name| !name.is_empty()));
    if lost.is_empty() {
        return;
    }
    let mut list = lost.iter().take(LISTED).map(|n| format!("'{}'", shorten(n))).collect::<Vec<_>>().join(", ");
    if lost.len() > LISTED {
        list += ", …";
    }
    let are = if lost.len() == 1 { "material is" } else { "materials are" };
    let text = format!("{} {are} not defined and drawn plain: {list}", lost.len());
    reading.warnings.push(Diagnostic::new("mtl-undefined-material", reading.file, "", text));
}

/// Warns once for each used material whose name is defined again with other contents. With maps, libraries in different folders
/// always differ, since pictures are named relative to their library.
fn warn_of_redefined(read: &[Read], used: &[(usize, usize)], warnings: &mut Warnings) {
    let mut first: HashMap<&str, (&Read, &Mtl)> =
        used.iter().map(|&(l, m)| (&*read[l].materials[m].name, (&read[l], &read[l].materials[m]))).collect();
    for library in read {
        for other in &library.materials {
            if let Some((of, kept)) = first.get(&*other.name)
                && !std::ptr::eq(*kept, other)
                && (library.folder != of.folder && !other.maps.is_empty() || !other.is_like(kept))
            {
                let place = format!("line {} of {}", kept.line, of.file.display());
                let text = format!("material '{}' is defined again; {place} counts", shorten(&other.name));
                let warning = Diagnostic::new("mtl-defined-twice", &library.file, other.line.to_string(), text);
                warnings.push(warning.remedy("give one of them another name"));
                // One warning per name: a file may have very many duplicates.
                first.remove(&*other.name);
            }
        }
    }
}

/// Material of surfaces that name no known one; white where the model has vertex colours.
pub(super) fn plain_material(name: &str, colored: bool) -> Material {
    let mut plain = Material::plain();
    if colored {
        plain.base_color = Vec3::ONE;
    }
    if name.is_empty() { plain } else { Material { name: name.into(), ..plain } }
}

fn make(
    read: &[Read],
    (l, m): (usize, usize),
    all_invisible: bool,
    textures: &mut Textures,
    reading: &mut Reading,
) -> Material {
    let library = Library { number: l, file: &read[l].file, folder: &read[l].folder };
    let (mtl, mode) = (&read[l].materials[m], reading.options.mtl);
    let has_map = |slot: Slot| textures.picture(l, mtl, slot).is_some();
    let mut meaning = Meaning {
        mtl,
        mode,
        writer: read[l].writer,
        file: library.file,
        warnings: reading.warnings,
        has_map: &has_map,
        all_invisible,
    };
    let mut material = meaning.material();
    let (limits, budget) = (&reading.options.limits, &mut *reading.budget);
    Mapper { textures, library: &library, mtl, mode, limits, budget, warnings: reading.warnings }.apply(&mut material);
    material
}

/// Names of the materials in a text.
#[cfg(test)]
pub(super) fn parse_names(text: &[u8]) -> Vec<String> {
    let mut budget = Budget::new(&Limits::default());
    let materials = parse::parse(text, Path::new("m.mtl"), &mut budget, &mut Warnings::default());
    materials.into_iter().map(|m| m.name).collect()
}

#[cfg(test)]
mod tests;
