//! Draco streams -> indices and vertex values, in the types that accessors declare.

use gltf::json::accessor::ComponentType;

/// Attributes that a stream may have in addition to the requested ones.
pub(super) const SPARE: usize = 2;

/// A requested attribute, in the type that its accessor declares.
#[derive(Clone, Debug)]
#[cfg_attr(not(feature = "draco"), expect(dead_code, reason = "only the decoder looks for attributes"))]
pub(super) struct WantedAttribute {
    /// Id of the attribute in the stream.
    pub(super) id: u64,
    /// Name of the attribute, for messages.
    pub(super) name: String,
    pub(super) component: ComponentType,
    /// Components per value.
    pub(super) width: usize,
    /// Largest count of values that is accepted.
    pub(super) most: u64,
}

impl WantedAttribute {
    /// Upper bound of the bytes of all values.
    pub(super) fn size(&self) -> u64 {
        self.most.saturating_mul((self.width * self.component.size()) as u64)
    }
}

/// A decoded stream.
pub(super) struct Output {
    /// Triangle corners.
    pub(super) indices: Vec<u32>,
    /// Number of vertices, and so of values of each attribute.
    pub(super) vertices: u64,
    /// Packed values of all vertices, for each requested attribute.
    pub(super) attributes: Vec<Vec<u8>>,
}

/// Decodes a stream with at most the requested number of values.
///
/// # Errors
/// What is wrong with the stream, or which attribute it lacks.
#[cfg(feature = "draco")]
pub(super) fn decode(stream: &[u8], wanted: &[WantedAttribute]) -> Result<Output, String> {
    decoder::decode(stream, wanted)
}

/// Stub without the library, which returns an error.
#[cfg(not(feature = "draco"))]
pub(super) fn decode(_: &[u8], _: &[WantedAttribute]) -> Result<Output, String> {
    Err("this meshray was built without the feature 'draco'".into())
}

#[cfg(feature = "draco")]
mod decoder {
    //! Conversion of decoded values to the types that accessors declare.

    use super::{ComponentType, Output, WantedAttribute};
    use crate::catch_panic::attempt;
    use crate::load::gltf::draco_points::Points;
    use crate::load::gltf::draco_survey::check;
    use draco_oxide_core::attribute::Attribute;
    use draco_oxide_core::mesh::Mesh;
    use draco_oxide_decoder::Err as Failure;
    use draco_oxide_decoder::connectivity::Connectivity;

    pub(super) fn decode(stream: &[u8], wanted: &[WantedAttribute]) -> Result<Output, String> {
        let decoded = attempt(|| mesh(stream, wanted));
        let damaged = || String::from("the stream cannot be decoded: it is damaged");
        let (mesh, corners, points) = decoded.unwrap_or_else(|| Err(damaged()))?;
        let attribute = |wanted: &WantedAttribute| {
            let mut all = mesh.attributes.iter();
            let found = all.find(|attribute| attribute.get_id().as_usize() as u64 == wanted.id);
            let attribute = found.ok_or_else(|| format!("the stream has no attribute {}", wanted.id))?;
            let all = places(attribute);
            let chosen: Option<Vec<u32>> = match &points {
                Some(points) => points.shown.iter().map(|&point| all.get(point as usize).copied()).collect(),
                None => Some(all),
            };
            let values = Values {
                bytes: attribute.get_data_as_bytes(),
                kind: attribute.get_component_type().get_id(),
                width: attribute.get_num_components(),
            };
            let values = chosen.ok_or_else(lost).and_then(|places| values.convert(&places, wanted));
            values.map_err(|why| format!("{}: {why}", wanted.name))
        };
        let attributes: Vec<(Vec<u8>, usize)> = wanted.iter().map(attribute).collect::<Result<_, _>>()?;
        let vertices = attributes.first().map_or(0, |&(_, count)| count);
        if attributes.iter().any(|&(_, count)| count != vertices) {
            return Err(lost());
        }
        let number = |corner: u32| points.as_ref().map_or(corner, |points| points.number[corner as usize]);
        let attributes = attributes.into_iter().map(|(bytes, _)| bytes).collect();
        Ok(Output { indices: corners.into_iter().map(number).collect(), vertices: vertices as u64, attributes })
    }

    /// Returns the decoded mesh, the point of each corner, and the format's order of points where it differs from the library's.
    fn mesh(stream: &[u8], wanted: &[WantedAttribute]) -> Result<(Mesh, Vec<u32>, Option<Points>), String> {
        let survey = check(stream, wanted)?;
        let mesh = draco_oxide_decoder::decode_mesh(stream);
        let mesh = mesh.map_err(|why| match why {
            Failure::Unimplemented => String::from(
                "the stream uses what cannot be decoded yet: mostly values that are foretold across seams, as encoders do \
                 at levels 9 and 10 but not at 8",
            ),
            why => format!("the stream cannot be decoded: {why}"),
        })?;
        let corners: Vec<u32> = mesh.faces.iter().flatten().map(|&corner| usize::from(corner) as u32).collect();
        let Some(walked) = survey.connectivity.as_ref().and_then(Connectivity::edgebreaker) else {
            return Ok((mesh, corners, None));
        };
        let values: Vec<Vec<u32>> = mesh.attributes.iter().map(places).collect();
        let points = Points::of(walked, &survey.seams, &corners, &values).ok_or_else(lost)?;
        Ok((mesh, corners, Some(points)))
    }

