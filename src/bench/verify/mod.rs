//! Verifies how far a mesh's hits can be trusted: every ray/triangle test through every structure, judged by exact arithmetic.
//!
//! The mesh is taken unchanged, scaled, and moved far from the origin in two ways ([`variation`]). For each variation, rays are
//! aimed at hard targets ([`aim`](crate::bench::aim)), the oracle computes the exact hits ([`oracle`](crate::bench::oracle)), and
//! the answers are tallied against them ([`tally`]).

pub mod kernels;
pub mod spawned;
pub mod tally;
pub mod variation;

use rayon::prelude::*;

use self::spawned::{Spawned, spawned};
use self::tally::Tally;
use self::variation::{Variation, Variations};
use super::aim::{Aim, Aimer};
use super::clock::{Spread, timed};
use super::oracle::{Oracle, Truth};
use crate::accel::{Accel, AccelKind, AccelParams, AnyAccel, Hit, IntersectorKind, NoProbe, Ray};
use crate::scene::Scene;

/// Settings of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Rays per [`Aim`] and variation, at least 1; fewer where rounding collapsed much of the mesh.
    pub rays: usize,
    /// Seed of the rays.
    pub seed: u64,
    /// Ray/triangle tests per row that structures without culling may take; their number of rays follows from that.
    pub brute_tests: usize,
}

impl Plan {
    /// Takes some seconds for a mesh of a hundred thousand triangles.
    pub const DEFAULT: Self = Self { rays: 2000, seed: 0, brute_tests: 10_000_000 };
}

/// Results of one intersector through one structure over one variation.
#[derive(Clone, Debug)]
pub struct Row {
    /// Ray/triangle test.
    pub test: IntersectorKind,
    /// Structure.
    pub accel: AccelKind,
    /// Results per [`Aim`], in the order of [`Aim::ALL`].
    pub tallies: Vec<Tally>,
}

impl Row {
    /// Sum over all aims.
    pub fn total(&self) -> Tally {
        self.tallies.iter().fold(Tally::default(), |sum, t| sum + *t)
    }
}

/// Results of one variation.
#[derive(Clone, Debug)]
pub struct Section {
    /// Transformation of the mesh.
    pub variation: &'static str,
    /// Amount of the transformation.
    pub amount: f64,
    /// Whether the frame is centred, as that of rendered scenes is.
    pub centred: bool,
    /// Triangles of whose three different corners rounding made some coincide.
    pub collapsed: usize,
    /// Rows by intersector, then by structure.
    pub rows: Vec<Row>,
    /// Rays of the exact test for which two structures gave different bits.
    pub disagreements: usize,
    /// Results of secondary rays with the exact test.
    pub spawned: Spawned,
}

/// Measured time of a ray/triangle test.
#[derive(Clone, Debug)]
pub struct TestTime {
    /// Ray/triangle test.
    pub test: IntersectorKind,
    /// Seconds per ray in the default structure on one thread, from [`PASSES`] passes over the rays of the unchanged mesh.
    pub per_ray: Spread,
}

/// Results of a verification.
#[derive(Clone, Debug)]
pub struct Findings {
    /// Number of triangles of the mesh; other prims are not verified.
    pub triangles: usize,
    /// Number of spheres, cones, polygons and planes, which are left out.
    pub others: usize,
    /// One section per variation, the unchanged mesh first.
    pub sections: Vec<Section>,
    /// Times of each intersector.
    pub costs: Vec<TestTime>,
}

/// Number of timed passes per test.
pub const PASSES: usize = 5;

impl Findings {
    /// Results of a test through the default structure, over all variations.
    pub fn total(&self, test: IntersectorKind) -> Tally {
        let rows = self.sections.iter().flat_map(|s| &s.rows);
        let rows = rows.filter(|r| r.test == test && r.accel == AccelKind::DEFAULT);
        rows.fold(Tally::default(), |sum, r| sum + r.total())
    }

    /// Whether the exact test made no error in any structure, and no secondary ray started on the wrong side of a face. Starts
    /// count only where the frame is centred: elsewhere a mesh may be smaller than their rounding error.
    pub fn trusted(&self) -> bool {
        self.sections.iter().all(|s| {
            let exact = s.rows.iter().filter(|r| r.test == IntersectorKind::Exact);
            let shadows = (s.spawned.leaks, s.spawned.false_shadows) == (0, 0);
            let starts = !s.centred || (s.spawned.self_hits, s.spawned.slips) == (0, 0);
            s.disagreements == 0 && shadows && starts && exact.map(Row::total).all(|t| t.is_clean())
        })
    }
}

