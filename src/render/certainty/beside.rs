//! Evaluates the samples of many pixels side by side, as columns (structure of arrays).
//!
//! The formulas of `frame` and of the developer are called in loops over pixels, which the compiler vectorises. So a pixel has
//! the same bits whatever its neighbours, on every instruction set.

use super::{Certainty, GROUPS, PixelSummary, Range, Shown};
use crate::math::simd::{Kernel, LANES, Simd};
use crate::math::{Vec3, Vec4};
use crate::render::frame::Sum;
use crate::render::whitted::Sample;

/// Number of pixels evaluated together.
const PIXELS: usize = 16;

/// One value of every pixel.
type Row = [f32; PIXELS];

/// Written values of every pixel, RGB and alpha.
type Rows = [Row; 4];

/// Pixels of a picture.
#[derive(Default)]
pub(in crate::render) struct Pixels {
    /// As [`Picture::beauty`](crate::image::Picture::beauty).
    pub beauty: Vec<[f32; 4]>,
    /// As [`Picture::veil`](crate::image::Picture::veil); empty where there is none.
    pub veil: Vec<[f32; 4]>,
}

/// One group of samples of every pixel, as columns.
#[derive(Clone, Copy)]
struct Sums {
    radiance: [Row; 3],
    through: [Row; 3],
    solid: Row,
    weight: Row,
}

impl Sums {
    const EMPTY: Self = {
        let (row, three) = ([0.0; PIXELS], [[0.0; PIXELS]; 3]);
        Self { radiance: three, through: three, solid: row, weight: row }
    };

    #[inline(always)]
    fn at(&self, i: usize) -> Sum {
        let three = |rows: &[Row; 3]| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
        let (radiance, through) = (three(&self.radiance), three(&self.through));
        Sum { radiance, through, solid: self.solid[i], weight: self.weight[i] }
    }

    /// Loads one sample for every pixel; lanes past the end repeat the last one.
    #[inline(always)]
    fn take<S: Simd>(&mut self, s: S, samples: &[Sample]) {
        for k in 0..PIXELS / LANES {
            let numbers =
                |i: usize| -> &[f32; 6] { bytemuck::cast_ref(&samples[(k * LANES + i).min(samples.len() - 1)]) };
            let first = s.columns(std::array::from_fn(|i| numbers(i).first_chunk().unwrap_or(&[0.0; 4])));
            let last = s.columns(std::array::from_fn(|i| numbers(i).last_chunk().unwrap_or(&[0.0; 4])));
            let rows = self.radiance.iter_mut().zip(&first).chain(self.through.iter_mut().zip(&last[1..]));
            for (row, lanes) in rows {
                row.as_chunks_mut().0[k] = s.store(*lanes);
            }
        }
        let [x, y, z] = &self.through;
        for i in 0..PIXELS {
            self.solid[i] = if (x[i] == 0.0) & (y[i] == 0.0) & (z[i] == 0.0) { 1.0 } else { 0.0 };
        }
        self.weight = [1.0; PIXELS];
    }

    #[inline(always)]
    fn set(&mut self, i: usize, sum: Sum) {
        let Sum { radiance: r, through: t, solid, weight } = sum;
        (self.radiance[0][i], self.radiance[1][i], self.radiance[2][i]) = (r.x, r.y, r.z);
        (self.through[0][i], self.through[1][i], self.through[2][i]) = (t.x, t.y, t.z);
        (self.solid[i], self.weight[i]) = (solid, weight);
    }
}

/// Pixels that wait to be evaluated together.
struct PixelBatch<'g> {
    sums: [Sums; GROUPS],
    /// Groups of the last pixel.
    last: &'g [Sum],
    pixels: usize,
    /// Run length of identical consecutive pixels, by lane.
    alike: [u32; PIXELS],
    seen: Found,
}

/// Results of the evaluation, by lane.
struct Found {
    color: Rows,
    least: Rows,
    most: Rows,
    brightest: Row,
    error: Row,
}

