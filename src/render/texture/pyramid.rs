//! Mip levels of a bitmap (Williams, *Pyramidal Parametrics*, 1983), each built when a lookup first needs it.
//!
//! Each level is half the one before, rounded down, and each of its texels is the mean over exactly the area it covers: where a
//! side is odd, texels that straddle a border count with the fraction inside. Means are taken of linear values. Where alpha cuts
//! colours out it weights them, so that colours hidden under transparent texels do not bleed out.

use super::ColorSpace;
use super::decode::{self, FRACTION, Texels};
use crate::huge_pages::Paged;
use crate::math::Vec4;
use crate::math::simd::Simd;
use crate::scene::{Bitmap, Pixels};
use std::sync::OnceLock;

/// The levels above a bitmap, for one colour space. Level 0 is the bitmap itself and not stored here.
#[derive(Debug)]
pub(super) struct Pyramid {
    above: Vec<OnceLock<Level>>,
}

/// One mip level: linear RGBA, straight alpha, 16 bits a channel.
///
/// A step of 1/65535 is a twentieth of the darkest step of an 8-bit sRGB file.
#[derive(Debug)]
struct Level {
    texels: Paged<[u16; 4]>,
    /// Whether every alpha is 1.
    solid: bool,
}

impl Pyramid {
    /// A pyramid without any level built.
    pub(super) fn new(bitmap: &Bitmap) -> Self {
        let longest = bitmap.width.max(bitmap.height).max(1);
        Self { above: (0..longest.ilog2()).map(|_| OnceLock::new()).collect() }
    }

    /// Index of the highest level, a single texel; 0 for a bitmap of one texel.
    pub(super) fn top(&self) -> usize {
        self.above.len()
    }

    /// Level `level`, built if it is missing.
    #[inline]
    pub(super) fn plane<'a>(&'a self, bitmap: &'a Bitmap, space: ColorSpace, level: usize) -> Plane<'a> {
        let (width, height) = size(bitmap, level);
        let texels = match level {
            0 => Stored::Bitmap(Texels::new(bitmap, space)),
            _ => Stored::Level(&self.level(bitmap, space, level).texels),
        };
        Plane { width, height, texels }
    }

    /// Whether a level that exists is known to be opaque.
    fn is_solid(&self, bitmap: &Bitmap, level: usize) -> bool {
        match level {
            0 => matches!(bitmap.pixels, Pixels::Rgb8(_)),
            _ => self.above[level - 1].get().is_some_and(|level| level.solid),
        }
    }

    /// Level `level` > 0, built if it is missing.
    #[inline]
    fn level(&self, bitmap: &Bitmap, space: ColorSpace, level: usize) -> &Level {
        self.above[level - 1].get().unwrap_or_else(|| self.made(bitmap, space, level))
    }

    /// Builds a level, unless another thread is faster. It depends on the bitmap alone, so it does not matter which one does.
    #[cold]
    #[inline(never)]
    fn made(&self, bitmap: &Bitmap, space: ColorSpace, level: usize) -> &Level {
        self.above[level - 1].get_or_init(|| {
            let (from, to) = (self.plane(bitmap, space, level - 1), size(bitmap, level));
            let solid = self.is_solid(bitmap, level - 1);
            let texels = match from.texels {
                _ if !from.is_twice(to) => halve(&from, to, space),
                Stored::Bitmap(Texels::Rgb8(texels, _)) if space == ColorSpace::Linear => {
                    halve_numbers(texels, from.width)
                }
                Stored::Bitmap(Texels::Rgb8(texels, _)) => {
                    let light = decode::fixed8(space);
                    halve_evenly(texels, from.width, |block| mean_solid8(block, light))
                }
                Stored::Bitmap(Texels::Rgba8(texels, colors)) => {
                    let light = decode::fixed8(space);
                    halve_evenly(texels, from.width, |block| mean8(block, colors, light, space))
                }
                Stored::Level(texels) if solid || space != ColorSpace::SrgbCutOut => {
                    halve_evenly(texels, from.width, mean_of_codes)
                }
                Stored::Level(texels) => halve_evenly(texels, from.width, |[a, b, c, d]| {
                    quantized(mean_of_four(unit(a), unit(b), unit(c), unit(d), space))
                }),
                Stored::Bitmap(_) => halve(&from, to, space),
            };
            let solid = solid || level == 1 && texels.iter().all(|texel| texel[3] == u16::MAX);
            Level { texels, solid }
        })
    }
}

