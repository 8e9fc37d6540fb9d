//! Separable filters: the product of one along rows and one along columns.

use rayon::prelude::*;

/// Weights at the offsets from `-radius` to `radius`, for each of the `N` values of a pixel.
pub(super) type Taps<const N: usize> = Vec<[f32; N]>;

/// Direction of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Along {
    Rows,
    Columns,
}

/// Filters pixels of `width` columns; beyond the edge the pixel at the edge is repeated.
pub(super) fn filtered<const N: usize>(
    width: usize,
    pixels: &[[f32; N]],
    taps: &[[f32; N]],
    along: Along,
) -> Vec<[f32; N]> {
    let height = pixels.len().checked_div(width).unwrap_or(0);
    let radius = taps.len() / 2;
    let mut out = vec![[0.0; N]; pixels.len()];
    out.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, row)| {
        for (x, value) in row.iter_mut().enumerate() {
            for (k, tap) in taps.iter().enumerate() {
                let moved = |at: usize, end: usize| (at + k).saturating_sub(radius).min(end - 1);
                let from = match along {
                    Along::Rows => y * width + moved(x, width),
                    Along::Columns => moved(y, height) * width + x,
                };
                let pixel = &pixels[from];
                for n in 0..N {
                    value[n] += tap[n] * pixel[n];
                }
            }
        }
    });
    out
}

/// Gaussian `exp(-x² / 2σ²)` at the offsets from `-radius` to `radius`.
pub(super) fn bell(sigma: f64, radius: usize) -> Vec<f64> {
    places(radius).map(|x| libm::exp(-x * x / (2.0 * sigma * sigma))).collect()
}

/// Offsets from `-radius` to `radius`.
pub(super) fn places(radius: usize) -> impl Iterator<Item = f64> {
    (0..=2 * radius).map(move |k| k as f64 - radius as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_filter_moves_along_its_axis_and_holds_on_at_the_edge() {
        let pixels = [[1.0], [2.0], [3.0], [4.0], [5.0], [6.0]];
        let next = [[0.0], [0.0], [1.0]];
        let flat = |v: Vec<[f32; 1]>| v.into_iter().map(|[x]| x).collect::<Vec<_>>();
        assert_eq!(flat(filtered(3, &pixels, &next, Along::Rows)), [2.0, 3.0, 3.0, 5.0, 6.0, 6.0]);
        assert_eq!(flat(filtered(3, &pixels, &next, Along::Columns)), [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
    }
}
