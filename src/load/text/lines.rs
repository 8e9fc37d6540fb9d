//! Text -> logical lines: any line end (LF, CR LF, CR), continuations joined, white space trimmed.
//!
//! A backslash at the end of a line joins the next one, as the OBJ specification says, except in a comment: exporters write
//! paths into comments, and a path may end in a backslash.

/// Reads logical lines in sequence; allocates only for joined ones.
pub(in crate::load) struct Lines<'a> {
    rest: &'a [u8],
    joined: Vec<u8>,
    /// Number of the physical line that comes next, from 1.
    number: u32,
}

impl<'a> Lines<'a> {
    pub(in crate::load) fn new(text: &'a [u8]) -> Self {
        Self { rest: text, joined: Vec::new(), number: 1 }
    }

    /// Unread text.
    pub(in crate::load) fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// Number of the physical line that starts with [`Self::rest`].
    pub(in crate::load) fn number(&self) -> u32 {
        self.number
    }

    /// Skips a physical line of `length` bytes, its end included.
    pub(in crate::load) fn pass(&mut self, length: usize) {
        self.rest = &self.rest[length..];
        self.number = self.number.saturating_add(1);
    }

    /// Next line that is not blank, and the number of its first physical line.
    pub(in crate::load) fn next(&mut self) -> Option<(u32, &[u8])> {
        loop {
            let number = self.number;
            let line = self.physical()?;
            if line.is_empty() {
                continue;
            }
            if !is_continued(line) {
                return Some((number, line));
            }
            self.join(line);
            return Some((number, self.joined.trim_ascii()));
        }
    }

    /// Collects `first` and the lines that continue it.
    fn join(&mut self, first: &[u8]) {
        self.joined.clear();
        self.joined.extend_from_slice(&first[..first.len() - 1]);
        while let Some(line) = self.physical() {
            self.joined.push(b' ');
            match line {
                [start @ .., b'\\'] => self.joined.extend_from_slice(start),
                _ => {
                    self.joined.extend_from_slice(line);
                    break;
                }
            }
        }
    }

    /// Next physical line, trimmed.
    fn physical(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(self.rest.len());
        let (line, after) = self.rest.split_at(end);
        self.rest = after.strip_prefix(b"\r\n").or_else(|| after.get(1..)).unwrap_or_default();
        self.number = self.number.saturating_add(1);
        Some(line.trim_ascii())
    }
}

/// Whether this non-blank line is continued on the next: it ends in a backslash that is not part of a comment.
fn is_continued(line: &[u8]) -> bool {
    if line[line.len() - 1] != b'\\' {
        return false;
    }
    match keyword(line) {
        (b"v" | b"vt" | b"vn" | b"f" | b"fo" | b"l" | b"p" | b"s", rest) => comment(rest).is_none(),
        // Names may hold the character that starts a comment elsewhere.
        _ => line[0] != b'#' && without_comment(line).len() == line.len(),
    }
}

/// Start of a comment behind numbers. (`1.#IND` holds none: C libraries print infinities so.)
fn comment(rest: &[u8]) -> Option<usize> {
    let starts = |at: &usize| rest[*at] == b'#' && (*at == 0 || rest[*at - 1] != b'.');
    if rest.contains(&b'#') { (0..rest.len()).find(starts) } else { None }
}

/// Splits a line into its first word and the trimmed rest.
pub(in crate::load) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}

/// Words of `rest` up to a comment.
pub(in crate::load) fn words(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    rest[..comment(rest).unwrap_or(rest.len())].split(u8::is_ascii_whitespace).filter(|w| !w.is_empty())
}

/// Name without the comment that may follow it: a `#` between white space starts one (names such as `Color#1` keep
/// theirs).
pub(in crate::load) fn without_comment(name: &[u8]) -> &[u8] {
    let starts = |w: &[u8]| w[0].is_ascii_whitespace() && w[1] == b'#' && w[2].is_ascii_whitespace();
    name.windows(3).position(starts).map_or(name, |at| name[..at].trim_ascii())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(u32, String)> {
        let mut lines = Lines::new(text.as_bytes());
        let mut out = Vec::new();
        while let Some((number, line)) = lines.next() {
            out.push((number, String::from_utf8_lossy(line).into_owned()));
        }
        out
    }

    #[test]
    fn every_line_end_counts_once() {
        let expected = vec![(1, "a b".into()), (3, "c".into()), (4, "d".into())];
        assert_eq!(all("a b\n\n c \t\nd"), expected);
        assert_eq!(all("a b\r\n\r\nc\r\nd\r\n"), expected);
        assert_eq!(all("a b\r\rc\rd\r"), expected);
    }

    #[test]
    fn continued_lines_are_joined_and_keep_the_number_of_the_first() {
        assert_eq!(all("f 1 2\\\n3 \\\r\n 4\nf 5"), [(1, "f 1 2 3  4".into()), (4, "f 5".into())]);
        assert_eq!(all("f 1 \\"), [(1, "f 1".into())]);
    }

    #[test]
    fn a_comment_that_ends_in_a_backslash_does_not_swallow_the_next_line() {
        assert_eq!(all("# C:\\tmp\\\nv 1"), [(1, "# C:\\tmp\\".into()), (2, "v 1".into())]);
        for line in ["v 0 0 0 # C:\\tmp\\", "f 1 2 3#\\", "o a # C:\\"] {
            assert_eq!(all(&format!("{line}\nv 1")), [(1, line.into()), (2, "v 1".into())]);
        }
        assert_eq!(all("v 1.#IND \\\n2"), [(1, "v 1.#IND  2".into())], "a number");
        assert_eq!(all("o a#1 \\\n2"), [(1, "o a#1  2".into())], "a name");
    }

    #[test]
    fn comments_after_data_are_cut_but_names_keep_their_signs() {
        assert_eq!(words(b"1 2\t3 # four").count(), 3);
        assert_eq!(words(b"1 2#3").count(), 2);
        assert_eq!(words(b"1.#IND 2#3").collect::<Vec<_>>(), [&b"1.#IND"[..], b"2"]);
        assert_eq!(without_comment(b"Color #1"), b"Color #1");
        assert_eq!(without_comment(b"Color # one"), b"Color");
    }
}
