//! Report on a finished picture.

use super::job::Shot;
use super::message::{Messages, Severity};
use super::meter;
use super::picture::Effective;
use super::sampling;
use super::stats::Times;
use crate::load::{Diagnostic, Facts, Loaded};
use crate::render::Rendered;
use crate::scene::Environment;
use crate::scene::default_light::DefaultLight;
use crate::scene::framing::Bounds;
use std::path::Path;

/// Index of the animation shown, and its time, clamped to its end.
pub(super) fn animation_shown(facts: &Facts) -> Option<(usize, f64)> {
    let (number, time) = facts.shown?;
    let end = facts.animations.get(number).map_or(time, |animation| animation.seconds);
    Some((number, time.min(end)))
}

/// Final messages about a picture.
pub(super) struct Summary<'a> {
    pub shot: &'a Shot,
    pub effective: &'a Effective,
    pub loaded: &'a Loaded,
    pub bounds: &'a Bounds,
    pub view: &'a str,
    pub light: DefaultLight,
}

impl Summary<'_> {
    /// Reports what was drawn, and how long it took.
    pub(super) fn say(&self, rendered: &Rendered, times: &Times, messages: &Messages) {
        let name = self.shot.target.path().unwrap_or(Path::new("-"));
        let say = |code, text: String| messages.say(Severity::Info, &Diagnostic::new(code, name, "", text));
        say("picture", self.picture(rendered));
        say("times", times.line(rendered.sampled.rays));
    }

    fn picture(&self, rendered: &Rendered) -> String {
        let settings = &self.effective.settings;
        let mut parts = vec![
            format!("{}×{}", settings.width, settings.height),
            sampling::phrase(settings, &rendered.sampled),
            format!("depth {}{}", rendered.depth, if settings.depth.is_none() { " (auto)" } else { "" }),
            self.view.to_owned(),
        ];
        let facts = &self.loaded.facts;
        if let Some((number, time)) = animation_shown(facts) {
            let name = facts.animations.get(number).map_or("", |animation| animation.name.as_str());
            let name = if name.is_empty() { number.to_string() } else { format!("'{name}'") };
            parts.push(format!("animation {name} at {time:.3} s"));
        }
        if let Some(reason) = &facts.up_reason {
            let axis = if self.loaded.scene.up == crate::scene::UpAxis::Z { "+Z" } else { "+Y" };
            parts.push(format!("{axis} up ({reason})"));
        }
        if self.light == DefaultLight::Added {
            parts.push("studio light".into());
        }
        let scene = &self.loaded.scene;
        if let Some(panorama) = scene.panorama.as_ref().filter(|_| scene.environment == Environment::Panorama) {
            parts.push(format!("light of {}", panorama.name));
        }
        if self.effective.metered && self.effective.output.exposure != 0.0 {
            parts.push(meter::phrase(self.effective.output.exposure));
        }
        if self.bounds.strays > 0 {
            parts.push(format!("framing leaves out {} far-off faces", self.bounds.strays));
        }
        parts.join(", ")
    }
}
