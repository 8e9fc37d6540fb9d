//! Panoramas of the scene's surroundings.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// An equirectangular picture of the scene's surroundings, seen from its centre.
///
/// In a frame whose +Y is up, the picture's centre lies along +X, +Z a quarter of the width to the right of it, and its upper
/// edge is the zenith: the convention of most modelling programs and viewers. If +Z is up, the frame is rotated in the same way
/// as the studio's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panorama {
    /// Source of the picture, for messages.
    pub name: String,
    /// Number of columns: once around.
    pub width: u32,
    /// Number of rows: from the zenith down.
    pub height: u32,
    /// Linear radiance (Rec. 709), row by row; finite and not negative.
    pub texels: Arc<Vec<[f32; 3]>>,
    /// Rotation about the up axis, radians: from +X towards −Z.
    pub rotation: f32,
    /// Data that a renderer has derived from the texels, kept for the next picture; clones share it.
    pub prepared: Prepared,
}

/// A slot for one value derived from the data beside it.
#[derive(Clone, Default)]
pub struct Prepared(Arc<OnceLock<Arc<dyn Any + Send + Sync>>>);

impl Prepared {
    /// Returns the kept value, made by `make` if there is none yet; `None` if it is of another type.
    ///
    /// Threads that call at the same time may each make a value, and one of these is kept: none waits for another, which might
    /// itself be waiting for that thread's work.
    pub fn get_or_make<T: Send + Sync + 'static>(&self, make: impl FnOnce() -> T) -> Option<Arc<T>> {
        let kept = match self.0.get() {
            Some(kept) => Arc::clone(kept),
            None => {
                let made: Arc<dyn Any + Send + Sync> = Arc::new(make());
                Arc::clone(self.0.get_or_init(|| made))
            }
        };
        kept.downcast().ok()
    }
}

impl fmt::Debug for Prepared {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Prepared").finish_non_exhaustive()
    }
}

/// All are equal, because the derived value adds no information to the texels.
impl PartialEq for Prepared {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
