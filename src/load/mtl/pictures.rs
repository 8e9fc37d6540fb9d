//! Pictures that maps name -> bitmaps of the scene: unchanged, or derived as one channel, two pictures merged, or made opaque.
//!
//! Our materials read fixed channels (opacity and shininess red, roughness green, metallic blue, …); MTL names a picture, and
//! perhaps a channel, for each.

use super::options::Channel;
use crate::load::limits::{Budget, Limits};
use crate::load::texture::{Unusable, take_memory};
use crate::scene::color::to_srgb;
use crate::scene::{Bitmap, Pixels};
use std::collections::HashMap;

/// A bitmap to derive from decoded pictures; picture numbers are indices into [`Pictures::sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum TexelSource {
    /// The picture unchanged.
    Whole(usize),
    /// The picture's colour; alpha 1.
    Opaque(usize),
    /// One channel copied to red, green and blue; alpha 1.
    Channel(usize, Channel),
    /// 1 − one channel, copied to red, green and blue; alpha 1.
    Inverse(usize, Channel),
    /// Roughness in green, metallic in blue; 1 for a missing source.
    RoughMetal(Option<(usize, Channel)>, Option<(usize, Channel)>),
    /// One channel, sRGB-encoded, in red, green and blue: a linear number where a colour is read.
    Coded(usize, Channel),
    /// Anisotropy: strength in blue, direction as a vector in red and green. The angle in turns is a channel times the `f64`
    /// with these bits. Without sources the strength is 1 and the angle 0.
    Anisotropy(Option<(usize, Channel)>, Option<(usize, Channel)>, u64),
}

/// Use that a picture makes of its alpha channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// 1 everywhere.
    Solid,
    /// 0 everywhere: a channel that its author ignored.
    Clear,
    /// Values in between, or both 0 and 1.
    Used,
}

/// Decoded pictures and the bitmaps derived from them.
#[derive(Debug, Default)]
pub(super) struct Pictures {
    sources: Vec<Bitmap>,
    known: HashMap<TexelSource, u32>,
    made: Vec<BitmapSource>,
}

/// A bitmap of the scene: a decoded picture, which is not copied, or a new one.
#[derive(Debug)]
enum BitmapSource {
    Source(usize),
    New(Bitmap),
}

impl Pictures {
    /// Adds a decoded picture and returns its index.
    pub(super) fn add(&mut self, bitmap: Bitmap) -> usize {
        self.sources.push(bitmap);
        self.sources.len() - 1
    }

    /// Returns the index of a bitmap in the list of [`Self::finish`]; derives it on first use.
    ///
    /// # Errors
    /// If the bitmap exceeds `limits` or the rest of `budget`.
    pub(super) fn take(&mut self, take: TexelSource, limits: &Limits, budget: &mut Budget) -> Result<u32, Unusable> {
        if let Some(&known) = self.known.get(&take) {
            return Ok(known);
        }
        if let Some(((width, height), texel)) = self.size(take) {
            take_memory(width, height, texel, 0, limits, budget)?;
        }
        let made = match take {
            TexelSource::Whole(i) => BitmapSource::Source(i),
            TexelSource::Opaque(i) => BitmapSource::New(self.map(i, |[r, g, b, _]| [r, g, b, 1.0])),
            TexelSource::Channel(i, channel) => BitmapSource::New(self.map(i, |p| grey(pick(p, channel)))),
            TexelSource::Inverse(i, channel) => BitmapSource::New(self.map(i, |p| grey(1.0 - pick(p, channel)))),
            TexelSource::RoughMetal(rough, metal) => BitmapSource::New(self.rough_metal(rough, metal)),
            TexelSource::Coded(i, channel) => BitmapSource::New(self.coded(i, channel)),
            TexelSource::Anisotropy(strength, turn, most) => {
                BitmapSource::New(self.anisotropy(strength, turn, f64::from_bits(most)))
            }
        };
        #[expect(clippy::cast_possible_truncation, reason = "a handful of pictures for each material")]
        let index = self.made.len() as u32;
        self.made.push(made);
        self.known.insert(take, index);
        Ok(index)
    }

