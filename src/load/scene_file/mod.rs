//! Scene files (`.toml`): models, inline shapes, materials, lights and cameras, written by hand.
//!
//! As much as published ray tracing scenes and our own `models/` need, and no more. Unknown keys are errors that name
//! the nearest known one; every error says line and column, and all of them are reported at once.
//!
//! # Schema
//! Lengths are in the unit of the scene (metres when nothing else is said), angles in degrees. A *colour* is
//! `[r, g, b]` linear, one number (grey, linear), `"#rrggbb"` (sRGB) or a name (`"white"`, sRGB). A *vec* is `[x, y, z]`.
//!
//! ```toml
//! up = "y"                      # or "z"; default "y"
//! background = "white"          # colour, "transparent" or "environment"
//! environment = "studio"        # what rays that leave see: "studio", "black" or a colour. Default: "studio" when the
//!                               # file has no light at all, else "black"
//!
//! [render]                      # defaults that the command line overrides; every key optional
//! size = [800, 600]
//! samples = 4                   # rays a pixel
//! depth = 1                     # bounces after the eye ray
//! cutoff = 0.002                # weight where a branch ends
//! tone_map = "none"             # none, reinhard, aces, neutral
//! exposure = 0.0                # stops
//! default_light = false         # whether a scene without lights gets some; default true
//!
//! [materials.red]               # Phong is the default model
//! model = "phong"
//! diffuse = [0.8, 0.1, 0.1]     # colour, default 0.6
//! ambient = [0.8, 0.1, 0.1]     # colour, default: the diffuse one
//! specular = 0.5                # colour, default 0
//! shininess = 50                # exponent, default 1
//! mirror = 0.3                  # colour: weight of the reflected ray, default 0
//! transmission = 0.0            # colour: weight of the refracted ray, default 0
//! ior = 1.0                     # number, or a name: "air", "water", "crown glass", "diamond", ...; default 1
//! fresnel = false               # whether Fresnel balances mirror and transmission
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
//! # opacity, emission, double_sided as above
//!
//! [materials.sticker]
//! model = "unlit"
//! color = "white"               # opacity, double_sided as above
//!
//! [[models]]                    # glTF, OBJ or another scene file, relative to this file
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
//! [[planes]]                    # unbounded
//! normal = [0, 1, 0]
//! point = [0, -1, 0]            # any point on it; default the origin
//! material = "red"
//!
//! [[lights]]
//! kind = "point"                # point, directional, spot, ambient
//! color = "white"               # default white
//! intensity = 1.0               # factor, default 1
//! position = [0, 10, 0]         # point, spot
//! direction = [0, -1, 0]        # directional, spot: where the light goes
//! inner = 20                    # spot: half angle where it starts to fade, default 0
//! outer = 30                    # spot: half angle where it ends, default 45
//! falloff = "none"              # point, spot: "none" or "inverse-square"; default "none"
//! range = 20                    # inverse-square: where it ends; default nowhere
//! shadows = true                # default true
//!
//! [[cameras]]                   # the first is used unless the command line names another
//! name = "front"
//! eye = [0, 0, 25]
//! at = [0, 0, 0]
//! up = [0, 1, 0]                # default: the up axis of the scene
//! fov = 50                      # vertical; default 45
//! # or ortho = 10               # height seen by parallel rays
//! ```

use super::{Diagnostic, LoadError, LoadOptions, Loaded, Source};

/// Loads a scene file.
pub fn load(source: &Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let _ = options;
    Err(Diagnostic::new("unsupported-format", &source.path, "", "no loader yet").into())
}
