//! Cargo's build script: records compiler and flags for the reports.

#![allow(clippy::print_stdout, reason = "this is how Cargo is told")]

use std::env::var;
use std::process::Command;

fn main() {
    let name = var("RUSTC").unwrap_or_else(|_| "rustc".into());
    let asked = Command::new(name).arg("--version").output().ok().and_then(|o| String::from_utf8(o.stdout).ok());
    let compiler = asked.as_deref().map_or("unknown compiler", str::trim);
    let level = var("OPT_LEVEL").unwrap_or_default();
    let given = var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default().replace('\u{1f}', " ");
    let given = if given.is_empty() { String::new() } else { format!(" {given}") };
    println!("cargo::rustc-env=MESHRAY_COMPILER={compiler}");
    println!("cargo::rustc-env=MESHRAY_FLAGS=opt-level {level}{given}");
    println!("cargo::rerun-if-changed=src/bench/compiler.rs");
}
