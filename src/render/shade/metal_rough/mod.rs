//! glTF's metallic-roughness model (glTF 2.0, Appendix B) with the specular, ior and transmission extensions.
//!
//! Lights are seen through the microfacet model: GGX distribution, height-correlated Smith masking, Schlick's Fresnel. The
//! environment is seen by one mirror ray where the surface is smooth, and by a lookup as wide as the roughness makes it, where it
//! is rough; in between the two are blended, so that no edge shows. A lookup sends no ray: its occlusion is known from the
//! occlusion map only. Metals reflect all of the environment's light, after several bounces between their facets if need be; of
//! lights they show the first bounce, as the model says. Light passes rough glass unscattered apart from a part that is looked
//! up; lights themselves are not seen through rough glass.
//!
//! A translucent surface scatters a share of the light that enters it to its other side, uniformly in all directions: the half
//! spaces are swapped, and Fresnel removes as much as if the light were mirrored at the surface.

use super::facets::{AlbedoRow, albedo, mean_albedo, rebound};
use super::highlight::{NARROWEST_HIGHLIGHT, highlight, is_narrow, least_square, squared_width};
use super::{AnisotropicLobe, BounceWeights, Lobe, Reader, ShadingFrame, Sky, iridescence};
use crate::math::formula::{exp2, root, smoothstep};
use crate::math::{Vec3, Vec4};
use crate::render::media::Crossing;
use crate::render::optics::{fresnel_dielectric, fresnel_schlick, transmittance};
use crate::scene::{DiffuseTransmission, Iridescence, MetalRough};
use std::f32::consts::PI;

/// Below this roughness the environment is seen by a ray alone.
const MIRROR_ROUGHNESS: f32 = 0.1;
/// Above this roughness the environment is seen by a lookup alone.
const MATT_ROUGHNESS: f32 = crate::scene::features::SMOOTH;
/// Roughness from which on the lookup through glass has its largest share.
const FROSTED_ROUGHNESS: f32 = 0.6;
/// Largest share that is looked up through glass; the rest passes straight, so that glass never hides its contents.
const FROSTED_SHARE: f32 = 0.75;
/// The model's parameters at one point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetalRoughBsdf {
    base: Vec3,
    metallic: f32,
    roughness: f32,
    /// Roughness along the grain; 0 without a grain.
    roughness_along: f32,
    /// Albedo of a white surface with that grain; 1 without a grain.
    sent_back: f32,
    /// Whether reflection and transmission are seen by rays alone.
    by_rays: bool,
    /// Reflectance of the dielectric part, at normal incidence and grazing.
    f0: Vec3,
    f90: f32,
    /// Reflectance of the metal part at normal incidence.
    metal_f0: Vec3,
    /// Whether a film changes both reflectances, as far as each part exists.
    filmed: bool,
    /// Share of the light entering the dielectric part that passes through instead of being scattered.
    transmission: f32,
    /// Share of the light that is scattered to the other side, and its colour there.
    share: f32,
    through: Vec3,
    occlusion: f32,
    pub ior: f32,
    pub thick: bool,
    /// Transmittance of the whole thickness, where rays do not trace the inside.
    inside: Vec3,
    pub dispersion: f32,
    /// Lower bound of α² in the highlights of lights.
    least_square: f32,
}

/// The parameters that maps of colour, roughness, metalness, occlusion and transmission change.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MetalRoughInputs {
    pub base: Vec3,
    pub metallic: f32,
    pub roughness: f32,
    pub occlusion: f32,
    pub transmission: f32,
}

impl MetalRoughInputs {
    /// Combines the base colour, the unoccluded share of the environment, the texel `map` of roughness and metalness, and that of
    /// transmission.
    #[inline(always)]
    pub(crate) fn of(m: &MetalRough, base: Vec3, occlusion: f32, (map, let_through): (Vec4, Vec4)) -> Self {
        Self {
            base: base.max(Vec3::ZERO),
            metallic: (m.metallic * map.z).clamp(0.0, 1.0),
            roughness: (m.roughness * map.y).clamp(0.0, 1.0),
            occlusion: occlusion.clamp(0.0, 1.0),
            transmission: (m.transmission * let_through.x).clamp(0.0, 1.0),
        }
    }
}

