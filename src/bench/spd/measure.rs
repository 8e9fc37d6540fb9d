//! Counts of our structures on the SPD scenes, by the rules of the published counts.

use super::published::{self, Figures};
#[cfg(doc)]
use super::rules::PIXELS;
use super::rules::{Facing, Sent, Tally, send};
use crate::accel::{AccelKind, AccelParams, AnyAccel, Assign, BitSet, MailboxKind, RayCounts, Shapes};
use crate::bench::rays::{Batch, Class, RaySet};
use crate::bench::replay::{answers, counted};
use crate::render::{Question, World};
use crate::scene;
use rayon::prelude::*;

/// Settings of the measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Approximate limit of ray/object tests per structure: an even sample of the rays is used where all would take more.
    pub tests: u64,
    /// Seed of the sampling.
    pub seed: u64,
    /// Pixels per axis; the rules prescribe [`PIXELS`].
    pub pixels: u32,
}

/// Results of one scene.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Published figures.
    pub published: &'static published::Scene,
    /// Hash of the file.
    pub hash: u128,
    /// Number of objects that were read.
    pub objects: usize,
    /// Numbers of rays as Haines counts them.
    pub turned: Tally,
    /// Numbers of rays as Havran and Sixta count them; these rays are sent to the structures.
    pub outward: Tally,
    /// Results per structure, as far as measured.
    pub rows: Vec<Row>,
}

impl Measured {
    /// Difference between measured and published number of primary hits.
    pub fn eye_hits_off(&self) -> i64 {
        self.outward.primary_hits.cast_signed() - self.published.rays.primary_hits.cast_signed()
    }

    /// Our figures with the divisors of the published columns.
    ///
    /// All are per ray, but tests of octrees per hit, over the hits of all rays. The source does not say so, but the quotient of
    /// the published column and the tests per ray equals rays over hits in each of the eight scenes, at every depth.
    pub fn comparable(&self, row: &Row) -> Figures {
        let rays_per_hit = self.outward.rays() as f64 / self.outward.hits().max(1) as f64;
        let n_it = if row.setting.is_octree() { row.ours.n_it * rays_per_hit } else { row.ours.n_it };
        Figures { n_it, ..row.ours }
    }
}

/// Figures of one structure beside the published ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Structure.
    pub setting: Setting,
    /// Margin by which the boxes of faces are thickened.
    pub thickness: f64,
    /// Published figures.
    pub theirs: Figures,
    /// Counted figures, all per ray.
    pub ours: Figures,
    /// Number of rays sent.
    pub rays: u64,
    /// Number of rays whose answer differed from that of the structure that recorded them.
    pub differing: u64,
}

/// Published structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// Uniform grid.
    Grid {
        /// Rule by which the resolution was chosen.
        rule: &'static str,
        /// Cells per axis.
        cells: [u32; 3],
    },
    /// Octree over one cell.
    Octree {
        /// Maximum depth.
        depth: u32,
    },
}

impl Setting {
    /// All published structures of a scene, with their figures.
    pub fn all(scene: &published::Scene) -> Vec<(Self, Figures)> {
        let grids = scene.grids.iter().map(|g| (Self::Grid { rule: g.setting, cells: g.cells }, g.cost));
        let octrees = scene.octrees.iter().map(|o| (Self::Octree { depth: o.depth }, o.cost));
        grids.chain(octrees).collect()
    }

    /// Kind of the structure.
    pub fn kind(self) -> AccelKind {
        match self {
            Self::Grid { .. } => AccelKind::Grid,
            Self::Octree { .. } => AccelKind::Octree,
        }
    }

    /// Parameters by the published rules: objects assigned by their boxes and tested again in each cell (no mailbox), and octree
    /// cells split while they list more than one object.
    pub fn params(self, thickness: f64) -> AccelParams {
        let rules = AccelParams { assign: Assign::Box, thickness, mailbox: MailboxKind::None, ..AccelParams::DEFAULT };
        match self {
            Self::Grid { cells, .. } => AccelParams { grid_cells: Some(cells), ..rules },
            Self::Octree { depth } => {
                AccelParams { max_depth: Some(depth), leaf_size: Some(1), max_references: Some(1000.0), ..rules }
            }
        }
    }

    /// Whether the structure is an octree.
    pub fn is_octree(self) -> bool {
        self.kind() == AccelKind::Octree
    }

    /// Name in reports.
    pub fn name(self) -> String {
        match self {
            Self::Grid { rule, cells: [x, y, z] } => format!("grid {x}×{y}×{z} ({rule})"),
            Self::Octree { depth } => format!("octree, depth {depth}"),
        }
    }

    /// Name in one word.
    pub fn short_name(self) -> String {
        match self {
            Self::Grid { cells: [x, y, z], .. } => format!("grid-{x}x{y}x{z}"),
            Self::Octree { depth } => format!("octree-{depth}"),
        }
    }
}

