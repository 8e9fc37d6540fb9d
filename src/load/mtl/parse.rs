//! MTL text -> materials as written, before they are interpreted.

use super::options::{self, Map};
use crate::load::limits::{Budget, OverBudget};
use crate::load::number;
use crate::load::paths::shorten;
use crate::load::text::encoding::{decode_name, to_ascii_superset};
use crate::load::text::lines::{Lines, keyword, words};
use crate::load::{Diagnostic, Warnings};
use crate::math::DVec3;
use crate::math::primaries::rec_709_of_xyz;
use std::mem::size_of;
use std::path::Path;

/// A material as written; `None`: not given.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Mtl {
    pub name: String,
    /// Line of its `newmtl`.
    pub line: u32,
    pub ka: Option<[f64; 3]>,
    pub kd: Option<[f64; 3]>,
    pub ks: Option<[f64; 3]>,
    pub ke: Option<[f64; 3]>,
    pub tf: Option<[f64; 3]>,
    pub ns: Option<f64>,
    pub ni: Option<f64>,
    pub d: Option<f64>,
    pub tr: Option<f64>,
    pub illum: Option<i32>,
    pub pr: Option<f64>,
    pub pm: Option<f64>,
    /// Sheen `ps`, clear coat `pc` and its roughness `pcr`, anisotropy and its rotation (1: a full turn).
    pub ps: Option<f64>,
    pub pc: Option<f64>,
    pub pcr: Option<f64>,
    pub aniso: Option<f64>,
    pub anisor: Option<f64>,
    pub maps: Vec<(Slot, Map)>,
    /// Line of the reflection map.
    pub refl: Option<u32>,
}

/// Property that a map controls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    Ambient,
    Diffuse,
    Specular,
    Emission,
    Shininess,
    Dissolve,
    Transparency,
    Bump,
    Displacement,
    Normal,
    Roughness,
    Metallic,
    /// Occlusion in red, roughness in green, metallic in blue.
    OcclusionRoughMetal,
    /// Roughness in red, metallic in green, occlusion in blue.
    RoughMetalOcclusion,
    Occlusion,
    Sheen,
    Coat,
    CoatRoughness,
    Anisotropy,
    AnisotropyRotation,
}

/// Map statements, in lower case.
const MAPS: [(&[u8], Slot); 32] = [
    (b"map_ka", Slot::Ambient),
    (b"map_kd", Slot::Diffuse),
    (b"map_ks", Slot::Specular),
    (b"map_ke", Slot::Emission),
    (b"map_ns", Slot::Shininess),
    (b"map_d", Slot::Dissolve),
    (b"map_opacity", Slot::Dissolve),
    (b"map_tr", Slot::Transparency),
    (b"map_bump", Slot::Bump),
    (b"bump", Slot::Bump),
    (b"disp", Slot::Displacement),
    (b"map_disp", Slot::Displacement),
    (b"norm", Slot::Normal),
    (b"map_norm", Slot::Normal),
    (b"map_normal", Slot::Normal),
    (b"map_kn", Slot::Normal),
    (b"normal", Slot::Normal),
    (b"map_tangentspacenormal", Slot::Normal),
    (b"map_pr", Slot::Roughness),
    (b"map_roughness", Slot::Roughness),
    (b"map_pm", Slot::Metallic),
    (b"map_metallic", Slot::Metallic),
    (b"map_ao", Slot::Occlusion),
    (b"map_ambientocclusion", Slot::Occlusion),
    (b"map_occlusion", Slot::Occlusion),
    (b"map_orm", Slot::OcclusionRoughMetal),
    (b"map_rma", Slot::RoughMetalOcclusion),
    (b"map_ps", Slot::Sheen),
    (b"map_pc", Slot::Coat),
    (b"map_pcr", Slot::CoatRoughness),
    (b"map_aniso", Slot::Anisotropy),
    (b"map_anisor", Slot::AnisotropyRotation),
];

