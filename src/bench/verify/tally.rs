//! Tallies of answers against exact hits.

use std::ops::Add;

use crate::accel::{Hit, Ray};
use crate::bench::oracle::{Oracle, Truth, ulps};

/// Least difference in distance for a hit to count as behind another, in units in the last place: the rounding of two distances
/// can hide less.
const ORDER_ULPS: f64 = 2.0;

/// Counts over a set of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Number of rays.
    pub rays: usize,
    /// Rays that hit, by exact arithmetic.
    pub hits: usize,
    /// Rays that hit but were answered with a miss.
    pub missed: usize,
    /// Answers with a triangle that the ray does not hit in its range.
    pub false_hits: usize,
    /// Answers with a triangle behind the nearest one.
    pub wrong_order: usize,
    /// Largest error of t over true hits, in units in the last place.
    pub max_ulps: f64,
    /// Sum of the squared errors of t.
    pub sum_squares: f64,
    /// Answers with true hits, over which [`Self::sum_squares`] is taken.
    pub measured: usize,
}

impl Tally {
    /// Judges answers; there may be fewer answers than rays.
    pub fn of(oracle: &Oracle, rays: &[Ray], truths: &[Option<Truth>], answers: &[Hit]) -> Self {
        let each = rays.iter().zip(truths).zip(answers);
        each.fold(Self::default(), |sum, ((ray, truth), hit)| sum + Self::one(oracle, ray, truth.as_ref(), hit))
    }

    fn one(oracle: &Oracle, ray: &Ray, truth: Option<&Truth>, hit: &Hit) -> Self {
        let mut tally = Self { rays: 1, hits: usize::from(truth.is_some()), ..Self::default() };
        if !hit.is_some() {
            tally.missed = usize::from(truth.is_some());
            return tally;
        }
        let Some(t) = oracle.meets(ray, hit.prim) else {
            tally.false_hits = 1;
            return tally;
        };
        let error = ulps(hit.t, t);
        (tally.max_ulps, tally.sum_squares, tally.measured) = (error, error * error, 1);
        #[expect(clippy::cast_possible_truncation, reason = "compared in units of f32")]
        let behind = truth.is_some_and(|nearest| t > nearest.t && ulps(nearest.t as f32, t) > ORDER_ULPS);
        tally.wrong_order = usize::from(behind);
        tally
    }

    /// Whether no answer is wrong.
    pub fn is_clean(&self) -> bool {
        (self.missed, self.false_hits, self.wrong_order) == (0, 0, 0)
    }

    /// Number of wrong answers of any kind.
    pub fn wrong(&self) -> usize {
        self.missed + self.false_hits + self.wrong_order
    }

    /// Root mean square error of t, in units in the last place.
    #[expect(clippy::cast_precision_loss, reason = "a mean")]
    pub fn rms_ulps(&self) -> f64 {
        (self.sum_squares / self.measured.max(1) as f64).sqrt()
    }
}

impl Add for Tally {
    type Output = Self;

    fn add(self, o: Self) -> Self {
        Self {
            rays: self.rays + o.rays,
            hits: self.hits + o.hits,
            missed: self.missed + o.missed,
            false_hits: self.false_hits + o.false_hits,
            wrong_order: self.wrong_order + o.wrong_order,
            max_ulps: self.max_ulps.max(o.max_ulps),
            sum_squares: self.sum_squares + o.sum_squares,
            measured: self.measured + o.measured,
        }
    }
}

/// Rate per million; if no event was seen, the bound 3/n at 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    /// Observed rate per million.
    Seen(f64),
    /// No event seen; upper bound per million.
    Below(f64),
}

impl Rate {
    /// Rate of `count` events in `rays` rays.
    #[expect(clippy::cast_precision_loss, reason = "a rate")]
    pub fn new(count: usize, rays: usize) -> Self {
        let million = 1e6 / rays.max(1) as f64;
        if count == 0 { Self::Below(3.0 * million) } else { Self::Seen(count as f64 * million) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::tests::scenes;
    use crate::math::Vec3;

    #[test]
    fn every_kind_of_wrong_answer_is_counted_as_what_it_is() {
        let shapes = scenes::star(12, 8);
        let oracle = Oracle::new(&shapes);
        let through = scenes::ray(Vec3::new(0.1, 0.05, 4.0), Vec3::NEG_Z);
        let past = scenes::ray(Vec3::new(0.1, 9.0, 4.0), Vec3::NEG_Z);
        let truth = oracle.nearest(&through).unwrap();
        let back = oracle.nearest(&Ray { t_min: truth.t as f32 + 0.1, ..through }).unwrap();
        let answer = |t: f64, prim| Hit { t: t as f32, u: 0.0, v: 0.0, prim };
        let judge = |ray: &Ray, hit| Tally::of(&oracle, &[*ray], &[oracle.nearest(ray)], &[hit]);

        let right = judge(&through, answer(truth.t, truth.prim));
        assert!(right.is_clean() && right.hits == 1 && right.max_ulps <= 0.5);
        assert_eq!(judge(&through, Hit::MISS).missed, 1);
        assert_eq!(judge(&through, answer(back.t, back.prim)).wrong_order, 1);
        assert_eq!(judge(&past, answer(1.0, 3)).false_hits, 1);
        assert!(judge(&past, Hit::MISS).is_clean());
        let late = judge(&through, answer(truth.t * (1.0 + 1e-5), truth.prim));
        assert!(late.is_clean() && late.max_ulps > 50.0 && late.rms_ulps() == late.max_ulps, "{late:?}");
    }

    #[test]
    fn a_rate_of_nothing_is_a_bound() {
        assert_eq!(Rate::new(0, 3000), Rate::Below(1000.0));
        assert_eq!(Rate::new(6, 3_000_000), Rate::Seen(2.0));
    }
}
