use super::*;
use crate::math::random::Random;
use crate::math::simd::LANES;
use crate::scene::{Bitmap, Texture};
use proptest::prelude::*;

/// A scene with one bitmap and one texture of it.
fn scene(width: u32, height: u32, sampler: Sampler, texel: impl Fn(u32, u32) -> [u8; 4]) -> Scene {
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
    let bitmap = Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels) };
    Scene { textures: vec![Texture { bitmap: 0, sampler }], bitmaps: vec![bitmap], ..Scene::default() }
}

fn grey(value: u8) -> [u8; 4] {
    [value, value, value, 255]
}

fn look(scene: &Scene, u: f32, v: f32, footprint: f32) -> f32 {
    let (dx, dy) = (Vec2::new(footprint, 0.0), Vec2::new(0.0, footprint));
    TextureStore::new(scene).sample(0, ColorSpace::Linear, Vec2::new(u, v), dx, dy).x
}

fn close(a: f32, b: f32) -> bool {
    (a - b).abs() < 1e-4
}

#[test]
fn a_texel_shows_its_own_value_at_its_centre() {
    let scene = scene(4, 2, Sampler::default(), |x, y| grey((x * 10 + y * 100) as u8));
    for (x, y) in [(0, 0), (3, 0), (1, 1)] {
        let (u, v) = ((x as f32 + 0.5) / 4.0, (y as f32 + 0.5) / 2.0);
        assert!(close(look(&scene, u, v, 0.0) * 255.0, (x * 10 + y * 100) as f32));
    }
}

#[test]
fn linear_is_halfway_between_two_centres_and_nearest_jumps_there() {
    let ramp = |x: u32, _: u32| grey(if x == 0 { 0 } else { 255 });
    let linear = scene(2, 1, Sampler { wrap_u: Wrap::Clamp, ..Sampler::default() }, ramp);
    assert!(close(look(&linear, 0.5, 0.5, 0.0), 0.5));
    let nearest = scene(2, 1, Sampler { magnify: Filter::Nearest, ..Sampler::default() }, ramp);
    assert_eq!((look(&nearest, 0.499, 0.5, 0.0), look(&nearest, 0.501, 0.5, 0.0)), (0.0, 1.0));
}

#[test]
fn beyond_the_border_each_wrap_shows_what_it_promises() {
    // Texels 0, 100, 200; results of each wrap mode one and a half texels beyond each border.
    let expected = [(Wrap::Repeat, [100.0, 100.0]), (Wrap::Mirror, [100.0, 100.0]), (Wrap::Clamp, [0.0, 200.0])];
    for (wrap, [left, right]) in expected {
        let sampler = Sampler { wrap_u: wrap, magnify: Filter::Nearest, ..Sampler::default() };
        let scene = scene(3, 1, sampler, |x, _| grey((x * 100) as u8));
        let at = |texels: f32| look(&scene, texels / 3.0, 0.5, 0.0) * 255.0;
        assert!(close(at(-1.5), left) && close(at(4.5), right), "{wrap:?}: {} {}", at(-1.5), at(4.5));
    }
    // Just outside the left border: repeat sees the last texel, mirror and clamp the first.
    for (wrap, value) in [(Wrap::Repeat, 200.0), (Wrap::Mirror, 0.0), (Wrap::Clamp, 0.0)] {
        let sampler = Sampler { wrap_u: wrap, magnify: Filter::Nearest, ..Sampler::default() };
        let scene = scene(3, 1, sampler, |x, _| grey((x * 100) as u8));
        assert!(close(look(&scene, -0.1, 0.5, 0.0) * 255.0, value), "{wrap:?}");
    }
}

#[test]
fn a_seam_blends_across_a_repeating_border_and_not_across_a_clamped_one() {
    let ends = |x: u32, _: u32| grey(if x == 0 { 255 } else { 0 });
    let at_border = |wrap| look(&scene(4, 1, Sampler { wrap_u: wrap, ..Sampler::default() }, ends), 0.0, 0.5, 0.0);
    assert!(close(at_border(Wrap::Repeat), 0.5));
    assert!(close(at_border(Wrap::Clamp), 1.0) && close(at_border(Wrap::Mirror), 1.0));
}

