//! Share of uniform light that the microfacets of a rough surface reflect: directly ([`albedo`]), and after several bounces
//! between them ([`rebound`]).

use crate::math::Vec3;
use crate::math::formula::{floor, integer};
use crate::math::simd::{LANES, Row as Eight, Simd};

/// Directional albedo of the microfacet lobe as (scale of f0, scale of f90), the split sum of B. Karis, "Real Shading in
/// Unreal Engine 4" (2013): rows by roughness 0 … 1, columns by the square root of N·V.
const ALBEDO: [[(f32, f32); 9]; 9] = [
    [
        (0.000, 1.000),
        (0.076, 0.924),
        (0.276, 0.724),
        (0.531, 0.469),
        (0.763, 0.237),
        (0.916, 0.084),
        (0.984, 0.016),
        (0.999, 0.001),
        (1.000, 0.000),
    ],
    [
        (0.197, 0.774),
        (0.166, 0.716),
        (0.298, 0.664),
        (0.536, 0.455),
        (0.762, 0.235),
        (0.915, 0.084),
        (0.983, 0.016),
        (0.999, 0.001),
        (1.000, 0.000),
    ],
    [
        (0.472, 0.508),
        (0.446, 0.487),
        (0.450, 0.432),
        (0.574, 0.342),
        (0.757, 0.204),
        (0.901, 0.081),
        (0.973, 0.018),
        (0.993, 0.001),
        (0.996, 0.000),
    ],
    [
        (0.669, 0.313),
        (0.654, 0.301),
        (0.642, 0.264),
        (0.667, 0.208),
        (0.753, 0.137),
        (0.859, 0.065),
        (0.930, 0.018),
        (0.965, 0.002),
        (0.976, 0.000),
    ],
    [
        (0.790, 0.192),
        (0.777, 0.183),
        (0.762, 0.158),
        (0.751, 0.122),
        (0.761, 0.081),
        (0.801, 0.042),
        (0.852, 0.015),
        (0.891, 0.002),
        (0.916, 0.000),
    ],
    [
        (0.860, 0.122),
        (0.844, 0.115),
        (0.818, 0.096),
        (0.780, 0.072),
        (0.752, 0.047),
        (0.744, 0.025),
        (0.753, 0.010),
        (0.772, 0.002),
        (0.796, 0.000),
    ],
    [
        (0.899, 0.082),
        (0.878, 0.076),
        (0.832, 0.062),
        (0.768, 0.044),
        (0.716, 0.028),
        (0.675, 0.015),
        (0.646, 0.006),
        (0.631, 0.001),
        (0.627, 0.000),
    ],
    [
        (0.921, 0.060),
        (0.891, 0.054),
        (0.821, 0.042),
        (0.735, 0.028),
        (0.658, 0.017),
        (0.590, 0.009),
        (0.534, 0.004),
        (0.488, 0.001),
        (0.452, 0.000),
    ],
    [
        (0.933, 0.047),
        (0.893, 0.041),
        (0.795, 0.030),
        (0.686, 0.019),
        (0.587, 0.011),
        (0.499, 0.005),
        (0.423, 0.002),
        (0.360, 0.001),
        (0.307, 0.000),
    ],
];

/// [`ALBEDO`] at any roughness and N·V between its entries, off by at most 0.05.
pub(crate) fn albedo(roughness: f32, n_v: f32) -> (f32, f32) {
    let row = Row::of(roughness);
    between(n_v, |column| row.entry(column))
}

/// Position of a roughness among the rows of [`ALBEDO`].
#[derive(Clone, Copy)]
struct Row {
    row: usize,
    rest: f32,
}

#[inline(always)]
fn mix(a: (f32, f32), b: (f32, f32), t: f32) -> (f32, f32) {
    (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t)
}

impl Row {
    #[inline(always)]
    fn of(roughness: f32) -> Self {
        let (row, rest) = row(roughness);
        Self { row: row as usize, rest }
    }

    fn entry(self, column: usize) -> (f32, f32) {
        mix(ALBEDO[self.row][column], ALBEDO[self.row + 1][column], self.rest)
    }
}

/// [`albedo`] of one roughness for many points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AlbedoRow {
    /// Both values at all columns of [`ALBEDO`] but the last, and their differences to the next ones.
    from: [Eight; 2],
    rise: [Eight; 2],
}

