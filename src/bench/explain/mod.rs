//! Explains the cost of a mesh: each suspected cause is removed, and the saving is counted.
//!
//! A small picture is rendered unchanged and once more without each suspected cause. Cost is the sum of ray/prim tests, visited
//! nodes and cells, and transformed points of all rays: it depends on neither the machine nor the number of threads.

mod causes;
mod mend;
#[cfg(test)]
mod tests;

use crate::accel::{AccelKind, AccelParams, AnyAccel, RayCounts};
use crate::render::texture::TextureStore;
use crate::render::{ClassCounts, Job, Settings, View, World, render_counted};
use crate::scene::Scene;
use std::fmt;

/// A picture whose cost is to be explained.
#[derive(Clone, Debug)]
pub struct Case {
    /// Scene with its lights.
    pub scene: Scene,
    /// Camera.
    pub view: View,
    /// Render settings; few pixels suffice.
    pub settings: Settings,
    /// Acceleration structure.
    pub accel: AccelKind,
    /// Parameters of the structure.
    pub params: AccelParams,
}

/// Possible cause of avoidable cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cause {
    /// A few huge triangles that overlap many cells or boxes.
    HugeTriangles,
    /// Cluster of most prims in a small part of the space that the structure divides.
    DenseCluster,
    /// Structure that does more work than another would.
    Structure,
    /// Triangles that share their corners with others.
    Shells,
    /// Long thin triangles, whose bounding boxes are mostly empty.
    Slivers,
    /// Surfaces that rays pass through: alpha masks and blending.
    AlphaCards,
    /// Rays that are refracted and reflected many times.
    Depth,
    /// Shadow rays to many lights.
    Lights,
}

impl Cause {
    /// All causes, in the order of suspicion.
    pub const ALL: [Self; 8] = [
        Self::HugeTriangles,
        Self::DenseCluster,
        Self::Structure,
        Self::Shells,
        Self::Slivers,
        Self::AlphaCards,
        Self::Depth,
        Self::Lights,
    ];

    /// Name in reports.
    pub const fn name(self) -> &'static str {
        match self {
            Self::HugeTriangles => "huge triangles",
            Self::DenseCluster => "dense cluster",
            Self::Structure => "structure",
            Self::Shells => "duplicate shells",
            Self::Slivers => "slivers",
            Self::AlphaCards => "alpha cards",
            Self::Depth => "depth of mirrors and glass",
            Self::Lights => "lights",
        }
    }

    /// Whether the picture is unchanged without the cause.
    pub const fn keeps_the_picture(self) -> bool {
        matches!(self, Self::HugeTriangles | Self::DenseCluster | Self::Structure | Self::Shells | Self::Slivers)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Work of rendering a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Rays traced.
    pub rays: u64,
    /// Ray/prim tests.
    pub tests: u64,
    /// Nodes and cells visited.
    pub steps: u64,
    /// Points transformed; the structure `transform` does so for each prim before its test.
    pub transforms: u64,
}

impl Work {
    fn of(counts: &RayCounts) -> Self {
        Self { rays: counts.queries, tests: counts.n_it, steps: counts.n_ts, transforms: counts.n_xf }
    }

    /// Cost: sum of tests, steps and transforms.
    pub fn cost(&self) -> u64 {
        self.tests + self.steps + self.transforms
    }

    fn join(self, other: Self) -> Self {
        Self {
            rays: self.rays + other.rays,
            tests: self.tests + other.tests,
            steps: self.steps + other.steps,
            transforms: self.transforms + other.transforms,
        }
    }
}

/// Work of a picture by ray class: primary, shadow, reflected, refracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bill(pub [Work; 4]);