    /// Width and height of the bitmap to derive, and bytes per texel; `None` if nothing has to be allocated.
    fn size(&self, take: TexelSource) -> Option<((u32, u32), u64)> {
        let size = |i: usize| (self.sources[i].width, self.sources[i].height);
        match take {
            TexelSource::Whole(_) => None,
            TexelSource::Opaque(i) | TexelSource::Channel(i, _) | TexelSource::Inverse(i, _) => {
                let is_deep = matches!(self.sources[i].pixels, Pixels::Rgba16(_));
                Some((size(i), if is_deep { 8 } else { 4 }))
            }
            TexelSource::RoughMetal(rough, metal) => Some((self.size_of_pair([rough, metal]), 4)),
            TexelSource::Coded(i, _) => Some((size(i), 8)),
            TexelSource::Anisotropy(strength, turn, _) => Some((self.size_of_pair([strength, turn]), 8)),
        }
    }

    /// Names of the source pictures, for messages.
    pub(super) fn name(&self, take: TexelSource) -> String {
        match take {
            TexelSource::Whole(i)
            | TexelSource::Opaque(i)
            | TexelSource::Channel(i, _)
            | TexelSource::Inverse(i, _)
            | TexelSource::Coded(i, _) => self.sources[i].name.clone(),
            TexelSource::RoughMetal(first, second) | TexelSource::Anisotropy(first, second, _) => {
                self.name_of_pair([first, second])
            }
        }
    }

    /// Returns the bitmaps in the order of their indices.
    pub(super) fn finish(mut self) -> Vec<Bitmap> {
        let bitmap = |made| match made {
            BitmapSource::Source(i) => std::mem::take(&mut self.sources[i]),
            BitmapSource::New(bitmap) => bitmap,
        };
        self.made.into_iter().map(bitmap).collect()
    }

    /// Returns how picture `i` uses its alpha channel.
    pub(super) fn alpha(&self, i: usize) -> Alpha {
        let (mut lowest, mut highest) = (1.0f32, 0.0f32);
        each_texel(&self.sources[i], |p| (lowest, highest) = (lowest.min(p[3]), highest.max(p[3])));
        if lowest == 1.0 {
            Alpha::Solid
        } else if highest == 0.0 {
            Alpha::Clear
        } else {
            Alpha::Used
        }
    }

    /// Returns whether red, green and blue are equal in every texel.
    pub(super) fn is_grey(&self, i: usize) -> bool {
        let mut grey = true;
        each_texel(&self.sources[i], |p| grey &= p[0] == p[1] && p[1] == p[2]);
        grey
    }

    /// Returns whether picture `i` is a normal map: nine in ten texels are unit vectors that point out of the surface. Light
    /// grey decodes to a unit vector, too, but is a height.
    pub(super) fn is_normal_map(&self, i: usize) -> bool {
        /// Spread of the channels that compression leaves in grey.
        const GREY: f32 = 0.05;
        let (mut unit, mut all) = (0u64, 0u64);
        each_texel(&self.sources[i], |[r, g, b, _]| {
            let n = crate::math::Vec3::new(r, g, b) * 2.0 - 1.0;
            let is_grey = (n - n.z).abs().max_element() < GREY;
            unit += u64::from((n.length() - 1.0).abs() < 0.1 && n.z > 0.0 && !is_grey);
            all += 1;
        });
        unit * 10 >= all * 9
    }

    fn map(&self, i: usize, change: impl Fn([f32; 4]) -> [f32; 4]) -> Bitmap {
        let Bitmap { name, width, height, pixels } = &self.sources[i];
        let pixels = match pixels {
            Pixels::Rgb8(bytes) => Pixels::Rgba8(threes(bytes).iter().map(|&t| to8(change(solid8(t)))).collect()),
            Pixels::Rgba8(texels) => Pixels::Rgba8(texels.iter().map(|&t| to8(change(from8(t)))).collect()),
            Pixels::Rgba16(texels) => Pixels::Rgba16(texels.iter().map(|&t| to16(change(from16(t)))).collect()),
        };
        Bitmap { name: name.clone(), width: *width, height: *height, pixels }
    }

