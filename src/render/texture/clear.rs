//! Where a map says that nothing is there, all around: how far from each place.

use super::{MAX_PROBES, Sampler, TextureStore, Wrap, pixels, size_of};
use crate::math::Vec2;
use crate::math::formula::floor;
use crate::scene::{Bitmap, Filter, Mipmaps, Pixels};

/// Sides of the cells by which a map is surveyed: so long that there are no more than these along the longer side of it, as
/// far as whole cells cover it.
const CELLS: usize = 512;

/// No map is surveyed by more cells than these.
const MOST: usize = 1 << 20;

/// Texels on both sides of a place that a lookup reads, in widths of the largest ones: those next to it, and what is left of
/// them.
const BESIDE: f32 = 1.5;

/// The bits of a number that are its power of two.
const EXPONENT: u32 = 0xff80_0000;

/// More than rounding changes where steps of levels and probes are.
const ROUNDING: f32 = 1.02;

/// How far it is from each cell of a map to the nearest one in which anything is.
#[derive(Debug)]
pub(crate) struct Clear {
    /// Columns and rows.
    cells: [usize; 2],
    /// Texels along each side of a cell, and its inverse.
    side: f32,
    inverse: f32,
    size: Vec2,
    per_size: Vec2,
    wrap: [Wrap; 2],
    /// Cells to the nearest one that is not clear, at most 255.
    steps: Vec<u8>,
    /// Texels of a smaller copy cover no more than so many of the widths that its level says.
    spread: f32,
    /// Whether there are smaller copies, and whether several probes may be taken.
    levels: bool,
    several: bool,
}

impl Clear {
    /// Surveys the channel of a map: what is no more than `most`, of 8 bits, is as good as nothing. `None` where nothing is
    /// clear, or that would take long.
    pub(crate) fn of(store: &TextureStore, texture: u32, channel: usize, most: u8) -> Option<Self> {
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
        let steps = steps(cells, wrap, &filled(bitmap, (channel, most), side, cells)?);
        let even = width.is_power_of_two() && height.is_power_of_two();
        let side = pixels((side, side)).x;
        Some(Self {
            cells,
            side,
            inverse: 1.0 / side,
            size: pixels((width, height)),
            per_size: 1.0 / pixels((width, height)),
            wrap,
            steps,
            // Where a side is not halved evenly the last level has one that is up to twice as wide, and each texel may have a
            // part of one more of those below.
            spread: if even { 1.0 } else { 3.0 },
            levels: mipmaps != Mipmaps::None,
            several: minify == Filter::Linear,
        })
    }

    /// Texels along both axes.
    pub(crate) fn size(&self) -> Vec2 {
        self.size
    }

    /// How many texels from each place, in texels, everything is clear on both axes; 0 where that is not known.
    #[inline(always)]
    pub(crate) fn room<const N: usize>(&self, [x, y]: &[[f32; N]; 2]) -> [f32; N] {
        let (columns, rows) = (self.cells_of(x, 0), self.cells_of(y, 1));
        let mut room = [0.0; N];
        for (i, room) in room.iter_mut().enumerate() {
            let cell = rows[i] as usize * self.cells[0] + columns[i] as usize;
            *room = f32::from(self.steps.get(cell).map_or(0, |steps| steps.saturating_sub(1))) * self.side;
        }
        room
    }

    /// The cells of coordinates, in texels, along an axis.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "cast as small numbers")]
    fn cells_of<const N: usize>(&self, at: &[f32; N], axis: usize) -> [i32; N] {
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

    /// How far from its place, in texels, a lookup may read whose footprint has axes of no more than these lengths, in texels.
    #[inline]
    pub(crate) fn reach(&self, shorter: f32, longer: f32) -> f32 {
        // What a probe covers is rounded up to a level, and the next one may be read.
        let covered = if self.several { shorter.max(longer / MAX_PROBES) } else { longer };
        let level = f32::from_bits((ROUNDING * covered).max(0.5).to_bits() & EXPONENT);
        let texel = if self.levels { 2.0 * level } else { 1.0 };
        let probing = if self.several { 0.5 * ROUNDING * longer } else { 0.0 };
        BESIDE * texel * self.spread + probing
    }
}

/// Which cells have anything in them, of so many texels a side; `None` if all have.
fn filled(bitmap: &Bitmap, (channel, most): (usize, u8), side: usize, cells: [usize; 2]) -> Option<Vec<bool>> {
    let filled = match &bitmap.pixels {
        Pixels::Rgb8(_) if channel == 3 => return None,
        Pixels::Rgb8(texels) => cells_with(texels.as_chunks::<3>().0, |t| t[channel] > most, (bitmap, side, cells)),
        Pixels::Rgba8(texels) => cells_with(texels, |t| t[channel] > most, (bitmap, side, cells)),
        Pixels::Rgba16(texels) => {
            cells_with(texels, |t| t[channel] > u16::from(most) * 257, (bitmap, side, cells))
        }
    };
    filled.contains(&false).then_some(filled)
}

/// The cells in which any texel is such.
fn cells_with<T>(
    texels: &[T],
    is_such: impl Fn(&T) -> bool,
    (bitmap, side, [columns, rows]): (&Bitmap, usize, [usize; 2]),
) -> Vec<bool> {
    let mut cells = vec![false; columns * rows];
    for (y, row) in texels.chunks(bitmap.width as usize).enumerate() {
        let cells = &mut cells[y / side * columns..][..columns];
        for (cell, texels) in cells.iter_mut().zip(row.chunks(side)) {
            *cell |= texels.iter().any(&is_such);
        }
    }
    cells
}

/// How many steps, along rows, columns or both, each cell is away from one that is filled, at most 255.
fn steps([columns, rows]: [usize; 2], wrap: [Wrap; 2], filled: &[bool]) -> Vec<u8> {
    let mut steps: Vec<u8> = filled.iter().map(|&filled| if filled { 0 } else { u8::MAX }).collect();
    let [around, over] = wrap.map(|wrap| wrap == Wrap::Repeat);
    let mut beside = vec![u8::MAX; columns + 2];
    let mut step = |steps: &mut [u8], y: usize, from: Option<usize>| {
        if let Some(from) = from {
            let other = &steps[from * columns..][..columns];
            beside[1..=columns].copy_from_slice(other);
            (beside[0], beside[columns + 1]) =
                if around { (other[columns - 1], other[0]) } else { (u8::MAX, u8::MAX) };
        } else {
            beside.fill(u8::MAX);
        }
        let row = &mut steps[y * columns..][..columns];
        for (here, near) in row.iter_mut().zip(beside.windows(3)) {
            *here = (*here).min(near[0].min(near[1]).min(near[2]).saturating_add(1));
        }
        let before = |row: &[u8], end: usize| if around { row[end] } else { u8::MAX };
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
    // Down and up once is enough where nothing repeats.
    loop {
        let known = steps.clone();
        for y in 0..rows {
            step(&mut steps, y, y.checked_sub(1).or(over.then_some(rows - 1)));
        }
        for y in (0..rows).rev() {
            step(&mut steps, y, Some(y + 1).filter(|&y| y < rows).or(over.then_some(0)));
        }
        if steps == known {
            return steps;
        }
    }
}
