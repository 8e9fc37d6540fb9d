//! KHR_animation_pointer: channels that change any number of the document, not only the transforms of nodes.
//!
//! The mutable properties are those of the glTF 2.0 Asset Object Model, as listed in the tables of the schema: one to four
//! numbers in cameras, lights and materials, the visibility of nodes, and weights of morph targets. A pointer (RFC 6901) is
//! valid only if all objects that enclose its target exist; the target itself may be absent.

use super::{Numbers, Property, Target};
use crate::load::gltf::schema::{Kind, Object, Range};
use crate::load::gltf::schema_tables::{EXTENSIONS, ROOT};
use crate::load::gltf::tree::Value;
use crate::load::paths::shorten;

/// A part of the document whose properties can be animated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::load::gltf) enum Entry {
    Camera(usize),
    Light(usize),
    Material(usize),
    Mesh(usize),
    Node(usize),
}

impl Entry {
    /// JSON pointer to the entry.
    pub(super) fn pointer(self) -> String {
        match self {
            Self::Camera(i) => format!("/cameras/{i}"),
            Self::Light(i) => format!("/extensions/KHR_lights_punctual/lights/{i}"),
            Self::Material(i) => format!("/materials/{i}"),
            Self::Mesh(i) => format!("/meshes/{i}"),
            Self::Node(i) => format!("/nodes/{i}"),
        }
    }

    /// Returns the entry that a path from the root leads into, if there is one.
    fn of(steps: &[String]) -> Option<Self> {
        let steps: Vec<&str> = steps.iter().map(String::as_str).collect();
        let (entry, number): (fn(usize) -> Self, &str) = match steps[..] {
            ["cameras", i, ..] => (Self::Camera, i),
            ["materials", i, ..] => (Self::Material, i),
            ["meshes", i, ..] => (Self::Mesh, i),
            ["nodes", i, ..] => (Self::Node, i),
            ["extensions", "KHR_lights_punctual", "lights", i, ..] => (Self::Light, i),
            _ => return None,
        };
        index(number).map(entry)
    }

    /// Number of steps from the root to the entry.
    fn depth(self) -> usize {
        if matches!(self, Self::Light(_)) { 4 } else { 2 }
    }
}

/// Target of a pointer.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::load::gltf) struct Pointed {
    /// The part of the document that is changed.
    pub(in crate::load::gltf) entry: Entry,
    /// Steps from the entry to the target.
    pub(in crate::load::gltf) steps: Vec<String>,
    pub(super) form: Form,
}

/// Type of a pointer's target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// One to four numbers; more than one are in a list.
    Numbers(usize, Range),
    /// A boolean.
    Switch,
    /// The weights of all morph targets, or of one.
    Weights(Option<usize>),
}

impl Pointed {
    /// The pointer in its canonical spelling.
    pub(super) fn pointer(&self) -> String {
        let steps = self.steps.iter().map(|step| format!("/{}", step.replace('~', "~0").replace('/', "~1")));
        steps.fold(self.entry.pointer(), |pointer, step| pointer + &step)
    }

    /// The pointer to the list of all weights, if the target is one weight.
    pub(super) fn whole(&self) -> Option<String> {
        self.weights()?.map(|_| format!("{}/weights", self.entry.pointer()))
    }

    /// Index of the targeted morph weight, `Some(None)` for all of them; `None` for other targets.
    pub(super) fn weights(&self) -> Option<Option<usize>> {
        if let Form::Weights(which) = self.form { Some(which) } else { None }
    }

    /// Returns whether the target affects materials or the visibility of nodes.
    pub(super) fn changes_materials(&self) -> bool {
        matches!(self.entry, Entry::Material(_)) || self.form == Form::Switch
    }

    /// Number types that the keys of the channel may have.
    pub(super) fn numbers(&self) -> Numbers {
        if self.form == Form::Switch { Numbers::Bytes } else { Numbers::All }
    }
}

