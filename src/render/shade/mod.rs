//! What a surface does with light: the material at a point, evaluated from factors, maps and vertex colours.
//!
//! Shading models answer two questions here: how a light's arrival is seen ([`Bsdf::lit`], [`Bsdf::lit_through`]),
//! and how much of what lies in the mirrored and refracted direction is seen ([`Bsdf::bounce_weights`]). Which rays are
//! sent, and what they find, is the tracer's business.

mod anisotropy;
mod coat;
mod facets;
mod highlight;
mod iridescence;
mod light;
mod lobe;
mod metal_rough;
mod phong;
mod sheen;
mod spectrum;

pub(crate) use anisotropy::AnisotropicLobe;
pub(crate) use coat::CoatLobe;
pub(crate) use facets::{AlbedoRow, albedo_of_each, mean_albedo};
pub(crate) use highlight::is_narrow;
pub(crate) use light::{Incident, LocalLight, shadow_segment};
pub(crate) use lobe::{Lobe, pattern};
pub(crate) use metal_rough::{EnvironmentTerms, MetalRoughBsdf, MetalRoughInputs, above, open};
pub(crate) use phong::{PhongBsdf, PhongInputs};
pub(crate) use sheen::SheenLobe;
pub(crate) use spectrum::{Band, bands};

use super::lobe_frame::LobeFrame;
use super::media::Crossing;
use super::optics::reflect;
use super::patch::Patch;
use super::sky::Sky;
use super::surface::Surface;
use super::texture::{ColorSpace, TextureStore};
use crate::math::{Vec3, Vec4};
use crate::scene::{AlphaMode, Material, MetalRough, Reflection, TextureRef};
use std::f32::consts::PI;

/// How a point of a surface is seen: unit vectors away from it, and from which side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingFrame {
    /// For shading.
    pub normal: Vec3,
    /// Of the shape itself.
    pub geometric: Vec3,
    /// Back along the ray.
    pub view: Vec3,
    /// Whether it is seen from outside: from either side where light cannot enter.
    pub outside: bool,
}

impl ShadingFrame {
    /// The mirrored direction, never into the surface.
    #[inline(always)]
    pub(crate) fn mirrored(&self) -> Vec3 {
        above(reflect(-self.view, self.normal), self.geometric)
    }
}

/// The material at one point of a surface.
pub(crate) struct Bsdf {
    /// Whether it is seen from outside.
    outside: bool,
    pub emission: Vec3,
    pub model: Model,
    /// Its grain, fibres on it, and clear coat over all; seen from outside only.
    pub anisotropy: Option<AnisotropicLobe>,
    pub sheen: Option<SheenLobe>,
    pub coat: Option<CoatLobe>,
}

/// The reflection model at one point.
#[derive(Clone, Copy)]
pub(crate) enum Model {
    Unlit(Vec3),
    Phong(PhongBsdf),
    MetalRough(MetalRoughBsdf),
}

impl Model {
    /// Its base colour.
    pub(crate) fn base(&self) -> Vec3 {
        match self {
            Self::Unlit(color) => *color,
            Self::Phong(m) => m.diffuse,
            Self::MetalRough(m) => m.inputs().base,
        }
    }
}

/// Weights of the secondary rays of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct BounceWeights {
    pub reflected: Vec3,
    /// The part of this that clear glass reflects: facets that stop some of it send that on through themselves.
    pub glass: Vec3,
    pub refracted: Vec3,
}

impl BounceWeights {
    /// Of a surface without facets.
    pub(crate) fn smooth(reflected: Vec3, refracted: Vec3) -> Self {
        Self { reflected, refracted, glass: Vec3::ZERO }
    }

    /// What is mirrored where other facets leave this share: what they stop goes on through glass, and what runs into glass
    /// again comes out after all.
    pub(crate) fn mirrored(&self, kept: f32) -> Vec3 {
        (self.reflected - self.glass) * kept + self.glass
    }
}

/// Reads the maps of one point.
pub(crate) struct Reader<'a> {
    pub store: &'a TextureStore<'a>,
    pub patch: Option<&'a Patch<'a>>,
    /// What has been read already.
    pub known: &'a [Known],
}

/// What a map says at a point.
#[derive(Clone, Copy)]
pub(crate) struct Known {
    pub map: TextureRef,
    pub space: ColorSpace,
    /// Linear RGBA.
    pub texel: Vec4,
}

