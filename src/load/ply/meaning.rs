//! Meanings of properties, by the names that programs give them.

use super::header::{Element, Header, Kind, Property};

/// Names of the vertex properties that are read, by slot.
pub(super) const SLOTS: [&[&str]; 12] = [
    &["x"],
    &["y"],
    &["z"],
    &["nx", "normal_x"],
    &["ny", "normal_y"],
    &["nz", "normal_z"],
    &["u", "s", "texture_u", "texture_s"],
    &["v", "t", "texture_v", "texture_t"],
    &["red", "r", "diffuse_red", SPLAT[0]],
    &["green", "g", "diffuse_green", SPLAT[1]],
    &["blue", "b", "diffuse_blue", SPLAT[2]],
    &["alpha", "a", "opacity", "diffuse_alpha"],
];

/// Slots of properties that belong together, as indices into [`SLOTS`].
pub(super) const PLACE: [usize; 3] = [0, 1, 2];
pub(super) const NORMAL: [usize; 3] = [3, 4, 5];
pub(super) const UV: [usize; 2] = [6, 7];
pub(super) const COLOR: [usize; 3] = [RED, RED + 1, RED + 2];
pub(super) const RED: usize = 8;
pub(super) const ALPHA: usize = 11;

/// Colours of Gaussian splats, as the constant part of spherical harmonics (B. Kerbl and others, "3D Gaussian Splatting for
/// Real-Time Radiance Field Rendering", 2023).
const SPLAT: [&str; 3] = ["f_dc_0", "f_dc_1", "f_dc_2"];

/// Whether vertices are Gaussian splats. Their normals are 0, and their opacities those of a haze: both are ignored.
pub(super) fn are_splats(vertex: &Element) -> bool {
    SPLAT.iter().all(|name| vertex.properties.iter().any(|property| property.name == *name))
}

/// Meanings of the properties of a vertex.
pub(super) struct Meanings<'a> {
    /// Index into [`SLOTS`] of each property; of several with one meaning the first has it.
    pub slots: Vec<Option<usize>>,
    /// Names of the first two properties of each meaning that several have.
    pub twice: Vec<[&'a str; 2]>,
}

impl<'a> Meanings<'a> {
    pub(super) fn of(vertex: &'a Element) -> Self {
        let (splats, hazy) = (are_splats(vertex), [NORMAL[0], NORMAL[1], NORMAL[2], ALPHA]);
        let mut said: [Vec<&str>; SLOTS.len()] = Default::default();
        let slot = |property: &'a Property| {
            let name = property.name.as_str();
            let found = SLOTS.iter().position(|names| names.contains(&name));
            let slot = found.filter(|slot| property.length.is_none() && !(splats && hazy.contains(slot)))?;
            if said[slot].len() < 2 {
                said[slot].push(name);
            }
            (said[slot].len() == 1).then_some(slot)
        };
        let slots = vertex.properties.iter().map(slot).collect();
        let twice = said.iter().filter_map(|names| names.as_slice().try_into().ok());
        Self { slots, twice: twice.collect() }
    }
}

/// Encoding of a colour channel.
#[derive(Clone, Copy, Debug)]
pub(super) enum Light {
    /// A number relative to this value of full light.
    Of(f64),
    /// Spherical harmonic of a splat.
    OfSplat,
}

impl Light {
    pub(super) fn said_by(property: &Property) -> Self {
        if SPLAT.contains(&property.name.as_str()) { Self::OfSplat } else { Self::Of(unit(property.kind)) }
    }

    /// Decodes a value to 0…1.
    #[inline]
    pub(super) fn part(self, value: f64) -> f64 {
        /// 1 / (2 √π), the constant spherical harmonic.
        const EVEN: f64 = 0.282_094_791_773_878_14;
        match self {
            Self::Of(full) => value / full,
            Self::OfSplat => (0.5 + EVEN * value).clamp(0.0, 1.0),
        }
    }
}

