//! Textures: bitmaps and how they are sampled.

use crate::huge_pages::Paged;

/// A bitmap and its sampler.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`super::Scene::bitmaps`].
    pub bitmap: u32,
    /// Wrapping and filtering.
    pub sampler: Sampler,
}

/// How texels are looked up by coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Wrapping along u, outside 0…1.
    pub wrap_u: Wrap,
    /// Wrapping along v, outside 0…1.
    pub wrap_v: Wrap,
    /// Filter where a texel covers more than a pixel.
    pub magnify: Filter,
    /// Filter where a pixel covers more than a texel.
    pub minify: Filter,
    /// Use of mip levels for minification.
    pub mipmaps: Mipmaps,
}

/// How coordinates outside 0…1 wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The picture repeats.
    #[default]
    Repeat,
    /// The picture repeats, every second copy mirrored.
    Mirror,
    /// The border texel repeats.
    Clamp,
}

/// Interpolation between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// The nearest texel.
    Nearest,
}

/// How the mip levels of a bitmap are sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mipmaps {
    /// Without mip levels.
    None,
    /// From the nearest level.
    Nearest,
    /// Between the two nearest levels (trilinear).
    #[default]
    Linear,
}

/// A decoded picture, rows from the top.
#[derive(Clone, Debug, Default)]
pub struct Bitmap {
    /// Source of the picture, for messages.
    pub name: String,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
    /// Texels, row by row; `width × height` of them.
    pub pixels: Pixels,
}

impl Bitmap {
    /// Number of whole texels stored.
    pub fn texels(&self) -> usize {
        match &self.pixels {
            Pixels::Rgb8(bytes) => bytes.len() / 3,
            Pixels::Rgba8(texels) => texels.len(),
            Pixels::Rgba16(texels) => texels.len(),
        }
    }

    /// Whether there are exactly `width × height` texels.
    pub fn is_whole(&self) -> bool {
        self.texels() as u64 == u64::from(self.width) * u64::from(self.height)
    }

    /// Size of the texels, bytes.
    pub fn bytes(&self) -> u64 {
        let bytes = match &self.pixels {
            Pixels::Rgb8(bytes) => bytes.len(),
            Pixels::Rgba8(texels) => texels.len() * 4,
            Pixels::Rgba16(texels) => texels.len() * 8,
        };
        bytes as u64
    }
}

/// Texels as stored in the file; whether 8-bit values are sRGB or linear depends on the slot that uses them.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// 8 bits a channel, RGB, opaque; three bytes per texel.
    Rgb8(Paged<u8>),
    /// 8 bits a channel, RGBA.
    Rgba8(Paged<[u8; 4]>),
    /// 16 bits a channel, RGBA.
    Rgba16(Paged<[u16; 4]>),
}

impl Default for Pixels {
    fn default() -> Self {
        Self::Rgba8(Paged::default())
    }
}
