//! Render settings that a scene file brings along; the command line overrides each of them.

/// Most bounces that may be asked for; the wall of a wine glass leads light along hundreds of total reflections.
pub const MAX_DEPTH: u32 = 1024;

/// Most stops that a picture may be made brighter or darker by: factors that `f32` holds, and enough for lamps a billion
/// times as strong as the sun.
pub const MAX_STOPS: f32 = 100.0;

/// What a scene file asks for; `None`: it does not say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderHints {
    /// Columns and rows.
    pub size: Option<(u32, u32)>,
    /// Rays a pixel.
    pub samples: Option<u32>,
    /// Bounces after the eye ray.
    pub depth: Option<u32>,
    /// Weight below which a branch ends.
    pub cutoff: Option<f32>,
    /// Name of the tone map.
    pub tone_map: Option<String>,
    /// Exposure, stops.
    pub exposure: Option<f32>,
    /// Whether a scene without lights gets some.
    pub default_light: Option<bool>,
    /// Which of [`super::Scene::cameras`] is used when the command line names none.
    pub camera: Option<u32>,
}
