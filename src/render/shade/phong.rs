//! Phong's model with the extensions of the founding texts: I = Ia Ka + Σ I (Kd N·L + Ks cosⁿα) + mirror + transmission.
//!
//! B. T. Phong, "Illumination for Computer Generated Pictures" (1975); T. Whitted, "An Improved Illumination Model for
//! Shaded Display" (1980). Nothing is divided by π: a light of strength 1 shows a white surface that faces it as 1.

use super::{BounceWeights, Reader};
use crate::math::Vec3;
use crate::render::media::Crossing;
use crate::render::optics::{fresnel_dielectric, fresnel_schlick, reflect};
use crate::scene::Phong;

/// Phong's parameters at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhongBsdf {
    pub ambient: Vec3,
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub shininess: f32,
    pub mirror: Vec3,
    pub transmission: Vec3,
    pub ior: f32,
    pub fresnel: bool,
    pub dispersion: f32,
}

/// The parameters that maps change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PhongInputs {
    pub ambient: Vec3,
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub mirror: Vec3,
    pub shininess: f32,
}

impl PhongInputs {
    /// Combines the diffuse colour, and the values of the other maps.
    #[inline(always)]
    pub(crate) fn of(phong: &Phong, diffuse: Vec3, (ambient, specular, shininess): (Vec3, Vec3, f32)) -> Self {
        Self {
            ambient: phong.ambient * ambient,
            diffuse,
            specular: phong.specular * specular,
            // In MTL files both are Ks.
            mirror: phong.mirror * specular,
            shininess: (phong.shininess * shininess).max(0.0),
        }
    }
}

impl PhongBsdf {
    pub(super) fn new(phong: &Phong, diffuse: Vec3, reader: &Reader) -> Self {
        let [ambient, specular] = [&phong.ambient_map, &phong.specular_map].map(|map| reader.srgb(map.as_ref()));
        let shininess = reader.linear(phong.shininess_map.as_ref()).x;
        let PhongInputs { ambient, diffuse, specular, mirror, shininess } =
            PhongInputs::of(phong, diffuse, (ambient, specular, shininess));
        Self {
            ambient,
            diffuse,
            specular,
            shininess,
            mirror,
            transmission: phong.transmission,
            ior: phong.ior,
            fresnel: phong.fresnel,
            dispersion: phong.dispersion,
        }
    }

    /// Values of the parameters that maps change.
    pub(crate) fn inputs(&self) -> PhongInputs {
        let Self { ambient, diffuse, specular, mirror, shininess, .. } = *self;
        PhongInputs { ambient, diffuse, specular, mirror, shininess }
    }

    /// This material with other map values.
    #[inline(always)]
    pub(crate) fn painted(&self, inputs: PhongInputs) -> Self {
        let PhongInputs { ambient, diffuse, specular, mirror, shininess } = inputs;
        Self { ambient, diffuse, specular, mirror, shininess, ..*self }
    }

    /// Whether a mirror ray could be seen.
    pub(crate) fn mirrors(&self) -> bool {
        self.mirror != Vec3::ZERO
    }

    /// Kd N·L + Ks cosⁿα with α between the view and the mirrored light; all unit vectors, away from the surface.
    #[inline(always)]
    pub(crate) fn lit(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        let shown = self.glows() && normal.dot(to_light) > 0.0;
        let highlight = if shown { self.highlight(Self::agreement(normal, view, to_light)) } else { 0.0 };
        self.lit_with(normal, to_light, highlight)
    }

    /// Whether lights cause highlights.
    #[inline(always)]
    pub(crate) fn glows(&self) -> bool {
        self.specular != Vec3::ZERO
    }

    /// cosα, clamped to 0.
    #[inline(always)]
    pub(crate) fn agreement(normal: Vec3, view: Vec3, to_light: Vec3) -> f32 {
        let cosine = view.dot(reflect(-to_light, normal));
        if cosine > 0.0 { cosine } else { 0.0 }
    }

    /// cosⁿα for cosα = `agreement`.
    #[inline]
    pub(crate) fn highlight(&self, agreement: f32) -> f32 {
        libm::powf(agreement, self.shininess)
    }

