//! Interpolation of a value between keyframes (glTF 2.0, appendix C), in `f64`.

use crate::math::DQuat;

/// Interpolation between keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Interpolation {
    /// The value of the previous key.
    Step,
    /// Linear; rotations along the shorter arc.
    Linear,
    /// Cubic Hermite splines: every key has an in-tangent before its value and an out-tangent after it.
    CubicSpline,
}

impl Interpolation {
    /// Returns the interpolation of this name; linear, the default, for unknown names, which the schema check reports.
    pub(super) fn of(name: Option<&str>) -> Self {
        match name {
            Some("STEP") => Self::Step,
            Some("CUBICSPLINE") => Self::CubicSpline,
            _ => Self::Linear,
        }
    }

    /// Output elements per key, tangents included.
    pub(super) fn elements(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

/// Position of a time among keys.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Between {
    /// Index of the key before.
    pub(super) before: usize,
    /// Index of the key after; equal to `before` at and beyond the ends.
    pub(super) after: usize,
    /// Seconds between both keys.
    span: f64,
    /// Fraction of the span that has passed, from 0 to below 1.
    part: f64,
}

impl Between {
    /// Locates `time` among at least one ascending time. Beyond the ends the nearest key counts, and of two keys at one time the
    /// later.
    ///
    /// Times are stored as `f32`: a moment that rounds to the time of a key has reached that key; otherwise every other frame of
    /// a sequence would show the previous one.
    pub(super) fn of(times: &[f32], time: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "compared as stored")]
        let stored = time as f32;
        // Index of the first key after the moment.
        let after = times.partition_point(|&t| t <= stored);
        let at = |key: usize| times.get(key).copied().map_or(0.0, f64::from);
        match after.checked_sub(1) {
            None => Self::at_key(0),
            Some(before) if after == times.len() => Self::at_key(before),
            Some(before) => {
                let span = at(after) - at(before);
                // A key that was reached by rounding may lie slightly after the moment.
                Self { before, after, span, part: ((time - at(before)) / span).max(0.0) }
            }
        }
    }

    fn at_key(key: usize) -> Self {
        Self { before: key, after: key, span: 0.0, part: 0.0 }
    }
}

/// Value of a key; the tangents are empty where the interpolation needs none.
#[derive(Clone, Debug, Default)]
pub(super) struct Key {
    pub(super) tangent_in: Vec<f64>,
    pub(super) value: Vec<f64>,
    pub(super) tangent_out: Vec<f64>,
}

/// Interpolates independent numbers: translations, scales, weights.
pub(super) fn numbers(interpolation: Interpolation, between: Between, before: &Key, after: &Key) -> Vec<f64> {
    let part = between.part;
    let pairs = before.value.iter().zip(&after.value);
    match interpolation {
        _ if part == 0.0 => before.value.clone(),
        Interpolation::Step => before.value.clone(),
        Interpolation::Linear => pairs.map(|(a, b)| a + (b - a) * part).collect(),
        Interpolation::CubicSpline => {
            let [p0, m0, p1, m1] = hermite(part, between.span);
            let tangents = before.tangent_out.iter().zip(&after.tangent_in);
            pairs.zip(tangents).map(|((a, b), (out, into))| p0 * a + m0 * out + p1 * b + m1 * into).collect()
        }
    }
}

/// Hermite weights of the value before, its out-tangent, the value after and its in-tangent, at fraction `part` of `span`
/// seconds.
fn hermite(part: f64, span: f64) -> [f64; 4] {
    let (t, t2, t3) = (part, part * part, part * part * part);
    [2.0 * t3 - 3.0 * t2 + 1.0, span * (t3 - 2.0 * t2 + t), 3.0 * t2 - 2.0 * t3, span * (t3 - t2)]
}

/// Interpolates a rotation to a unit quaternion; `None` where it has length 0 or is not finite.
pub(super) fn rotation(interpolation: Interpolation, between: Between, before: &Key, after: &Key) -> Option<DQuat> {
    if interpolation == Interpolation::Linear && between.part > 0.0 {
        return Some(slerp(unit(&before.value)?, unit(&after.value)?, between.part));
    }
    unit(&numbers(interpolation, between, before, after))
}

fn unit(q: &[f64]) -> Option<DQuat> {
    let q = DQuat::from_array(<[f64; 4]>::try_from(q).ok()?);
    let length = q.length();
    (length > 0.0 && length.is_finite()).then(|| q / length)
}

