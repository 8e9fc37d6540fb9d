//! Programs that write MTL files, recognised by their comments, and the habits of each.

use super::parse::Mtl;
use crate::load::text::encoding::to_ascii_superset;
use crate::math::Vec3;
use crate::scene::color::from_srgb;

/// Program that wrote a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Writer {
    /// Unknown, or without known habits.
    #[default]
    Other,
    /// Blender. Under a map that replaces it, `Kd` is 0.8 or a former value. `illum` 3 is a metal, with the metallic factor in
    /// `Ka` and 1000 (1 − roughness)² in `Ns`; 6 and 9 are metals and others with an alpha, `d`, below 1. `Tf` beside physically
    /// based fields is the transmission, where there is any. Colours are linear.
    Blender,
    /// 3ds Max: writes the colour that a map replaces.
    Max,
    /// AliceVision's Meshroom: writes 0.6 as `Kd` under its maps.
    Meshroom,
    /// The Visualization Toolkit: writes opacity as `Tr`, and `illum` 3 for everything.
    Vtk,
}

/// Text in the comments of each program, in lower case.
const NAMES: [(&str, Writer); 5] = [
    ("# blender ", Writer::Blender),
    ("# 3ds max ", Writer::Max),
    ("guruware", Writer::Max),
    ("alicevision", Writer::Meshroom),
    ("visualization toolkit", Writer::Vtk),
];

impl Writer {
    /// Recognises the writer of a text by its leading comments.
    pub(super) fn of(text: &[u8]) -> Self {
        /// Most lines that are searched.
        const LINES: usize = 32;
        let text = to_ascii_superset(text);
        let lines = text.split(|&byte| matches!(byte, b'\n' | b'\r')).map(<[u8]>::trim_ascii).take(LINES);
        let mut comments = lines.take_while(|line| line.is_empty() || line.starts_with(b"#"));
        let known = |comment: &[u8]| {
            let comment = String::from_utf8_lossy(comment).to_lowercase();
            NAMES.iter().find(|(name, _)| comment.contains(name)).map(|&(_, writer)| writer)
        };
        comments.find_map(known).unwrap_or_default()
    }

    /// Returns whether a map replaces `Kd`, which is written nevertheless.
    pub(super) fn replaces_by_maps(self) -> bool {
        matches!(self, Self::Blender | Self::Max | Self::Meshroom)
    }
}

/// Returns whether the diffuse colours are 8-bit sRGB codes (89 of 255 is `0.349020`), picked on a screen and written
/// unconverted. They are if every component is such a code, to the last digit, and together they have so many digits that chance
/// would produce them in less than one of a hundred files.
pub(super) fn are_codes(materials: &[Mtl]) -> bool {
    /// Largest probability of chance that still counts as codes.
    const CHANCE: f64 = 1e-2;
    let mut all: Vec<f64> = materials.iter().filter_map(|mtl| mtl.kd).flatten().collect();
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    let chance = all.into_iter().map(chance_of_code).try_fold(1.0, |all, one| Some(all * one?));
    chance.is_some_and(|chance| chance < CHANCE)
}

/// Probability that a number with this many digits is an 8-bit code by chance; `None` if it is not one. Codes of 0, 1 and thirds
/// prove nothing, as people write them, too.
fn chance_of_code(number: f64) -> Option<f64> {
    const CODES: f64 = 255.0;
    /// Codes of 0, 1/3, 2/3 and 1.
    const COMMON: [f64; 4] = [0.0, 85.0, 170.0, 255.0];
    // Trailing zeros are lost, so some numbers seem to have a digit less, which only weakens the evidence.
    let written = number.to_string();
    let digits = written.split_once('.').map_or(0, |(_, places)| places.len());
    let half = 0.5 * libm::exp10(-(digits as f64));
    let code = (number * CODES).round();
    // Tolerates writers that truncate instead of rounding.
    let is_code = (0.0..=1.0).contains(&number) && (number - code / CODES).abs() <= 2.0 * half;
    is_code.then_some(if COMMON.contains(&code) { 1.0 } else { (4.0 * half * CODES).min(1.0) })
}

/// Returns whether each component of a colour is an 8-bit code.
pub(super) fn is_code(color: [f64; 3]) -> bool {
    color.into_iter().all(|part| chance_of_code(part).is_some())
}

/// Decodes an sRGB colour, each component 0…1, to linear light.
pub(super) fn light(code: [f64; 3]) -> [f64; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "colours become f32")]
    let linear: Vec3 = from_srgb(code.map(|part| part as f32));
    linear.to_array().map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_known_by_the_comments_at_the_beginning() {
        let of = |text: &str| Writer::of(text.as_bytes());
        assert_eq!(of("# Blender 4.2.1 MTL File: 'None'\n# www.blender.org\n"), Writer::Blender);
        assert_eq!(of("#\n# 3ds Max Wavefront OBJ Exporter v0.97b\n"), Writer::Max);
        assert_eq!(of("\r\n# wavefront mtl file written by the visualization toolkit\r\n"), Writer::Vtk);
        assert_eq!(of("newmtl a\n# Blender MTL File\n"), Writer::Other);
        assert_eq!(of("# made for Blender and 3ds Max\n"), Writer::Other);
        assert_eq!(of(""), Writer::Other);
    }

    #[test]
    fn colors_of_eight_bits_are_told_from_others_by_their_digits() {
        let are = |colors: &[[f64; 3]]| {
            let of = |&kd: &[f64; 3]| Mtl { kd: Some(kd), ..Mtl::default() };
            are_codes(&colors.iter().map(of).collect::<Vec<_>>())
        };
        // Written by 3ds Max, SketchUp and Tinkercad.
        assert!(are(&[[0.1098, 0.3490, 0.6941]]));
        assert!(are(&[[0.400000, 0.298039, 0.000000], [1.0, 1.0, 1.0]]));
        assert!(are(&[[0.27450980392156865, 0.7176470588235294, 0.28627450980392155]]));
        // Written by hand, in halves, by Blender, and with one component that is no code.
        assert!(!are(&[[0.8, 0.2, 0.4], [0.6, 0.6, 0.6], [0.1, 0.9, 0.0]]));
        assert!(!are(&[[0.5, 0.25, 0.125]]));
        assert!(!are(&[[0.8, 0.026241, 0.115]]));
        assert!(!are(&[[0.1098, 0.3490, 0.6941], [0.3452, 0.1, 0.1]]));
        assert!(!are(&[[0.0, 1.0, 0.0]]) && !are(&[]));
        assert!(!are(&[[0.333333, 0.666667, 0.8], [1e-6, 0.9999, 1e-300]]));
    }
}
