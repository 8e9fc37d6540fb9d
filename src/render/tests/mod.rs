//! Whole small pictures with analytic answers.

mod bits;
mod coat;
mod costs;
mod environment_rays;
mod gaps;
mod glass;
mod glints;
mod gloss;
mod hotspot;
mod instances;
mod leaf;
mod light;
mod mirrors;
mod ray_tree;
mod round;
mod sampling;
mod see_through;
mod sight;
mod soft;
mod tiles;

use super::texture::TextureStore;
use super::view::{Lens, View};
use super::{Forecast, forecast};
use super::{Job, Rendered, Settings, World, render_counted};
use crate::accel::{AccelKind, AccelParams, AnyAccel};
use crate::math::{DAffine3, DVec3, Vec3};
use crate::scene::{Falloff, Instance, Light, LightKind, Material, Mesh, Phong, Plane, Reflection, Scene, Sphere};

/// A scene under construction, with its view and settings.
struct Stage {
    scene: Scene,
    view: View,
    settings: Settings,
}

/// One pixel that looks along −z from +`distance` with parallel rays.
fn looking_down(distance: f64) -> Stage {
    let eye = DVec3::Z * distance;
    let view = View::look_at(eye, DVec3::ZERO, DVec3::Y, Lens::orthographic(1.0));
    stage(view)
}

fn stage(view: View) -> Stage {
    let settings = Settings { width: 1, height: 1, samples: 1, cutoff: 0.0, ..Settings::default() };
    Stage { scene: Scene::default(), view, settings }
}

/// A Phong surface that reflects nothing by default.
fn phong() -> Phong {
    Phong::default()
}

fn material(base_color: Vec3, phong: Phong) -> Material {
    Material { base_color, double_sided: true, reflection: Reflection::Phong(phong), ..Material::default() }
}

fn unlit(color: Vec3) -> Material {
    Material { base_color: color, double_sided: true, reflection: Reflection::Unlit, ..Material::default() }
}

impl Stage {
    fn add_material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    fn sphere(&mut self, center: DVec3, radius: f64, material: Material) -> &mut Self {
        let material = self.add_material(material);
        self.scene.spheres.push(Sphere { name: String::new(), center, radius, material });
        self
    }

    fn plane(&mut self, normal: DVec3, offset: f64, material: Material) -> &mut Self {
        let material = self.add_material(material);
        self.scene.planes.push(Plane { name: String::new(), normal, offset, material });
        self
    }

    /// Adds a mesh with its instance; its material index is filled in.
    fn mesh(&mut self, mesh: Mesh, world_from_object: DAffine3, material: Material) -> &mut Self {
        let material = self.add_material(material);
        self.scene.meshes.push(Mesh { material, ..mesh });
        let mesh = self.scene.meshes.len() as u32 - 1;
        self.scene.instances.push(Instance { name: String::new(), mesh, world_from_object });
        self
    }

    /// Adds a square of side 2·`half` that faces +z at height `z`.
    fn square(&mut self, z: f32, half: f32, material: Material) -> &mut Self {
        self.mesh(square(z, half), DAffine3::IDENTITY, material)
    }

    /// Adds a point light of strength `intensity` without falloff.
    fn lamp(&mut self, position: DVec3, intensity: f32) -> &mut Self {
        let kind = LightKind::Point { position, falloff: Falloff::None };
        let intensity = Vec3::splat(intensity);
        self.scene.lights.push(Light { name: String::new(), intensity, kind, shadows: true, size: 0.0 });
        self
    }

    fn with_job<T>(&self, kind: AccelKind, work: impl FnOnce(&Job) -> T) -> T {
        let world = World::new(&self.scene);
        let accel = AnyAccel::build(kind, &world.shapes, &AccelParams::DEFAULT);
        let textures = TextureStore::new(&self.scene);
        work(&Job {
            scene: &self.scene,
            world: &world,
            accel: &accel,
            textures: &textures,
            view: &self.view,
            settings: &self.settings,
        })
    }

    fn render_by(&self, kind: AccelKind) -> Rendered {
        self.with_job(kind, |job| render_counted(job, &()))
    }

    fn render(&self) -> Rendered {
        self.render_by(AccelKind::None)
    }

    fn forecast(&self) -> Forecast {
        self.with_job(AccelKind::DEFAULT, |job| forecast(job, &())).unwrap()
    }

    /// Colour of the first pixel.
    fn color(&self) -> Vec3 {
        Vec3::from_slice(&self.render().picture.beauty[0])
    }

    /// Alpha of the first pixel.
    fn alpha(&self) -> f32 {
        self.render().picture.beauty[0][3]
    }
}

fn square(z: f32, half: f32) -> Mesh {
    let corner = |x: f32, y: f32| Vec3::new(x * half, y * half, z);
    Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

#[track_caller]
fn assert_near(a: Vec3, b: Vec3, tolerance: f32) {
    assert!((a - b).length() <= tolerance, "{a} is not within {tolerance} of {b}");
}

#[test]
fn settings_out_of_their_ranges_are_named_with_these() {
    let valid = Settings::default();
    assert_eq!(valid.validate(), Ok(()));
    let largest = Settings { width: Settings::MOST_SIDE, gloss_rays: Some(Settings::MOST_RAYS), ..valid.clone() };
    assert_eq!(largest.validate(), Ok(()));
    let faults = [
        (Settings { height: 0, ..valid.clone() }, "height is 0: it must be 1 to 65535"),
        (Settings { width: u32::MAX, ..valid.clone() }, "width is 4294967295: it must be 1 to 65535"),
        (Settings { samples: 0, ..valid.clone() }, "samples is 0: it must be 1 to 65536"),
        (Settings { light_rays: 65_537, ..valid.clone() }, "light_rays is 65537: it must be 0 to 65536"),
        (Settings { env_rays: Some(u32::MAX), ..valid.clone() }, "env_rays is 4294967295: it must be 0 to 65536"),
        (Settings { gloss_rays: Some(65_537), ..valid }, "gloss_rays is 65537: it must be 0 to 65536"),
    ];
    for (settings, expected) in faults {
        assert_eq!(settings.validate().unwrap_err().to_string(), expected);
    }
}
