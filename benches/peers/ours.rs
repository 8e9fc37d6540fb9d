//! Our own structures, one tracer for each kernel.

use std::cell::RefCell;

use meshray::accel::{Accel, Hit, HitQueries, NO_PRIM, NoProbe, Ray, Shapes, Splitting, Wide};

use crate::tracer::{Answer, Rays, Tracer};

/// Printed name of a structure.
pub(crate) fn structure(splitting: Splitting) -> &'static str {
    match splitting {
        Splitting::Octree => "meshray fast-octree",
        Splitting::SurfaceArea => "meshray fast-bvh",
    }
}

type Buffers<'a> = (<Wide<'a> as Accel>::Scratch, Vec<Hit>, Vec<bool>);

/// One structure with one kernel.
pub(crate) struct Ours<'a> {
    wide: Wide<'a>,
    name: String,
    buffers: RefCell<Buffers<'a>>,
}

impl<'a> Ours<'a> {
    pub(crate) fn new(wide: Wide<'a>, kernel: &str) -> Self {
        let structure = structure(wide.splitting());
        let buffers = RefCell::new((wide.scratch(), Vec::new(), Vec::new()));
        Self { wide, name: format!("{structure}, {kernel}"), buffers }
    }

    /// Returns the first hits of all rays.
    pub(crate) fn hits(shapes: &Shapes, rays: &[Ray]) -> Vec<Hit> {
        let wide = Wide::build(shapes, Splitting::SurfaceArea);
        let mut hits = vec![Hit::MISS; rays.len()];
        wide.closest(rays, &mut hits, &mut wide.scratch(), &mut NoProbe);
        hits
    }
}

impl Tracer for Ours<'_> {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn trace(&self, any: bool, _: bool, rays: Rays, answers: &mut [Answer]) {
        let (pencil, rays) = (rays.pencil, rays.all);
        let (scratch, hits, occluded) = &mut *self.buffers.borrow_mut();
        if any {
            occluded.resize(rays.len(), false);
            self.wide.occluded(rays, occluded, scratch, &mut NoProbe);
            for (answer, occluded) in answers.iter_mut().zip(occluded) {
                *answer = Answer { prim: if *occluded { 0 } else { NO_PRIM }, t: 0.0 };
            }
        } else {
            hits.resize(rays.len(), Hit::MISS);
            let queries = HitQueries { pencil: pencil.as_ref(), ..HitQueries::along(rays) };
            self.wide.first_hits(&queries, hits, scratch, &mut NoProbe);
            for (answer, hit) in answers.iter_mut().zip(hits) {
                *answer = Answer { prim: hit.prim, t: hit.t };
            }
        }
    }
}
