//! Evaluation of an animation at one moment, for nodes and for the targets of pointers.

use super::curve::{self, Between, Interpolation, Key};
use super::pointer::{Entry, Form, Pointed};
use super::{Animation, Channel, Property, Target};
use crate::load::Diagnostic;
use crate::load::gltf::accessor::{Format, Pick, Reader, Unreadable};
use crate::load::gltf::codes::Code;
use crate::load::gltf::graph::{Graph, Moved};
use crate::load::gltf::report::Report;
use crate::load::limits::{Budget, OverBudget};
use crate::math::DVec3;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use serde_json::{Value, json};
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// Values that replace those of the document at one moment.
#[derive(Clone, Debug, Default)]
pub(in crate::load::gltf) struct Pose {
    /// Translations, rotations and scales, by node index.
    pub(in crate::load::gltf) moved: HashMap<usize, Moved>,
    /// Morph weights, by node index.
    pub(in crate::load::gltf) weights: HashMap<usize, Vec<f32>>,
    /// Morph weights by mesh index, for nodes of the mesh without weights of their own.
    pub(super) mesh_weights: HashMap<usize, Vec<f32>>,
    /// Whether the animation switches nodes on and off.
    pub(in crate::load::gltf) switches: bool,
    /// Other changes by pointers, in the order of the file.
    pub(super) changes: Vec<Change>,
}

/// A new value for the target of a pointer.
#[derive(Clone, Debug)]
pub(super) struct Change {
    pub(super) pointed: Pointed,
    /// A number, a list of numbers, or a boolean.
    pub(super) value: Value,
}

/// Targets of the channels of one animation, which must not overlap.
#[derive(Default)]
struct Aims {
    /// All targets so far, as pointers.
    whole: HashSet<String>,
    /// Lists that have a target among their elements.
    in_parts: HashSet<String>,
}

impl Aims {
    /// Adds a target; returns whether neither it, nor a part of it, nor the list it is a part of was a target before.
    fn insert(&mut self, pointer: String, part_of: Option<String>) -> bool {
        let is_in_a_whole = part_of.as_ref().is_some_and(|list| self.whole.contains(list));
        let is_taken = is_in_a_whole || self.in_parts.contains(&pointer);
        self.in_parts.extend(part_of);
        !is_taken && self.whole.insert(pointer)
    }
}

/// Evaluates an animation, the `number`th of the file, at `time` seconds.
///
/// # Errors
/// If its times would exceed the rest of `budget`.
pub(in crate::load::gltf) fn play(
    reader: Reader,
    graph: &Graph,
    number: usize,
    animation: &Animation,
    time: f64,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Pose, OverBudget> {
    let place = format!("animations[{number}]");
    let (times, morphed, pose) =
        (HashMap::new(), HashSet::new(), Pose { switches: animation.switches(), ..Pose::default() });
    let mut player = Player { reader, graph, time, budget, report, times, morphed, pose };
    let mut aims = Aims::default();
    for (k, channel) in animation.channels.iter().enumerate() {
        let Some(channel) = channel else { continue };
        let place =
            ChannelSource { channel: format!("{place}.channels[{k}]"), animation: &place, sampler: channel.sampler };
        let (pointer, whole) = match &channel.target {
            Target::Nothing => continue,
            Target::Lost(why) => {
                Fault::Target(Code::AnimationPointerPath, why.clone()).report(&place, player.report);
                continue;
            }
            Target::Node(node, property) => (format!("{}/{}", Entry::Node(*node).pointer(), property.name()), None),
            Target::Pointed(pointed) => (pointed.pointer(), pointed.whole()),
        };
        if channel.has_needless_node {
            let (code, place) = (Code::AnimationPointerNode, format!("{}.target.node", place.channel));
            player.report.warn_with(code, place, "a node beside a pointer", "the pointer counts");
        }
        if !aims.insert(pointer, whole) {
            let (code, text) = (Code::AnimationDuplicateTargets, player.again(&channel.target));
            player.report.warn_with(code, place.channel, text, "the first counts");
        } else if let Err(fault) = player.channel(channel, &place)? {
            fault.report(&place, player.report);
        }
    }
    Ok(player.pose)
}

/// Location of a channel in the file, for messages.
struct ChannelSource<'a> {
    channel: String,
    animation: &'a str,
    sampler: usize,
}