impl Reader<'_> {
    /// The map's linear RGBA; white where there is no map, or nothing to read it with.
    #[inline]
    fn read(&self, map: Option<&TextureRef>, space: ColorSpace) -> Vec4 {
        let Some(map) = map else { return Vec4::ONE };
        match self.known.iter().find(|known| known.map == *map && known.space == space) {
            Some(known) => known.texel,
            None => self.patch.map_or(Vec4::ONE, |patch| patch.texel(map, space, self.store)),
        }
    }

    fn srgb(&self, map: Option<&TextureRef>) -> Vec3 {
        self.read(map, ColorSpace::Srgb).truncate()
    }

    fn linear(&self, map: Option<&TextureRef>) -> Vec4 {
        self.read(map, ColorSpace::Linear)
    }

    /// The map's alpha; 1 where there is none.
    fn alpha(&self, map: Option<&TextureRef>) -> f32 {
        let Some(map) = map else { return 1.0 };
        match self.known.iter().find(|known| known.map == *map && known.space != ColorSpace::SrgbCutOut) {
            Some(known) => known.texel.w,
            None => self.patch.map_or(1.0, |patch| patch.alpha(map, self.store)),
        }
    }

    /// A channel of the map, as sharp as it is; 1 where there is no map, or nothing to read it with.
    fn sharp<const CHANNEL: usize>(&self, map: Option<&TextureRef>) -> f32 {
        map.zip(self.patch).map_or(1.0, |(map, patch)| patch.channel::<CHANNEL>(map, self.store))
    }

    /// Base colour and opacity: factors × maps × vertex colour.
    pub(crate) fn base(&self, material: &Material) -> Vec4 {
        let (base, opacity) = (material.base_color_map.as_ref(), material.opacity_map.as_ref());
        let map = self.read(base, base_space(material));
        let vertex = self.patch.map_or(Vec4::ONE, Patch::color);
        if is_cut_out(material) {
            let map = map.truncate().extend(self.sharp::<3>(base));
            return base_color(material, map, self.sharp::<0>(opacity), vertex);
        }
        base_color(material, map, self.linear(opacity).x, vertex)
    }
}

/// Whether a material is there or not, by an opacity that is read as sharply as it is stored, however small it is seen: of its
/// mean over what a cone covers most leaves would be less than their cutoff, and gone, or more, and solid.
pub(crate) fn is_cut_out(material: &Material) -> bool {
    matches!(material.alpha_mode, AlphaMode::Mask { .. })
}

/// What the map of a material's base colour says with its alpha.
pub(crate) fn base_space(material: &Material) -> ColorSpace {
    match material.alpha_mode {
        AlphaMode::Opaque => ColorSpace::Srgb,
        AlphaMode::Mask { .. } | AlphaMode::Blend => ColorSpace::SrgbCutOut,
    }
}

/// Base colour and opacity: factors × maps × vertex colour.
#[inline(always)]
pub(crate) fn base_color(material: &Material, map: Vec4, opacity_map: f32, vertex: Vec4) -> Vec4 {
    let base = material.base_color.extend(material.opacity * opacity_map) * map * vertex;
    if base.is_finite() { base } else { Vec4::ONE }
}

impl Bsdf {
    /// The material at `surface`, whose base colour has been read already.
    pub(crate) fn new(surface: &Surface, base: Vec3, store: &TextureStore) -> Self {
        let reader = Reader { store, patch: surface.patch.as_ref(), known: &[] };
        let material = surface.target.material;
        let bsdf = Self { outside: surface.is_outside(), ..Self::read(material, base, &reader) };
        let Some(m) = material.metal_rough() else { return bsdf };
        let bsdf = bsdf.thinned(m, &reader);
        if bsdf.outside && m.has_lobes() { bsdf.with_lobes(m, &surface.lobe_frame(), &reader) } else { bsdf }
    }

    /// This surface, scattering light to its other side if the material does.
    pub(crate) fn thinned(mut self, m: &MetalRough, reader: &Reader) -> Self {
        if let (Some(diffuse_transmission), Model::MetalRough(core)) = (&m.diffuse_transmission, &mut self.model) {
            core.thin(diffuse_transmission, reader);
        }
        self
    }

