//! What each knob buys: time against error, measured on one scene.
//!
//! Every setting renders the same view several times with different random numbers, and its pictures are compared with a
//! reference that is as good as patience allows ([`mod@reference`]). What differs from rendering to rendering is noise,
//! what they all have in common is bias ([`mod@measure`]). Settings that no other beats in both time and error are the
//! front ([`front`]), and from these one is advised for each purpose ([`advice`]).

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

/// What is rendered again and again.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// The scene as loaded, lit.
    pub scene: &'a Scene,
    /// The same placed for tracing.
    pub world: &'a World,
    /// A structure over it.
    pub accel: &'a AnyAccel<'a>,
    /// Its textures.
    pub textures: &'a TextureStore<'a>,
    /// The eye.
    pub view: &'a View,
    /// What is not studied: size and whatever the scene asks for.
    pub base: &'a Settings,
    /// Samples of every pixel that the scene asks for; `None`: stochastic sampling, of the usual quality.
    pub samples: Option<u32>,
    /// The fewest samples of a pixel that stochastic sampling takes of it.
    pub fewest: u32,
    /// How linear light becomes the picture whose error counts.
    pub output: &'a Output,
}

impl<'a> Subject<'a> {
    /// The job of rendering it with `settings`.
    fn job<'s>(&self, settings: &'s Settings, accel: &'s AnyAccel<'s>) -> Job<'s>
    where
        'a: 's,
    {
        Job { scene: self.scene, world: self.world, accel, textures: self.textures, view: self.view, settings }
    }

    /// The numbers in which stochastic sampling counts errors: those of the study.
    fn space(&self) -> ErrorSpace {
        ErrorSpace::Display { tone_map: self.output.tone_map, exposure: self.output.exposure }
    }
}

/// How a study is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Renderings of each setting; 2 at least are done, as noise is what differs between them.
    pub passes: u32,
    /// Samples of each pixel of the reference.
    pub reference_samples: u32,
    /// Other numbers give other renderings.
    pub seed: u64,
}

impl Plan {
    /// Renderings of each setting.
    pub fn renderings(&self) -> u32 {
        self.passes.max(2)
    }

    /// What is done unless something else is asked.
    pub const DEFAULT: Self = Self { passes: 3, reference_samples: 1024, seed: 0 };
}

/// What was found.
#[derive(Clone, Debug)]
pub struct Study {
    /// The model as typed.
    pub name: String,
    /// Of everything that was read.
    pub hash: u128,
    /// From where it was seen.
    pub view: String,
    /// Columns and rows of the pictures.
    pub size: (u32, u32),
    /// Threads that rendered.
    pub threads: usize,
    /// How it was done.
    pub plan: Plan,
    /// What pictures were compared with.
    pub reference: Reference,
    /// Every setting, in the order they were measured.
    pub rows: Vec<Row>,
    /// Whether every setting was measured.
    pub complete: bool,
}

impl Study {
    /// Places of the rows that no other beats in time and error, from fast to exact. Errors that cannot be told from none
    /// are equal.
    pub fn front(&self) -> Vec<usize> {
        front::front(&self.rows.iter().map(|row| (row.cpu.median(), row.error.known())).collect::<Vec<_>>())
    }

    /// Which settings to use for what.
    pub fn advice(&self) -> Vec<Advice> {
        advice::advice(self)
    }
}

/// Renders the reference; `None` when `go_on` says no. It hears how many renderings are done, of how many.
pub fn reference(subject: &Subject, plan: &Plan, go_on: &mut dyn FnMut(u32, u32) -> bool) -> Option<Reference> {
    Reference::render(subject, plan, go_on)
}

/// Measures one setting.
pub fn measure(subject: &Subject, plan: &Plan, reference: &Reference, setting: Setting) -> Row {
    measure::measure(subject, plan, reference, setting)
}

/// Every setting that this scene can be studied with.
pub fn settings(subject: &Subject) -> Vec<Setting> {
    knob::settings(subject)
}

/// A picture's file, for reports.
pub(crate) fn png(picture: &Picture) -> Vec<u8> {
    let kind = crate::image::FileKind::Png;
    crate::image::encode(picture, kind, &crate::image::statistics::as_is(), &Metadata::default()).unwrap_or_default()
}

#[cfg(test)]
mod tests;
