//! The `meshray` command.

fn main() {}
