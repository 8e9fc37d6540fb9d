//! Parts of a bitmap whose values all lie in a range: summed-area tables over blocks of texels, queried for any rectangle.

use super::ALPHA;
use crate::math::Vec2;
use crate::scene::{Bitmap, Pixels, Wrap};
use rayon::prelude::*;

/// Columns and rows of texels in a block.
const BLOCK: usize = 8;

/// Minimum and maximum of a channel in each block of texels of a bitmap: read once, however many ranges are queried.
pub(super) struct Extremes {
    /// Columns and rows of the bitmap.
    size: [usize; 2],
    /// Value that stands for 1.
    largest: u16,
    /// Minimum and maximum of each block, row by row; empty for a bitmap without the channel, which then is `largest` everywhere.
    blocks: Vec<[u16; 2]>,
}

impl Extremes {
    /// Reads a bitmap; `None` if it has no texels.
    pub(super) fn of(bitmap: &Bitmap, channel: usize) -> Option<Self> {
        let size = [bitmap.width as usize, bitmap.height as usize];
        let texels = size[0].checked_mul(size[1]).filter(|&texels| texels > 0)?;
        let (largest, blocks) = match &bitmap.pixels {
            Pixels::Rgb8(numbers) if numbers.len() != 3 * texels => return None,
            Pixels::Rgb8(_) if channel == ALPHA => (255, Vec::new()),
            Pixels::Rgb8(numbers) => (255, extremes(size, numbers.as_chunks::<3>().0, channel)),
            Pixels::Rgba8(all) => (255, extremes(size, all.get(..texels)?, channel)),
            Pixels::Rgba16(all) => (65535, extremes(size, all.get(..texels)?, channel)),
        };
        Some(Self { size, largest, blocks })
    }

    /// Blocks whose values all lie in this range, 0 … 1, ends included.
    pub(super) fn blocks(&self, range: [f32; 2]) -> Blocks {
        let [least, most] = range.map(|part| code(part, self.largest));
        let is_open = |&[lo, hi]: &[u16; 2]| lo < least || hi > most;
        let sums = if self.blocks.iter().any(is_open) { summed(self.size, &self.blocks, is_open) } else { Vec::new() };
        Blocks { size: self.size, sums }
    }
}

/// Solid blocks of texels of a bitmap.
pub(super) struct Blocks {
    /// Columns and rows of the bitmap.
    size: [usize; 2],
    /// Number of open blocks above and to the left of each corner of a block, row by row; empty where none is open.
    sums: Vec<u32>,
}

impl Blocks {
    /// Whether all blocks are solid.
    pub(super) fn are_solid(&self) -> bool {
        self.sums.is_empty()
    }

    /// Whether all blocks are solid that lookups between these coordinates read.
    pub(super) fn are_solid_between(&self, lo: Vec2, hi: Vec2, wrap: [Wrap; 2]) -> bool {
        let columns = spans([lo.x, hi.x], self.size[0], wrap[0]);
        let rows = spans([lo.y, hi.y], self.size[1], wrap[1]);
        let pitch = self.size[0].div_ceil(BLOCK) + 1;
        let sum = |x: usize, y: usize| self.sums[y * pitch + x];
        rows.into_iter().flatten().all(|[top, bottom]| {
            columns.into_iter().flatten().all(|[left, right]| {
                let ([left, top], [right, bottom]) =
                    ([left / BLOCK, top / BLOCK], [right / BLOCK + 1, bottom / BLOCK + 1]);
                sum(right, bottom) + sum(left, top) == sum(right, top) + sum(left, bottom)
            })
        })
    }
}

/// Smallest stored value that is no less than `part` of the largest.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 65535")]
pub(in crate::render) fn code(part: f32, largest: u16) -> u16 {
    libm::ceil(f64::from(part) * f64::from(largest)) as u16
}

/// Minimum and maximum of a channel in each block of texels, row by row.
fn extremes<T: Copy + Ord + Into<u16> + Sync, const N: usize>(
    [width, height]: [usize; 2],
    texels: &[[T; N]],
    channel: usize,
) -> Vec<[u16; 2]> {
    let columns = width.div_ceil(BLOCK);
    let mut blocks = vec![[u16::MAX, 0]; columns * height.div_ceil(BLOCK)];
    let rows = texels.par_chunks(width * BLOCK).zip(blocks.par_chunks_mut(columns));
    rows.with_min_len(BLOCK).for_each(|(texels, blocks)| {
        for row in texels.chunks(width) {
            for ([lo, hi], texels) in blocks.iter_mut().zip(row.chunks(BLOCK)) {
                let first = texels[0][channel];
                let (least, greatest) = texels.iter().fold((first, first), |(least, greatest), texel| {
                    (least.min(texel[channel]), greatest.max(texel[channel]))
                });
                (*lo, *hi) = ((*lo).min(least.into()), (*hi).max(greatest.into()));
            }
        }
    });
    blocks
}

/// Number of open blocks above and to the left of each corner of a block.
fn summed([width, height]: [usize; 2], blocks: &[[u16; 2]], is_open: impl Fn(&[u16; 2]) -> bool) -> Vec<u32> {
    let (columns, rows) = (width.div_ceil(BLOCK), height.div_ceil(BLOCK));
    let pitch = columns + 1;
    let mut sums = vec![0; pitch * (rows + 1)];
    for (y, row) in blocks.chunks(columns).enumerate() {
        let mut so_far = 0;
        for (x, block) in row.iter().enumerate() {
            so_far += u32::from(is_open(block));
            sums[(y + 1) * pitch + x + 1] = sums[y * pitch + x + 1] + so_far;
        }
    }
    sums
}