    /// This surface with anisotropy, film, sheen and clear coat.
    #[cold]
    pub(crate) fn with_lobes(mut self, m: &MetalRough, on: &LobeFrame, reader: &Reader) -> Self {
        let Model::MetalRough(core) = &mut self.model else { return self };
        if let Some(iridescence) = &m.iridescence {
            core.cover(iridescence, on.normal.dot(on.view).clamp(0.0, 1.0), reader);
        }
        self.anisotropy =
            m.anisotropy.as_ref().and_then(|anisotropy| AnisotropicLobe::new(anisotropy, core.roughness(), on, reader));
        core.brush(self.anisotropy.as_ref(), on.normal, on.view);
        let occlusion = core.inputs().occlusion;
        self.under(overlays(m, on, occlusion, reader))
    }

    /// This surface under sheen and clear coat.
    pub(crate) fn under(mut self, (sheen, coat): (Option<SheenLobe>, Option<CoatLobe>)) -> Self {
        (self.sheen, self.coat) = (sheen, coat);
        self.emission *= self.below_coat();
        self
    }

    /// This surface with the reflectance that maps say at this point.
    pub(crate) fn tinted(mut self, m: &MetalRough, reader: &Reader) -> Self {
        if let Model::MetalRough(core) = &mut self.model {
            core.tint(m, reader);
        }
        self
    }

    /// A material without maps, the same everywhere.
    pub(crate) fn without_maps(material: &Material, store: &TextureStore) -> Self {
        let reader = Reader { store, patch: None, known: &[] };
        Self::read(material, reader.base(material).truncate(), &reader)
    }

    /// The material as maps say, but for a grain, film, sheen and clear coat, as seen from outside.
    pub(crate) fn read(material: &Material, base: Vec3, reader: &Reader) -> Self {
        let emission = material.emission * reader.srgb(material.emission_map.as_ref());
        let model = match &material.reflection {
            Reflection::Unlit => Model::Unlit(base),
            Reflection::Phong(phong) => Model::Phong(PhongBsdf::new(phong, base, reader)),
            Reflection::MetalRough(m) => {
                let shade = reader.linear(material.occlusion_map.as_ref()).x;
                Model::MetalRough(MetalRoughBsdf::new(m, base, occlusion(material, shade), reader))
            }
        };
        Self::base_layer(model, emission, true)
    }

    /// A surface of this model without anything over it.
    pub(crate) fn base_layer(model: Model, emission: Vec3, outside: bool) -> Self {
        Self { outside, emission, model, anisotropy: None, sheen: None, coat: None }
    }

    /// Whether nothing is seen of its surface but what rays find that go on from it.
    pub(crate) fn is_dark(&self) -> bool {
        !self.outside && self.is_dark_inside()
    }

    /// Whether that is so from inside: of clear glass.
    pub(crate) fn is_dark_inside(&self) -> bool {
        self.emission == Vec3::ZERO && matches!(&self.model, Model::MetalRough(m) if m.is_clear())
    }

    /// Share of what is under the clear coat that is seen through it.
    fn below_coat(&self) -> f32 {
        self.coat.as_ref().map_or(1.0, CoatLobe::clear)
    }

    /// Share of what is under fibres and clear coat that is seen through both.
    fn clear(&self) -> f32 {
        self.below_coat() * self.sheen.as_ref().map_or(1.0, SheenLobe::clear)
    }

    /// Whether light does nothing to it.
    pub(crate) fn is_unlit(&self) -> bool {
        matches!(self.model, Model::Unlit(_))
    }

    /// Whether it is seen in the dark.
    pub(crate) fn shines(&self) -> bool {
        self.emission != Vec3::ZERO || self.is_unlit()
    }

    /// What is seen of the light that arrives from everywhere, without a ray: on this side, and through frosted glass.
    pub(crate) fn ambient(&self, seen: &ShadingFrame, sky: &Sky, ambient: Vec3) -> [Vec3; 2] {
        let [below, through] = match &self.model {
            Model::Unlit(color) => [*color, Vec3::ZERO],
            Model::Phong(m) => [m.ambient * ambient + m.diffuse * sky.diffuse(seen.normal), Vec3::ZERO],
            Model::MetalRough(m) => m.ambient(seen, sky, ambient, self.anisotropy.as_ref()),
        };
        let mut all = below * self.clear();
        if let Some(sheen) = &self.sheen {
            all += sheen.ambient(seen, sky, ambient) * self.below_coat();
        }
        if let Some(coat) = &self.coat {
            all += coat.ambient(seen, sky, ambient);
        }
        [all, through * self.clear()]
    }

