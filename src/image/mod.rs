//! Linear pixels <-> files: tone mapping, PNG, EXR with layers, JPEG, WebP, metadata, difference metrics.
//!
//! [`encode`] turns a [`Picture`] into the bytes of a file, [`rgba8`] into pixels for a screen, [`write_atomic`] writes a file
//! to the disk, [`read_metadata`] reads how a picture was made. Knows nothing of scenes or rays.

mod develop;
pub mod diff;
pub mod draw;
mod encode;
mod error;
mod exif;
mod exr;
mod kind;
pub mod metadata;
mod output;
mod photo;
mod png;
pub mod read;
pub mod srgb;
pub mod statistics;
pub mod tone;
mod write;

pub(crate) use develop::Developer;
pub use develop::rgba8;
pub use encode::encode;
pub use error::ImageError;
pub use exr::{LARGEST_HALF, beyond_half};
pub use kind::FileKind;
pub use metadata::{Metadata, read_metadata, was_written_by_meshray};
pub use output::{ExrSamples, Output, PngDepth};
pub use read::{decode, read_picture};
pub use tone::ToneMap;
pub use write::{destination, folder_takes, write_atomic};

/// A rendered picture: linear Rec. 709, rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Beauty: RGBA, colour premultiplied by alpha; `width × height` values.
    pub beauty: Vec<[f32; 4]>,
    /// Further per-pixel data that was requested (`--layers`).
    pub layers: Option<Layers>,
    /// RGB: light of a known background that comes through coloured glass, in excess of what alpha lets through; added like the
    /// background, neither exposed nor tone mapped. A: the part of the pixel's coverage that is glass. Empty, or
    /// `width × height` values where glass stands before a background.
    pub veil: Vec<[f32; 4]>,
}

impl Picture {
    /// Picture of beauty alone.
    pub fn of(width: u32, height: u32, beauty: Vec<[f32; 4]>) -> Self {
        Self { width, height, beauty, layers: None, veil: Vec::new() }
    }
}

/// Per-pixel data beside the beauty; each array is empty or `width × height` long.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Surface colour without light, linear, averaged over the samples.
    pub albedo: Vec<[f32; 3]>,
    /// World-space unit shading normal, averaged over the samples; zero where nothing was hit.
    pub normal: Vec<[f32; 3]>,
    /// World-space position of the pixel's first sample that hit; zero where nothing was hit.
    pub position: Vec<[f32; 3]>,
    /// Distance along the view axis of the pixel's first sample that hit; infinite where nothing was hit.
    pub depth: Vec<f32>,
    /// Prim id of that sample; `u32::MAX` where nothing was hit.
    pub prim: Vec<u32>,
    /// Instance id of that sample (spheres, cones and planes count on after the instances); `u32::MAX` where nothing was hit.
    pub instance: Vec<u32>,
    /// Further channels that were requested.
    pub channels: Vec<Channel>,
}

/// One more value per pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name such as `tests.shadow`: the layer is the part before the dot.
    pub name: String,
    /// `width × height` values.
    pub values: Values,
}

/// The values of a [`Channel`].
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Counts.
    U32(Vec<u32>),
    /// Measures.
    F32(Vec<f32>),
}

impl Values {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::U32(values) => values.len(),
            Self::F32(values) => values.len(),
        }
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Every value; both kinds convert to `f64` exactly.
    pub fn iter(&self) -> impl Iterator<Item = f64> {
        let (counts, measures): (&[u32], &[f32]) = match self {
            Self::U32(values) => (values, &[]),
            Self::F32(values) => (&[], values),
        };
        counts.iter().map(|&n| f64::from(n)).chain(measures.iter().map(|&x| f64::from(x)))
    }
}
