//! The BVHs of the crate obvhs, traced ray by ray.

use meshray::accel::{NO_PRIM, Shapes};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;

use crate::tracer::{Answer, Rays, Tracer};

/// The crate's compressed eight-wide hierarchy; triangles in the order of its leaves.
pub(crate) struct Compressed {
    bvh: CwBvh,
    triangles: Vec<Triangle>,
}

impl Compressed {
    pub(crate) fn build(shapes: &Shapes) -> Self {
        let all: Vec<Triangle> = (0..shapes.triangles.len() as u32)
            .map(|prim| {
                let [v0, v1, v2] = shapes.triangle(prim).map(|p| glam::Vec3A::new(p.x, p.y, p.z));
                Triangle { v0, v1, v2 }
            })
            .collect();
        let bvh = build_cwbvh_from_tris(&all, BvhBuildParams::medium_build(), &mut std::time::Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| all[i as usize]).collect();
        Self { bvh, triangles }
    }
}

impl Tracer for Compressed {
    fn name(&self) -> String {
        "obvhs 0.4, ray by ray".into()
    }

    fn trace(&self, any: bool, _: bool, rays: Rays, answers: &mut [Answer]) {
        for (ray, answer) in rays.all.iter().zip(answers) {
            let [o, d] = [ray.origin, ray.dir].map(|v| glam::Vec3A::new(v.x, v.y, v.z));
            let theirs = obvhs::ray::Ray::new(o, d, ray.t_min, ray.t_max);
            let mut hit = RayHit::none();
            let test = |ray: &obvhs::ray::Ray, i: usize| self.triangles[i].intersect(ray);
            let found = if any {
                self.bvh.ray_traverse_miss(theirs, test)
            } else {
                self.bvh.ray_traverse(theirs, &mut hit, test)
            };
            *answer = match (any, found) {
                (true, missed) => Answer { prim: if missed { NO_PRIM } else { 0 }, t: 0.0 },
                (false, true) => Answer { prim: self.bvh.primitive_indices[hit.primitive_id as usize], t: hit.t },
                (false, false) => Answer { prim: NO_PRIM, t: f32::INFINITY },
            };
        }
    }
}
