//! Benefit of each knob: time against error, measured on one scene.
//!
//! Every setting renders the same view several times with different seeds, and its pictures are compared with a reference of as
//! many samples as affordable ([`mod@reference`]). What differs between renderings is noise, what they have in common is bias
//! ([`mod@measure`]). Settings that no other beats in both time and error form the front ([`front`]), and one of them is
//! recommended for each purpose ([`advice`]).

pub mod advice;
pub mod front;
pub mod knob;
pub mod measure;
pub mod reference;
pub mod report;

use crate::accel::AnyAccel;
use crate::image::{Metadata, Output, Picture};
use crate::render::texture::TextureStore;
use crate::render::{ErrorSpace, Job, Settings, View, World};
use crate::scene::Scene;
use advice::Advice;
use knob::Setting;
use measure::Row;
use reference::Reference;

/// View that is rendered with every setting.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Scene as loaded, with lights.
    pub scene: &'a Scene,
    /// The scene prepared for tracing.
    pub world: &'a World,
    /// Acceleration structure.
    pub accel: &'a AnyAccel<'a>,
    /// Textures of the scene.
    pub textures: &'a TextureStore<'a>,
    /// Camera.
    pub view: &'a View,
    /// Settings that are not varied: picture size and whatever the scene asks for.
    pub base: &'a Settings,
    /// Samples per pixel that the scene asks for; `None` for stochastic sampling of default quality.
    pub samples: Option<u32>,
    /// Minimum number of samples per pixel for stochastic sampling.
    pub fewest: u32,
    /// Output settings that turn linear light into the picture whose error counts.
    pub output: &'a Output,
}

impl<'a> Subject<'a> {
    /// Job of rendering the subject with `settings`.
    fn job<'s>(&self, settings: &'s Settings, accel: &'s AnyAccel<'s>) -> Job<'s>
    where
        'a: 's,
    {
        Job { scene: self.scene, world: self.world, accel, textures: self.textures, view: self.view, settings }
    }

    /// Space in which stochastic sampling measures errors: that of the study.
    fn space(&self) -> ErrorSpace {
        ErrorSpace::Display { tone_map: self.output.tone_map, exposure: self.output.exposure }
    }
}

/// Settings of a study.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Renderings per setting; at least 2 are done, since noise is the difference between them.
    pub passes: u32,
    /// Samples per pixel of the reference.
    pub reference_samples: u32,
    /// Seed of the renderings.
    pub seed: u64,
}

impl Plan {
    /// Number of renderings per setting.
    pub fn renderings(&self) -> u32 {
        self.passes.max(2)
    }

    /// Default plan.
    pub const DEFAULT: Self = Self { passes: 3, reference_samples: 1024, seed: 0 };
}

/// Results of a study.
#[derive(Clone, Debug)]
pub struct Study {
    /// Model name as typed.
    pub name: String,
    /// Hash of everything that was read.
    pub hash: u128,
    /// Camera in words.
    pub view: String,
    /// Width and height of the pictures in pixels.
    pub size: (u32, u32),
    /// Number of rendering threads.
    pub threads: usize,
    /// Settings of the study.
    pub plan: Plan,
    /// Reference picture.
    pub reference: Reference,
    /// Results of all settings, in the order of measurement.
    pub rows: Vec<Row>,
    /// Whether every setting was measured.
    pub complete: bool,
}

impl Study {
    /// Indices of the rows that no other beats in both time and error, from fast to exact. Errors below the detection limit count
    /// as equal.
    pub fn front(&self) -> Vec<usize> {
        front::front(&self.rows.iter().map(|row| (row.cpu.median(), row.error.known())).collect::<Vec<_>>())
    }

    /// Recommended settings by purpose.
    pub fn advice(&self) -> Vec<Advice> {
        advice::advice(self)
    }
}

/// Renders the reference; `None` when `go_on`, called with the numbers of finished and of all renderings, returns false.
pub fn reference(subject: &Subject, plan: &Plan, go_on: &mut dyn FnMut(u32, u32) -> bool) -> Option<Reference> {
    Reference::render(subject, plan, go_on)
}

/// Measures one setting.
pub fn measure(subject: &Subject, plan: &Plan, reference: &Reference, setting: Setting) -> Row {
    measure::measure(subject, plan, reference, setting)
}

/// All settings to study for this subject.
pub fn settings(subject: &Subject) -> Vec<Setting> {
    knob::settings(subject)
}

/// Encodes a picture as PNG, for reports.
pub(crate) fn png(picture: &Picture) -> Vec<u8> {
    let kind = crate::image::FileKind::Png;
    crate::image::encode(picture, kind, &crate::image::statistics::as_is(), &Metadata::default()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
