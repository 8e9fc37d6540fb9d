//! Highlights that are seen in bent and bumpy surfaces: as wide as it takes to be met by rays.
//!
//! A light without extent is seen in a smooth surface where the normal lies halfway between light and eye. Where normals
//! turn fast that is a spot of a thousandth of a pixel, a thousand times as bright as white: it changes the pixel and is met
//! by one ray in thousands. So highlights are at least as wide as the halfway directions of a part of the pixel lie apart, which
//! spreads their light over that part and takes nothing of it away; wider ones stay as they are.
//!
//! A. S. Kaplanyan, S. Hill, A. Patney, A. Lefohn, "Filtering Distributions of Normals for Shading Antialiasing" (2016),
//! with a kernel of half the width of theirs; J. Amanatides, "Ray Tracing with Cones" (1984), for what mirrors do to a cone.

use super::Settings;
use super::context::Context;
use super::frame::sample_width;
use super::surface::Surface;
use crate::scene::TextureRef;

/// Standard deviation of the part of a pixel over which a highlight is spread at least, in widths of the pixel.
const OF_PIXEL: f32 = 0.25;
/// That deviation at least in widths of what one sample stands for.
const OF_SAMPLE: f32 = 0.5;
/// Growth of a cone beyond which it says nothing any more.
const WIDEST_CONE: f32 = 1.0;
/// How many times as far as its normals a mirror turns directions.
pub(super) const MIRROR: f32 = 2.0;

/// How far highlights are spread, in widths of a ray's cone.
pub(super) fn reach(settings: &Settings) -> f32 {
    (OF_PIXEL / sample_width(settings)).max(OF_SAMPLE)
}

/// The squared width α² of a highlight on `surface` at least, whose normals this map turns with its scale, seen along a ray
/// whose cone grows by `spread`: twice the variance of the slopes of halfway directions along each axis, since GGX has α²
/// where a Gaussian has that.
pub(super) fn least_square(surface: &Surface, map: (Option<&TextureRef>, f32), context: &Context, spread: f32) -> f32 {
    let reach = context.highlight_reach;
    least_of(surface.turning(context, reach, map), spread, reach)
}

/// Least α² of a highlight where normals turn so far within reach: the squares of the angles, summed over both axes.
#[inline(always)]
pub(super) fn least_of(turning: f32, spread: f32, reach: f32) -> f32 {
    // The direction to the eye turns over the cone, and the halfway direction half as far, along both axes.
    let eye = spread * reach;
    turning + 0.5 * eye * eye
}

/// Growth of a ray's cone behind a surface whose normals turn so far within it, the squares of the angles summed over both
/// axes; `factor` says how many times as far directions turn, 2 for mirrors.
#[inline(always)]
pub(super) fn behind(bend: f32, spread: f32, factor: f32) -> f32 {
    let turned = (0.5 * bend).sqrt();
    let spread = spread + factor * turned;
    // What is not a number, at the tip of a cone, is as wide as can be.
    if spread < WIDEST_CONE { spread } else { WIDEST_CONE }
}
