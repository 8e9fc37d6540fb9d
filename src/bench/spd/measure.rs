//! Our counts on one of the scenes, by the rules that the published ones go by.

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

/// How to measure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Ray/object tests that one structure may take, about: it gets an even sample of the rays where all would take more.
    pub tests: u64,
    /// Changes what is sampled.
    pub seed: u64,
    /// Pixels on an axis: [`PIXELS`], as the rules have it.
    pub pixels: u32,
}

/// Everything about one scene.
#[derive(Clone, Debug)]
pub struct Measured {
    /// What was published.
    pub published: &'static published::Scene,
    /// Of the file.
    pub hash: u128,
    /// Objects that were read.
    pub objects: usize,
    /// Rays as Haines counts them.
    pub turned: Tally,
    /// Rays as Havran and Sixta count them; those that the structures are given.
    pub outward: Tally,
    /// Each structure, as far as they are.
    pub rows: Vec<Row>,
}

impl Measured {
    /// Eye rays that hit, more than published.
    pub fn eye_hits_off(&self) -> i64 {
        self.outward.primary_hits.cast_signed() - self.published.rays.primary_hits.cast_signed()
    }

    /// Our cost with the divisors of the published columns.
    ///
    /// Per ray; but tests of octrees per hit, all hits of all rays together. The source does not say so. But the quotient of
    /// the published column and the tests a ray is that of rays and hits in each of the eight scenes, at every depth.
    pub fn comparable(&self, row: &Row) -> Figures {
        let rays_per_hit = self.outward.rays() as f64 / self.outward.hits().max(1) as f64;
        let n_it = if row.setting.is_octree() { row.ours.n_it * rays_per_hit } else { row.ours.n_it };
        Figures { n_it, ..row.ours }
    }
}

/// One structure beside its published figures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Which one.
    pub setting: Setting,
    /// How far the boxes of faces reached beyond them.
    pub thickness: f64,
    /// What was published.
    pub theirs: Figures,
    /// What was counted, all a ray.
    pub ours: Figures,
    /// Rays it was given.
    pub rays: u64,
    /// Rays whose answer differed from that of the structure which recorded them.
    pub differing: u64,
}

/// A published structure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Setting {
    /// A uniform grid.
    Grid {
        /// How the resolution was chosen.
        rule: &'static str,
        /// Cells on each axis.
        cells: [u32; 3],
    },
    /// An octree over one cell.
    Octree {
        /// Greatest depth.
        depth: u32,
    },
}

impl Setting {
    /// All of a scene, with what was published.
    pub fn all(scene: &published::Scene) -> Vec<(Self, Figures)> {
        let grids = scene.grids.iter().map(|g| (Self::Grid { rule: g.setting, cells: g.cells }, g.cost));
        let octrees = scene.octrees.iter().map(|o| (Self::Octree { depth: o.depth }, o.cost));
        grids.chain(octrees).collect()
    }

    /// Which kind of structure.
    pub fn kind(self) -> AccelKind {
        match self {
            Self::Grid { .. } => AccelKind::Grid,
            Self::Octree { .. } => AccelKind::Octree,
        }
    }

    /// Parameters that follow the published rules: objects assigned by their boxes, tested again in each cell, and cells
    /// split while they list more than one.
    pub fn params(self, thickness: f64) -> AccelParams {
        let rules = AccelParams { assign: Assign::Box, thickness, mailbox: MailboxKind::None, ..AccelParams::DEFAULT };
        match self {
            Self::Grid { cells, .. } => AccelParams { grid_cells: Some(cells), ..rules },
            Self::Octree { depth } => {
                AccelParams { max_depth: Some(depth), leaf_size: Some(1), max_references: Some(1000.0), ..rules }
            }
        }
    }

    /// Whether it is an octree.
    pub fn is_octree(self) -> bool {
        self.kind() == AccelKind::Octree
    }

    /// As printed.
    pub fn name(self) -> String {
        match self {
            Self::Grid { rule, cells: [x, y, z] } => format!("grid {x}×{y}×{z} ({rule})"),
            Self::Octree { depth } => format!("octree, depth {depth}"),
        }
    }

    /// In one word.
    pub fn short_name(self) -> String {
        match self {
            Self::Grid { cells: [x, y, z], .. } => format!("grid-{x}x{y}x{z}"),
            Self::Octree { depth } => format!("octree-{depth}"),
        }
    }
}

/// Measures. `go_on` hears of every step, with what is known by then; `None` when it says to stop, or when the scene has
/// no camera.
pub fn measure(
    published: &'static published::Scene,
    scene: &scene::Scene,
    hash: u128,
    plan: Plan,
    go_on: &mut dyn FnMut(&Measured, &str) -> bool,
) -> Option<Measured> {
    let world = World::new(scene);
    // What lets light through counts as being in its way.
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

/// Faces as they are, and as thick as explains the published cells.
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
            // The one node above a grid's cells is none of theirs.
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

    /// As printed.
    pub fn name(&self) -> String {
        let thick = if self.thickness > 0.0 { ", thick faces" } else { "" };
        format!("{}{thick}", self.setting.name())
    }

    /// In one word.
    pub fn short_name(&self) -> String {
        let thick = if self.thickness > 0.0 { "-thick" } else { "" };
        format!("{}{thick}", self.setting.short_name())
    }
}

/// Rays that one thread asks in a row.
const SLICE: usize = 8192;

/// Counts over all rays, and how many answers differ from the recorder's.
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
