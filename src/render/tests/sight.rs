//! Eye rays, far eyes, layers, and cancelling.

use super::*;
use crate::render::{Progress, Sampling, Stochastic, render};
use std::sync::atomic::{AtomicUsize, Ordering};

fn bumpy() -> Stage {
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(2.0, 1.0, 5.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.5));
    s.settings = Settings { width: 40, height: 40, ..s.settings };
    s.square(-1.0, 1.5, material(Vec3::new(0.5, 0.6, 0.7), phong())).lamp(DVec3::new(3.0, 4.0, 5.0), 1.0);
    s.sphere(DVec3::ZERO, 0.7, material(Vec3::ONE, phong()));
    s
}

#[test]
fn an_eye_a_million_miles_away_sees_what_a_near_one_sees() {
    let mut s = bumpy();
    let dir = DVec3::new(2.0, 1.0, 5.0).normalize();
    let from = |s: &mut Stage, distance: f64| {
        s.view = View::look_at(dir * distance, DVec3::ZERO, DVec3::Y, Lens::orthographic(3.0));
        s.render().picture
    };
    let (near, far) = (from(&mut s, 6.0), from(&mut s, 1.5e9));
    let differ =
        near.beauty.iter().zip(&far.beauty).filter(|(a, b)| a.iter().zip(b.iter()).any(|(a, b)| (a - b).abs() > 1e-3));
    assert!(differ.count() <= 2, "no more than a pixel or two where an edge runs through a pixel's centre");
}

#[test]
fn layers_tell_where_and_what_was_seen() {
    let mut s = bumpy();
    s.settings.layers = true;
    s.view = View::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    let picture = s.render().picture;
    let layers = picture.layers.expect("layers were asked for");
    let (middle, corner) = (20 * 40 + 20, 0);
    // The sphere: prim 2 behind two triangles, instance 1 behind one mesh.
    assert_eq!((layers.prim[middle], layers.instance[middle]), (2, 1));
    assert_eq!((layers.prim[corner], layers.instance[corner]), (1, 0));
    assert_near(Vec3::from(layers.albedo[corner]), Vec3::new(0.5, 0.6, 0.7), 1e-6);
    let position = Vec3::from(layers.position[middle]);
    assert_near(position, Vec3::new(0.025, -0.025, (0.49f32 - 2.0 * 0.025 * 0.025).sqrt()), 1e-5);
    assert_near(Vec3::from(layers.normal[middle]), position / 0.7, 1e-5);
    assert!((layers.depth[middle] - (5.0 - position.z)).abs() < 1e-5);
    assert_eq!(layers.depth[corner], 6.0);
}

#[test]
fn layers_of_nothing_say_so() {
    let mut s = looking_down(1.0);
    s.settings.layers = true;
    let layers = s.render().picture.layers.expect("layers were asked for");
    assert_eq!((layers.prim[0], layers.instance[0], layers.depth[0]), (u32::MAX, u32::MAX, f32::INFINITY));
}

#[test]
fn a_cancelled_picture_says_that_it_is_not_complete() {
    struct After(usize, AtomicUsize);
    impl Progress for After {
        fn tiles(&self, done: usize, total: usize) {
            assert!(done <= total && total == 4);
            self.1.fetch_max(done, Ordering::Relaxed);
        }
        fn cancelled(&self) -> bool {
            self.1.load(Ordering::Relaxed) >= self.0
        }
    }
    let s = bumpy();
    let world = World::new(&s.scene);
    let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
    let textures = TextureStore::new(&s.scene);
    for sampling in [Sampling::Uniform, Sampling::Stochastic(Stochastic::default())] {
        let settings = Settings { width: 64, height: 64, sampling, ..s.settings.clone() };
        let (scene, world, accel, textures, view, settings) = (&s.scene, &world, &accel, &textures, &s.view, &settings);
        let job = Job { scene, world, accel, textures, view, settings };
        for threads in [1, 3] {
            let threads = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let after = |done| threads.install(|| render(&job, &After(done, AtomicUsize::new(0))));
            let (cut, whole) = (after(1), after(9));
            assert!(!cut.complete && whole.complete, "{sampling:?}");
            if threads.current_num_threads() == 1 {
                assert_eq!(cut.picture.beauty[..32], whole.picture.beauty[..32], "{sampling:?}");
                assert_eq!(cut.picture.beauty[64 * 64 - 1], [0.0; 4], "{sampling:?}");
            }
        }
    }
}