/// Interpolates from `a` to `b` along the shorter arc of the sphere.
///
/// Angles come from `libm`, so that every machine draws the same picture.
fn slerp(a: DQuat, b: DQuat, part: f64) -> DQuat {
    /// Cosine above which the arc is replaced by its chord: they differ by the cube of the angle, below 1e-10.
    const STRAIGHT: f64 = 1.0 - 1e-7;
    // A quaternion and its negative are the same rotation; the nearer of the two gives the shorter arc.
    let dot = a.dot(b);
    let (b, cosine) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    if cosine > STRAIGHT {
        return (a * (1.0 - part) + b * part).normalize();
    }
    let angle = libm::acos(cosine);
    let sine = libm::sin(angle);
    ((a * (libm::sin((1.0 - part) * angle) / sine)) + b * (libm::sin(part * angle) / sine)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_1_SQRT_2, PI};

    fn key(value: &[f64]) -> Key {
        Key { value: value.to_vec(), ..Key::default() }
    }

    fn smooth(tangent_in: f64, value: f64, tangent_out: f64) -> Key {
        Key { tangent_in: vec![tangent_in], value: vec![value], tangent_out: vec![tangent_out] }
    }

    fn around_z(angle: f64) -> Key {
        key(&[0.0, 0.0, libm::sin(angle * 0.5), libm::cos(angle * 0.5)])
    }

    #[test]
    fn a_moment_lies_between_two_keys_and_outside_them_at_the_nearest() {
        let times = [1.0, 2.0, 4.0];
        assert_eq!(Between::of(&times, 3.0), Between { before: 1, after: 2, span: 2.0, part: 0.5 });
        assert_eq!(Between::of(&times, 1.0), Between { before: 0, after: 1, span: 1.0, part: 0.0 });
        assert_eq!(Between::of(&times, 0.5), Between::at_key(0));
        assert_eq!(Between::of(&times, 4.0), Between::at_key(2));
        assert_eq!(Between::of(&times, 1e300), Between::at_key(2));
        assert_eq!(Between::of(&[0.0], 7.0), Between::at_key(0));
        assert_eq!(Between::of(&[0.0, 1.0, 1.0, 2.0], 1.5), Between { before: 2, after: 3, span: 1.0, part: 0.5 });
        assert_eq!(Between::of(&[1.0, 1.0], 1.0), Between::at_key(1));
    }

    #[test]
    fn a_frame_that_falls_on_a_key_when_rounded_shows_that_key() {
        let times: Vec<f32> = (0..1000).map(|k| k as f32 / 24.0).collect();
        for k in 0..1000 {
            let between = Between::of(&times, f64::from(k) / 24.0);
            assert_eq!((between.before, between.part < 1e-4), (k as usize, true), "frame {k}: {between:?}");
        }
    }

    #[test]
    fn steps_wait_and_lines_go_evenly() {
        let (a, b) = (key(&[1.0, -2.0]), key(&[3.0, 2.0]));
        let quarter = Between { before: 0, after: 1, span: 8.0, part: 0.25 };
        assert_eq!(numbers(Interpolation::Step, quarter, &a, &b), [1.0, -2.0]);
        assert_eq!(numbers(Interpolation::Linear, quarter, &a, &b), [1.5, -1.0]);
    }

    #[test]
    fn a_spline_goes_through_its_keys_with_their_slopes() {
        // Half way through 2 s: half of each value, and an eighth of the span times the tangents' difference.
        let (a, b) = (smooth(9.0, 1.0, 4.0), smooth(-2.0, 3.0, 9.0));
        let middle = Between { before: 0, after: 1, span: 2.0, part: 0.5 };
        assert_eq!(numbers(Interpolation::CubicSpline, middle, &a, &b), [0.5 + 1.5 + 0.25 * 4.0 - 0.25 * -2.0]);
        let start = Between { part: 0.0, ..middle };
        assert_eq!(numbers(Interpolation::CubicSpline, start, &a, &b), [1.0]);
        let step = 1e-6;
        let soon = Between { part: step, ..middle };
        let slope = (numbers(Interpolation::CubicSpline, soon, &a, &b)[0] - 1.0) / (2.0 * step);
        assert!((slope - 4.0).abs() < 1e-4, "{slope}");
    }

    #[test]
    fn rotations_go_the_shorter_way_at_an_even_pace() {
        let third = Between { before: 0, after: 1, span: 1.0, part: 1.0 / 3.0 };
        let close = |q: DQuat, angle: f64| {
            let expected = DQuat::from_array([0.0, 0.0, libm::sin(angle * 0.5), libm::cos(angle * 0.5)]);
            assert!((q.dot(expected).abs() - 1.0).abs() < 1e-12, "{q} {expected}");
        };
        let turned = |a: &Key, b: &Key| rotation(Interpolation::Linear, third, a, b).unwrap();
        close(turned(&around_z(0.0), &around_z(0.9 * PI)), 0.3 * PI);
        // A rotation by 1.5 π is shorter as one by −0.5 π.
        close(turned(&around_z(0.0), &around_z(1.5 * PI)), -0.5 * PI / 3.0);
        close(turned(&around_z(0.2), &around_z(0.2 + 3e-5)), 0.2 + 1e-5);
    }

    #[test]
    fn rotations_on_a_spline_are_made_unit() {
        let flat = |value: &[f64]| Key { tangent_in: vec![0.0; 4], value: value.to_vec(), tangent_out: vec![0.0; 4] };
        let middle = Between { before: 0, after: 1, span: 1.0, part: 0.5 };
        let (a, b) = (flat(&[0.0, 0.0, 0.0, 1.0]), flat(&[0.0, 0.0, 1.0, 0.0]));
        let q = rotation(Interpolation::CubicSpline, middle, &a, &b).unwrap();
        assert!((q.z - FRAC_1_SQRT_2).abs() < 1e-15 && (q.w - FRAC_1_SQRT_2).abs() < 1e-15, "{q}");
        let nowhere = flat(&[0.0; 4]);
        assert_eq!(rotation(Interpolation::Step, middle, &nowhere, &b), None);
    }
}
