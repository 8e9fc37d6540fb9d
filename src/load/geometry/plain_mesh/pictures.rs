//! Pictures of files of bare geometry -> the materials that show them.

use crate::load::finder::{Finder, FoundPath};
use crate::load::mtl::{Materials, Reading, plain_material};
use crate::load::paths::{FileFault, taken_from};
use crate::load::texture::{Encoded, Unusable, decode_all};
use crate::load::{Diagnostic, Loaded};
use crate::math::{Vec3, Vec4};
use crate::scene::{Material, Sampler, Texture, TextureRef, UvTransform};
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Reads the `pictures` of a file, which it names on these lines, and makes a material for each of `names`: one that shows the
/// picture of that name, or a plain one for `None` and where the picture cannot be read.
pub(super) fn load(pictures: &[(u32, String)], names: &[Option<&str>], reading: &mut Reading) -> Materials {
    let mut images: Vec<Encoded> = Vec::new();
    // Index of the image by name, and by file: a file may have many names.
    let (mut known, mut files): (HashMap<&str, usize>, HashMap<PathBuf, usize>) = Default::default();
    let (wanted, mut missed): (HashSet<&str>, _) = (names.iter().flatten().copied().collect(), 0);
    for (line, name) in pictures.iter().filter(|(_, name)| wanted.contains(name.as_str())) {
        let place = line.to_string();
        let mut found = |place: &str| -> Result<usize, Diagnostic> {
            let found = find(name, place, &mut missed, reading)?;
            if let Some(&at) = files.get(&found.canonical) {
                return Ok(at);
            }
            let bytes = read(&found.path, name, place, reading)?.into();
            files.insert(found.canonical, images.len());
            let name = found.path.to_string_lossy().into_owned();
            images.push(Encoded { name, place: place.into(), bytes });
            Ok(images.len() - 1)
        };
        if !known.contains_key(name.as_str()) {
            match found(&place) {
                Ok(at) => _ = known.insert(name, at),
                Err(warning) => reading.warnings.push(warning),
            }
        }
    }
    let limits = &reading.options.limits;
    let (decoded, decoding) = decode_all(&images, reading.file, limits, reading.budget, reading.warnings);
    drop(images);

    let mut out = Materials { decoding, ..Materials::default() };
    let mut shown: Vec<Option<u32>> = Vec::new();
    for bitmap in decoded {
        shown.push(bitmap.map(|bitmap| {
            let number = index(out.bitmaps.len());
            out.bitmaps.push(bitmap);
            out.textures.push(Texture { bitmap: number, sampler: Sampler::default() });
            number
        }));
    }
    let mut made: HashMap<Option<u32>, u32> = HashMap::new();
    for name in names {
        let texture = name.and_then(|name| shown[*known.get(name)?]);
        let material = *made.entry(texture).or_insert_with(|| {
            out.materials.push(match (texture, name) {
                (Some(texture), Some(name)) => showing(name, texture),
                _ => plain_material("", reading.colored),
            });
            index(out.materials.len() - 1)
        });
        out.of_name.push(material);
    }
    out
}

#[expect(clippy::cast_possible_truncation, reason = "headers name fewer than 2^32 pictures")]
fn index(at: usize) -> u32 {
    at as u32
}

fn showing(name: &str, texture: u32) -> Material {
    let map = TextureRef { texture, uv_set: 0, transform: UvTransform::default() };
    Material { name: name.into(), base_color: Vec3::ONE, base_color_map: Some(map), ..Material::plain() }
}

/// Finds a picture.
///
/// # Errors
/// The warning that the picture does not exist.
fn find(name: &str, place: &str, missed: &mut usize, reading: &mut Reading) -> Result<FoundPath, Diagnostic> {
    let mut finder = Finder { resolver: reading.resolver, missed };
    let found = finder.find(name, &[Path::new("")]).map_err(|fault| lost(&fault, place, reading.file))?;
    if found.guessed {
        let text = taken_from(name, &found.path);
        reading.warnings.push(Diagnostic::new("file-elsewhere", reading.file, place, text));
    }
    Ok(found)
}

/// Reads a picture.
///
/// # Errors
/// The warning that the picture cannot be read.
fn read(path: &Path, name: &str, place: &str, reading: &mut Reading) -> Result<Vec<u8>, Diagnostic> {
    let within = reading.resolver.read_file_within(path, reading.budget);
    let bytes = within.map_err(|fault| lost(&fault, place, reading.file))?;
    bytes.map_err(|over| Unusable::too_large(over.to_string()).warning(name, reading.file, place))
}

fn lost(fault: &FileFault, place: &str, file: &Path) -> Diagnostic {
    let warning = fault.diagnose(file, place);
    Diagnostic { text: format!("picture {}; faces are drawn without it", warning.text), ..warning }
}

/// Removes vertex colours from meshes that show a picture: in scans both hold the same light. Returns a warning about
/// that.
pub(super) fn leave_out_colors(loaded: &mut Loaded, file: &Path) -> Option<Diagnostic> {
    let scene = &mut loaded.scene;
    let shows = |material: u32| scene.materials.get(material as usize).is_some_and(|m| m.base_color_map.is_some());
    let mut had_colors = false;
    for mesh in scene.meshes.iter_mut().filter(|mesh| shows(mesh.material)) {
        had_colors |= mesh.colors.iter().any(|color| color.truncate() != Vec3::ONE);
        mesh.colors.iter_mut().for_each(|color| *color = Vec3::ONE.extend(color.w));
        if mesh.colors.iter().all(|&color| color == Vec4::ONE) {
            mesh.colors.clear();
        }
    }
    let text = "there are colours, which are not drawn where faces show a picture";
    had_colors.then(|| Diagnostic::new("colors-under-picture", file, "", text))
}
