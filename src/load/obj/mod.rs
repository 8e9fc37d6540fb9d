//! (to be written)

use super::{Diagnostic, LoadError, LoadOptions, Loaded, Source};

/// Loads the OBJ loader.
pub fn load(source: &Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let _ = options;
    Err(Diagnostic::new("unsupported-format", &source.path, "", "no loader yet").into())
}