/// One level, ready to be read.
#[derive(Clone, Copy)]
pub(super) struct Plane<'a> {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Stored<'a>,
}

#[derive(Clone, Copy)]
pub(super) enum Stored<'a> {
    Bitmap(Texels<'a>),
    Level(&'a [[u16; 4]]),
}

impl Plane<'_> {
    /// Linear RGBA of texel (`x`, `y`), which must lie inside.
    #[inline(always)]
    pub(super) fn texel(&self, x: usize, y: usize) -> Vec4 {
        self.at(y * self.width + x)
    }

    /// Linear RGBA of a texel by index, row by row.
    #[inline(always)]
    pub(super) fn at(&self, index: usize) -> Vec4 {
        match self.texels {
            Stored::Bitmap(texels) => texels.get(index),
            Stored::Level(texels) => unit(&texels[index]),
        }
    }

    /// Prefetches a texel; does nothing for rare formats.
    #[inline(always)]
    pub(super) fn prefetch<S: Simd>(&self, s: S, index: usize) {
        match self.texels {
            Stored::Level(texels) => s.prefetch(texels.get(index..=index).unwrap_or_default()),
            Stored::Bitmap(Texels::Rgb8(texels, _)) => s.prefetch(texels.get(index..=index).unwrap_or_default()),
            Stored::Bitmap(_) => {}
        }
    }

    fn is_twice(&self, to: (usize, usize)) -> bool {
        (self.width, self.height) == (2 * to.0, 2 * to.1)
    }
}

/// Columns and rows of a level.
#[inline]
pub(super) fn size(bitmap: &Bitmap, level: usize) -> (usize, usize) {
    ((bitmap.width as usize >> level).max(1), (bitmap.height as usize >> level).max(1))
}

#[inline(always)]
fn unit(texel: &[u16; 4]) -> Vec4 {
    codes(texel) / 65535.0
}

/// Stored codes, 0 … 65535.
#[inline(always)]
pub(super) fn codes(&[r, g, b, a]: &[u16; 4]) -> Vec4 {
    Vec4::new(f32::from(r), f32::from(g), f32::from(b), f32::from(a))
}

/// The next smaller level.
fn halve(from: &Plane, to: (usize, usize), space: ColorSpace) -> Paged<[u16; 4]> {
    let columns: Vec<Span> = (0..to.0).map(|x| Span::new(x, from.width, to.0)).collect();
    let mut texels = Paged::zeroed(to.0 * to.1);
    for (y, row) in texels.chunks_exact_mut(to.0).enumerate() {
        let rows = Span::new(y, from.height, to.1);
        for (texel, columns) in row.iter_mut().zip(&columns) {
            *texel = quantized(mean(columns, &rows, space, &|x, y| from.texel(x, y)));
        }
    }
    texels
}

/// Halves a level where each texel is the mean of exactly four, passed as upper left and right, lower left and right.
fn halve_evenly<T>(texels: &[T], width: usize, mean: impl Fn([&T; 4]) -> [u16; 4]) -> Paged<[u16; 4]> {
    let mut halves = Paged::zeroed(texels.len() / 4);
    for (row, rows) in halves.chunks_exact_mut(width / 2).zip(texels.chunks_exact(2 * width)) {
        let (upper, lower) = rows.split_at(width);
        let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
        row.iter_mut().zip(pairs).for_each(|(half, ([a, b], [c, d]))| *half = mean([a, b, c, d]));
    }
    halves
}

