//! Whole files, made in memory.
