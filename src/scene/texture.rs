//! Pictures that cover surfaces.

use crate::huge_pages::Paged;

/// A bitmap and how to read between and beyond its texels.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Texture {
    /// Index into [`super::Scene::bitmaps`].
    pub bitmap: u32,
    /// Wrap and filter.
    pub sampler: Sampler,
}

/// How texels are found from coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Sampler {
    /// Beyond 0…1 along u.
    pub wrap_u: Wrap,
    /// Beyond 0…1 along v.
    pub wrap_v: Wrap,
    /// When a texel covers more than a pixel.
    pub magnify: Filter,
    /// When a pixel covers more than a texel.
    pub minify: Filter,
    /// Whether smaller copies are used when minifying.
    pub mipmaps: Mipmaps,
}

/// What coordinates outside 0…1 mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The picture repeats.
    #[default]
    Repeat,
    /// Every second copy is mirrored.
    Mirror,
    /// The border texel goes on.
    Clamp,
}

/// What lies between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// Bilinear.
    #[default]
    Linear,
    /// The nearest texel.
    Nearest,
}

/// How the smaller copies of a bitmap are read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Mipmaps {
    /// Not at all.
    None,
    /// The nearest level.
    Nearest,
    /// Between the two nearest levels (trilinear).
    #[default]
    Linear,
}

/// A decoded picture, rows from the top.
#[derive(Clone, Debug, Default)]
pub struct Bitmap {
    /// Where it came from, for messages.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Texels, row by row; `width × height` of them.
    pub pixels: Pixels,
}

impl Bitmap {
    /// How many whole texels are stored.
    pub fn texels(&self) -> usize {
        match &self.pixels {
            Pixels::Rgb8(bytes) => bytes.len() / 3,
            Pixels::Rgba8(texels) => texels.len(),
            Pixels::Rgba16(texels) => texels.len(),
        }
    }

    /// Whether there is one for each place.
    pub fn is_whole(&self) -> bool {
        self.texels() as u64 == u64::from(self.width) * u64::from(self.height)
    }

    /// Bytes of its texels.
    pub fn bytes(&self) -> u64 {
        let bytes = match &self.pixels {
            Pixels::Rgb8(bytes) => bytes.len(),
            Pixels::Rgba8(texels) => texels.len() * 4,
            Pixels::Rgba16(texels) => texels.len() * 8,
        };
        bytes as u64
    }
}

/// Texels as the file stored them; whether 8-bit values are sRGB or linear is decided by the slot that reads them.
#[derive(Clone, Debug)]
pub enum Pixels {
    /// 8 bits a channel, RGB, opaque: three bytes each.
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
