//! The recorded ray tree of a sample.

use super::bits::busy;
use super::*;
use crate::accel::RayCounts;
use crate::accel::probe::Outcome;
use crate::render::ray_tree::{Class, Event, Query, RayTree, tell};
use crate::render::{Question, render_counted};

fn ray_tree(stage: &Stage, kind: AccelKind, pixel: (u32, u32), sample: u32) -> RayTree {
    stage.with_job(kind, |job| tell(job, pixel, sample)).expect("there is such a pixel")
}

/// All results that do not depend on the structure.
fn answers(ray_tree: &RayTree) -> Vec<impl PartialEq + std::fmt::Debug + use<>> {
    let hit = |q: &Query| if q.question == Question::Occluded { [0; 2] } else { [q.hit.t.to_bits(), q.hit.prim] };
    let of = |q: &Query| (q.class, q.question, hit(q), q.hit.is_some(), q.children.clone());
    ray_tree.queries.iter().map(of).collect()
}

#[test]
fn every_structure_tells_as_many_steps_and_tests_as_it_counts_and_the_same_tree() {
    let s = busy();
    for pixel in [(35, 25), (20, 27), (48, 24), (3, 3)] {
        let truth = answers(&ray_tree(&s, AccelKind::None, pixel, 1));
        for kind in AccelKind::ALL {
            let told = ray_tree(&s, kind, pixel, 1);
            assert_eq!(answers(&told), truth, "{kind} at {pixel:?}");
            for query in &told.queries {
                let count = |of: fn(&Event) -> u64| query.events.iter().map(of).sum::<u64>();
                let c = &query.counts;
                assert_eq!(count(|e| u64::from(matches!(e, Event::Visit(_)))), c.n_ts, "{kind}");
                assert_eq!(count(|e| u64::from(matches!(e, Event::Test(_)))), c.n_it, "{kind}");
                assert_eq!(count(|e| u64::from(matches!(e, Event::Skipped(_)))), c.n_mb, "{kind}");
                let empty = count(|e| u64::from(matches!(e, Event::Visit(v) if v.listed == Some(0))));
                assert_eq!(empty, c.n_eets, "{kind}");
                let sum = |e: &Event| match e {
                    Event::Volumes(n) => *n as u64,
                    _ => 0,
                };
                assert_eq!(count(sum), c.n_bit, "{kind}");
            }
        }
    }
}

#[test]
fn ray_trees_of_all_pixels_add_up_to_the_counts_of_the_picture() {
    let mut s = busy();
    s.settings = Settings { width: 14, height: 10, samples: 2, ..s.settings };
    let counted = s.with_job(AccelKind::GridOctree, |job| render_counted(job, &())).counts;
    let mut sums = [RayCounts::default(); 4];
    for (x, y) in (0..10).flat_map(|y| (0..14).map(move |x| (x, y))) {
        for sample in 0..2 {
            let told = ray_tree(&s, AccelKind::GridOctree, (x, y), sample);
            told.queries.iter().for_each(|q| sums[q.class as usize] += q.counts);
            let children: usize = told.queries.iter().map(|q| q.children.len()).sum();
            assert_eq!(children + 1, told.queries.len(), "every ray but the eye's has a parent");
            assert!(told.queries.iter().enumerate().all(|(i, q)| q.children.iter().all(|&child| child > i)));
        }
    }
    assert_eq!(sums, [counted.primary, counted.shadow, counted.reflected, counted.refracted]);
}

#[test]
fn a_told_ray_is_the_one_of_the_picture() {
    let s = busy();
    let picture = s.render_by(AccelKind::FastOctree).picture;
    for (x, y) in [(35, 25), (20, 27), (48, 24), (60, 5)] {
        let told: Vec<RayTree> = (0..3).map(|i| ray_tree(&s, AccelKind::FastOctree, (x, y), i)).collect();
        let mean = told.iter().map(|t| t.radiance).sum::<Vec3>() / 3.0;
        let pixel = Vec3::from_slice(&picture.beauty[(y * 70 + x) as usize]);
        assert_near(mean, pixel, 1e-5);
        let first = told.iter().find_map(|t| t.queries[0].hit.is_some().then_some(t.queries[0].hit.prim));
        let layers = picture.layers.as_ref().expect("layers were asked for");
        assert_eq!(layers.prim[(y * 70 + x) as usize], first.unwrap_or(u32::MAX));
    }
}

#[test]
fn the_hit_is_told_as_the_last_test_that_was_nearer() {
    let s = busy();
    for kind in AccelKind::ALL {
        let told = ray_tree(&s, kind, (35, 25), 0);
        let eye = &told.queries[0];
        let mut tests = eye.events.iter().filter_map(|e| if let Event::Test(t) = e { Some(t) } else { None });
        let last = tests.rfind(|t| t.outcome == Outcome::Hit).expect("a hit");
        assert_eq!((last.prim, last.t.to_bits()), (eye.hit.prim, eye.hit.t.to_bits()), "{kind}");
        for event in &eye.events {
            if let Event::Visit(visit) = event {
                let bounds = visit.extent.bounds();
                let dir = eye.ray.dir.as_dvec3();
                assert!(bounds.span(eye.ray.origin, dir.recip(), -0.1, 1e9).is_some(), "{kind}: {visit:?} is beside");
            }
        }
    }
}

#[test]
fn a_shadow_ray_knows_its_light_and_what_is_in_its_way() {
    let mut s = looking_down(5.0);
    s.square(0.0, 9.0, material(Vec3::ONE, phong()));
    s.square(2.0, 0.5, material(Vec3::ONE, phong()));
    s.scene.instances[1].world_from_object = DAffine3::from_translation(DVec3::X * 3.0);
    s.lamp(DVec3::new(6.0, 0.0, 4.0), 1.0).lamp(DVec3::new(-6.0, 0.0, 4.0), 1.0);
    let told = ray_tree(&s, AccelKind::Bvh, (0, 0), 0);
    let shadows: Vec<_> = told.queries[1..].iter().map(|q| (q.class, q.light, q.hit.is_some())).collect();
    assert_eq!(shadows, [(Class::Shadow, Some(0), true), (Class::Shadow, Some(1), false)]);
    assert_eq!(told.queries[1].hit.prim / 2, 1, "a triangle of the second square");
    assert_eq!(told.queries[0].children, [1, 2]);
}

#[test]
fn a_pixel_or_sample_that_is_not_there_has_no_ray_tree() {
    let s = busy();
    for (pixel, sample) in [((70, 0), 0), ((0, 50), 0), ((0, 0), 3)] {
        assert!(s.with_job(AccelKind::None, |job| tell(job, pixel, sample)).is_none());
    }
}
