//! Material as written -> material as drawn.
//!
//! MTL has many careless writers. Under [`MtlMode::Guess`] values that no one can have meant are replaced, each with a counted
//! warning; under [`MtlMode::Literal`] the text counts. In both, colours are linear (the original specification knows nothing
//! else, and Blender writes them so; [`super::writer`] guesses when they are not) and pictures sRGB-coded; surfaces are
//! double-sided; `illum` 3 and above mirror by `Ks`; of these 4, 6, 7 and 9 are transparent and transmit what they do not
//! mirror, and 5 and 7 weigh both by Fresnel; a material with fields of physically based rendering (`Pr`, `Pm`, …) is physically
//! based, and its `Ks` is not used.
//!
//! The numbers come first ([`Meaning`]), then the pictures ([`super::textures`]): the meaning of a factor may depend on whether
//! its map could be read.

use super::parse::{Mtl, Slot};
use super::writer::{Writer, light};
use crate::load::paths::shorten;
use crate::load::{Diagnostic, MtlMode, Warnings};
use crate::math::Vec3;
use crate::scene::{AlphaMode, Anisotropy, Coat, Material, MetalRough, Phong, Reflection, Sheen};
use std::path::Path;

/// Default diffuse colour: that of [`Material::plain`].
const NO_DIFFUSE: f32 = 0.6;
/// Default Phong exponent: that of a satin finish.
const NO_SHININESS: f64 = 32.0;
/// Roughness of the fibres of cloth.
const SHEEN_ROUGHNESS: f32 = 0.3;
/// Default index of refraction of glass.
const NO_IOR: f64 = 1.5;

/// Computes the numbers of one material.
pub(super) struct Meaning<'a> {
    pub mtl: &'a Mtl,
    pub mode: MtlMode,
    /// Program that wrote the library.
    pub writer: Writer,
    /// Path of the library, for warnings.
    pub file: &'a Path,
    pub warnings: &'a mut Warnings,
    /// Returns whether the picture of a slot could be read.
    pub has_map: &'a dyn Fn(Slot) -> bool,
    /// Whether every material in use has an opacity of 0.
    pub all_invisible: bool,
}

