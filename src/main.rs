//! The `meshray` command: parse, run, exit code. Everything else is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    meshray::cli::run(wild::args_os()).into()
}
