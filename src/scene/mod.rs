//! The scene to be drawn, as plain data: flat arrays and `u32` indices, no behaviour beyond lookup.
//!
//! A [`Scene`] keeps each object in its own space; positions are `f32` there, while everything that places objects in
//! the world is `f64`. Units are metres, angles radians, colours linear Rec. 709, unless a field says otherwise.

pub mod camera;
mod check;
pub mod color;
pub(crate) mod corners;
pub mod default_light;
pub mod features;
pub mod framing;
pub mod hints;
pub mod ior;
pub mod light;
pub mod lobes;
pub mod material;
pub mod merge;
pub mod mesh;
pub mod panorama;
pub mod texture;

pub use camera::{Camera, Projection};
pub use check::SceneFault;
pub use hints::{MAX_DEPTH, MAX_STOPS, RenderHints};
pub use light::{Falloff, Light, LightKind};
pub use lobes::{Anisotropy, Coat, DiffuseTransmission, Iridescence, Sheen};
pub use material::{AlphaMode, Material, MetalRough, Phong, Reflection, TexCoords, TextureRef, UvTransform};
pub use mesh::{Cone, Instance, Mesh, Plane, Polygon, Sphere};
pub use panorama::Panorama;
pub use texture::{Bitmap, Filter, Mipmaps, Pixels, Sampler, Texture, Wrap};

use crate::math::Vec3;
use std::mem::size_of;

/// A whole scene. Indices in its parts point into the arrays here ([`Self::check`]).
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Meshes, each in its own object space; drawn only where an [`Instance`] places them.
    pub meshes: Vec<Mesh>,
    /// Placements of the meshes in the world.
    pub instances: Vec<Instance>,
    /// Spheres, in world space.
    pub spheres: Vec<Sphere>,
    /// Cones and cylinders, in world space.
    pub cones: Vec<Cone>,
    /// Unbounded planes, in world space.
    pub planes: Vec<Plane>,
    /// Materials; every mesh, sphere, cone and plane uses one.
    pub materials: Vec<Material>,
    /// Textures: bitmaps with samplers.
    pub textures: Vec<Texture>,
    /// Decoded pictures.
    pub bitmaps: Vec<Bitmap>,
    /// Lights, in world space.
    pub lights: Vec<Light>,
    /// Whether lights are given in photometric units, lux and candela, so that a picture needs an exposure.
    pub photometric: bool,
    /// Cameras in the file, in world space.
    pub cameras: Vec<Camera>,
    /// Ambient light: radiance from everywhere, multiplied by a material's ambient colour.
    pub ambient: Vec3,
    /// Radiance of rays that leave the scene.
    pub environment: Environment,
    /// Picture of [`Environment::Panorama`].
    pub panorama: Option<Panorama>,
    /// Background of primary rays that hit nothing; `None` if the file gives none.
    pub background: Option<Background>,
    /// Axis of the file that points up.
    pub up: UpAxis,
    /// Whether the model faces backwards: along −Z where +Y points up, as avatars in VRM 0.x do.
    pub faces_back: bool,
    /// Render settings in the scene file.
    pub hints: RenderHints,
}

impl Scene {
    /// Size of the scene in memory, bytes: lists, names, mesh arrays and pictures.
    pub fn bytes(&self) -> u64 {
        let lists = self.meshes.len() * size_of::<Mesh>()
            + self.instances.len() * size_of::<Instance>()
            + self.spheres.len() * size_of::<Sphere>()
            + self.cones.len() * size_of::<Cone>()
            + self.planes.len() * size_of::<Plane>()
            + self.materials.len() * size_of::<Material>()
            + self.textures.len() * size_of::<Texture>()
            + self.bitmaps.len() * size_of::<Bitmap>()
            + self.lights.len() * size_of::<Light>()
            + self.cameras.len() * size_of::<Camera>();
        let names = self.meshes.iter().map(|it| it.name.len()).sum::<usize>()
            + self.instances.iter().map(|it| it.name.len()).sum::<usize>()
            + self.spheres.iter().map(|it| it.name.len()).sum::<usize>()
            + self.cones.iter().map(|it| it.name.len()).sum::<usize>()
            + self.planes.iter().map(|it| it.name.len()).sum::<usize>()
            + self.materials.iter().map(|it| it.name.len()).sum::<usize>()
            + self.bitmaps.iter().map(|it| it.name.len()).sum::<usize>()
            + self.lights.iter().map(|it| it.name.len()).sum::<usize>()
            + self.cameras.iter().map(|it| it.name.len()).sum::<usize>();
        let meshes: u64 = self.meshes.iter().map(Mesh::bytes).sum();
        let bitmaps: u64 = self.bitmaps.iter().map(Bitmap::bytes).sum();
        (lists + names) as u64 + meshes + bitmaps
    }
}

/// Radiance of secondary rays that leave the scene, and source of diffuse light from afar.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Environment {
    /// Black.
    #[default]
    Black,
    /// The same radiance from every direction.
    Constant(Vec3),
    /// The built-in studio, a closed formula (see `render::studio`).
    Studio,
    /// [`Scene::panorama`]; black without one.
    Panorama,
}

/// Background of primary rays that hit nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// Transparent: alpha 0.
    Transparent,
    /// One colour, linear.
    Color(Vec3),
    /// The environment, as reflected rays see it.
    Environment,
}

impl Background {
    /// The background's single colour, linear, if it has one.
    pub fn color(self) -> Option<Vec3> {
        if let Self::Color(color) = self { Some(color) } else { None }
    }
}

/// The axis that points up in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum UpAxis {
    /// +Y, as in glTF and from most OBJ exporters.
    #[default]
    Y,
    /// +Z, as from CAD programs and scanners.
    Z,
}
