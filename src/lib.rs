//! meshray renders the mesh files people download (glTF 2.0, OBJ) into pictures, on any CPU.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic"))]

pub mod accel;
#[cfg(feature = "cli")]
pub mod cli;
pub mod image;
pub mod load;
pub mod math;
pub mod render;
pub mod scene;
