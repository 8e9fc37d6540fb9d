//! Texture lookups: wrapping, filtering, and the mip level that suits the footprint.
//!
//! Bitmaps stay as stored; texels are decoded when read (`decode`), and mip levels are built when a lookup first needs them
//! (`pyramid`). An anisotropic footprint is covered by several probes along its major axis, as in EXT_texture_filter_anisotropic
//! (after McCormack, Perry, Farkas, Jouppi, *Feline*, 1999).
//!
//! Every lookup is a pure function of the scene and its arguments: no state, no order, the same bits on every thread.

mod decode;
mod places;
mod pyramid;
mod survey;

pub(crate) use places::{Layout, Places, Spots, changes};
pub(crate) use survey::{Codes, Survey};

use crate::math::formula::floor_of_one;
use crate::math::{Vec2, Vec4};
use crate::scene::{Bitmap, Filter, Mipmaps, Pixels, Sampler, Scene, Texture, Wrap};
use decode::Texels;
use pyramid::{Plane, Pyramid, Stored};
use std::ops::{Add, Mul, Sub};
use std::sync::{Arc, Mutex, PoisonError};

/// Interpretation of a bitmap's values; chosen by the slot that reads it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorSpace {
    /// Colours: red, green and blue follow the sRGB curve; alpha is linear and independent.
    Srgb,
    /// Colours with alpha as coverage: it weights the colours in mip levels.
    SrgbCutOut,
    /// Data: four independent linear channels.
    Linear,
}

/// Maximum number of probes in an elongated footprint.
const MAX_PROBES: f32 = 8.0;

/// [`MAX_PROBES`] as an array length.
const PROBES: usize = MAX_PROBES as usize;

/// All textures of a scene, ready to be read.
#[derive(Debug)]
pub struct TextureStore<'a> {
    textures: &'a [Texture],
    /// `None` for a bitmap that is empty, or has fewer texels than its width and height say.
    bitmaps: Vec<Option<Source<'a>>>,
    /// Read where there is no map.
    stand_in: Option<Source<'static>>,
    surveys: Surveys,
}

/// Cached surveys of maps, by texture, channel and codes.
type Surveys = Mutex<Vec<((u32, usize, Codes), Arc<Option<Survey>>)>>;

/// Texture index of missing maps.
pub(super) const STAND_IN: u32 = u32::MAX;

/// A bitmap with its mip levels, by colour space.
#[derive(Debug)]
struct Source<'a> {
    bitmap: &'a Bitmap,
    srgb: Pyramid,
    cut_out: Pyramid,
    linear: Pyramid,
}

impl<'a> Source<'a> {
    fn new(bitmap: &'a Bitmap) -> Self {
        let [srgb, cut_out, linear] = std::array::from_fn(|_| Pyramid::new(bitmap));
        Self { bitmap, srgb, cut_out, linear }
    }

    /// The bitmap in one colour space, with one sampler.
    fn lookup(&self, space: ColorSpace, sampler: Sampler) -> Lookup<'_> {
        let pyramid = match space {
            ColorSpace::Srgb => &self.srgb,
            ColorSpace::SrgbCutOut => &self.cut_out,
            ColorSpace::Linear => &self.linear,
        };
        Lookup { bitmap: self.bitmap, pyramid, space, sampler }
    }
}

impl<'a> TextureStore<'a> {
    /// Makes the scene's textures readable; copies and computes nothing.
    pub fn new(scene: &'a Scene) -> Self {
        let bitmaps = scene.bitmaps.iter().map(|bitmap| is_whole(bitmap).then(|| Source::new(bitmap)));
        Self { textures: &scene.textures, bitmaps: bitmaps.collect(), stand_in: None, surveys: Surveys::default() }
    }

    /// A store in which missing maps are read, too, without effect (see [`no_prune`](super::no_prune)).
    #[must_use]
    pub fn without_pruning(self) -> Self {
        Self { stand_in: Some(Source::new(&super::no_prune::GREY)), ..self }
    }

