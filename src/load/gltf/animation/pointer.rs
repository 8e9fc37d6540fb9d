//! KHR_animation_pointer: channels that change any number of the document, not only what places nodes.
//!
//! What may be changed is what the glTF 2.0 Asset Object Model lists as mutable, which the tables of the schema tell: single
//! numbers and up to four of them in cameras, lamps and materials, whether a node is visible, and weights of morph targets.
//! A pointer (RFC 6901) leads to one of them only if all that encloses it is there; itself it need not be.

use super::{Numbers, Property, Target};
use crate::load::gltf::schema::{Kind, Object, Range};
use crate::load::gltf::schema_tables::{EXTENSIONS, ROOT};
use crate::load::gltf::tree::Value;
use crate::load::paths::shorten;

/// A part of the document that numbers can be changed in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::load::gltf) enum Entry {
    Camera(usize),
    Light(usize),
    Material(usize),
    Mesh(usize),
    Node(usize),
}

impl Entry {
    /// Where it stands in the document.
    pub(super) fn pointer(self) -> String {
        match self {
            Self::Camera(i) => format!("/cameras/{i}"),
            Self::Light(i) => format!("/extensions/KHR_lights_punctual/lights/{i}"),
            Self::Material(i) => format!("/materials/{i}"),
            Self::Mesh(i) => format!("/meshes/{i}"),
            Self::Node(i) => format!("/nodes/{i}"),
        }
    }

    /// The entry that these steps from the root lead through, if there is one.
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

    /// How many steps lead to it.
    fn depth(self) -> usize {
        if matches!(self, Self::Light(_)) { 4 } else { 2 }
    }
}

/// What a pointer leads to.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::load::gltf) struct Pointed {
    /// The part of the document that is changed.
    pub(in crate::load::gltf) entry: Entry,
    /// The steps from there.
    pub(in crate::load::gltf) steps: Vec<String>,
    pub(super) form: Form,
}

/// What stands where a pointer leads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    /// So many numbers, up to four: one by itself, others in a list.
    Numbers(usize, Range),
    /// True or false.
    Switch,
    /// The weights of all morph targets, or that of one.
    Weights(Option<usize>),
}

impl Pointed {
    /// The pointer, written in the one way that it can be.
    pub(super) fn pointer(&self) -> String {
        let steps = self.steps.iter().map(|step| format!("/{}", step.replace('~', "~0").replace('/', "~1")));
        steps.fold(self.entry.pointer(), |pointer, step| pointer + &step)
    }

    /// The pointer to all weights, where this leads to one of them.
    pub(super) fn whole(&self) -> Option<String> {
        self.weights()?.map(|_| format!("{}/weights", self.entry.pointer()))
    }

    /// Of weights of morph targets: which of them, `Some(None)` being all.
    pub(super) fn weights(&self) -> Option<Option<usize>> {
        if let Form::Weights(which) = self.form { Some(which) } else { None }
    }

    /// Whether that may change materials, or which nodes are visible.
    pub(super) fn changes_materials(&self) -> bool {
        matches!(self.entry, Entry::Material(_)) || self.form == Form::Switch
    }

    /// Which numbers the keys of its channel may be.
    pub(super) fn numbers(&self) -> Numbers {
        if self.form == Form::Switch { Numbers::Bytes } else { Numbers::All }
    }
}

/// What a pointer aims at in a document that the schema check has seen.
///
/// # Errors
/// Why it leads to nothing that can be changed.
pub(super) fn target(root: &Value, pointer: &str) -> Result<Target, String> {
    let lost = |why: &str| format!("the pointer '{}' {why}", shorten(pointer));
    let steps = steps(pointer).ok_or_else(|| lost("is none: every step starts with a slash"))?;
    // What lies there is for others to know.
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

/// The steps of a pointer, as the document writes them; `None`: it is no pointer.
fn steps(pointer: &str) -> Option<Vec<String>> {
    let steps = pointer.strip_prefix('/')?.split('/');
    Some(steps.map(|step| step.replace("~1", "/").replace("~0", "~")).collect())
}

/// A place in a list, which is written in one way only.
fn index(step: &str) -> Option<usize> {
    let index: usize = step.parse().ok()?;
    (index.to_string() == step).then_some(index)
}

/// Where a pointer ends.
enum Leaf {
    /// No rule speaks of it.
    Unknown,
    /// Something that would enclose it is not there.
    Nowhere,
    Kind(&'static Kind),
}

/// Follows the steps of a pointer through the rules of the schema and the document beside them.
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

/// What of this kind can be animated; of switches only whether nodes are visible.
fn form(kind: &Kind, entry: Entry) -> Option<Form> {
    let range = |kind: &Kind| if let Kind::Number(range) = kind { Some(*range) } else { None };
    match kind {
        Kind::Number(range) => Some(Form::Numbers(1, *range)),
        Kind::List { of, min: 2..=4, max, .. } if matches!(max, 2..=4) => Some(Form::Numbers(*max, range(of)?)),
        Kind::Bool if matches!(entry, Entry::Node(_)) => Some(Form::Switch),
        _ => None,
    }
}
