//! Reflection and transmission of light: the material at a point, evaluated from factors, maps and vertex colours.
//!
//! Shading models answer two questions here: how much of a light is reflected to the view ([`Bsdf::lit`], [`Bsdf::lit_through`]),
//! and with what weights the mirrored and refracted directions are seen ([`Bsdf::bounce_weights`]). The tracer decides which rays
//! are sent, and follows them.

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

/// View and normals at a point of a surface, unit vectors away from it, and the side it is seen from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShadingFrame {
    /// Shading normal.
    pub normal: Vec3,
    /// Geometric normal.
    pub geometric: Vec3,
    /// Direction back along the ray.
    pub view: Vec3,
    /// Whether it is seen from outside: always, where light cannot enter.
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
    /// Anisotropy, sheen and clear coat; visible from outside only.
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
    /// Base colour.
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
    /// Part of `reflected` that clear glass reflects: light that its facets mask passes on through other facets.
    pub glass: Vec3,
    pub refracted: Vec3,
}

impl BounceWeights {
    /// Weights of a surface without microfacets.
    pub(crate) fn smooth(reflected: Vec3, refracted: Vec3) -> Self {
        Self { reflected, refracted, glass: Vec3::ZERO }
    }

    /// Weight of reflection where other facets leave the share `kept`: light masked in glass passes on through it, and light that
    /// enters glass again comes out after all.
    pub(crate) fn mirrored(&self, kept: f32) -> Vec3 {
        (self.reflected - self.glass) * kept + self.glass
    }
}

/// Reads the maps of one point.
pub(crate) struct Reader<'a> {
    pub store: &'a TextureStore<'a>,
    pub patch: Option<&'a Patch<'a>>,
    /// Texels that have been read already.
    pub known: &'a [Known],
}

/// Texel of a map at a point.
#[derive(Clone, Copy)]
pub(crate) struct Known {
    pub map: TextureRef,
    pub space: ColorSpace,
    /// Linear RGBA.
    pub texel: Vec4,
}

impl Reader<'_> {
    /// Linear RGBA of the map; white where there is no map, or no mesh to read it on.
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

    /// Alpha of the map; 1 where there is none.
    fn alpha(&self, map: Option<&TextureRef>) -> f32 {
        let Some(map) = map else { return 1.0 };
        match self.known.iter().find(|known| known.map == *map && known.space != ColorSpace::SrgbCutOut) {
            Some(known) => known.texel.w,
            None => self.patch.map_or(1.0, |patch| patch.alpha(map, self.store)),
        }
    }

    /// One channel of the map, at full resolution; 1 where there is no map, or no mesh to read it on.
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

/// Whether a material has an alpha cutoff, whose opacity is read at full resolution, however small it is seen: with a mean over
/// the footprint most leaves would fall below their cutoff and vanish, or rise above it and turn solid.
pub(crate) fn is_cut_out(material: &Material) -> bool {
    matches!(material.alpha_mode, AlphaMode::Mask { .. })
}