/// Light of the environment at a point, and the factors of its reflection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EnvironmentTerms {
    /// Cosine of the view, 0 … 1.
    pub n_v: f32,
    /// Albedo of the lobe: shares of f0 and f90.
    pub shares: (f32, f32),
    /// Mean light over the hemisphere.
    pub diffuse: Vec3,
    /// Light around the mirrored view.
    pub mirrored: Vec3,
    /// Unoccluded share of the mirrored light.
    pub open: f32,
    /// Whether it is seen from outside.
    pub outside: bool,
    /// Lower bound of the light turned back from inside before it is scattered.
    pub turned_back: f32,
}

/// `metallic` with its map.
pub(super) fn metallic_at(m: &MetalRough, reader: &Reader) -> f32 {
    (m.metallic * reader.linear(m.metal_rough_map.as_ref()).z).clamp(0.0, 1.0)
}

/// Transmittance of the thickness of a material that absorbs light.
fn inside(m: &MetalRough, reader: &Reader) -> Vec3 {
    if m.absorption == Vec3::ZERO {
        return Vec3::ONE;
    }
    transmittance(m.absorption, m.thickness * reader.linear(m.thickness_map.as_ref()).y)
}

impl MetalRoughBsdf {
    pub(super) fn new(m: &MetalRough, base: Vec3, occlusion: f32, reader: &Reader) -> Self {
        let maps = [&m.metal_rough_map, &m.transmission_map].map(|map| reader.linear(map.as_ref()));
        let inputs = MetalRoughInputs::of(m, base, occlusion, maps.into());
        let MetalRoughInputs { base, metallic, roughness, occlusion, transmission } = inputs;
        let mut bsdf = Self {
            base,
            metal_f0: base,
            filmed: false,
            metallic,
            roughness,
            roughness_along: 0.0,
            sent_back: 1.0,
            by_rays: false,
            f0: Vec3::ZERO,
            f90: 0.0,
            transmission,
            share: 0.0,
            through: Vec3::ZERO,
            occlusion,
            ior: m.ior,
            thick: m.thick,
            inside: inside(m, reader),
            dispersion: m.dispersion,
            least_square: 0.0,
        };
        bsdf.tint(m, reader);
        bsdf
    }

    /// Sets the reflectance of the dielectric part from factors and maps.
    pub(super) fn tint(&mut self, m: &MetalRough, reader: &Reader) {
        let color = m.specular_color * reader.srgb(m.specular_color_map.as_ref());
        let specular = m.specular * reader.alpha(m.specular_map.as_ref());
        let at_normal = (m.ior - 1.0) / (m.ior + 1.0);
        self.f0 = (color * (at_normal * at_normal)).clamp(Vec3::ZERO, Vec3::ONE) * specular;
        self.f90 = specular;
    }

    /// Values of the parameters that maps change.
    pub(crate) fn inputs(&self) -> MetalRoughInputs {
        let Self { base, metallic, roughness, occlusion, transmission, .. } = *self;
        MetalRoughInputs { base, metallic, roughness, occlusion, transmission }
    }

    /// This material with other map values, if it has no film.
    #[inline(always)]
    pub(crate) fn painted(&self, inputs: MetalRoughInputs) -> Self {
        let MetalRoughInputs { base, metallic, roughness, occlusion, transmission } = inputs;
        Self { base, metal_f0: base, metallic, roughness, occlusion, transmission, ..*self }
    }

    /// Makes it scatter light to its other side.
    pub(super) fn thin(&mut self, diffuse_transmission: &DiffuseTransmission, reader: &Reader) {
        let color = diffuse_transmission.color * reader.srgb(diffuse_transmission.color_map.as_ref());
        self.share =
            (diffuse_transmission.share * reader.alpha(diffuse_transmission.share_map.as_ref())).clamp(0.0, 1.0);
        self.through = color.clamp(Vec3::ZERO, Vec3::ONE);
    }

    /// Whether it scatters light to its other side.
    pub(super) fn is_translucent(&self) -> bool {
        self.share > 0.0
    }

