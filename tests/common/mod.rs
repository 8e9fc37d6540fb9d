//! What several subjects need: the repository, and little scenes.

pub mod stage;

use std::path::Path;

/// The repository.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}
