//! White light as a few wavelengths, for materials whose index of refraction depends on the wavelength.

use crate::math::Vec3;
use crate::math::primaries::rec_709_of_xyz;

/// Number of parts that white light is split into.
pub(crate) const BANDS: u8 = 12;

/// One band of white light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Band {
    /// Wavelength, nanometres.
    pub wavelength: f32,
    /// Linear colour; those of all bands sum to white.
    pub color: Vec3,
}

/// Bands of the visible spectrum, 400 to 680 nm, in equal steps.
///
/// Colours are the CIE 1931 matching functions (the fits of C. Wyman, P.-P. Sloan, P. Shirley, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", 2013) in Rec. 709, cut at zero because no screen shows pure
/// wavelengths, and scaled so that together they are white again.
pub(crate) fn bands() -> Vec<Band> {
    let (from, to) = (400.0, 680.0);
    let wavelength = |i: u8| from + (to - from) * (f32::from(i) + 0.5) / f32::from(BANDS);
    let mut bands: Vec<Band> =
        (0..BANDS).map(|i| Band { wavelength: wavelength(i), color: rgb(wavelength(i)) }).collect();
    let sum: Vec3 = bands.iter().map(|b| b.color).sum();
    bands.iter_mut().for_each(|b| b.color /= sum);
    bands
}

fn rgb(wavelength: f32) -> Vec3 {
    let lobe = |height: f32, middle: f32, left: f32, right: f32| {
        let t = (wavelength - middle) / if wavelength < middle { left } else { right };
        height * libm::expf(-0.5 * t * t)
    };
    let x = lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2);
    let y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1);
    let z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8);
    rec_709_of_xyz(Vec3::new(x, y, z).as_dvec3()).as_vec3().max(Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bands_together_are_white() {
        let sum: Vec3 = bands().iter().map(|b| b.color).sum();
        assert!((sum - Vec3::ONE).length() < 1e-5);
    }

    #[test]
    fn the_spectrum_runs_from_blue_over_green_to_red() {
        let strongest = |nm: f32| {
            let near =
                bands().into_iter().min_by(|a, b| (a.wavelength - nm).abs().total_cmp(&(b.wavelength - nm).abs()));
            near.map(|b| b.color.max_position())
        };
        assert_eq!([450.0, 535.0, 640.0].map(strongest), [Some(2), Some(1), Some(0)]);
    }
}
