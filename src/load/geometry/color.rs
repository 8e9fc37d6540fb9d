//! Vertex colours -> linear.

use crate::load::Diagnostic;
use crate::math::{Vec3, Vec4};
use crate::scene::color::from_srgb;
use std::path::Path;
use std::sync::LazyLock;

/// Linear RGBA of a vertex colour as written.
///
/// Programs that write vertex colours (scanners, sculpting and mesh repair programs) take them from 8-bit pictures and divide
/// by 255, so they are sRGB-coded, unlike the colours of MTL files. Codes of bytes, which nearly all are, are
/// looked up in a table: as exact, and much faster.
pub(in crate::load) fn linear(color: [f32; 3]) -> Vec4 {
    static OF_BYTES: LazyLock<[f32; 256]> = LazyLock::new(|| std::array::from_fn(|byte| decode(of_byte(byte))));
    let part = |code: f32| {
        let code = code.clamp(0.0, 1.0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 … 255")]
        let byte = (code * 255.0).round() as usize;
        if of_byte(byte) == code { OF_BYTES[byte] } else { decode(code) }
    };
    Vec3::from(color.map(part)).extend(1.0)
}

#[expect(clippy::cast_precision_loss, reason = "0 … 255")]
fn of_byte(byte: usize) -> f32 {
    byte as f32 / 255.0
}

fn decode(code: f32) -> f32 {
    from_srgb([code; 3]).x
}

/// Opacities of vertices, 0…1; empty where all are opaque, or [`are_all_clear`].
pub(in crate::load) fn opacities(colors: &[[f32; 4]]) -> Vec<f32> {
    let is_see_through = colors.iter().any(|c| opacity(c) < 1.0) && !are_all_clear(colors);
    if is_see_through { colors.iter().map(opacity).collect() } else { Vec::new() }
}

/// Whether all opacities are 0. Then they must mean something else: nobody writes an invisible mesh.
pub(in crate::load) fn are_all_clear(colors: &[[f32; 4]]) -> bool {
    !colors.is_empty() && colors.iter().all(|c| opacity(c) == 0.0)
}

fn opacity(color: &[f32; 4]) -> f32 {
    if color[3].is_nan() { 1.0 } else { color[3].clamp(0.0, 1.0) }
}

/// Encoding of vertex colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::load) enum Coding {
    /// 0…1.
    Units,
    /// 0…255.
    Bytes,
    /// Neither; values above 1 or below 0 are clamped when they are decoded.
    Beyond,
}

/// Normalizes colours to 0…1, and to white where they are not finite. A fourth channel, the opacity, is scaled like the
/// colours where any opacity is above 1, and else taken as 0…1.
pub(in crate::load) fn settle<const N: usize>(colors: &mut [[f32; N]]) -> Coding {
    /// Excess over full light, or below 0, that counts as rounding.
    const ROUNDED: f32 = 1e-3;
    let (bytes, mut beyond) = (are_bytes(colors), false);
    let unit = |bytes: bool| if bytes { 255.0 } else { 1.0 };
    let alphas_are_bytes = bytes && colors.iter().flat_map(|color| color.iter().skip(3)).any(|&alpha| alpha > 1.0);
    for color in colors {
        let (light, alpha) = color.split_at_mut(3.min(N));
        if light.iter().all(|c| c.is_finite()) {
            light.iter_mut().for_each(|c| *c /= unit(bytes));
        } else {
            light.fill(1.0);
        }
        alpha.iter_mut().for_each(|alpha| *alpha /= unit(alphas_are_bytes));
        beyond |= light.iter().any(|c| !(-ROUNDED..=1.0 + ROUNDED).contains(c));
    }
    match (bytes, beyond) {
        (true, _) => Coding::Bytes,
        (false, true) => Coding::Beyond,
        (false, false) => Coding::Units,
    }
}

