//! Rays -> linear pixels: waves per tile, Whitted shading, lights and shadows, optics, pixel sampling.

pub mod studio;
pub mod texture;
pub mod view;
pub mod world;

pub use view::View;
pub use world::{PrimSource, World};

use crate::accel::RayCounts;

/// What to render and how well.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel: a square number lies on a regular grid, another on a rank-1 lattice.
    pub samples: u32,
    /// Bounces after the eye ray; `None`: chosen from the scene.
    pub depth: Option<u32>,
    /// Branches whose weight (largest channel) falls below this end.
    pub cutoff: f32,
    /// Seed of every random stream.
    pub seed: u64,
    /// Whether [`crate::image::Layers`] are wanted.
    pub layers: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { width: 1024, height: 768, samples: 4, depth: None, cutoff: 1.0 / 512.0, seed: 0, layers: false }
    }
}

/// Counts of a counted run, by ray class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassCounts {
    /// From the eye.
    pub primary: RayCounts,
    /// To the lights.
    pub shadow: RayCounts,
    /// Reflected.
    pub reflected: RayCounts,
    /// Refracted or passed through.
    pub refracted: RayCounts,
}
