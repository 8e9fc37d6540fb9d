//! Animations: which there are ([`Animation`]), how a value runs between keys ([`curve`]), and what a moment of one does to
//! the nodes ([`play`]).
//!
//! Only the moment that is asked for is read: all times of a sampler, and of its values those of the keys around it.
//! Faults are warnings, each costs one channel: a picture can be drawn without.

mod curve;
mod play;

pub(super) use play::{Pose, play};

use super::accessor::{Pick, Reader};
use super::schema::{list, whole};
use crate::load::AnimationFacts;
use curve::Interpolation;
use gltf::json::{Index, accessor::Accessor};
use serde_json::Value;
use std::collections::HashMap;

/// An animation of the file, as its JSON says.
#[derive(Clone, Debug, Default)]
pub(super) struct Animation {
    pub(super) name: Option<String>,
    /// `None`: a channel whose parts are not there, which the schema check has told of.
    channels: Vec<Option<Channel>>,
}

/// What one channel changes.
#[derive(Clone, Debug)]
struct Channel {
    target: Target,
    sampler: usize,
    input: Index<Accessor>,
    output: Index<Accessor>,
    interpolation: Interpolation,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Target {
    Node(usize, Property),
    /// KHR_animation_pointer: any property of the document.
    Pointer,
    /// No node, which means that an extension unknown here says what is changed.
    Nothing,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
}

impl Property {
    fn of(path: &str) -> Option<Self> {
        let known = [Self::Translation, Self::Rotation, Self::Scale, Self::Weights];
        known.into_iter().find(|property| property.name() == path)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Scale => "scale",
            Self::Weights => "weights",
        }
    }
}

/// All animations of a document that the schema check has seen.
pub(super) fn all(root: &Value) -> Vec<Animation> {
    let accessors = list(root, "accessors").len();
    list(root, "animations").iter().map(|animation| Animation::of(animation, accessors)).collect()
}

impl Animation {
    fn of(animation: &Value, accessors: usize) -> Self {
        let samplers = list(animation, "samplers");
        let accessor = |value: &Value, name: &str| {
            let index = value.get(name).and_then(position).filter(|&i| i < accessors)?;
            Some(Index::new(u32::try_from(index).ok()?))
        };
        let channel = |channel: &Value| {
            let sampler = channel.get("sampler").and_then(position)?;
            let source = samplers.get(sampler)?;
            Some(Channel {
                target: target(channel.get("target")?)?,
                sampler,
                input: accessor(source, "input")?,
                output: accessor(source, "output")?,
                interpolation: Interpolation::of(source.get("interpolation").and_then(Value::as_str)),
            })
        };
        Self {
            name: animation.get("name").and_then(Value::as_str).map(str::to_owned),
            channels: list(animation, "channels").iter().map(channel).collect(),
        }
    }

    /// The name in quotes, or else the number: what messages call it.
    pub(super) fn called(&self, number: usize) -> String {
        let name = self.name.as_deref().filter(|name| !name.is_empty());
        name.map_or_else(|| number.to_string(), |name| format!("'{name}'"))
    }
}

/// What there is to say about all of them.
///
/// The length of one is that of the `max` of its times, which glTF asks for; where it is missing, the last of them, which
/// ascend. That one alone is read: any number of accessors may lie over each other.
pub(super) fn facts(animations: &[Animation], reader: Reader) -> Vec<AnimationFacts> {
    let mut ends: HashMap<usize, f64> = HashMap::new();
    let mut end = |input: Index<Accessor>| {
        *ends.entry(input.value()).or_insert_with(|| {
            let accessor = reader.root.accessors.get(input.value());
            let declared = accessor.and_then(|a| a.max.as_ref()?.get(0)?.as_f64());
            let last = || {
                let last = u32::try_from(accessor?.count.0.checked_sub(1)?).ok()?;
                let read = reader.floats::<1>(input, Pick::Only(&[last])).ok()?;
                read.first().map(|[end]| f64::from(*end)).filter(|end| end.is_finite())
            };
            declared.or_else(last).unwrap_or(0.0)
        })
    };
    let of = |animation: &Animation| AnimationFacts {
        name: animation.name.clone().unwrap_or_default(),
        seconds: animation.channels.iter().flatten().map(|channel| end(channel.input)).fold(0.0, f64::max),
        channels: animation.channels.len(),
    };
    animations.iter().map(of).collect()
}

/// What a channel aims at; `None`: at a property or node that does not exist.
fn target(target: &Value) -> Option<Target> {
    match target.get("path").and_then(Value::as_str)? {
        "pointer" => Some(Target::Pointer),
        path => {
            let property = Property::of(path)?;
            match target.get("node") {
                None => Some(Target::Nothing),
                Some(node) => Some(Target::Node(position(node)?, property)),
            }
        }
    }
}

fn position(value: &Value) -> Option<usize> {
    whole(value).and_then(|i| usize::try_from(i).ok())
}
