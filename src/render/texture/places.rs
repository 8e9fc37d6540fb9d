//! Lookups at eight points side by side: texel addresses are computed once for all maps of the same layout.
//!
//! Maps of one material mostly share size, sampler and coordinates. The addresses are those that
//! [`Lookup::filtered`](super::Lookup) computes one by one, and texels are summed in its order: the same bits.

use super::pyramid::{self, Plane, Stored};
use super::{ColorSpace, PROBES, TextureStore, apart, decode, doublings, pixels, probes, size_of};
use crate::math::formula::{floor, integer};
use crate::math::simd::{LANES, Simd};
use crate::math::{Vec2, Vec4};
use crate::scene::{Filter, Mipmaps, Sampler, Wrap};
use decode::Texels;

/// One value of each of eight points.
type Eight = [f32; LANES];

/// Texture coordinates of eight points, and their change along both axes of the footprint.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Spots {
    pub uv: [Eight; 2],
    pub along: [Eight; 2],
    pub across: [Eight; 2],
}

impl Spots {
    #[inline(always)]
    fn axes(&self, i: usize) -> [Vec2; 2] {
        [Vec2::new(self.along[0][i], self.along[1][i]), Vec2::new(self.across[0][i], self.across[1][i])]
    }
}

/// Size and sampler of a bitmap: what determines texel addresses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Layout {
    width: u32,
    height: u32,
    top: u32,
    wrap: [Wrap; 2],
    magnify: Filter,
    minify: Filter,
    mipmaps: Mipmaps,
}

impl Layout {
    /// Layout of a texture; `None` for one that is missing or too large.
    pub(crate) fn of(store: &TextureStore, texture: u32) -> Option<Self> {
        let (sampler, source) = store.find(texture)?;
        let Sampler { magnify, minify, mipmaps, wrap_u, wrap_v, .. } = sampler;
        let (width, height) = size_of(source.bitmap);
        // Texel indices are computed in 32 bits, and places in `f32`.
        let texels = u32::try_from(width.checked_mul(height)?).ok()?;
        let (width, height, top) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?, source.srgb.top());
        let small = texels < u32::MAX / 2 && width.max(height) < 1 << 23;
        let (top, wrap) = (u32::try_from(top).ok()?, [wrap_u, wrap_v]);
        small.then_some(Self { width, height, top, wrap, magnify, minify, mipmaps })
    }
}

/// Change of the linear texels at each of eight points from `uv` to `reach` times each of both axes, as
/// [`TextureStore::changes`](super::TextureStore) computes it; zero except where `wanted`.
#[inline(always)]
pub(crate) fn changes(
    store: &TextureStore,
    texture: u32,
    layout: &Layout,
    at: &Spots,
    reach: f32,
    wanted: [bool; LANES],
) -> [[Vec4; LANES]; 2] {
    let mut changes = [[Vec4::ZERO; LANES]; 2];
    let Some((sampler, source)) = store.find(texture) else { return changes };
    let lookup = source.lookup(ColorSpace::Linear, sampler);
    let size = pixels((layout.width as usize, layout.height as usize));
    let mut level = [0; LANES];
    for (i, level) in level.iter_mut().enumerate() {
        let [along, across] = at.axes(i).map(|axis| (axis * size).length());
        let doublings = doublings(along.max(across)).min(layout.top);
        *level = if layout.mipmaps == Mipmaps::None { 0 } else { doublings };
    }
    let (width, height) = (sides(layout.width, &level, 0), sides(layout.height, &level, 0));
    // The point itself and a step along each axis, with the step's stretch factor.
    let (mut places, mut steps) = ([at.uv; 3], [[0.0; LANES]; 2]);
    for i in 0..LANES {
        #[expect(clippy::cast_precision_loss, reason = "sides are below 2²³")]
        let texels = Vec2::new(width[i] as f32, height[i] as f32);
        for (k, way) in at.axes(i).into_iter().enumerate() {
            let longer = apart(way, texels, reach).unwrap_or(0.0);
            let moved = Vec2::new(at.uv[0][i], at.uv[1][i]) + way * (reach * longer);
            (places[k + 1][0][i], places[k + 1][1][i], steps[k][i]) = (moved.x, moved.y, longer);
        }
    }
    let mut texels = [[0; LANES]; 3];
    for (texels, uv) in texels.iter_mut().zip(&places) {
        let (x, y) = (nearest(&uv[0], &width, layout.wrap[0]), nearest(&uv[1], &height, layout.wrap[1]));
        for i in 0..LANES {
            texels[i] = y[i].wrapping_mul(width[i]).wrapping_add(x[i]);
        }
    }
    for i in (0..LANES).filter(|&i| wanted[i]) {
        let plane = lookup.plane(level[i] as usize);
        let here = plane.at(texels[0][i] as usize);
        for k in 0..2 {
            if steps[k][i] > 0.0 {
                changes[k][i] = (plane.at(texels[k + 1][i] as usize) - here) / steps[k][i];
            }
        }
    }
    changes
}

