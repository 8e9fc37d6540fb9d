//! Number words as exporters write them -> words that every number parser reads.

use std::borrow::Cow;

/// A number word, checked.
pub(super) struct Number<'a> {
    /// What to read.
    pub word: Cow<'a, str>,
    /// Decimal places of the last digit (negative: it stands for tens, hundreds, …); `None` where there is none.
    pub places: Option<i32>,
    /// Whether the word had to be changed to be read.
    pub odd: bool,
}

/// Checks a word; one that is no number in any reading becomes `nan`.
pub(super) fn check(word: &[u8]) -> Number<'_> {
    if let Some((end, places)) = scan(word)
        && end == word.len()
        && let Ok(word) = std::str::from_utf8(word)
    {
        return Number { word: word.into(), places: Some(places), odd: false };
    }
    repair(word)
}

/// Length and decimal places of the longest number `word` starts with.
fn scan(word: &[u8]) -> Option<(usize, i32)> {
    let digits = |from: usize| word[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut at = usize::from(matches!(word.first(), Some(b'+' | b'-')));
    let whole = digits(at);
    at += whole;
    let mut fraction = 0;
    if word.get(at) == Some(&b'.') {
        fraction = digits(at + 1);
        at += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    let mut places = i32::try_from(fraction).unwrap_or(i32::MAX);
    if matches!(word.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(word.get(at + 1), Some(b'+' | b'-')));
        let length = digits(at + 1 + sign);
        if length > 0 {
            let end = at + 1 + sign + length;
            let exponent = std::str::from_utf8(&word[at + 1..end]).ok()?.parse::<i32>().unwrap_or(0);
            places = places.saturating_sub(exponent);
            at = end;
        }
    }
    Some((at, places))
}

/// Reads `nan`, `inf`, C runtime spellings (`1.#IND`), decimal commas, Fortran exponents, a sign before the exponent's
/// letter, and numbers followed by something else.
fn repair(word: &[u8]) -> Number<'_> {
    let odd = |word: String| Number { word: word.into(), places: None, odd: true };
    let text = String::from_utf8_lossy(word).to_ascii_lowercase();
    let unsigned = text.trim_start_matches(['+', '-']);
    if ["nan", "inf", "1.#", "-1.#", "ind"].iter().any(|s| unsigned.starts_with(s)) {
        return Number { word: "nan".into(), places: None, odd: false };
    }
    let respelled = text.replace(',', ".").replace('d', "e").replace("+e", "e+").replace("-e", "e-");
    match scan(respelled.as_bytes()) {
        Some((end, _)) => odd(respelled[..end].into()),
        None => odd("nan".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(word: &str) -> (f64, bool) {
        let number = check(word.as_bytes());
        (number.word.parse().unwrap(), number.odd)
    }

    #[test]
    fn plain_numbers_pass_as_they_are() {
        for (word, expected) in [("1", 1.0), ("+2.", 2.0), ("-.5", -0.5), ("2.e1", 20.0), ("1E-02", 0.01), ("0", 0.0)] {
            assert_eq!(value(word), (expected, false), "{word}");
        }
    }

    #[test]
    fn odd_spellings_are_read_and_told() {
        for (word, expected) in [("1,5", 1.5), ("1.5D+02", 150.0), ("3.1+e2", 310.0), ("3.1-e2", 0.031), ("2.0f", 2.0)]
        {
            assert_eq!(value(word), (expected, true), "{word}");
        }
        assert!(value("1e").1 && value("abc").0.is_nan() && value("").0.is_nan() && value("+").0.is_nan());
    }

    #[test]
    fn not_a_number_is_not_odd() {
        for word in ["nan", "-nan(ind)", "NaN", "inf", "-Infinity", "1.#IND", "-1.#INF", "1.#QNAN"] {
            let (value, odd) = value(word);
            assert!(value.is_nan() && !odd, "{word}");
        }
    }

    #[test]
    fn the_place_of_the_last_digit_counts_the_exponent() {
        let places = |word: &str| check(word.as_bytes()).places;
        assert_eq!(places("12.500"), Some(3));
        assert_eq!(places("1.25e-3"), Some(5));
        assert_eq!(places("3e2"), Some(-2));
        assert_eq!(places("1e99999999999"), Some(0));
        assert_eq!(places("nan"), None);
    }

    #[test]
    fn whatever_is_checked_can_be_parsed() {
        for word in ["", "-", ".", "e5", "1e+", "--1", "1e400", "\u{e4}", "1..2", "+-3"] {
            assert!(check(word.as_bytes()).word.parse::<f64>().is_ok(), "{word}");
        }
    }
}