    /// Covers it with a film, seen from outside at this cosine.
    pub(super) fn cover(&mut self, iridescence: &Iridescence, cosine: f32, reader: &Reader) {
        let strength = (iridescence.strength * reader.linear(iridescence.strength_map.as_ref()).x).clamp(0.0, 1.0);
        let [thin, thick] = iridescence.thickness;
        let thickness = thin + (thick - thin) * reader.linear(iridescence.thickness_map.as_ref()).y;
        if strength > 0.0 && thickness > 0.0 {
            let under = |f0: Vec3| {
                let share = iridescence::reflectance(iridescence.ior, thickness, f0, cosine);
                f0.lerp(iridescence::seen_face_on(share, cosine), strength)
            };
            // A part with no share needs no colour.
            if self.metallic < 1.0 {
                self.f0 = under(self.f0);
            }
            if self.metallic > 0.0 {
                self.metal_f0 = under(self.metal_f0);
            }
            self.filmed = true;
        }
    }

    /// Sets its grain, seen along `view` at this normal.
    pub(super) fn brush(&mut self, anisotropy: Option<&AnisotropicLobe>, normal: Vec3, view: Vec3) {
        if let Some(anisotropy) = anisotropy {
            (self.roughness_along, self.sent_back) = (anisotropy.roughness(), anisotropy.lobe(normal).albedo(view));
        }
    }

    /// Raises its roughness to at least this.
    pub(super) fn blur(&mut self, roughness: f32) {
        self.roughness = self.roughness.max(roughness);
    }

    /// Whether its highlights are narrow.
    #[inline(always)]
    pub(super) fn has_narrow_highlight(&self) -> bool {
        is_narrow(self.roughness)
    }

    /// Widens the highlights of lights to this α².
    pub(super) fn widen_highlight(&mut self, to: f32) {
        self.least_square = least_square(self.roughness, to);
    }

    /// Lower bound of α² in the highlights of lights, where narrow ones must be as wide as `to`; 0 where they are not narrow.
    #[inline(always)]
    pub(crate) fn least_square_where_narrow(&self, to: f32) -> f32 {
        if self.has_narrow_highlight() { least_square(self.roughness, to) } else { 0.0 }
    }

    /// This material with this lower bound of α² in highlights.
    #[inline(always)]
    pub(crate) fn at_least(&self, least_square: f32) -> Self {
        Self { least_square, ..*self }
    }

    /// Shares of f0 and f90 in the albedo of its lobe.
    fn albedo(&self, n_v: f32) -> (f32, f32) {
        let (scale, bias) = albedo(self.mean_roughness(), n_v);
        if self.roughness_along == 0.0 {
            return (scale, bias);
        }
        let kept = self.sent_back / (scale + bias).max(f32::MIN_POSITIVE);
        (scale * kept, bias * kept)
    }

    /// Switches reflection and transmission to rays alone.
    pub(super) fn spread_by_rays(&mut self) {
        self.by_rays = true;
    }

    /// Whether reflection is looked up, at least in part.
    pub(crate) fn looks_up(&self) -> bool {
        !self.by_rays
    }

    /// Whether all light that enters it passes through.
    pub(crate) fn is_clear(&self) -> bool {
        self.transmission >= 1.0 && self.metallic <= 0.0
    }

    /// Width α over which its facets spread rays; `None` where a single ray suffices.
    pub(super) fn spreads(&self) -> Option<f32> {
        (self.by_rays && self.roughness.max(self.roughness_along) >= NARROWEST_HIGHLIGHT)
            .then_some(self.roughness * self.roughness)
    }

    /// Roughness of an isotropic surface that spreads light equally far overall.
    fn mean_roughness(&self) -> f32 {
        if self.roughness_along > self.roughness {
            (self.roughness * self.roughness_along).sqrt()
        } else {
            self.roughness
        }
    }

    /// Reflectance of the dielectric and of the metal part by Schlick's formula.
    #[inline(always)]
    fn fresnel(&self, cosine: f32) -> (Vec3, Vec3) {
        (fresnel_schlick(self.f0, self.f90, cosine), fresnel_schlick(self.metal_f0, 1.0, cosine))
    }

    /// Colour of the light scattered below the surface, before reflection is subtracted.
    #[inline(always)]
    fn scattered(&self) -> Vec3 {
        self.base * ((1.0 - self.metallic) * (1.0 - self.transmission) * (1.0 - self.share))
    }

    /// Colour of the light scattered to the other side, before reflection is subtracted.
    fn scattered_through(&self) -> Vec3 {
        self.through * ((1.0 - self.metallic) * (1.0 - self.transmission) * self.share)
    }

