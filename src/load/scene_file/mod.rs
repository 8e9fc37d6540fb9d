//! Scene files (`.toml`): models, inline shapes, materials, lights and cameras, written by hand.
//!
//! Supports what published ray tracing scenes and our own `models/` need, and no more. Unknown keys are errors that name
//! the nearest known one; every error has line and column, and all of them are reported at once.
//!
//! # Schema
//! Lengths are in the unit of the scene (metres when nothing else is said), angles in degrees. A *colour* is
//! `[r, g, b]` linear, one number (grey, linear), `"#rrggbb"` (sRGB) or a name (`"white"`, sRGB). A *vec* is `[x, y, z]`.
//!
//! ```toml
//! up = "y"                      # or "z"; default "y"
//! background = "white"          # colour, "transparent" or "environment"; default: the environment, dark grey if black
//! environment = "studio"        # what rays that leave see: "studio", "black", a colour, or a file such as "sky.hdr",
//!                               # an equirectangular picture; default "black": no light, but mirrors and glass see the
//!                               # background in it, where that is a colour
//! # environment_rotation = 90   # turns that picture about the up axis, degrees
//!
//! [render]                      # defaults that the command line overrides; every key optional
//! size = [800, 600]
//! samples = 4                   # rays a pixel
//! depth = 1                     # bounces after the eye ray
//! cutoff = 0.002                # weight where a branch ends
//! tone_map = "none"             # none, reinhard, aces, neutral
//! exposure = 0.0                # stops
//! default_light = false         # whether a scene without any light gets lamps and the studio; default true
//!
//! [materials.red]               # Phong is the default model
//! model = "phong"
//! diffuse = [0.8, 0.1, 0.1]     # colour, default 0.6
//! ambient = [0.8, 0.1, 0.1]     # colour, default: the diffuse one
//! specular = 0.5                # colour, default 0
//! shininess = 50                # exponent, default 1
//! mirror = 0.3                  # colour: weight of the reflected ray, default 0
//! transmission = 0.0            # colour: weight of the refracted ray, default 0; without fresnel
//!                                 # no more than mirror leaves
//! ior = 1.0                     # number, or a name: "air", "water", "crown glass", "diamond", ...; default 1
//! fresnel = false               # whether Fresnel balances mirror and transmission
//! dispersion = 0.0              # 20 / Abbe number, default 0
//! opacity = 1.0                 # below 1: composited over what lies behind
//! emission = 0                  # colour
//! double_sided = true           # default true
//!
//! [materials.gold]
//! model = "pbr"                 # glTF's metallic-roughness model
//! base_color = "#ffd700"        # default white
//! metallic = 1.0                # default 0
//! roughness = 0.2               # default 0.5
//! transmission = 0.0            # default 0
//! ior = 1.5                     # as above
//! thick = true                  # whether rays bend; default true
//! attenuation_color = "white"   # what is left of white light after attenuation_distance inside, default white
//! attenuation_distance = 1.0    # default: it absorbs nothing
//! # dispersion, opacity, emission, double_sided as above
//!
//! [materials.sticker]
//! model = "unlit"
//! color = "white"               # opacity, double_sided as above
//!
//! [[models]]                    # glTF, OBJ, PLY, STL or NFF, relative to this file
//! file = "bunny.obj"
//! material = "red"              # optional: replaces every material of the model
//! up = "z"                      # optional: overrides the model's up axis
//! scale = 2                     # number or vec; applied first
//! rotate = [0, 90, 0]           # about x, then y, then z; or { axis = vec, angle = 30 }; applied second
//! translate = [0, 1, 0]         # applied last
//! # or instead of these three: matrix = [[...4], [...4], [...4], [...4]], rows, column vectors
//!
//! [[meshes]]
//! name = "wall"                 # optional, as everywhere
//! material = "red"              # optional: a plain light grey
//! positions = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
//! faces = [[0, 1, 2, 3]]        # corners of each face, 3 or more, counter-clockwise from the front
//! # scale, rotate, translate, matrix as for models
//!
//! [[spheres]]
//! center = [0, 0, 0]
//! radius = 1
//! material = "gold"
//!
//! [[cones]]                     # the mantle alone, open at both ends
//! base = [0, 0, 0]              # centre of one end
//! base_radius = 1               # 0 or more
//! apex = [0, 2, 0]              # centre of the other end
//! apex_radius = 0.5             # default 0: a tip
//! material = "gold"
//!
//! [[cylinders]]                 # open at both ends as well
//! base = [0, 0, 0]
//! top = [0, 2, 0]               # centre of the other end
//! radius = 1
//! material = "gold"
//!
//! [[planes]]                    # unbounded
//! normal = [0, 1, 0]
//! point = [0, -1, 0]            # any point on it; default the origin
//! material = "red"
//!
//! [[lights]]
//! kind = "point"                # point, directional, spot, ambient
//! color = "white"               # default white
//! intensity = 1.0               # factor, default 1: a white matt surface that faces the light shows it (less where the
//!                               # light is so wide that much of it comes from the side); candela when the light fades
//! position = [0, 10, 0]
//! falloff = "inverse-square"    # or "none", the default
//! range = 20                    # inverse-square: where it ends; default nowhere
//! radius = 0.1                  # of the ball that shines: shadows get soft edges; default 0
//! shadows = true                # default true
//!
//! [[lights]]
//! kind = "spot"                 # as a point light, and:
//! position = [0, 10, 0]
//! direction = [0, -1, 0]        # where the light goes; so for directional lights, which have no position
//! inner = 20                    # half angle where it starts to fade, default 0
//! outer = 30                    # half angle where it ends, default 45
//!
//! [[lights]]
//! kind = "directional"
//! direction = [0, -1, 0]
//! angle = 0.53                  # how wide it looks in the sky, degrees; default 0
//!
//! [[lights]]
//! kind = "rectangle"            # shines to where side_u × side_v points, fades like a point light
//! position = [0, 3, 0]          # of its middle
//! side_u = [1, 0, 0]
//! side_v = [0, 0, 1]
//!
//! [[lights]]
//! kind = "ambient"              # has color and intensity only
//! color = 0.2
//!
//! [[cameras]]                   # the first is used unless the command line names another
//! name = "front"
//! eye = [0, 0, 25]
//! at = [0, 0, 0]
//! up = [0, 1, 0]                # default: the up axis of the scene
//! fov = 50                      # vertical; default 45
//! # or ortho = 10               # height seen by parallel rays
//! ```

