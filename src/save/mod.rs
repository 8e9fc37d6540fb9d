//! Scene -> file: what the program generates, in formats that every other program reads.
//!
//! Both writers put +Y up, as their formats say.

pub mod glb;
pub mod obj;

use crate::math::{DAffine3, DMat3, DVec3};
use crate::scene::UpAxis;

/// Turns a scene whose `up` is given so that +Y is up.
fn upright(up: UpAxis) -> DAffine3 {
    match up {
        UpAxis::Y => DAffine3::IDENTITY,
        // x stays, z becomes y, y becomes −z.
        UpAxis::Z => DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y)),
    }
}