    /// Whether a mirror ray could be seen.
    pub(crate) fn mirrors(&self) -> bool {
        self.traced(true) > 0.0
    }

    /// BRDF × N·L; all unit vectors, away from the surface.
    #[inline(always)]
    pub(crate) fn lit(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        self.lit_on_side(normal, view, to_light, true)
    }

    /// BRDF × N·L, without highlights if seen from inside.
    #[inline(always)]
    pub(crate) fn lit_on_side(&self, normal: Vec3, view: Vec3, to_light: Vec3, outside: bool) -> Vec3 {
        let a2 = squared_width(self.roughness).max(self.least_square);
        let lobe = |between| {
            let seen = highlight(normal, between, [normal.dot(to_light), normal.dot(view)], a2);
            if outside { seen } else { 0.0 }
        };
        self.lit_by(normal, view, to_light, lobe)
    }

    /// BRDF × N·L with another lobe: a function of the sum of both unit vectors, before Fresnel.
    #[inline(always)]
    pub(super) fn lit_by(&self, normal: Vec3, view: Vec3, to_light: Vec3, lobe: impl Fn(Vec3) -> f32) -> Vec3 {
        let (n_l, n_v) = (normal.dot(to_light), normal.dot(view));
        if n_l <= 0.0 || n_v <= 0.0 {
            return Vec3::ZERO;
        }
        // Half of its length is the cosine between either vector and the half vector.
        let between = view + to_light;
        let (dielectric, metal) = self.fresnel(0.5 * between.length());
        let diffuse = self.scattered() * ((1.0 - dielectric.max_element()) / PI);
        let specular = dielectric.lerp(metal, self.metallic) * lobe(between);
        (diffuse + specular) * n_l
    }

    /// BTDF × |N·L| of a light on the other side.
    pub(super) fn lit_through(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        let (n_l, n_v) = (-normal.dot(to_light), normal.dot(view));
        if !self.is_translucent() || n_l <= 0.0 || n_v <= 0.0 {
            return Vec3::ZERO;
        }
        let half = (view + to_light + 2.0 * n_l * normal).normalize_or(normal);
        let (dielectric, _) = self.fresnel(view.dot(half));
        self.scattered_through() * ((1.0 - dielectric.max_element()) / PI * n_l)
    }

    /// Light of the environment without a ray: scattered and looked-up mirrored light, and that looked up through frosted glass.
    pub(super) fn ambient(
        &self,
        seen: &ShadingFrame,
        sky: &Sky,
        ambient: Vec3,
        anisotropy: Option<&AnisotropicLobe>,
    ) -> [Vec3; 2] {
        let n_v = seen.normal.dot(seen.view).clamp(0.0, 1.0);
        let looked_up = self.traced(seen.outside) < 1.0;
        let roughness = self.mean_roughness();
        let mirrored = || anisotropy.map_or_else(|| sky.mirrored(seen, roughness), |g| g.mirrored(seen, sky));
        let around = EnvironmentTerms {
            n_v,
            shares: self.albedo(n_v),
            diffuse: sky.diffuse(seen.normal) + ambient,
            mirrored: if looked_up { mirrored() + ambient } else { Vec3::ZERO },
            open: if looked_up { open(n_v, self.occlusion, roughness) } else { 0.0 },
            outside: seen.outside,
            turned_back: self.turned_back(n_v, seen.outside),
        };
        let rebound = if self.metallic > 0.0 { self.rebound(mean_albedo(roughness)) } else { Vec3::ZERO };
        let (mut sum, taken) = self.around(&around, rebound);
        if self.is_translucent() {
            let behind = sky.diffuse(-seen.normal) + ambient;
            sum += self.scattered_through() * behind * ((1.0 - taken).max(0.0) * self.occlusion);
        }
        let frosted = self.frosted(seen.outside);
        if frosted <= 0.0 {
            return [sum, Vec3::ZERO];
        }
        let light = sky.blurred(-seen.view, self.roughness) + ambient;
        [sum, self.passed(1.0 - taken) * self.inside * light * frosted]
    }