#[test]
fn a_large_footprint_sees_the_mean_and_none_asks_for_no_mean() {
    let checker = |x: u32, y: u32| grey(if (x + y).is_multiple_of(2) { 255 } else { 0 });
    let mipmapped = scene(16, 16, Sampler::default(), checker);
    for footprint in [0.25, 1.0, 40.0, f32::INFINITY, f32::NAN] {
        assert!(close(look(&mipmapped, 0.3, 0.7, footprint), 0.5), "{footprint}");
    }
    let sampler = Sampler { minify: Filter::Nearest, mipmaps: Mipmaps::None, ..Sampler::default() };
    let sharp = look(&scene(16, 16, sampler, checker), 0.3, 0.7, 0.25);
    assert!(sharp == 0.0 || sharp == 1.0);
}

#[test]
fn nearest_mipmap_takes_one_whole_level() {
    // Level 0 of columns 0 and 255 alternating is sharp, level 1 is their mean, and nothing lies between.
    let sampler = Sampler { mipmaps: Mipmaps::Nearest, minify: Filter::Nearest, ..Sampler::default() };
    let columns = scene(8, 8, sampler, |x, _| grey(if x % 2 == 0 { 255 } else { 0 }));
    assert_eq!(look(&columns, 1.2 / 8.0, 0.5, 1.3 / 8.0), 0.0);
    assert!(close(look(&columns, 1.2 / 8.0, 0.5, 1.5 / 8.0), 0.5));
}

#[test]
fn a_long_footprint_stays_sharp_across_its_short_axis() {
    // Rows alternate; the footprint is 8 texels long along the rows and less than one across them.
    let rows = scene(64, 64, Sampler::default(), |_, y| grey(if y % 2 == 0 { 255 } else { 0 }));
    let store = TextureStore::new(&rows);
    let centre = Vec2::new(0.5, 10.5 / 64.0);
    let (along, across) = (Vec2::new(8.0 / 64.0, 0.0), Vec2::new(0.0, 0.5 / 64.0));
    assert!(close(store.sample(0, ColorSpace::Linear, centre, along, across).x, 1.0));
    assert!(close(store.sample(0, ColorSpace::Linear, centre, across, along).x, 1.0));
    // The same footprint turned covers as many bright rows as dark ones.
    let turned = store.sample(0, ColorSpace::Linear, centre, Vec2::new(0.0, 8.0 / 64.0), Vec2::new(0.5 / 64.0, 0.0));
    assert!((turned.x - 0.5).abs() < 0.05, "{turned}");
}

#[test]
fn what_is_missing_is_white() {
    let empty = Scene {
        textures: vec![
            Texture { bitmap: 0, sampler: Sampler::default() },
            Texture { bitmap: 7, sampler: Sampler::default() },
        ],
        bitmaps: vec![Bitmap { width: 4, height: 4, ..Bitmap::default() }],
        ..Scene::default()
    };
    let store = TextureStore::new(&empty);
    for texture in [0, 1, 9] {
        assert_eq!(store.sample(texture, ColorSpace::Srgb, Vec2::ZERO, Vec2::X, Vec2::Y), Vec4::ONE);
        assert_eq!(store.size(texture), Vec2::ONE);
    }
}

#[test]
fn all_threads_read_the_same_bits() {
    let scene = scene(33, 17, Sampler::default(), |x, y| [(x * 7) as u8, (y * 13) as u8, (x * y) as u8, (x + y) as u8]);
    let read = |store: &TextureStore| -> Vec<[u32; 4]> {
        let at = |i: u32| {
            let t = i as f32 * 0.37;
            let (dx, dy) = (Vec2::new(t * 0.01, 0.001 * t), Vec2::new(0.0, 0.02));
            store.sample(0, ColorSpace::Srgb, Vec2::new(t, 1.7 * t), dx, dy).to_array().map(f32::to_bits)
        };
        (0..200).map(at).collect()
    };
    let alone = read(&TextureStore::new(&scene));
    let shared = TextureStore::new(&scene);
    std::thread::scope(|threads| {
        let workers: Vec<_> = (0..4).map(|_| threads.spawn(|| read(&shared))).collect();
        for worker in workers {
            assert_eq!(worker.join().ok().as_ref(), Some(&alone));
        }
    });
}

fn any_float() -> impl Strategy<Value = f32> {
    prop_oneof![
        -3.0f32..3.0,
        any::<f32>(),
        Just(f32::NAN),
        Just(f32::INFINITY),
        Just(f32::MAX),
        Just(-f32::MAX),
        Just(-0.0f32),
        Just(1.0f32)
    ]
}

