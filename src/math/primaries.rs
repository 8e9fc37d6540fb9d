//! Primaries of colour spaces, and their conversion to Rec. 709.

use super::{DMat3, DVec3};

/// Converts CIE XYZ, white D65, to linear Rec. 709 (IEC 61966-2-1); a colour outside its gamut has negative components.
pub fn rec_709_of_xyz(xyz: DVec3) -> DVec3 {
    let row = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).dot(xyz);
    DVec3::new(
        row(3.240_454_2, -1.537_138_5, -0.498_531_4),
        row(-0.969_266_0, 1.876_010_8, 0.041_556_0),
        row(0.055_643_4, -0.204_025_9, 1.057_225_2),
    )
}

/// Primaries and white of an RGB colour space, as CIE chromaticities (x, y).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Primaries {
    /// Chromaticities of red, green and blue.
    pub colors: [[f64; 2]; 3],
    /// Chromaticity of the white point, the colour of 1, 1, 1.
    pub white: [f64; 2],
}

impl Primaries {
    /// ITU-R BT.709 (1990), which sRGB shares.
    pub const REC_709: Self = Self { colors: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06]], white: [0.3127, 0.3290] };

    /// CIE XYZ itself, as OpenEXR writes it.
    pub const CIE_XYZ: Self = Self { colors: [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]], white: [1.0 / 3.0, 1.0 / 3.0] };

    /// Primaries with these chromaticities: red, green, blue and white.
    pub fn of(places: [[f32; 2]; 4]) -> Self {
        let [red, green, blue, white] = places.map(|place| place.map(f64::from));
        Self { colors: [red, green, blue], white }
    }

    /// Whether these primaries equal those of another space, up to rounding to three digits.
    pub fn are_near(&self, other: &Self) -> bool {
        const ROUNDING: f64 = 1e-3;
        let pairs = self.colors.iter().zip(&other.colors).chain([(&self.white, &other.white)]);
        pairs.flat_map(|(a, b)| a.iter().zip(b)).all(|(a, b)| (a - b).abs() <= ROUNDING)
    }

    /// Matrix that converts colours of this space to linear Rec. 709; white stays white by chromatic adaptation (K. M. Lam,
    /// "Metamerism and Colour Constancy", 1985: Bradford's cones), except for XYZ, which is not adapted. `None` if the
    /// primaries span no space.
    pub fn to_rec_709(&self) -> Option<DMat3> {
        if self.are_near(&Self::CIE_XYZ) {
            return Some(Self::REC_709.to_xyz()?.inverse());
        }
        let bradford = DMat3::from_cols_array_2d(&[
            [0.8951, -0.7502, 0.0389],
            [0.2664, 1.7135, -0.0685],
            [-0.1614, 0.0367, 1.0296],
        ]);
        let (here, there) = (xyz_of(self.white)?, xyz_of(Self::REC_709.white)?);
        let adapted = bradford.inverse() * DMat3::from_diagonal(bradford * there / (bradford * here)) * bradford;
        let turned = Self::REC_709.to_xyz()?.inverse() * adapted * self.to_xyz()?;
        turned.is_finite().then_some(turned)
    }

    /// Matrix to CIE XYZ, with a white of luminance 1 (SMPTE RP 177, 1993).
    fn to_xyz(self) -> Option<DMat3> {
        /// Largest determinant of collinear primaries, up to rounding.
        const FLAT: f64 = 1e-6;
        let [red, green, blue] = self.colors.map(|[x, y]| DVec3::new(x, y, 1.0 - x - y));
        let colors = DMat3::from_cols(red, green, blue);
        (colors.determinant().abs() > FLAT).then_some(())?;
        let parts = colors.inverse() * xyz_of(self.white)?;
        Some(colors * DMat3::from_diagonal(parts))
    }
}

/// CIE XYZ of a white of luminance 1 with this chromaticity; `None` if it has no luminance.
fn xyz_of([x, y]: [f64; 2]) -> Option<DVec3> {
    let xyz = DVec3::new(x / y, 1.0, (1.0 - x - y) / y);
    xyz.is_finite().then_some(xyz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_stays_white_and_rec_709_as_it_is() {
        let ap0 = Primaries { colors: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], white: [0.32168, 0.33767] };
        let p3 = Primaries { colors: [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]], ..Primaries::REC_709 };
        for space in [ap0, p3, Primaries::REC_709] {
            let white = space.to_rec_709().unwrap() * DVec3::ONE;
            assert!((white - DVec3::ONE).length() < 1e-12, "{white}");
        }
        assert!((Primaries::REC_709.to_rec_709().unwrap() - DMat3::IDENTITY).abs_diff_eq(DMat3::ZERO, 1e-12));
        // As published for P3: its red is more saturated than that of Rec. 709.
        let red = p3.to_rec_709().unwrap() * DVec3::X;
        assert!((red - DVec3::new(1.2249, -0.0420, -0.0196)).length() < 2e-4, "{red}");
        // And for the archive space of ACES (S-2008-001), adapted in the same way.
        let red = ap0.to_rec_709().unwrap() * DVec3::X;
        assert!((red - DVec3::new(2.5217, -0.2765, -0.0154)).length() < 5e-4, "{red}");
        // XYZ is not adapted. Collinear primaries and a white without luminance are refused.
        assert!(
            (Primaries::CIE_XYZ.to_rec_709().unwrap() * DVec3::new(0.9505, 1.0, 1.089) - DVec3::ONE).length() < 1e-3
        );
        let flat = Primaries { colors: [[0.3, 0.3]; 3], ..Primaries::REC_709 };
        assert!(flat.to_rec_709().is_none());
        assert!(Primaries { white: [0.3, 0.0], ..Primaries::REC_709 }.to_rec_709().is_none());
    }

    #[test]
    fn its_numbers_are_those_that_xyz_is_turned_by() {
        let to_xyz = Primaries::REC_709.to_xyz().unwrap();
        for color in [DVec3::X, DVec3::new(0.2, 0.5, 0.9)] {
            assert!((rec_709_of_xyz(to_xyz * color) - color).length() < 1e-3, "{color}");
        }
    }
}