/// Index of the property that lists the corners of faces.
pub(super) fn list_of(element: &Element) -> Option<usize> {
    let lists = |property: &Property| {
        property.length.is_some()
            && matches!(property.name.as_str(), "vertex_indices" | "vertex_index" | "vertex_idx" | "vertex_ids")
    };
    element.properties.iter().position(lists)
}

/// Indices of the properties that hold the ends of an edge.
pub(super) fn ends(element: &Element) -> Option<[usize; 2]> {
    let number = |property: &Property, name: &str| property.length.is_none() && property.name == name;
    let slot = |name| element.properties.iter().position(|property| number(property, name));
    Some([slot("vertex1")?, slot("vertex2")?])
}

/// Value of full light in colours of a number type.
fn unit(kind: Kind) -> f64 {
    match kind {
        Kind::F32 | Kind::F64 => 1.0,
        Kind::U16 => 65535.0,
        _ => 255.0,
    }
}

/// Which properties of faces and edges are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct WantedProperties {
    /// Whether their colours are read: not where vertices have colours, which are finer.
    pub colors: bool,
    /// Whether the texture coordinates and pictures of corners are read: only where the file names pictures.
    pub pictures: bool,
}

impl WantedProperties {
    pub(super) fn of(header: &Header) -> Self {
        let vertex = header.elements.iter().find(|element| element.name == "vertex" && element.count > 0);
        let slots = vertex.map(|element| Meanings::of(element).slots).unwrap_or_default();
        let has_colors = COLOR.iter().all(|slot| slots.contains(&Some(*slot)));
        Self { colors: !has_colors, pictures: !header.pictures.is_empty() }
    }
}

/// Use of a property of a face or an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Use {
    /// List of the corners.
    Corners,
    /// Vertex at this end of an edge.
    End(usize),
    /// Texture coordinates of the corners, u and v interleaved.
    Uvs,
    /// Index of the picture; negative: none.
    Picture,
    /// Channel of the colour: red, green, blue or opacity.
    Light(usize),
    Nothing,
}

/// Use of each property of faces whose corners are in `list`; for strips, whose triangles share corners, only corners and
/// colours are used.
pub(super) fn uses_in_faces(face: &Element, list: usize, strips: bool, wanted: WantedProperties) -> Vec<Use> {
    let of = |(k, property): (usize, &Property)| match (property.name.as_str(), property.length) {
        _ if k == list => Use::Corners,
        ("texcoord", Some(_)) if wanted.pictures && !strips => Use::Uvs,
        ("texnumber", None) if wanted.pictures && !strips => Use::Picture,
        _ => light_in(face, k, wanted),
    };
    face.properties.iter().enumerate().map(of).collect()
}

/// Use of each property of edges with these ends.
pub(super) fn uses_in_edges(edge: &Element, ends: [usize; 2], wanted: WantedProperties) -> Vec<Use> {
    let of = |k| match ends.iter().position(|&end| end == k) {
        Some(end) => Use::End(end),
        None => light_in(edge, k, wanted),
    };
    (0..edge.properties.len()).map(of).collect()
}

/// Whether elements have colours.
pub(super) fn are_colored(element: &Element) -> bool {
    let has = |slot: &usize| element.properties.iter().any(|property| is_in(property, *slot));
    COLOR.iter().all(has)
}

/// Colour channel of the `k`th property, if it is the first for that channel.
fn light_in(element: &Element, k: usize, wanted: WantedProperties) -> Use {
    let (before, rest) = element.properties.split_at(k);
    let part = (RED..=ALPHA).find(|&slot| rest.first().is_some_and(|property| is_in(property, slot)));
    let first = part.filter(|&slot| !before.iter().any(|property| is_in(property, slot)));
    first.filter(|_| wanted.colors && are_colored(element)).map_or(Use::Nothing, |slot| Use::Light(slot - RED))
}

fn is_in(property: &Property, slot: usize) -> bool {
    property.length.is_none() && SLOTS[slot].contains(&property.name.as_str())
}
