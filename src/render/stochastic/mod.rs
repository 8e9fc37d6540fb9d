//! Stochastic sampling of a tile: its pixels advance together in rounds, and only those that are not certain yet go into
//! the next.
//!
//! What decides about a pixel are its own samples, and in the first rounds those of the pixels beside it ([`around`]): a
//! pixel that happens to see nothing of what its neighbours see goes on with them. Pixels around the tile are therefore
//! sampled in these rounds too, by this tile for itself, since no tile may wait for another; that their rays are traced again
//! is counted.

mod around;
mod pixel;

use super::Settings;
use super::certainty::{Certainty, GROUPS, SURE, output};
use super::frame::Frame;
use super::observer::Observer;
use super::sampling::Stochastic;
use super::sobol;
use super::tile::{End, TOGETHER, Tile, TilePixels};
use super::whitted::Tracer;
use crate::accel::Accel;
use crate::scene::Background;
use around::Around;
use pixel::Pixel;
use std::ops::Range;

/// Samples at which variances are first relied on: one in each group.
const FIRST_LOOK: u32 = GROUPS as u32;

/// Renders one tile; `None` when cancelled.
pub(super) fn render<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    tile: Tile,
) -> Option<TilePixels> {
    let output = output(how.space, frame.background);
    let transparent = matches!(tracer.context.scene.background, None | Some(Background::Transparent));
    let judge = Certainty::new(output.as_ref(), frame.background, transparent, how.error, frame.standard_errors);
    let rounds: Vec<u32> = rounds(how, frame.settings).collect();
    let rings = rings(tile, frame.settings, &rounds);
    let mut pixels = pixels(&rings, frame.settings);
    let mut around = Around::new(rings[rings.len() - 1], &pixels);
    let mut active: Vec<usize> = (0..pixels.len()).collect();
    let (mut from, mut errors) = (0, Vec::new());
    for (round, &to) in rounds.iter().enumerate() {
        trace(frame, how, tracer, &mut pixels, &active, from..to)?;
        if round < looks(&rounds) {
            around.see(&judge, &pixels, &active);
            let mut news = if from > 0 { active.clone() } else { Vec::new() };
            while !news.is_empty() {
                news = around.reopen(&judge, &mut pixels[..rings[1].pixels()], &news, from);
                trace(frame, how, tracer, &mut pixels, &news, from..to)?;
                around.see(&judge, &pixels, &news);
                active.extend(&news);
            }
            // Of the outermost pixels nobody knows what lies beyond.
            let known = rings[rings.len().saturating_sub(round + 2)].pixels();
            active.retain(|&i| i < known);
            around.judge(&judge, &mut pixels, &active);
        }
        if to >= FIRST_LOOK {
            look(&judge, &mut pixels, &active, &mut errors);
        }
        active.retain(|&i| pixels[i].facts.end == End::Ceiling);
        from = to;
    }
    let rays = |pixels: &[Pixel]| pixels.iter().map(|pixel| u64::from(pixel.facts.count)).sum::<u64>();
    let rays_around = rays(&pixels[tile.pixels()..]);
    pixels.truncate(tile.pixels());
    let rays = rays(&pixels) + rays_around;
    let view = frame.view;
    Some(TilePixels {
        tile,
        beauty: pixels.iter().map(|pixel| pixel.sum().resolve(frame.background)).collect(),
        layers: pixels.iter().filter_map(|pixel| Some(pixel.layers.as_ref()?.pixel(view.eye, view.forward))).collect(),
        facts: pixels.iter().map(|pixel| pixel.facts).collect(),
        rays,
        rays_around,
    })
}

/// Samples of a pixel after each round: the fewest, but then at least [`SURE`], then twice as many from round to round,
/// powers of two throughout, as these many points of the sequence lie most evenly.
fn rounds(how: &Stochastic, settings: &Settings) -> impl Iterator<Item = u32> + use<> {
    let most = 1 << how.max_samples.max(1).ilog2();
    // In a single row or column there are not enough pixels beside one.
    let least = if settings.width.min(settings.height) < 2 { SURE } else { 1 };
    let fewest = how.min_samples.max(least).checked_next_power_of_two().unwrap_or(most).min(most);
    std::iter::successors(Some(fewest), move |&last| (last < most).then(|| (2 * last).max(SURE).min(most)))
}

/// After how many rounds the pixels beside each are looked at: after the first, and after that in which it gets [`SURE`]
/// samples.
fn looks(rounds: &[u32]) -> usize {
    if rounds[0] < SURE { 2 } else { 1 }
}

/// The tile, and around it what is sampled only to be looked at: a ring of pixels for each look that decides something, which
/// none does after the last round.
fn rings(tile: Tile, settings: &Settings, rounds: &[u32]) -> Vec<Tile> {
    let grown = |ring: &Tile| Some(ring.grown(settings.width, settings.height));
    std::iter::successors(Some(tile), grown).take(1 + looks(rounds).min(rounds.len() - 1)).collect()
}