    /// Columns and rows of a texture's bitmap; (1, 1) for a missing texture.
    pub fn size(&self, texture: u32) -> Vec2 {
        self.find(texture).map_or(Vec2::ONE, |(_, source)| pixels(size_of(source.bitmap)))
    }

    /// Linear RGBA (straight alpha) of `texture` around `uv`.
    ///
    /// `duvdx` and `duvdy` span the footprint: the change of `uv` from this sample to the next along two directions; zero selects
    /// the magnification filter. A missing or empty texture is opaque white. Values that are not finite are safe: such a `uv`
    /// counts as 0, such a footprint as unbounded.
    pub fn sample(&self, texture: u32, space: ColorSpace, uv: Vec2, duvdx: Vec2, duvdy: Vec2) -> Vec4 {
        let Some((sampler, source)) = self.find(texture) else { return Vec4::ONE };
        source.lookup(space, sampler).filtered(uv, duvdx, duvdy)
    }

    /// Channel `CHANNEL` of the linear RGBA of `texture` at `uv`, at full resolution: that of [`Self::sample`] with a footprint
    /// of zero.
    pub(in crate::render) fn channel<const CHANNEL: usize>(&self, texture: u32, uv: Vec2) -> f32 {
        let [read] = self.channels::<CHANNEL, 1>(texture, &[[uv.x], [uv.y]], 1);
        read
    }

    /// [`Self::channel`] at the first `count` of some places, given by axis.
    #[inline(always)]
    pub(in crate::render) fn channels<const CHANNEL: usize, const N: usize>(
        &self,
        texture: u32,
        uv: &[[f32; N]; 2],
        count: usize,
    ) -> [f32; N] {
        let Some((sampler, source)) = self.find(texture) else { return [1.0; N] };
        let lookup = source.lookup(ColorSpace::Linear, sampler);
        match &source.bitmap.pixels {
            Pixels::Rgb8(_) if CHANNEL == 3 => [1.0; N],
            Pixels::Rgb8(texels) => lookup.sharp(uv, count, |i| decode::unit8(texels[3 * i + CHANNEL])),
            Pixels::Rgba8(texels) => lookup.sharp(uv, count, |i| decode::unit8(texels[i][CHANNEL])),
            Pixels::Rgba16(texels) => lookup.sharp(uv, count, |i| decode::unit16(texels[i][CHANNEL])),
        }
    }

    /// Change of the linear texels from `uv` to `reach` times each of two vectors, which span a footprint as in [`Self::sample`]:
    /// between single texels, of the mip level that suits the footprint, at least one texel apart.
    pub(super) fn changes(&self, texture: u32, uv: Vec2, ways: [Vec2; 2], reach: f32) -> [Vec4; 2] {
        let Some((sampler, source)) = self.find(texture) else { return [Vec4::ZERO; 2] };
        source.lookup(ColorSpace::Linear, sampler).changes(uv, ways, reach)
    }

    /// Clear and solid parts of a map's channel. Surveyed once; `None` where there are none, or where it would take long.
    pub(super) fn survey(&self, texture: u32, channel: usize, codes: Codes) -> Arc<Option<Survey>> {
        let mut surveys = self.surveys.lock().unwrap_or_else(PoisonError::into_inner);
        let what = (texture, channel, codes);
        if let Some((_, known)) = surveys.iter().find(|(known, _)| *known == what) {
            return Arc::clone(known);
        }
        let found = Arc::new(Survey::of(self, texture, channel, codes));
        surveys.push((what, Arc::clone(&found)));
        found
    }

    fn find(&self, texture: u32) -> Option<(Sampler, &Source<'a>)> {
        if texture == STAND_IN {
            return self.stand_in.as_ref().map(|source| (Sampler::default(), source));
        }
        let texture = self.textures.get(texture as usize)?;
        let source = self.bitmaps.get(texture.bitmap as usize)?.as_ref()?;
        Some((texture.sampler, source))
    }
}

