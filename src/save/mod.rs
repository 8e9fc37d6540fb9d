//! Scene -> file: generated scenes, in formats that every other program reads.
//!
//! Both writers turn +Y up, as their formats require.

pub mod glb;
pub mod obj;
