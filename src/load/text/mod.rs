//! Texts as modelling programs write them: their lines and words, in whatever encoding.

pub(super) mod encoding;
pub(super) mod lines;
