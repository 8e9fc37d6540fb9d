//! Numbers formatted for people.

/// Groups digits in threes: `1 234 567`.
pub fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|c| std::str::from_utf8(c).ok()).collect();
    groups.join(" ")
}

/// Formats the hash of the input as it is written everywhere: 32 hexadecimal digits.
pub fn hash(hash: u128) -> String {
    format!("{hash:032x}")
}

/// Count with its noun, where `one` is the singular: `1 ray`, `4 rays`.
pub fn so_many(n: u64, one: &str) -> String {
    format!("{} {one}{}", grouped(n), if n == 1 { "" } else { "s" })
}

/// Formats about three digits in at most eight characters; `-` for infinities and NaN.
pub fn short(x: f64) -> String {
    match x {
        x if !x.is_finite() => "-".into(),
        x if x >= 9_999_999.5 => format!("{x:.1e}"),
        x if x >= 999.5 => grouped(rounded(x)),
        x if x >= 99.95 => format!("{x:.0}"),
        x if x >= 9.995 => format!("{x:.1}"),
        0.0 => "0".into(),
        x if x >= 0.00995 => format!("{x:.2}"),
        x if x >= 0.000_095 => format!("{x:.4}"),
        x => format!("{x:.0e}"),
    }
}

/// Formats a computed number of things, rounded up.
pub fn whole(x: f64) -> String {
    if x.is_finite() && x < 1e15 { grouped(rounded(x.ceil())) } else { short(x) }
}

/// Formats seconds, with the unit that fits, from millionths up to thousands.
pub fn seconds(s: f64) -> String {
    match s {
        s if !s.is_finite() => "-".into(),
        s if s < 1e-6 => format!("{} ns", short(s * 1e9)),
        s if s < 1e-3 => format!("{} µs", short(s * 1e6)),
        s if s < 1.0 => format!("{} ms", short(s * 1e3)),
        s => format!("{} s", short(s)),
    }
}

/// Formats bytes in the unit that fits: 1 kB is 1000 bytes.
pub fn bytes(n: u64) -> String {
    match n as f64 {
        n if n < 1e3 => format!("{n} B"),
        n if n < 1e6 => format!("{} kB", short(n * 1e-3)),
        n if n < 1e9 => format!("{} MB", short(n * 1e-6)),
        n => format!("{} GB", short(n * 1e-9)),
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded, positive, below 2^63")]
fn rounded(x: f64) -> u64 {
    x.round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_numbers_are_grouped() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }

    #[test]
    fn numbers_keep_three_digits_or_so() {
        let shown = [0.0, 0.00061, 0.123, 9.994, 12.34, 123.4, 69_451.0, 2e9, f64::NAN].map(short);
        assert_eq!(shown, ["0", "0.0006", "0.12", "9.99", "12.3", "123", "69 451", "2.0e9", "-"]);
        assert_eq!([3.2e-7, 0.0042, 12.0].map(seconds), ["320 ns", "4.20 ms", "12.0 s"]);
        assert_eq!([999, 12_340_000].map(bytes), ["999 B", "12.3 MB"]);
    }
}
