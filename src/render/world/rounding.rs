//! Error of rounding a scene to `f32` when it is placed.

use super::World;
use super::placing::{PARALLEL_RUN, centered};
use crate::accel::instances::PrimLocation;
use crate::math::aabb::Aabb;
use crate::math::{DVec3, Vec3};
use crate::scene::Scene;
use rayon::prelude::*;

/// Object that rounding has moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// Index into [`Scene::instances`].
    Instance(usize),
    /// Index into [`Scene::spheres`].
    Sphere(usize),
    /// Index into [`Scene::cones`].
    Cone(usize),
}

impl World {
    /// Largest distance that rounding to `f32` has moved corners of faces, surfaces of spheres and ends of cones from their
    /// places in `scene`, whose world this is; world units. For instanced objects, which are not compared corner by corner, an
    /// upper bound.
    pub fn rounding(&self, scene: &Scene) -> f64 {
        let mut from = 0;
        let stored = scene.instances.iter().enumerate().filter(|(i, _)| self.stored(*i)).map(|(_, instance)| {
            let mesh = &scene.meshes[instance.mesh as usize];
            let there = &self.shapes.vertices[from..from + mesh.positions.len()];
            from += mesh.positions.len();
            let to_frame = centered(&instance.world_from_object, self.center);
            let off = |(p, there): (&Vec3, &Vec3)| to_frame.transform_point3(p.as_dvec3()).distance(there.as_dvec3());
            let pairs = mesh.positions.par_iter().zip(there).with_min_len(PARALLEL_RUN);
            pairs.map(off).filter(|off| off.is_finite()).reduce(|| 0.0, f64::max)
        });
        let stored = stored.fold(0.0, f64::max);
        let instanced = self.instanced.placed().iter().map(|placed| half_steps(&placed.place.bounds));
        let solids = self.solids_moved(scene).map(|(_, off, _)| off);
        instanced.chain(solids).fold(stored, f64::max)
    }

    /// Distance that rounding has moved each sphere and cone, and its size.
    fn solids_moved(&self, scene: &Scene) -> impl Iterator<Item = (Moved, f64, f64)> {
        let moved = |at: DVec3, there: Vec3| (at - self.center).distance(there.as_dvec3());
        let resized = |radius: f64, there: f32| (radius - f64::from(there)).abs();
        let spheres = scene.spheres.iter().zip(&self.shapes.spheres).enumerate().map(move |(i, (of, there))| {
            let off = moved(of.center, there.center) + resized(of.radius, there.radius);
            (Moved::Sphere(i), off, 2.0 * of.radius)
        });
        let cones = scene.cones.iter().zip(&self.shapes.cones).enumerate().map(move |(i, (of, there))| {
            let base = moved(of.base, there.base) + resized(of.base_radius, there.base_radius);
            let apex = moved(of.apex, there.apex) + resized(of.apex_radius, there.apex_radius);
            let thick = 2.0 * of.base_radius.max(of.apex_radius);
            (Moved::Cone(i), base.max(apex), thick.min(of.base.distance(of.apex)))
        });
        spheres.chain(cones).filter(|(_, off, _)| off.is_finite())
    }

    /// Object that rounding has moved by the largest fraction of its size, with that fraction, if it exceeds `most`: the object
    /// is so far from the middle of the scene that its shape is distorted.
    pub fn coarsest(&self, scene: &Scene, most: f64) -> Option<(Moved, f64)> {
        let worse = |a: &(Moved, f64), b: &(Moved, f64)| a.1.total_cmp(&b.1);
        let solids = self.solids_moved(scene).map(|(which, off, size)| (which, off / size));
        let instance = self.coarsest_instance(scene, most).map(|(i, part)| (Moved::Instance(i), part));
        solids.filter(|(_, part)| *part > most && part.is_finite()).chain(instance).max_by(worse)
    }

    /// Instance that rounding moves by the largest fraction of its size, if that exceeds `most`.
    fn coarsest_instance(&self, scene: &Scene, most: f64) -> Option<(usize, f64)> {
        let mut from = 0;
        let mut worst: Option<(usize, f64)> = None;
        // A single instance is in the middle of the scene.
        if scene.instances.len() < 2 {
            return None;
        }
        // Instanced objects were checked when they were placed.
        for (i, instance) in scene.instances.iter().enumerate().filter(|(i, _)| self.stored(*i)) {
            let len = scene.meshes[instance.mesh as usize].positions.len();
            let there = Aabb::around(self.shapes.vertices[from..from + len].iter().copied());
            from += len;
            let size = f64::from((there.hi - there.lo).max_element());
            let part = half_steps(&there) / size;
            // Points and collapsed meshes have no size to compare with.
            let is_worse = part > worst.map_or(most, |(_, part)| part);
            if is_worse && part.is_finite() {
                worst = Some((i, part));
            }
        }
        worst
    }

    /// Whether an instance is stored by itself.
    fn stored(&self, instance: usize) -> bool {
        let (first, end) = (self.first_triangle[instance], self.first_triangle[instance + 1]);
        first == end || matches!(self.instanced.find(first), PrimLocation::Stored(_))
    }
}

/// Upper bound of the distance that rounding moves points of a box.
fn half_steps(bounds: &Aabb) -> f64 {
    let most = bounds.lo.abs().max(bounds.hi.abs());
    let step = most.map(|x| x.next_up() - x).as_dvec3();
    if step.is_finite() { (0.5 * step).length() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Cone, Sphere};

    fn sphere(x: f64, radius: f64) -> Sphere {
        Sphere { name: String::new(), center: DVec3::new(x, 0.0, 0.0), radius, material: 0 }
    }

    #[test]
    fn spheres_and_cones_far_from_the_middle_are_told() {
        let mut scene = Scene { spheres: vec![sphere(0.0, 0.1), sphere(0.3, 0.1)], ..Scene::default() };
        let world = World::new(&scene);
        assert!(world.rounding(&scene) < 1e-7 && world.coarsest(&scene, 0.01).is_none());
        scene.spheres.push(sphere(1e7, 0.1));
        let world = World::new(&scene);
        let (which, part) = world.coarsest(&scene, 0.01).expect("half steps of 5e6 are 0.25");
        assert!(matches!(which, Moved::Sphere(_)) && part > 0.1 && world.rounding(&scene) > 0.02, "{which:?} {part}");
        let end = |x: f64| DVec3::new(x, 0.3, 0.1);
        let cone = Cone {
            name: String::new(),
            base: end(0.3),
            base_radius: 0.2,
            apex: end(0.4),
            apex_radius: 0.0,
            material: 0,
        };
        let scene = Scene { spheres: vec![sphere(1e7, 1.0)], cones: vec![cone], ..Scene::default() };
        assert_eq!(World::new(&scene).coarsest(&scene, 0.2).map(|(which, _)| which), Some(Moved::Cone(0)));
    }
}