proptest! {
    #[test]
    fn every_lookup_lies_between_the_darkest_and_the_brightest_texel(
        (width, height) in (1u32..9, 1u32..9),
        (wraps, filters) in (0usize..9, 0usize..12),
        (u, v, a, b, c, d) in (any_float(), any_float(), any_float(), any_float(), any_float(), any_float()),
    ) {
        let wrap = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
        let filter = [Filter::Linear, Filter::Nearest];
        let sampler = Sampler {
            wrap_u: wrap[wraps % 3],
            wrap_v: wrap[wraps / 3],
            magnify: filter[filters % 2],
            minify: filter[filters / 2 % 2],
            mipmaps: [Mipmaps::None, Mipmaps::Nearest, Mipmaps::Linear][filters / 4],
        };
        let scene = scene(width, height, sampler, |x, y| grey(50 + ((x * 5 + y * 11) % 100) as u8));
        let store = TextureStore::new(&scene);
        let color = store.sample(0, ColorSpace::Linear, Vec2::new(u, v), Vec2::new(a, b), Vec2::new(c, d));
        prop_assert!(color.x >= 50.0 / 255.0 - 1e-4 && color.x <= 150.0 / 255.0 + 1e-4, "{color}");
    }
}

#[test]
fn texels_change_by_their_slope_however_far_apart_they_are_read() {
    // Four steps of 255 a texel, along u alone.
    let scene = scene(64, 64, Sampler::default(), |x, _| grey((x * 4) as u8));
    let store = TextureStore::new(&scene);
    let texel = 1.0 / 64.0;
    for (width, reach, texels) in [(1.0, 1.0, 1.0), (0.1, 1.0, 0.1), (0.1, 5.0, 0.5), (1.0, 8.0, 8.0), (4.0, 2.0, 8.0)]
    {
        let ways = [Vec2::new(width * texel, 0.0), Vec2::new(0.0, width * texel)];
        let [along, across] = store.changes(0, Vec2::splat(0.3), ways, reach);
        let expected = texels * 4.0 / 255.0;
        assert!((along.x - expected).abs() < 0.01 * expected, "{width} × {reach}: {} not {expected}", along.x);
        assert_eq!(across, Vec4::ZERO);
    }
    assert_eq!(store.changes(9, Vec2::ZERO, [Vec2::X, Vec2::Y], 1.0), [Vec4::ZERO; 2], "no texture");
    assert_eq!(store.changes(0, Vec2::ZERO, [Vec2::NAN, Vec2::ZERO], 1.0), [Vec4::ZERO; 2], "no footprint");
}

/// Typical coordinates, and some hostile ones.
fn odd(random: &mut Random, size: f32) -> f32 {
    match (random.unit() * 40.0) as u32 {
        0 => 0.0,
        1 => 1.0,
        2 => f32::NAN,
        3 => f32::INFINITY,
        4 => -3.0e38,
        5 => -f32::MIN_POSITIVE,
        _ => (random.unit() * 2.0 - 1.0) * size,
    }
}

#[test]
fn lookups_at_eight_points_have_the_bits_of_single_ones() {
    let mut random = Random::new(7);
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let mipmaps = [Mipmaps::None, Mipmaps::Nearest, Mipmaps::Linear];
    let (mixed, nearest) = (Filter::Linear, Filter::Nearest);
    let filters = [(mixed, mixed), (mixed, nearest), (nearest, mixed), (nearest, nearest)];
    for (k, (width, height)) in [(1, 1), (1, 7), (3, 2), (16, 16), (61, 40), (128, 4)].into_iter().enumerate() {
        for i in 0..36 {
            let (wrap_u, wrap_v, mipmaps) = (wraps[i % 3], wraps[(i + k) % 3], mipmaps[i / 3 % 3]);
            let (magnify, minify) = filters[i / 9];
            let sampler = Sampler { magnify, minify, mipmaps, wrap_u, wrap_v };
            let seed = random.bits();
            let texel = |x: u32, y: u32| {
                (seed as u32 ^ x.wrapping_mul(0x9e37_79b9) ^ y.wrapping_mul(0x85eb_ca6b)).to_le_bytes()
            };
            let mut scene = scene(width, height, sampler, texel);
            if i % 2 == 0 {
                let Pixels::Rgba8(texels) = &scene.bitmaps[0].pixels else { unreachable!() };
                scene.bitmaps[0].pixels = Pixels::Rgb8(texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect());
            }
            let store = TextureStore::new(&scene);
            let layout = Layout::of(&store, 0).expect("small");
            for footprint in [0.001, 0.02, 0.3, 20.0] {
                let mut spots = Spots::default();
                let Spots { uv, along, across } = &mut spots;
                uv.as_flattened_mut().iter_mut().for_each(|c| *c = odd(&mut random, 4.0));
                let ways = along.as_flattened_mut().iter_mut().chain(across.as_flattened_mut());
                ways.for_each(|c| *c = odd(&mut random, footprint));
                compare(&store, &layout, &spots, 1.0 + random.unit());
            }
        }
    }
}