/// Index of the texel that contains each coordinate along one axis.
#[inline(always)]
fn nearest(c: &Eight, sides: &[u32; LANES], wrap: Wrap) -> [u32; LANES] {
    let (c, mut places) = (periods(c, wrap), [0; LANES]);
    for i in 0..LANES {
        #[expect(clippy::cast_precision_loss, reason = "sides are below 2²³")]
        let place = c[i] * sides[i] as f32;
        places[i] = integer(floor(place));
    }
    inside(&places, sides, wrap)
}

/// Side lengths of a map, `above` levels above that of each point.
#[inline(always)]
fn sides(whole: u32, level: &[u32; LANES], above: u32) -> [u32; LANES] {
    let mut sides = [0; LANES];
    for (side, level) in sides.iter_mut().zip(level) {
        *side = (whole >> (level + above).min(31)).max(1);
    }
    sides
}

/// Coordinates reduced to one period of the wrap mode.
#[inline(always)]
fn periods(c: &Eight, wrap: Wrap) -> Eight {
    let mut periods = [0.0; LANES];
    for (period, c) in periods.iter_mut().zip(c) {
        *period = if c.is_finite() { *c } else { 0.0 };
    }
    match wrap {
        Wrap::Repeat => periods.iter_mut().for_each(|c| *c -= floor(*c)),
        Wrap::Mirror => periods.iter_mut().for_each(|c| *c -= 2.0 * floor(*c * 0.5)),
        Wrap::Clamp => periods.iter_mut().for_each(|c| *c = c.clamp(0.0, 1.0)),
    }
    periods
}

/// Texel addresses of lookups at eight points.
pub(crate) struct Places {
    /// Number of probes at each point.
    probes: Eight,
    level: [u32; LANES],
    /// 1 where the next level is read, too; and its weight.
    between: [u32; LANES],
    share: Eight,
    /// Offset from a place, in texels, of the first texel: ½ where texels are interpolated, and 0 where only the nearest is read.
    half: Eight,
    taps: [[Taps; PROBES]; 2],
}

/// Four texels at each point, and the weights of the right and the lower ones.
#[derive(Clone, Copy)]
struct Taps {
    corners: [[u32; LANES]; 4],
    x: Eight,
    y: Eight,
}

impl Default for Places {
    fn default() -> Self {
        let taps = Taps { corners: [[0; LANES]; 4], x: [0.0; LANES], y: [0.0; LANES] };
        Self {
            probes: [1.0; LANES],
            level: [0; LANES],
            between: [0; LANES],
            share: [0.0; LANES],
            half: [0.5; LANES],
            taps: [[taps; PROBES]; 2],
        }
    }
}

impl Places {
    /// Computes the texel addresses for maps of this layout.
    #[inline(always)]
    pub(crate) fn find(&mut self, layout: &Layout, at: &Spots) {
        let axis = self.choose_levels(layout, at);
        // Nearly all maps are interpolated: these have a branch-free kernel.
        if (layout.magnify, layout.minify) == (Filter::Linear, Filter::Linear) {
            self.find_taps::<true>(layout, at, &axis);
        } else {
            self.find_taps::<false>(layout, at, &axis);
        }
    }

    #[inline(always)]
    fn find_taps<const MIXED: bool>(&mut self, layout: &Layout, at: &Spots, axis: &[Eight; 2]) {
        let most = self.probes.iter().fold(1.0_f32, |most, &probes| most.max(probes));
        let levels = if self.between == [0; LANES] { 1 } else { 2 };
        let (mut p, mut k) = (0, 0.5);
        while k < most {
            // A single probe lies in the middle.
            let mut uv = at.uv;
            for (uv, axis) in uv.iter_mut().zip(axis) {
                for i in 0..LANES {
                    let moved = uv[i] + axis[i] * (k / self.probes[i] - 0.5);
                    uv[i] = if self.probes[i] > 1.0 { moved } else { uv[i] };
                }
            }
            for (above, taps) in (0..).zip(&mut self.taps).take(levels) {
                taps[p % PROBES].find::<MIXED>(layout, (&uv, &self.half), &self.level, above);
            }
            (p, k) = (p + 1, k + 1.0);
        }
    }