impl ChannelSource<'_> {
    fn of_sampler(&self, part: Part) -> String {
        let part = match part {
            Part::Input => "input",
            Part::Interpolation => "interpolation",
            Part::Output => "output",
        };
        format!("{}.samplers[{}].{part}", self.animation, self.sampler)
    }
}

/// Bytes per morph weight: in the pose, in the posed mesh, and in the key that identifies posed meshes.
const WEIGHT: u64 = 3 * size_of::<f32>() as u64;

/// A property of a sampler.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Times of the keys.
    Input,
    Interpolation,
    /// Values of the keys.
    Output,
}

/// Reason why a channel is left out.
enum Fault {
    /// A fault of the channel itself.
    Target(Code, String),
    /// A fault in a part of its sampler.
    Sampler(Part, Code, String),
    /// Unreadable data in a file.
    File(Diagnostic),
    /// A fault that has been reported before.
    Told,
}

impl Fault {
    fn report(self, place: &ChannelSource, report: &mut Report) {
        let left_out = "the channel is left out";
        match self {
            Self::Target(code, text) => report.warn_with(code, format!("{}.target", place.channel), text, left_out),
            // Channels share times, which are checked only once.
            Self::Sampler(Part::Input, code, text) => {
                let left_out = "channels with these times are left out";
                report.warn_with(code, place.of_sampler(Part::Input), text, left_out);
            }
            Self::Sampler(part, code, text) => report.warn_with(code, place.of_sampler(part), text, left_out),
            Self::File(why) => report.warnings.push(why),
            Self::Told => {}
        }
    }

    fn unreadable(part: Part, why: Unreadable) -> Self {
        match why {
            Unreadable::Nowhere(why) | Unreadable::Buffer(why) => Self::File(why),
            Unreadable::Data(code, text) => Self::Sampler(part, code, text),
            Unreadable::Unknown => Self::Told,
        }
    }
}

struct Player<'a, 'b> {
    reader: Reader<'a>,
    graph: &'b Graph,
    time: f64,
    budget: &'b mut Budget,
    report: &'b mut Report,
    /// Key times by accessor: the channels of a skeleton share them. `None`: unusable.
    times: HashMap<usize, Option<Rc<[f32]>>>,
    /// Nodes and meshes whose morph weights have been charged to the budget.
    morphed: HashSet<Entry>,
    pose: Pose,
}

