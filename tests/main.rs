//! All tests from outside: the program as a black box, and pictures against stored ones.
//!
//! One binary, so that it is linked once; each module covers one subject.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "a test answers by panics and prints"
)]
#![allow(unreachable_pub, reason = "nobody uses a test binary as a library")]

#[cfg(feature = "cli")]
mod cli;
mod common;
mod far_away;
mod golden;
mod models;
mod sweep;
mod validator;