    /// What is seen of light of this radiance from one direction `to`, per solid angle, of all that [`Self::ambient`] shows on
    /// this side; `ambient` comes from everywhere.
    pub(crate) fn lit_around(&self, seen: &ShadingFrame, to: Vec3, radiance: Vec3, ambient: Vec3) -> Vec3 {
        let (normal, view, all) = (seen.normal, seen.view, radiance + ambient);
        let below = match &self.model {
            Model::Unlit(_) => Vec3::ZERO,
            Model::Phong(m) => (m.ambient * ambient + m.diffuse * radiance) * (normal.dot(to).max(0.0) / PI),
            Model::MetalRough(m) => m.lit_around(seen, to, self.anisotropy.as_ref()) * all,
        };
        let mut sum = below * self.clear();
        if let Some(sheen) = &self.sheen {
            sum += sheen.lit(normal, view, to) * all * self.below_coat();
        }
        if let Some(coat) = &self.coat {
            sum += all * coat.lit_around(view, to);
        }
        sum
    }

    /// From now on rough surfaces mirror and let through by rays that are spread, not by lookups.
    pub(crate) fn spread_by_rays(&mut self) {
        if let Model::MetalRough(m) = &mut self.model {
            m.spread_by_rays();
        }
    }

    /// Blurs what is seen along a path that rough surfaces have spread to this angle across, radians: on such paths narrow
    /// highlights would be met by few rays, each far too bright (A. S. Kaplanyan, C. Dachsbacher, "Path Space Regularization
    /// for Holistic and Robust Light Transport", 2013).
    pub(crate) fn blur(&mut self, angle: f32) {
        if let Model::MetalRough(m) = &mut self.model {
            m.blur(blurred(angle));
        }
    }

    /// Whether lights without extent are seen in what is under the clear coat so small that they must be widened.
    pub(crate) fn has_narrow_highlight(&self) -> bool {
        matches!(&self.model, Model::MetalRough(m) if m.has_narrow_highlight())
    }

    /// Widens the highlights of lights under the clear coat to this squared width α², where they are narrower.
    pub(crate) fn widen_highlight(&mut self, to: f32) {
        if let Model::MetalRough(m) = &mut self.model {
            m.widen_highlight(to);
        }
        if let Some(anisotropy) = &mut self.anisotropy {
            anisotropy.widen_highlight(to);
        }
    }

    /// The facets around this normal that spread rays; `None` where one ray does.
    pub(crate) fn lobe(&self, normal: Vec3) -> Option<Lobe> {
        let Model::MetalRough(m) = &self.model else { return None };
        let alpha = m.spreads()?;
        Some(self.anisotropy.as_ref().map_or_else(|| Lobe::even(normal, alpha), |g| g.lobe(normal)))
    }

    /// Roughness of the lobe that [`Self::ambient`] looks up, if there is one.
    pub(crate) fn gloss(&self) -> Option<f32> {
        match &self.model {
            Model::MetalRough(m) => m.gloss(),
            Model::Phong(_) | Model::Unlit(_) => None,
        }
    }

    /// What is seen of a light on the viewer's side of the surface, whose normal before maps turn it is `horizon`.
    ///
    /// From inside there is no highlight: what a light sends in was bent where it came in, so it does not arrive along the
    /// straight line, and never so flat that all of it is mirrored. Light that thin walls lead along hundreds of
    /// reflections would gain such a highlight at each.
    pub(crate) fn lit(&self, horizon: Vec3, normal: Vec3, view: Vec3, light: &Incident) -> Vec3 {
        let below = match &self.model {
            Model::Unlit(_) => Vec3::ZERO,
            Model::Phong(m) if !self.outside => m.scattered(normal, light.to_light) * light.strength(),
            Model::Phong(m) => m.lit(normal, view, light.to_light) * light.strength(),
            Model::MetalRough(m) => self.lit_below(m, normal, view, light.to_light) * light.irradiance(),
        };
        self.lit_over(below, (horizon, normal, view), light.to_light, light.irradiance())
    }