impl Bill {
    /// Renders a case and counts its work.
    pub fn of(case: &Case) -> Self {
        let world = World::new(&case.scene);
        let accel = AnyAccel::build(case.accel, &world.shapes, &case.params);
        let textures = TextureStore::new(&case.scene);
        let (scene, view, settings) = (&case.scene, &case.view, &case.settings);
        let job = Job { scene, world: &world, accel: &accel, textures: &textures, view, settings };
        let ClassCounts { primary, shadow, reflected, refracted } = render_counted(&job, &()).counts;
        Self([primary, shadow, reflected, refracted].map(|class| Work::of(&class)))
    }

    /// Cost scaled to the given number of rays of each class.
    fn cost_of(&self, rays: &[u64; 4]) -> f64 {
        let cost = |(work, &rays): (&Work, &u64)| work.cost() as f64 * rays as f64 / work.rays.max(1) as f64;
        self.0.iter().zip(rays).map(cost).sum()
    }

    /// Work of all classes together.
    pub fn sum(&self) -> Work {
        self.0.iter().copied().fold(Work::default(), Work::join)
    }
}

/// Suspected cause, and the case without it.
#[derive(Clone, Debug)]
pub struct Suspect {
    /// Suspected cause.
    pub cause: Cause,
    /// Observation that raises the suspicion, with numbers.
    pub evidence: String,
    /// Flag or change of the mesh that gains the saving.
    pub remedy: String,
    /// Case without the cause.
    pub without: Case,
}

/// Counted cost of a suspected cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Suspected cause.
    pub cause: Cause,
    /// Observation that raises the suspicion, with numbers.
    pub evidence: String,
    /// Flag or change of the mesh that gains the saving.
    pub remedy: String,
    /// Work of the picture without the cause.
    pub without: Bill,
    /// Saved part of the counted cost; negative where it grows. If the picture is unchanged, costs are compared for equal numbers
    /// of rays of each class.
    pub saving: f64,
    /// Whether the picture is unchanged except for the random scattering of rough surfaces, which is drawn anew: part of the
    /// saving is then chance.
    pub is_drawn_anew: bool,
}

impl Finding {
    fn of(usual: &Bill, without: Bill, Suspect { cause, evidence, remedy, .. }: Suspect) -> Self {
        /// Up to one ray in this many differs where a position is rounded differently.
        const ROUNDED: u64 = 500;
        let rays = usual.0.map(|work| work.rays);
        let keeps = cause.keeps_the_picture();
        let cost = if keeps { without.cost_of(&rays) } else { without.sum().cost() as f64 };
        let saving = 1.0 - cost / usual.sum().cost().max(1) as f64;
        let others: u64 = rays.iter().zip(&without.0).map(|(rays, work)| rays.abs_diff(work.rays)).sum();
        let is_drawn_anew = keeps && others * ROUNDED > usual.sum().rays;
        Self { cause, evidence, remedy, without, saving, is_drawn_anew }
    }

    /// Whether the saving is large enough to matter and is not chance alone.
    pub fn is_worth_it(&self) -> bool {
        /// Largest change observed from rays that were merely drawn anew.
        const CHANCE: f64 = 0.1;
        self.saving >= if self.is_drawn_anew { CHANCE } else { WORTH }
    }
}

/// Least saving worth reporting.
pub const WORTH: f64 = 0.02;

/// All suspected causes in a case.
pub fn suspects(case: &Case) -> Vec<Suspect> {
    causes::suspects(case)
}

/// Returns the work of a case and the share of each suspected cause, greatest saving first; `None` when `go_on` returns false.
pub fn explain(case: &Case, mut go_on: impl FnMut(Cause) -> bool) -> Option<(Bill, Vec<Finding>)> {
    let usual = Bill::of(case);
    let mut findings = Vec::new();
    for suspect in suspects(case) {
        if !go_on(suspect.cause) {
            return None;
        }
        findings.push(Finding::of(&usual, Bill::of(&suspect.without), suspect));
    }
    findings.sort_by(|a, b| b.saving.total_cmp(&a.saving));
    Some((usual, findings))
}