/// Colour space of a material's base colour map, given the role of its alpha.
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

    /// This surface with the reflectance that maps give at this point.
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

    /// The material with its maps, but without anisotropy, film, sheen and clear coat, as seen from outside.
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

    /// A surface of this model without further layers.
    pub(crate) fn base_layer(model: Model, emission: Vec3, outside: bool) -> Self {
        Self { outside, emission, model, anisotropy: None, sheen: None, coat: None }
    }

    /// Whether the surface itself shows no light, only what its secondary rays find.
    pub(crate) fn is_dark(&self) -> bool {
        !self.outside && self.is_dark_inside()
    }

    /// The same for a surface seen from inside: true of clear glass.
    pub(crate) fn is_dark_inside(&self) -> bool {
        self.emission == Vec3::ZERO && matches!(&self.model, Model::MetalRough(m) if m.is_clear())
    }

    /// Share of the light below the clear coat that passes through it.
    fn below_coat(&self) -> f32 {
        self.coat.as_ref().map_or(1.0, CoatLobe::clear)
    }

    /// Share of the light below sheen and clear coat that passes through both.
    fn clear(&self) -> f32 {
        self.below_coat() * self.sheen.as_ref().map_or(1.0, SheenLobe::clear)
    }

    /// Whether light has no effect on it.
    pub(crate) fn is_unlit(&self) -> bool {
        matches!(self.model, Model::Unlit(_))
    }

    /// Whether it is visible without light.
    pub(crate) fn shines(&self) -> bool {
        self.emission != Vec3::ZERO || self.is_unlit()
    }

    /// Light of the environment that is seen without a ray: on this side, and through frosted glass.
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

    /// Contribution, per solid angle, of radiance from one direction `to` to what [`Self::ambient`] shows on this side; `ambient`
    /// comes from everywhere.
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

    /// Switches rough surfaces from lookups to spread rays, for reflection and transmission.
    pub(crate) fn spread_by_rays(&mut self) {
        if let Model::MetalRough(m) = &mut self.model {
            m.spread_by_rays();
        }
    }

    /// Roughens the surface for a path that rough surfaces have spread to this angle across, radians: on such paths few rays
    /// would hit narrow highlights, each far too bright (A. S. Kaplanyan, C. Dachsbacher, "Path Space Regularization for Holistic
    /// and Robust Light Transport", 2013).
    pub(crate) fn blur(&mut self, angle: f32) {
        if let Model::MetalRough(m) = &mut self.model {
            m.blur(blurred(angle));
        }
    }

    /// Whether highlights of lights without extent below the clear coat are so narrow that they must be widened.
    pub(crate) fn has_narrow_highlight(&self) -> bool {
        matches!(&self.model, Model::MetalRough(m) if m.has_narrow_highlight())
    }

    /// Widens the highlights of lights below the clear coat to this squared width α², where they are narrower.
    pub(crate) fn widen_highlight(&mut self, to: f32) {
        if let Model::MetalRough(m) = &mut self.model {
            m.widen_highlight(to);
        }
        if let Some(anisotropy) = &mut self.anisotropy {
            anisotropy.widen_highlight(to);
        }
    }

    /// Lobe around this normal that spreads rays; `None` where a single ray suffices.
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

    /// Light reflected to the viewer from a light on the viewer's side of the surface, whose normal before maps is `horizon`.
    ///
    /// From inside there is no highlight: light that enters was refracted there, so it does not arrive along the straight line,
    /// and never at an angle of total reflection. Light guided through thin walls over hundreds of reflections would gain such a
    /// highlight at each.
    pub(crate) fn lit(&self, horizon: Vec3, normal: Vec3, view: Vec3, light: &Incident) -> Vec3 {
        let below = match &self.model {
            Model::Unlit(_) => Vec3::ZERO,
            Model::Phong(m) if !self.outside => m.scattered(normal, light.to_light) * light.strength(),
            Model::Phong(m) => m.lit(normal, view, light.to_light) * light.strength(),
            Model::MetalRough(m) => self.lit_below(m, normal, view, light.to_light) * light.irradiance(),
        };
        self.lit_over(below, horizon, normal, view, light.to_light, light.irradiance())
    }

    /// Like [`Self::lit`], of a metallic-rough surface, for irradiance `light` from `to_light`.
    pub(crate) fn lit_with_lobes(&self, horizon: Vec3, normal: Vec3, view: Vec3, to_light: Vec3, light: Vec3) -> Vec3 {
        let Model::MetalRough(m) = &self.model else { return Vec3::ZERO };
        let below = self.lit_below(m, normal, view, to_light) * light;
        self.lit_over(below, horizon, normal, view, to_light, light)
    }

    /// BRDF × N·L of the metallic-rough surface below sheen and clear coat.
    fn lit_below(&self, m: &MetalRoughBsdf, normal: Vec3, view: Vec3, to_light: Vec3) -> Vec3 {
        match &self.anisotropy {
            _ if !self.outside => m.lit_inside(normal, view, to_light),
            None => m.lit(normal, view, to_light),
            Some(anisotropy) => m.lit_by(normal, view, to_light, |_| anisotropy.widened(normal, view, to_light)),
        }
    }

    /// Adds sheen and clear coat under the same irradiance over the light `below`.
    fn lit_over(&self, below: Vec3, horizon: Vec3, normal: Vec3, view: Vec3, to_light: Vec3, irradiance: Vec3) -> Vec3 {
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

    /// Light transmitted to the viewer from a light on the other side of the surface.
    pub(crate) fn lit_through(&self, normal: Vec3, view: Vec3, light: &Incident, crossing: &Crossing) -> Vec3 {
        match &self.model {
            Model::Phong(m) => m.lit_through(normal, view, light.to_light, crossing) * light.strength(),
            Model::MetalRough(_) => self.lit_through_lobes(normal, view, light.to_light, light.irradiance()),
            Model::Unlit(_) => Vec3::ZERO,
        }
    }

    /// The same for irradiance `light` on the other side of a metallic-rough surface.
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

    /// Weights of the mirrored and the refracted direction; `cosine` is that of the view.
    pub(crate) fn bounce_weights(&self, cosine: f32, crossing: &Crossing) -> BounceWeights {
        let BounceWeights { reflected, glass, refracted } = match &self.model {
            Model::Unlit(_) => BounceWeights::default(),
            Model::Phong(m) => m.bounce_weights(cosine, crossing),
            Model::MetalRough(m) => m.bounce_weights(cosine, crossing, self.outside),
        };
        let clear = self.clear();
        BounceWeights { reflected: reflected * clear, glass: glass * clear, refracted: refracted * clear }
    }

    /// Normal of the clear coat, and the weight of the mirror ray off it.
    pub(crate) fn coat_reflection(&self) -> Option<(Vec3, f32)> {
        self.coat.as_ref().map(|coat| (coat.normal, coat.mirrored()))
    }

    /// Whether light can pass through it here.
    pub(crate) fn lets_light_in(&self) -> bool {
        match &self.model {
            Model::Phong(m) => m.transmission != Vec3::ZERO,
            Model::MetalRough(m) => m.lets_light_in(),
            Model::Unlit(_) => false,
        }
    }

    /// Index of refraction of the inside (1: rays pass straight), and its dispersion; `None` where there is no inside.
    pub(crate) fn refraction(&self) -> Option<(f32, f32)> {
        let (ior, dispersion) = match &self.model {
            Model::Phong(m) if m.transmission != Vec3::ZERO => (m.ior, m.dispersion),
            Model::MetalRough(m) if m.thick => (m.ior, m.dispersion),
            Model::Phong(_) | Model::MetalRough(_) | Model::Unlit(_) => return None,
        };
        Some(if ior > 0.0 { (ior, dispersion) } else { (1.0, 0.0) })
    }
}

