//! A picture of everything around the scene.

use std::any::Any;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// An equirectangular picture of what surrounds the scene, seen from its middle.
///
/// In a frame whose +Y is up, the picture's middle is what lies along +X, a quarter to the right of it +Z, and its upper
/// edge the zenith: the convention of most modelling programs and viewers. Where +Z is up the same frame is turned as the
/// studio's is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panorama {
    /// Where it came from, for messages.
    pub name: String,
    /// Columns: once around.
    pub width: u32,
    /// Rows: from the zenith down.
    pub height: u32,
    /// Linear radiance (Rec. 709), row by row; finite and not negative.
    pub texels: Arc<Vec<[f32; 3]>>,
    /// How far it is turned about the up axis, radians: what was along +X comes to lie towards −Z.
    pub rotation: f32,
    /// What a renderer has made of the texels, for the next picture; clones share it.
    pub prepared: Prepared,
}

/// Room for one value that is worth keeping beside what it is made of.
#[derive(Clone, Default)]
pub struct Prepared(Arc<OnceLock<Arc<dyn Any + Send + Sync>>>);

impl Prepared {
    /// What is kept, made by `make` if nothing is yet; `None` where that is of another type.
    ///
    /// Threads that ask at once may each make it, and one of these values is kept: none waits for another, which could be at work
    /// for the one that waits.
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

/// What is made of texels tells nothing that they do not.
impl PartialEq for Prepared {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
