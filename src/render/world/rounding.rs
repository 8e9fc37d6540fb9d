//! What rounding to `f32` does to a scene when it is placed.

use super::World;
use super::placing::{PARALLEL_RUN, centered};
use crate::accel::instances::Spot;
use crate::math::Vec3;
use crate::math::aabb::Aabb;
use crate::scene::Scene;
use rayon::prelude::*;

impl World {
    /// How far rounding to `f32` has moved corners of faces at most from where `scene` has them, of which this is the world;
    /// world units. Corners of objects are not looked at one by one: of them, the most that can be.
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
        let kept = self.kept.placed().iter().map(|placed| half_steps(&placed.place.bounds));
        kept.fold(stored, f64::max)
    }

    /// The instance whose faces rounding has moved by the largest part of its size, with that part, if it is more than `most`:
    /// it stands so far from the middle of the scene that it is not what the file says.
    pub fn coarsest(&self, scene: &Scene, most: f64) -> Option<(usize, f64)> {
        let mut from = 0;
        let mut worst: Option<(usize, f64)> = None;
        // One that stands alone is in the middle.
        if scene.instances.len() < 2 {
            return None;
        }
        // What is kept has been looked at.
        for (i, instance) in scene.instances.iter().enumerate().filter(|(i, _)| self.stored(*i)) {
            let len = scene.meshes[instance.mesh as usize].positions.len();
            let there = Aabb::around(self.shapes.vertices[from..from + len].iter().copied());
            from += len;
            let size = f64::from((there.hi - there.lo).max_element());
            let part = half_steps(&there) / size;
            // Points and what has collapsed have no size to compare with.
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
        first == end || matches!(self.kept.find(first), Spot::Stored(_))
    }
}

/// How far rounding moves points of a box at most.
fn half_steps(bounds: &Aabb) -> f64 {
    let most = bounds.lo.abs().max(bounds.hi.abs());
    let step = most.map(|x| x.next_up() - x).as_dvec3();
    if step.is_finite() { (0.5 * step).length() } else { 0.0 }
}