/// Whether a bitmap has texels, and as many as width and height promise.
fn is_whole(bitmap: &Bitmap) -> bool {
    bitmap.texels() > 0 && bitmap.is_whole()
}

fn size_of(bitmap: &Bitmap) -> (usize, usize) {
    pyramid::size(bitmap, 0)
}

#[expect(clippy::cast_precision_loss, reason = "bitmaps have far fewer than 2^24 columns or rows")]
fn pixels((width, height): (usize, usize)) -> Vec2 {
    Vec2::new(width as f32, height as f32)
}

/// One bitmap, in one colour space, with its sampler.
#[derive(Clone, Copy)]
struct Lookup<'a> {
    bitmap: &'a Bitmap,
    pyramid: &'a Pyramid,
    space: ColorSpace,
    sampler: Sampler,
}

/// Mip levels that the probes of one footprint read.
#[derive(Clone, Copy)]
enum Plan<'a> {
    One(Plane<'a>, Filter),
    /// Two levels, and the weight of the second.
    Between(Plane<'a>, Plane<'a>, Filter, f32),
}

impl<'a> Lookup<'a> {
    /// Mean over a footprint.
    fn filtered(&self, uv: Vec2, duvdx: Vec2, duvdy: Vec2) -> Vec4 {
        // Lengths of the footprint's axes in texels.
        let texels = pixels(size_of(self.bitmap));
        let (dx, dy) = ((duvdx * texels).length(), (duvdy * texels).length());
        let (major, minor, axis) = if dx >= dy { (dx, dy, duvdx) } else { (dy, dx, duvdy) };
        if major <= 1.0 {
            return self.read(Plan::One(self.plane(0), self.sampler.magnify), &Probes::one(uv));
        }
        if !(major.is_finite() && minor.is_finite()) {
            return self.read(self.plan(f32::INFINITY), &Probes::one(uv));
        }

        // The number of probes is the footprint's aspect ratio; files that ask for nearest texels get one.
        let count = match self.sampler.minify {
            Filter::Nearest => 1.0,
            Filter::Linear => probes(major, minor),
        };
        let plan = self.plan(libm::log2f(major / count));
        self.read(plan, &Probes { uv, axis, count })
    }

    /// One value of the texels, at full resolution, at the first `count` of some places.
    #[inline(always)]
    fn sharp<const N: usize>(&self, [u, v]: &[[f32; N]; 2], count: usize, texel: impl Fn(usize) -> f32) -> [f32; N] {
        let (size, mut read) = (size_of(self.bitmap), [1.0; N]);
        for (read, (&u, &v)) in read.iter_mut().zip(u.iter().zip(v)).take(count) {
            *read = self.tap(size, Vec2::new(u, v), self.sampler.magnify).read(&texel);
        }
        read
    }

    fn changes(&self, uv: Vec2, ways: [Vec2; 2], reach: f32) -> [Vec4; 2] {
        let texels = pixels(size_of(self.bitmap));
        let widest = (ways[0] * texels).length().max((ways[1] * texels).length());
        let level = match self.sampler.mipmaps {
            Mipmaps::None => 0,
            Mipmaps::Nearest | Mipmaps::Linear => doublings(widest),
        };
        let plane = self.plane((level as usize).min(self.pyramid.top()));
        let texel = |uv: Vec2| {
            let x = Axis::new(uv.x, plane.width, self.sampler.wrap_u, Filter::Nearest);
            let y = Axis::new(uv.y, plane.height, self.sampler.wrap_v, Filter::Nearest);
            plane.texel(x.near, y.near)
        };
        let (here, texels) = (texel(uv), pixels((plane.width, plane.height)));
        ways.map(|way| match apart(way, texels, reach) {
            Some(longer) => (texel(uv + way * (reach * longer)) - here) / longer,
            None => Vec4::ZERO,
        })
    }

