//! Thin-film iridescence: light reflected off both sides of a film interferes (KHR_materials_iridescence).
//!
//! L. Belcour, P. Barla, "A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence" (2017): the sum
//! over the paths through the film, whose phases are integrated over the eye's sensitivity in closed form.

use crate::math::Vec3;
use crate::math::formula::{exp2, floor, sin_cos_of_turns};
use crate::math::primaries::rec_709_of_xyz;
use crate::render::optics::fresnel_schlick;
use std::f32::consts::{LOG2_E, PI};

/// Films thinner than this many nanometres fade out: without a film there is no boundary to reflect at.
const FADE: f32 = 0.03;

/// Sensitivity of the eye in CIE XYZ as Gaussians over the wave number: height, centre and variance of each, a second one of X,
/// and the integral of Y (Belcour and Barla, supplemental material).
const HEIGHTS: Vec3 = Vec3::new(5.4856e-13, 4.4201e-13, 5.2481e-13);
const CENTERS: Vec3 = Vec3::new(1.6810e6, 1.7953e6, 2.2084e6);
const VARIANCES: Vec3 = Vec3::new(4.3278e9, 9.3046e9, 6.6121e9);
const SECOND_X: [f32; 3] = [9.7470e-14, 2.2399e6, 4.5282e9];
const WHOLE: f32 = 1.0685e-7;

/// Reflectance at this cosine, seen from empty space, of a film of index `ior`, `thickness` nanometres thick, on a base with
/// reflectance `f0` at normal incidence; linear Rec. 709.
pub(super) fn reflectance(ior: f32, thickness: f32, f0: Vec3, cosine: f32) -> Vec3 {
    let t = (thickness / FADE).clamp(0.0, 1.0);
    let ior = 1.0 + (ior - 1.0) * (t * t * (3.0 - 2.0 * t));
    let below = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
    if below <= 0.0 {
        return Vec3::ONE;
    }
    let cosine_inside = below.sqrt();

    // The upper boundary, and the lower one to the index that f0 implies.
    let upper = fresnel_schlick(Vec3::splat(face_on(ior, 1.0)), 1.0, cosine).x;
    let through = 1.0 - upper;
    let base = f0.clamp(Vec3::ZERO, Vec3::splat(0.9999)).map(index_of);
    let lower = fresnel_schlick(base.map(|n| face_on(n, ior)), 1.0, cosine_inside);

    // Reflection off a denser medium shifts the phase by half a wave; off the upper side, seen from inside, it does not.
    let turned = |n: f32| if n < ior { PI } else { 0.0 };
    let phase = Vec3::splat(PI) + base.map(turned);
    let way = 2.0 * ior * thickness * cosine_inside;

    let both = (lower * upper).clamp(Vec3::splat(1e-5), Vec3::splat(0.9999));
    let (amplitude, inside) = (both.map(f32::sqrt), lower * (through * through) / (Vec3::ONE - both));
    let mut sum = inside + upper;
    let mut term = inside - through;
    for order in [1.0, 2.0] {
        term *= amplitude;
        sum += term * sensitivity(order * way, phase * order) * 2.0;
    }
    sum.max(Vec3::ZERO)
}

/// Reflectance at normal incidence from which Schlick's formula, which is 1 at grazing angles, gives `reflectance` at this
/// cosine.
pub(super) fn seen_face_on(reflectance: Vec3, cosine: f32) -> Vec3 {
    let m = (1.0 - cosine).clamp(0.0, 1.0);
    let m2 = m * m;
    let grazing = (m2 * m2 * m).min(0.9999);
    ((reflectance - grazing) / (1.0 - grazing)).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Reflectance of a boundary at normal incidence.
fn face_on(inside: f32, outside: f32) -> f32 {
    let part = (inside - outside) / (inside + outside);
    part * part
}

/// Index of refraction whose boundary to empty space has reflectance `f0` at normal incidence.
fn index_of(f0: f32) -> f32 {
    let root = f0.sqrt();
    (1.0 + root) / (1.0 - root)
}

/// Integral of cos(phase) over the eye's sensitivity for a path of `way` nanometres and these phase shifts, in Rec. 709.
fn sensitivity(way: f32, shift: Vec3) -> Vec3 {
    let phase = 2.0 * PI * way * 1e-9;
    let gaussian = |height: f32, center: f32, variance: f32, shift: f32| {
        let turns = (center * phase + shift) / (2.0 * PI);
        let (_, cosine) = sin_cos_of_turns(turns - floor(turns));
        let faded = exp2((-phase * phase * variance * LOG2_E).max(-126.0));
        height * (2.0 * PI * variance).sqrt() * (cosine * faded)
    };
    let [height, center, variance] = SECOND_X;
    let part = |k: usize| gaussian(HEIGHTS[k], CENTERS[k], VARIANCES[k], shift[k]);
    let x = part(0) + gaussian(height, center, variance, shift.x);
    rec_709_of_xyz((Vec3::new(x, part(1), part(2)) / WHOLE).as_dvec3()).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GLASS: Vec3 = Vec3::splat(0.04);

    #[test]
    fn a_film_without_thickness_leaves_the_surface_as_it_is() {
        // At more grazing angles, Schlick's formula sees a boundary even between equal indices.
        for cosine in [1.0, 0.9, 0.8] {
            let plain = fresnel_schlick(GLASS, 1.0, cosine);
            let filmed = reflectance(1.3, 0.0, GLASS, cosine);
            assert!((filmed - plain).length() < 0.02, "{cosine}: {filmed} for {plain}");
        }
    }

    #[test]
    fn a_soap_film_has_the_colours_of_newtons_rings() {
        // On a base of index 1 the film stands alone: black where it is thinnest, then white, then colours in their order.
        let soap = |thickness| reflectance(1.33, thickness, Vec3::ZERO, 1.0);
        assert!(soap(5.0).max_element() < 0.005, "{}", soap(5.0));
        let white = soap(100.0);
        assert!(white.min_element() > 0.04 && white.max_element() < 1.5 * white.min_element(), "{white}");
        // The path through the film is one wave of green: green is missing.
        let purple = soap(550.0 / 2.0 / 1.33);
        assert!(purple.y < 0.6 * purple.x.min(purple.z), "{purple}");
        // One and a half: green is brightest.
        let green = soap(550.0 * 0.75 / 1.33);
        assert!(green.y > green.x && green.y > green.z, "{green}");
    }

    #[test]
    fn a_film_sends_back_no_less_than_nothing_and_hardly_more_than_arrives() {
        for thickness in (0u8..=30).map(|i| 40.0 * f32::from(i)) {
            for cosine in [0.05, 0.3, 0.6, 1.0] {
                for f0 in [0.0, 0.04, 0.5, 0.98] {
                    let share = reflectance(1.8, thickness, Vec3::splat(f0), cosine);
                    let fits = share.min_element() >= 0.0 && share.max_element() < 1.3;
                    assert!(fits, "{thickness} {cosine} {f0}: {share}");
                    let f0 = seen_face_on(share, cosine);
                    assert!(f0.min_element() >= 0.0 && f0.max_element() <= 1.0);
                }
            }
        }
    }

    #[test]
    fn what_is_seen_face_on_gives_back_what_was_seen_aslant() {
        for cosine in [0.3, 0.8, 1.0] {
            let f0 = seen_face_on(fresnel_schlick(Vec3::new(0.1, 0.4, 0.9), 1.0, cosine), cosine);
            assert!((f0 - Vec3::new(0.1, 0.4, 0.9)).length() < 1e-5);
        }
    }
}
