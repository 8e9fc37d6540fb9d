//! Numbers in text: fast reading of plain ones, repair of the odd spellings that exporters write.

use crate::load::Diagnostic;
use crate::load::paths::shorten;
use std::borrow::Cow;
use std::path::Path;

/// A checked number word.
pub(in crate::load) struct Number<'a> {
    /// Word that parses as a number.
    pub word: Cow<'a, str>,
    /// Decimal places of the last digit (negative: it stands for tens, hundreds, …); `None` where there is no digit.
    pub places: Option<i32>,
    /// Whether the word had to be repaired.
    pub odd: bool,
}

/// A plain decimal number at the start of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::load) struct Plain {
    pub value: f64,
    /// Decimal places of the last digit, as in [`Number`].
    pub places: i32,
    /// Length in bytes.
    pub length: usize,
}

/// Powers of ten that `f64` holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Largest number of digits that surely fits into 64 bits.
const MOST_DIGITS: usize = 19;

/// Reads the number that `text` starts with, if it ends before white space and can be read with one rounding: its digits
/// make a whole number below 2⁵³ and its power of ten is exact, so that one division or multiplication gives what
/// [`str::parse`] gives (W. D. Clinger, "How to Read Floating Point Numbers Accurately", 1990). Other numbers are left
/// to [`check`].
#[inline]
pub(in crate::load) fn plain(text: &[u8]) -> Option<Plain> {
    let sign = usize::from(matches!(text.first(), Some(b'-' | b'+')));
    let (whole, mut at) = digits(text, sign, 0);
    let (mut mantissa, mut count, mut fraction) = (whole, at - sign, 0);
    if text.get(at) == Some(&b'.') {
        let (all, end) = digits(text, at + 1, mantissa);
        fraction = end - at - 1;
        (mantissa, at) = (all, end);
        count += fraction;
    }
    if count == 0 || count > MOST_DIGITS || mantissa > 1 << 53 {
        return None;
    }
    let mut power = -(fraction as i64);
    if matches!(text.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(text.get(at + 1), Some(b'-' | b'+')));
        let (exponent, end) = digits(text, at + 1 + sign, 0);
        if !(1..=3).contains(&(end - at - 1 - sign)) {
            return None;
        }
        power += if text[at + 1] == b'-' { -(exponent as i64) } else { exponent as i64 };
        at = end;
    }
    if !text.get(at).is_none_or(u8::is_ascii_whitespace) {
        return None;
    }
    let exact = mantissa as f64;
    let power_of_ten = *POWERS.get(power.unsigned_abs() as usize)?;
    let value = if power < 0 { exact / power_of_ten } else { exact * power_of_ten };
    let value = if text[0] == b'-' { -value } else { value };
    Some(Plain { value, places: -(power as i32), length: at })
}

/// Appends the digits from `at` on to those of `number`; returns the result and the end of the digits. Overflow wraps.
#[inline]
fn digits(text: &[u8], mut at: usize, mut number: u64) -> (u64, usize) {
    while let Some(digit) = text.get(at).map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10) {
        number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    (number, at)
}

/// Value of a whole word: as [`str::parse`] reads it, or NaN for C libraries' spellings of non-finite numbers.
pub(in crate::load) fn value(word: &[u8]) -> Option<f64> {
    let parsed = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    parsed.or_else(|| is_none_spelled(word).then_some(f64::NAN))
}

/// Reads numbers spelled with a decimal comma or FORTRAN's `d`, and counts them for a warning.
#[derive(Default)]
pub(in crate::load) struct Respelled {
    /// The first such word, and its line.
    first: Option<(u32, String)>,
    count: u32,
}

impl Respelled {
    /// Value of a whole word: by [`value`], or else after respelling.
    pub(in crate::load) fn value(&mut self, line: u32, word: &[u8]) -> Option<f64> {
        if let Some(value) = value(word) {
            return Some(value);
        }
        let respelled = respelled(&String::from_utf8_lossy(word).to_ascii_lowercase());
        let (length, _) = scan(respelled.as_bytes())?;
        let value = (length == respelled.len()).then(|| respelled.parse().ok())??;
        self.first.get_or_insert_with(|| (line, String::from_utf8_lossy(word).into_owned()));
        self.count = self.count.saturating_add(1);
        Some(value)
    }