mod assemble;
mod materials;
mod reader;
mod shapes;
mod view;
mod weight;

use self::assemble::assemble;
use self::reader::{Faults, Table, color, number, string, word};
use self::shapes::UndrawnShapes;
use self::weight::weight;
use super::limits::Budget;
use super::{Diagnostic, LoadError, LoadOptions, Loaded, Source};
use crate::math::DVec3;
use crate::scene::{Background, Environment, Material, Scene, UpAxis};
use std::collections::HashMap;
use std::path::Path;
use toml::de::{DeTable, DeValue};

const UP: [(&str, UpAxis); 2] = [("y", UpAxis::Y), ("z", UpAxis::Z)];

/// Loads a scene file and the models it names; its memory is taken from `budget`.
///
/// # Errors
/// Every fault of the file with its line and column, or those of a model; or when memory would exceed the budget.
pub fn load(source: &Source, options: &LoadOptions, budget: &mut Budget) -> Result<Loaded, LoadError> {
    let text = match std::str::from_utf8(&source.bytes) {
        Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text).to_owned(),
        Err(e) => {
            let text = format!("byte {} is not UTF-8 text", e.valid_up_to());
            return Err(Diagnostic::new("scene-syntax", &source.path, "", text).remedy("save it as UTF-8").into());
        }
    };
    budget.take(weight(&text), 1).map_err(|over| Diagnostic::over_budget(&source.path, over))?;
    let faults = Faults::new(source.path.clone(), text);
    let parsed = read(&faults, options)?;
    assemble(parsed, &faults, source, options, budget)
}

