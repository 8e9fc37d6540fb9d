//! User choices of how linear pixels become a file.

use super::ToneMap;

/// Choices for [`super::encode`].
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Curve from scene light to display light; EXR files stay linear and ignore it.
    pub tone_map: ToneMap,
    /// Stops of brightening (doublings) before the tone map; EXR files ignore it.
    pub exposure: f32,
    /// Linear Rec. 709 colour behind the picture, each channel 0..=1; `None` keeps the transparency.
    ///
    /// For display formats it is composited behind the tone-mapped picture, so that white stays white; for EXR behind the
    /// linear one. JPEG has no transparency and takes white for `None`.
    pub background: Option<[f32; 3]>,
    /// Bits of a PNG sample.
    pub png_depth: PngDepth,
    /// Number type of an EXR's colour channels.
    pub exr_samples: ExrSamples,
    /// JPEG quality, 1..=100.
    pub jpeg_quality: u8,
}

impl Default for Output {
    fn default() -> Self {
        Self {
            tone_map: ToneMap::default(),
            exposure: 0.0,
            background: None,
            png_depth: PngDepth::default(),
            exr_samples: ExrSamples::default(),
            jpeg_quality: 92,
        }
    }
}

/// Bits of a PNG sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PngDepth {
    /// 256 steps.
    #[default]
    Eight,
    /// 65 536 steps.
    Sixteen,
}

/// Number type of an EXR's colour channels; positions and depth are always floats, ids always unsigned integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ExrSamples {
    /// 16 bit, 11 of precision, up to 65 504.
    #[default]
    Half,
    /// 32 bit: exactly the pixels that were computed.
    Float,
}