    /// Levels to read where a probe covers 2^`lod` texels.
    fn plan(&self, lod: f32) -> Plan<'a> {
        let Sampler { magnify, minify, mipmaps, .. } = self.sampler;
        if lod <= 0.0 {
            return Plan::One(self.plane(0), magnify);
        }
        let top = self.pyramid.top();
        match mipmaps {
            Mipmaps::None => Plan::One(self.plane(0), minify),
            Mipmaps::Nearest => Plan::One(self.plane(whole(lod + 0.5).min(top)), minify),
            Mipmaps::Linear => {
                let lower = whole(lod);
                if lower >= top {
                    return Plan::One(self.plane(top), minify);
                }
                Plan::Between(self.plane(lower), self.plane(lower + 1), minify, lod - floor_of_one(lod))
            }
        }
    }

    fn plane(&self, level: usize) -> Plane<'a> {
        self.pyramid.plane(self.bitmap, self.space, level)
    }

    fn read(&self, plan: Plan, probes: &Probes) -> Vec4 {
        match plan {
            Plan::One(plane, filter) => self.level(&plane, probes, filter),
            Plan::Between(lower, upper, filter, share) => {
                let (a, b) = (self.level(&lower, probes, filter), self.level(&upper, probes, filter));
                a + (b - a) * share
            }
        }
    }

    /// Looks up one level: the storage format is matched once, not for each texel.
    fn level(&self, plane: &Plane, probes: &Probes, filter: Filter) -> Vec4 {
        match plane.texels {
            Stored::Level(texels) => {
                let codes = self.mean(plane, probes, filter, |i| pyramid::codes(&texels[i]));
                codes / 65535.0
            }
            Stored::Bitmap(Texels::Rgb8(texels, colors)) => {
                self.mean(plane, probes, filter, |i| decode::solid8(texels[i], colors))
            }
            Stored::Bitmap(texels) => self.mean(plane, probes, filter, |i| texels.get(i)),
        }
    }

    /// Mean of all probes.
    #[inline(always)]
    fn mean(&self, plane: &Plane, probes: &Probes, filter: Filter, texel: impl Fn(usize) -> Vec4) -> Vec4 {
        if probes.count <= 1.0 {
            return self.tap((plane.width, plane.height), probes.uv, filter).read(&texel);
        }
        // First the addresses of all probes, then their texels: so none waits for another.
        let (mut taps, mut count, mut k) = ([Tap::default(); PROBES], 0, 0.5);
        while k < probes.count {
            let uv = probes.uv + probes.axis * (k / probes.count - 0.5);
            taps[count % PROBES] = self.tap((plane.width, plane.height), uv, filter);
            (count, k) = (count + 1, k + 1.0);
        }
        // Written so that the mean of equal texels is exact.
        let first = taps[0].read(&texel);
        let rest = taps.iter().take(count).skip(1);
        first + rest.fold(Vec4::ZERO, |sum, tap| sum + (tap.read(&texel) - first)) / probes.count
    }

    /// Texels that a probe reads from a level of this size.
    #[inline(always)]
    fn tap(&self, (width, height): (usize, usize), uv: Vec2, filter: Filter) -> Tap {
        let x = Axis::new(uv.x, width, self.sampler.wrap_u, filter);
        let y = Axis::new(uv.y, height, self.sampler.wrap_v, filter);
        let (near, far) = (y.near * width, y.far * width);
        let corners = [near + x.near, near + x.far, far + x.near, far + x.far];
        Tap { corners, x: x.share, y: y.share, mixed: filter == Filter::Linear }
    }
}

/// The four texels around a place, the weights of the right and the lower ones, and whether they are interpolated; if not, only
/// the first is read.
#[derive(Clone, Copy, Default)]
struct Tap {
    corners: [usize; 4],
    x: f32,
    y: f32,
    mixed: bool,
}

