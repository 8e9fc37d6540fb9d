//! Haines' rules for the rays of a picture, which make the counts of two programs comparable.
//!
//! Primary rays pass through the corners of 512 × 512 pixels. Every hit sends a shadow ray to each light that its normal does not
//! point away from; reflecting or transmitting surfaces also send a reflected ray, and transmitting ones a refracted ray unless
//! there is total internal reflection. No ray is dropped for its small weight; with the primary rays there are at most five
//! generations. Surfaces are visible from both sides.

use crate::accel::{Accel, Hit, NO_PRIM, NoProbe, Ray, Shapes};
use crate::math::{DVec3, Vec3};
use crate::render::optics::{reflect, refract};
use crate::render::{World, given_normal};
use crate::scene::{Camera, LightKind, Projection, Reflection, Scene};
use rayon::prelude::*;
use std::ops::AddAssign;

/// Pixels per axis.
pub const PIXELS: u32 = 512;

/// Generations of rays, including the primary rays.
const GENERATIONS: u32 = 5;

/// Rays per parallel task.
const SLICE: usize = 4096;

/// Convention for the outside of a surface when shadow rays are sent. The rules leave it open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// The side that the ray hits, as in Haines' own counts.
    Turned,
    /// The side of the file's normals, as in Havran's counts.
    Outward,
}

/// Numbers of rays and hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Primary rays.
    pub primary: u64,
    /// Primary rays that hit.
    pub primary_hits: u64,
    /// Reflected rays.
    pub reflected: u64,
    /// Refracted rays.
    pub refracted: u64,
    /// Reflected and refracted rays that hit.
    pub secondary_hits: u64,
    /// Shadow rays.
    pub shadow: u64,
    /// Shadow rays that hit something before the light, whether transparent or not.
    pub shadow_hits: u64,
}

impl Tally {
    /// Reflected and refracted rays.
    pub fn secondary(&self) -> u64 {
        self.reflected + self.refracted
    }

    /// Rays that hit something; any structure needs at least this many tests.
    pub fn hits(&self) -> u64 {
        self.primary_hits + self.secondary_hits + self.shadow_hits
    }

    /// All rays.
    pub fn rays(&self) -> u64 {
        self.primary + self.secondary() + self.shadow
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, o: Self) {
        self.primary += o.primary;
        self.primary_hits += o.primary_hits;
        self.reflected += o.reflected;
        self.refracted += o.refracted;
        self.secondary_hits += o.secondary_hits;
        self.shadow += o.shadow;
        self.shadow_hits += o.shadow_hits;
    }
}

/// Rays of a picture.
#[derive(Clone, Debug, Default)]
pub struct Sent {
    /// Numbers of rays.
    pub tally: Tally,
    /// Primary rays, then reflected and refracted ones, generation by generation, for closest-hit queries.
    pub seeing: Vec<Ray>,
    /// Shadow rays, for occlusion queries.
    pub shadow: Vec<Ray>,
}

/// Sends all rays of the picture of the scene's first camera. `None` without a camera, or if it is orthographic.
///
/// `pixels` is the number per axis; there is one more corner. Everything must be opaque: `shapes` are those of `world` with all
/// opaque flags set, and `accel` is built over them.
pub fn send<A: Accel>(
    scene: &Scene,
    world: &World,
    shapes: &Shapes,
    accel: &A,
    facing: Facing,
    pixels: u32,
) -> Option<Sent> {
    let tracer = Tracer { scene, world, shapes, accel, facing, lights: lights(scene, world), kinds: kinds(scene) };
    let mut rays = eye_rays(scene.cameras.first()?, world.center, pixels)?;
    let mut sent = Sent::default();
    for generation in 1..=GENERATIONS {
        let last = generation == GENERATIONS;
        let parts: Vec<Part> = rays.par_chunks(SLICE).map(|slice| tracer.trace(slice, last)).collect();
        let mut next = Vec::new();
        for part in parts {
            sent.tally += part.tally;
            sent.shadow.extend(part.shadow);
            next.extend(part.next);
            let hits = if generation == 1 { &mut sent.tally.primary_hits } else { &mut sent.tally.secondary_hits };
            *hits += part.hits;
        }
        if generation == 1 {
            sent.tally.primary = rays.len() as u64;
        }
        sent.seeing.append(&mut rays);
        rays = next;
    }
    Some(sent)
}

