//! Texts as modelling programs write them: lines and words, in any encoding.

pub(super) mod encoding;
pub(super) mod lines;
pub(super) mod words;

/// Strips the byte-order mark that some programs write.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}
