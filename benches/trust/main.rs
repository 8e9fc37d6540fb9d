//! Correctness of hits over very many rays: `cargo bench --bench trust -- closed|agree|kernels [options]`.
//!
//! `closed` counts the rays that escape from inside a closed mesh; `agree` compares the fast structures with each other and with
//! brute force on the given models. Both exit with 1 if there is any difference. `kernels` plots the speed of our tests, and of
//! Embree's where `MESHRAY_EMBREE` names its library, against their wrong answers.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command that prints what it counted")]

mod agree;
mod closed;
#[expect(dead_code, reason = "bytes of its structure are asked for by the other bench")]
#[path = "../peers/embree.rs"]
mod embree;
mod kernels;
#[expect(dead_code, reason = "pencils are read by a tracer of the other bench")]
#[path = "../peers/tracer.rs"]
mod tracer;

use std::process::ExitCode;

const USAGE: &str = "\
usage: trust closed [--rays N]                       N aimed rays a place (default 8e6)
       trust agree [--rays N] [--tests N] FILE...    N rays (default 1e7), N tests of brute force (default 1e10)
       trust kernels [--rays N] FILE PAGE.html       N rays of each kind (default 1e5)";

/// Parsed command line.
struct Words {
    rays: f64,
    tests: f64,
    files: Vec<String>,
}

fn main() -> ExitCode {
    // Cargo adds --bench to the arguments.
    let mut words = std::env::args().skip(1).filter(|w| w != "--bench");
    let command = words.next();
    let clean = match (command.as_deref(), parse(words)) {
        (Some("closed"), Some(w)) => closed::run(if w.rays > 0.0 { w.rays } else { 8e6 }),
        (Some("agree"), Some(w)) if !w.files.is_empty() => {
            agree::run(&w.files, if w.rays > 0.0 { w.rays } else { 1e7 }, if w.tests > 0.0 { w.tests } else { 1e10 })
        }
        (Some("kernels"), Some(w)) if w.files.len() == 2 => {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at least 1")]
            let rays = if w.rays > 0.0 { w.rays as usize } else { 100_000 };
            kernels::run(&w.files[0], rays, &w.files[1])
        }
        // `cargo bench` runs every bench without arguments.
        (None, _) => closed::run(1e5),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    if clean { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn parse(mut words: impl Iterator<Item = String>) -> Option<Words> {
    let mut parsed = Words { rays: 0.0, tests: 0.0, files: Vec::new() };
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|n| n.parse::<f64>().ok()).filter(|n| *n >= 1.0);
        match word.as_str() {
            "--rays" => parsed.rays = number()?,
            "--tests" => parsed.tests = number()?,
            _ => parsed.files.push(word),
        }
    }
    Some(parsed)
}
