//! Vertex colours -> linear.

use crate::math::Vec4;

/// Linear RGBA of a vertex colour as written.
///
/// Programs that write them (scanners, sculpting and mesh repair programs) take them from 8-bit pictures and divide by
/// 255, so they are sRGB-coded, unlike the colours of MTL files.
pub(super) fn linear(color: [f32; 3]) -> Vec4 {
    let [r, g, b] = color.map(decode);
    Vec4::new(r, g, b, 1.0)
}

/// The sRGB transfer function, IEC 61966-2-1.
fn decode(coded: f32) -> f32 {
    let c = coded.clamp(0.0, 1.0);
    if c <= 0.04045 { c / 12.92 } else { libm::powf((c + 0.055) / 1.055, 2.4) }
}

/// Opacities of vertices, 0…1; none where all are opaque. Where all are 0 the fourth number means something else: nobody
/// writes a mesh that cannot be seen.
pub(super) fn opacities(colors: &[[f32; 4]]) -> Vec<f32> {
    let alphas = || colors.iter().map(|c| if c[3].is_nan() { 1.0 } else { c[3].clamp(0.0, 1.0) });
    let means_something = alphas().any(|a| a < 1.0) && alphas().any(|a| a > 0.0);
    if means_something { alphas().collect() } else { Vec::new() }
}

/// Whether colours were written as 0 … 255.
pub(super) fn are_bytes(colors: &[[f32; 3]]) -> bool {
    let all = || colors.iter().flatten();
    all().any(|&c| c > 1.5) && all().all(|&c| (0.0..=255.0).contains(&c))
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
    fn colors_above_one_are_bytes() {
        assert!(are_bytes(&[[1.0; 3], [255.0, 0.0, 128.0]]));
        assert!(!are_bytes(&[[1.0, 0.5, 0.0]]) && !are_bytes(&[[300.0, 0.0, 0.0]]));
    }
}