/// Diagnostic for a decal: procedures of one program, not a picture, decide what it shows.
const DECAL: (&str, &str) = ("a decal (decal) is not drawn", "paint it into map_Kd");

/// Diagnostic for a reflection map: a picture of the surroundings for one material alone, without the objects of the scene. Here
/// mirrors reflect the scene, and `--env` surrounds all of it.
const REFLECTED: (&str, &str) =
    ("a reflection map (refl) is not drawn", "mirrors see the scene; --env puts a picture around it");

/// Statements that do not affect the rendering and cause no warning.
const SILENT: [&[u8]; 5] = [b"sharpness", b"map_aat", b"km", b"ke_strength", b"interpolatemode"];

impl Mtl {
    /// Returns whether two materials are equal except for line numbers.
    pub(super) fn is_like(&self, other: &Self) -> bool {
        let placeless = |mtl: &Self| {
            let maps = mtl.maps.iter().map(|(slot, map)| (*slot, Map { line: 0, ..map.clone() }));
            Self { line: 0, refl: mtl.refl.map(|_| 0), maps: maps.collect(), ..mtl.clone() }
        };
        placeless(self) == placeless(other)
    }

    /// Returns the last map of a slot.
    pub(super) fn map(&self, slot: Slot) -> Option<&Map> {
        self.maps.iter().rev().find(|(s, _)| *s == slot).map(|(_, map)| map)
    }

    /// Turns the ambient map into the diffuse map where there is none; returns its line.
    pub(super) fn take_ambient_map(&mut self) -> Option<u32> {
        if self.map(Slot::Diffuse).is_some() {
            return None;
        }
        let (slot, map) = self.maps.iter_mut().rfind(|(slot, _)| *slot == Slot::Ambient)?;
        *slot = Slot::Diffuse;
        Some(map.line)
    }

    /// Returns whether the specular colour, which scales reflections, is not black.
    fn is_shiny(&self) -> bool {
        self.ks.is_some_and(|ks| ks.iter().any(|&c| c > 0.0)) || self.map(Slot::Specular).is_some()
    }

    /// Returns whether the material has a field or map of physically based rendering. A normal map says nothing about roughness
    /// or metal and does not count.
    pub(super) fn is_physical(&self) -> bool {
        /// Maps that only physically based materials have.
        const MAPS: [Slot; 9] = [
            Slot::Roughness,
            Slot::Metallic,
            Slot::OcclusionRoughMetal,
            Slot::RoughMetalOcclusion,
            Slot::Sheen,
            Slot::Coat,
            Slot::CoatRoughness,
            Slot::Anisotropy,
            Slot::AnisotropyRotation,
        ];
        [self.pr, self.pm, self.ps, self.pc, self.pcr, self.aniso, self.anisor].iter().any(Option::is_some)
            || MAPS.iter().any(|&slot| self.map(slot).is_some())
    }
}

/// Parses all materials of `text`; unreadable statements cost a warning about `file`, and so do materials that would exceed the
/// rest of `budget`, which are left out.
pub(super) fn parse(text: &[u8], file: &Path, budget: &mut Budget, warnings: &mut Warnings) -> Vec<Mtl> {
    let mut parser = Parser { file, line: 1, warnings };
    let mut out: Vec<Mtl> = Vec::new();
    if let Err(over) = budget.take(text.len() as u64, 1) {
        parser.cut_off(over);
        return out;
    }
    let text = to_ascii_superset(text);
    let mut lines = Lines::new(&text);
    while let Some((line, text)) = lines.next() {
        let (word, rest) = keyword(text);
        parser.line = line;
        if let Err(over) = budget.take(memory(word, rest), 1) {
            parser.cut_off(over);
            break;
        }
        if word.eq_ignore_ascii_case(b"newmtl") {
            out.push(Mtl { name: decode_name(rest), line, ..Mtl::default() });
        } else if !word.is_empty()
            && !word.starts_with(b"#")
            && let Some(material) = out.last_mut()
        {
            parser.field(material, &word.to_ascii_lowercase(), rest);
        }
    }
    for material in &out {
        if let Some(line) = material.refl.filter(|_| material.is_shiny()) {
            parser.line = line;
            parser.not_drawn(REFLECTED);
        }
    }
    out
}