/// Reads the text.
fn read(faults: &Faults, options: &LoadOptions) -> Result<Parsed, LoadError> {
    /// Largest text that is parsed to its end for all faults of syntax, in bytes; each fault takes memory.
    const SMALL: usize = 1 << 20;
    let root = match DeTable::parse(faults.text()) {
        Ok(root) => root,
        Err(first) => {
            let is_small = faults.text().len() <= SMALL;
            let mut all = if is_small { DeTable::parse_recoverable(faults.text()).1 } else { Vec::new() };
            if all.is_empty() {
                all.push(first);
            }
            for error in all {
                faults.note("scene-syntax", &error.span().unwrap_or(0..0), error.message().replace('\n', ", "), "");
            }
            return Err(faults.all());
        }
    };
    let parsed = parse(faults, root.get_ref(), options);
    faults.check()?;
    Ok(parsed)
}

/// Contents of the text, before any model is read.
struct Parsed {
    scene: Scene,
    models: Vec<Model>,
    panorama: Option<Surrounding>,
    lost: UndrawnShapes,
    /// Largest displacement of a vertex by rounding to `f32`, world units.
    max_rounding: f64,
}

/// A picture around the scene.
struct Surrounding {
    file: String,
    /// Byte offset of its name.
    at: usize,
    rotation: f32,
}

/// One `[[models]]` entry.
struct Model {
    file: String,
    /// Byte offset of its name.
    at: usize,
    up: Option<UpAxis>,
    material: Option<u32>,
    world_from_model: crate::math::DAffine3,
}

fn parse<'a>(faults: &'a Faults, root: &'a DeTable<'a>, options: &LoadOptions) -> Parsed {
    let root = Table::new(faults, "the scene", 0..0, root);
    let mut scene = Scene { up: root.get("up", word(&UP)).unwrap_or_default(), ..Scene::default() };
    scene.up = options.up.unwrap_or(scene.up);
    scene.background = root.get("background", background);
    let panorama = surrounding(&root);
    match panorama {
        Some(_) => scene.environment = Environment::Panorama,
        None => scene.environment = root.get("environment", environment).unwrap_or_default(),
    }
    scene.hints = root.table("render", "[render]").map(view::hints).unwrap_or_default();

    if let Some(materials) = root.table("materials", "[materials]") {
        let read = |(name, table): (String, Table)| materials::material(&name, table);
        scene.materials = materials.named("material").into_iter().map(read).collect();
    }
    let named = |(material, id): (&Material, u32)| (material.name.clone(), id);
    let mut names = Names { of: scene.materials.iter().zip(0..).map(named).collect(), plain: None };
    let mut models = Vec::new();
    for table in root.tables("models", "model") {
        models.extend(model(&mut scene, &mut names, table));
    }
    let mut lost = UndrawnShapes::default();
    let max_rounding = add_shapes(&root, &mut scene, &mut names, &mut lost);
    for table in root.tables("lights", "light") {
        match view::light(table) {
            Some(view::Lit::Light(light)) => scene.lights.push(light),
            Some(view::Lit::Ambient(radiance)) => scene.ambient += radiance,
            None => {}
        }
    }
    let up = if scene.up == UpAxis::Z { DVec3::Z } else { DVec3::Y };
    for table in root.tables("cameras", "camera") {
        scene.cameras.extend(view::camera(table, up));
    }
    scene.hints.camera = (!scene.cameras.is_empty()).then_some(0);
    root.finish();
    Parsed { scene, models, panorama, lost, max_rounding }
}

/// Adds the file's own shapes; returns the largest displacement of a vertex by rounding.
fn add_shapes(root: &Table, scene: &mut Scene, names: &mut Names, lost: &mut UndrawnShapes) -> f64 {
    let mut inline = Vec::new();
    for table in root.tables("meshes", "mesh") {
        let material = names.material(scene, &table);
        inline.extend(shapes::mesh(table, material, lost));
    }
    let max_rounding = shapes::place(inline, scene, lost);
    for table in root.tables("spheres", "sphere") {
        let material = names.material(scene, &table);
        scene.spheres.extend(shapes::sphere(table, material, lost));
    }
    for table in root.tables("cones", "cone") {
        let material = names.material(scene, &table);
        scene.cones.extend(shapes::cone(table, material, lost));
    }
    for table in root.tables("cylinders", "cylinder") {
        let material = names.material(scene, &table);
        scene.cones.extend(shapes::cylinder(table, material, lost));
    }
    for table in root.tables("planes", "plane") {
        let material = names.material(scene, &table);
        scene.planes.extend(shapes::plane(table, material, lost));
    }
    max_rounding
}