/// Resolves a pointer in a document that has passed the schema check.
///
/// # Errors
/// The reason why it leads to nothing that can be animated.
pub(super) fn target(root: &Value, pointer: &str) -> Result<Target, String> {
    let lost = |why: &str| format!("the pointer '{}' {why}", shorten(pointer));
    let steps = steps(pointer).ok_or_else(|| lost("is none: every step starts with a slash"))?;
    // The contents of `extras` belong to applications.
    if steps.iter().any(|step| step == "extras") {
        return Ok(Target::Nothing);
    }
    let unknown = || lost("leads to nothing that can be animated");
    let entry = Entry::of(&steps).ok_or_else(unknown)?;
    if root.pointer(&entry.pointer()).is_none() {
        return Err(lost("leads to what the file does not have"));
    }
    let inside = &steps[entry.depth()..];
    if let (Entry::Node(node), [path]) = (entry, inside)
        && let Some(property) = Property::of(path)
    {
        return Ok(Target::Node(node, property));
    }
    let pointed = |form| Target::Pointed(Pointed { entry, steps: inside.to_vec(), form });
    if matches!(entry, Entry::Mesh(_) | Entry::Node(_)) && inside.first().is_some_and(|step| step == "weights") {
        return match inside {
            [_] => Ok(pointed(Form::Weights(None))),
            [_, which] => index(which).map(|which| pointed(Form::Weights(Some(which)))).ok_or_else(unknown),
            _ => Err(unknown()),
        };
    }
    match leaf(root, &steps) {
        Leaf::Unknown => Err(unknown()),
        Leaf::Nowhere => Err(lost("leads into what the file does not have")),
        Leaf::Kind(kind) => form(kind, entry).map(pointed).ok_or_else(unknown),
    }
}

/// Splits a pointer into unescaped steps; `None` if it is malformed.
fn steps(pointer: &str) -> Option<Vec<String>> {
    let steps = pointer.strip_prefix('/')?.split('/');
    Some(steps.map(|step| step.replace("~1", "/").replace("~0", "~")).collect())
}

/// Parses an array index in its canonical spelling.
fn index(step: &str) -> Option<usize> {
    let index: usize = step.parse().ok()?;
    (index.to_string() == step).then_some(index)
}

/// End of a pointer's path.
enum Leaf {
    /// The schema has no rule for the path.
    Unknown,
    /// An enclosing object or list is missing.
    Nowhere,
    Kind(&'static Kind),
}

/// Follows a path through the rules of the schema and the document in parallel.
fn leaf(root: &Value, steps: &[String]) -> Leaf {
    let (mut rules, mut kind, mut value): (&Object, Option<&'static Kind>, Option<&Value>) = (&ROOT, None, Some(root));
    let mut rest = steps.iter().map(String::as_str);
    while let Some(step) = rest.next() {
        let Some(here) = value else { return Leaf::Nowhere };
        match kind {
            None | Some(Kind::Object(_)) if step == "extensions" => {
                let Some(name) = rest.next() else { return Leaf::Unknown };
                let known = EXTENSIONS.iter().find(|e| e.name == name && e.on.contains(&rules.name));
                let Some(extension) = known else { return Leaf::Unknown };
                (rules, kind) = (extension.object, None);
                value = here.get(step).and_then(|extensions| extensions.get(name));
            }
            None | Some(Kind::Object(_)) => {
                let Some(property) = rules.properties.iter().find(|p| p.name == step) else { return Leaf::Unknown };
                kind = Some(&property.kind);
                value = here.get(step);
            }
            Some(Kind::List { of: of @ Kind::Object(_), .. }) => {
                kind = Some(of);
                value = index(step).and_then(|i| here.element(i));
            }
            Some(_) => return Leaf::Unknown,
        }
        if let Some(Kind::Object(object)) = kind {
            rules = object;
        }
    }
    kind.map_or(Leaf::Unknown, Leaf::Kind)
}

/// Animatable form of a property of this kind; of booleans only the visibility of nodes.
fn form(kind: &Kind, entry: Entry) -> Option<Form> {
    let range = |kind: &Kind| if let Kind::Number(range) = kind { Some(*range) } else { None };
    match kind {
        Kind::Number(range) => Some(Form::Numbers(1, *range)),
        Kind::List { of, min: 2..=4, max, .. } if matches!(max, 2..=4) => Some(Form::Numbers(*max, range(of)?)),
        Kind::Bool if matches!(entry, Entry::Node(_)) => Some(Form::Switch),
        _ => None,
    }
}