    /// Uses 16 bits so that the sRGB encoding loses nothing.
    fn coded(&self, i: usize, channel: Channel) -> Bitmap {
        let Bitmap { name, width, height, .. } = &self.sources[i];
        let mut pixels = Vec::with_capacity(*width as usize * *height as usize);
        each_texel(&self.sources[i], |p| pixels.push(to16(grey(to_srgb(pick(p, channel))))));
        Bitmap { name: name.clone(), width: *width, height: *height, pixels: Pixels::Rgba16(pixels.into()) }
    }

    fn rough_metal(&self, rough: Option<(usize, Channel)>, metal: Option<(usize, Channel)>) -> Bitmap {
        let texel = |[rough, metal]: [Option<f32>; 2]| to8([1.0, rough.unwrap_or(1.0), metal.unwrap_or(1.0), 1.0]);
        self.pair([rough, metal], texel, |texels| Pixels::Rgba8(texels.into()))
    }

    /// Uses 16 bits, as 8 bits cannot store the middle of their range and would turn an angle of 0 by 0.2°.
    fn anisotropy(&self, strength: Option<(usize, Channel)>, turn: Option<(usize, Channel)>, most: f64) -> Bitmap {
        #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
        let texel = |[strength, turn]: [Option<f32>; 2]| {
            let (sin, cos) = libm::sincos(f64::from(turn.unwrap_or(0.0)) * most * std::f64::consts::TAU);
            to16([0.5 + 0.5 * cos as f32, 0.5 + 0.5 * sin as f32, strength.unwrap_or(1.0), 1.0])
        };
        self.pair([strength, turn], texel, |texels| Pixels::Rgba16(texels.into()))
    }

    /// Combines two pictures texel by texel.
    ///
    /// The result has the larger width and the larger height; smaller pictures are enlarged by repeating texels.
    fn pair<T>(
        &self,
        [first, second]: [Option<(usize, Channel)>; 2],
        make: impl Fn([Option<f32>; 2]) -> T,
        pixels: impl Fn(Vec<T>) -> Pixels,
    ) -> Bitmap {
        let (width, height) = self.size_of_pair([first, second]);
        let read = |source: Option<(usize, Channel)>, x: u32, y: u32| match source {
            Some((i, channel)) => {
                let bitmap = &self.sources[i];
                let scaled = |at: u32, of: u32, to: u32| u64::from(at) * u64::from(to) / u64::from(of);
                let at = scaled(y, height, bitmap.height) * u64::from(bitmap.width) + scaled(x, width, bitmap.width);
                #[expect(clippy::cast_possible_truncation, reason = "an index into texels in memory")]
                texel(bitmap, at as usize).map(|p| pick(p, channel))
            }
            None => None,
        };
        let mut texels = Vec::with_capacity(width as usize * height as usize);
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        texels.extend(places.map(|(x, y)| make([read(first, x, y), read(second, x, y)])));
        Bitmap { name: self.name_of_pair([first, second]), width, height, pixels: pixels(texels) }
    }

    fn size_of_pair(&self, sources: [Option<(usize, Channel)>; 2]) -> (u32, u32) {
        let sizes = sources.into_iter().flatten().map(|(i, _)| (self.sources[i].width, self.sources[i].height));
        sizes.fold((1, 1), |(w, h), (x, y)| (w.max(x), h.max(y)))
    }

    fn name_of_pair(&self, sources: [Option<(usize, Channel)>; 2]) -> String {
        let names = sources.into_iter().flatten().map(|(i, _)| self.sources[i].name.as_str());
        names.collect::<Vec<_>>().join(" + ")
    }
}

fn texel(bitmap: &Bitmap, at: usize) -> Option<[f32; 4]> {
    match &bitmap.pixels {
        Pixels::Rgb8(bytes) => threes(bytes).get(at).map(|&t| solid8(t)),
        Pixels::Rgba8(texels) => texels.get(at).map(|&t| from8(t)),
        Pixels::Rgba16(texels) => texels.get(at).map(|&t| from16(t)),
    }
}