    /// What is seen of a metallic-rough surface on whose viewer's side so much light falls from there.
    pub(crate) fn lit_with_lobes(&self, horizon: Vec3, normal: Vec3, view: Vec3, to_light: Vec3, light: Vec3) -> Vec3 {
        let Model::MetalRough(m) = &self.model else { return Vec3::ZERO };
        let below = self.lit_below(m, normal, view, to_light) * light;
        self.lit_over(below, (horizon, normal, view), to_light, light)
    }

    /// What the metallic-rough surface under fibres and clear coat shows: BRDF × N·L.
    fn lit_below(&self, m: &MetalRoughBsdf, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        match &self.anisotropy {
            _ if !self.outside => m.lit_inside(normal, view, to_light),
            None => m.lit(normal, view, to_light),
            Some(anisotropy) => m.lit_by(normal, view, to_light, |_| anisotropy.widened(normal, view, to_light)),
        }
    }

    /// What is seen where `below` comes from under fibres and clear coat, which show light of this irradiance, too.
    fn lit_over(
        &self,
        below: Vec3,
        (horizon, normal, view): (Vec3, Vec3, Vec3),
        to_light: Vec3,
        irradiance: Vec3,
    ) -> Vec3 {
        let mut all = below * self.clear();
        if let Some(sheen) = &self.sheen {
            all += sheen.lit(normal, view, to_light) * irradiance * self.below_coat();
        }
        all *= terminator(horizon, normal, to_light);
        if let Some(coat) = &self.coat {
            all += irradiance * (coat.lit(view, to_light) * terminator(horizon, coat.normal, to_light));
        }
        all
    }

    /// What is seen of a light on the other side of the surface.
    pub(crate) fn lit_through(&self, normal: Vec3, view: Vec3, light: &Incident, crossing: &Crossing) -> Vec3 {
        match &self.model {
            Model::Phong(m) => m.lit_through(normal, view, light.to_light, crossing) * light.strength(),
            Model::MetalRough(_) => self.lit_through_lobes(normal, view, light.to_light, light.irradiance()),
            Model::Unlit(_) => Vec3::ZERO,
        }
    }

    /// What is seen of so much light that falls on the other side of a metallic-rough surface from there.
    pub(crate) fn lit_through_lobes(&self, normal: Vec3, view: Vec3, to_light: Vec3, light: Vec3) -> Vec3 {
        match &self.model {
            Model::MetalRough(m) if m.is_translucent() => m.lit_through(normal, view, to_light) * light * self.clear(),
            _ => Vec3::ZERO,
        }
    }

    /// Whether it scatters light to its other side.
    pub(crate) fn is_translucent(&self) -> bool {
        matches!(&self.model, Model::MetalRough(m) if m.is_translucent())
    }

    /// How much of the mirrored and of the refracted direction is seen; `cosine` is that of the view.
    pub(crate) fn bounce_weights(&self, cosine: f32, crossing: &Crossing) -> BounceWeights {
        let BounceWeights { reflected, glass, refracted } = match &self.model {
            Model::Unlit(_) => BounceWeights::default(),
            Model::Phong(m) => m.bounce_weights(cosine, crossing),
            Model::MetalRough(m) => m.bounce_weights(cosine, crossing, self.outside),
        };
        let clear = self.clear();
        BounceWeights { reflected: reflected * clear, glass: glass * clear, refracted: refracted * clear }
    }

    /// The normal of the clear coat over it, and the weight of the mirror ray off that.
    pub(crate) fn coat_reflection(&self) -> Option<(Vec3, f32)> {
        self.coat.as_ref().map(|coat| (coat.normal, coat.mirrored()))
    }

    /// Whether light passes through it here.
    pub(crate) fn lets_light_in(&self) -> bool {
        match &self.model {
            Model::Phong(m) => m.transmission != Vec3::ZERO,
            Model::MetalRough(m) => m.lets_light_in(),
            Model::Unlit(_) => false,
        }
    }

    /// Index of refraction of the inside (1: rays pass straight on), and its dispersion; `None` where there is no inside.
    pub(crate) fn refraction(&self) -> Option<(f32, f32)> {
        let (ior, dispersion) = match &self.model {
            Model::Phong(m) if m.transmission != Vec3::ZERO => (m.ior, m.dispersion),
            Model::MetalRough(m) if m.thick => (m.ior, m.dispersion),
            Model::Phong(_) | Model::MetalRough(_) | Model::Unlit(_) => return None,
        };
        Some(if ior > 0.0 { (ior, dispersion) } else { (1.0, 0.0) })
    }
}

