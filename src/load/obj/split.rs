//! Splits a text into runs of whole logical lines.

/// Cuts `text` into runs of about `size` bytes; each ends behind a line end that is not continued.
pub(super) fn runs(text: &[u8], size: usize) -> Vec<&[u8]> {
    let mut runs = Vec::with_capacity(text.len() / size.max(1) + 1);
    let mut rest = text;
    while rest.len() > 2 * size {
        let Some(end) = end_of_line(rest, size) else { break };
        let (run, after) = rest.split_at(end);
        runs.push(run);
        rest = after;
    }
    runs.push(rest);
    runs
}

/// First position after `from` where a line starts that continues no other; only LF counts as a line end here.
fn end_of_line(text: &[u8], from: usize) -> Option<usize> {
    // A backslash as the last character before a line end, regardless of blank lines in between, may continue the line.
    let mut last = text[..from].trim_ascii_end().last();
    for (at, byte) in text.iter().enumerate().skip(from) {
        match byte {
            b'\n' if last != Some(&b'\\') => return Some(at + 1),
            blank if blank.is_ascii_whitespace() => {}
            _ => last = Some(byte),
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(text: &str, size: usize) -> Vec<&str> {
        runs(text.as_bytes(), size).into_iter().map(|run| std::str::from_utf8(run).unwrap()).collect()
    }

    #[test]
    fn a_text_is_cut_behind_line_ends_only() {
        assert_eq!(cut("ab\ncd\nef\ngh", 2), ["ab\n", "cd\n", "ef\n", "gh"]);
        assert_eq!(cut("ab\r\ncd\r\nef\r\n", 3), ["ab\r\n", "cd\r\n", "ef\r\n"]);
        assert_eq!(cut("abcdefgh", 2), ["abcdefgh"]);
        assert_eq!(cut("", 2), [""]);
    }

    #[test]
    fn a_continued_line_stays_in_one_piece() {
        assert_eq!(cut("a\\\nb \\ \r\n \nc\nd\ne", 1), ["a\\\nb \\ \r\n \nc\n", "d\n", "e"]);
    }

    #[test]
    fn a_continued_line_before_many_blank_ones_is_cut_in_one_pass() {
        let text = format!("g a \\\n{}f 1 2 3\nf 1 2 3\n", "\n".repeat(4_000_000));
        let start = std::time::Instant::now();
        let runs = cut(&text, 2);
        assert_eq!(runs[1..], ["f 1 2 3\n", ""]);
        assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    }
}
