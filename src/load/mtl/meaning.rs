//! A material as written -> a material as it is drawn.
//!
//! MTL has many careless writers. Under [`MtlMode::Guess`] the values that no one can have meant are replaced, each with
//! a counted warning; under [`MtlMode::Literal`] the text counts. Both agree on this: colours are linear (the founding
//! texts know nothing else, and Blender writes them so; [`super::writer`] tells when they are guessed not to be) and pictures
//! sRGB-coded; surfaces are seen from both sides; `illum` 3 and above mirror by `Ks`, of these 4, 6, 7 and 9 are transparent,
//! 5 and 7 have Fresnel's balance; a material with fields of physically based rendering (`Pr`, `Pm`, …) is one, and its `Ks`
//! is not used.
//!
//! The numbers come first ([`Meaning`]), then the pictures ([`super::textures`]): what a factor means may depend on
//! whether its map could be read.

use super::parse::{Mtl, Slot};
use super::writer::{Writer, light};
use crate::load::paths::shorten;
use crate::load::{Diagnostic, MtlMode, Warnings};
use crate::math::Vec3;
use crate::scene::{AlphaMode, Coat, Grain, Material, MetalRough, Phong, Reflection, Sheen};
use std::path::Path;

/// Diffuse colour of a material that gives none: that of [`Material::plain`].
const NO_DIFFUSE: f32 = 0.6;
/// Exponent of a highlight whose width nobody gave: that of a satin finish.
const NO_SHININESS: f64 = 32.0;
/// Roughness of the fibres of cloth.
const SHEEN_ROUGHNESS: f32 = 0.3;
/// Index of refraction of glass nobody gave one for.
const NO_IOR: f64 = 1.5;

/// Gathers the numbers of one material.
pub(super) struct Meaning<'a> {
    pub mtl: &'a Mtl,
    pub mode: MtlMode,
    /// Who wrote it.
    pub writer: Writer,
    /// Where warnings say it was.
    pub file: &'a Path,
    pub warnings: &'a mut Warnings,
    /// Whether the picture of a slot could be read.
    pub has_map: &'a dyn Fn(Slot) -> bool,
    /// Whether every material in use has an opacity of 0.
    pub all_invisible: bool,
}

