//! Why a mesh costs what it costs: each cause that can be suspected is taken away, and what that saves is counted.
//!
//! A small picture is rendered as it is and once more without each suspected cause. Cost is the sum of ray/prim tests, of
//! nodes and cells visited, and of points transformed, of all rays: it depends on neither the machine nor the number of threads.

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
    /// With its lights.
    pub scene: Scene,
    /// Seen from here.
    pub view: View,
    /// Few pixels will do.
    pub settings: Settings,
    /// The structure.
    pub accel: AccelKind,
    /// Its parameters.
    pub params: AccelParams,
}

/// What can make a picture cost more than it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cause {
    /// A few huge triangles that lie in many cells or boxes.
    HugeTriangles,
    /// Most prims lie in a small part of the space that the structure divides.
    DenseCluster,
    /// Another structure has less to do.
    Structure,
    /// Triangles that stand on the same corners as others.
    Shells,
    /// Long thin triangles, whose boxes are mostly empty.
    Slivers,
    /// Surfaces that rays go on behind: alpha masks and blending.
    AlphaCards,
    /// Rays that are bent and mirrored many times.
    Depth,
    /// Shadow rays to many lights.
    Lights,
}

impl Cause {
    /// All of them.
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

    /// As printed.
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

    /// Whether the picture stays what it is without the cause.
    pub const fn keeps_the_picture(self) -> bool {
        matches!(self, Self::HugeTriangles | Self::DenseCluster | Self::Structure | Self::Shells | Self::Slivers)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// What rendering a picture took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Rays asked.
    pub rays: u64,
    /// Ray/prim tests.
    pub tests: u64,
    /// Nodes and cells visited.
    pub steps: u64,
    /// Points transformed, which is what `transform` does for each prim before it tests it.
    pub transforms: u64,
}

impl Work {
    fn of(counts: &RayCounts) -> Self {
        Self { rays: counts.queries, tests: counts.n_it, steps: counts.n_ts, transforms: counts.n_xf }
    }

    /// Tests, steps and transforms together.
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

/// The work of a picture, by ray class: primary, shadow, reflected, refracted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bill(pub [Work; 4]);

impl Bill {
    /// Renders a case and counts.
    pub fn of(case: &Case) -> Self {
        let world = World::new(&case.scene);
        let accel = AnyAccel::build(case.accel, &world.shapes, &case.params);
        let textures = TextureStore::new(&case.scene);
        let (scene, view, settings) = (&case.scene, &case.view, &case.settings);
        let job = Job { scene, world: &world, accel: &accel, textures: &textures, view, settings };
        let ClassCounts { primary, shadow, reflected, refracted } = render_counted(&job, &()).counts;
        Self([primary, shadow, reflected, refracted].map(|class| Work::of(&class)))
    }

    /// The cost of so many rays of each class.
    fn cost_of(&self, rays: &[u64; 4]) -> f64 {
        let cost = |(work, &rays): (&Work, &u64)| work.cost() as f64 * rays as f64 / work.rays.max(1) as f64;
        self.0.iter().zip(rays).map(cost).sum()
    }

    /// Of all classes.
    pub fn sum(&self) -> Work {
        self.0.iter().copied().fold(Work::default(), Work::join)
    }
}

/// A suspected cause, and the case without it.
#[derive(Clone, Debug)]
pub struct Suspect {
    /// Which.
    pub cause: Cause,
    /// What was seen, with numbers.
    pub evidence: String,
    /// The flag or the change of the mesh that gets the saving.
    pub remedy: String,
    /// The same picture without it.
    pub without: Case,
}

/// What a cause costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Which.
    pub cause: Cause,
    /// What was seen, with numbers.
    pub evidence: String,
    /// The flag or the change of the mesh that gets the saving.
    pub remedy: String,
    /// What the picture takes without it.
    pub without: Bill,
    /// The part of the cost that is saved, counted; negative where it grows. Where the picture stays what it is, of as many rays
    /// of each class.
    pub saving: f64,
    /// Whether the picture stays what it is but for what rough surfaces scatter, which is drawn anew: some of the saving is
    /// chance then.
    pub is_drawn_anew: bool,
}

impl Finding {
    fn of(usual: &Bill, without: Bill, Suspect { cause, evidence, remedy, .. }: Suspect) -> Self {
        /// One ray of so many is another where a place is rounded in another way.
        const ROUNDED: u64 = 500;
        let rays = usual.0.map(|work| work.rays);
        let keeps = cause.keeps_the_picture();
        let cost = if keeps { without.cost_of(&rays) } else { without.sum().cost() as f64 };
        let saving = 1.0 - cost / usual.sum().cost().max(1) as f64;
        let others: u64 = rays.iter().zip(&without.0).map(|(rays, work)| rays.abs_diff(work.rays)).sum();
        let is_drawn_anew = keeps && others * ROUNDED > usual.sum().rays;
        Self { cause, evidence, remedy, without, saving, is_drawn_anew }
    }

    /// Whether so much is saved that it matters, and is not chance alone.
    pub fn is_worth_it(&self) -> bool {
        /// What rays that are drawn anew have been seen to change.
        const CHANCE: f64 = 0.1;
        self.saving >= if self.is_drawn_anew { CHANCE } else { WORTH }
    }
}

/// The least saving that is told.
pub const WORTH: f64 = 0.02;

/// Everything that can be suspected in a case.
pub fn suspects(case: &Case) -> Vec<Suspect> {
    causes::suspects(case)
}

/// The cost of a case, and what each suspected cause has in it, the greatest saving first.
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
