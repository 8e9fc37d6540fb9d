//! Number of standard errors for a confidence level when a pixel is judged repeatedly.

use super::GROUPS;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Degrees of freedom of an estimate from [`GROUPS`] means. The closed forms below hold for seven.
const FREEDOM: f64 = (GROUPS - 1) as f64;
const _: () = assert!(GROUPS == 8);

/// Number of estimated standard errors that must fit into the allowed error, so that a pixel that stops at the first round where
/// they do is within that error with probability `confidence`.
///
/// If ρ true standard errors fit into the allowed error, a round stops wrongly when the estimated standard error is at most ρ/f
/// of the true one, and the mean is off by more than ρ true ones: two events that are independent for normal means. From round to
/// round the samples double, which divides the standard error by at least √2. The probabilities of all rounds are added, the
/// worst initial ρ is taken, and f is found for which that is 1 − `confidence`; it is never less than Student's t, which a single
/// round would need.
///
/// The search takes a sixth of a millisecond, once for a picture; its result for the usual confidence is a constant.
pub(in crate::render) fn factor(confidence: f64) -> f32 {
    const USUAL: f64 = 0.95;
    const OF_USUAL: f32 = 2.364_624_3;
    if confidence == USUAL { OF_USUAL } else { found(confidence) }
}

#[expect(clippy::cast_possible_truncation, reason = "a small number")]
fn found(confidence: f64) -> f32 {
    let wrong = 1.0 - confidence;
    let student = zero(|t| 1.0 - student_within(t) - wrong);
    let looks = RoundSequences::new();
    student.max(zero(|f| looks.wrong_stops(f) - wrong)) as f32
}

/// Sequences of rounds of pixels that start with different errors.
struct RoundSequences {
    /// For each start, ρ at each round, and the probability that the mean is off by more than that.
    of_start: Vec<Vec<(f64, f64)>>,
}

impl RoundSequences {
    fn new() -> Self {
        /// Factor by which each round lowers the standard error at least.
        const GAIN: f64 = std::f64::consts::SQRT_2;
        const STARTS: u32 = 32;
        let looks =
            |start: f64| std::iter::successors(Some(start), |rho| Some(rho * GAIN)).take_while(|rho| *rho < 9.0);
        let starts = (0..STARTS).map(|k| 0.05 * libm::pow(GAIN, f64::from(k) / f64::from(STARTS)));
        let of_start = starts.map(|start| looks(start).map(|rho| (rho, normal_beyond(rho))).collect());
        Self { of_start: of_start.collect() }
    }

    /// Upper bound of the probability that any round stops wrongly.
    fn wrong_stops(&self, factor: f64) -> f64 {
        let look = |(rho, beyond): &(f64, f64)| chi_square_below(FREEDOM * (rho / factor) * (rho / factor)) * beyond;
        self.of_start.iter().map(|looks| looks.iter().map(look).sum::<f64>()).fold(0.0, f64::max)
    }
}

/// Root of a falling function that is positive at ¼, in ¼…1000 (1000 where there is none).
///
/// By the secant of the bracket, where an endpoint that stays for long counts half (the Illinois method; M. Dowell, P. Jarratt,
/// "A Modified Regula Falsi Method for Computing the Root of an Equation", 1971).
fn zero(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut above) = (0.25, f(0.25));
    let (mut high, mut below) = (low, above);
    while below > 0.0 {
        (low, above) = (high, below);
        high *= 2.0;
        if high > 1000.0 {
            return 1000.0;
        }
        below = f(high);
    }
    let mut stayed = 0;
    for _ in 0..60 {
        if high - low <= 1e-12 * high {
            break;
        }
        let middle = (low * below - high * above) / (below - above);
        let value = f(middle);
        if value > 0.0 {
            (low, above) = (middle, value);
            below *= if stayed == 1 { 0.5 } else { 1.0 };
            stayed = 1;
        } else {
            (high, below) = (middle, value);
            above *= if stayed == -1 { 0.5 } else { 1.0 };
            stayed = -1;
        }
    }
    high
}

/// Probability that a normal variate is more than `x` ≥ 0 standard deviations off.
fn normal_beyond(x: f64) -> f64 {
    libm::erfc(x * FRAC_1_SQRT_2)
}

/// Probability of χ² with 7 degrees of freedom below `x` ≥ 0.
fn chi_square_below(x: f64) -> f64 {
    let tail = (2.0 * x / PI).sqrt() * libm::exp(-0.5 * x) * (1.0 + x / 3.0 + x * x / 15.0);
    (libm::erf((0.5 * x).sqrt()) - tail).max(0.0)
}

/// Probability of Student's t with 7 degrees of freedom within ±`t`.
fn student_within(t: f64) -> f64 {
    let angle = libm::atan(t / FREEDOM.sqrt());
    let (sin, cos) = libm::sincos(angle);
    let series = cos * (1.0 + cos * cos * (2.0 / 3.0 + cos * cos * 8.0 / 15.0));
    2.0 / PI * (angle + sin * series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distributions_agree_with_published_tables() {
        // Student's t and χ² for 7 degrees of freedom, and the normal distribution.
        for (t, within) in [(2.365, 0.95), (3.499, 0.99), (1.895, 0.90)] {
            assert!((student_within(t) - within).abs() < 1e-4, "{t}");
        }
        for (x, below) in [(14.067, 0.95), (2.167, 0.05), (6.346, 0.50)] {
            assert!((chi_square_below(x) - below).abs() < 1e-4, "{x}");
        }
        assert!((normal_beyond(1.96) - 0.05).abs() < 1e-4);
    }

    #[test]
    fn what_is_known_of_the_usual_confidence_is_what_a_search_finds() {
        assert_eq!(factor(0.95), found(0.95));
    }

    #[test]
    fn more_confidence_asks_for_more_standard_errors_and_never_less_than_students() {
        let factors = [0.8, 0.9, 0.95, 0.99, 0.999].map(factor);
        assert!(factors.windows(2).all(|pair| pair[0] < pair[1]), "{factors:?}");
        assert!(factors[2] > 2.364);
        for confidence in [0.8, 0.95, 0.99] {
            assert!(RoundSequences::new().wrong_stops(factor(confidence).into()) <= 1.0 - confidence + 1e-6);
        }
    }
}