impl Meaning<'_> {
    /// The material, without its maps.
    pub(super) fn material(&mut self) -> Material {
        let illum = self.illum();
        let opacity = self.opacity();
        let glass = self.glass(illum, opacity);
        // Opaque, `illum` of glass says nothing: some programs write it of everything.
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
        // Of glass, what does not pass is scattered; a physically based model finds that share itself.
        let kept = if glass && !physical && self.mtl.d.is_some() { opacity } else { 1.0 };
        // A physically based model lets through as much of each colour as its base colour says.
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

    /// A number from 0 to 1; the nearest of these, which is told, for any other.
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

    /// A factor; black under a map counts as white, because many programs write 0 when the map replaces the colour.
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

    /// Tells of a colour that no light or surface has, which is taken as it is but for what is negative.
    fn tell_unreal(&mut self, slot: Slot, factor: [f64; 3], name: &str) {
        // Rounded conversions end a little beyond 1.
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

    /// `d`, or 1 − `Tr`, 0 … 1.
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

    /// Whether light is refracted.
    fn glass(&mut self, illum: i32, opacity: f32) -> bool {
        let asked = is_of_glass(illum);
        // White lets everything pass and black nothing, and opaque materials are written with either.
        let mut filters = self.mtl.tf.is_some_and(|tf| tf != [1.0; 3] && tf != [0.0; 3]);
        // 3ds Max has one number for both.
        let is_opacity = |tf: [f64; 3]| tf.iter().all(|part| (part - f64::from(opacity)).abs() < 0.01);
        if self.guessing() && !asked && filters && opacity < 1.0 && self.mtl.tf.is_some_and(is_opacity) {
            self.warn("mtl-filter-is-opacity", "Tf is d once more and filters nothing");
            filters = false;
        }
        // A filter says nothing of what says in words that it lets nothing pass.
        let says_opaque = opacity >= 1.0 && (self.mtl.d.is_some() || self.mtl.tr.is_some());
        let filters = filters && (asked || !says_opaque);
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

    /// Weight of the refracted ray: what `Tf` lets through of what `d` leaves.
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
        // Fresnel's balance needs something to balance: glass mirrors what it does not let through.
        let mirror = if mirrors && glass && fresnel && ks == Vec3::ZERO && self.guessing() { transmission } else { ks };
        Phong {
            ambient: self.ambient(kd),
            specular,
            shininess,
            mirror: if mirrors { mirror } else { Vec3::ZERO },
            transmission,
            ior: self.ior(glass),
            fresnel,
            ..Phong::default()
        }
    }

    /// `Ka` is what most programs write without looking: 0, 1, or a copy of `Kd`.
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
        // Below 1 a highlight would be wider than what lies in the light.
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

    /// A physically based material. Roughness that is not given comes from `Ns`, as the width of the highlight
    /// (B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007: α² = 2 / (n + 2)).
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
                self.warn("mtl-illum-of-writer", "illum 3 of Blender is metal: Ka says how much of one, Ns how smooth");
                self.mtl.ka.map_or(1.0, |[metallic, ..]| metallic)
            }
            None => 0.0,
        };
        let ior = self.ior(glass);
        MetalRough {
            metallic: self.part("Pm", metallic),
            roughness: self.part("roughness (Pr)", roughness),
            // 1 is what programs write that have no such field; a dielectric without reflection is not meant.
            ior: if ior > 1.0 { ior } else { number(NO_IOR) },
            transmission: passed.max_element(),
            thick: glass,
            sheen: self.sheen().map(Box::new),
            coat: self.coat().map(Box::new),
            grain: self.grain().map(Box::new),
            ..MetalRough::default()
        }
    }

    /// Whether it is a metal as Blender wrote them before it had fields for them.
    fn is_metal_of_blender(&self) -> bool {
        self.guessing() && self.writer == Writer::Blender && self.mtl.illum == Some(3) && !self.mtl.is_physical()
    }

    /// `Ps`: white fibres. No field tells their roughness.
    fn sheen(&self) -> Option<Sheen> {
        let strength = self.share_under(Slot::Sheen, self.mtl.ps)?;
        Some(Sheen { color: Vec3::splat(strength), color_map: None, roughness: SHEEN_ROUGHNESS, roughness_map: None })
    }

    /// `Pc`, `Pcr`.
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

    /// `aniso`, `anisor`.
    fn grain(&self) -> Option<Grain> {
        // A map of turns has them in its picture.
        let turns = self.mtl.anisor.filter(|_| !(self.has_map)(Slot::GrainTurn));
        let rotation = turns.map_or(0.0, |turns| number(turns.rem_euclid(1.0) * std::f64::consts::TAU));
        Some(Grain { strength: self.share_under(Slot::Grain, self.mtl.aniso)?, rotation, map: None })
    }

    /// The share that a map is multiplied by: all where no number is given, or a careless 0.
    fn share_under(&self, slot: Slot, of: Option<f64>) -> Option<f32> {
        match of {
            None if (self.has_map)(slot) => Some(1.0),
            Some(0.0) if self.guessing() && (self.has_map)(slot) => Some(1.0),
            _ => share(of),
        }
    }
}

/// Whether `illum` asks for light to be refracted.
fn is_of_glass(illum: i32) -> bool {
    matches!(illum, 4 | 6 | 7 | 9)
}

/// Whether a colour, of what sends back no more light than falls on it, is one of 0…255.
fn are_bytes(color: [f64; 3]) -> bool {
    /// More than anybody means who means more than all light.
    const LEAST: f64 = 16.0;
    color.iter().any(|&x| x >= LEAST) && color.iter().all(|x| (0.0..=255.0).contains(x) && x.fract() == 0.0)
}

fn words_of(color: [f64; 3]) -> String {
    color.map(|x| x.to_string()).join(" ")
}

/// A share of at most 1; `None` where nothing of it is there.
fn share(of: Option<f64>) -> Option<f32> {
    of.map(|x| number(x.clamp(0.0, 1.0))).filter(|x| *x > 0.0)
}

