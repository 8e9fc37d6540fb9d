//! Costs of single pixels.

use super::bits::busy;
use super::*;
use crate::accel::RayCounts;
use crate::render::{Cost, Costs, render_costs};

fn costs(stage: &Stage, kind: AccelKind, wanted: &[Cost]) -> Costs {
    stage.with_job(kind, |job| render_costs(job, wanted, &())).expect("nobody gives up")
}

#[test]
fn counts_of_pixels_add_up_to_those_of_the_picture_by_class() {
    let s = busy();
    for kind in [AccelKind::Grid, AccelKind::GridOctree, AccelKind::Bvh, AccelKind::FastOctree] {
        let rendered = s.render_by(kind);
        let pixels = costs(&s, kind, &Cost::ALL[..3]);
        for (i, cost) in Cost::ALL[..3].iter().copied().enumerate() {
            let c = rendered.counts;
            let count = |class: RayCounts| [class.n_it, class.n_ts, class.n_mb][i] as f64;
            let expected = [c.primary, c.shadow, c.reflected, c.refracted].map(count);
            let sums: Vec<f64> = pixels.channels(cost).map(|c| c.values.iter().sum()).collect();
            assert_eq!(sums, expected, "{kind}, {cost}");
            assert_eq!(pixels.total(cost).iter().sum::<f64>(), expected.iter().sum::<f64>());
        }
    }
}

#[test]
fn a_pixel_has_its_own_counts_whatever_else_is_in_the_picture() {
    // A square that covers a pixel in each of two rows, and half of its neighbour.
    let mut s = looking_down(5.0);
    s.settings = Settings { width: 8, height: 4, samples: 4, ..s.settings };
    s.mesh(square(0.0, 0.2), DAffine3::from_translation(DVec3::X * 0.6), unlit(Vec3::ONE));
    let pixels = costs(&s, AccelKind::Bvh, &[Cost::Tests]);
    let row = [0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 8.0, 0.0];
    assert_eq!(pixels.total(Cost::Tests), [[0.0; 8], row, row, [0.0; 8]].concat(), "two triangles, 2 or 4 samples");
}

#[test]
fn counts_do_not_depend_on_threads() {
    let s = busy();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| costs(&s, AccelKind::GridOctree, &[Cost::Tests, Cost::Mailbox]))
    };
    let one = with(1);
    assert!(one.total(Cost::Mailbox).iter().any(|&n| n > 0.0));
    assert_eq!([with(2), with(7)], [one.clone(), one]);
}

#[test]
fn times_are_told_by_class_and_for_shading() {
    let s = busy();
    let pixels = costs(&s, AccelKind::FastBvh, &[Cost::Ms]);
    let names: Vec<&str> = pixels.channels(Cost::Ms).map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["ms.primary", "ms.shadow", "ms.reflected", "ms.refracted", "ms.shading"]);
    assert!(pixels.channels(Cost::Ms).flat_map(|c| c.values.iter()).all(|ms| ms >= 0.0));
    assert!(pixels.total(Cost::Ms).iter().all(|&ms| ms > 0.0));
    assert!(pixels.total(Cost::Tests).is_empty(), "not asked for");
}

#[test]
fn who_gives_up_gets_no_costs() {
    struct GivesUp;
    impl crate::render::Progress for GivesUp {
        fn tiles(&self, _done: usize, _total: usize) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let s = busy();
    assert_eq!(s.with_job(AccelKind::Bvh, |job| render_costs(job, &[Cost::Tests], &GivesUp)), None);
}

#[test]
fn progress_runs_once_over_all_passes() {
    #[derive(Default)]
    struct Told(std::sync::Mutex<Vec<(usize, usize)>>);
    impl crate::render::Progress for Told {
        fn tiles(&self, done: usize, total: usize) {
            self.0.lock().expect("nobody panics").push((done, total));
        }
        fn cancelled(&self) -> bool {
            false
        }
    }
    let (s, told) = (busy(), Told::default());
    s.with_job(AccelKind::Bvh, |job| render_costs(job, &Cost::ALL, &told)).expect("nobody gives up");
    let mut told = told.0.into_inner().expect("nobody panics");
    told.sort_unstable();
    let total = told[0].1;
    assert!(total >= 4, "a tile at least in each of four passes");
    assert_eq!(told, (1..=total).map(|done| (done, total)).collect::<Vec<_>>());
}