/// Sheen and clear coat of a material at a point with this occlusion.
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

/// Minimum roughness along a path that rough surfaces have spread to this angle across, radians.
pub(crate) fn blurred(angle: f32) -> f32 {
    (0.5 * angle).sqrt().min(0.5)
}

/// Share of the environment that an occlusion map with the value `shade` leaves open.
#[inline(always)]
pub(crate) fn occlusion(material: &Material, shade: f32) -> f32 {
    (1.0 + material.occlusion_strength * (shade - 1.0)).clamp(0.0, 1.0)
}

/// Share of light that passes through a surface to a point in its shadow: filtered by its colour.
///
/// A gap lets everything through, a texel of a see-through material what its opacity and colour leave.
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

/// Whether a material has an inside: back faces of thin surfaces are seen from outside, too.
pub(crate) fn has_inside(material: &Material) -> bool {
    material.reflection.transmits() && material.metal_rough().is_none_or(|m| m.thick)
}

/// Factor on a light near the terminator of a mapped surface: 1 away from it, 0 on it, so that the end of the lit side does not
/// cut off the detail of its maps.
///
/// `horizon` is the normal without maps. M. J.-Y. Chiang, Y. K. Li, B. Burley, "Taming the Shadow Terminator" (2019), who compare
/// with the facets of the mesh, which then show. 1 everywhere on surfaces without maps.
#[inline(always)]
pub(crate) fn terminator(horizon: Vec3, shading: Vec3, to_light: Vec3) -> f32 {
    let agreement = shading.dot(to_light) * shading.dot(horizon);
    let g = horizon.dot(to_light) / agreement;
    // NaN where the shading normal is perpendicular to the light or to the surface: such light is not seen anyway.
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