impl<'a> Player<'a, '_> {
    /// Message about a second channel with the same target.
    fn again(&self, target: &Target) -> String {
        match target {
            Target::Node(node, property) => format!("a second channel changes the {} of node {node}", property.name()),
            Target::Pointed(pointed) => format!("a second channel changes {}, or a part of it", pointed.pointer()),
            Target::Lost(_) | Target::Nothing => String::new(),
        }
    }

    /// Evaluates one channel into the pose.
    fn channel(&mut self, channel: &Channel, place: &ChannelSource) -> Result<Result<(), Fault>, OverBudget> {
        let times = self.times(channel.input, place)?;
        if let Some(owner) = channel.target.morphed().filter(|owner| self.morphed.insert(*owner)) {
            self.budget.take(self.targets(owner) as u64, WEIGHT)?;
        }
        Ok(times.ok_or(Fault::Told).and_then(|times| match &channel.target {
            Target::Node(node, property) => self.property(channel, *node, *property, &times),
            Target::Pointed(pointed) => self.pointed(channel, pointed, &times, place),
            Target::Lost(_) | Target::Nothing => Ok(()),
        }))
    }

    /// Key times of a sampler, read and reported only once.
    fn times(&mut self, input: Index<Accessor>, place: &ChannelSource) -> Result<Option<Rc<[f32]>>, OverBudget> {
        if let Some(known) = self.times.get(&input.value()) {
            return Ok(known.clone());
        }
        self.budget.take(self.reader.count(input), size_of::<f32>() as u64 * 2)?;
        let times = match read_times(self.reader, input) {
            Ok(times) => {
                if let Some(k) = times.windows(2).position(|pair| pair[0] == pair[1]) {
                    let text = format!("times {k} and {} are both {} s", k + 1, times[k]);
                    let (code, place) = (Code::AccessorAnimationInputNonIncreasing, place.of_sampler(Part::Input));
                    self.report.warn_with(code, place, text, "the later key counts");
                }
                Some(times)
            }
            Err(fault) => {
                fault.report(place, self.report);
                None
            }
        };
        self.times.insert(input.value(), times.clone());
        Ok(times)
    }

    /// Evaluates a property of a node into the pose.
    fn property(&mut self, channel: &Channel, node: usize, property: Property, times: &[f32]) -> Result<(), Fault> {
        let between = Between::of(times, self.time);
        let keys = Keys { reader: self.reader, channel, count: times.len() };
        if property != Property::Weights && self.graph.has_matrix(node) {
            let text = format!("node {node} has a matrix, which cannot be animated");
            return Err(Fault::Target(Code::AnimationTargetMatrix, text));
        }
        match property {
            Property::Translation | Property::Scale => {
                let value = <[f64; 3]>::try_from(keys.numbers(between, 3)?).map_err(|_| Fault::Told)?;
                let moved = self.pose.moved.entry(node).or_default();
                let slot = if property == Property::Scale { &mut moved.scale } else { &mut moved.translation };
                *slot = Some(DVec3::from(value));
            }
            Property::Rotation => {
                keys.check(Type::Vec4, 1)?;
                let (before, after) = keys.around::<4>(between, 1)?;
                let rotation = curve::rotation(channel.interpolation, between, &before, &after).ok_or_else(|| {
                    Fault::Sampler(Part::Output, Code::AccessorAnimationQuaternion, "a rotation of length 0".into())
                })?;
                self.pose.moved.entry(node).or_default().rotation = Some(rotation);
            }
            Property::Weights => self.weights(&keys, between, Entry::Node(node), None)?,
        }
        Ok(())
    }

    /// Evaluates the target of a pointer into the pose.
    fn pointed(
        &mut self,
        channel: &Channel,
        pointed: &Pointed,
        times: &[f32],
        place: &ChannelSource,
    ) -> Result<(), Fault> {
        let between = Between::of(times, self.time);
        let keys = Keys { reader: self.reader, channel, count: times.len() };
        let value = match pointed.form {
            Form::Weights(which) => return self.weights(&keys, between, pointed.entry, which),
            Form::Switch => {
                keys.check(Type::Scalar, 1)?;
                let (before, _) = keys.around::<1>(between, 1)?;
                if channel.interpolation != Interpolation::Step {
                    let text = "there is nothing between true and false";
                    let place = place.of_sampler(Part::Interpolation);
                    self.report.note("gltf-animation-switch", place, text, "it is switched in steps");
                }
                json!(before.value.first().is_some_and(|&on| on != 0.0))
            }
            Form::Numbers(count, range) => {
                let mut numbers = keys.numbers(between, count)?;
                for number in numbers.iter_mut().filter(|number| !range.holds(**number)) {
                    // Splines overshoot their keys.
                    if channel.interpolation != Interpolation::CubicSpline {
                        let text = format!("{number} where {range} is allowed");
                        let (code, place) = (Code::ValueNotInRange, place.of_sampler(Part::Output));
                        self.report.warn_with(code, place, text, "the nearest that is allowed is taken");
                    }
                    *number = range.nearest(*number);
                }
                if count == 1 { json!(numbers.first()) } else { json!(numbers) }
            }
        };
        self.pose.changes.push(Change { pointed: pointed.clone(), value });
        Ok(())
    }

    /// Evaluates the weights of all morph targets of a node or mesh, or of one target, into the pose.
    fn weights(&mut self, keys: &Keys, between: Between, owner: Entry, which: Option<usize>) -> Result<(), Fault> {
        let targets = self.targets(owner);
        if which.map_or(targets == 0, |which| which >= targets) {
            let morphs = if targets == 0 { "no morph targets".into() } else { format!("{targets} morph targets") };
            let text = match owner {
                Entry::Node(node) => format!("node {node} has {morphs}"),
                _ => format!("{} has {morphs}", owner.pointer()),
            };
            return Err(Fault::Target(Code::AnimationTargetNoMorphs, text));
        }
        let each = if which.is_some() { 1 } else { targets };
        keys.check(Type::Scalar, each)?;
        let (before, after) = keys.around::<1>(between, each)?;
        let value = curve::numbers(keys.channel.interpolation, between, &before, &after);
        #[expect(clippy::cast_possible_truncation, reason = "morphing is done with f32 weights")]
        let value: Vec<f32> = value.into_iter().map(|w| w as f32).collect();
        let (reader, mesh) = (self.reader, self.mesh(owner));
        let slot = match owner {
            Entry::Node(node) => self.pose.weights.entry(node),
            Entry::Mesh(mesh) => self.pose.mesh_weights.entry(mesh),
            Entry::Camera(_) | Entry::Light(_) | Entry::Material(_) => return Ok(()),
        };
        match which {
            None => drop(slot.insert_entry(value)),
            Some(which) => {
                let weights = slot.or_insert_with(|| weights_at_rest(reader, owner, mesh, targets));
                weights.iter_mut().skip(which).zip(value).take(1).for_each(|(weight, value)| *weight = value);
            }
        }
        Ok(())
    }

    /// Mesh of a node, or the mesh itself.
    fn mesh(&self, owner: Entry) -> Option<&'a gltf::json::Mesh> {
        let root = self.reader.root;
        let mesh = match owner {
            Entry::Mesh(mesh) => mesh,
            Entry::Node(node) => root.nodes.get(node)?.mesh?.value(),
            Entry::Camera(_) | Entry::Light(_) | Entry::Material(_) => return None,
        };
        root.meshes.get(mesh)
    }

    /// Number of morph targets of a node or mesh.
    fn targets(&self, owner: Entry) -> usize {
        let primitive = self.mesh(owner).and_then(|mesh| mesh.primitives.first());
        primitive.and_then(|p| p.targets.as_ref()).map_or(0, Vec::len)
    }
}

