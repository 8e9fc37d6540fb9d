//! Colours as people write them, converted to linear values.

use crate::math::Vec3;

/// Colour names and their sRGB bytes.
pub const NAMES: [(&str, [u8; 3]); 18] = [
    ("black", [0, 0, 0]),
    ("white", [255, 255, 255]),
    ("grey", [128, 128, 128]),
    ("gray", [128, 128, 128]),
    ("lightgrey", [211, 211, 211]),
    ("lightgray", [211, 211, 211]),
    ("darkgrey", [64, 64, 64]),
    ("darkgray", [64, 64, 64]),
    ("silver", [192, 192, 192]),
    ("red", [255, 0, 0]),
    ("green", [0, 128, 0]),
    ("blue", [0, 0, 255]),
    ("yellow", [255, 255, 0]),
    ("cyan", [0, 255, 255]),
    ("magenta", [255, 0, 255]),
    ("orange", [255, 165, 0]),
    ("skyblue", [135, 206, 235]),
    ("navy", [0, 0, 128]),
];

/// Parses a colour: `#rgb`, `#rrggbb`, a name (all sRGB) or `r,g,b` (linear, 0 … 1); the result is linear.
pub fn parse(text: &str) -> Result<Vec3, String> {
    let text = text.trim();
    if let Some(hex) = text.strip_prefix('#') {
        return hex_bytes(hex)
            .map(from_srgb8)
            .ok_or_else(|| format!("`{text}` is no colour; write #rrggbb with hexadecimal digits"));
    }
    if text.contains(',') {
        return triple(text).ok_or_else(|| format!("`{text}` is no colour; write three numbers from 0 to 1 as r,g,b"));
    }
    let name = text.to_lowercase();
    match NAMES.iter().find(|(known, _)| *known == name) {
        Some((_, bytes)) => Ok(from_srgb8(*bytes)),
        None => Err(format!("`{text}` is no colour; write #rrggbb, r,g,b or a name such as white, black, grey")),
    }
}

fn hex_bytes(hex: &str) -> Option<[u8; 3]> {
    let digits: Vec<u8> =
        hex.chars().map(|c| c.to_digit(16).and_then(|d| u8::try_from(d).ok())).collect::<Option<_>>()?;
    match digits[..] {
        [r, g, b] => Some([r * 17, g * 17, b * 17]),
        [r1, r0, g1, g0, b1, b0] => Some([r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0]),
        _ => None,
    }
}

fn triple(text: &str) -> Option<Vec3> {
    let parts: Vec<f32> = text.split(',').map(|p| p.trim().parse().ok()).collect::<Option<_>>()?;
    match parts[..] {
        [r, g, b] if parts.iter().all(|c| (0.0..=1.0).contains(c)) => Some(Vec3::new(r, g, b)),
        _ => None,
    }
}

/// Linear colour of sRGB bytes.
pub fn from_srgb8(bytes: [u8; 3]) -> Vec3 {
    from_srgb(bytes.map(|b| f32::from(b) / 255.0))
}

/// Linear colour of sRGB codes, 0 … 1 (IEC 61966-2-1).
pub fn from_srgb(codes: [f32; 3]) -> Vec3 {
    let decode = |c: f32| if c <= 0.04045 { c / 12.92 } else { libm::powf((c + 0.055) / 1.055, 2.4) };
    Vec3::from(codes.map(decode))
}

/// The sRGB code, 0 … 1, of a linear value: the inverse of [`from_srgb`].
pub fn to_srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * libm::powf(linear, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ways_of_writing_a_colour_agree() {
        assert_eq!(parse("#f00").unwrap(), parse("red").unwrap());
        assert_eq!(parse("#FFFFFF").unwrap(), Vec3::ONE);
        assert_eq!(parse("1, 0.5,0").unwrap(), Vec3::new(1.0, 0.5, 0.0));
        assert!((parse("#bcbcbc").unwrap().x - 0.5028).abs() < 1e-3);
    }

    #[test]
    fn what_is_no_colour_is_refused() {
        for wrong in ["", "#", "#12345", "#ggg", "1,2,3", "0.1,0.2", "0,0,nan", "reddish", "#é12"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