impl Certainty<'_> {
    /// Passes what the sample groups of each of these pixels show to `tell`: all pixels have the same number of groups, at most
    /// [`GROUPS`].
    pub(in crate::render) fn see_each<'g>(
        &self,
        pixels: impl Iterator<Item = &'g [Sum]>,
        mut tell: impl FnMut(&PixelSummary),
    ) {
        self.look_at_each(pixels, true, |found, i| tell(&found.at(i)));
    }

    /// Passes the standard error of each of these pixels, the root of the mean over its channels, to `tell`: from groups of
    /// equally many samples, the same number for all pixels, at most [`GROUPS`].
    pub(in crate::render) fn each_standard_error<'g>(
        &self,
        pixels: impl Iterator<Item = &'g [Sum]>,
        mut tell: impl FnMut(f32),
    ) {
        self.look_at_each(pixels, false, |found, i| tell(found.error[i]));
    }

    /// Evaluates each single sample: what it shows, and the pixel that it makes where it is the only one.
    pub(in crate::render) fn see_samples(&self, samples: &[Sample]) -> (Shown, Pixels) {
        let (mut shown, mut pixels) = (Shown::with_capacity(samples.len()), Pixels::default());
        pixels.beauty.reserve(samples.len());
        self.level.run(SummarizeSamples { judge: self, samples, shown: &mut shown, pixels: &mut pixels });
        (shown, pixels)
    }

    fn look_at_each<'g>(
        &self,
        pixels: impl Iterator<Item = &'g [Sum]>,
        range: bool,
        mut tell: impl FnMut(&Found, usize),
    ) {
        let mut beside = PixelBatch::new();
        for groups in pixels {
            if beside.is_full_for(groups) {
                beside.look(self, range, &mut tell);
            }
            beside.take(groups);
        }
        beside.look(self, range, &mut tell);
    }
}

impl<'g> PixelBatch<'g> {
    fn new() -> Self {
        let (row, rows) = ([0.0; PIXELS], [[0.0; PIXELS]; 4]);
        let seen = Found { color: rows, least: rows, most: rows, brightest: row, error: row };
        Self { sums: [Sums::EMPTY; GROUPS], last: &[], pixels: 0, alike: [0; PIXELS], seen }
    }

    /// Whether the waiting pixels must be evaluated before a pixel with these groups is added.
    fn is_full_for(&self, groups: &[Sum]) -> bool {
        self.pixels == PIXELS && self.last != groups
    }

    fn take(&mut self, groups: &'g [Sum]) {
        debug_assert!(self.pixels == 0 || self.last.len() == groups.len());
        // Large parts of a picture have one colour.
        if self.pixels == 0 || self.last != groups {
            for (sums, group) in self.sums.iter_mut().zip(groups) {
                sums.set(self.pixels % PIXELS, *group);
            }
            self.alike[self.pixels % PIXELS] = 0;
            self.last = groups;
            self.pixels += 1;
        }
        self.alike[self.pixels - 1] += 1;
    }

    /// Evaluates all waiting pixels, and passes the result of each to `tell`.
    fn look(&mut self, judge: &Certainty, range: bool, mut tell: impl FnMut(&Found, usize)) {
        let (sums, to) = (&self.sums[..self.last.len().min(GROUPS)], &mut self.seen);
        if range {
            judge.level.run(SummarizePixels { judge, sums, to });
        } else {
            judge.level.run(StandardErrors { judge, sums, to });
        }
        for (i, alike) in self.alike[..self.pixels].iter().enumerate() {
            (0..*alike).for_each(|_| tell(to, i));
        }
        self.pixels = 0;
    }
}

impl Found {
    fn at(&self, i: usize) -> PixelSummary {
        let color = |[r, g, b, a]: &Rows| Vec4::new(r[i], g[i], b[i], a[i]);
        let range = Range { least: color(&self.least), most: color(&self.most), brightest: self.brightest[i] };
        PixelSummary { color: color(&self.color), range, error: self.error[i] }
    }
}

/// Kernel that evaluates all results.
struct SummarizePixels<'a, 'j> {
    judge: &'a Certainty<'j>,
    sums: &'a [Sums],
    to: &'a mut Found,
}

impl Kernel for SummarizePixels<'_, '_> {
    type Output = ();