/// Upper bound of the memory that a statement takes, in bytes.
fn memory(word: &[u8], rest: &[u8]) -> u64 {
    /// A material in a list that has grown by doubling, with its entries in the tables of names.
    const MATERIAL: u64 = 2 * size_of::<Mtl>() as u64 + 2 * 96;
    /// A map, likewise, with the table entries of its picture.
    const MAP: u64 = 2 * size_of::<(Slot, Map)>() as u64 + 4 * 96;
    let text = 4 * rest.len() as u64;
    if word.eq_ignore_ascii_case(b"newmtl") {
        MATERIAL + text
    } else if MAPS.iter().any(|(name, _)| word.eq_ignore_ascii_case(name)) {
        MAP + text
    } else {
        0
    }
}

struct Parser<'a> {
    file: &'a Path,
    line: u32,
    warnings: &'a mut Warnings,
}

impl Parser<'_> {
    fn field(&mut self, m: &mut Mtl, word: &[u8], rest: &[u8]) {
        match word {
            b"ka" => m.ka = self.color(rest).or(m.ka),
            b"kd" => m.kd = self.color(rest).or(m.kd),
            b"ks" => m.ks = self.color(rest).or(m.ks),
            b"ke" => m.ke = self.color(rest).or(m.ke),
            b"tf" | b"kt" => m.tf = self.color(rest).or(m.tf),
            b"ns" => m.ns = self.number(rest).or(m.ns),
            b"ni" => m.ni = self.number(rest).or(m.ni),
            b"d" => m.d = self.dissolve(rest).or(m.d),
            b"tr" => m.tr = self.number(rest).or(m.tr),
            #[expect(clippy::cast_possible_truncation, reason = "saturates")]
            b"illum" => m.illum = self.number(rest).map(|n| n as i32).or(m.illum),
            b"pr" => m.pr = self.number(rest).or(m.pr),
            b"pm" => m.pm = self.number(rest).or(m.pm),
            b"ps" => m.ps = self.number(rest).or(m.ps),
            b"pc" => m.pc = self.number(rest).or(m.pc),
            b"pcr" => m.pcr = self.number(rest).or(m.pcr),
            b"aniso" => m.aniso = self.number(rest).or(m.aniso),
            b"anisor" => m.anisor = self.number(rest).or(m.anisor),
            _ if SILENT.contains(&word) => {}
            _ => self.map_or_unknown(m, word, rest),
        }
    }

    fn map_or_unknown(&mut self, m: &mut Mtl, word: &[u8], rest: &[u8]) {
        // Exporters write zeros for maps that a material does not have.
        let zero = words(rest).next().and_then(|w| number::check(w).word.parse::<f64>().ok()) == Some(0.0);
        if let Some((_, slot)) = MAPS.iter().find(|(name, _)| *name == word) {
            if zero && words(rest).count() == 1 {
                return;
            }
            match options::parse(rest, self.line) {
                Some(map) => {
                    for option in &map.ignored {
                        self.warn("mtl-map-option", format!("the option '{option}' of a map is ignored"));
                    }
                    m.maps.push((*slot, map));
                }
                None => self.warn("mtl-map-without-file", format!("'{}' names no file", decode_name(word))),
            }
            return;
        }
        match word {
            b"refl" | b"map_refl" | b"decal" if zero => {}
            b"refl" | b"map_refl" => m.refl = Some(self.line),
            b"decal" => self.not_drawn(DECAL),
            _ => {
                self.warn("mtl-unknown-statement", format!("'{}' is not an MTL statement", shorten(&decode_name(word))))
            }
        }
    }

    fn cut_off(&mut self, over: OverBudget) {
        let text = format!("the materials from here on are left out: {over}");
        self.warnings.push(Diagnostic::over_memory(self.file, self.line.to_string(), text));
    }

    fn not_drawn(&mut self, (what, instead): (&'static str, &'static str)) {
        let warning = Diagnostic::new("mtl-unsupported", self.file, self.line.to_string(), what.to_string());
        self.warnings.push(warning.remedy(instead));
    }

    /// Parses `r [g b]`, `xyz x [y z]` or `spectral file [factor]`.
    fn color(&mut self, rest: &[u8]) -> Option<[f64; 3]> {
        let mut words = words(rest).peekable();
        let kind = words.next_if(|w| matches!(*w, b"spectral" | b"xyz"));
        if kind == Some(b"spectral") {
            self.warn("mtl-spectral", "a spectral curve (.rfl) is not read; the colour counts as not given".into());
            return None;
        }
        let given: Vec<&[u8]> = words.take(3).collect();
        let numbers: Vec<f64> = given.iter().map_while(|w| number::check(w).word.parse().ok()).collect();
        let first = numbers.first().copied().filter(|n| n.is_finite());
        let Some(first) = first else {
            self.warn("mtl-bad-number", format!("'{}' is not a colour", shorten(&decode_name(rest))));
            return None;
        };
        let or_first = |i: usize| numbers.get(i).copied().filter(|n| n.is_finite()).unwrap_or(first);
        let color = [first, or_first(1), or_first(2)];
        let is_odd = given.iter().any(|w| number::check(w).odd) || numbers.iter().any(|n| !n.is_finite());
        if is_odd || given.len() == 2 || numbers.len() < given.len() {
            let text = shorten(&decode_name(rest));
            self.warn(
                "mtl-bad-number",
                format!("'{text}' is not a colour; it counts as {first} {} {}", color[1], color[2]),
            );
        }
        if kind.is_some() {
            self.warn("mtl-xyz", "a CIE XYZ colour is converted to Rec. 709".into());
            // Colours out of gamut are clipped.
            return Some(rec_709_of_xyz(color.into()).max(DVec3::ZERO).to_array());
        }
        Some(color)
    }

    fn number(&mut self, rest: &[u8]) -> Option<f64> {
        let word = words(rest).next().map(number::check);
        let value = word.as_ref().and_then(|w| w.word.parse().ok()).filter(|n: &f64| n.is_finite());
        let text = || shorten(&decode_name(rest)).to_string();
        match value {
            None => self.warn("mtl-bad-number", format!("'{}' is not a number", text())),
            Some(read) if word.is_some_and(|w| w.odd) => {
                self.warn("mtl-bad-number", format!("'{}' is not a number; it counts as {read}", text()));
            }
            Some(_) => {}
        }
        value
    }

    /// Parses `factor`, or `-halo factor`, which fades towards the silhouette.
    fn dissolve(&mut self, rest: &[u8]) -> Option<f64> {
        match rest.strip_prefix(b"-halo") {
            Some(rest) => {
                self.warn("mtl-halo", "'d -halo' is drawn without its halo".into());
                self.number(rest)
            }
            None => self.number(rest),
        }
    }

    fn warn(&mut self, code: &'static str, text: String) {
        self.warnings.push(Diagnostic::new(code, self.file, self.line.to_string(), text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::Limits;

    fn of(text: &str) -> (Vec<Mtl>, Vec<Diagnostic>) {
        within(text, &mut Budget::new(&Limits::default()))
    }

    fn within(text: &str, budget: &mut Budget) -> (Vec<Mtl>, Vec<Diagnostic>) {
        let mut warnings = Warnings::default();
        (parse(text.as_bytes(), Path::new("m.mtl"), budget, &mut warnings), warnings.into_vec())
    }

    #[test]
    fn materials_over_the_budget_are_left_out_with_a_warning() {
        let materials: String = (0..1000).map(|i| format!("newmtl a{i}\nKd 1 0 0\n")).collect();
        let maps = format!("newmtl a\n{}", "map_Kd a.png\n".repeat(1000));
        for (text, left) in [(materials, 999), (maps, 1)] {
            let mut budget = Budget::new(&Limits { memory: 200_000, ..Limits::default() });
            let (read, warnings) = within(&text, &mut budget);
            assert!(!read.is_empty() && read.len() <= left, "{}", read.len());
            let told = warnings[0].to_string();
            assert!(told.contains("are left out: ") && told.ends_with("raise --max-memory"), "{told}");
            assert!(within(&text, &mut Budget::new(&Limits::default())).1.is_empty());
        }
    }

    #[test]
    fn every_number_is_read_whatever_the_case_of_its_name() {
        let text = "newmtl a b\n\tKa .1 .2 .3 # c\nkd 0.5\nKS 1 0 1\nNs 10\nNI 1.5\nd 0.5\nTr 0.25\nillum 7\nTf 1 1 0\nPr .1\nPm 1";
        let (materials, warnings) = of(text);
        let m = &materials[0];
        assert_eq!((m.name.as_str(), m.line), ("a b", 1));
        assert_eq!((m.ka, m.kd, m.ks), (Some([0.1, 0.2, 0.3]), Some([0.5; 3]), Some([1.0, 0.0, 1.0])));
        assert_eq!((m.ns, m.ni, m.d, m.tr, m.illum), (Some(10.0), Some(1.5), Some(0.5), Some(0.25), Some(7)));
        assert_eq!((m.tf, m.pr, m.pm), (Some([1.0, 1.0, 0.0]), Some(0.1), Some(1.0)));
        assert!(m.is_physical() && warnings.is_empty(), "{warnings:?}");
    }

    #[test]
    fn what_cannot_be_read_or_drawn_is_a_counted_warning_and_nothing_else() {
        let text = "Kd 9 9 9\nnewmtl a\nKd spectral x.rfl 1\nKs xyz 0.9505 1 1.089\nNs x\nd -halo 0.5\nmap_Kd\nfoo 1\nfoo 2\n\
                    refl -type sphere a.png\nmap_Ps 0\ndisp 0\ndecal a.png\nmap_Ks -cc on a.png";
        let (materials, warnings) = of(text);
        let m = &materials[0];
        assert_eq!((m.kd, m.ns, m.d, m.is_physical()), (None, None, Some(0.5), false));
        assert!(m.ks.unwrap().iter().all(|c| (c - 1.0).abs() < 1e-3), "{:?}", m.ks);
        let codes: Vec<_> = warnings.iter().map(|w| (w.code, w.count)).collect();
        assert_eq!(
            codes,
            [
                ("mtl-spectral", 1),
                ("mtl-xyz", 1),
                ("mtl-bad-number", 1),
                ("mtl-halo", 1),
                ("mtl-map-without-file", 1),
                ("mtl-unknown-statement", 2),
                ("mtl-unsupported", 1),
                ("mtl-map-option", 1),
                ("mtl-unsupported", 1),
            ]
        );
    }

    #[test]
    fn a_reflection_map_is_missed_only_where_something_reflects() {
        let codes = |ks: &str| of(&format!("newmtl a\nrefl -type sphere a.png\n{ks}")).1.len();
        assert_eq!([codes(""), codes("Ks 0 0 0"), codes("Ks 0 .5 0"), codes("map_Ks a.png")], [0, 0, 1, 1]);
    }

    #[test]
    fn maps_go_to_their_slots_and_the_last_one_counts() {
        let (materials, _) = of("newmtl a\nmap_Kd 1.png\nMap_KD 2.png\nbump -bm 2 b.png\nnorm n.png\nmap_d d.png");
        let m = &materials[0];
        assert_eq!(m.map(Slot::Diffuse).unwrap().file, "2.png");
        assert_eq!(m.map(Slot::Bump).unwrap().bump, Some(2.0));
        assert!(m.map(Slot::Normal).is_some() && m.map(Slot::Dissolve).is_some() && !m.is_physical());
    }
}