/// Verifies a scene. `go_on` is called with variation index and count; `None` when it returns false, or without triangles.
pub fn verify(scene: &Scene, plan: &Plan, mut go_on: impl FnMut(usize, usize) -> bool) -> Option<Findings> {
    let variations = Variations::new(scene);
    let original = variations.get(0);
    let triangles = original.shapes.triangles.len();
    let mut findings = Findings { triangles, others: original.others, sections: Vec::new(), costs: Vec::new() };
    Aimer::new(&original.shapes, plan.seed)?;
    for i in 0..Variations::COUNT {
        if !go_on(i, Variations::COUNT) {
            return None;
        }
        findings.sections.push(section(&variations.get(i), plan)?);
    }
    findings.costs = costs(&original, plan)?;
    Some(findings)
}

fn section(variation: &Variation, plan: &Plan) -> Option<Section> {
    let shapes = &variation.shapes;
    let mut aimer = Aimer::new(shapes, plan.seed)?;
    let oracle = Oracle::new(shapes);
    // The rest of a collapsed mesh is concentrated in few places, where every ray hits thousands of triangles.
    let left = shapes.triangles.len().saturating_sub(variation.collapsed);
    let count = (plan.rays * left / shapes.triangles.len().max(1)).clamp(plan.rays.min(10), plan.rays);
    let sets: Vec<Vec<Ray>> = Aim::ALL.iter().map(|&aim| aimer.rays(aim, count)).collect();
    let truths: Vec<Vec<Option<Truth>>> =
        sets.iter().map(|rays| rays.par_iter().map(|ray| oracle.nearest(ray)).collect()).collect();

    let mut rows = Vec::new();
    let mut disagreements = 0;
    let structures = AccelKind::ALL.map(|kind| AnyAccel::build(kind, shapes, &AccelParams::DEFAULT));
    for test in IntersectorKind::ALL {
        let mut first: Vec<Vec<Hit>> = Vec::new();
        for accel in structures.iter().rev().filter(|a| is_judged(test, a.kind())) {
            let accel = accel.clone().tested_by(test);
            let affordable = match accel.kind() {
                kind if kind.is_slow() => (plan.brute_tests / shapes.triangles.len().max(1) / Aim::ALL.len()).max(1),
                _ => plan.rays,
            };
            let answers: Vec<Vec<Hit>> = sets.iter().map(|rays| hits(&accel, take(rays, affordable))).collect();
            let judge = |i: usize| Tally::of(&oracle, &sets[i], &truths[i], &answers[i]);
            let tallies = (0..sets.len()).map(judge).collect();
            rows.push(Row { test, accel: accel.kind(), tallies });
            if first.is_empty() {
                first = answers;
            } else if test == IntersectorKind::Exact {
                let pairs = first.iter().zip(&answers).flat_map(|(a, b)| a.iter().zip(b));
                disagreements += pairs.filter(|(a, b)| a.bits() != b.bits()).count();
            }
        }
    }
    let spawned = spawned(shapes, &structures, &oracle, &sets, plan.seed);
    let Variation { name, amount, centred, collapsed, .. } = *variation;
    Some(Section { variation: name, amount, centred, collapsed, rows, disagreements, spawned })
}

/// Whether a test is verified through a structure: the exact test is through all. The others are only through the default one and
/// without any, since they may answer differently through each of the many.
fn is_judged(test: IntersectorKind, kind: AccelKind) -> bool {
    test == IntersectorKind::Exact || matches!(kind, AccelKind::DEFAULT | AccelKind::None)
}

fn take(rays: &[Ray], count: usize) -> &[Ray] {
    &rays[..rays.len().min(count)]
}

/// First hits of rays, traced on all threads.
fn hits(accel: &AnyAccel, rays: &[Ray]) -> Vec<Hit> {
    let slice = |rays: &[Ray]| {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.closest(rays, &mut hits, &mut accel.scratch(), &mut NoProbe);
        hits
    };
    rays.par_chunks(256).flat_map_iter(slice).collect()
}

/// Times of all tests on the same rays on one thread, with interleaved passes.
fn costs(variation: &Variation, plan: &Plan) -> Option<Vec<TestTime>> {
    let shapes = &variation.shapes;
    let mut aimer = Aimer::new(shapes, plan.seed)?;
    let rays: Vec<Ray> = Aim::ALL.iter().flat_map(|&aim| aimer.rays(aim, plan.rays)).collect();
    let accel = AnyAccel::build(AccelKind::DEFAULT, shapes, &AccelParams::DEFAULT);
    let accels = IntersectorKind::ALL.map(|test| (test, accel.clone().tested_by(test)));
    let mut scratch = accel.scratch();
    let mut answers = vec![Hit::MISS; rays.len()];
    let mut times = vec![Spread::default(); accels.len()];
    for _ in 0..PASSES {
        for ((_, accel), times) in accels.iter().zip(&mut times) {
            let ((), seconds) = timed(|| accel.closest(&rays, &mut answers, &mut scratch, &mut NoProbe));
            times.push(seconds / rays.len().max(1) as f64);
        }
    }
    Some(accels.iter().zip(times).map(|((test, _), per_ray)| TestTime { test: *test, per_ray }).collect())
}