/// Halves data texels (not colours) without alpha: a row of sums of two, and then of four, with a texel in each word.
fn halve_numbers(texels: &[[u8; 3]], width: usize) -> Paged<[u16; 4]> {
    /// In each 16-bit lane of a word: 2, and a mask of all but the highest two bits.
    const TWO: u64 = 0x0002_0002_0002_0002;
    const LOW: u64 = 0x3fff_3fff_3fff_3fff;
    let mut halves = Paged::zeroed(texels.len() / 4);
    // One texel of padding: words have room for four values.
    let mut sums = vec![0_u16; 3 * width + 3];
    for (row, rows) in halves.chunks_exact_mut(width / 2).zip(texels.chunks_exact(2 * width)) {
        let (upper, lower) = rows.split_at(width);
        let pairs = upper.as_flattened().iter().zip(lower.as_flattened());
        sums.iter_mut().zip(pairs).for_each(|(sum, (&a, &b))| *sum = u16::from(a) + u16::from(b));
        let (firsts, seconds) = (sums.as_chunks::<6>().0, sums[3..].as_chunks::<6>().0);
        for ((half, &[a, b, c, d, ..]), &[e, f, g, h, ..]) in row.iter_mut().zip(firsts).zip(seconds) {
            let sum = word([a, b, c, d]) + word([e, f, g, h]);
            // A quarter of 257 times the sum, rounded.
            let mean = (sum << 6) + ((sum + TWO) >> 2 & LOW);
            *half = codes_of(mean | u64::from(u16::MAX) << 48);
        }
    }
    halves
}

/// Stored mean of four texels without alpha; `light` holds the colours as in [`decode::fixed8`].
#[inline(always)]
fn mean_solid8([a, b, c, d]: [&[u8; 3]; 4], light: &[u32; 256]) -> [u16; 4] {
    let light = |code: u8| light[usize::from(code)];
    let sum = |i: usize| rounded(light(a[i]) + light(b[i]) + light(c[i]) + light(d[i]));
    [sum(0), sum(1), sum(2), u16::MAX]
}

/// A quarter of a sum, from units of 2⁻¹² steps to steps.
#[expect(clippy::cast_possible_truncation, reason = "four times 65535 steps at most")]
#[inline(always)]
fn rounded(sum: u32) -> u16 {
    ((sum + (1 << (FRACTION + 1))) >> (FRACTION + 2)) as u16
}

/// Stored mean of four stored texels whose channels do not weight each other.
#[inline(always)]
fn mean_of_codes(four: [&[u16; 4]; 4]) -> [u16; 4] {
    /// Every other code of a word, with room for a sum of four, and 2 in each lane.
    const HALF: u64 = 0x0000_ffff_0000_ffff;
    const TWO: u64 = 0x0000_0002_0000_0002;
    let [a, b, c, d] = four.map(|&codes| word(codes));
    let sum = |shift: u32| (a >> shift & HALF) + (b >> shift & HALF) + (c >> shift & HALF) + (d >> shift & HALF);
    let mean = |shift: u32| (sum(shift) + TWO) >> 2 & HALF;
    codes_of(mean(0) | mean(16) << 16)
}

/// Packs four codes into a word, the first one lowest.
#[inline(always)]
fn word(codes: [u16; 4]) -> u64 {
    u64::from_le_bytes(bytemuck::cast(codes.map(u16::to_le)))
}

/// Unpacks the four codes of a word.
#[inline(always)]
fn codes_of(word: u64) -> [u16; 4] {
    bytemuck::cast::<_, [u16; 4]>(word.to_le_bytes()).map(u16::from_le)
}

/// [`mean`] of four texels of equal weight. No maps over arrays here: they are not always inlined, and this builds most texels.
#[inline(always)]
fn mean_of_four(a: Vec4, b: Vec4, c: Vec4, d: Vec4, space: ColorSpace) -> Vec4 {
    let (a, b, c, d) = (a * 0.25, b * 0.25, c * 0.25, d * 0.25);
    let plain = a + b + c + d;
    if is_plain(plain, space) {
        return plain;
    }
    let sum = a * (a.w * 4.0) + b * (b.w * 4.0) + c * (c.w * 4.0) + d * (d.w * 4.0);
    (sum / plain.w).truncate().extend(plain.w)
}