    /// BRDF × N·L of the light that [`Self::ambient`] looks up on this side.
    pub(super) fn lit_around(&self, seen: &ShadingFrame, to: Vec3, anisotropy: Option<&AnisotropicLobe>) -> Vec3 {
        let (normal, view) = (seen.normal, seen.view);
        let looked_up = 1.0 - self.traced(seen.outside);
        let lobe = |between| match anisotropy {
            None => highlight(normal, between, [normal.dot(to), normal.dot(view)], squared_width(self.roughness)),
            Some(anisotropy) => anisotropy.highlight(normal, view, to),
        };
        let through = if self.is_translucent() { self.lit_through(normal, view, to) } else { Vec3::ZERO };
        let left = 1.0 - self.turned_back(normal.dot(view), seen.outside);
        (self.lit_by(normal, view, to, |between| lobe(between) * looked_up) * left + through) * self.occlusion
    }

    /// BRDF × N·L seen from inside: no highlight, and without the light turned back.
    pub(super) fn lit_inside(&self, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        self.lit_by(normal, view, to_light, |_| 0.0) * (1.0 - self.turned_back(normal.dot(view), false))
    }

    /// Share of the light along a direction from inside that its facets turn back: scattering takes place below them, so that
    /// scattered and transmitted light together are no more than arrives. 0 from outside, and where nothing is scattered.
    fn turned_back(&self, cosine: f32, outside: bool) -> f32 {
        let scatters = self.transmission < 1.0 && self.metallic < 1.0;
        if outside || !scatters || !self.thick || !self.lets_light_in() || self.ior <= 0.0 {
            return 0.0;
        }
        #[expect(clippy::cast_possible_truncation, reason = "a share of light")]
        let share = |cosine: f32| fresnel_dielectric(f64::from(cosine), f64::from(self.ior), 1.0) as f32;
        match self.spreads() {
            Some(alpha) => Lobe::even(Vec3::Z, alpha).mirrored(cosine, share),
            None => share(cosine),
        }
    }

    /// Roughness of the looked-up lobe, if there is one.
    pub(super) fn gloss(&self) -> Option<f32> {
        (self.traced(true) < 1.0).then(|| self.mean_roughness())
    }

    /// Scattered and mirrored light of the environment, and the largest share that the dielectric part mirrors. `rebound` is the
    /// result of [`rebound`] for the material.
    #[inline(always)]
    pub(crate) fn around(&self, around: &EnvironmentTerms, rebound: Vec3) -> (Vec3, f32) {
        let looked_up = 1.0 - self.traced(around.outside);
        // Spread rays lose light between facets, as lookups do.
        let rough = if self.by_rays { 1.0 } else { looked_up };
        let (scale, bias) = around.shares;
        let (dielectric, metal) = (self.f0 * scale + self.f90 * bias, self.metal_f0 * scale + bias);

        let taken = self.fresnel(around.n_v).0.lerp(dielectric, rough).max_element().max(around.turned_back);
        let diffuse = self.scattered() * (1.0 - taken).max(0.0) * self.occlusion;
        let mirrored = dielectric.lerp(metal, self.metallic) * around.mirrored * (looked_up * around.open);
        let lost = (1.0 - scale - bias).max(0.0);
        let again = rebound * lost * around.diffuse * (self.metallic * rough * self.occlusion);
        (diffuse * around.diffuse + mirrored + again, taken)
    }

    /// Albedo by N·V, where it has no grain.
    pub(crate) fn shares(&self) -> AlbedoRow {
        AlbedoRow::of(self.roughness)
    }

    /// Light that its facets reflect to each other, for the mean albedo of its lobe.
    #[inline(always)]
    pub(crate) fn rebound(&self, mean_albedo: f32) -> Vec3 {
        rebound(mean_albedo, self.metal_f0)
    }

    /// Perceptual roughness.
    pub(crate) fn roughness(&self) -> f32 {
        self.roughness
    }

    /// This material without occlusion.
    pub(crate) fn in_the_open(&self) -> Self {
        Self { occlusion: 1.0, ..*self }
    }

