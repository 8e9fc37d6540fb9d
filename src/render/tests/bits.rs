//! The same bits, whoever computes them.

use super::*;
use crate::scene::{AlphaMode, Environment, MetalRough};

/// A bit of everything: mirrors, glass, blending, textures aside.
pub(super) fn busy() -> Stage {
    let mut s = stage(View::look_at(DVec3::new(1.0, 2.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.8)));
    s.settings = Settings { width: 70, height: 50, samples: 3, cutoff: 1.0 / 512.0, layers: true, ..s.settings };
    let pbr = |m: MetalRough| Material { surface: Reflection::MetalRough(m), ..Material::plain() };
    s.square(-2.0, 3.0, Material::plain());
    s.mesh(
        square(0.0, 1.5),
        DAffine3::from_rotation_x(-1.2) * DAffine3::from_translation(DVec3::Z * -1.0),
        pbr(MetalRough { roughness: 0.2, ..MetalRough::default() }),
    );
    let glass = Phong { transmission: Vec3::new(0.9, 0.8, 0.7), mirror: Vec3::ONE, ior: 1.5, fresnel: true, ..phong() };
    s.sphere(DVec3::new(-0.8, 0.3, 0.4), 0.6, material(Vec3::splat(0.1), glass));
    s.sphere(DVec3::new(0.8, 0.3, 0.2), 0.5, material(Vec3::X, Phong { mirror: Vec3::splat(0.5), ..phong() }));
    s.square(1.0, 0.7, Material { opacity: 0.3, alpha_mode: AlphaMode::Blend, ..Material::plain() });
    s.lamp(DVec3::new(3.0, 4.0, 5.0), 0.7).lamp(DVec3::new(-4.0, 3.0, 2.0), 0.4);
    s.scene.environment = Environment::Studio;
    s
}

#[test]
fn every_number_of_threads_gives_the_same_bits() {
    let s = busy();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| s.render())
    };
    let one = with(1);
    assert!(one.complete && one.picture.beauty.iter().flatten().all(|v| v.is_finite()));
    for threads in [2, 7] {
        let many = with(threads);
        assert!(many.picture == one.picture, "{threads} threads differ from one");
        assert_eq!(many.counts, one.counts);
    }
}

#[test]
fn every_structure_gives_the_same_bits() {
    let s = busy();
    let truth = s.render_by(AccelKind::None);
    for kind in AccelKind::ALL {
        let by = s.render_by(kind);
        assert!(by.picture == truth.picture, "{kind} differs from brute force");
        let queries = |r: &Rendered| {
            [r.counts.primary, r.counts.shadow, r.counts.reflected, r.counts.refracted].map(|c| (c.queries, c.found))
        };
        assert_eq!(queries(&by), queries(&truth));
    }
}

#[test]
fn counting_changes_no_bit() {
    let s = busy();
    let (timed, counted) =
        s.with_job(AccelKind::None, |job| (crate::render::render(job, &()), render_counted(job, &())));
    assert!(timed.picture == counted.picture);
    assert_eq!(timed.counts, Default::default());
    assert_eq!(counted.counts.primary.queries, 70 * 50 * 3);
}