/// Stored mean of four 8-bit texels; `light` holds the colours as in [`decode::fixed8`]. Most pictures are opaque, and then it
/// takes only lookups and sums.
#[inline(always)]
fn mean8([a, b, c, d]: [&[u8; 4]; 4], colors: &[f32; 256], light: &[u32; 256], space: ColorSpace) -> [u16; 4] {
    if a[3] & b[3] & c[3] & d[3] < u8::MAX {
        let linear = |texel: &[u8; 4]| decode::decode8(*texel, colors);
        return quantized(mean_of_four(linear(a), linear(b), linear(c), linear(d), space));
    }
    let light = |code: u8| light[usize::from(code)];
    let sum = |i: usize| rounded(light(a[i]) + light(b[i]) + light(c[i]) + light(d[i]));
    [sum(0), sum(1), sum(2), u16::MAX]
}

/// Whether a mean needs no alpha weights: where everything is clear there are none, and where everything is opaque both means are
/// the same.
#[inline]
fn is_plain(mean: Vec4, space: ColorSpace) -> bool {
    space != ColorSpace::SrgbCutOut || mean.w <= 0.0 || mean.w >= 1.0
}

/// The texels of the finer level that one texel covers along one axis, with their weights.
struct Span {
    first: usize,
    count: usize,
    shares: [f32; 3],
}

impl Span {
    /// Texel `i` of `to` covers `i·from/to … (i+1)·from/to`, at most three texels as `from/to` is at most 3.
    #[expect(clippy::cast_precision_loss, reason = "texel counts are far below 2^24")]
    fn new(i: usize, from: usize, to: usize) -> Self {
        let (start, end) = (i * from, (i + 1) * from);
        let first = start / to;
        let count = end.div_ceil(to) - first;
        let mut shares = [0.0; 3];
        for (k, share) in shares.iter_mut().enumerate().take(count) {
            let covered = end.min((first + k + 1) * to) - start.max((first + k) * to);
            *share = covered as f32 / from as f32;
        }
        Self { first, count, shares }
    }
}