    /// Weights of the mirror ray and of the transmitted ray, seen from outside or not.
    pub(super) fn bounce_weights(&self, cosine: f32, crossing: &Crossing, outside: bool) -> BounceWeights {
        let (mut dielectric, metal) = self.fresnel(cosine);
        let mut open = 1.0 - dielectric.max_element();
        let inside = crossing.n_i > crossing.n_t;
        // Index 0 stands for a reflectance of 1 from all sides, by Schlick's formula.
        if self.transmission > 0.0 && self.thick && self.ior > 0.0 {
            let share = fresnel_dielectric(f64::from(cosine), f64::from(crossing.n_i), f64::from(crossing.n_t));
            #[expect(clippy::cast_possible_truncation, reason = "a share of light")]
            let share = share as f32;
            // From inside, light turned back belongs to the transmitted light.
            if inside {
                dielectric = Vec3::splat(share);
            } else if !self.filmed {
                dielectric = self.tinted(share, crossing);
            }
            open = 1.0 - dielectric.max_element();
        }
        BounceWeights {
            reflected: self.mirrored(dielectric, metal, outside),
            glass: dielectric * (self.transmission * (1.0 - self.metallic) * self.traced(outside)),
            refracted: self.passed(open) * (1.0 - self.frosted(outside)),
        }
    }

    /// Reflectance of clear glass for the Fresnel `share`: with the strength and colour that the material has at normal
    /// incidence, fading towards grazing angles.
    fn tinted(&self, share: f32, crossing: &Crossing) -> Vec3 {
        let square = |a: f32, b: f32| ((a - b) / (a + b)).powi(2);
        let tint = self.f0 - Vec3::splat(square(self.ior, 1.0) * self.f90);
        let face_on = square(crossing.n_i, crossing.n_t);
        let steep = if face_on < 1.0 { (1.0 - share) / (1.0 - face_on) } else { 0.0 };
        (Vec3::splat(share * self.f90) + tint * steep).clamp(Vec3::ZERO, Vec3::ONE)
    }

    #[inline(always)]
    fn mirrored(&self, dielectric: Vec3, metal: Vec3, outside: bool) -> Vec3 {
        dielectric.lerp(metal, self.metallic) * self.traced(outside)
    }

    /// Weight of the mirror ray of an opaque material.
    #[inline(always)]
    pub(crate) fn reflected(&self, cosine: f32) -> Vec3 {
        let (dielectric, metal) = self.fresnel(cosine);
        self.mirrored(dielectric, metal, true)
    }

    /// Whether light can pass through it here.
    pub(super) fn lets_light_in(&self) -> bool {
        self.transmission > 0.0 && self.metallic < 1.0
    }

    /// Transmitted light along one direction when the share `open` enters.
    fn passed(&self, open: f32) -> Vec3 {
        self.base * (self.transmission * (1.0 - self.metallic) * open.max(0.0))
    }

    /// Share of the mirrored environment that a ray brings in. From inside there is no environment to look up.
    #[inline(always)]
    fn traced(&self, outside: bool) -> f32 {
        if outside && !self.by_rays { traced(self.roughness.max(self.roughness_along)) } else { 1.0 }
    }

    /// Share of the transmitted light that is looked up instead.
    fn frosted(&self, outside: bool) -> f32 {
        if self.transmission <= 0.0 || !outside || self.by_rays {
            return 0.0;
        }
        // Glass that hardly refracts hardly spreads light.
        let bending = if self.thick { (2.0 * self.ior - 2.0).clamp(0.0, 1.0) } else { 1.0 };
        FROSTED_SHARE * smoothstep(0.0, FROSTED_ROUGHNESS, self.roughness * bending)
    }
}

/// Share of the mirrored environment that a ray brings in.
#[inline(always)]
pub(super) fn traced(roughness: f32) -> f32 {
    1.0 - smoothstep(MIRROR_ROUGHNESS, MATT_ROUGHNESS, roughness)
}

/// Share of the mirrored environment that the occlusion map leaves open: less where few directions are open and the lobe is wide
/// (S. Lagarde, C. de Rousiers, "Moving Frostbite to Physically Based Rendering", 2014).
#[inline(always)]
pub(crate) fn open(n_v: f32, occlusion: f32, roughness: f32) -> f32 {
    let share = (root(n_v + occlusion, exp2(-16.0 * roughness - 1.0)) - 1.0 + occlusion).clamp(0.0, 1.0);
    if occlusion >= 1.0 { 1.0 } else { share }
}

/// `dir`, mirrored to the front of a surface when a shading normal has sent it behind.
#[inline(always)]
pub(crate) fn above(dir: Vec3, geometric: Vec3) -> Vec3 {
    let height = dir.dot(geometric);
    if height < 0.0 { dir - 2.0 * height * geometric } else { dir }
}

#[cfg(test)]
mod tests;