fn model(scene: &mut Scene, names: &mut Names, table: Table) -> Option<Model> {
    let file = table.need("file", string);
    let at = table.place_of("file").start;
    let material = table.has("material").then(|| names.material(scene, &table));
    let up = table.get("up", word(&UP));
    let world_from_model = shapes::transform(&table);
    table.finish();
    Some(Model { file: file?, at, up, material, world_from_model })
}

/// Indices of materials by name, and of the plain one once a shape uses it.
struct Names {
    of: HashMap<String, u32>,
    plain: Option<u32>,
}

impl Names {
    /// Index of the material that a shape names, or of the plain one.
    fn material(&mut self, scene: &mut Scene, table: &Table) -> u32 {
        let is_listed = table.faults.lists(table.place_of("material").start);
        let named = table.get("material", |value| {
            let name = string(value)?;
            self.of.get(&name).copied().ok_or_else(|| {
                if !is_listed {
                    return String::new();
                }
                let known = || scene.materials.iter().map(|m| m.name.as_str());
                if known().next().is_none() {
                    return format!("is `{name}`, but no materials are there; write [materials.{name}]");
                }
                let near = super::suggest::nearest(&name, known());
                let hint = near.map_or_else(|| super::suggest::list(known()), |near| format!("did you mean `{near}`?"));
                format!("is `{name}`, but no [materials.{name}] is there; {hint}")
            })
        });
        let plain = || {
            *self.plain.get_or_insert_with(|| {
                scene.materials.push(Material::plain());
                count(scene.materials.len() - 1)
            })
        };
        named.unwrap_or_else(plain)
    }
}

fn background(value: &DeValue) -> Result<Background, String> {
    match value.as_str() {
        Some("transparent") => Ok(Background::Transparent),
        Some("environment" | "env") => Ok(Background::Environment),
        _ => color(value).map(Background::Color).map_err(|why| why + "; or `transparent` or `environment`"),
    }
}

/// Reads the picture of `environment`, if it names a file.
fn surrounding(root: &Table) -> Option<Surrounding> {
    let named = |value: &DeValue| Ok(value.as_str().filter(|name| is_picture(name)).map(str::to_owned));
    let file = root.get("environment", named).flatten();
    let degrees = root.get("environment_rotation", number);
    let Some(file) = file else {
        if degrees.is_some() {
            let text = "`environment_rotation` turns a picture, and `environment` names none";
            root.note(&root.place_of("environment_rotation"), text, "leave it out, or name a picture");
        }
        return None;
    };
    #[expect(clippy::cast_possible_truncation, reason = "an angle")]
    let rotation = (degrees.unwrap_or(0.0) % 360.0).to_radians() as f32;
    Some(Surrounding { file, at: root.place_of("environment").start, rotation })
}

fn is_picture(name: &str) -> bool {
    let ending = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    ["hdr", "exr", "png", "jpg", "jpeg", "webp", "tga", "bmp"].contains(&ending.as_str())
}

fn environment(value: &DeValue) -> Result<Environment, String> {
    match value.as_str() {
        Some("studio") => Ok(Environment::Studio),
        Some("black") => Ok(Environment::Black),
        _ => {
            let others = "; or `studio`, `black`, or a picture (.hdr, .exr, .png, .jpg)";
            color(value).map(Environment::Constant).map_err(|why| why + others)
        }
    }
}

/// [`super::Facts::format`] of scene files.
pub const FORMAT: &str = "meshray scene";

#[expect(clippy::cast_possible_truncation, reason = "a scene file is far smaller than 2^32 lines")]
fn count(n: usize) -> u32 {
    n as u32
}

#[cfg(test)]
mod tests;