impl Meaning<'_> {
    /// Returns the material, without its maps.
    pub(super) fn material(&mut self) -> Material {
        let illum = self.illum();
        let opacity = self.opacity();
        let glass = self.glass(illum, opacity);
        // On an opaque material an `illum` of glass means nothing: some programs write it for everything.
        let illum = if is_of_glass(illum) && !glass { 2 } else { illum };
        let passed = self.passed(glass, opacity);
        let kd = self.diffuse();
        let physical = self.mtl.is_physical() || self.is_metal_of_blender();
        let reflection = if physical {
            Reflection::MetalRough(self.metal_rough(glass, passed))
        } else if illum == 0 {
            Reflection::Unlit
        } else {
            Reflection::Phong(self.phong(illum, kd, passed))
        };
        // In glass, the share that is not transmitted is scattered; a physically based model computes that share itself.
        let kept = if glass && !physical && self.mtl.d.is_some() { opacity } else { 1.0 };
        // A physically based model tints transmission by the base colour.
        let tint = if physical && passed != Vec3::ZERO { passed / passed.max_element() } else { Vec3::ONE };
        let blended = !glass && opacity < 1.0;
        Material {
            name: self.mtl.name.clone(),
            base_color: kd * kept * tint,
            opacity: if glass { 1.0 } else { opacity },
            alpha_mode: if blended { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
            emission: self.under_map(Slot::Emission, self.mtl.ke, Vec3::ZERO, "Ke"),
            reflection,
            ..Material::default()
        }
    }

    fn guessing(&self) -> bool {
        self.mode == MtlMode::Guess
    }

    fn warn(&mut self, code: &'static str, text: &str) {
        let line = self.mtl.line.to_string();
        self.warnings.push(Diagnostic::new(code, self.file, line, text).remedy("--mtl literal follows the text"));
    }

    /// Clamps a number to 0 … 1, with a warning if it is outside.
    fn part(&mut self, what: &str, value: f64) -> f32 {
        let nearest = value.clamp(0.0, 1.0);
        if nearest != value {
            let text = format!("{what} is {value}, and counts as {nearest}");
            self.warnings.push(Diagnostic::new("mtl-range", self.file, self.mtl.line.to_string(), text));
        }
        number(nearest)
    }

    fn illum(&mut self) -> i32 {
        match self.mtl.illum {
            Some(0) if self.guessing() => {
                self.warn("mtl-constant", "illum 0 (constant colour) is shaded like illum 1");
                1
            }
            Some(3) if self.guessing() && self.writer == Writer::Vtk => {
                self.warn(
                    "mtl-illum-of-writer",
                    "the program that wrote this writes illum 3 of everything: it is no mirror",
                );
                2
            }
            Some(9) if self.is_of_blender() => {
                self.warn("mtl-illum-of-writer", "illum 9 of Blender is blended as d says: it is no glass");
                2
            }
            // A blended metal.
            Some(6) if self.is_of_blender() => 3,
            Some(illum) => illum,
            None => 2,
        }
    }

    fn diffuse(&mut self) -> Vec3 {
        let is_mapped = (self.has_map)(Slot::Diffuse);
        let missing_map = self.mtl.map(Slot::Diffuse).is_some() && !is_mapped;
        let black = self.mtl.kd.is_some_and(|kd| kd == [0.0; 3]);
        if missing_map && black && self.guessing() {
            self.warn("mtl-black-under-map", "a colour of 0 under a map that cannot be read counts as grey");
            return Vec3::splat(NO_DIFFUSE);
        }
        if self.mtl.kd.is_none() && !is_mapped && self.guessing() {
            self.warn("mtl-no-diffuse", "a material without Kd is grey");
        }
        if black && self.mtl.ni == Some(0.0) && self.mtl.ks.is_none() && !is_mapped && self.guessing() {
            self.warn(
                "mtl-no-diffuse",
                "Kd 0 with Ni 0 and no Ks is what is written of materials that are not known: it is grey",
            );
            return Vec3::splat(NO_DIFFUSE);
        }
        let is_replaced = is_mapped && self.writer.replaces_by_maps() && self.mtl.kd.is_some_and(|kd| kd != [1.0; 3]);
        if is_replaced && !black && self.guessing() {
            self.warn(
                "mtl-color-under-map",
                "in the program that wrote this a map takes the place of Kd, which counts as 1",
            );
            return Vec3::ONE;
        }
        let default = if is_mapped { Vec3::ONE } else { Vec3::splat(NO_DIFFUSE) };
        self.under_map(Slot::Diffuse, self.mtl.kd, default, "Kd")
    }

    /// Factor of a slot; black under a map counts as white, because many programs write 0 when the map replaces the colour.
    fn under_map(&mut self, slot: Slot, factor: Option<[f64; 3]>, default: Vec3, name: &str) -> Vec3 {
        let mapped = (self.has_map)(slot);
        match factor {
            Some([0.0, 0.0, 0.0]) if mapped && self.guessing() => {
                self.warn("mtl-black-under-map", &format!("{name} 0 under a map counts as 1"));
                Vec3::ONE
            }
            Some(factor) if self.guessing() && slot == Slot::Diffuse && are_bytes(factor) => {
                let text = format!("{name} is {}: it counts as 0…255, as screens show it", words_of(factor));
                self.warn("mtl-color-bytes", &text);
                color(light(factor.map(|x| x / 255.0)))
            }
            Some(factor) => {
                self.tell_unreal(slot, factor, name);
                color(factor)
            }
            None if mapped => Vec3::ONE,
            None => default,
        }
    }

    /// Warns of a colour that no light or surface can have; it is used as given, except that negative parts count as 0.
    fn tell_unreal(&mut self, slot: Slot, factor: [f64; 3], name: &str) {
        // Rounding in conversions overshoots 1 a little.
        const MOST: f64 = 1.01;
        let what = match slot {
            _ if factor.iter().any(|x| *x < 0.0) => "parts below 0 count as 0",
            Slot::Diffuse | Slot::Specular if factor.iter().any(|x| *x > MOST) => {
                "it sends back more light than falls on it; parts run from 0 to 1"
            }
            _ => return,
        };
        let text = format!("{name} is {}: {what}", words_of(factor));
        self.warnings.push(Diagnostic::new("mtl-range", self.file, self.mtl.line.to_string(), text));
    }

    /// Opacity: `d`, or 1 − `Tr`, clamped to 0 … 1.
    fn opacity(&mut self) -> f32 {
        let (d, tr) = (self.mtl.d, self.mtl.tr);
        let opacity = match (d, tr) {
            (Some(d), Some(tr)) if (d + tr - 1.0).abs() > 0.01 => {
                self.warn("mtl-tr-contradicts-d", "Tr is not 1 - d; d counts");
                d
            }
            (None, Some(tr)) if self.writer == Writer::Vtk && self.guessing() => {
                if tr < 1.0 {
                    self.warn("mtl-tr-as-opacity", "the program that wrote this writes opacity as Tr");
                }
                tr
            }
            (None, Some(tr)) if tr >= 1.0 && self.guessing() => {
                self.warn(
                    "mtl-tr-as-opacity",
                    "Tr of 1 or more without d would hide the surface; it counts as opacity",
                );
                1.0
            }
            (Some(d), _) => d,
            (None, Some(tr)) => 1.0 - tr,
            (None, None) => 1.0,
        };
        let mapped = [Slot::Dissolve, Slot::Transparency, Slot::Diffuse].into_iter().any(self.has_map);
        if opacity <= 0.0 && self.guessing() && (self.all_invisible || mapped) {
            self.warn("mtl-invisible", "d 0 would hide everything, or a map; it counts as 1");
            return 1.0;
        }
        if opacity == 0.0 {
            let text = "its opacity is 0: faces of it are not seen";
            self.warnings.push(Diagnostic::new("mtl-unseen", self.file, self.mtl.line.to_string(), text));
        }
        self.part("opacity (d, or 1 - Tr)", opacity)
    }

    /// Returns whether the material refracts light.
    fn glass(&mut self, illum: i32, opacity: f32) -> bool {
        let asked = is_of_glass(illum);
        // White transmits everything and black nothing, and exporters write either for opaque materials.
        let mut filters = self.mtl.tf.is_some_and(|tf| tf != [1.0; 3] && tf != [0.0; 3]);
        // 3ds Max writes one number as both.
        let is_opacity = |tf: [f64; 3]| tf.iter().all(|part| (part - f64::from(opacity)).abs() < 0.01);
        if self.guessing() && !asked && filters && opacity < 1.0 && self.mtl.tf.is_some_and(is_opacity) {
            self.warn("mtl-filter-is-opacity", "Tf is d once more and filters nothing");
            filters = false;
        }
        // An explicit opacity of 1 overrides the filter.
        let says_opaque = opacity >= 1.0 && (self.mtl.d.is_some() || self.mtl.tr.is_some());
        let filters = (filters && (asked || !says_opaque)) || self.is_glass_of_blender();
        let passes = opacity < 1.0 || filters;
        if self.guessing() {
            let refracts = matches!(illum, 6 | 7) && self.mtl.tf.is_some_and(|tf| tf != [0.0; 3]);
            if asked && !passes && !refracts {
                let text = "illum asks for glass, but d is 1 and Tf filters nothing: it is opaque, like illum 2";
                self.warn("mtl-opaque-glass", text);
            }
            filters || (asked && (passes || refracts))
        } else {
            asked || filters
        }
    }

    /// Weight of the refracted ray: the filter `Tf`, times 1 − `d` where `d` is below 1.
    fn passed(&self, glass: bool, opacity: f32) -> Vec3 {
        if !glass {
            return Vec3::ZERO;
        }
        let filter = self.mtl.tf.map_or(Vec3::ONE, color).clamp(Vec3::ZERO, Vec3::ONE);
        let open = if opacity < 1.0 { 1.0 - opacity } else { 1.0 };
        filter * open
    }

    fn ior(&mut self, glass: bool) -> f32 {
        match self.mtl.ni {
            Some(ni) if ni > 0.0 => number(ni.clamp(0.001, 10.0)),
            _ if glass && self.guessing() => {
                self.warn("mtl-no-ior", "glass without Ni has an index of refraction of 1.5");
                number(NO_IOR)
            }
            _ => 1.0,
        }
    }

    fn phong(&mut self, illum: i32, kd: Vec3, transmission: Vec3) -> Phong {
        let glass = transmission != Vec3::ZERO;
        let ks = self.under_map(Slot::Specular, self.mtl.ks, Vec3::ZERO, "Ks");
        let mirrors = (3..=9).contains(&illum);
        if mirrors && ks == Vec3::ZERO && !glass && self.guessing() {
            self.warn("mtl-black-mirror", "illum asks for a mirror, but Ks is 0: there is none");
        }
        let (specular, shininess) = self.highlight(illum, ks);
        let fresnel = matches!(illum, 5 | 7);
        // Fresnel needs something to balance: glass mirrors what it does not transmit.
        let mirror = if mirrors && glass && fresnel && ks == Vec3::ZERO && self.guessing() { transmission } else { ks };
        let mirror = if mirrors { mirror } else { Vec3::ZERO };
        // What is mirrored is not transmitted. Fresnel decides by angle, a map by place.
        let is_even = !fresnel && !(self.has_map)(Slot::Specular);
        let kept = if is_even { Vec3::ONE - mirror.min(Vec3::ONE) } else { Vec3::ONE };
        let transmission = transmission * kept;
        if glass && transmission == Vec3::ZERO && self.guessing() {
            self.warn("mtl-opaque-glass", "illum asks for glass, but Ks mirrors all light, so that nothing passes");
        }
        Phong {
            ambient: self.ambient(kd),
            specular,
            shininess,
            mirror,
            transmission,
            ior: self.ior(transmission != Vec3::ZERO),
            fresnel,
            ..Phong::default()
        }
    }

    /// Ambient colour. Most programs write `Ka` carelessly: 0, 1, or a copy of `Kd`.
    fn ambient(&mut self, kd: Vec3) -> Vec3 {
        let ka = self.mtl.ka.map(color);
        if !self.guessing() {
            return ka.unwrap_or(Vec3::ZERO);
        }
        if ka.is_some_and(|ka| ka != kd) {
            self.warn("mtl-ambient", "Ka is not used; ambient light sees Kd");
        }
        kd
    }

    fn highlight(&mut self, illum: i32, ks: Vec3) -> (Vec3, f32) {
        if illum <= 1 || ks == Vec3::ZERO {
            return (Vec3::ZERO, 1.0);
        }
        // An exponent below 1 would make the highlight wider than the diffuse lobe.
        let narrowest_told = if self.guessing() { 1.0 } else { f64::MIN_POSITIVE };
        match self.mtl.ns {
            Some(ns) if ns >= narrowest_told => (ks, number(ns)),
            Some(ns) if self.guessing() => {
                let ns = shorten(&ns.to_string());
                let text = format!("Ns {ns} would spread the highlight over everything; there is none");
                self.warn("mtl-flat-highlight", &text);
                (Vec3::ZERO, 1.0)
            }
            None if self.guessing() => {
                self.warn("mtl-no-shininess", "Ks without Ns has an exponent of 32");
                (ks, number(NO_SHININESS))
            }
            ns => (ks, number(ns.unwrap_or(1.0).max(0.0))),
        }
    }

    /// Metal-rough parameters. Roughness that is not given follows from the exponent `Ns` (B. Walter et al., "Microfacet Models
    /// for Refraction through Rough Surfaces", 2007: α² = 2 / (n + 2)).
    fn metal_rough(&mut self, glass: bool, passed: Vec3) -> MetalRough {
        let packed = (self.has_map)(Slot::OcclusionRoughMetal) || (self.has_map)(Slot::RoughMetalOcclusion);
        let roughness = match self.mtl.pr {
            Some(0.0) if self.guessing() && ((self.has_map)(Slot::Roughness) || packed) => 1.0,
            Some(pr) => pr,
            None if (self.has_map)(Slot::Roughness) || packed => 1.0,
            None if self.is_metal_of_blender() => {
                1.0 - self.mtl.ns.map_or(0.25, |ns| (ns / 1000.0).clamp(0.0, 1.0)).sqrt()
            }
            None => self.mtl.ns.map_or(0.5, |ns| libm::pow(2.0 / (ns.max(0.0) + 2.0), 0.25)),
        };
        let metallic = match self.mtl.pm {
            Some(0.0) if self.guessing() && ((self.has_map)(Slot::Metallic) || packed) => 1.0,
            Some(pm) => pm,
            None if (self.has_map)(Slot::Metallic) || packed => 1.0,
            None if self.is_metal_of_blender() => {
                let illum = self.mtl.illum.unwrap_or(3);
                let text = format!("illum {illum} of Blender is metal: Ka says how much of one, Ns how smooth");
                self.warn("mtl-illum-of-writer", &text);
                self.mtl.ka.map_or(1.0, |[metallic, ..]| metallic)
            }
            None => 0.0,
        };
        let ior = self.ior(glass);
        MetalRough {
            metallic: self.part("Pm", metallic),
            roughness: self.part("roughness (Pr)", roughness),
            // Programs without such a field write 1; a dielectric without reflection is not meant.
            ior: if ior > 1.0 { ior } else { number(NO_IOR) },
            transmission: passed.max_element(),
            thick: glass,
            sheen: self.sheen().map(Box::new),
            coat: self.coat().map(Box::new),
            anisotropy: self.anisotropy().map(Box::new),
            ..MetalRough::default()
        }
    }

    /// Returns whether the conventions of Blender override the text.
    fn is_of_blender(&self) -> bool {
        self.guessing() && self.writer == Writer::Blender
    }

    /// Returns whether this is a metal as Blender wrote it before MTL had fields for metals.
    fn is_metal_of_blender(&self) -> bool {
        self.is_of_blender() && matches!(self.mtl.illum, Some(3 | 6)) && !self.mtl.is_physical()
    }

    /// Returns whether this is glass as Blender writes it: `Tf` beside physically based fields.
    fn is_glass_of_blender(&self) -> bool {
        self.is_of_blender() && self.mtl.is_physical() && self.mtl.tf.is_some_and(|tf| tf != [0.0; 3])
    }

    /// Sheen: `Ps` as the strength of white fibres. No field gives their roughness.
    fn sheen(&self) -> Option<Sheen> {
        let strength = self.share_under(Slot::Sheen, self.mtl.ps)?;
        Some(Sheen { color: Vec3::splat(strength), color_map: None, roughness: SHEEN_ROUGHNESS, roughness_map: None })
    }

    /// Clear coat: `Pc`, `Pcr`.
    fn coat(&self) -> Option<Coat> {
        Some(Coat {
            strength: self.share_under(Slot::Coat, self.mtl.pc)?,
            strength_map: None,
            roughness: self.share_under(Slot::CoatRoughness, self.mtl.pcr).unwrap_or(0.0),
            roughness_map: None,
            normal_map: None,
            normal_scale: 1.0,
        })
    }

    /// Anisotropy: `aniso`, `anisor`.
    fn anisotropy(&self) -> Option<Anisotropy> {
        // A map of rotations contains the angle itself.
        let turns = self.mtl.anisor.filter(|_| !(self.has_map)(Slot::AnisotropyRotation));
        let rotation = turns.map_or(0.0, |turns| number(turns.rem_euclid(1.0) * std::f64::consts::TAU));
        Some(Anisotropy { strength: self.share_under(Slot::Anisotropy, self.mtl.aniso)?, rotation, map: None })
    }

    /// Factor of a map: 1 where no number is given, or a careless 0.
    fn share_under(&self, slot: Slot, of: Option<f64>) -> Option<f32> {
        match of {
            None if (self.has_map)(slot) => Some(1.0),
            Some(0.0) if self.guessing() && (self.has_map)(slot) => Some(1.0),
            _ => share(of),
        }
    }
}

/// Returns whether an `illum` asks for refraction.
fn is_of_glass(illum: i32) -> bool {
    matches!(illum, 4 | 6 | 7 | 9)
}

/// Returns whether a colour that should be at most 1 is given in 0…255.
fn are_bytes(color: [f64; 3]) -> bool {
    /// Larger than any colour above 1 that is meant.
    const LEAST: f64 = 16.0;
    color.iter().any(|&x| x >= LEAST) && color.iter().all(|x| (0.0..=255.0).contains(x) && x.fract() == 0.0)
}

fn words_of(color: [f64; 3]) -> String {
    color.map(|x| x.to_string()).join(" ")
}

/// A share clamped to at most 1; `None` if it is missing or not positive.
fn share(of: Option<f64>) -> Option<f32> {
    of.map(|x| number(x.clamp(0.0, 1.0))).filter(|x| *x > 0.0)
}

/// Converts a colour to `f32`, with negative parts cut to 0.
pub(super) fn color(c: [f64; 3]) -> Vec3 {
    Vec3::from(c.map(number)).max(Vec3::ZERO)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant; values were finite f64s")]
fn number(x: f64) -> f32 {
    (x as f32).clamp(-f32::MAX, f32::MAX)
}

#[cfg(test)]
mod tests;