    /// [`Self::lit`] with cosⁿα given: a branch-free formula.
    #[inline(always)]
    pub(crate) fn lit_with(&self, normal: Vec3, to_light: Vec3, highlight: f32) -> Vec3 {
        let cosine = normal.dot(to_light);
        let lit = self.diffuse * cosine + self.specular * highlight;
        if cosine > 0.0 { lit } else { Vec3::ZERO }
    }

    /// Kd (N·L): the same without the highlight.
    pub(super) fn scattered(&self, normal: Vec3, to_light: Vec3) -> Vec3 {
        self.diffuse * normal.dot(to_light).max(0.0)
    }

    /// Kt (N·H′)ⁿ for a light seen through the surface: the analogue of Blinn's highlight for the refracted direction.
    ///
    /// H′ = ±(ηv V + ηl L)/|·| is the normal of the facets that refract the light to the viewer (B. Walter et al.,
    /// "Microfacet Models for Refraction through Rough Surfaces", 2007). Where the indices are equal every facet passes
    /// light straight on, so nothing is scattered.
    pub(super) fn lit_through(&self, normal: Vec3, view: Vec3, to_light: Vec3, crossing: &Crossing) -> Vec3 {
        let opposite = normal.dot(to_light) < 0.0 && normal.dot(view) > 0.0;
        if !opposite || crossing.n_i == crossing.n_t || self.transmission == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let facet = (crossing.n_i * view + crossing.n_t * to_light).normalize_or_zero();
        self.transmission * libm::powf(normal.dot(facet).abs(), self.shininess)
    }

    /// Weight of the mirror ray of an opaque material.
    #[inline(always)]
    pub(crate) fn reflected(&self, cosine: f32) -> Vec3 {
        let schlick = fresnel_schlick(self.mirror, 1.0, cosine);
        if self.fresnel && self.mirror != Vec3::ZERO { schlick } else { self.mirror }
    }

