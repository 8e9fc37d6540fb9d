//! Distance maps of a texture channel: how far around each place the map is clear throughout, or solid throughout.

use super::{MAX_PROBES, Sampler, TextureStore, Wrap, doublings, pixels, size_of};
use crate::math::Vec2;
use crate::math::formula::floor;
use crate::scene::{Bitmap, Filter, Mipmaps, Pixels};

/// Limit of the cells of a survey along the longer side of its map: cells are doubled in size until they fit, as long as whole
/// cells cover the sides along which the map repeats.
const CELLS: usize = 512;

/// Maximum number of cells: larger maps that repeat and have a side that cannot be halved are not surveyed.
const MOST: usize = 1 << 20;

/// Distance that a lookup reads to each side of a place, in widths of the largest texels: the neighbouring texels, each in full.
const BESIDE: f32 = 1.5;

/// Number of levels surveyed; nothing is known beyond.
const LEVELS: usize = 16;

/// Margin for the rounding of level and probe computations.
const ROUNDING: f32 = 1.02;

/// Thresholds of an 8-bit channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Codes {
    /// A place with no more than this is clear: the surface has a gap there.
    pub most: u8,
    /// A place with no less than this is solid. Beyond 255: nowhere.
    pub least: u16,
}

/// Distance of each clear, or solid, cell of a map to the nearest one that is not.
#[derive(Debug)]
pub(crate) struct Survey {
    /// Columns and rows.
    cells: [usize; 2],
    /// Texels along each side of a cell, and the inverse.
    side: f32,
    inverse: f32,
    size: Vec2,
    per_size: Vec2,
    wrap: [Wrap; 2],
    /// Steps to the nearest cell that is not clear, at most 127; negative: to the nearest one that is not solid.
    steps: Vec<i8>,
    /// Whether any cell is clear.
    has_gaps: bool,
    /// Distance from its place, in texels, that a lookup in each level reads.
    reach: [f32; LEVELS],
    /// Whether there are mip levels, and whether several probes may be taken.
    levels: bool,
    several: bool,
}

impl Survey {
    /// Surveys the channel of a map. `None` where nothing is clear and nothing solid, or where it would take long.
    pub(crate) fn of(store: &TextureStore, texture: u32, channel: usize, codes: Codes) -> Option<Self> {
        let (sampler, source) = store.find(texture)?;
        let Sampler { minify, mipmaps, wrap_u, wrap_v, .. } = sampler;
        let (bitmap, (width, height)) = (source.bitmap, size_of(source.bitmap));
        let wrap = [wrap_u, wrap_v];
        let whole = |side: usize| {
            let covers = |(wrap, len): (Wrap, usize)| wrap != Wrap::Repeat || len % side == 0;
            wrap.into_iter().zip([width, height]).all(covers)
        };
        let mut side = 1;
        while width.max(height) > CELLS * side && whole(2 * side) {
            side *= 2;
        }
        let cells = [width.div_ceil(side), height.div_ceil(side)];
        if cells[0] * cells[1] > MOST {
            return None;
        }
        let [filled, open] = cells_of(bitmap, channel, codes, side, cells)?;
        let has_gaps = filled.contains(&false);
        if !has_gaps && !open.contains(&false) {
            return None;
        }
        let (clear, solid) = (steps(cells, wrap, &filled), steps(cells, wrap, &open));
        let steps = clear.into_iter().zip(solid).map(|(clear, solid)| clear - solid).collect();
        let side = pixels((side, side)).x;
        Some(Self {
            cells,
            side,
            inverse: 1.0 / side,
            size: pixels((width, height)),
            per_size: 1.0 / pixels((width, height)),
            wrap,
            steps,
            has_gaps,
            reach: std::array::from_fn(|level| reach(width, level).max(reach(height, level))),
            levels: mipmaps != Mipmaps::None,
            several: minify == Filter::Linear,
        })
    }

    /// Texels along both axes.
    #[cfg(test)]
    fn size(&self) -> Vec2 {
        self.size
    }

    /// Whether any part is clear.
    pub(crate) fn has_gaps(&self) -> bool {
        self.has_gaps
    }

    /// Distance along both axes, in texels, around each place within which everything is clear or, if negative, solid; 0 where
    /// that is unknown.
    #[inline(always)]
    pub(crate) fn room<const N: usize>(&self, [x, y]: &[[f32; N]; 2]) -> [f32; N] {
        let (columns, rows) = (self.cells_at(x, 0), self.cells_at(y, 1));
        let mut room = [0.0; N];
        for (i, room) in room.iter_mut().enumerate() {
            let cell = rows[i] as usize * self.cells[0] + columns[i] as usize;
            let steps = self.steps.get(cell).copied().unwrap_or(0);
            *room = f32::from(steps - steps.signum()) * self.side;
        }
        room
    }

