//! Output of `--version`.

use std::sync::LazyLock;

/// Optional features, and whether this build has them.
const FEATURES: [(&str, bool); 4] = [
    ("basisu", cfg!(feature = "basisu")),
    ("cli", cfg!(feature = "cli")),
    ("draco", cfg!(feature = "draco")),
    ("meshopt", cfg!(feature = "meshopt")),
];

/// Version and features of this build.
pub(super) static LONG: LazyLock<String> = LazyLock::new(|| {
    let features: Vec<&str> = FEATURES.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect();
    format!(
        "{SHORT}\ninput: glTF 2.0 (.glb, .gltf, .vrm), Wavefront OBJ + MTL, PLY, STL, NFF, meshray scenes (.toml), \
         and zip archives of these\noutput: PNG, OpenEXR, JPEG, WebP\nfeatures: {}",
        features.join(", ")
    )
});

/// Version alone.
pub(super) const SHORT: &str = env!("CARGO_PKG_VERSION");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_features_are_those_of_this_build() {
        let listed = LONG.lines().last().unwrap();
        assert!(listed.contains("cli") && listed.contains("draco") == cfg!(feature = "draco"), "{listed}");
    }
}