/// A colour, never negative.
pub(super) fn color(c: [f64; 3]) -> Vec3 {
    Vec3::from(c.map(number)).max(Vec3::ZERO)
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant; values were finite f64s")]
fn number(x: f64) -> f32 {
    (x as f32).clamp(-f32::MAX, f32::MAX)
}

#[cfg(test)]
mod tests {
    use super::super::parse::parse;
    use super::*;
    use crate::load::Limits;
    use crate::load::limits::Budget;

    fn of(text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<&'static str>) {
        let (material, warnings) = read(text, mode, maps);
        (material, warnings.iter().map(|w| w.code).collect())
    }

    fn read(text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<Diagnostic>) {
        read_of("", text, mode, maps)
    }

    fn read_of(comment: &str, text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<Diagnostic>) {
        let mut warnings = Warnings::default();
        let (text, file) = (format!("newmtl m\n{text}"), Path::new("m.mtl"));
        let mut budget = Budget::new(&Limits::default());
        let mtl = parse(text.as_bytes(), file, &mut budget, &mut warnings).remove(0);
        let has_map = |slot| maps.contains(&slot);
        let mut meaning = Meaning {
            mtl: &mtl,
            mode,
            writer: Writer::of(comment.as_bytes()),
            file: Path::new("m.mtl"),
            warnings: &mut warnings,
            has_map: &has_map,
            all_invisible: false,
        };
        let material = meaning.material();
        (material, warnings.into_vec())
    }

    /// A material in a file that begins with a comment.
    fn guess_of(comment: &str, text: &str, maps: &[Slot]) -> (Material, Vec<&'static str>) {
        let (material, warnings) = read_of(comment, text, MtlMode::Guess, maps);
        (material, warnings.iter().map(|w| w.code).collect())
    }

    fn guess(text: &str) -> (Material, Vec<&'static str>) {
        of(text, MtlMode::Guess, &[])
    }

    fn literal(text: &str) -> Material {
        of(text, MtlMode::Literal, &[]).0
    }

    fn phong(material: &Material) -> &Phong {
        match &material.reflection {
            Reflection::Phong(phong) => phong,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn a_plain_diffuse_material_is_phong_seen_from_both_sides() {
        let (m, warnings) = guess("Kd 0.5 0.25 0\nillum 1\nKs 1 1 1\nNs 10");
        assert_eq!((m.base_color, m.opacity, m.alpha_mode), (Vec3::new(0.5, 0.25, 0.0), 1.0, AlphaMode::Opaque));
        assert!(m.double_sided && warnings.is_empty());
        let p = phong(&m);
        assert_eq!(
            (p.ambient, p.specular, p.mirror, p.transmission),
            (m.base_color, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO)
        );
    }

    #[test]
    fn ambient_is_guessed_from_the_diffuse_color_and_literal_is_ka() {
        let (m, warnings) = guess("Ka 1 1 1\nKd 0.5 0 0");
        assert_eq!((phong(&m).ambient, warnings), (Vec3::new(0.5, 0.0, 0.0), vec!["mtl-ambient"]));
        assert_eq!(phong(&literal("Ka 1 1 1\nKd 0.5 0 0")).ambient, Vec3::ONE);
    }

    #[test]
    fn dissolve_blends_unless_illum_or_a_filter_makes_it_glass() {
        let (m, warnings) = guess("Kd 1 1 1\nd 0.25\nillum 2");
        assert_eq!((m.opacity, m.alpha_mode, warnings.len()), (0.25, AlphaMode::Blend, 0));
        assert_eq!(phong(&m).transmission, Vec3::ZERO);

        let (m, _) = guess("Kd 1 1 1\nd 0.25\nillum 6\nNi 1.52\nKs 0.1 0.1 0.1\nNs 9");
        assert_eq!((m.opacity, m.alpha_mode, m.base_color), (1.0, AlphaMode::Opaque, Vec3::splat(0.25)));
        let p = phong(&m);
        assert_eq!((p.transmission, p.mirror, p.ior, p.fresnel), (Vec3::splat(0.75), Vec3::splat(0.1), 1.52, false));

        let (m, _) = guess("Kd 0 0 0\nTf 1 0.5 0\nillum 2\nNi 1.5");
        assert_eq!(phong(&m).transmission, Vec3::new(1.0, 0.5, 0.0));
        assert_eq!(phong(&m).mirror, Vec3::ZERO);
        let (m, warnings) = guess("Kd 0 0 0\nTf 1 0.5 0\nillum 7\nd 0.5");
        assert_eq!((phong(&m).transmission, phong(&m).ior), (Vec3::new(0.5, 0.25, 0.0), 1.5));
        assert_eq!(warnings, ["mtl-no-ior"]);
    }

    #[test]
    fn opaque_filters_of_careless_exporters_make_no_glass() {
        for text in ["Kd 1 1 1\nTf 1 1 1\nillum 2", "Kd 1 1 1\nTf 0 0 0\nillum 2", "Kd 1 1 1\nd 1\nTr 0\nillum 4"] {
            assert_eq!(phong(&guess(text).0).transmission, Vec3::ZERO, "{text}");
        }
        for text in ["Kd 1 1 1\nTf 0.588 0.588 0.588\nd 1\nillum 2", "Kd 1 1 1\nTf 0.5 0.5 0.5\nTr 0\nillum 2"] {
            assert_eq!(phong(&guess(text).0).transmission, Vec3::ZERO, "{text}");
            assert_eq!(phong(&literal(text)).transmission, Vec3::ZERO, "{text}");
        }
        assert_ne!(phong(&guess("Kd 1 1 1\nTf 0.5 0.5 0.5\nd 1\nillum 6").0).transmission, Vec3::ZERO);
        assert_eq!(guess("Kd 1 1 1\nKs 1\nNs 9\nillum 7").1, ["mtl-opaque-glass"]);
        assert_ne!(phong(&literal("Kd 1 1 1\nillum 7\nTf 0.5")).transmission, Vec3::ZERO);
    }

    #[test]
    fn only_illum_and_specular_together_make_a_mirror() {
        let mirror = |illum: i32, ks: f64| {
            let (m, warnings) = guess(&format!("Kd 0 0 0\nKs {ks} {ks} {ks}\nNs 50\nillum {illum}"));
            (phong(&m).mirror, phong(&m).fresnel, warnings)
        };
        assert_eq!(mirror(2, 1.0), (Vec3::ZERO, false, vec![]));
        assert_eq!(mirror(3, 0.5), (Vec3::splat(0.5), false, vec![]));
        assert_eq!(mirror(5, 0.5), (Vec3::splat(0.5), true, vec![]));
        assert_eq!(mirror(8, 0.5), (Vec3::splat(0.5), false, vec![]));
        assert_eq!(mirror(3, 0.0), (Vec3::ZERO, false, vec!["mtl-black-mirror"]));
    }

    #[test]
    fn tr_is_the_rest_of_d_and_d_wins() {
        assert_eq!(guess("Kd 1\nTr 0.25").0.opacity, 0.75);
        let (m, warnings) = guess("Kd 1\nd 0.75\nTr 0.5");
        assert_eq!((m.opacity, warnings), (0.75, vec!["mtl-tr-contradicts-d"]));
        let (m, warnings) = guess("Kd 1\nTr 1");
        assert_eq!((m.opacity, warnings), (1.0, vec!["mtl-tr-as-opacity"]));
        assert_eq!(literal("Kd 1\nTr 1").opacity, 0.0);
    }

    #[test]
    fn parts_outside_of_0_to_1_are_told_and_the_nearest_counts() {
        let (m, warnings) = guess("Kd 1\nd -1");
        assert_eq!((m.opacity, warnings), (0.0, vec!["mtl-range"]));
        assert_eq!(guess("Kd 1\nd 0").1, ["mtl-unseen"]);
        let (m, warnings) = guess("Kd 1\nPm 5\nPr 0.5");
        assert_eq!((m.metal_rough().unwrap().metallic, warnings), (1.0, vec!["mtl-range"]));
        assert!(guess("Kd 1\nPm 1\nPr 0\nd 1").1.is_empty());
        // Colours stay as they are: light may be brighter than white.
        let (m, warnings) = guess("Kd 1.5 1 0\nKe 4 4 4");
        assert_eq!((m.base_color, warnings), (Vec3::new(1.5, 1.0, 0.0), vec!["mtl-range"]));
        assert_eq!(guess("Kd 2.5 2.5 2.5").0.base_color, Vec3::splat(2.5));
        assert_eq!(literal("Kd 255 128 0").base_color, Vec3::new(255.0, 128.0, 0.0));
        let (m, warnings) = guess("Kd 255 128 0");
        assert_eq!(warnings, ["mtl-color-bytes"]);
        assert!((m.base_color - Vec3::new(1.0, 0.2158605, 0.0)).abs().max_element() < 1e-5, "{}", m.base_color);
        let (m, warnings) = guess("Kd 1 -1 0.5\nKe 0 -2 0");
        assert_eq!((m.base_color, m.emission), (Vec3::new(1.0, 0.0, 0.5), Vec3::ZERO));
        assert_eq!(warnings, ["mtl-range"; 2]);
    }

    #[test]
    fn black_under_a_map_is_white_and_under_a_lost_one_grey() {
        let (m, warnings) = of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]);
        assert_eq!((m.base_color, warnings), (Vec3::ONE, vec!["mtl-black-under-map"]));
        let (m, _) = of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Guess, &[]);
        assert_eq!(m.base_color, Vec3::splat(NO_DIFFUSE));
        assert_eq!(of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Literal, &[Slot::Diffuse]).0.base_color, Vec3::ZERO);
        assert_eq!(of("Ke 0 0 0\nKd 1\nmap_Ke a.png", MtlMode::Guess, &[Slot::Emission]).0.emission, Vec3::ONE);
        assert_eq!(of("map_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]).0.base_color, Vec3::ONE);
        assert_eq!(guess("Ns 1").1, ["mtl-no-diffuse"]);
    }

    #[test]
    fn what_programs_write_of_everything_makes_no_mirrors_and_no_glass() {
        // Maya, Cinema 4D, VTK.
        for (comment, text, told) in [
            ("", "illum 4\nKd .5 .5 .5\nKa 0 0 0\nTf 1 1 1\nNi 1\nKs .5 .5 .5\nNs 18", "mtl-opaque-glass"),
            ("", "illum 7\nKd .8 .8 .8\nKa 0 0 0\nKs 1 1 1\nNs 43", "mtl-opaque-glass"),
            ("# by the Visualization Toolkit", "Kd 1 0 0\nKs 1 1 1\nNs 9\nillum 3", "mtl-illum-of-writer"),
        ] {
            let (m, warnings) = guess_of(comment, text, &[]);
            assert!(warnings.contains(&told), "{text}: {warnings:?}");
            let p = phong(&m);
            assert_eq!((p.mirror, p.transmission), (Vec3::ZERO, Vec3::ZERO), "{text}");
            assert!(p.specular != Vec3::ZERO, "{text}");
        }
        assert_eq!(phong(&literal("Kd 1\nKs 1\nNs 9\nillum 7")).mirror, Vec3::ONE);

        let (m, warnings) = guess_of("# VTK, the Visualization Toolkit", "Kd 1 0 0\nTr 0.2", &[]);
        assert_eq!((m.opacity, warnings), (0.2, vec!["mtl-tr-as-opacity"]));
        assert_eq!(guess_of("# VTK, the Visualization Toolkit", "Kd 1 0 0\nTr 1", &[]).0.opacity, 1.0);
        // 3ds Max writes opacity as Tf, too.
        let (m, warnings) = guess("Kd .26 .26 .26\nNi 1.5\nd 0.1\nTr 0.9\nTf 0.1 0.1 0.1\nillum 2");
        assert_eq!((m.opacity, m.alpha_mode, warnings), (0.1, AlphaMode::Blend, vec!["mtl-filter-is-opacity"]));
        assert_eq!(phong(&m).transmission, Vec3::ZERO);
    }

    #[test]
    fn metals_of_blender_are_metals() {
        let text = "Ns 10\nKa 1 1 1\nKd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nNi 1.5\nd 1\nillum 3";
        let (m, warnings) = guess_of("# Blender 3.3.0 MTL File: 'a.blend'", text, &[]);
        let metal = m.metal_rough().unwrap();
        assert_eq!((metal.metallic, metal.roughness, warnings), (1.0, 0.9, vec!["mtl-illum-of-writer"]));
        assert!(matches!(guess_of("# another", text, &[]).0.reflection, Reflection::Phong(_)));
    }

    #[test]
    fn maps_take_the_place_of_colors_where_they_did_in_the_program_that_wrote_them() {
        let of = |comment: &str, text: &str| guess_of(comment, text, &[Slot::Diffuse]);
        for comment in ["# 3ds Max Wavefront OBJ Exporter", "# Blender MTL File: 'a'", "# Created with AliceVision"] {
            let (m, warnings) = of(comment, "Kd 0.588 0.588 0.588\nmap_Kd a.png");
            assert_eq!((m.base_color, warnings), (Vec3::ONE, vec!["mtl-color-under-map"]), "{comment}");
            assert_eq!(of(comment, "Kd 1 1 1\nmap_Kd a.png").1.len(), 0);
        }
        assert_eq!(of("", "Kd 0.5 0.5 0.5\nmap_Kd a.png").0.base_color, Vec3::splat(0.5));
    }

    #[test]
    fn materials_of_which_nothing_is_known_are_grey() {
        let unknown = "illum 4\nKd 0.00 0.00 0.00\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 0.00";
        let (m, warnings) = guess(unknown);
        assert_eq!(m.base_color, Vec3::splat(NO_DIFFUSE));
        assert!(warnings.contains(&"mtl-no-diffuse"), "{warnings:?}");
        assert_eq!(literal(unknown).base_color, Vec3::ZERO);
        // Black that somebody chose.
        assert_eq!(guess("Kd 0 0 0\nNi 1").0.base_color, Vec3::ZERO);
        assert_eq!(of("Kd 0.5 0.5 0.5\nd 0\nmap_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]).0.opacity, 1.0);
    }

    #[test]
    fn a_highlight_without_width_is_none_and_without_exponent_satin() {
        let (m, warnings) = guess("Kd 1\nKs 1\nNs 0\nillum 2");
        assert_eq!((phong(&m).specular, warnings), (Vec3::ZERO, vec!["mtl-flat-highlight"]));
        let told = read("Kd 1\nKs 1\nNs -3", MtlMode::Guess, &[]).1.remove(0).text;
        assert!(told.starts_with("Ns -3 would spread the highlight"), "{told}");
        assert_eq!(guess("Kd 1\nKs 1\nNs 0.2\nillum 2").1, ["mtl-flat-highlight"]);
        let (m, warnings) = guess("Kd 1\nKs 1");
        assert_eq!((phong(&m).shininess, warnings), (32.0, vec!["mtl-no-shininess"]));
        assert_eq!(phong(&literal("Kd 1\nKs 1\nNs 0")).shininess, 0.0);
    }

    #[test]
    fn physical_fields_make_a_metal_rough_material() {
        let (m, warnings) = guess("Kd 1 0 0\nPr 0.25\nPm 0.75\nNi 1.45\nKs 0.5 0.5 0.5");
        let Reflection::MetalRough(s) = &m.reflection else { panic!() };
        assert_eq!((s.roughness, s.metallic, s.ior, s.transmission), (0.25, 0.75, 1.45, 0.0));
        assert!(warnings.is_empty());
        let (m, _) = guess("Kd 1 1 1\nPr 0\nd 0.1\nillum 9\nNi 1.5");
        let Reflection::MetalRough(s) = &m.reflection else { panic!() };
        assert!((s.transmission - 0.9).abs() < 1e-6 && s.thick && m.base_color == Vec3::ONE);
        let (m, _) = guess("Kd 1\nPm 1\nNs 98");
        let Reflection::MetalRough(s) = &m.reflection else { panic!() };
        assert!((s.roughness - 0.02f32.sqrt().sqrt()).abs() < 1e-6);
    }

    #[test]
    fn illum_0_is_constant_only_literally() {
        assert!(matches!(literal("Kd 1\nillum 0").reflection, Reflection::Unlit));
        assert_eq!(guess("Kd 1\nillum 0").1, ["mtl-constant"]);
    }

    #[test]
    fn sheen_clear_coat_and_anisotropy_are_drawn() {
        let (material, warnings) = guess("Kd 1 1 1\nPr 0.2\nPs 0.4\nPc 0.5\nPcr 0.6\naniso 0.7\nanisor 0.25");
        let Reflection::MetalRough(m) = &material.reflection else { panic!("physically based") };
        let (sheen, coat, grain) = (m.sheen.as_ref().unwrap(), m.coat.as_ref().unwrap(), m.grain.as_ref().unwrap());
        assert_eq!((sheen.color, coat.strength, coat.roughness), (Vec3::splat(0.4), 0.5, 0.6));
        assert_eq!((grain.strength, grain.rotation), (0.7, std::f32::consts::FRAC_PI_2));
        assert!(warnings.is_empty(), "{warnings:?}");
        let (plain, _) = guess("Pr 0.2\nPs 0\nPc 0\nPcr 0.03\naniso 0\nanisor 0");
        let Reflection::MetalRough(m) = &plain.reflection else { panic!("physically based") };
        assert!(!m.has_lobes(), "exporters write zeros for what a material does not have");
    }
}