    // The lanes are plain arrays: the token `S` only tells which instructions the compiler may use.
    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { judge, sums, to } = self;
        let Some((first, others)) = sums.split_first() else { return };
        let of_first = judge.written(first);
        (to.least, to.most, to.brightest) = (of_first, of_first, [0.0; PIXELS]);
        for group in others {
            let rows = judge.written(group);
            for ((least, most), row) in to.least.iter_mut().zip(&mut to.most).zip(&rows) {
                for i in 0..PIXELS {
                    (least[i], most[i]) = (least[i].min(row[i]), most[i].max(row[i]));
                }
            }
        }
        for group in sums {
            for i in 0..PIXELS {
                to.brightest[i] = to.brightest[i].max(judge.light(&group.at(i)));
            }
        }
        if others.is_empty() {
            (to.color, to.error) = (of_first, [0.0; PIXELS]);
            return;
        }
        let left = judge.left_out(sums);
        let left = &left[..sums.len().min(GROUPS)];
        mean(left, &mut to.color);
        let equal = equal(sums);
        judge.spread(left, &equal, &mut to.error);
        // Equal groups keep their exact value, without the rounding of means.
        for (to, row) in to.color.iter_mut().zip(&of_first) {
            (0..PIXELS).for_each(|i| to[i] = if equal[i] == 1 { row[i] } else { to[i] });
        }
    }
}

/// Kernel that evaluates single samples.
struct SummarizeSamples<'a, 'j> {
    judge: &'a Certainty<'j>,
    samples: &'a [Sample],
    shown: &'a mut Shown,
    pixels: &'a mut Pixels,
}

impl Kernel for SummarizeSamples<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { judge, samples, shown, pixels } = self;
        let (mut sums, mut resolved, mut written) = (Sums::EMPTY, [[0.0; PIXELS]; 4], [[0.0; PIXELS]; 4]);
        let (mut brightest, mut last): (Row, &[Sample]) = ([0.0; PIXELS], &[]);
        for some in samples.chunks(PIXELS) {
            // Large parts of a picture have one colour.
            if some != last {
                sums.take(s, some);
                resolved = judge.resolved(&sums);
                written = judge.written_of(&sums, resolved);
                for (i, brightest) in brightest.iter_mut().enumerate() {
                    *brightest = judge.light(&sums.at(i)).max(0.0);
                }
                last = some;
            }
            for (column, row) in shown.colors.iter_mut().zip(&written) {
                column.extend_from_slice(&row[..some.len()]);
            }
            shown.brightest.extend_from_slice(&brightest[..some.len()]);
            for k in 0..PIXELS / LANES {
                let eight = s.rows(resolved.map(|row| s.load(&row.as_chunks().0[k])));
                let there = some.len().saturating_sub(k * LANES).min(LANES);
                pixels.beauty.extend_from_slice(&eight[..there]);
            }
            if let (Some(behind), true) = (judge.background, judge.has_veil) {
                let [r, g, b, glass] = veils(&sums, behind);
                pixels.veil.extend((0..some.len()).map(|i| [r[i], g[i], b[i], glass[i]]));
            }
        }
    }
}

/// Kernel that evaluates standard errors alone.
struct StandardErrors<'a, 'j> {
    judge: &'a Certainty<'j>,
    sums: &'a [Sums],
    to: &'a mut Found,
}

impl Kernel for StandardErrors<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        let Self { judge, sums, to } = self;
        let left = judge.left_out(sums);
        judge.spread(&left[..sums.len().min(GROUPS)], &equal(sums), &mut to.error);
    }
}

