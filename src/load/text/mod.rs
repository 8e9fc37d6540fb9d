//! Texts as modelling programs write them: their lines and words, in whatever encoding.

pub(super) mod encoding;
pub(super) mod lines;
pub(super) mod words;

/// A text without the byte-order mark that some programs begin it with.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}