fn each_texel(bitmap: &Bitmap, mut look: impl FnMut([f32; 4])) {
    match &bitmap.pixels {
        Pixels::Rgb8(bytes) => threes(bytes).iter().for_each(|&t| look(solid8(t))),
        Pixels::Rgba8(texels) => texels.iter().for_each(|&t| look(from8(t))),
        Pixels::Rgba16(texels) => texels.iter().for_each(|&t| look(from16(t))),
    }
}

/// Views the bytes of an RGB picture as texels.
fn threes(bytes: &[u8]) -> &[[u8; 3]] {
    bytes.as_chunks().0
}

fn pick([r, g, b, a]: [f32; 4], channel: Channel) -> f32 {
    match channel {
        Channel::Red => r,
        Channel::Green => g,
        Channel::Blue => b,
        Channel::Alpha => a,
        // Rec. 709 weights on the stored values: scalar maps are data, not light.
        Channel::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
    }
}

fn grey(value: f32) -> [f32; 4] {
    [value, value, value, 1.0]
}

fn from8(texel: [u8; 4]) -> [f32; 4] {
    texel.map(|c| f32::from(c) / 255.0)
}

fn solid8([r, g, b]: [u8; 3]) -> [f32; 4] {
    from8([r, g, b, u8::MAX])
}