impl AlbedoRow {
    pub(crate) fn of(roughness: f32) -> Self {
        let row = Row::of(roughness);
        let (mut from, mut rise) = ([[0.0; LANES]; 2], [[0.0; LANES]; 2]);
        for column in 0..LANES {
            let (here, next) = (row.entry(column), row.entry(column + 1));
            (from[0][column], from[1][column]) = here;
            (rise[0][column], rise[1][column]) = (next.0 - here.0, next.1 - here.1);
        }
        Self { from, rise }
    }

    /// Both values at each of eight N·V.
    #[inline(always)]
    pub(crate) fn at_each<S: Simd>(&self, s: S, n_v: &Eight) -> [Eight; 2] {
        let (mut columns, mut rests) = ([0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            (columns[i], rests[i]) = column(n_v[i]);
        }
        let (rest, mut found) = (s.load(&rests), [[0.0; LANES]; 2]);
        for ((found, from), rise) in found.iter_mut().zip(&self.from).zip(&self.rise) {
            *found = s.store(s.add(s.among(from, &columns), s.mul(s.among(rise, &columns), rest)));
        }
        found
    }
}

/// For each cell between entries of [`ALBEDO`], row by row, the entries at its corners: left and right in the upper row, then in
/// the lower one.
const SQUARES: [[[f32; 4]; 2]; 64] = {
    let (mut squares, mut i) = ([[[0.0; 4]; 2]; 64], 0);
    while i < 128 {
        let (square, lower) = (i / 2, i % 2);
        let (left, right) = (ALBEDO[square / 8 + lower][square % 8], ALBEDO[square / 8 + lower][square % 8 + 1]);
        squares[square][lower] = [left.0, left.1, right.0, right.1];
        i += 1;
    }
    squares
};

/// [`albedo`] at each of eight roughnesses and N·V.
#[inline(always)]
pub(crate) fn albedo_of_each<S: Simd>(s: S, roughness: &Eight, n_v: &Eight) -> [Eight; 2] {
    let (mut squares, mut down, mut across) = ([0; LANES], [0.0; LANES], [0.0; LANES]);
    for i in 0..LANES {
        let ((row, below), (column, behind)) = (row(roughness[i]), column(n_v[i]));
        (squares[i], down[i], across[i]) = (8 * row + column, below, behind);
    }
    let corners = |i: usize| &SQUARES[squares[i] as usize % SQUARES.len()];
    let upper = s.columns(std::array::from_fn(|i| &corners(i)[0]));
    let lower = s.columns(std::array::from_fn(|i| &corners(i)[1]));
    let (down, across, mut found) = (s.load(&down), s.load(&across), [[0.0; LANES]; 2]);
    for (k, found) in found.iter_mut().enumerate() {
        let left = s.add(upper[k], s.mul(s.sub(lower[k], upper[k]), down));
        let right = s.add(upper[k + 2], s.mul(s.sub(lower[k + 2], upper[k + 2]), down));
        *found = s.store(s.add(left, s.mul(s.sub(right, left), across)));
    }
    found
}

/// Row of [`ALBEDO`] before this roughness, never the last, and the distance behind it.
#[inline(always)]
fn row(roughness: f32) -> (u32, f32) {
    before(roughness.clamp(0.0, 1.0) * 8.0)
}

/// Column of [`ALBEDO`] before this N·V, never the last, and the distance behind it.
#[inline(always)]
fn column(n_v: f32) -> (u32, f32) {
    before(n_v.clamp(0.0, 1.0).sqrt() * 8.0)
}

/// Whole part of `x`, 0 … 8, at most 7, and the rest.
#[inline(always)]
fn before(x: f32) -> (u32, f32) {
    let whole = floor(x);
    let whole = if whole < 7.0 { whole } else { 7.0 };
    (integer(whole).cast_unsigned(), x - whole)
}

/// Interpolates between the two entries that are nearest to N·V.
#[inline(always)]
fn between(n_v: f32, entry: impl Fn(usize) -> (f32, f32)) -> (f32, f32) {
    let (column, rest) = column(n_v);
    mix(entry(column as usize), entry(column as usize + 1), rest)
}

/// Mean of a white lobe's albedo over the hemisphere, weighted by the cosine, for roughness 0, 1/8, … 1: the integral
/// of 2 E(μ) μ over [`ALBEDO`]'s rows.
const MEAN_ALBEDO: [f32; 9] = [1.000, 0.999, 0.987, 0.951, 0.883, 0.781, 0.657, 0.529, 0.410];

/// Mean over the hemisphere of the albedo of a white lobe of any roughness.
#[inline(always)]
pub(crate) fn mean_albedo(roughness: f32) -> f32 {
    let Row { row, rest } = Row::of(roughness);
    MEAN_ALBEDO[row] + (MEAN_ALBEDO[row + 1] - MEAN_ALBEDO[row]) * rest
}

/// Share of uniform light that leaves a metal after more than one bounce between its facets, relative to the loss of the first
/// bounce.
///
/// The microfacet model follows light to one facet only and so loses light that hits a second: two thirds on the roughest metal.
/// Here each further bounce is coloured once more (C. Fdez-Agüera, "A Multiple-Scattering Microfacet Model for Real-Time
/// Image-Based Lighting", 2019); `mean` is [`mean_albedo`], `f0` the metal's colour at normal incidence.
#[inline(always)]
pub(super) fn rebound(mean: f32, f0: Vec3) -> Vec3 {
    // Mean of Schlick's reflectance over the hemisphere.
    let f0 = f0.min(Vec3::ONE);
    let once = f0 + (Vec3::ONE - f0) / 21.0;
    once * once * mean / (Vec3::ONE - once * (1.0 - mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::{Kernel, Level};

    #[test]
    fn the_mean_albedo_is_that_of_the_table() {
        for (i, known) in (0u8..).zip(MEAN_ALBEDO) {
            let at = |step: u16| {
                let mu = (f32::from(step) + 0.5) / 4000.0;
                let (scale, bias) = albedo(f32::from(i) / 8.0, mu);
                f64::from((scale + bias) * mu)
            };
            let mean = (0..4000).map(at).sum::<f64>() * 2.0 / 4000.0;
            assert!((mean - f64::from(known)).abs() < 1e-3, "{i}: {mean} for {known}");
        }
    }

    struct AtEach<'a>(&'a AlbedoRow, &'a Eight);

    impl Kernel for AtEach<'_> {
        type Output = [Eight; 2];

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> [Eight; 2] {
            self.0.at_each(s, self.1)
        }
    }

    struct OfEach<'a>(&'a Eight, &'a Eight);

    impl Kernel for OfEach<'_> {
        type Output = [Eight; 2];

        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> [Eight; 2] {
            albedo_of_each(s, self.0, self.1)
        }
    }

    #[test]
    fn every_instruction_set_finds_the_same_albedos_side_by_side_as_one_by_one() {
        let eights = [
            [0.0, 1e-40, 1e-30, 1e-3, 0.3, 0.7, 1.0f32.next_down(), 1.0],
            std::array::from_fn(|k| (k as f32 / 8.0).powi(2)),
            std::array::from_fn(|k| (k as f32 / 8.0).powi(2).next_down()),
        ];
        for roughness in [0.0, 0.05, 0.3, 0.5, 0.99, 1.0] {
            let row = AlbedoRow::of(roughness);
            for n_v in &eights {
                let alone = n_v.map(|n_v| albedo(roughness, n_v));
                for level in Level::all() {
                    check(level, level.run(AtEach(&row, n_v)), &alone);
                    check(level, level.run(OfEach(&[roughness; LANES], n_v)), &alone);
                }
            }
        }
        // Each with another roughness.
        let roughness = [0.0, 0.125, 0.124, 0.5, 0.51, 0.875, 0.999, 1.0];
        for n_v in &eights {
            let alone = std::array::from_fn(|i| albedo(roughness[i], n_v[i]));
            Level::all().into_iter().for_each(|level| check(level, level.run(OfEach(&roughness, n_v)), &alone));
        }
    }

    fn check(level: Level, [scale, bias]: [Eight; 2], alone: &[(f32, f32); LANES]) {
        let same = |i: usize| (scale[i].to_bits(), bias[i].to_bits()) == (alone[i].0.to_bits(), alone[i].1.to_bits());
        assert!((0..LANES).all(same), "{}: {scale:?} {bias:?}, {alone:?}", level.name());
    }

    #[test]
    fn white_metal_sends_everything_back_and_colours_deepen() {
        for roughness in [0.0, 0.3, 0.6, 1.0] {
            let (scale, bias) = albedo(roughness, 0.7);
            assert!((rebound(mean_albedo(roughness), Vec3::ONE).x - 1.0).abs() < 1e-6 && scale + bias <= 1.0);
        }
        let gold = rebound(mean_albedo(0.8), Vec3::new(1.0, 0.7, 0.3));
        assert!(gold.y / gold.x < 0.7 && gold.z / gold.y < 0.3 / 0.7, "{gold}");
    }
}