impl Tap {
    #[inline(always)]
    fn read<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<f32, Output = T>>(
        &self,
        texel: impl Fn(usize) -> T,
    ) -> T {
        let [a, b, c, d] = self.corners;
        if !self.mixed {
            return texel(a);
        }
        let (a, b, c, d) = (texel(a), texel(b), texel(c), texel(d));
        let (upper, lower) = (a + (b - a) * self.x, c + (d - c) * self.x);
        upper + (lower - upper) * self.y
    }
}

/// Floor of log₂ `x`; 0 where that is negative or `x` is NaN.
#[inline(always)]
fn doublings(x: f32) -> u32 {
    let exponent = (x.to_bits() >> 23).saturating_sub(127);
    if x >= 1.0 { exponent } else { 0 }
}

/// Factor by which `reach` times the vector `way` must be stretched to span at least one texel, 1 if it does so already; `None`
/// where no factor suffices.
#[inline(always)]
fn apart(way: Vec2, texels: Vec2, reach: f32) -> Option<f32> {
    let apart = (way * texels).length() * reach;
    ((apart > 0.0) & apart.is_finite()).then(|| (1.0 / apart).max(1.0))
}

/// Aspect ratio of a footprint, rounded up to a number of probes; its axes are in texels.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "1 to 8")]
fn probes(major: f32, minor: f32) -> f32 {
    let times = (major / minor.max(1.0)).clamp(1.0, MAX_PROBES);
    let truncated = times as i32 as f32;
    if truncated < times { truncated + 1.0 } else { truncated }
}

/// Probes of a lookup: evenly spaced along `axis`, with `uv` in the middle.
struct Probes {
    uv: Vec2,
    axis: Vec2,
    count: f32,
}

impl Probes {
    fn one(uv: Vec2) -> Self {
        Self { uv, axis: Vec2::ZERO, count: 1.0 }
    }
}

/// The two texels next to a coordinate along one axis, and the weight of the second.
struct Axis {
    near: usize,
    far: usize,
    share: f32,
}

impl Axis {
    /// Coordinate `c` (0…1 over `len` texels, centres at halves) with its wrap mode; one that is not finite counts as 0.
    #[inline]
    fn new(c: f32, len: usize, wrap: Wrap, filter: Filter) -> Self {
        let c = if c.is_finite() { c } else { 0.0 };
        let period = match wrap {
            Wrap::Repeat => c - floor_of_one(c),
            Wrap::Mirror => c - 2.0 * floor_of_one(c * 0.5),
            Wrap::Clamp => c.clamp(0.0, 1.0),
        };
        let half = if filter == Filter::Linear { 0.5 } else { 0.0 };
        let place = period * pixels((len, 0)).x - half;
        let below = floor_of_one(place);
        let near = signed(below);
        Self { near: wrapped(near, len, wrap), far: wrapped(near + 1, len, wrap), share: place - below }
    }
}

/// Texel index at place `i` of an endless row.
#[inline]
fn wrapped(i: i64, len: usize, wrap: Wrap) -> usize {
    match usize::try_from(i) {
        // The common case; division is slow.
        Ok(i) if i < len => i,
        _ => wrapped_outside(i, len, wrap),
    }
}

#[cold]
fn wrapped_outside(i: i64, len: usize, wrap: Wrap) -> usize {
    let last = i64::try_from(len).unwrap_or(i64::MAX) - 1;
    let inside = match wrap {
        Wrap::Repeat => i.rem_euclid(last + 1),
        Wrap::Mirror => {
            let back_and_forth = i.rem_euclid(2 * (last + 1));
            back_and_forth.min(2 * last + 1 - back_and_forth)
        }
        Wrap::Clamp => i.clamp(0, last),
    };
    usize::try_from(inside).unwrap_or(0)
}

#[expect(clippy::cast_possible_truncation, reason = "the cast saturates, which is what a huge level or place needs")]
fn signed(x: f32) -> i64 {
    x as i64
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "x is not negative; the cast saturates")]
fn whole(x: f32) -> usize {
    x as usize
}

#[cfg(test)]
mod tests;
