//! Animations: which there are ([`Animation`]), what pointers aim at ([`pointer`]), how a value runs between keys ([`curve`]),
//! what a moment of one does to nodes and numbers ([`play`]), and the document at that moment ([`posed`]).
//!
//! Only the moment that is asked for is read: all times of a sampler, and of its values those of the keys around it.
//! Faults are warnings, each costs one channel: a picture can be drawn without.

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
    /// What the numbers of its output may be.
    numbers: Numbers,
    /// Whether it names a node beside a pointer.
    has_needless_node: bool,
}

#[derive(Clone, Debug, PartialEq)]
enum Target {
    Node(usize, Property),
    /// KHR_animation_pointer: other numbers of the document.
    Pointed(Pointed),
    /// A pointer to nothing, and why it is none.
    Lost(String),
    /// No node, which means that an extension unknown here says what is changed.
    Nothing,
}

/// What numbers may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Numbers {
    Floats,
    /// Floats, or integers that stand for -1…1.
    Units,
    /// Floats and integers of all kinds.
    All,
    /// Unsigned bytes that stand for themselves.
    Bytes,
}

impl Numbers {
    /// Whether an accessor holds such numbers.
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
    /// The node or mesh whose morph targets get other weights.
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

    /// What keys of it may be made of, where no pointer leads to it: places and scales go beyond -1…1.
    fn numbers(self) -> Numbers {
        match self {
            Self::Translation | Self::Scale => Numbers::Floats,
            Self::Rotation | Self::Weights => Numbers::Units,
        }
    }
}

/// All animations of a document that the schema check has seen.
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

    /// What its pointers lead to, whether that can be played or not.
    fn pointed(&self) -> impl Iterator<Item = &Pointed> {
        let targets = self.channels.iter().flatten().map(|channel| &channel.target);
        targets.filter_map(|target| if let Target::Pointed(pointed) = target { Some(pointed) } else { None })
    }

    /// Whether moments of it may show other materials, or other nodes, than others.
    pub(super) fn changes_materials(&self) -> bool {
        self.pointed().any(Pointed::changes_materials)
    }

    /// Whether it switches nodes on and off.
    pub(super) fn switches(&self) -> bool {
        self.pointed().any(|pointed| pointed.form == Form::Switch)
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

/// The extension by which channels change other things than nodes.
const POINTER: &str = "KHR_animation_pointer";

fn is_pointer(target: &Value) -> bool {
    target.get("path").and_then(Value::as_str) == Some("pointer")
}

/// What a channel aims at, and with which numbers; `None`: at a property or node that does not exist.
fn target(root: &Value, target: &Value) -> Option<(Target, Numbers)> {
    if is_pointer(target) {
        // The schema check has told of a word that the file does not declare.
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
