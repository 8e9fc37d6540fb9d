//! Tests of the mailboxes by counts.

use std::collections::HashSet;

use super::*;
use crate::accel::grid::mailbox::{AnyMailbox, Mailbox};

/// Mailbox that records visits but answers as if it remembered nothing.
#[derive(Debug, Default)]
struct Recorder {
    prims: HashSet<u32>,
    visits: u64,
}

impl Mailbox for Recorder {
    fn new(_: MailboxKind, _prims: u32) -> Self {
        Self::default()
    }
    fn next_ray(&mut self) {
        *self = Self::default();
    }
    fn first_visit(&mut self, prim: u32) -> bool {
        self.prims.insert(prim);
        self.visits += 1;
        true
    }
}

fn counts<M: Mailbox>(grid: &GridOctree<M>, ray: &Ray, scratch: &mut <GridOctree<M> as Accel>::Scratch) -> RayCounts {
    let mut counts = RayCounts::default();
    grid.closest(&[*ray], &mut [Hit::MISS], scratch, &mut counts);
    counts
}

/// Long thin triangles across the scene, each in many cells.
fn slivers() -> Shapes {
    let mut r = Random::new(31);
    let mut vertices = Vec::new();
    for _ in 0..150 {
        let (from, to) = (r.cube(), r.cube());
        vertices.extend([from, to, to + r.cube() * 0.01]);
    }
    scenes::mesh(vertices, (0..150).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect())
}

#[test]
fn every_reference_seen_is_tested_or_skipped_and_the_exact_kind_tests_no_prim_twice() {
    let mut scenes = all();
    scenes.push(("slivers", slivers()));
    for (name, shapes) in scenes {
        if shapes.planes.is_empty() {
            for params in [GridParams { step_cost: 0.5, ..GridParams::DEFAULT }, GridParams::UNIFORM] {
                let exact = GridOctree::<AnyMailbox>::build(&shapes, &params);
                let hashed = exact.clone().with_mailbox(MailboxKind::Hashed);
                let recorder = GridOctree::<Recorder>::build(&shapes, &params);
                let (mut a, mut b, mut c) = (exact.scratch(), hashed.scratch(), recorder.scratch());
                for ray in &rays(&shapes, 8) {
                    let (exact, hashed) = (counts(&exact, ray, &mut a), counts(&hashed, ray, &mut b));
                    let all = counts(&recorder, ray, &mut c);
                    let recorded = &c.mailbox;
                    if all.n_ts > 0 {
                        assert_eq!((all.n_it, all.n_mb), (recorded.visits, 0), "{name}");
                        assert_eq!(exact.n_it, recorded.prims.len() as u64, "{name}: each prim once");
                    }
                    assert_eq!(exact.n_it + exact.n_mb, all.n_it, "{name}: the exact kind, {ray:?}");
                    assert_eq!(hashed.n_it + hashed.n_mb, all.n_it, "{name}: the hashed kind, {ray:?}");
                    assert!(exact.n_it <= hashed.n_it, "{name}");
                    assert_eq!((exact.n_ts, hashed.n_ts), (all.n_ts, all.n_ts), "{name}: the same way");
                }
            }
        }
    }
}

#[test]
fn where_prims_are_long_mailboxes_save_most_tests_and_the_small_one_nearly_as_many() {
    let shapes = slivers();
    let rays = rays(&shapes, 60);
    let count = |mailbox| {
        let accel = AnyAccel::build(AccelKind::Grid, &shapes, &AccelParams { mailbox, ..AccelParams::DEFAULT });
        let mut counts = RayCounts::default();
        accel.closest(&rays, &mut vec![Hit::MISS; rays.len()], &mut accel.scratch(), &mut counts);
        counts
    };
    let [none, exact, hashed] = MailboxKind::ALL.map(count);
    assert_eq!(none.n_mb, 0);
    assert!(exact.n_it * 4 < none.n_it * 3, "{exact:?}");
    assert!(exact.n_it < hashed.n_it && hashed.n_it * 10 < exact.n_it * 11, "{exact:?} {hashed:?}");
}

/// The test in the first cell counts for all cells of a prim: its hit in a later cell is kept, and stands unless another hit
/// precedes it.
#[test]
fn a_prim_in_many_cells_is_tested_in_the_first_and_hit_in_a_later_one() {
    // A wall that leans away from the ray, through all cells, and small triangles that make the grid fine.
    let mut vertices = vec![Vec3::new(-1.0, -1.0, 0.1), Vec3::new(9.0, -1.0, 0.1), Vec3::new(4.0, 1.0, -0.1)];
    for i in 0..40 {
        let at = Vec3::new(0.2 * i as f32, 0.9, 0.9);
        vertices.extend([at, at + Vec3::X * 0.01, at + Vec3::Y * 0.01]);
    }
    let shapes = scenes::mesh(vertices, (0..41).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect());
    let grid = GridOctree::<AnyMailbox>::build(&shapes, &GridParams { density: 64.0, ..GridParams::UNIFORM });
    let ray = [scenes::ray(Vec3::new(0.5, 0.0, 0.02), Vec3::new(1.0, 0.0, -0.004))];
    let (mut hit, mut counts) = ([Hit::MISS], RayCounts::default());
    grid.closest(&ray, &mut hit, &mut grid.scratch(), &mut counts);
    assert_eq!((hit[0].prim, counts.n_it), (0, 1));
    assert!(hit[0].t > 4.0 && counts.n_mb >= 5 && counts.n_mb == counts.n_ets - counts.n_eets - 1, "{counts:?}");
}
