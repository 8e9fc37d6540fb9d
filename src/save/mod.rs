//! Scene -> file: what the program generates, in formats that every other program reads.
//!
//! Both writers put +Y up, as their formats say.

pub mod glb;
pub mod obj;
