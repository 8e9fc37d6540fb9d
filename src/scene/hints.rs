//! Render settings in a scene file; the command line overrides each of them.

/// Greatest number of bounces; the wall of a wine glass guides light along hundreds of total internal reflections.
pub const MAX_DEPTH: u32 = 1024;

/// Greatest exposure, in stops up or down: the factors fit into `f32`, and are enough for lamps a billion times as strong as the
/// sun.
pub const MAX_STOPS: f32 = 100.0;

/// Settings in a scene file; `None` where the file gives none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderHints {
    /// Columns and rows.
    pub size: Option<(u32, u32)>,
    /// Rays per pixel.
    pub samples: Option<u32>,
    /// Bounces after the eye ray.
    pub depth: Option<u32>,
    /// Weight below which a branch ends.
    pub cutoff: Option<f32>,
    /// Name of the tone map.
    pub tone_map: Option<String>,
    /// Exposure, stops.
    pub exposure: Option<f32>,
    /// Whether a scene without lights gets default lights.
    pub default_light: Option<bool>,
    /// Index of the camera in [`super::Scene::cameras`] to use when the command line names none.
    pub camera: Option<u32>,
}