fn compare(store: &TextureStore, layout: &Layout, spots: &Spots, reach: f32) {
    let at = |row: &[[f32; LANES]; 2], i: usize| Vec2::new(row[0][i], row[1][i]);
    let bits = |texel: Vec4| texel.to_array().map(f32::to_bits);
    let mut places = Places::default();
    places.find(layout, spots);
    let found = changes(store, 0, layout, spots, reach, [true; LANES]);
    for space in [ColorSpace::Srgb, ColorSpace::Linear] {
        let mut texels = [Vec4::NAN; LANES];
        places.read(store, 0, space, &mut texels);
        for i in 0..LANES {
            let (uv, along, across) = (at(&spots.uv, i), at(&spots.along, i), at(&spots.across, i));
            let single = store.sample(0, space, uv, along, across);
            assert_eq!(bits(texels[i]), bits(single), "{uv} {along} {across} {layout:?}");
            let single = store.changes(0, uv, [along, across], reach);
            assert_eq!(found.map(|way| bits(way[i])), single.map(bits), "{uv} {along} {across} {layout:?}");
        }
    }
}

#[test]
fn what_is_not_there_is_left_to_single_lookups() {
    let plain = scene(4, 4, Sampler::default(), |_, _| grey(9));
    assert!(Layout::of(&TextureStore::new(&plain), 1).is_none() && Layout::of(&TextureStore::new(&plain), 0).is_some());
}

#[test]
fn what_is_the_same_everywhere_is_read_as_just_that_from_near_and_far() {
    let mut random = Random::new(3);
    for code in [1, 2, 64, 97, 128, 200, 254] {
        for (width, height) in [(64, 64), (37, 19)] {
            let scene = scene(width, height, Sampler::default(), |_, _| [9, 90, 200, code]);
            let store = TextureStore::new(&scene);
            for round in 0..300_u32 {
                let size = 2_f32.powi(-(round.cast_signed() % 12));
                let mut way = |size: f32| Vec2::new(random.unit() * size, random.unit() * size);
                let (uv, along, across) = (way(1.0), way(size), way(0.2 * size));
                let alpha = store.sample(0, ColorSpace::Linear, uv, along, across).w;
                // A cutoff of exactly that value keeps the texel.
                assert_eq!(alpha, f32::from(code) / 255.0, "{code} {width}×{height} {uv} {along} {across}");
            }
        }
    }
}

#[test]
fn alpha_has_the_same_bits_whether_or_not_the_other_numbers_are_colours() {
    let mut random = Random::new(8);
    let bytes: Vec<u8> = (0..64 * 64).map(|_| random.below(256) as u8).collect();
    for (width, height, solid) in [(64, 64, false), (64, 32, true), (37, 19, false), (5, 64, true)] {
        let scene = scene(width, height, Sampler::default(), |x, y| {
            let code = |k: u32| bytes[((x * 31 + y * 57 + k * 1009) % 4096) as usize];
            // A block of clear texels among others, too.
            let alpha = if solid && x > 2 {
                255
            } else if x < 8 && y < 8 {
                0
            } else {
                code(3)
            };
            [code(0), code(1), code(2), alpha]
        });
        let store = TextureStore::new(&scene);
        for _ in 0..500 {
            let [uv, along, across] = [1.0, 0.3, 0.1].map(|size| Vec2::new(random.unit() * size, random.unit() * size));
            let alpha = |space| store.sample(0, space, uv, along, across).w;
            let (color, data) = (alpha(ColorSpace::Srgb), alpha(ColorSpace::Linear));
            assert_eq!(color.to_bits(), data.to_bits(), "{width}×{height} {uv} {along} {across}");
        }
    }
}