    /// Chooses mip levels and numbers of probes; returns the major axis of the footprint.
    #[inline(always)]
    fn choose_levels(&mut self, layout: &Layout, at: &Spots) -> [Eight; 2] {
        let size = pixels((layout.width as usize, layout.height as usize));
        let (mut axis, mut lod) = ([[0.0; LANES]; 2], [0.0; LANES]);
        // Files that ask for nearest texels get one probe.
        let is_mixed = layout.minify == Filter::Linear;
        for i in 0..LANES {
            let [along, across] = at.axes(i);
            let (dx, dy) = ((along * size).length(), (across * size).length());
            let (major, minor) = if dx >= dy { (dx, dy) } else { (dy, dx) };
            let longer = if dx >= dy { along } else { across };
            let bounded = major.is_finite() & minor.is_finite();
            let probes = if bounded & (major > 1.0) & is_mixed { probes(major, minor) } else { 1.0 };
            (axis[0][i], axis[1][i], self.probes[i]) = (longer.x, longer.y, probes);
            // Footprints up to one texel read level 0; unbounded ones the smallest level.
            lod[i] = if major <= 1.0 {
                1.0
            } else if bounded {
                major / probes
            } else {
                f32::INFINITY
            };
        }
        for lod in &mut lod {
            *lod = if *lod > 1.0 { libm::log2f(*lod) } else { 0.0 };
        }
        let top = layout.top;
        for i in 0..LANES {
            let (lod, lower) = (lod[i], whole(lod[i]));
            let (level, between) = match layout.mipmaps {
                Mipmaps::None => (0, 0),
                Mipmaps::Nearest => (if lod > 0.0 { whole(lod + 0.5).min(top) } else { 0 }, 0),
                Mipmaps::Linear => (lower.min(top), u32::from((lod > 0.0) & (lower < top))),
            };
            (self.level[i], self.between[i], self.share[i]) = (level, between, lod - floor(lod));
        }
        let half = |filter| if filter == Filter::Linear { 0.5 } else { 0.0 };
        let (smaller, larger) = (half(layout.minify), half(layout.magnify));
        for (half, lod) in self.half.iter_mut().zip(&lod) {
            *half = if *lod > 0.0 { smaller } else { larger };
        }
        axis
    }

    /// Linear RGBA (straight alpha) of a texture of the layout, at as many points as `to` has.
    #[inline(always)]
    pub(crate) fn read(&self, store: &TextureStore, texture: u32, space: ColorSpace, to: &mut [Vec4]) {
        let Some((sampler, source)) = store.find(texture) else { return };
        let lookup = source.lookup(space, sampler);
        // Neighbouring points mostly read the same levels.
        let (mut level, mut plane, mut above) = (self.level[0], lookup.plane(self.level[0] as usize), None);
        for (i, to) in to.iter_mut().enumerate().take(LANES) {
            if self.level[i] != level {
                level = self.level[i];
                (plane, above) = (lookup.plane(level as usize), None);
            }
            *to = self.of_level(&plane, 0, i);
            if self.between[i] == 1 {
                let above = above.get_or_insert_with(|| lookup.plane(level as usize + 1));
                let upper = self.of_level(above, 1, i);
                *to += (upper - *to) * self.share[i];
            }
        }
    }

    /// Prefetches most texels of [`Self::read`]: where all maps of a layout are prefetched first, none waits for memory.
    #[inline(always)]
    pub(crate) fn prefetch<S: Simd>(&self, s: S, store: &TextureStore, texture: u32, space: ColorSpace) {
        let Some((sampler, source)) = store.find(texture) else { return };
        let lookup = source.lookup(space, sampler);
        for above in 0..=self.between[0] as usize {
            let (plane, [upper, _, lower, _]) =
                (lookup.plane(self.level[0] as usize + above), &self.taps[above][0].corners);
            for i in (0..LANES).filter(|&i| self.level[i] == self.level[0]) {
                plane.prefetch(s, upper[i] as usize);
                plane.prefetch(s, lower[i] as usize);
            }
        }
    }

    #[inline(always)]
    fn of_level(&self, plane: &Plane, above: usize, i: usize) -> Vec4 {
        match plane.texels {
            Stored::Level(texels) => self.mean(above, i, |at| pyramid::codes(&texels[at as usize])) / 65535.0,
            Stored::Bitmap(Texels::Rgb8(texels, colors)) => {
                self.mean(above, i, |at| decode::solid8(texels[at as usize], colors))
            }
            Stored::Bitmap(Texels::Rgba8(texels, colors)) => {
                self.mean(above, i, |at| decode::decode8(texels[at as usize], colors))
            }
            Stored::Bitmap(texels) => self.mean(above, i, |at| texels.get(at as usize)),
        }
    }

