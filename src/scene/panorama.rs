//! A picture of everything around the scene.

use std::sync::Arc;

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
}