/// Morph weights of a node or mesh without animation.
fn weights_at_rest(reader: Reader, owner: Entry, mesh: Option<&gltf::json::Mesh>, targets: usize) -> Vec<f32> {
    let node = if let Entry::Node(node) = owner { reader.root.nodes.get(node) } else { None };
    let own = node.and_then(|node| node.weights.clone());
    let mut weights = own.or_else(|| mesh?.weights.clone()).unwrap_or_default();
    weights.resize(targets, 0.0);
    weights
}

/// Reads key times, which have to be finite, non-decreasing and at least one.
fn read_times(reader: Reader, input: Index<Accessor>) -> Result<Rc<[f32]>, Fault> {
    let fault = |code, text: String| Fault::Sampler(Part::Input, code, text);
    let format = reader.root.accessors.get(input.value()).and_then(Format::of).ok_or(Fault::Told)?;
    if format.component != ComponentType::F32 || format.shape != Type::Scalar {
        return Err(fault(Code::AnimationInputFormat, "times must be single floats".into()));
    }
    let times = reader.floats::<1>(input, Pick::All).map_err(|why| Fault::unreadable(Part::Input, why))?;
    let times: Rc<[f32]> = times.into_iter().map(|[time]| time).collect();
    if let Some(k) = times.iter().position(|time| !time.is_finite()) {
        return Err(fault(Code::AccessorInvalidFloat, format!("time {k} is {}", times[k])));
    }
    if let Some(k) = times.windows(2).position(|pair| pair[0] > pair[1]) {
        let text = format!("time {} ({} s) is before time {k} ({} s)", k + 1, times[k + 1], times[k]);
        return Err(fault(Code::AccessorAnimationInputNonIncreasing, text));
    }
    if times.is_empty() {
        return Err(fault(Code::AnimationInputFew, "no times".into()));
    }
    Ok(times)
}