/// Primary rays through the corners of all pixels, row by row from the top.
fn eye_rays(camera: &Camera, center: DVec3, pixels: u32) -> Option<Vec<Ray>> {
    let Projection::Perspective { y_fov, .. } = camera.projection else { return None };
    let half = libm::tan(y_fov / 2.0);
    let origin = (camera.world_from_camera.translation - center).as_vec3();
    let at = |i: u32| half * (2.0 * f64::from(i) / f64::from(pixels) - 1.0);
    let ray = |row: u32, column: u32| {
        let dir = camera.world_from_camera.matrix3 * DVec3::new(at(column), -at(row), -1.0);
        ray(origin, dir.as_vec3(), f32::INFINITY)
    };
    Some((0..=pixels).flat_map(|row| (0..=pixels).map(move |column| (row, column))).map(|(r, c)| ray(r, c)).collect())
}

/// Rays do not exclude the face they start on: the programs compared with tested it like any other.
fn ray(origin: Vec3, dir: Vec3, t_max: f32) -> Ray {
    Ray { origin, t_min: 0.0, dir, t_max, exclude: NO_PRIM, sample: 0 }
}

/// Positions of the lights in the frame of the shapes.
fn lights(scene: &Scene, world: &World) -> Vec<Vec3> {
    let place = |kind: &LightKind| match kind {
        LightKind::Point { position, .. } => Some((position - world.center).as_vec3()),
        _ => None,
    };
    scene.lights.iter().filter_map(|light| place(&light.kind)).collect()
}

/// Secondary rays of a material.
#[derive(Clone, Copy, Debug, Default)]
struct Kind {
    reflects: bool,
    /// Index of refraction of a transmitting material.
    transmits: Option<f64>,
}

fn kinds(scene: &Scene) -> Vec<Kind> {
    let kind = |surface: &Reflection| match surface {
        Reflection::Phong(phong) => {
            let transmits = (phong.transmission.max_element() > 0.0).then_some(f64::from(phong.ior));
            Kind { reflects: phong.specular.max_element() > 0.0 || transmits.is_some(), transmits }
        }
        _ => Kind::default(),
    };
    scene.materials.iter().map(|m| kind(&m.reflection)).collect()
}

struct Tracer<'a, A> {
    scene: &'a Scene,
    world: &'a World,
    shapes: &'a Shapes,
    accel: &'a A,
    facing: Facing,
    lights: Vec<Vec3>,
    kinds: Vec<Kind>,
}

/// Results of one slice of rays.
#[derive(Default)]
struct Part {
    tally: Tally,
    hits: u64,
    shadow: Vec<Ray>,
    next: Vec<Ray>,
}

impl<A: Accel> Tracer<'_, A> {
    fn trace(&self, rays: &[Ray], last: bool) -> Part {
        let mut scratch = self.accel.scratch();
        let mut hits = vec![Hit::MISS; rays.len()];
        self.accel.closest(rays, &mut hits, &mut scratch, &mut NoProbe);
        let mut part = Part::default();
        for (ray, hit) in rays.iter().zip(&hits).filter(|(_, hit)| hit.is_some()) {
            part.hits += 1;
            self.follow(ray, hit, last, &mut part);
        }
        let mut occluded = vec![false; part.shadow.len()];
        self.accel.occluded(&part.shadow, &mut occluded, &mut scratch, &mut NoProbe);
        part.tally.shadow = part.shadow.len() as u64;
        part.tally.shadow_hits = occluded.iter().filter(|b| **b).count() as u64;
        part
    }

    /// Adds the shadow and secondary rays of a hit.
    fn follow(&self, ray: &Ray, hit: &Hit, last: bool, part: &mut Part) {
        let at = self.shapes.refine(ray, hit);
        let own = given_normal(self.scene, self.world, hit.prim, &at).unwrap_or(at.normal);
        let seen_from_front = own.dot(ray.dir) <= 0.0;
        let turned = if seen_from_front { own } else { -own };

        let lit_side = if self.facing == Facing::Turned { turned } else { own };
        for light in self.lights.iter().filter(|&&light| lit_side.dot(light - at.position) > 0.0) {
            let origin = at.origin(light - at.position);
            // The light lies at t = 1.
            part.shadow.push(self::ray(origin, light - origin, 1.0));
        }

        let kind = self.kinds[self.world.material(self.scene, hit.prim) as usize];
        if last || !kind.reflects {
            return;
        }
        let incident = ray.dir.normalize_or_zero();
        let mut send = |dir: Vec3| part.next.push(self::ray(at.origin(dir), dir, f32::INFINITY));
        send(reflect(incident, turned));
        part.tally.reflected += 1;
        let Some(index) = kind.transmits else { return };
        let (from, to) = if seen_from_front { (1.0, index) } else { (index, 1.0) };
        if let Some(dir) = refract(incident, turned, from, to) {
            send(dir);
            part.tally.refracted += 1;
        }
    }
}
