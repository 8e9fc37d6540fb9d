//! What one moment of an animation does to the nodes.

use super::curve::{self, Between, Interpolation, Key};
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
use std::collections::{HashMap, HashSet};
use std::rc::Rc;

/// What an animation puts in the place of what the nodes say.
#[derive(Clone, Debug, Default)]
pub(in crate::load::gltf) struct Pose {
    /// Translations, rotations and scales, by node.
    pub(in crate::load::gltf) moved: HashMap<usize, Moved>,
    /// Weights of morph targets, by node.
    pub(in crate::load::gltf) weights: HashMap<usize, Vec<f32>>,
}

/// Evaluates an animation, the `number`th of the file, at `time` seconds.
///
/// # Errors
/// When its times would take more than is left of `budget`.
pub(in crate::load::gltf) fn play(
    reader: Reader,
    graph: &Graph,
    (number, animation): (usize, &Animation),
    time: f64,
    budget: &mut Budget,
    report: &mut Report,
) -> Result<Pose, OverBudget> {
    let place = format!("animations[{number}]");
    let mut player = Player { reader, graph, time, budget, report, times: HashMap::new(), pose: Pose::default() };
    let mut seen = HashSet::new();
    for (k, channel) in animation.channels.iter().enumerate() {
        let Some(channel) = channel else { continue };
        let place = Place { channel: format!("{place}.channels[{k}]"), animation: &place, sampler: channel.sampler };
        match channel.target {
            Target::Pointer => {
                let (code, text) = (Code::UnsupportedExtension, "KHR_animation_pointer is not supported");
                player.report.warn_with(code, place.channel, text, "what the channel changes stays as it is");
            }
            Target::Nothing => {}
            Target::Node(node, property) => {
                if !seen.insert(channel.target) {
                    let code = Code::AnimationDuplicateTargets;
                    let text = format!("a second channel changes the {} of node {node}", property.name());
                    player.report.warn_with(code, place.channel, text, "the first counts");
                } else if let Err(fault) = player.channel(channel, node, property, &place)? {
                    fault.tell(&place, player.report);
                }
            }
        }
    }
    Ok(player.pose)
}

/// Where a channel stands in the file.
struct Place<'a> {
    channel: String,
    animation: &'a str,
    sampler: usize,
}

impl Place<'_> {
    fn of_sampler(&self, part: &str) -> String {
        format!("{}.samplers[{}].{part}", self.animation, self.sampler)
    }
}

/// Bytes that a weight of a morph target takes: in the pose, in the variant of the mesh, and in what tells variants apart.
const WEIGHT: u64 = 3 * size_of::<f32>() as u64;

/// The accessors of a sampler.
const INPUT: &str = "input";
const OUTPUT: &str = "output";

/// Why a channel is left out.
enum Fault {
    /// Of the channel itself.
    Target(Code, String),
    /// Of its sampler's `input` or `output`.
    Sampler(&'static str, Code, String),
    /// Of data in a file that cannot be read.
    File(Diagnostic),
    /// The schema check has told of it.
    Told,
}

impl Fault {
    fn tell(self, place: &Place, report: &mut Report) {
        let left_out = "the channel is left out";
        match self {
            Self::Target(code, text) => report.warn_with(code, format!("{}.target", place.channel), text, left_out),
            // Channels share times, and they are looked at once.
            Self::Sampler(part, code, text) if part == INPUT => {
                report.warn_with(code, place.of_sampler(part), text, "channels with these times are left out");
            }
            Self::Sampler(part, code, text) => report.warn_with(code, place.of_sampler(part), text, left_out),
            Self::File(why) => report.warnings.push(why),
            Self::Told => {}
        }
    }

    fn unreadable(part: &'static str, why: Unreadable) -> Self {
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
    /// Times by accessor: the channels of a skeleton share them. `None`: they cannot be used.
    times: HashMap<usize, Option<Rc<[f32]>>>,
    pose: Pose,
}

impl Player<'_, '_> {
    /// Evaluates one channel into the pose.
    fn channel(
        &mut self,
        channel: &Channel,
        node: usize,
        property: Property,
        place: &Place,
    ) -> Result<Result<(), Fault>, OverBudget> {
        let times = self.times(channel.input, place)?;
        if property == Property::Weights {
            self.budget.take(self.targets(node) as u64, WEIGHT)?;
        }
        Ok(times.ok_or(Fault::Told).and_then(|times| self.value(channel, node, property, &times)))
    }

    /// The times of the keys, read and told of once.
    fn times(&mut self, input: Index<Accessor>, place: &Place) -> Result<Option<Rc<[f32]>>, OverBudget> {
        if let Some(known) = self.times.get(&input.value()) {
            return Ok(known.clone());
        }
        self.budget.take(self.reader.count(input), size_of::<f32>() as u64 * 2)?;
        let times = match read_times(self.reader, input) {
            Ok(times) => {
                if let Some(k) = times.windows(2).position(|pair| pair[0] == pair[1]) {
                    let text = format!("times {k} and {} are both {} s", k + 1, times[k]);
                    let (code, place) = (Code::AccessorAnimationInputNonIncreasing, place.of_sampler(INPUT));
                    self.report.warn_with(code, place, text, "the later key counts");
                }
                Some(times)
            }
            Err(fault) => {
                fault.tell(place, self.report);
                None
            }
        };
        self.times.insert(input.value(), times.clone());
        Ok(times)
    }

