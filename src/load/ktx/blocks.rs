//! Pixels of one level, in rows or in blocks of 4×4.

use crate::scene::Pixels;

/// How the pixels of a level are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    Rgb,
    Rgba,
    /// Blocks of 8 bytes; `alpha`: the fourth colour of a block may be transparent.
    Bc1 {
        alpha: bool,
    },
    /// Blocks of 16 bytes.
    Bc3,
    Bc7,
    /// Blocks of 16 bytes that are not decoded here: UASTC.
    Blocks16,
}

impl Layout {
    /// Size of a picture in bytes.
    pub(super) fn bytes(self, width: u32, height: u32) -> u64 {
        let pixels = u64::from(width) * u64::from(height);
        let blocks = u64::from(width.div_ceil(4)) * u64::from(height.div_ceil(4));
        match self {
            Self::Rgb => pixels.saturating_mul(3),
            Self::Rgba => pixels.saturating_mul(4),
            Self::Bc1 { .. } => blocks.saturating_mul(8),
            Self::Bc3 | Self::Bc7 | Self::Blocks16 => blocks.saturating_mul(16),
        }
    }
}

/// Decodes the pixels of a picture from exactly [`Layout::bytes`] bytes.
///
/// # Errors
/// If the number of bytes differs, or the layout cannot be decoded here.
pub(super) fn pixels_of(layout: Layout, bytes: &[u8], width: u32, height: u32) -> Result<Pixels, String> {
    if bytes.len() as u64 != layout.bytes(width, height) {
        return Err("its pixels are cut off".into());
    }
    let (width, height) = (width as usize, height as usize);
    Ok(match layout {
        Layout::Rgb => Pixels::Rgb8(bytes.to_vec().into()),
        Layout::Rgba => Pixels::Rgba8(bytes.as_chunks::<4>().0.to_vec().into()),
        Layout::Bc1 { alpha: true } => Pixels::Rgba8(blocks::<8>(bytes, width, height, ::bcdec_rs::bc1).into()),
        Layout::Bc1 { alpha: false } => {
            let texels = blocks::<8>(bytes, width, height, ::bcdec_rs::bc1);
            Pixels::Rgb8(texels.into_iter().flat_map(|[r, g, b, _]| [r, g, b]).collect())
        }
        Layout::Bc3 => Pixels::Rgba8(blocks::<16>(bytes, width, height, ::bcdec_rs::bc3).into()),
        Layout::Bc7 => Pixels::Rgba8(blocks::<16>(bytes, width, height, ::bcdec_rs::bc7).into()),
        Layout::Blocks16 => return Err("its blocks are of an unknown kind".into()),
    })
}

/// Decodes blocks of `N` bytes, row by row; texels outside the picture are dropped.
fn blocks<const N: usize>(
    bytes: &[u8],
    width: usize,
    height: usize,
    decode: fn(&[u8], &mut [u8], usize),
) -> Vec<[u8; 4]> {
    /// Bytes of one row of texels in a block; a block has four.
    const ROW: usize = 4 * 4;
    let mut out = vec![[0; 4]; width * height];
    let columns = width.div_ceil(4);
    for (i, block) in bytes.as_chunks::<N>().0.iter().enumerate() {
        let mut texels = [0; 4 * ROW];
        decode(block, &mut texels, ROW);
        let (x, y) = (i % columns * 4, i / columns * 4);
        let count = (width - x).min(4);
        for (row, texels) in texels.chunks_exact(ROW).take((height - y).min(4)).enumerate() {
            let first = (y + row) * width + x;
            out[first..first + count].copy_from_slice(&texels.as_chunks::<4>().0[..count]);
        }
    }
    out
}