    /// Cell indices of coordinates, in texels, along an axis.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "cast as small numbers")]
    fn cells_at<const N: usize>(&self, at: &[f32; N], axis: usize) -> [i32; N] {
        let (len, per_len, last) = (self.size[axis], self.per_size[axis], self.cells[axis] as i32 - 1);
        let mut inside = *at;
        match self.wrap[axis] {
            Wrap::Repeat => inside.iter_mut().for_each(|at| *at -= floor(*at * per_len) * len),
            Wrap::Mirror => inside.iter_mut().for_each(|at| {
                *at -= floor(*at * (0.5 * per_len)) * (2.0 * len);
                *at = at.min(2.0 * len - *at);
            }),
            Wrap::Clamp => {}
        }
        let mut cells = [0; N];
        for (cell, inside) in cells.iter_mut().zip(inside) {
            *cell = ((inside * self.inverse) as i32).clamp(0, last);
        }
        cells
    }

    /// Distance from its place, in texels, that a lookup may read with footprint axes no longer than these, in texels.
    #[inline]
    pub(crate) fn reach(&self, shorter: f32, longer: f32) -> f32 {
        // The width of a probe is rounded up to a level, and the next one may be read.
        let covered = if self.several { shorter.max(longer / MAX_PROBES) } else { longer };
        let level = if self.levels { doublings(2.0 * ROUNDING * covered) as usize } else { 0 };
        let probing = if self.several { 0.5 * ROUNDING * longer } else { 0.0 };
        // NaN gives infinity.
        if longer >= 0.0 { self.reach[level.min(LEVELS - 1)] + probing } else { f32::INFINITY }
    }
}

/// Distance from its place that a lookup in a level reads along a side of `len` texels; infinite in the last surveyed level.
fn reach(len: usize, level: usize) -> f32 {
    if level == LEVELS - 1 {
        return f32::INFINITY;
    }
    // Where a side is not halved evenly, texels are wider than two of the level below, and include a part of one more on each
    // side.
    let side = |level: usize| (len >> level).max(1);
    let width = |level: usize| pixels((len, 0)).x / pixels((side(level), 0)).x;
    let more = (0..level).filter(|&below| side(below) != 2 * side(below + 1)).map(width);
    BESIDE * width(level) + more.sum::<f32>()
}

/// Masks of the cells, of `side` texels a side, that contain a texel that is not clear, and one that is not solid; `None` for the
/// alpha of a bitmap that stores none.
fn cells_of(
    bitmap: &Bitmap,
    channel: usize,
    Codes { most, least }: Codes,
    side: usize,
    cells: [usize; 2],
) -> Option<[Vec<bool>; 2]> {
    let grid = (bitmap, side, cells);
    let all = |code: u16| [code > u16::from(most), code < least];
    let wide = |code: u16| [code > u16::from(most) * 257, u32::from(code) < u32::from(least) * 257];
    Some(match &bitmap.pixels {
        Pixels::Rgb8(_) if channel == 3 => return None,
        Pixels::Rgb8(texels) => cells_with(texels.as_chunks::<3>().0, |t| all(t[channel].into()), grid),
        Pixels::Rgba8(texels) => cells_with(texels, |t| all(t[channel].into()), grid),
        Pixels::Rgba16(texels) => cells_with(texels, |t| wide(t[channel]), grid),
    })
}

/// Masks of the cells that contain a texel with either property.
fn cells_with<T>(
    texels: &[T],
    is_such: impl Fn(&T) -> [bool; 2],
    (bitmap, side, [columns, rows]): (&Bitmap, usize, [usize; 2]),
) -> [Vec<bool>; 2] {
    let [mut one, mut other] = [(); 2].map(|()| vec![false; columns * rows]);
    for (y, row) in texels.chunks(bitmap.width as usize).enumerate() {
        let [one, other] = [&mut one, &mut other].map(|cells| &mut cells[y / side * columns..][..columns]);
        for ((one, other), texels) in one.iter_mut().zip(other).zip(row.chunks(side)) {
            for such in texels.iter().map(&is_such) {
                *one |= such[0];
                *other |= such[1];
            }
        }
    }
    [one, other]
}

/// Maximum number of steps stored.
const FARTHEST: i8 = i8::MAX;

