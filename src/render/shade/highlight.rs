//! Highlights of lights without extent: the microfacet lobe.
//!
//! B. Walter and others, "Microfacet Models for Refraction through Rough Surfaces" (2007), who call the distribution of
//! T. S. Trowbridge and K. P. Reitz GGX.

use crate::math::Vec3;
use crate::math::formula::smoothstep;
use std::f32::consts::PI;

/// Lower bound of the roughness in highlights of lights without extent.
pub(super) const NARROWEST_HIGHLIGHT: f32 = 0.045;
/// Below this roughness highlights of lights are widened so that rays hit them (see [`crate::render::glint`]).
const NARROW_HIGHLIGHT: f32 = 0.35;

/// α² of the highlights of a roughness: its fourth power.
#[inline(always)]
pub(super) fn squared_width(roughness: f32) -> f32 {
    let alpha = roughness.max(NARROWEST_HIGHLIGHT) * roughness.max(NARROWEST_HIGHLIGHT);
    alpha * alpha
}

/// Whether highlights of lights at this roughness must be widened.
#[inline(always)]
pub(crate) fn is_narrow(roughness: f32) -> bool {
    roughness < NARROW_HIGHLIGHT
}

/// Lower bound of α² where `to` is wanted: all of it, up to a limit, where the roughness makes highlights narrow, fading to none
/// where the roughness makes them wide by itself.
#[inline(always)]
pub(super) fn least_square(roughness: f32, to: f32) -> f32 {
    /// α² of a roughness of 0.7.
    const WIDE: f32 = 0.24;
    to.min(WIDE) * (1.0 - smoothstep(0.5 * NARROW_HIGHLIGHT, NARROW_HIGHLIGHT, roughness))
}

/// The microfacet lobe of a light without extent, before Fresnel: distribution × visibility, for a squared width α² and the
/// direction `between` light and view, of any length.
#[inline(always)]
pub(super) fn highlight(normal: Vec3, between: Vec3, [n_l, n_v]: [f32; 2], a2: f32) -> f32 {
    0.5 / PI * ggx(normal, between, a2) / masking(n_l, n_v, a2)
}

/// π times Trowbridge and Reitz's distribution of facets (GGX), `a2` the fourth power of the roughness.
#[inline(always)]
fn ggx(normal: Vec3, between: Vec3, a2: f32) -> f32 {
    let n_h = normal.dot(between).max(0.0);
    // 1 − (N·H)² as |N × H|², which keeps its digits in a narrow highlight; both times the square of the length.
    let sine_squared = normal.cross(between).length_squared();
    let f = n_h * n_h * a2 + sine_squared;
    let narrow = between.length_squared() / f.max(f32::MIN_POSITIVE);
    a2 * narrow * narrow
}

/// Smith's height-correlated masking and shadowing over 4 N·L N·V is ½ divided by this (E. Heitz, "Understanding the
/// Masking-Shadowing Function", 2014).
#[inline(always)]
fn masking(n_l: f32, n_v: f32, a2: f32) -> f32 {
    let view = n_l * (n_v * n_v * (1.0 - a2) + a2).sqrt();
    let light = n_v * (n_l * n_l * (1.0 - a2) + a2).sqrt();
    view + light
}