/// Coordinates beyond this are rounded by more than a texel of large maps.
pub(super) const FARTHEST: f32 = 64.0;

/// First and last texel along an axis of all that lookups between two coordinates read: one run of texels, or two.
#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "places of some texels")]
fn spans([lo, hi]: [f32; 2], len: usize, wrap: Wrap) -> [Option<[usize; 2]>; 2] {
    let all = [Some([0, len - 1]), None];
    if !(lo >= -FARTHEST && hi <= FARTHEST) {
        return all;
    }
    // Bilinear lookups read two texels; one more on each side allows for rounding.
    let place = |c: f32| libm::floor(f64::from(c) * len as f64 - 0.5) as i64;
    let (first, last, count) = (place(lo) - 1, place(hi) + 2, len as i64);
    let index = |i: i64| usize::try_from(i).unwrap_or(0).min(len - 1);
    if last - first >= count - 1 {
        return all;
    }
    match wrap {
        Wrap::Clamp => [Some([index(first), index(last)]), None],
        Wrap::Mirror if first < 0 || last >= count => all,
        Wrap::Mirror => [Some([index(first), index(last)]), None],
        Wrap::Repeat => {
            let [first, last] = [first, last].map(|i| index(i.rem_euclid(count)));
            if first <= last { [Some([first, last]), None] } else { [Some([0, last]), Some([first, len - 1])] }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    #[test]
    fn a_rectangle_is_solid_only_where_every_texel_that_is_read_there_is_in_range_however_many_ranges_are_asked_for() {
        let mut random = Random::new(11);
        let (mut solid, mut open) = (0, 0);
        for (width, height) in [(40, 24), (17, 9), (8, 8), (3, 50)] {
            let noise = random.below(5);
            let number = |random: &mut Random| if random.below(60) <= noise { random.below(256) as u8 } else { 200 };
            let texels: Vec<[u8; 4]> = (0..width * height).map(|_| [(); 4].map(|()| number(&mut random))).collect();
            let pixels = Pixels::Rgba8(texels.clone().into());
            let bitmap = Bitmap { name: String::new(), width: width as u32, height: height as u32, pixels };
            for channel in [0, 1, 2, ALPHA] {
                let extremes = Extremes::of(&bitmap, channel).expect("it is there");
                for range in [[0.5, 1.0], [0.1, 1.0], [0.0, 0.8], [0.0, 1.0], [0.79, 0.79]] {
                    let blocks = extremes.blocks(range);
                    let codes = range.map(|part| code(part, 255));
                    let is_open = |x: usize, y: usize| {
                        let number = u16::from(texels[y * width + x][channel]);
                        number < codes[0] || number > codes[1]
                    };
                    let all = (0..width * height).all(|i| !is_open(i % width, i / width));
                    assert_eq!(blocks.are_solid(), all);
                    for _ in 0..if all { 0 } else { 40 } {
                        let [(x0, x1), (y0, y1)] = [width, height].map(|side| {
                            let (a, b) = (random.below(side), random.below(side));
                            (a.min(b), a.max(b))
                        });
                        // From the middle of one texel to that of another.
                        let middle = |x: usize, y: usize| {
                            Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32)
                        };
                        if blocks.are_solid_between(middle(x0, y0), middle(x1, y1), [Wrap::Clamp; 2]) {
                            solid += 1;
                            assert!((y0..=y1).all(|y| (x0..=x1).all(|x| !is_open(x, y))), "{range:?} {channel}");
                        } else {
                            open += 1;
                        }
                    }
                }
            }
        }
        assert!(solid > 50 && open > 500, "{solid} and {open}");
    }

    #[test]
    fn a_part_of_the_largest_number_is_rounded_up() {
        assert_eq!([code(0.5, 255), code(1.0, 255), code(0.0, 255), code(1.0, 65535)], [128, 255, 0, 65535]);
    }

    #[test]
    fn runs_of_texels_go_over_the_edge_where_a_map_repeats() {
        let at = |lo: f32, hi: f32, wrap| {
            spans([lo / 100.0, hi / 100.0], 100, wrap).into_iter().flatten().collect::<Vec<_>>()
        };
        assert_eq!(at(20.0, 30.0, Wrap::Repeat), [[18, 31]]);
        assert_eq!(at(-5.0, 5.0, Wrap::Repeat), [[0, 6], [93, 99]]);
        assert_eq!(at(995.0, 1005.0, Wrap::Repeat), [[0, 6], [93, 99]]);
        assert_eq!(at(1.0, 99.0, Wrap::Repeat), [[0, 99]]);
        assert_eq!(at(-50.0, -5.0, Wrap::Clamp), [[0, 0]]);
        assert_eq!(at(50.0, 120.0, Wrap::Clamp), [[48, 99]]);
        assert_eq!(at(-5.0, 5.0, Wrap::Mirror), [[0, 99]]);
        assert_eq!(at(9990.0, 9991.0, Wrap::Repeat), [[0, 99]], "far away");
        assert_eq!(at(f32::NAN, 1.0, Wrap::Repeat), [[0, 99]]);
    }
}