/// Mean of a block of texels.
fn mean(columns: &Span, rows: &Span, space: ColorSpace, texel: &impl Fn(usize, usize) -> Vec4) -> Vec4 {
    let (mut plain, mut weighted) = (Vec4::ZERO, Vec4::ZERO);
    for (j, row_share) in rows.shares.iter().enumerate().take(rows.count) {
        for (i, column_share) in columns.shares.iter().enumerate().take(columns.count) {
            let value = texel(columns.first + i, rows.first + j) * (row_share * column_share);
            let alpha = value.w / (row_share * column_share);
            plain += value;
            weighted += value * alpha;
        }
    }
    if is_plain(plain, space) {
        return plain;
    }
    (weighted / plain.w).truncate().extend(plain.w)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 0…65535")]
#[inline(always)]
fn quantized(v: Vec4) -> [u16; 4] {
    let scaled = v.clamp(Vec4::ZERO, Vec4::ONE) * 65535.0 + 0.5;
    [scaled.x as u16, scaled.y as u16, scaled.z as u16, scaled.w as u16]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bitmap(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Bitmap {
        let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
        Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels) }
    }

    fn top_of(bitmap: &Bitmap, space: ColorSpace) -> Vec4 {
        let pyramid = Pyramid::new(bitmap);
        pyramid.plane(bitmap, space, pyramid.top()).texel(0, 0)
    }

    #[test]
    fn the_top_is_the_mean_of_the_whole_picture_whatever_its_sides() {
        for (width, height) in [(1, 1), (2, 2), (3, 3), (5, 7), (13, 1), (1, 6), (16, 9), (31, 33)] {
            let picture = bitmap(width, height, |x, y| [(x * 7 + y * 31) as u8, (x * y) as u8, 200, 255]);
            let Pixels::Rgba8(texels) = &picture.pixels else { unreachable!() };
            let sum = |c: usize| texels.iter().map(|t| f64::from(t[c]) / 255.0).sum::<f64>() / texels.len() as f64;
            let top = top_of(&picture, ColorSpace::Linear);
            for c in 0..4 {
                let error = (f64::from(top[c]) - sum(c)).abs();
                assert!(error < 6.0 / 65535.0, "{width}x{height} channel {c}: off by {error}");
            }
        }
    }

    #[test]
    fn colours_are_averaged_as_light_not_as_stored_numbers() {
        let checker = bitmap(8, 8, |x, y| [if (x + y) % 2 == 0 { 255 } else { 0 }, 0, 0, 255]);
        assert!((top_of(&checker, ColorSpace::Srgb).x - 0.5).abs() < 1e-4);
    }

    #[test]
    fn halving_evenly_is_halving_to_a_step_of_65535() {
        let hash = |x: u32, y: u32| x.wrapping_mul(2_654_435_761).wrapping_add(y.wrapping_mul(40_503)).rotate_left(7);
        let opaque = bitmap(32, 16, |x, y| [hash(x, y) as u8, hash(y, x) as u8, 7, 255]);
        let cut_out = bitmap(16, 64, |x, y| [hash(x, y) as u8, 200, 7, (hash(y, x) % 3 * 100) as u8]);
        let texels = (0..16 * 8 * 3).map(|i| hash(i, 1) as u8).collect();
        let without_alpha = Bitmap { name: String::new(), width: 16, height: 8, pixels: Pixels::Rgb8(texels) };
        for picture in [opaque, cut_out, without_alpha] {
            for space in [ColorSpace::Srgb, ColorSpace::SrgbCutOut, ColorSpace::Linear] {
                let pyramid = Pyramid::new(&picture);
                for level in 1..4 {
                    let below = pyramid.plane(&picture, space, level - 1);
                    let slow = halve(&below, size(&picture, level), space);
                    assert!(below.is_twice(size(&picture, level)));
                    let evenly = &pyramid.level(&picture, space, level).texels;
                    let steps = evenly.iter().flatten().zip(slow.iter().flatten()).map(|(a, b)| a.abs_diff(*b));
                    assert_eq!(evenly.len(), slow.len());
                    assert!(steps.max() <= Some(1), "level {level} {space:?}");
                }
            }
        }
    }

    #[test]
    fn numbers_in_words_are_halved_as_one_by_one() {
        let some = |i: usize| (i.wrapping_mul(2_654_435_761) >> 7) as u8;
        let texels: Vec<[u8; 3]> =
            (0..46 * 8).map(|i| [some(3 * i), some(3 * i + 1) | 0xfc, some(3 * i + 2) & 3]).collect();
        let light = decode::fixed8(ColorSpace::Linear);
        for width in [2, 46] {
            let one_by_one = halve_evenly(&texels, width, |block| mean_solid8(block, light));
            assert_eq!(halve_numbers(&texels, width)[..], one_by_one[..], "{width}");
        }
    }

    #[test]
    fn clear_texels_do_not_stain_their_neighbours() {
        // Red leaves cut out of clear black.
        let leaves = bitmap(4, 4, |x, _| if x % 2 == 0 { [255, 0, 0, 255] } else { [0, 0, 0, 0] });
        let top = top_of(&leaves, ColorSpace::SrgbCutOut);
        assert!((top - Vec4::new(1.0, 0.0, 0.0, 0.5)).abs().max_element() < 1e-4, "{top}");
        // In other colour spaces the channels are independent: alpha is a roughness, or is not read.
        for space in [ColorSpace::Srgb, ColorSpace::Linear] {
            assert!((top_of(&leaves, space).x - 0.5).abs() < 1e-4, "{space:?}");
        }
    }

    #[test]
    fn shares_of_a_texel_add_up_to_one() {
        for from in 1..40 {
            let to = (from / 2).max(1);
            let spans: Vec<_> = (0..to).map(|i| Span::new(i, from, to)).collect();
            for span in &spans {
                assert!((span.shares.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                assert!((1..=3).contains(&span.count) && span.first + span.count <= from);
            }
        }
    }
}