/// Distance of each cell from the nearest filled one, in steps along rows, columns or both, at most [`FARTHEST`].
fn steps([columns, rows]: [usize; 2], wrap: [Wrap; 2], filled: &[bool]) -> Vec<i8> {
    let mut steps: Vec<i8> = filled.iter().map(|&filled| if filled { 0 } else { FARTHEST }).collect();
    let [around, over] = wrap.map(|wrap| wrap == Wrap::Repeat);
    let mut beside = vec![FARTHEST; columns + 2];
    let mut step = |steps: &mut [i8], y: usize, from: Option<usize>| {
        if let Some(from) = from {
            let other = &steps[from * columns..][..columns];
            beside[1..=columns].copy_from_slice(other);
            (beside[0], beside[columns + 1]) =
                if around { (other[columns - 1], other[0]) } else { (FARTHEST, FARTHEST) };
        } else {
            beside.fill(FARTHEST);
        }
        let row = &mut steps[y * columns..][..columns];
        for (here, near) in row.iter_mut().zip(beside.windows(3)) {
            *here = (*here).min(near[0].min(near[1]).min(near[2]).saturating_add(1));
        }
        let before = |row: &[i8], end: usize| if around { row[end] } else { FARTHEST };
        let mut last = before(row, columns - 1);
        for here in row.iter_mut() {
            last = (*here).min(last.saturating_add(1));
            *here = last;
        }
        let mut last = before(row, 0);
        for here in row.iter_mut().rev() {
            last = (*here).min(last.saturating_add(1));
            *here = last;
        }
    };
    // One pass down and one up suffice where nothing repeats.
    loop {
        let known = steps.clone();
        for y in 0..rows {
            step(&mut steps, y, y.checked_sub(1).or(over.then_some(rows - 1)));
        }
        for y in (0..rows).rev() {
            step(&mut steps, y, Some(y + 1).filter(|&y| y < rows).or(over.then_some(0)));
        }
        if steps == known || !(around || over) {
            return steps;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ColorSpace;
    use super::*;
    use crate::math::random::Random;
    use crate::scene::{Scene, Texture};
    use std::ops::RangeInclusive;

    const CODES: Codes = Codes { most: 0, least: 200 };
    const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

    /// Steps by their definition.
    fn defined([columns, rows]: [usize; 2], wrap: [Wrap; 2], filled: &[bool]) -> Vec<i8> {
        let apart = |a: usize, b: usize, len: usize, wrap: Wrap| {
            let apart = a.abs_diff(b);
            if wrap == Wrap::Repeat { apart.min(len - apart) } else { apart }
        };
        let of = |cell: usize| {
            let steps = |other: usize| {
                let [x, y] = [(cell % columns, other % columns), (cell / columns, other / columns)];
                apart(x.0, x.1, columns, wrap[0]).max(apart(y.0, y.1, rows, wrap[1]))
            };
            let nearest = (0..filled.len()).filter(|&other| filled[other]).map(steps).min();
            nearest.map_or(FARTHEST, |steps| steps.min(127) as i8)
        };
        (0..filled.len()).map(of).collect()
    }

    #[test]
    fn steps_lead_to_the_nearest_cell_that_is_filled_also_across_borders() {
        let mut random = Random::new(3);
        for cells in [[1, 1], [7, 5], [13, 1], [1, 9], [16, 11], [300, 1]] {
            for wrap in WRAPS.map(|u| WRAPS.map(|v| [u, v])).as_flattened() {
                for part in [0.0, 0.01, 0.05, 0.5, 1.0] {
                    let filled: Vec<bool> = (0..cells[0] * cells[1]).map(|_| random.unit() < part).collect();
                    assert_eq!(steps(cells, *wrap, &filled), defined(cells, *wrap, &filled), "{cells:?} {wrap:?}");
                }
            }
        }
    }

    /// A map with an alpha of random codes, and spots of another on it.
    fn spotted(
        random: &mut Random,
        ((width, height), sampler): ((u32, u32), Sampler),
        codes: RangeInclusive<u8>,
        spot: u8,
    ) -> Scene {
        let mut texels = vec![[200, 100, 50, 0]; (width * height) as usize];
        let count = usize::from(codes.end() - codes.start()) + 1;
        texels.iter_mut().for_each(|texel| texel[3] = codes.start() + random.below(count) as u8);
        for _ in 0..3 {
            let (x, y) = (random.below(width as usize) as u32, random.below(height as usize) as u32);
            for k in 0..4 {
                let (x, y) = ((x + k % 2).min(width - 1), (y + k / 2).min(height - 1));
                texels[(y * width + x) as usize][3] = spot;
            }
        }
        let pixels = Pixels::Rgba8(texels.into_iter().collect());
        let bitmap = Bitmap { name: String::new(), width, height, pixels };
        Scene { textures: vec![Texture { bitmap: 0, sampler }], bitmaps: vec![bitmap], ..Scene::default() }
    }

    /// Maps of many sizes, with all samplers.
    fn kinds() -> impl Iterator<Item = ((u32, u32), Sampler)> {
        let sizes = [(64, 64), (128, 32), (37, 50), (127, 63), (1023, 8), (2048, 16), (33, 1)];
        sizes.into_iter().cycle().take(84).enumerate().map(|(round, size)| {
            let filter = |k: usize| if k.is_multiple_of(3) { Filter::Nearest } else { Filter::Linear };
            let sampler = Sampler {
                magnify: filter(round + 1),
                minify: filter(round + 2),
                mipmaps: [Mipmaps::Linear, Mipmaps::Linear, Mipmaps::Nearest, Mipmaps::None][round % 4],
                wrap_u: WRAPS[round % 3],
                wrap_v: WRAPS[round / 3 % 3],
            };
            (size, sampler)
        })
    }

    #[test]
    fn what_is_clear_all_around_is_read_as_no_more_than_what_is_stored_there() {
        let mut random = Random::new(12);
        let (mut clear_ones, mut all) = (0, 0);
        for (round, (size, sampler)) in kinds().enumerate() {
            let most = [0, 100][round % 2];
            let scene = spotted(&mut random, (size, sampler), 0..=most, 255);
            let store = TextureStore::new(&scene);
            let clear = Survey::of(&store, 0, 3, Codes { most, least: 256 }).unwrap();
            for _ in 0..3000 {
                let at = Vec2::new(random.unit() * 3.0 - 1.0, random.unit() * 3.0 - 1.0);
                // Footprints from far below a texel to many, round or elongated, in any direction.
                let longer = libm::exp2f(random.unit() * 8.0 - 3.0);
                let shorter = longer * libm::exp2f(-4.0 * random.unit());
                let (sin, cos) = libm::sincosf(random.unit() * 7.0);
                let texels = clear.size();
                let axes = [Vec2::new(cos, sin) * longer / texels, Vec2::new(-sin, cos) * shorter / texels];
                let room = clear.room(&[[at.x * texels.x], [at.y * texels.y]])[0];
                all += 1;
                if clear.reach(shorter, longer) <= room {
                    clear_ones += 1;
                    let read = store.sample(0, ColorSpace::SrgbCutOut, at, axes[0], axes[1]).w;
                    let least = f32::from(most) / 255.0 + 1e-3;
                    assert!(read <= least && (most > 0 || read == 0.0), "{size:?} {sampler:?} {at} {axes:?}: {read}");
                    let sharp = store.channel::<3>(0, at);
                    assert!(sharp <= least, "{size:?} {sampler:?} {at}: {sharp}");
                }
            }
        }
        assert!(clear_ones > all / 5, "{clear_ones} of {all}");
    }

    #[test]
    fn what_is_solid_all_around_is_read_as_no_less_than_what_is_stored_there() {
        let mut random = Random::new(13);
        let (mut solid_ones, mut all) = (0, 0);
        for (round, (size, sampler)) in kinds().enumerate() {
            let least = [255, 128][round % 2];
            let scene = spotted(&mut random, (size, sampler), least..=255, least - 1);
            let store = TextureStore::new(&scene);
            let solid = Survey::of(&store, 0, 3, Codes { most: 9, least: least.into() }).unwrap();
            assert!(!solid.has_gaps());
            for _ in 0..3000 {
                let at = Vec2::new(random.unit() * 3.0 - 1.0, random.unit() * 3.0 - 1.0);
                let texels = solid.size();
                let room = solid.room(&[[at.x * texels.x], [at.y * texels.y]])[0];
                all += 1;
                if solid.reach(0.0, 0.0) <= -room {
                    solid_ones += 1;
                    let (read, stored) = (store.channel::<3>(0, at), f32::from(least) / 255.0);
                    let enough = if least == 255 { read == 1.0 } else { read >= stored * (1.0 - 1e-6) };
                    assert!(enough, "{size:?} {sampler:?} {at}: {read}");
                }
            }
        }
        assert!(solid_ones > all / 5, "{solid_ones} of {all}");
    }

    #[test]
    fn of_maps_without_alpha_or_that_are_between_everywhere_nothing_is_known() {
        let of = |pixels: Pixels, channel: usize| {
            let bitmap = Bitmap { name: String::new(), width: 4, height: 4, pixels };
            let texture = Texture { bitmap: 0, sampler: Sampler::default() };
            let scene = Scene { textures: vec![texture], bitmaps: vec![bitmap], ..Scene::default() };
            Survey::of(&TextureStore::new(&scene), 0, channel, CODES).is_some()
        };
        let rgb = |code: u8| Pixels::Rgb8((0..48).map(|_| code).collect());
        assert!(!of(rgb(0), 3) && of(rgb(0), 0) && !of(rgb(1), 0) && !of(rgb(199), 0) && of(rgb(200), 0));
        let rgba16 = |code: u16| Pixels::Rgba16((0..16).map(|_| [9, 9, 9, code]).collect());
        assert!(of(rgba16(0), 3) && !of(rgba16(1), 3) && !of(rgba16(0), 1));
        assert!(of(rgba16(200 * 257), 3) && !of(rgba16(200 * 257 - 1), 3));
        assert!(Survey::of(&TextureStore::new(&Scene::default()), 0, 3, CODES).is_none());
    }
}
