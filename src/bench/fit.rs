//! Power laws fitted to measurements.

/// Power law y = factor · x^exponent, by least squares of the logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Exponent: 1 for proportional growth, 0 for none.
    pub exponent: f64,
    /// Value of y at x = 1.
    pub factor: f64,
    /// Standard error of the exponent; NaN for two points, which any such curve fits exactly.
    pub error: f64,
    /// Share of the variance of log y that the law explains; NaN where y does not vary.
    pub r2: f64,
    /// Number of fitted points.
    pub points: usize,
}

impl Fit {
    /// Fits points (x, y); those without finite logarithms are left out. `None` with fewer than two different x left.
    pub fn of(points: &[(f64, f64)]) -> Option<Self> {
        let logs = points.iter().map(|&(x, y)| (x.ln(), y.ln()));
        let logs: Vec<(f64, f64)> = logs.filter(|(x, y)| x.is_finite() && y.is_finite()).collect();
        let n = logs.len() as f64;
        let (mean_x, mean_y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
        let sum = |f: &dyn Fn(f64, f64) -> f64| logs.iter().map(|&(x, y)| f(x - mean_x, y - mean_y)).sum::<f64>();
        let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
        if xx <= 1e-9 {
            return None;
        }
        let exponent = xy / xx;
        let left = sum(&|x, y| (y - exponent * x).powi(2));
        Some(Self {
            exponent,
            factor: (mean_y - exponent * mean_x).exp(),
            error: if logs.len() > 2 { (left / (n - 2.0) / xx).sqrt() } else { f64::NAN },
            r2: if yy > 1e-18 { 1.0 - left / yy } else { f64::NAN },
            points: logs.len(),
        })
    }

    /// Factor by which y grows when x grows tenfold.
    pub fn for_ten_times(&self) -> f64 {
        10f64.powf(self.exponent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn law(factor: f64, exponent: f64, sizes: &[f64]) -> Vec<(f64, f64)> {
        sizes.iter().map(|&x| (x, factor * x.powf(exponent))).collect()
    }

    #[test]
    fn an_exact_power_law_is_found_without_error() {
        for (factor, exponent) in [(3.0, 0.5), (1e-9, 1.0), (40.0, 1.0 / 3.0), (7.0, -0.25)] {
            let fit = Fit::of(&law(factor, exponent, &[1e3, 4e3, 1e5, 1e6])).unwrap();
            assert!((fit.exponent - exponent).abs() < 1e-12 && (fit.factor / factor - 1.0).abs() < 1e-9, "{fit:?}");
            assert!(fit.error < 1e-7 && fit.r2 > 1.0 - 1e-12 && fit.points == 4, "{fit:?}");
            assert!((fit.for_ten_times() - 10f64.powf(exponent)).abs() < 1e-9);
        }
    }

    #[test]
    fn what_does_not_grow_has_exponent_0_and_nothing_to_explain() {
        let fit = Fit::of(&law(5.0, 0.0, &[1e3, 1e4, 1e5])).unwrap();
        assert!(fit.exponent.abs() < 1e-12 && fit.error < 1e-7 && fit.r2.is_nan(), "{fit:?}");
    }

    /// Log y is off the line by +d, −d, −d, +d at even distances: the slope stays, and analytically
    /// error² = (4 d² / 2) / Σ(x − mean)² and 1 − R² = 4 d² / (Σ(x − mean)² + 4 d²).
    #[test]
    fn the_standard_error_is_the_textbooks() {
        let d = 0.1;
        let points: Vec<(f64, f64)> =
            [(0.0, d), (1.0, -d), (2.0, -d), (3.0, d)].map(|(x, o)| (f64::exp(x), f64::exp(x + o))).into();
        let fit = Fit::of(&points).unwrap();
        assert!((fit.exponent - 1.0).abs() < 1e-12);
        assert!((fit.error - (2.0 * d * d / 5.0).sqrt()).abs() < 1e-12, "{fit:?}");
        assert!((fit.r2 - (1.0 - 0.04 / 5.04)).abs() < 1e-12, "{fit:?}");
    }

    #[test]
    fn what_has_no_logarithm_is_left_out_and_one_size_is_not_enough() {
        let fit = Fit::of(&[(10.0, 0.0), (100.0, 2.0), (1000.0, f64::NAN), (10_000.0, 200.0)]).unwrap();
        assert!((fit.exponent - 1.0).abs() < 1e-12 && fit.points == 2 && fit.error.is_nan());
        for few in [&[][..], &[(10.0, 1.0)], &[(10.0, 1.0), (10.0, 2.0)], &[(10.0, 0.0), (20.0, 0.0)]] {
            assert_eq!(Fit::of(few), None, "{few:?}");
        }
    }
}