/// Measures one scene. `go_on` is called at every step with the results so far; returns `None` when it stops the measurement, or
/// when the scene has no camera.
pub fn measure(
    published: &'static published::Scene,
    scene: &scene::Scene,
    hash: u128,
    plan: Plan,
    go_on: &mut dyn FnMut(&Measured, &str) -> bool,
) -> Option<Measured> {
    let world = World::new(scene);
    // Transparent objects block shadow rays, too.
    let opaque = BitSet::filled(world.shapes.len(), true);
    let shapes = Shapes { opaque, ..world.shapes.clone() };
    let mut measured = Measured {
        published,
        hash,
        objects: shapes.len(),
        turned: Tally::default(),
        outward: Tally::default(),
        rows: Vec::new(),
    };
    go_on(&measured, "sending rays").then_some(())?;
    let recorder = AnyAccel::build(AccelKind::FastBvh, &shapes, &AccelParams::DEFAULT);
    measured.turned = send(scene, &world, &shapes, &recorder, Facing::Turned, plan.pixels)?.tally;
    let sent = send(scene, &world, &shapes, &recorder, Facing::Outward, plan.pixels)?;
    measured.outward = sent.tally;
    let rays = ray_set(sent);
    for thickness in thicknesses(published) {
        for (setting, theirs) in Setting::all(published) {
            go_on(&measured, &setting.name()).then_some(())?;
            let mut row = Row { setting, thickness, theirs, ours: theirs, rays: 0, differing: 0 };
            row.count(&shapes, &recorder, &rays, plan);
            measured.rows.push(row);
        }
    }
    Some(measured)
}

/// Thickness of faces: none, then the one that explains the published cells.
fn thicknesses(published: &published::Scene) -> impl Iterator<Item = f64> + use<> {
    let thick = published.thickness;
    std::iter::once(0.0).chain((thick > 0.0).then_some(thick))
}

fn ray_set(sent: Sent) -> RaySet {
    let batch = |question, rays| Batch { question, rays, after: Vec::new() };
    let asked = sent.tally.rays();
    let batches = vec![batch(Question::Closest, sent.seeing), batch(Question::Occluded, sent.shadow)];
    RaySet { class: Class::Primary, asked, batches }
}

impl Row {
    fn count(&mut self, shapes: &Shapes, recorder: &AnyAccel, rays: &RaySet, plan: Plan) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "`as` saturates; a positive number"
        )]
        let limit = (plan.tests as f64 / self.theirs.n_it) as usize;
        let sample = if limit < rays.len() { &rays.sample(limit, plan.seed).0 } else { rays };
        let accel = AnyAccel::build(self.setting.kind(), shapes, &self.setting.params(self.thickness));
        let (counts, differing) = replay(&accel, recorder, sample);
        let made_of = accel.summary();
        let per_ray = |n: u64| n as f64 / counts.queries.max(1) as f64;
        self.ours = Figures {
            // The published counts lack the one node above a grid's cells.
            n_in: made_of.n_in - 1,
            n_v: made_of.n_v,
            n_ev: made_of.n_ev,
            n_oiv: made_of.n_oiv,
            n_it: per_ray(counts.n_it),
            n_ts: per_ray(counts.n_ts),
            n_ets: per_ray(counts.n_ets),
            n_eets: per_ray(counts.n_eets),
        };
        (self.rays, self.differing) = (counts.queries, differing);
    }

    /// Name in reports.
    pub fn name(&self) -> String {
        let thick = if self.thickness > 0.0 { ", thick faces" } else { "" };
        format!("{}{thick}", self.setting.name())
    }

    /// Name in one word.
    pub fn short_name(&self) -> String {
        let thick = if self.thickness > 0.0 { "-thick" } else { "" };
        format!("{}{thick}", self.setting.short_name())
    }
}

/// Rays per parallel task.
const SLICE: usize = 8192;

/// Sums the counts of all rays, and counts the answers that differ from the recorder's.
fn replay(accel: &AnyAccel, recorder: &AnyAccel, rays: &RaySet) -> (RayCounts, u64) {
    let slices = rays.batches.iter().flat_map(|b| b.rays.chunks(SLICE).map(|rays| (b.question, rays)));
    let slices: Vec<(Question, &[_])> = slices.collect();
    let parts: Vec<(RayCounts, u64)> = slices
        .into_par_iter()
        .map(|(question, rays)| {
            let batch = Batch { question, rays: rays.to_vec(), after: Vec::new() };
            let mut sum = RayCounts::default();
            let found = counted(accel, None, &batch, |_, counts| sum += *counts);
            let expected = answers(recorder, None, &batch);
            (sum, found.iter().zip(&expected).filter(|(a, b)| a != b).count() as u64)
        })
        .collect();
    parts.into_iter().fold(Default::default(), |(mut counts, differing), (more, wrong)| {
        counts += more;
        (counts, differing + wrong)
    })
}
