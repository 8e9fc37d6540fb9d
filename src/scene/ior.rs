//! Indices of refraction by name.
//!
//! Values as tabulated by J. M. Brisson Lopes (*Ray Tracing*, lecture text, IST Lisbon, 2013).

/// Substances and their indices of refraction.
pub const TABLE: [(&str, f64); 11] = [
    ("air", 1.00029),
    ("water", 1.33),
    ("ethyl alcohol", 1.36),
    ("quartz", 1.46),
    ("crown glass", 1.52),
    ("polystyrene", 1.55),
    ("dense glass", 1.66),
    ("sapphire", 1.77),
    ("crystal glass", 2.0),
    ("diamond", 2.417),
    ("iodine crystal", 3.34),
];

/// Index of refraction of a substance, `None` if it is unknown; `-` and `_` in the name count as spaces.
pub fn by_name(name: &str) -> Option<f64> {
    let name = name.trim().to_lowercase().replace(['-', '_'], " ");
    TABLE.iter().find(|(known, _)| *known == name).map(|(_, ior)| *ior)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn substances_are_known_by_name() {
        assert_eq!(by_name("Crown-Glass"), Some(1.52));
        assert_eq!(by_name("diamond"), Some(2.417));
        assert_eq!(by_name("unobtainium"), None);
    }
}
