//! Pure numerics: vectors, rays against shapes, error bounds.
//!
//! Everything here is arithmetic on plain values; no module below this one knows of scenes, files or threads. Rounding tricks
//! live here and nowhere else.

pub use glam::{DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, Mat4, Vec2, Vec3, Vec3Swizzles, Vec4};

pub mod aabb;
pub mod bounds;
pub mod cone;
pub mod ear_clip;
pub mod expansion;
pub mod fan;
pub mod formula;
pub mod frame;
pub mod inset;
pub mod meetings;
pub mod moller_trumbore;
#[cfg(test)]
mod oracle;
pub mod plane;
pub mod polygon;
pub mod primaries;
pub mod quotient;
pub mod random;
pub mod rational;
pub mod real;
pub mod shear;
pub mod sight;
pub mod simd;
pub mod sphere;
pub mod triangle;
pub mod triangles;
pub mod watertight;