/// Sheen and clear coat of a material at a point that sees such a share of its surroundings.
pub(crate) fn overlays(
    m: &MetalRough,
    on: &LobeFrame,
    occlusion: f32,
    reader: &Reader,
) -> (Option<SheenLobe>, Option<CoatLobe>) {
    let n_v = on.normal.dot(on.view).clamp(0.0, 1.0);
    let sheen = m.sheen.as_ref().and_then(|sheen| SheenLobe::new(sheen, n_v, reader));
    let coat = m.coat.as_ref().and_then(|coat| {
        let normal = on.coat_normal(coat.normal_map.as_ref(), coat.normal_scale, reader.store);
        CoatLobe::new(coat, normal, on.view, occlusion, reader)
    });
    (sheen, coat)
}

/// How rough what is seen along a path that rough surfaces have spread to this angle across, radians, is at least.
pub(crate) fn blurred(angle: f32) -> f32 {
    (0.5 * angle).sqrt().min(0.5)
}

/// Share of the surroundings that the occlusion map leaves open, which says `shade`.
#[inline(always)]
pub(crate) fn occlusion(material: &Material, shade: f32) -> f32 {
    (1.0 + material.occlusion_strength * (shade - 1.0)).clamp(0.0, 1.0)
}

/// The share of light that a surface lets through to a point in its shadow: filtered by its colour.
///
/// An absent texel lets everything through, one of a see-through material what its opacity and its colour leave.
pub(crate) fn shadow_filter(material: &Material, reader: &Reader) -> Vec3 {
    let base = reader.base(material);
    let solid = material.alpha_mode.covers(base.w);
    let passed = match &material.reflection {
        Reflection::Unlit => Vec3::ZERO,
        Reflection::Phong(m) if m.fresnel => m.transmission,
        Reflection::Phong(m) => m.transmission.min(Vec3::ONE - m.mirror.min(Vec3::ONE)),
        Reflection::MetalRough(m) if m.transmission > 0.0 => {
            let share = m.transmission * reader.linear(m.transmission_map.as_ref()).x;
            base.truncate() * (share * (1.0 - metal_rough::metallic_at(m, reader)))
        }
        Reflection::MetalRough(_) => Vec3::ZERO,
    };
    Vec3::splat(1.0 - solid) + passed.clamp(Vec3::ZERO, Vec3::ONE) * solid
}

/// Whether a material has an inside: back faces of what is thin are seen from outside, too.
pub(crate) fn has_inside(material: &Material) -> bool {
    material.reflection.transmits() && material.metal_rough().is_none_or(|m| m.thick)
}

/// How much of a light a mapped surface shows near the line where it turns away from it: 1 away from that line, 0 on it, so
/// that where the surface ends does not cut off what its maps do.
///
/// `horizon` is the normal without maps. M. J.-Y. Chiang, Y. K. Li, B. Burley, "Taming the Shadow Terminator" (2019), who
/// compare with the facets of the mesh, which then show. 1 everywhere on surfaces without maps.
#[inline(always)]
pub(crate) fn terminator(horizon: Vec3, shading: Vec3, to_light: Vec3) -> f32 {
    let agreement = shading.dot(to_light) * shading.dot(horizon);
    let g = horizon.dot(to_light) / agreement;
    // Not a number where the shading normal is square to the light or to the surface: such light is not seen anyway.
    if g.is_nan() || g >= 1.0 {
        return 1.0;
    }
    let g = g.max(0.0);
    ((1.0 - g) * g + 1.0) * g
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shading_fades_out_smoothly_where_the_true_surface_turns_away() {
        let lean = |degrees: f32| {
            let (sin, cos) = libm::sincosf(degrees.to_radians());
            Vec3::new(sin, 0.0, cos)
        };
        let shading = lean(20.0);
        let seen: Vec<f32> = (0..=8).map(|i| terminator(Vec3::Z, shading, lean(50.0 + 5.0 * i as f32))).collect();
        assert_eq!(terminator(Vec3::Z, shading, Vec3::Z), 1.0, "far from the line nothing changes");
        assert!(seen.windows(2).all(|w| w[1] <= w[0]) && seen[7] < 0.5 && seen[8] < 1e-4, "{seen:?}");
        assert_eq!(terminator(Vec3::Z, Vec3::Z, lean(89.0)), 1.0, "flat faces keep their shading");
    }
}