/// Those of the tile in the order of its places, then those of each ring.
fn pixels(rings: &[Tile], settings: &Settings) -> Vec<Pixel> {
    let mut pixels = Vec::with_capacity(rings[rings.len() - 1].pixels());
    for (k, ring) in rings.iter().enumerate() {
        let is_new = |&at: &(u32, u32)| k == 0 || !rings[k - 1].contains(at);
        let new = ring.places().filter(is_new);
        // From inside the loops of places, which a `for` would leave and enter again for each.
        new.for_each(|at| pixels.push(Pixel::new(settings.seed, at, settings.layers)));
    }
    pixels
}

/// Traces these samples of all active pixels, in batches.
fn trace<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    pixels: &mut [Pixel],
    active: &[usize],
    samples: Range<u32>,
) -> Option<()> {
    if samples.start as usize >= GROUPS {
        active.iter().for_each(|&pixel| pixels[pixel].join_groups());
    }
    let in_group = (samples.end as usize).div_ceil(GROUPS);
    let mut places = Places::default();
    for some in active.chunks((TOGETHER / samples.len().max(1)).max(1)) {
        for start in samples.clone().step_by(TOGETHER) {
            let samples = start..samples.end.min(start + TOGETHER as u32);
            trace_batch(frame, how, tracer, (pixels, some), (samples, in_group), &mut places)?;
        }
    }
    Some(())
}

/// Where samples lie in their pixels; buffers.
#[derive(Default)]
struct Places {
    many: sobol::Many,
    squares: Vec<[f64; 2]>,
}

/// Traces the same samples of `some` pixels, of which so many go into each group, all together.
fn trace_batch<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Stochastic,
    tracer: &mut Tracer<A, P>,
    (pixels, some): (&mut [Pixel], &[usize]),
    (samples, in_group): (Range<u32>, usize),
    places: &mut Places,
) -> Option<()> {
    let each = samples.len();
    tracer.reset(some.len() * each, frame.settings.layers);
    let eye = frame.eye(tracer.center());
    let all = &*pixels;
    some.iter().for_each(|&pixel| tracer.streams.extend(samples.clone().map(|i| all[pixel].stream(i))));
    if frame.settings.lens.is_some() {
        let places = some.iter().flat_map(|&pixel| samples.clone().map(move |i| all[pixel].place_and_lens(how, i)));
        tracer.eyes.send(&eye, places);
    } else {
        let Places { many, squares } = places;
        squares.clear();
        many.find(some.iter().flat_map(|&pixel| samples.clone().map(move |i| (all[pixel].places, i))), squares);
        how.filter.place_each(squares.as_flattened_mut());
        let places = some.iter().zip(squares.chunks(each)).flat_map(|(&pixel, squares)| {
            let pixel = &all[pixel];
            squares.iter().map(move |&place| pixel.place(place, [0.5; 2]))
        });
        tracer.eyes.send(&eye, places);
    }
    if !tracer.trace() {
        return None;
    }
    for (k, &pixel) in some.iter().enumerate() {
        let (pixel, of_pixel) = (&mut pixels[pixel], k * each..(k + 1) * each);
        for (i, sample) in samples.clone().zip(&tracer.samples[of_pixel.clone()]) {
            pixel.groups[i as usize / in_group].add(sample);
        }
        pixel.facts.count += samples.end - samples.start;
        if let Some(layers) = &mut pixel.layers {
            tracer.facts.get(of_pixel).into_iter().flatten().for_each(|facts| layers.add(facts));
        }
    }
    Some(())
}

/// Finds out how certain the means of these pixels are.
fn look(judge: &Certainty, pixels: &mut [Pixel], active: &[usize], errors: &mut Vec<f32>) {
    errors.clear();
    judge.each_standard_error(active.iter().map(|&i| &pixels[i].groups[..]), |error| errors.push(error));
    for (&i, &error) in active.iter().zip(&*errors) {
        pixels[i].facts.error = error;
        pixels[i].look(judge);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_double_and_end_at_the_most() {
        let rounds_of = |min_samples, max_samples, height| {
            let settings = Settings { width: 16, height, ..Settings::default() };
            super::rounds(&Stochastic { min_samples, max_samples, ..Stochastic::default() }, &settings)
                .collect::<Vec<_>>()
        };
        let rounds = |min_samples, max_samples| rounds_of(min_samples, max_samples, 9);
        assert_eq!(rounds(1, 64), [1, 4, 8, 16, 32, 64]);
        assert_eq!(rounds(2, 8), [2, 4, 8]);
        assert_eq!(rounds(1, 2), [1, 2]);
        assert_eq!(rounds_of(1, 16, 1), [4, 8, 16], "of a single row");
        assert_eq!(rounds(4, 256), [4, 8, 16, 32, 64, 128, 256]);
        assert_eq!(rounds(4, 100), [4, 8, 16, 32, 64]);
        assert_eq!(rounds(30, 256), [32, 64, 128, 256]);
        assert_eq!(rounds(4, 4), [4]);
        assert_eq!(rounds(4, 3), [2]);
        assert_eq!(rounds(64, 16), [16]);
    }
}