    /// Warning about the respelled numbers, if any.
    pub(in crate::load) fn told(self, code: &'static str, file: &Path) -> Option<Diagnostic> {
        let (line, word) = self.first?;
        let text = format!("`{}` is read with a decimal point and `e`", shorten(&word));
        let warning = Diagnostic::new(code, file, line.to_string(), text).remedy("export it with decimal points");
        Some(Diagnostic { count: self.count, ..warning })
    }
}

/// Replaces commas by decimal points and FORTRAN's `d` by `e`, and moves signs behind the `e`.
fn respelled(lower: &str) -> String {
    lower.replace(',', ".").replace('d', "e").replace("+e", "e+").replace("-e", "e-")
}

/// Whether a word is `nan`, `inf` or a spelling of C libraries for them: `-nan(ind)`, `1.#QNAN`.
fn is_none_spelled(word: &[u8]) -> bool {
    let text = String::from_utf8_lossy(word).to_ascii_lowercase();
    let unsigned = text.trim_start_matches(['+', '-']);
    ["nan", "inf", "1.#", "ind"].iter().any(|start| unsigned.starts_with(start))
}

/// Checks a word; one that cannot be read as a number becomes `nan`.
pub(super) fn check(word: &[u8]) -> Number<'_> {
    if let Some((end, places)) = scan(word)
        && end == word.len()
        && let Ok(word) = std::str::from_utf8(word)
    {
        return Number { word: word.into(), places: Some(places), odd: false };
    }
    repair(word)
}

/// Length and decimal places of the longest number that `word` starts with.
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

/// Repairs `nan`, `inf`, C runtime spellings (`1.#IND`), decimal commas, Fortran exponents, a sign before the exponent's
/// letter, and numbers followed by other characters.
fn repair(word: &[u8]) -> Number<'_> {
    let odd = |word: String| Number { word: word.into(), places: None, odd: true };
    let text = String::from_utf8_lossy(word).to_ascii_lowercase();
    if is_none_spelled(word) {
        return Number { word: "nan".into(), places: None, odd: false };
    }
    let respelled = respelled(&text);
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
    fn plain_numbers_are_read_as_the_library_reads_them() {
        let mut words: Vec<String> =
            ["0", "-0", "-0.000", "1", "+2.", "-.5", "007", "1e3", "2.5E-2", "1e+22", "9007199254740992", "1.5e-22"]
                .map(String::from)
                .into();
        // Numbers of every length, as programs print them.
        let mut x = 0.123_456_789_012_345_67_f64;
        for i in 0..2000 {
            x = (x * 1.618_033 + 0.271_828).fract();
            let scaled = (x - 0.5) * POWERS[i % 9];
            words.push(format!("{scaled:.*}", i % 13));
            words.push(format!("{scaled:.*e}", i % 11));
        }
        let mut read = 0;
        for word in &words {
            let Some(found) = plain(word.as_bytes()) else { continue };
            read += 1;
            assert_eq!(found.value.to_bits(), word.parse::<f64>().unwrap().to_bits(), "{word}");
            assert_eq!((Some(found.places), found.length), (check(word.as_bytes()).places, word.len()), "{word}");
        }
        assert!(read > words.len() * 9 / 10, "{read} of {}", words.len());
    }

    #[test]
    fn a_plain_number_ends_at_white_space_and_nowhere_else() {
        assert_eq!(plain(b"1.25 7"), Some(Plain { value: 1.25, places: 2, length: 4 }));
        assert_eq!(plain(b"3\r\n"), Some(Plain { value: 3.0, places: 0, length: 1 }));
        for word in ["", "-", ".", "+.", "1,5", "2.0f", "1e", "1e+", "1.5D+02", "nan", "1#", "1\\", "0x1", "1/2"] {
            assert_eq!(plain(word.as_bytes()), None, "{word}");
        }
    }

    #[test]
    fn numbers_that_need_more_than_one_rounding_are_left_to_the_library() {
        for word in ["9007199254740993", "0.12345678901234567890", "1e23", "1e-23", "1e0001", "1e400"] {
            assert_eq!(plain(word.as_bytes()), None, "{word}");
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
            assert!(super::value(word.as_bytes()).is_some_and(|value| !value.is_finite()), "{word}");
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
