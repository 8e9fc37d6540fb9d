//! Parsing of value lists such as `1,2,5` and ranges such as `0.5..16`, optionally with a number of values: `0.5..16:8`.

/// Maximum number of values.
pub const MOST: usize = 64;

/// Spacing of the values of a range without a number of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// The first value, times 10, and so on, and the last value.
    Tens,
    /// This many values with equal ratios.
    Ratio(usize),
    /// This many values with equal differences.
    Even(usize),
}

impl Spacing {
    /// The same spacing with another number of values; tens become equal ratios.
    fn with(self, count: usize) -> Self {
        match self {
            Self::Even(_) => Self::Even(count),
            Self::Tens | Self::Ratio(_) => Self::Ratio(count),
        }
    }

    fn between(self, from: f64, to: f64) -> Vec<f64> {
        // Rounding to three digits may leave the range when its ends lie close together.
        let rounded = |value: f64| printable(value).clamp(from, to);
        let inner = |count: usize| (1..count - 1).map(move |i| i as f64 / (count - 1) as f64);
        let between: Vec<f64> = match self {
            Self::Tens => (1..).map(|i| from * 10f64.powi(i)).take_while(|v| *v < to * (1.0 - 1e-9)).collect(),
            Self::Ratio(count) => inner(count).map(|p| rounded(from * (to / from).powf(p))).collect(),
            Self::Even(count) => inner(count).map(|p| rounded(from + (to - from) * p)).collect(),
        };
        [vec![from], between, vec![to]].concat()
    }
}

/// Rounds to three digits, so that the number printed in a report is the value itself.
fn printable(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Parses the values of `text`, ascending, each once; whole numbers if `whole`. An error says what to write.
pub fn values(text: &str, spacing: Spacing, whole: bool) -> Result<Vec<f64>, String> {
    let wrong =
        |why: &str| format!("{text:?}: {why}; write values such as 1,2,5 or a range such as 1..100 or 1..100:7");
    let number = |typed: &str| {
        let number = typed.trim().parse::<f64>().ok().filter(|n| n.is_finite() && *n >= 0.0);
        let number = number.ok_or_else(|| wrong(&format!("{typed:?} is no number from 0 on")))?;
        if whole && number.fract() != 0.0 { Err(wrong(&format!("{typed:?} is no whole number"))) } else { Ok(number) }
    };
    let mut values = match text.split_once("..") {
        None => text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?,
        Some((from, rest)) => {
            let (to, count) = rest.split_once(':').map_or((rest, None), |(to, count)| (to, Some(count)));
            let (from, to) = (number(from)?, number(to)?);
            let spacing = match count.map(|c| c.trim().parse().ok().filter(|n| (2..=MOST).contains(n))) {
                None => spacing,
                Some(Some(count)) => spacing.with(count),
                Some(None) => return Err(wrong(&format!("a range has 2 to {MOST} values"))),
            };
            if from >= to {
                return Err(wrong("the first value must be below the last"));
            }
            if from == 0.0 && !matches!(spacing, Spacing::Even(_)) {
                return Err(wrong("equal ratios cannot start at 0"));
            }
            spacing.between(from, to)
        }
    };
    if whole {
        values.iter_mut().for_each(|v| *v = v.round());
    }
    values.sort_by(f64::total_cmp);
    values.dedup();
    if values.len() > MOST { Err(wrong(&format!("more than {MOST} values"))) } else { Ok(values) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tens(text: &str) -> Vec<f64> {
        values(text, Spacing::Tens, true).unwrap()
    }

    #[test]
    fn a_range_goes_by_tens_and_ends_where_it_says() {
        assert_eq!(tens("1e3..1e6"), [1e3, 1e4, 1e5, 1e6]);
        assert_eq!(tens("2000..5e4"), [2e3, 2e4, 5e4]);
        assert_eq!(tens("10..20"), [10.0, 20.0]);
    }

    #[test]
    fn steps_have_equal_ratios_or_differences() {
        assert_eq!(tens("1e3..1e6:7"), [1e3, 3160.0, 1e4, 31_600.0, 1e5, 316_000.0, 1e6]);
        assert_eq!(values("0.5..16", Spacing::Ratio(6), false).unwrap(), [0.5, 1.0, 2.0, 4.0, 8.0, 16.0]);
        assert_eq!(values("0..10", Spacing::Even(6), true).unwrap(), [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]);
        assert_eq!(values("1..3:3", Spacing::Ratio(6), false).unwrap(), [1.0, 1.73, 3.0]);
        assert_eq!(values("0..3:2", Spacing::Even(6), true).unwrap(), [0.0, 3.0]);
        assert_eq!(values("1006..1009:4", Spacing::Ratio(6), true).unwrap(), [1006.0, 1009.0]);
    }

    #[test]
    fn a_list_is_put_in_order_and_whole_values_that_coincide_are_one() {
        assert_eq!(tens("1e5,1e3 , 1e4,1e3"), [1e3, 1e4, 1e5]);
        assert_eq!(tens("7"), [7.0]);
        assert_eq!(values("1..4", Spacing::Ratio(6), true).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn what_is_no_range_is_refused_with_an_example() {
        for wrong in [
            "", "x", "1..", "..5", "5..1", "1..1", "1,x", "-1,2", "nan", "1..inf", "1..9:1", "1..9:99", "0..9",
            "1..9:x",
        ] {
            let error = values(wrong, Spacing::Tens, false).unwrap_err();
            assert!(error.contains("such as 1,2,5"), "{wrong}: {error}");
        }
        assert!(values("0.5,2", Spacing::Even(6), true).unwrap_err().contains("\"0.5\" is no whole number"));
        let many: Vec<String> = (0..65).map(|i| i.to_string()).collect();
        assert!(values(&many.join(","), Spacing::Tens, true).unwrap_err().contains("more than 64"));
        assert!(values("1e-300..1e300", Spacing::Tens, false).is_err());
    }
}
