//! Animations: their list ([`Animation`]), the targets of pointers ([`pointer`]), interpolation between keys ([`curve`]),
//! evaluation at a moment ([`play`]), and the document at that moment ([`posed`]).
//!
//! Only the requested moment is read: all times of a sampler, but only the values of the keys around it. Faults are warnings,
//! and each costs one channel: the scene can be drawn without it.

mod curve;
mod play;
mod pointer;
mod posed;

pub(super) use play::{Pose, play};
pub(super) use posed::Originals;

use super::accessor::{Format, Pick, Reader};
use super::schema::{list, position};
use crate::load::AnimationFacts;
use crate::load::gltf::tree::Value;
use curve::Interpolation;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType};
use pointer::{Entry, Form, Pointed};
use std::collections::HashMap;

/// An animation as declared in the JSON.
#[derive(Clone, Debug, Default)]
pub(super) struct Animation {
    pub(super) name: Option<String>,
    /// `None`: a channel with missing parts, which the schema check reports.
    channels: Vec<Option<Channel>>,
}

/// One channel: its target and its sampler.
#[derive(Clone, Debug)]
struct Channel {
    target: Target,
    sampler: usize,
    input: Index<Accessor>,
    output: Index<Accessor>,
    interpolation: Interpolation,
    /// Number types allowed in the output.
    numbers: Numbers,
    /// Whether the channel names a node beside a pointer.
    has_needless_node: bool,
}

#[derive(Clone, Debug, PartialEq)]
enum Target {
    Node(usize, Property),
    /// KHR_animation_pointer: other numbers of the document.
    Pointed(Pointed),
    /// A pointer without a target, and the reason.
    Lost(String),
    /// No node, no declared pointer, or `extras`: only an extension unknown here could say what changes.
    Nothing,
}

/// Number types that the output of a channel may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Numbers {
    Floats,
    /// Floats, or normalised integers of up to 16 bits.
    Units,
    /// Floats and all integers.
    All,
    /// Unsigned bytes, not normalised.
    Bytes,
}

impl Numbers {
    /// Returns whether an accessor of this format has such numbers.
    fn fits(self, format: Format) -> bool {
        let is_float = format.component == ComponentType::F32;
        match self {
            Self::Floats => is_float,
            Self::Units => is_float || (format.normalized && format.component != ComponentType::U32),
            Self::All => true,
            Self::Bytes => format.component == ComponentType::U8 && !format.normalized,
        }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Floats => "floats",
            Self::Units => "floats or normalized integers",
            Self::All => "numbers",
            Self::Bytes => "unsigned bytes that are not normalized",
        }
    }
}

impl Target {
    /// Returns the node or mesh whose morph weights change.
    fn morphed(&self) -> Option<Entry> {
        match self {
            Self::Node(node, Property::Weights) => Some(Entry::Node(*node)),
            Self::Pointed(pointed) => pointed.weights().map(|_| pointed.entry),
            Self::Node(..) | Self::Lost(_) | Self::Nothing => None,
        }
    }
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

    /// Number types of the keys of a property that no pointer addresses: translations and scales exceed −1…1.
    fn numbers(self) -> Numbers {
        match self {
            Self::Translation | Self::Scale => Numbers::Floats,
            Self::Rotation | Self::Weights => Numbers::Units,
        }
    }
}

/// Returns all animations of a document that has passed the schema check.
pub(super) fn all(root: &Value) -> Vec<Animation> {
    let accessors = list(root, "accessors").len();
    list(root, "animations").iter().map(|animation| Animation::of(root, animation, accessors)).collect()
}

impl Animation {
    fn of(root: &Value, animation: &Value, accessors: usize) -> Self {
        let samplers = list(animation, "samplers");
        let accessor = |value: &Value, name: &str| {
            let index = value.get(name).and_then(position).filter(|&i| i < accessors)?;
            Some(Index::new(u32::try_from(index).ok()?))
        };
        let channel = |channel: &Value| {
            let sampler = channel.get("sampler").and_then(position)?;
            let source = samplers.get(sampler)?;
            let aim = channel.get("target")?;
            let (target, numbers) = target(root, aim)?;
            Some(Channel {
                target,
                numbers,
                has_needless_node: is_pointer(aim) && aim.get("node").is_some(),
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

    /// Targets of the pointers, playable or not.
    fn pointed(&self) -> impl Iterator<Item = &Pointed> {
        let targets = self.channels.iter().flatten().map(|channel| &channel.target);
        targets.filter_map(|target| if let Target::Pointed(pointed) = target { Some(pointed) } else { None })
    }

    /// Returns whether the materials, or the set of visible nodes, may differ between moments.
    pub(super) fn changes_materials(&self) -> bool {
        self.pointed().any(Pointed::changes_materials)
    }

    /// Returns whether the animation switches nodes on and off.
    pub(super) fn switches(&self) -> bool {
        self.pointed().any(|pointed| pointed.form == Form::Switch)
    }

    /// Name of the animation in messages: its own in quotes, or else its index.
    pub(super) fn called(&self, number: usize) -> String {
        let name = self.name.as_deref().filter(|name| !name.is_empty());
        name.map_or_else(|| number.to_string(), |name| format!("'{name}'"))
    }
}

/// Summaries of all animations.
///
/// The length of an animation is the `max` that glTF requires of its times, or else the last time, since times ascend. Only that
/// time is read: any number of accessors may overlap.
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

/// The extension that lets channels target other properties than those of nodes.
const POINTER: &str = "KHR_animation_pointer";

fn is_pointer(target: &Value) -> bool {
    target.get("path").and_then(Value::as_str) == Some("pointer")
}

/// Target of a channel, and the number types it takes; `None` if the property or node does not exist.
fn target(root: &Value, target: &Value) -> Option<(Target, Numbers)> {
    if is_pointer(target) {
        // The schema check reports a pointer whose extension the file does not declare.
        if !list(root, "extensionsUsed").iter().any(|name| name.as_str() == Some(POINTER)) {
            return Some((Target::Nothing, Numbers::All));
        }
        let pointer = target.get("extensions").and_then(|extensions| extensions.get(POINTER)?.get("pointer")?.as_str());
        let pointer = pointer.ok_or_else(|| format!("its path is 'pointer', and there is no pointer of {POINTER}"));
        let target = pointer.and_then(|pointer| pointer::target(root, pointer)).unwrap_or_else(Target::Lost);
        let numbers = if let Target::Pointed(pointed) = &target { pointed.numbers() } else { Numbers::All };
        return Some((target, numbers));
    }
    let property = Property::of(target.get("path").and_then(Value::as_str)?)?;
    let target = match target.get("node") {
        None => Target::Nothing,
        Some(node) => Target::Node(position(node)?, property),
    };
    Some((target, property.numbers()))
}
