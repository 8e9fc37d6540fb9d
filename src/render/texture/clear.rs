//! Where a map says that nothing is there, all around: how far from each place.

use super::{Sampler, TextureStore, Wrap, doublings, pixels, probes, size_of};
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

    /// How many texels from a place, in texels, everything is clear on both axes; 0 where that is not known.
    #[inline]
    pub(crate) fn room(&self, at: Vec2) -> f32 {
        let column = self.cell(at.x, 0);
        let row = self.cell(at.y, 1);
        let steps = self.steps.get(row * self.cells[0] + column).copied().unwrap_or(0);
        f32::from(steps.saturating_sub(1)) * self.side
    }

    /// The cell of a coordinate, in texels, along an axis.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the map, and the cast saturates")]
    fn cell(&self, at: f32, axis: usize) -> usize {
        let len = self.size[axis];
        let inside = match self.wrap[axis] {
            Wrap::Repeat => at - floor(at / len) * len,
            Wrap::Mirror => {
                let there = at - floor(at / (2.0 * len)) * (2.0 * len);
                there.min(2.0 * len - there)
            }
            Wrap::Clamp => at,
        };
        ((inside * self.inverse).max(0.0) as usize).min(self.cells[axis] - 1)
    }

    /// How far from its place, in texels, a lookup may read whose footprint has these axes, in texels.
    #[inline]
    pub(crate) fn reach(&self, [along, across]: [Vec2; 2]) -> f32 {
        let (a, b) = (along.length(), across.length());
        let (major, minor) = (a.max(b) * ROUNDING, a.min(b) / ROUNDING);
        let count = if self.several { probes(major / (ROUNDING * ROUNDING), minor * (ROUNDING * ROUNDING)) } else { 1.0 };
        let wide = major / count;
        let level = if self.levels && wide > 1.0 { doublings(wide) + 1 } else { 0 };
        let probing = if self.several { 0.5 * major } else { 0.0 };
        let texel = f32::from_bits((127 + level.min(127)) << 23);
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
