//! Measures and compares, and prints nothing: rays that are hard on a mesh, exact answers, and what came out.

pub mod aim;
pub mod oracle;
pub mod star;
pub mod verify;