/// The output of a sampler.
struct Keys<'a> {
    reader: Reader<'a>,
    channel: &'a Channel,
    /// Number of keys.
    count: usize,
}

impl Keys<'_> {
    /// Checks that the output has this shape and `each` elements per value.
    fn check(&self, shape: Type, each: usize) -> Result<(), Fault> {
        let accessor = self.reader.root.accessors.get(self.channel.output.value()).ok_or(Fault::Told)?;
        let format = Format::of(accessor).ok_or(Fault::Told)?;
        let fault = |code, text: String| Err(Fault::Sampler(Part::Output, code, text));
        if format.shape != shape || !self.channel.numbers.fits(format) {
            let count = match shape {
                Type::Vec2 => "two",
                Type::Vec3 => "three",
                Type::Vec4 => "four",
                _ => "single",
            };
            let text = format!("values must be {count} {}", self.channel.numbers.words());
            return fault(Code::AnimationOutputFormat, text);
        }
        let each = (each as u64).saturating_mul(self.channel.interpolation.elements() as u64);
        if accessor.count.0 != each.saturating_mul(self.count as u64) {
            let text = format!("{} elements where {} keys take {each} each", accessor.count.0, self.count);
            return fault(Code::AnimationOutputCount, text);
        }
        Ok(())
    }

    /// Interpolates `count` numbers, one to four.
    fn numbers(&self, between: Between, count: usize) -> Result<Vec<f64>, Fault> {
        let shape = match count {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        self.check(shape, 1)?;
        let (before, after) = match count {
            1 => self.around::<1>(between, 1)?,
            2 => self.around::<2>(between, 1)?,
            3 => self.around::<3>(between, 1)?,
            _ => self.around::<4>(between, 1)?,
        };
        Ok(curve::numbers(self.channel.interpolation, between, &before, &after))
    }

    /// Reads the two keys around a moment, with values of `each` elements of `N` numbers.
    fn around<const N: usize>(&self, between: Between, each: usize) -> Result<(Key, Key), Fault> {
        let before = self.key::<N>(between.before, each)?;
        let after = if between.after == between.before { before.clone() } else { self.key::<N>(between.after, each)? };
        Ok((before, after))
    }

    fn key<const N: usize>(&self, key: usize, each: usize) -> Result<Key, Fault> {
        let elements = self.channel.interpolation.elements() * each;
        let first = key.checked_mul(elements).ok_or(Fault::Told)?;
        let wanted: Option<Vec<u32>> = (first..first + elements).map(|i| u32::try_from(i).ok()).collect();
        let read = self.reader.floats::<N>(self.channel.output, Pick::Only(&wanted.ok_or(Fault::Told)?));
        let read = read.map_err(|why| Fault::unreadable(Part::Output, why))?;
        let numbers: Vec<f64> = read.iter().flatten().map(|&x| f64::from(x)).collect();
        if let Some(odd) = numbers.iter().find(|x| !x.is_finite()) {
            let text = format!("a value of key {key} is {odd}");
            return Err(Fault::Sampler(Part::Output, Code::AccessorInvalidFloat, text));
        }
        if self.channel.interpolation != Interpolation::CubicSpline {
            return Ok(Key { value: numbers, ..Key::default() });
        }
        let mut parts = numbers.chunks(N * each).map(<[f64]>::to_vec);
        let mut part = || parts.next().unwrap_or_default();
        Ok(Key { tangent_in: part(), value: part(), tangent_out: part() })
    }
}
