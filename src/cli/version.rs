//! What `--version` says.

/// Version and features of this build.
pub(super) const LONG: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\ninput: glTF 2.0 (.glb, .gltf), Wavefront OBJ + MTL, PLY, STL, NFF, meshray scenes (.toml)",
    "\noutput: PNG, OpenEXR, JPEG, WebP",
    "\nfeatures: cli",
);

/// Version alone.
pub(super) const SHORT: &str = env!("CARGO_PKG_VERSION");
