//! Diffuse irradiance of a panorama, as a table over normals.
//!
//! The sum of a normal is taken over cells, each of which keeps the vector integral of its light, so that a sun shines from its
//! own direction and not from the middle of its cell.

use super::lookups::{LOOKUPS, Lookups, Row, Taps};
use super::panorama::{Level, Pyramid};
use crate::math::simd::{self, Kernel, LANES, Simd};
use crate::math::{Vec3, Vec4};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Columns and rows of the table.
const TABLE: (u32, u32) = (128, 64);

/// Columns and rows of the cells.
const CELLS: (u32, u32) = (64, 32);

/// Columns and rows of sample places in a cell, looked up side by side.
const FINER: u32 = 8;
const _: () = assert!((FINER * FINER) as usize == LOOKUPS);

/// Number of normals summed at a time.
const NORMALS: usize = 2 * LANES;

/// Cosine-weighted mean radiance around each normal.
pub(super) fn table(sky: &Pyramid) -> Level {
    let cells = cells(sky);
    let table = Level::without_texels(TABLE);
    let middle = |row: u32, column: u32| table.direction(column as f32 + 0.5, row as f32 + 0.5);
    // The sum of constant radiance 1 is the same all along a row.
    let even = cells.iter().map(|cell| [cell.even]).collect::<Vec<_>>();
    let wholes: Vec<f32> = (0..TABLE.1).map(|row| sums(&even, &[middle(row, 0)])[0][0]).collect();
    let light = cells.iter().map(|cell| cell.light).collect::<Vec<_>>();
    let row = |row: u32| {
        let normals: Vec<Vec3> = (0..TABLE.0).map(|column| middle(row, column)).collect();
        let means = normals.chunks(NORMALS).flat_map(|normals| {
            let sums = sums(&light, normals);
            (0..normals.len()).map(move |i| sums.map(|of| of[i]))
        });
        means.map(|sum| sum.map(|channel| channel / wholes[row as usize])).collect::<Vec<_>>()
    };
    let texels = (0..TABLE.1).into_par_iter().flat_map_iter(row).collect();
    table.made_of(texels)
}

/// Vector integrals over a cell: of the light of each channel, and of constant radiance 1.
#[derive(Clone, Copy)]
struct Cell {
    light: [Vec3; 3],
    even: Vec3,
}

/// All cells, row by row.
fn cells(sky: &Pyramid) -> Vec<Cell> {
    let fine = Level::without_texels((CELLS.0 * FINER, CELLS.1 * FINER));
    let part = |i: u32, of: u32| (i as f32 + 0.5) / of as f32;
    let turns: Vec<(f32, f32)> =
        (0..fine.width).map(|x| libm::sincosf((part(x, fine.width) - 0.5) * 2.0 * PI)).collect();
    let places: Vec<(u32, u32)> = (0..CELLS.1).flat_map(|row| (0..CELLS.0).map(move |column| (row, column))).collect();
    let cell = |(row, column): (u32, u32)| {
        let mut look = LookUpCell { sky, angle: fine.angle(), lookups: Lookups::NONE, areas: [[0.0; LOOKUPS]; 3] };
        for j in 0..FINER {
            let y = row * FINER + j;
            let (sin_down, cos_down) = libm::sincosf(part(y, fine.height) * PI);
            let area = fine.area(y);
            for i in 0..FINER {
                let (x, k) = (column * FINER + i, (j * FINER + i) as usize);
                let (sin, cos) = turns[x as usize];
                (look.lookups.around[k], look.lookups.down[k]) = (part(x, fine.width), part(y, fine.height));
                let by_area = [sin_down * cos, cos_down, sin_down * sin].map(|axis| axis * area);
                (0..3).for_each(|axis| look.areas[axis][k] = by_area[axis]);
            }
        }
        simd::Level::best().run(look)
    };
    places.into_par_iter().map(cell).collect()
}

/// Looks up all places of a cell.
struct LookUpCell<'a> {
    sky: &'a Pyramid,
    /// Angle across a place, radians.
    angle: f32,
    lookups: Lookups,
    /// Directions of the places, each as long as its solid angle, by axis.
    areas: [Row; 3],
}

impl Kernel for LookUpCell<'_> {
    type Output = Cell;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Cell {
        let Self { sky, angle, lookups, areas: [x, y, z] } = &self;
        let (fine, between) = sky.level(*angle);
        let levels = [sky.copy(fine), sky.copy(fine + 1)];
        let mut taps = [Taps::NONE, Taps::NONE];
        for (taps, level) in taps.iter_mut().zip(levels).take(1 + usize::from(between > 0.0)) {
            taps.find(lookups, &[0; LOOKUPS], [level.width, level.height]);
        }
        let ([mut red, mut green, mut blue], mut even) = ([Vec4::ZERO; 3], Vec4::ZERO);
        for k in 0..LOOKUPS {
            let sharp = taps[0].read(k, levels[0].texels());
            let seen = if between > 0.0 { sharp.lerp(taps[1].read(k, levels[1].texels()), between) } else { sharp };
            let by_area = Vec4::new(x[k], y[k], z[k], 0.0);
            even += by_area;
            red += by_area * seen.x;
            green += by_area * seen.y;
            blue += by_area * seen.z;
        }
        Cell { light: [red.truncate(), green.truncate(), blue.truncate()], even: even.truncate() }
    }
}

/// Cosine-weighted sums of each of `N` lights, given as vector integrals `from`, at these normals ([`NORMALS`] at most).
fn sums<const N: usize>(from: &[[Vec3; N]], normals: &[Vec3]) -> [[f32; NORMALS]; N] {
    simd::Level::best().run(Sums { from, normals })
}

struct Sums<'a, const N: usize> {
    from: &'a [[Vec3; N]],
    normals: &'a [Vec3],
}

impl<const N: usize> Kernel for Sums<'_, N> {
    type Output = [[f32; NORMALS]; N];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [[f32; NORMALS]; N] {
        let mut axes = [[[0.0; LANES]; 3]; 2];
        for (i, normal) in self.normals.iter().enumerate().take(NORMALS) {
            let half = &mut axes[i / LANES];
            (half[0][i % LANES], half[1][i % LANES], half[2][i % LANES]) = (normal.x, normal.y, normal.z);
        }
        let zero = s.splat(0.0);
        let [[ax, ay, az], [bx, by, bz]] = axes;
        let (ax, ay, az) = (s.load(&ax), s.load(&ay), s.load(&az));
        let (bx, by, bz) = (s.load(&bx), s.load(&by), s.load(&bz));
        let mut sums = [[zero; 2]; N];
        for lights in self.from {
            for (sum, light) in sums.iter_mut().zip(lights) {
                let (x, y, z) = (s.splat(light.x), s.splat(light.y), s.splat(light.z));
                let a = s.add(s.add(s.mul(ax, x), s.mul(ay, y)), s.mul(az, z));
                let b = s.add(s.add(s.mul(bx, x), s.mul(by, y)), s.mul(bz, z));
                sum[0] = s.add(sum[0], s.greater(a, zero));
                sum[1] = s.add(sum[1], s.greater(b, zero));
            }
        }
        let mut all = [[0.0; NORMALS]; N];
        for (of, [a, b]) in all.iter_mut().zip(sums) {
            of[..LANES].copy_from_slice(&s.store(a));
            of[LANES..].copy_from_slice(&s.store(b));
        }
        all
    }
}
