//! A text -> runs of whole logical lines.

/// Cuts `text` into runs of about `size` bytes; each ends behind a line end that nothing continues.
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

/// The first place after `from` where a line starts that stands for itself; only LF counts as a line end here.
fn end_of_line(text: &[u8], from: usize) -> Option<usize> {
    let mut at = from;
    loop {
        at += text[at..].iter().position(|&b| b == b'\n')? + 1;
        // A backslash before it may join the next line.
        if text[..at].trim_ascii_end().last() != Some(&b'\\') {
            return Some(at);
        }
    }
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
}