    /// The value of a channel at the moment, put into the pose.
    fn value(&mut self, channel: &Channel, node: usize, property: Property, times: &[f32]) -> Result<(), Fault> {
        let between = Between::of(times, self.time);
        let keys = Keys { reader: self.reader, channel, count: times.len() };
        let interpolation = channel.interpolation;
        if property != Property::Weights && self.graph.has_matrix(node) {
            let text = format!("node {node} has a matrix, which cannot be animated");
            return Err(Fault::Target(Code::AnimationTargetMatrix, text));
        }
        match property {
            Property::Translation | Property::Scale => {
                keys.check(Type::Vec3, 1)?;
                let (before, after) = keys.around::<3>(between, 1)?;
                let value = curve::numbers(interpolation, between, &before, &after);
                let value = <[f64; 3]>::try_from(value).map(DVec3::from).map_err(|_| Fault::Told)?;
                let moved = self.pose.moved.entry(node).or_default();
                let slot = if property == Property::Scale { &mut moved.scale } else { &mut moved.translation };
                *slot = Some(value);
            }
            Property::Rotation => {
                keys.check(Type::Vec4, 1)?;
                let (before, after) = keys.around::<4>(between, 1)?;
                let rotation = curve::rotation(interpolation, between, &before, &after).ok_or_else(|| {
                    Fault::Sampler(OUTPUT, Code::AccessorAnimationQuaternion, "a rotation of length 0".into())
                })?;
                self.pose.moved.entry(node).or_default().rotation = Some(rotation);
            }
            Property::Weights => {
                let targets = self.targets(node);
                if targets == 0 {
                    let text = format!("node {node} has no morph targets");
                    return Err(Fault::Target(Code::AnimationTargetNoMorphs, text));
                }
                keys.check(Type::Scalar, targets)?;
                let (before, after) = keys.around::<1>(between, targets)?;
                let value = curve::numbers(interpolation, between, &before, &after);
                #[expect(clippy::cast_possible_truncation, reason = "morphing is done with f32 weights")]
                let weights = value.into_iter().map(|w| w as f32).collect();
                self.pose.weights.insert(node, weights);
            }
        }
        Ok(())
    }

    /// How many morph targets the mesh of a node has.
    fn targets(&self, node: usize) -> usize {
        let root = self.reader.root;
        let mesh = root.nodes.get(node).and_then(|node| root.meshes.get(node.mesh?.value()));
        let primitive = mesh.and_then(|mesh| mesh.primitives.first());
        primitive.and_then(|p| p.targets.as_ref()).map_or(0, Vec::len)
    }
}

/// Times that are finite and never go back.
fn read_times(reader: Reader, input: Index<Accessor>) -> Result<Rc<[f32]>, Fault> {
    let fault = |code, text: String| Fault::Sampler(INPUT, code, text);
    let format = reader.root.accessors.get(input.value()).and_then(Format::of).ok_or(Fault::Told)?;
    if format.component != ComponentType::F32 || format.shape != Type::Scalar {
        return Err(fault(Code::AnimationInputFormat, "times must be single floats".into()));
    }
    let times = reader.floats::<1>(input, Pick::All).map_err(|why| Fault::unreadable(INPUT, why))?;
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
    /// How many keys there are.
    count: usize,
}

impl Keys<'_> {
    /// Whether the output has the shape, and as many elements as `each` value takes at every key.
    fn check(&self, shape: Type, each: usize) -> Result<(), Fault> {
        let accessor = self.reader.root.accessors.get(self.channel.output.value()).ok_or(Fault::Told)?;
        let format = Format::of(accessor).ok_or(Fault::Told)?;
        let fault = |code, text: String| Err(Fault::Sampler(OUTPUT, code, text));
        let small = format.normalized && format.component != ComponentType::U32;
        let numbers = match format.component {
            ComponentType::F32 => true,
            // Rotations and weights lie in -1…1; places and scales do not.
            _ => small && shape != Type::Vec3,
        };
        if format.shape != shape || !numbers {
            let kind = match shape {
                Type::Vec3 => "three floats",
                Type::Vec4 => "four floats or normalized integers",
                _ => "single floats or normalized integers",
            };
            return fault(Code::AnimationOutputFormat, format!("values must be {kind}"));
        }
        let each = (each as u64).saturating_mul(self.channel.interpolation.elements() as u64);
        if accessor.count.0 != each.saturating_mul(self.count as u64) {
            let text = format!("{} elements where {} keys take {each} each", accessor.count.0, self.count);
            return fault(Code::AnimationOutputCount, text);
        }
        Ok(())
    }

    /// The keys around a moment, `each` elements of `N` numbers to a value.
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
        let read = read.map_err(|why| Fault::unreadable(OUTPUT, why))?;
        let numbers: Vec<f64> = read.iter().flatten().map(|&x| f64::from(x)).collect();
        if let Some(odd) = numbers.iter().find(|x| !x.is_finite()) {
            let text = format!("a value of key {key} is {odd}");
            return Err(Fault::Sampler(OUTPUT, Code::AccessorInvalidFloat, text));
        }
        if self.channel.interpolation != Interpolation::CubicSpline {
            return Ok(Key { value: numbers, ..Key::default() });
        }
        let mut parts = numbers.chunks(N * each).map(<[f64]>::to_vec);
        let mut part = || parts.next().unwrap_or_default();
        Ok(Key { tangent_in: part(), value: part(), tangent_out: part() })
    }
}
