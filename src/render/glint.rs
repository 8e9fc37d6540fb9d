//! Highlights on curved and bumpy surfaces: widened until rays cannot miss them.
//!
//! A light without extent is reflected in a smooth surface where the normal lies halfway between light and eye. Where normals
//! vary fast, that is a spot of a thousandth of a pixel, a thousand times as bright as white: it changes the pixel but is hit by
//! one ray in thousands. So a highlight is at least as wide as the spread of halfway directions over a part of the pixel, which
//! distributes its light over that part and loses none of it; wider ones stay as they are.
//!
//! A. S. Kaplanyan, S. Hill, A. Patney, A. Lefohn, "Filtering Distributions of Normals for Shading Antialiasing" (2016),
//! with a kernel of half the width of theirs; J. Amanatides, "Ray Tracing with Cones" (1984), for what mirrors do to a cone.

use super::Settings;
use super::context::Context;
use super::frame::sample_width;
use super::surface::Surface;
use crate::scene::TextureRef;

/// Least standard deviation over which a highlight is spread, in widths of the pixel.
const OF_PIXEL: f32 = 0.25;
/// Least such deviation in widths of the footprint of one sample.
const OF_SAMPLE: f32 = 0.5;
/// Greatest cone spread: wider cones carry no information.
const WIDEST_CONE: f32 = 1.0;
/// Angle by which a mirror turns directions, relative to the angle by which its normal turns.
pub(super) const MIRROR: f32 = 2.0;

/// Spread of highlights, in widths of a ray's cone.
pub(super) fn reach(settings: &Settings) -> f32 {
    (OF_PIXEL / sample_width(settings)).max(OF_SAMPLE)
}

/// Least squared width α² of a highlight on `surface`, whose normals are turned by this map with its scale, seen along a ray
/// whose cone spread is `spread`: twice the variance of the slopes of halfway directions along each axis, since GGX has α² where
/// a Gaussian has that.
pub(super) fn least_square(surface: &Surface, map: (Option<&TextureRef>, f32), context: &Context, spread: f32) -> f32 {
    let reach = context.highlight_reach;
    least_of(surface.turning(context, reach, map), spread, reach)
}

/// Least α² of a highlight; `turning` is the variation of normals within reach: the squares of the angles, summed over both axes.
#[inline(always)]
pub(super) fn least_of(turning: f32, spread: f32, reach: f32) -> f32 {
    // The direction to the eye turns across the cone, and the halfway direction half as much, along both axes.
    let eye = spread * reach;
    turning + 0.5 * eye * eye
}

/// Cone spread of a ray behind a surface; `bend` is the variation of normals within its cone, the squares of the angles summed
/// over both axes, and `factor` how many times as far directions turn, 2 for mirrors.
#[inline(always)]
pub(super) fn behind(bend: f32, spread: f32, factor: f32) -> f32 {
    let turned = (0.5 * bend).sqrt();
    let spread = spread + factor * turned;
    // NaN, at the tip of a cone, counts as the widest spread.
    if spread < WIDEST_CONE { spread } else { WIDEST_CONE }
}