impl Coding {
    /// Warning about colours that are not 0…1; `codes` are those for bytes and for values beyond.
    pub(in crate::load) fn warning(self, codes: [&'static str; 2], file: &Path) -> Option<Diagnostic> {
        let (code, text) = match self {
            Self::Units => return None,
            Self::Bytes => (codes[0], "colours above 1 are taken as 0 … 255"),
            Self::Beyond => (codes[1], "colours are neither 0 … 1 nor 0 … 255; they are cut to 0 … 1"),
        };
        Some(Diagnostic::new(code, file, "", text))
    }
}

/// Whether colours were written as 0 … 255: integers, or averages of integers mostly far above 1, in contrast to
/// slightly over-exposed light.
fn are_bytes<const N: usize>(colors: &[[f32; N]]) -> bool {
    /// Values above this do not occur as over-exposed light.
    const BRIGHT: f32 = 8.0;
    let all = || colors.iter().flat_map(|color| color.iter().take(3)).filter(|c| c.is_finite());
    let greatest = all().copied().fold(0.0, f32::max);
    let whole = || all().all(|c| c.fract() == 0.0);
    let mean = || all().copied().map(f64::from).sum::<f64>() / all().count().max(1) as f64;
    let is_far_above = greatest > BRIGHT && (whole() || mean() > f64::from(BRIGHT));
    is_far_above && all().all(|&c| (0.0..=255.0).contains(&c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_white_and_middle_grey_are_decoded() {
        assert_eq!(linear([0.0, 1.0, 2.0]), Vec4::new(0.0, 1.0, 1.0, 1.0));
        assert!((linear([0.5; 3]).x - 0.214_041).abs() < 1e-5);
    }

    #[test]
    fn what_is_looked_up_is_what_would_be_computed() {
        for byte in 0..=255u16 {
            let code = f32::from(byte) / 255.0;
            for code in [code, code.next_up(), code.next_down(), -code] {
                let color = linear([code, 0.3, 1.0]);
                assert_eq!(color.truncate(), from_srgb([code.clamp(0.0, 1.0), 0.3, 1.0]), "{code}");
            }
        }
        assert!(linear([f32::NAN, 0.0, 0.0]).x.is_nan());
    }

    #[test]
    fn colors_above_one_are_bytes() {
        assert!(are_bytes(&[[1.0; 3], [255.0, 0.0, 128.0]]));
        assert!(are_bytes(&[[120.5, 99.25, 30.0]]), "means of bytes");
        assert!(!are_bytes(&[[1.0, 0.5, 0.0]]) && !are_bytes(&[[300.0, 0.0, 0.0]]));
        assert!(!are_bytes(&[[0.8, 0.6, 0.4], [1.6, 1.2, 0.8]]) && !are_bytes(&[[2.0, 0.0, 0.0]]), "over-exposed");
        assert!(!are_bytes(&[[0.5, 0.25, 0.5], [12.5, 9.0, 1.0]]), "a lamp among them");
    }

    #[test]
    fn bytes_of_one_are_nearly_black_and_vertices_without_a_color_are_white() {
        let mut colors = [[1.0; 3], [f32::NAN; 3], [255.0, 51.0, 0.0]];
        assert_eq!(settle(&mut colors), Coding::Bytes);
        assert_eq!(colors, [[1.0 / 255.0; 3], [1.0; 3], [1.0, 0.2, 0.0]]);
        assert_eq!((settle(&mut colors), colors[1]), (Coding::Units, [1.0; 3]));
        let mut with_opacity = [[51.0, 0.0, 0.0, 1.0], [255.0, 0.0, 0.0, 0.5]];
        settle(&mut with_opacity);
        assert_eq!(with_opacity, [[0.2, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.5]]);
        let mut all_bytes = [[51.0, 0.0, 0.0, 255.0], [255.0, 0.0, 0.0, 51.0]];
        settle(&mut all_bytes);
        assert_eq!(all_bytes, [[0.2, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.2]]);
        for odd in [300.0, 1.2, -0.1] {
            assert_eq!(settle(&mut [[odd, 0.5, 0.5]]), Coding::Beyond, "{odd}");
        }
    }
}