fn from16(texel: [u16; 4]) -> [f32; 4] {
    texel.map(|c| f32::from(c) / 65535.0)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 255 after clamping")]
fn to8(texel: [f32; 4]) -> [u8; 4] {
    texel.map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8)
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 65535 after clamping")]
fn to16(texel: [f32; 4]) -> [u16; 4] {
    texel.map(|c| (c.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pictures(bitmaps: &[(u32, u32, &[[u8; 4]])]) -> Pictures {
        let mut out = Pictures::default();
        for &(width, height, texels) in bitmaps {
            out.add(Bitmap { name: "p".into(), width, height, pixels: Pixels::Rgba8(texels.to_vec().into()) });
        }
        out
    }

    fn texels(pictures: Pictures) -> Vec<Vec<[u8; 4]>> {
        let texels = |bitmap: Bitmap| match bitmap.pixels {
            Pixels::Rgba8(texels) => texels.to_vec(),
            Pixels::Rgb8(_) | Pixels::Rgba16(_) => Vec::new(),
        };
        pictures.finish().into_iter().map(texels).collect()
    }

    /// Derives a bitmap under the default limits.
    fn make(pictures: &mut Pictures, take: TexelSource) -> u32 {
        let limits = Limits::default();
        pictures.take(take, &limits, &mut Budget::new(&limits)).ok().unwrap()
    }

    #[test]
    fn channels_move_to_where_materials_read_them() {
        let mut p = pictures(&[(1, 1, &[[10, 20, 30, 40]])]);
        let takes = [
            (TexelSource::Whole(0), [10, 20, 30, 40]),
            (TexelSource::Opaque(0), [10, 20, 30, 255]),
            (TexelSource::Channel(0, Channel::Alpha), [40, 40, 40, 255]),
            (TexelSource::Inverse(0, Channel::Green), [235, 235, 235, 255]),
            (TexelSource::RoughMetal(Some((0, Channel::Red)), None), [255, 10, 255, 255]),
        ];
        for (i, (take, _)) in (0..).zip(takes) {
            assert_eq!((make(&mut p, take), make(&mut p, take)), (i, i), "made once");
        }
        assert_eq!(texels(p), takes.map(|(_, expected)| vec![expected]));
    }

    #[test]
    fn roughness_and_metal_of_different_sizes_share_a_bitmap() {
        let mut p = pictures(&[(2, 1, &[[1; 4], [2; 4]]), (1, 2, &[[3; 4], [4; 4]])]);
        make(&mut p, TexelSource::RoughMetal(Some((0, Channel::Red)), Some((1, Channel::Red))));
        assert_eq!(texels(p), [[[255, 1, 3, 255], [255, 2, 3, 255], [255, 1, 4, 255], [255, 2, 4, 255]]]);
    }

    #[test]
    fn numbers_are_read_back_from_where_colours_and_directions_are() {
        let mut p = pictures(&[(2, 1, &[[51, 0, 0, 0], [128, 0, 0, 0]])]);
        let (red, quarter) = (Some((0, Channel::Red)), 0.25f64.to_bits());
        let takes = [
            TexelSource::Coded(0, Channel::Red),
            TexelSource::Anisotropy(red, None, quarter),
            TexelSource::Anisotropy(None, red, 5f64.to_bits()),
        ];
        for take in takes {
            make(&mut p, take);
        }
        let wide = |bitmap: Bitmap| match bitmap.pixels {
            Pixels::Rgba16(texels) => texels.iter().map(|t| t.map(|c| f32::from(c) / 65535.0)).collect(),
            other => panic!("{other:?}"),
        };
        let made: Vec<Vec<[f32; 4]>> = p.finish().into_iter().map(wide).collect();
        let value = crate::scene::color::from_srgb([0, 1, 2].map(|k| made[0][0][k]));
        assert!((value - 0.2).abs().max_element() < 1e-4, "{value}");
        let near = |texel: [f32; 4], expected: [f32; 3]| (0..3).all(|k| (texel[k] - expected[k]).abs() < 1e-4);
        assert!(near(made[1][0], [1.0, 0.5, 0.2]), "a strength turns nothing: {:?}", made[1]);
        assert!(near(made[2][0], [1.0, 0.5, 1.0]), "a fifth of five turns is a whole one: {:?}", made[2]);
    }

    #[test]
    fn what_is_made_is_charged_before_it_is_made() {
        // A row and a column: the pair has the width of the one and the height of the other.
        let mut p = pictures(&[(3000, 1, &[[1; 4]; 3000]), (1, 3000, &[[2; 4]; 3000])]);
        let (row, column) = (Some((0, Channel::Red)), Some((1, Channel::Red)));
        let pair = 3000 * 3000 * 4 + 3_000_000 * 8;
        let mut budget = Budget::new(&Limits { memory: pair, ..Limits::default() });
        let small = Limits { image_pixels: 3000 * 3000 - 1, ..Limits::default() };
        let over = p.take(TexelSource::RoughMetal(row, column), &small, &mut budget).unwrap_err();
        assert!(over.why.contains("3000×3000 pixels"), "{}", over.why);
        assert!(p.take(TexelSource::RoughMetal(row, column), &Limits::default(), &mut budget).is_ok());
        assert_eq!((budget.left(), p.name(TexelSource::Anisotropy(row, column, 0)).as_str()), (0, "p + p"));
        for take in [
            TexelSource::Opaque(0),
            TexelSource::Coded(0, Channel::Red),
            TexelSource::Anisotropy(row, None, 0),
            TexelSource::Inverse(0, Channel::Red),
        ] {
            assert!(p.take(take, &Limits::default(), &mut budget).is_err(), "{take:?}");
        }
        // Bitmaps that exist already cost nothing.
        assert!(p.take(TexelSource::Whole(0), &Limits::default(), &mut budget).is_ok());
        assert!(p.take(TexelSource::RoughMetal(row, column), &Limits::default(), &mut budget).is_ok());
    }

    #[test]
    fn pictures_are_recognised_by_their_texels() {
        let p = pictures(&[(1, 1, &[[127, 127, 255, 255]]), (2, 1, &[[90; 4], [9, 9, 9, 0]]), (1, 1, &[[1, 2, 3, 0]])]);
        assert!(p.is_normal_map(0) && !p.is_normal_map(1));
        assert!(p.is_grey(1) && !p.is_grey(2));
        assert_eq!([0, 1, 2].map(|i| p.alpha(i)), [Alpha::Solid, Alpha::Used, Alpha::Clear]);
    }
}
