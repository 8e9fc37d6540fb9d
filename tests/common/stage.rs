//! Small scenes built in code, and their pictures: a stage is set with a few calls and rendered through the library.

use meshray::accel::{AccelKind, AccelParams, AnyAccel};
use meshray::image::Picture;
use meshray::math::{DAffine3, DVec3, Vec2, Vec3};
use meshray::render::texture::TextureStore;
use meshray::render::view::Lens;
use meshray::render::{Job, Settings, View, World, render};
use meshray::scene::{
    Background, Bitmap, Environment, Falloff, Instance, Light, LightKind, Material, Mesh, MetalRough, Phong, Pixels,
    Plane, Reflection, Sampler, Scene, Sphere, Texture, TextureRef, UvTransform,
};

/// A scene, a view and the settings.
pub struct Stage {
    pub scene: Scene,
    pub view: View,
    pub settings: Settings,
}

impl Stage {
    /// An empty, dark stage seen from `eye` towards `at`, with a vertical field of view of 40 degrees, 96×72 pixels of 9 samples.
    pub fn new(eye: [f64; 3], at: [f64; 3]) -> Self {
        let lens = Lens::perspective(40.0_f64.to_radians());
        let view = View::look_at(eye.into(), at.into(), DVec3::Y, lens);
        let settings = Settings { width: 96, height: 72, samples: 9, ..Settings::default() };
        Self { scene: Scene { background: Some(Background::Transparent), ..Scene::default() }, view, settings }
    }

    pub fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// Adds a Phong material without gloss.
    pub fn matt(&mut self, color: [f32; 3]) -> u32 {
        self.material(phong(color, Phong::default()))
    }

    pub fn sphere(&mut self, center: [f64; 3], radius: f64, material: u32) {
        self.scene.spheres.push(Sphere { name: String::new(), center: center.into(), radius, material });
    }

    /// Adds the plane y = `height`, visible from above.
    pub fn floor(&mut self, height: f64, material: u32) {
        self.scene.planes.push(Plane { name: String::new(), normal: DVec3::Y, offset: height, material });
    }

    /// Adds a mesh in world coordinates.
    pub fn mesh(&mut self, mesh: Mesh) {
        self.scene.meshes.push(mesh);
        let mesh = self.scene.meshes.len() as u32 - 1;
        self.scene.instances.push(Instance { name: String::new(), mesh, world_from_object: DAffine3::IDENTITY });
    }

    /// Adds a flat quad, counter-clockwise from the front; texture coordinates `tiles` times 0…1, the first corner at the lower
    /// left.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], tiles: f32, material: u32) {
        let uv = [[0.0, tiles], [tiles, tiles], [tiles, 0.0], [0.0, 0.0]];
        self.mesh(Mesh {
            material,
            positions: corners.map(Vec3::from).to_vec(),
            uvs: vec![uv.map(Vec2::from).to_vec()],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        });
    }

    /// Adds a square in the plane z = `z`, facing +z.
    pub fn card(&mut self, x: f32, y: f32, z: f32, half: f32, material: u32) {
        let at = |dx: f32, dy: f32| [x + dx * half, y + dy * half, z];
        self.quad([at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)], 1.0, material);
    }

    /// Adds a texture of `side`×`side` texels, sRGB-coded RGBA.
    pub fn texture(&mut self, side: u32, sampler: Sampler, texel: impl Fn(u32, u32) -> [u8; 4]) -> TextureRef {
        let texels = (0..side * side).map(|i| texel(i % side, i / side)).collect();
        self.scene.bitmaps.push(Bitmap {
            name: String::new(),
            width: side,
            height: side,
            pixels: Pixels::Rgba8(texels),
        });
        self.scene.textures.push(Texture { bitmap: self.scene.bitmaps.len() as u32 - 1, sampler });
        let texture = self.scene.textures.len() as u32 - 1;
        TextureRef { texture, uv_set: 0, transform: UvTransform::default() }
    }

    /// Adds a directional light.
    pub fn sun(&mut self, direction: [f64; 3], intensity: f32) {
        let direction = DVec3::from(direction).normalize();
        self.light([intensity; 3], LightKind::Directional { direction });
    }

    /// Adds a point light without falloff.
    pub fn lamp(&mut self, position: [f64; 3], intensity: [f32; 3]) {
        self.light(intensity, LightKind::Point { position: position.into(), falloff: Falloff::None });
    }

    pub fn light(&mut self, intensity: [f32; 3], kind: LightKind) {
        self.scene.lights.push(Light {
            name: String::new(),
            intensity: intensity.into(),
            kind,
            shadows: true,
            size: 0.0,
        });
    }

    /// Adds the studio around the stage.
    pub fn studio(&mut self) {
        self.scene.environment = Environment::Studio;
    }

    pub fn render(&self) -> Picture {
        self.render_with(AccelKind::GridOctree)
    }

    pub fn render_with(&self, kind: AccelKind) -> Picture {
        let world = World::new(&self.scene);
        let accel = AnyAccel::build(kind, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&self.scene);
        let job = Job {
            scene: &self.scene,
            world: &world,
            accel: &accel,
            textures: &textures,
            view: &self.view,
            settings: &self.settings,
        };
        render(&job, &()).picture
    }
}

/// A double-sided Phong material.
pub fn phong(color: [f32; 3], phong: Phong) -> Material {
    Material {
        base_color: color.into(),
        double_sided: true,
        reflection: Reflection::Phong(phong),
        ..Material::default()
    }
}

/// A double-sided metallic-roughness material.
pub fn metal_rough(color: [f32; 3], model: MetalRough) -> Material {
    Material {
        base_color: color.into(),
        double_sided: true,
        reflection: Reflection::MetalRough(model),
        ..Material::default()
    }
}

/// An unlit material: it shows its colour whatever the light.
pub fn unlit(color: [f32; 3]) -> Material {
    Material { base_color: color.into(), double_sided: true, reflection: Reflection::Unlit, ..Material::default() }
}
