//! Rays from inside a closed mesh, aimed where tests tend to fail: none may escape.

use meshray::accel::{Accel, AccelKind, AccelParams, AnyAccel, Hit, NO_PRIM, NoProbe, Ray, Shapes};
use meshray::bench::star::star;
use meshray::math::random::Random;
use meshray::math::{DAffine3, DVec3, Vec3};
use meshray::render::World;
use meshray::scene::{Instance, Material, Mesh, Scene};
use rayon::prelude::*;

/// Rays of one task.
const SLICE: u32 = 4096;

/// Slow structures get one in this many of the others' rays, but at least a few.
const ONE_IN: u32 = 3200;
const FEW: u32 = 400;

const AIMS: [&str; 4] = ["corners", "edge middles", "edges", "random"];

/// Direction in which the mesh is moved.
const AWAY: DVec3 = DVec3::new(1.0, 0.7, 1.3);

/// Prints the escapes of `rays` rays for each place of the mesh; returns whether there were none.
pub(crate) fn run(rays: f64) -> bool {
    let mesh = star(400, 200);
    println!("closed mesh, {} triangles, {rays:e} rays a place; rays that escape, by aim", mesh.triangles.len());
    println!("{:28}{:14}{:>12}{:>14}{:>14}{:>14}{:>14}", "place", "accel", "rays", AIMS[0], AIMS[1], AIMS[2], AIMS[3]);
    let mut clean = true;
    for distance in [0.0, 1e3, 1e5] {
        let by = (AWAY * distance).as_vec3();
        let shapes = Shapes { vertices: mesh.vertices.iter().map(|p| *p + by).collect(), ..mesh.clone() };
        clean &= place(&format!("vertices moved by {distance:e}"), &shapes, by, rays);
    }
    let by = AWAY * 1e7;
    clean & place("transform moved by 1e7", &World::new(&scene(&mesh, by)).shapes, Vec3::ZERO, rays)
}

/// The mesh under a node transform.
fn scene(mesh: &Shapes, by: DVec3) -> Scene {
    let mesh = Mesh { positions: mesh.vertices.clone(), triangles: mesh.triangles.clone(), ..Mesh::default() };
    let instance = Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::from_translation(by) };
    Scene { meshes: vec![mesh], instances: vec![instance], materials: vec![Material::plain()], ..Scene::default() }
}

fn place(name: &str, shapes: &Shapes, center: Vec3, rays: f64) -> bool {
    let mut clean = true;
    for kind in AccelKind::ALL {
        let accel = AnyAccel::build(kind, shapes, &AccelParams::DEFAULT);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "`as` saturates")]
        let all = rays as u32;
        let count = if kind.is_slow() { (all / ONE_IN).max(FEW) } else { all };
        let escapes: [usize; 4] = std::array::from_fn(|aim| escapes(&accel, shapes, center, aim, count / 4));
        clean &= escapes == [0; 4];
        print!("{name:28}{kind:14}{count:>12}");
        escapes.iter().for_each(|n| print!("{n:>14}"));
        println!();
    }
    clean
}

fn escapes(accel: &AnyAccel, shapes: &Shapes, center: Vec3, aim: usize, count: u32) -> usize {
    let slice = |first: u32| {
        let mut random = Random::new(u64::from(first) << 2 | aim as u64);
        let rays: Vec<Ray> = (first..count.min(first + SLICE)).map(|_| ray(shapes, center, aim, &mut random)).collect();
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.closest(&rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
        hits.iter().filter(|h| !h.is_some()).count()
    };
    (0..count).into_par_iter().step_by(SLICE as usize).map(slice).sum()
}

fn ray(shapes: &Shapes, center: Vec3, aim: usize, random: &mut Random) -> Ray {
    let origin = loop {
        let p = random.cube();
        // The mesh has no vertex within the unit sphere, but its faces may bend inwards a little.
        if p.length_squared() < 0.8 {
            break center + p;
        }
    };
    let [a, b, _] = shapes.triangle(u32::try_from(random.below(shapes.triangles.len())).unwrap_or(0));
    let dir = match aim {
        0 => a - origin,
        1 => (a + b) * 0.5 - origin,
        2 => a + (b - a) * random.unit() - origin,
        _ => random.direction(),
    };
    Ray { origin, t_min: 0.0, dir, t_max: f32::INFINITY, exclude: NO_PRIM, sample: 0 }
}