    /// Without Fresnel the weights are the material's own, but a transparent one transmits no more than it does not mirror: if
    /// all branches of a ray together weighed more than it, they would never end. Total internal reflection adds the blocked
    /// transmission to the mirror.
    /// With Fresnel an opaque surface reflects more at grazing angles (Schlick), and a transparent one splits the light by the
    /// exact formula for dielectrics.
    pub(super) fn bounce_weights(&self, cosine: f32, crossing: &Crossing) -> BounceWeights {
        let share = fresnel_dielectric(f64::from(cosine), f64::from(crossing.n_i), f64::from(crossing.n_t));
        #[expect(clippy::cast_possible_truncation, reason = "a share of light")]
        let share = share as f32;
        let transparent = self.transmission != Vec3::ZERO;
        match (self.fresnel, transparent) {
            (false, true) if share == 1.0 && crossing.n_i > crossing.n_t => {
                BounceWeights::smooth((self.mirror + self.transmission).min(Vec3::ONE), Vec3::ZERO)
            }
            (false, true) => {
                let mirror = self.mirror.min(Vec3::ONE);
                BounceWeights::smooth(mirror, self.transmission.min(Vec3::ONE - mirror))
            }
            (false, false) => BounceWeights::smooth(self.mirror, Vec3::ZERO),
            (true, false) => BounceWeights::smooth(self.reflected(cosine), Vec3::ZERO),
            (true, true) => {
                // From inside, light turned back was transmitted before, and is not weakened by the mirror colour.
                let inside = crossing.n_i > crossing.n_t;
                let mirror = if inside { self.mirror.max(self.transmission) } else { self.mirror };
                BounceWeights::smooth(mirror * share, self.transmission * (1.0 - share))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::media::{Media, MediaTable, Medium};

    fn bsdf() -> PhongBsdf {
        PhongBsdf {
            ambient: Vec3::ZERO,
            diffuse: Vec3::new(0.5, 0.25, 0.0),
            specular: Vec3::splat(0.5),
            shininess: 2.0,
            mirror: Vec3::splat(0.25),
            transmission: Vec3::splat(0.75),
            ior: 1.5,
            fresnel: false,
            dispersion: 0.0,
        }
    }

    fn at(degrees: f32) -> Vec3 {
        let (sin, cos) = libm::sincosf(degrees.to_radians());
        Vec3::new(sin, 0.0, cos)
    }

    const GLASS: Medium = Medium { material: 0, ior: 1.5 };

    fn into_glass() -> Crossing {
        MediaTable::default().cross(Media::OUTSIDE, GLASS, true)
    }

    #[test]
    fn diffuse_and_specular_follow_their_cosines() {
        // Light at 60°, seen from 30° on the other side: α = 30°.
        let seen = bsdf().lit(Vec3::Z, at(-30.0), at(60.0));
        let (diffuse, highlight) = (0.5, 0.75);
        assert!((seen - (bsdf().diffuse * diffuse + Vec3::splat(0.5 * highlight))).length() < 1e-6);
    }

    #[test]
    fn a_light_below_the_horizon_gives_no_highlight() {
        assert_eq!(bsdf().lit(Vec3::Z, at(-85.0), at(95.0)), Vec3::ZERO);
    }

    #[test]
    fn a_highlight_seen_from_behind_the_mirrored_light_is_clamped_to_zero() {
        let seen = bsdf().lit(Vec3::Z, at(80.0), at(80.0));
        assert!((seen - bsdf().diffuse * at(80.0).z).length() < 1e-6);
    }

    #[test]
    fn a_light_seen_through_peaks_in_the_refracted_direction() {
        let through = |light: f32| bsdf().lit_through(Vec3::Z, at(-40.0), at(light), &into_glass()).x;
        // Snell: the light that reaches 40° outside travels 180° + asin(sin 40° / 1.5) inside.
        let refracted = 180.0 - libm::asinf(libm::sinf(40f32.to_radians()) / 1.5).to_degrees();
        assert!((through(refracted) - 0.75).abs() < 1e-5);
        assert!(through(refracted - 10.0) < 0.75 && through(refracted + 10.0) < 0.75);
        assert_eq!(through(20.0), 0.0, "a light on the viewer's side is not seen through");
        let same = MediaTable::default().cross(Media::OUTSIDE, Medium { material: 0, ior: 1.0 }, true);
        assert_eq!(bsdf().lit_through(Vec3::Z, at(-40.0), at(160.0), &same), Vec3::ZERO);
    }

    #[test]
    fn without_fresnel_the_weights_are_the_materials() {
        let bounce_weights = bsdf().bounce_weights(0.3, &into_glass());
        assert_eq!(bounce_weights, BounceWeights::smooth(Vec3::splat(0.25), Vec3::splat(0.75)));
    }

    #[test]
    fn total_reflection_loses_nothing() {
        let mut table = MediaTable::default();
        let within = table.reset(&[GLASS]);
        let out = table.cross(within, GLASS, false);
        for fresnel in [false, true] {
            let glass = PhongBsdf { fresnel, mirror: Vec3::ZERO, transmission: Vec3::ONE, ..bsdf() };
            assert_eq!(glass.bounce_weights(0.1, &out), BounceWeights::smooth(Vec3::ONE, Vec3::ZERO));
        }
    }

    #[test]
    fn fresnel_shares_the_light_between_mirror_and_transmission() {
        let glass = PhongBsdf { fresnel: true, mirror: Vec3::ONE, transmission: Vec3::ONE, ..bsdf() };
        for cosine in [0.05, 0.4, 1.0] {
            let bounce_weights = glass.bounce_weights(cosine, &into_glass());
            assert!((bounce_weights.reflected + bounce_weights.refracted - Vec3::ONE).length() < 1e-6);
        }
        assert!((glass.bounce_weights(1.0, &into_glass()).reflected.x - 0.04).abs() < 1e-6);
        let varnish = PhongBsdf { transmission: Vec3::ZERO, fresnel: true, ..bsdf() };
        assert_eq!(varnish.bounce_weights(1.0, &into_glass()).reflected, Vec3::splat(0.25));
        assert_eq!(varnish.bounce_weights(0.0, &into_glass()).reflected, Vec3::ONE);
    }
}
