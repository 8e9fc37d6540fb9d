//! Positions of the samples in a pixel: the same in every pixel, and not random.

/// Positions of `count` samples in the unit square, (x, y) from the top left; their mean is the pixel's centre for square counts.
///
/// A square number of samples lies on a regular grid, row by row. Any other number lies on a rank-1 lattice (Korobov 1959): one
/// sample in each of `count` columns and rows, with a row step of the number nearest `count` over the golden ratio that is
/// coprime to it, which keeps any two samples apart.
pub(crate) fn sample_offsets(count: u32) -> Vec<(f64, f64)> {
    let count = count.max(1);
    let side = (1..).take_while(|i: &u64| i * i <= u64::from(count)).last().unwrap_or(1);
    if side * side == u64::from(count) {
        let at = |i: u64| (center(i % side, side), center(i / side, side));
        return (0..side * side).map(at).collect();
    }
    let n = u64::from(count);
    let step = lattice_step(n);
    (0..n).map(|i| (center(i, n), center(i * step % n, n))).collect()
}

/// Centre of the `i`th of `n` equal parts of 0…1.
#[expect(clippy::cast_precision_loss, reason = "sample counts are far below 2^52")]
fn center(i: u64, n: u64) -> f64 {
    (i as f64 + 0.5) / n as f64
}

/// The number nearest n/φ that is coprime to n.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "0 < n < 2^32"
)]
fn lattice_step(n: u64) -> u64 {
    let golden = (n as f64 * 0.618_033_988_749_894_9).round() as u64;
    let near = (0..n).flat_map(|d| [golden + d, golden.saturating_sub(d)]);
    near.filter(|&s| s > 0).find(|&s| gcd(s, n) == 1).unwrap_or(1)
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_sample_lies_in_the_middle() {
        assert_eq!(sample_offsets(1), [(0.5, 0.5)]);
        assert_eq!(sample_offsets(0), [(0.5, 0.5)]);
    }

    #[test]
    fn square_counts_lie_on_a_grid() {
        assert_eq!(sample_offsets(4), [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)]);
        assert_eq!(sample_offsets(9)[5], (5.0 / 6.0, 0.5));
    }

    #[test]
    fn other_counts_put_one_sample_into_each_row_and_column() {
        for count in [2, 3, 5, 6, 7, 8, 10, 12, 33, 100_000] {
            let samples = sample_offsets(count);
            for axis in [0, 1] {
                let cell = |s: &(f64, f64)| ((if axis == 0 { s.0 } else { s.1 }) * f64::from(count)).floor() as u32;
                let mut cells: Vec<u32> = samples.iter().map(cell).collect();
                cells.sort_unstable();
                assert_eq!(cells, (0..count).collect::<Vec<_>>(), "{count} samples, axis {axis}");
            }
        }
    }
}
