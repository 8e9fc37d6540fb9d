//! Pictures in tiles: the samples that tiles share, and those each traces for itself.

use super::sampling::{soft, stochastic};
use super::*;
use crate::accel::RayCounts;
use crate::render::context::Context;
use crate::render::fireflies::{Closely, look};
use crate::render::layers::empty;
use crate::render::tile::{Alone, Tile, render_some};
use crate::render::{Sampling, Stochastic};

/// A stage without randomly spread rays: nothing is traced beforehand.
fn sharp() -> Stage {
    let mut s = soft();
    (s.settings.lens, s.settings.gloss_rays) = (None, None);
    s
}

#[test]
fn tiles_that_share_first_samples_have_the_same_bits_whoever_traces_these() {
    for s in [sharp(), soft()] {
        have_the_same_bits(s);
    }
}

/// Tests it where all tiles must trace their first samples, and where these were traced before.
fn have_the_same_bits(mut s: Stage) {
    (s.settings.width, s.settings.height) = (130, 70);
    s.settings.sampling = Sampling::Stochastic(stochastic(0.08, 16));
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| s.render())
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        let many = with(threads);
        assert!(many.picture == one.picture && many.sampled == one.sampled, "{threads} threads");
        assert_eq!(many.counts, one.counts, "{threads} threads");
    }
}

#[test]
fn pixels_around_tiles_are_looked_at_only_where_that_can_decide_something() {
    let mut s = sharp();
    (s.settings.width, s.settings.height) = (40, 12);
    let mut rays = |min_samples| {
        s.settings.sampling = Sampling::Stochastic(Stochastic { min_samples, ..stochastic(0.1, 16) });
        let sampled = s.render().sampled;
        (sampled.rays - sampled.looked, sampled.counts.iter().map(|&n| u64::from(n)).sum::<u64>())
    };
    assert_eq!(rays(16), (40 * 12 * 16, 40 * 12 * 16));
    // The two tiles share a border of twelve pixels: each samples one row of the other's.
    let (all, kept) = rays(4);
    assert_eq!(all - kept, 2 * 12 * 4);
    // Tiles share the hits of their first rays, so that only pixels that go on are traced twice.
    let (all, kept) = rays(1);
    // If the first ones were traced twice, too, it would be 48 more.
    assert!((1..=2 * 12 * 3).contains(&(all - kept)), "{}", all - kept);
    // Samples known beforehand are not traced for any tile.
    let mut s = soft();
    (s.settings.width, s.settings.height) = (40, 12);
    s.settings.sampling = Sampling::Stochastic(stochastic(0.1, 16));
    let sampled = s.render().sampled;
    assert_eq!((sampled.rays - sampled.looked, sampled.samples()), (40 * 12 * 16, 16.0));
}

#[test]
fn a_tile_by_itself_is_what_it_is_among_others() {
    for (mut s, known) in [(sharp(), 0), (soft(), 16)] {
        is_the_same_by_itself(&mut s, known);
    }
}

/// Tests it where the first `known` samples of each pixel are traced before the picture.
fn is_the_same_by_itself(s: &mut Stage, known: u32) {
    (s.settings.width, s.settings.height, s.settings.layers) = (70, 40, true);
    for (min_samples, max_samples) in [(1, 64), (1, 2), (1, 1), (4, 16)] {
        s.settings.sampling = Sampling::Stochastic(Stochastic { min_samples, ..stochastic(0.08, max_samples) });
        let whole = s.render();
        let layers = whole.picture.layers.as_ref().expect("asked for");
        let tile = Tile { x0: 32, y0: 0, x1: 64, y1: 32 };
        let (pixels, rays) = s.with_job(AccelKind::None, |job| {
            let mut context = Context::new(job.scene, job.world, job.textures, job.settings);
            look::<RayCounts>(job, &mut context, Closely::All, &());
            assert_eq!(context.first_samples, known.min(max_samples));
            context.ahead = None;
            let (mut done, complete) =
                render_some::<_, RayCounts>(&context, job.accel, job.view, job.settings, &(), &[tile]);
            assert!(complete);
            let Alone { pixels, counts, .. } = done.remove(0);
            (pixels, counts.primary.queries)
        });
        assert_eq!(pixels.rays, rays);
        let own: u32 = pixels.facts.iter().map(|facts| facts.count).sum();
        assert_eq!(pixels.rays - pixels.rays_beyond - pixels.rays_around, u64::from(own));
        let mut alone = empty(70 * 40);
        for (k, (x, y)) in tile.places().enumerate() {
            let i = y as usize * 70 + x as usize;
            assert_eq!(pixels.beauty[k], whole.picture.beauty[i], "{x} {y} of {max_samples}");
            assert_eq!(pixels.facts[k].count, whole.sampled.counts[i], "{x} {y} of {max_samples}");
            assert_eq!(pixels.facts[k].error, whole.sampled.errors[i], "{x} {y} of {max_samples}");
            pixels.layers[k].store(&mut alone, i);
            assert_eq!((alone.depth[i], alone.prim[i]), (layers.depth[i], layers.prim[i]), "{x} {y} of {max_samples}");
            assert_eq!(alone.normal[i], layers.normal[i], "{x} {y} of {max_samples}");
        }
    }
}