    /// Index of the value of each point.
    fn places(attribute: &Attribute) -> Vec<u32> {
        match attribute.point_map_as_slice() {
            Some(map) => map.iter().map(|&place| usize::from(place) as u32).collect(),
            None => (0..attribute.len() as u32).collect(),
        }
    }

    fn lost() -> String {
        "a vertex without a value: the stream is damaged".into()
    }

    /// Decoded values, without duplicates.
    struct Values<'a> {
        bytes: &'a [u8],
        /// Draco's code of the component type.
        kind: u8,
        width: usize,
    }

    #[derive(Clone, Copy)]
    enum Number {
        Whole(i64),
        Float(f32),
    }

    impl Values<'_> {
        /// Converts the values at `places`, one per vertex, to the requested type; also returns their count.
        fn convert(&self, places: &[u32], w: &WantedAttribute) -> Result<(Vec<u8>, usize), String> {
            let count = places.len();
            if self.width != w.width {
                return Err(format!("{} components in the stream, {} in the accessor", self.width, w.width));
            }
            if count as u64 > w.most {
                return Err(format!("{count} values in the stream, where {} are possible", w.most));
            }
            let size = self.size()?;
            // The library stores values in native byte order, glTF in little-endian order.
            let same = self.kind == kind_of(w.component) && cfg!(target_endian = "little");
            let mut out = Vec::with_capacity(count * w.width * w.component.size());
            for &place in places {
                let value = (place as usize).checked_mul(size * self.width).and_then(|start| self.bytes.get(start..));
                let value = value.and_then(|rest| rest.get(..size * self.width));
                let value = value.ok_or_else(lost)?;
                if same {
                    out.extend_from_slice(value);
                    continue;
                }
                for component in value.chunks_exact(size) {
                    write(self.number(component), w.component, &mut out)?;
                }
            }
            Ok((out, count))
        }

        /// Bytes per component.
        fn size(&self) -> Result<usize, String> {
            match self.kind {
                1 | 2 => Ok(1),
                3 | 4 => Ok(2),
                5 | 6 | 9 => Ok(4),
                kind => Err(format!("components of Draco's type {kind} have no meaning in glTF")),
            }
        }

        /// Reads a component, which is in native byte order.
        fn number(&self, bytes: &[u8]) -> Number {
            let (one, two, four) = (bytes.first_chunk(), bytes.first_chunk(), bytes.first_chunk());
            match (self.kind, one, two, four) {
                (1, Some(&b), ..) => Number::Whole(i8::from_ne_bytes(b).into()),
                (2, Some(&b), ..) => Number::Whole(u8::from_ne_bytes(b).into()),
                (3, _, Some(&b), _) => Number::Whole(i16::from_ne_bytes(b).into()),
                (4, _, Some(&b), _) => Number::Whole(u16::from_ne_bytes(b).into()),
                (5, _, _, Some(&b)) => Number::Whole(i32::from_ne_bytes(b).into()),
                (6, _, _, Some(&b)) => Number::Whole(u32::from_ne_bytes(b).into()),
                (_, _, _, Some(&b)) => Number::Float(f32::from_ne_bytes(b)),
                // Unreachable: `size` rejects all other types.
                _ => Number::Whole(0),
            }
        }
    }

    /// Draco's code of a component type.
    fn kind_of(component: ComponentType) -> u8 {
        match component {
            ComponentType::I8 => 1,
            ComponentType::U8 => 2,
            ComponentType::I16 => 3,
            ComponentType::U16 => 4,
            ComponentType::U32 => 6,
            ComponentType::F32 => 9,
        }
    }

    /// Appends a number as a component of an accessor.
    fn write(number: Number, component: ComponentType, out: &mut Vec<u8>) -> Result<(), String> {
        let whole = match number {
            Number::Whole(whole) => whole,
            Number::Float(float) if component == ComponentType::F32 => {
                out.extend(float.to_le_bytes());
                return Ok(());
            }
            Number::Float(float) if float.fract() == 0.0 => float as i64,
            Number::Float(float) => return Err(format!("{float} in the stream, where the accessor has integers")),
        };
        let lost = || format!("{whole} in the stream does not fit the type of the accessor");
        match component {
            ComponentType::I8 => out.extend(i8::try_from(whole).map_err(|_| lost())?.to_le_bytes()),
            ComponentType::U8 => out.extend(u8::try_from(whole).map_err(|_| lost())?.to_le_bytes()),
            ComponentType::I16 => out.extend(i16::try_from(whole).map_err(|_| lost())?.to_le_bytes()),
            ComponentType::U16 => out.extend(u16::try_from(whole).map_err(|_| lost())?.to_le_bytes()),
            ComponentType::U32 => out.extend(u32::try_from(whole).map_err(|_| lost())?.to_le_bytes()),
            ComponentType::F32 => out.extend((whole as f32).to_le_bytes()),
        }
        Ok(())
    }
}
