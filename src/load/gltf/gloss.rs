//! Conversion of the glossiness in the alpha channel of specular-glossiness maps to roughness.
//!
//! Roughness is 1 − glossiness (KHR_materials_pbrSpecularGlossiness), so the map is converted once after decoding: roughness in
//! green and a metallic factor of 0 in blue, as in metallic-roughness maps.

use crate::huge_pages::Paged;
use crate::scene::{Bitmap, Pixels};

/// Map of the roughness 1 − `gloss` × alpha of a picture, with `gloss` in 0 … 1. One texel where there is no alpha.
pub(super) fn roughness(picture: &Bitmap, gloss: f32) -> Bitmap {
    let Bitmap { name, width, height, .. } = picture;
    let (width, height, pixels) = match &picture.pixels {
        Pixels::Rgb8(_) => (1, 1, Pixels::Rgba8(vec![texel8(u8::MAX, gloss)].into())),
        Pixels::Rgba8(texels) => {
            (*width, *height, Pixels::Rgba8(map_texels(texels, |&[.., alpha]| texel8(alpha, gloss))))
        }
        Pixels::Rgba16(texels) => {
            (*width, *height, Pixels::Rgba16(map_texels(texels, |&[.., alpha]| texel16(alpha, gloss))))
        }
    };
    Bitmap { name: name.clone(), width, height, pixels }
}

fn map_texels<T: bytemuck::Pod>(texels: &[T], change: impl Fn(&T) -> T) -> Paged<T> {
    let mut changed = Paged::zeroed(texels.len());
    changed.iter_mut().zip(texels).for_each(|(to, from)| *to = change(from));
    changed
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 255")]
fn texel8(alpha: u8, gloss: f32) -> [u8; 4] {
    [u8::MAX, (255.5 - gloss * f32::from(alpha)) as u8, 0, u8::MAX]
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 65535")]
fn texel16(alpha: u16, gloss: f32) -> [u16; 4] {
    [u16::MAX, (65535.5 - gloss * f32::from(alpha)) as u16, 0, u16::MAX]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: Pixels, gloss: f32) -> Pixels {
        roughness(&Bitmap { name: String::new(), width: 2, height: 1, pixels }, gloss).pixels
    }

    #[test]
    fn roughness_is_what_gloss_is_missing_to_one() {
        let picture = || Pixels::Rgba8(vec![[9, 8, 7, 255], [9, 8, 7, 51]].into());
        assert!(matches!(of(picture(), 1.0), Pixels::Rgba8(p) if p[..] == [[255, 0, 0, 255], [255, 204, 0, 255]]));
        assert!(matches!(of(picture(), 0.5), Pixels::Rgba8(p) if p[..] == [[255, 128, 0, 255], [255, 230, 0, 255]]));
        assert!(matches!(of(picture(), 0.0), Pixels::Rgba8(p) if p[..] == [[255, 255, 0, 255]; 2]));
        let deep = Pixels::Rgba16(vec![[0, 0, 0, 65535], [0, 0, 0, 1]].into());
        assert!(matches!(of(deep, 1.0), Pixels::Rgba16(p) if (p[0][1], p[1][1]) == (0, 65534)));
    }

    #[test]
    fn a_picture_without_alpha_is_as_glossy_everywhere() {
        let picture = Bitmap { name: "a".into(), width: 2, height: 1, pixels: Pixels::Rgb8(vec![1; 6].into()) };
        let Bitmap { width, height, pixels, .. } = roughness(&picture, 0.8);
        assert!((width, height) == (1, 1) && matches!(pixels, Pixels::Rgba8(p) if p[..] == [[255, 51, 0, 255]]));
    }
}