    /// Mean of all probes of point `i`.
    #[inline(always)]
    fn mean(&self, above: usize, i: usize, texel: impl Fn(u32) -> Vec4) -> Vec4 {
        let one = |taps: &Taps| {
            let [a, b, c, d] = &taps.corners;
            let (a, b, c, d) = (texel(a[i]), texel(b[i]), texel(c[i]), texel(d[i]));
            let (upper, lower) = (a + (b - a) * taps.x[i], c + (d - c) * taps.x[i]);
            upper + (lower - upper) * taps.y[i]
        };
        let (taps, probes) = (&self.taps[above], self.probes[i]);
        if probes <= 1.0 {
            return one(&taps[0]);
        }
        // Written so that the mean of equal texels is exact.
        let first = one(&taps[0]);
        let (mut sum, mut p, mut k) = (Vec4::ZERO, 1, 1.5);
        while k < probes {
            sum += one(&taps[p % PROBES]) - first;
            (p, k) = (p + 1, k + 1.0);
        }
        first + sum / probes
    }
}

impl Taps {
    /// Finds the four texels around each of `uv`, `above` levels above that of the point; four times the nearest one where texels
    /// are not interpolated.
    #[inline(always)]
    fn find<const MIXED: bool>(
        &mut self,
        layout: &Layout,
        (uv, half): (&[Eight; 2], &Eight),
        level: &[u32; LANES],
        above: u32,
    ) {
        let (width, height) = (sides(layout.width, level, above), sides(layout.height, level, above));
        let x = Pairs::find::<MIXED>((&uv[0], half), &width, layout.wrap[0]);
        let y = Pairs::find::<MIXED>((&uv[1], half), &height, layout.wrap[1]);
        for (i, width) in width.into_iter().enumerate() {
            let (upper, lower) = (y.near[i].wrapping_mul(width), y.far[i].wrapping_mul(width));
            self.corners[0][i] = upper.wrapping_add(x.near[i]);
            self.corners[1][i] = upper.wrapping_add(x.far[i]);
            self.corners[2][i] = lower.wrapping_add(x.near[i]);
            self.corners[3][i] = lower.wrapping_add(x.far[i]);
        }
        (self.x, self.y) = (x.share, y.share);
    }
}

/// The two texels next to each coordinate along one axis, and the weight of the second.
struct Pairs {
    near: [u32; LANES],
    far: [u32; LANES],
    share: Eight,
}

impl Pairs {
    #[inline(always)]
    fn find<const MIXED: bool>((c, half): (&Eight, &Eight), sides: &[u32; LANES], wrap: Wrap) -> Self {
        let (period, mut below, mut share) = (periods(c, wrap), [0; LANES], [0.0; LANES]);
        for i in 0..LANES {
            #[expect(clippy::cast_precision_loss, reason = "sides are below 2²³")]
            let place = period[i] * sides[i] as f32 - if MIXED { 0.5 } else { half[i] };
            let whole = floor(place);
            (below[i], share[i]) = (integer(whole), if MIXED || half[i] > 0.0 { place - whole } else { 0.0 });
        }
        let near = inside(&below, sides, wrap);
        below.iter_mut().zip(half).for_each(|(at, half)| *at += i32::from(MIXED || *half > 0.0));
        Self { near, far: inside(&below, sides, wrap), share }
    }
}

/// Texel indices at places of endless rows, which may lie from one before the first to one behind the last of a period of
/// [`periods`]: one row, or two where every other is mirrored.
#[inline(always)]
fn inside(places: &[i32; LANES], sides: &[u32; LANES], wrap: Wrap) -> [u32; LANES] {
    let mut texels = [0; LANES];
    match wrap {
        Wrap::Repeat => {
            for i in 0..LANES {
                texels[i] = again(places[i], sides[i].cast_signed()).cast_unsigned();
            }
        }
        Wrap::Mirror => {
            for i in 0..LANES {
                let both = 2 * sides[i].cast_signed();
                let at = again(places[i], both);
                texels[i] = at.min(both - 1 - at).cast_unsigned();
            }
        }
        Wrap::Clamp => {
            for i in 0..LANES {
                texels[i] = places[i].max(0).min(sides[i].cast_signed() - 1).cast_unsigned();
            }
        }
    }
    texels
}

/// Place in a row of `len` that repeats; `place` is at least −`len` and less than 2 `len`.
#[inline(always)]
fn again(place: i32, len: i32) -> i32 {
    let up = if place < 0 { place + len } else { place };
    if up >= len { up - len } else { up }
}

/// Whole part of a level, which is not negative and less than 32.
#[inline(always)]
fn whole(lod: f32) -> u32 {
    integer(floor(lod.min(31.0))).cast_unsigned()
}