impl Certainty<'_> {
    /// Written values of these sums, the colour premultiplied.
    #[inline(always)]
    fn written(&self, sums: &Sums) -> Rows {
        self.written_of(sums, self.resolved(sums))
    }

    /// Pixels that these sums resolve to.
    #[inline(always)]
    fn resolved(&self, sums: &Sums) -> Rows {
        let mut rows = [[0.0; PIXELS]; 4];
        match self.background {
            Some(behind) => resolve(sums, Some(behind), &mut rows),
            None => resolve(sums, None, &mut rows),
        }
        rows
    }

    /// Written values of sums that resolve to these pixels.
    #[inline(always)]
    fn written_of(&self, sums: &Sums, mut rows: Rows) -> Rows {
        if let (Some(behind), true) = (self.background, self.has_veil) {
            self.write_glass(&veils(sums, behind), behind, &mut rows);
            return rows;
        }
        match (&self.developer, self.background) {
            (Some(developer), _) => developer.coded_lanes(&mut rows),
            (None, None) => {}
            (None, Some(behind)) => {
                let [r, g, b, coverage] = &mut rows;
                for (channel, behind) in [r, g, b].into_iter().zip(behind.to_array()) {
                    for i in 0..PIXELS {
                        channel[i] += behind * (1.0 - coverage[i]);
                    }
                }
                *coverage = [1.0; PIXELS];
            }
        }
        rows
    }

    /// Computes the written values where glass stands before a background.
    #[inline(always)]
    fn write_glass(&self, veils: &[Row; 4], behind: Vec3, rows: &mut Rows) {
        if let Some(developer) = &self.developer {
            return developer.coded_glass(rows, veils);
        }
        let [r, g, b, coverage] = rows;
        for ((channel, behind), veil) in [r, g, b].into_iter().zip(behind.to_array()).zip(veils) {
            for i in 0..PIXELS {
                channel[i] += behind * (1.0 - coverage[i]) + veil[i];
            }
        }
        *coverage = [1.0; PIXELS];
    }

    /// Written values with each of the groups left out in turn.
    #[inline(always)]
    fn left_out(&self, sums: &[Sums]) -> [Rows; GROUPS] {
        let mut all = Sums::EMPTY;
        for group in sums {
            for i in 0..PIXELS {
                all.set(i, all.at(i).plus(group.at(i), 1.0));
            }
        }
        let (mut left, mut rows) = (Sums::EMPTY, [[[0.0; PIXELS]; 4]; GROUPS]);
        for (rows, group) in rows.iter_mut().zip(sums) {
            for i in 0..PIXELS {
                left.set(i, all.at(i).plus(group.at(i), -1.0));
            }
            *rows = self.written(&left);
        }
        rows
    }

    /// Jackknife standard error of the written values of all groups, from those without each of them; 0 where all groups are
    /// [`equal`].
    #[inline(always)]
    #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, reason = "a handful of groups")]
    fn spread(&self, left: &[Rows], equal: &[u32; PIXELS], to: &mut Row) {
        let (n, channels) = (left.len() as f64, self.channels());
        let mut all = [0.0; PIXELS];
        for c in 0..channels {
            let (mut sum, mut squares) = ([0.0; PIXELS], [0.0; PIXELS]);
            for rows in left {
                for i in 0..PIXELS {
                    sum[i] += f64::from(rows[c][i]);
                }
            }
            for rows in left {
                for i in 0..PIXELS {
                    let off = f64::from(rows[c][i]) - sum[i] / n;
                    squares[i] += off * off;
                }
            }
            for i in 0..PIXELS {
                all[i] += squares[i] * (n - 1.0) / n;
            }
        }
        for i in 0..PIXELS {
            let error = (all[i] / channels as f64).sqrt() as f32;
            to[i] = if equal[i] == 1 { 0.0 } else { error };
        }
    }
}

#[inline(always)]
fn resolve(sums: &Sums, background: Option<Vec3>, rows: &mut Rows) {
    let [red, green, blue, coverage] = rows;
    for i in 0..PIXELS {
        [red[i], green[i], blue[i], coverage[i]] = sums.at(i).resolve(background).0;
    }
}

/// Background seen through glass, and the share of the coverage that is glass.
#[inline(always)]
fn veils(sums: &Sums, background: Vec3) -> [Row; 4] {
    let mut rows = [[0.0; PIXELS]; 4];
    let [red, green, blue, glass] = &mut rows;
    for i in 0..PIXELS {
        [red[i], green[i], blue[i], glass[i]] = sums.at(i).resolve(Some(background)).1;
    }
    rows
}

#[inline(always)]
#[expect(clippy::cast_precision_loss, reason = "a handful of groups")]
fn mean(of: &[Rows], to: &mut Rows) {
    *to = [[0.0; PIXELS]; 4];
    for rows in of {
        for (to, row) in to.iter_mut().zip(rows) {
            (0..PIXELS).for_each(|i| to[i] += row[i]);
        }
    }
    for row in to {
        (0..PIXELS).for_each(|i| row[i] /= of.len() as f32);
    }
}

/// By pixel, 1 where all groups are equal.
#[inline(always)]
fn equal(sums: &[Sums]) -> [u32; PIXELS] {
    let mut equal = [1; PIXELS];
    for pair in sums.windows(2) {
        (0..PIXELS).for_each(|i| equal[i] &= u32::from(pair[0].at(i) == pair[1].at(i)));
    }
    equal
}
