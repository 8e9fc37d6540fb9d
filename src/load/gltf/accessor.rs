//! Reads accessors: every component type, normalised or not, interleaved, sparse, decoded from a compressed primitive, or
//! without a view (zeros).
//!
//! [`super::links`] has checked declared sizes against the views; here every read is bounds-checked, so that a buffer shorter
//! than declared ends in a diagnostic.

use super::buffers::Buffers;
use super::draco::Decoded;
use super::sparse::{Replaced, Replacements};
use crate::load::Diagnostic;
use crate::math::Vec3;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Index, Root, buffer};

/// Reads accessors of one document.
#[derive(Clone, Copy)]
pub(super) struct Reader<'a> {
    pub(super) root: &'a Root,
    pub(super) buffers: &'a Buffers<'a>,
    pub(super) replacements: &'a Replacements,
    pub(super) decoded: &'a Decoded,
}

/// Elements of an accessor to read.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pick<'a> {
    All,
    /// The elements with these indices, ascending and distinct.
    Only(&'a [u32]),
}

/// Minimum and maximum of up to 16 components.
pub(super) type Extent = [(f64, f64); 16];

/// Reason why an accessor could not be read.
#[derive(Clone, Debug)]
pub(super) enum Unreadable {
    /// The file does not say where the bytes are.
    Nowhere(Diagnostic),
    /// The buffer could not be read.
    Buffer(Diagnostic),
    /// The data ends too early.
    Data(super::codes::Code, String),
    /// An unknown component type or shape.
    Unknown,
}

/// Component type and shape of an accessor's elements.
#[derive(Clone, Copy)]
pub(super) struct Format {
    pub(super) component: ComponentType,
    pub(super) shape: Type,
    pub(super) normalized: bool,
}

impl Format {
    /// Returns the format of an accessor; `None` for types that glTF 2.0 does not know.
    pub(super) fn of(accessor: &Accessor) -> Option<Self> {
        let (Checked::Valid(component), Checked::Valid(shape)) = (accessor.component_type, accessor.type_) else {
            return None;
        };
        Some(Self { component: component.0, shape, normalized: accessor.normalized })
    }

    /// Number of components per element.
    pub(super) fn width(self) -> usize {
        self.shape.multiplicity()
    }

    /// Bytes of one component.
    pub(super) fn component_size(self) -> usize {
        self.component.size()
    }

    /// Byte offset of component `k` in an element: columns of matrices start at multiples of four bytes.
    fn offset(self, k: usize) -> usize {
        let rows = self.rows();
        (k / rows) * self.column_size() + (k % rows) * self.component_size()
    }

    fn rows(self) -> usize {
        match self.shape {
            Type::Mat2 => 2,
            Type::Mat3 => 3,
            Type::Mat4 => 4,
            _ => self.width(),
        }
    }

    fn is_matrix(self) -> bool {
        matches!(self.shape, Type::Mat2 | Type::Mat3 | Type::Mat4)
    }

    fn column_size(self) -> usize {
        let size = self.rows() * self.component_size();
        if self.is_matrix() { size.next_multiple_of(4) } else { size }
    }

    /// Bytes of one packed element, with the padding between matrix columns.
    pub(super) fn size(self) -> usize {
        self.width() / self.rows() * self.column_size()
    }
}

/// Location of consecutive elements in memory.
pub(super) struct Run<'a> {
    bytes: &'a [u8],
    stride: usize,
    format: Format,
}

impl<'a> Run<'a> {
    /// Returns the packed elements from byte `offset` of a view on.
    pub(super) fn packed(
        buffers: &'a Buffers,
        view: Index<buffer::View>,
        offset: u64,
        format: Format,
    ) -> Result<Self, Unreadable> {
        let bytes = match buffers.view(view) {
            Ok(bytes) => bytes,
            Err(Some(why)) => return Err(Unreadable::Buffer(why)),
            Err(None) => return Err(buffers.nowhere(view).map_or(Unreadable::Unknown, Unreadable::Nowhere)),
        };
        let offset = usize::try_from(offset).unwrap_or(usize::MAX);
        Ok(Self { bytes: bytes.get(offset..).unwrap_or_default(), stride: format.size(), format })
    }

    /// Applies the stride of the view, if it declares one.
    fn strided(self, root: &Root, view: Index<buffer::View>) -> Self {
        let stride = root.buffer_views.get(view.value()).and_then(|view| view.byte_stride).map_or(0, |s| s.0);
        Self { stride: if stride > 0 { stride } else { self.stride }, ..self }
    }

    /// Bytes of element `i`; `None` if the data ends before its end.
    fn element(&self, i: usize) -> Option<&'a [u8]> {
        self.bytes.get(i.checked_mul(self.stride)?..)?.get(..self.format.size())
    }

    /// Bytes of the first `count` elements, each complete; ends early where the data does.
    pub(super) fn elements(&self, count: usize) -> impl Iterator<Item = &'a [u8]> {
        (0..count).map_while(|i| self.element(i))
    }

    /// Number of complete elements.
    fn len(&self) -> usize {
        let rest = self.bytes.len().checked_sub(self.format.size());
        rest.map_or(0, |rest| rest / self.stride.max(1) + 1)
    }
}

impl<'a> Reader<'a> {
    /// Reads elements of `N` floats; integers are normalised when the accessor says so.
    pub(super) fn floats<const N: usize>(
        &self,
        index: Index<Accessor>,
        pick: Pick,
    ) -> Result<Vec<[f32; N]>, Unreadable> {
        if let Pick::All = pick
            && let Some(bytes) = self.packed(index, is_floats::<N>)
        {
            let elements = bytes.as_chunks::<4>().0.as_chunks::<N>().0;
            return Ok(elements.iter().map(|element| element.map(f32::from_le_bytes)).collect());
        }
        self.elements(index, pick, [0.0; N], |element, format| match stored::<N>(element, format) {
            Some(floats) => floats,
            None => std::array::from_fn(|k| if k < format.width() { float(element, format, k) } else { 0.0 }),
        })
    }

    /// Reads elements of `N` unsigned integers.
    pub(super) fn integers<const N: usize>(
        &self,
        index: Index<Accessor>,
        pick: Pick,
    ) -> Result<Vec<[u32; N]>, Unreadable> {
        self.elements(index, pick, [0; N], |element, format| {
            std::array::from_fn(|k| if k < format.width() { integer(element, format, k) } else { 0 })
        })
    }

    /// Reads all elements as unsigned scalars.
    pub(super) fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, Unreadable> {
        if let Some(decoded) = self.decoded.indices(index.value()) {
            return Ok(decoded.to_vec());
        }
        let packed = |component| self.packed(index, |format| format.component == component && format.width() == 1);
        if let Some(bytes) = packed(ComponentType::U32) {
            return Ok(bytes.as_chunks().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect());
        }
        if let Some(bytes) = packed(ComponentType::U16) {
            return Ok(bytes.as_chunks().0.iter().map(|bytes| u32::from(u16::from_le_bytes(*bytes))).collect());
        }
        self.elements(index, Pick::All, 0, |element, format| integer(element, format, 0))
    }

    /// Bytes of all elements, if the accessor is packed, complete, not sparse and of a wanted format: most are.
    fn packed(&self, index: Index<Accessor>, is_wanted: impl Fn(Format) -> bool) -> Option<&'a [u8]> {
        let accessor = self.root.accessors.get(index.value()).filter(|accessor| accessor.sparse.is_none())?;
        let format = Format::of(accessor).filter(|format| is_wanted(*format))?;
        let run = self.run(index, accessor, format).ok()??;
        let bytes = usize::try_from(self.count(index)).ok()?.checked_mul(format.size())?;
        run.bytes.get(..bytes).filter(|_| run.stride == format.size())
    }

    /// Number of elements of an accessor: those decoded, or else those declared.
    pub(super) fn count(&self, index: Index<Accessor>) -> u64 {
        let declared = || self.root.accessors.get(index.value()).map_or(0, |accessor| accessor.count.0);
        self.decoded.count(index.value()).unwrap_or_else(declared)
    }

    /// Returns whether all elements are zero because the file stores no data for the accessor.
    pub(super) fn is_blank(&self, index: Index<Accessor>) -> bool {
        let accessor = self.root.accessors.get(index.value());
        let nowhere = accessor.is_some_and(|a| a.buffer_view.is_none() && a.sparse.is_none());
        nowhere && self.decoded.count(index.value()).is_none()
    }

    /// Returns the minimum and maximum of each component, not normalised; non-finite numbers are skipped.
    ///
    /// Small sparse accessors are read whole; `None` for large ones, for those without data, and for those of compressed
    /// primitives: their bounds date from before compression, which moves vertices slightly.
    pub(super) fn extent(&self, index: Index<Accessor>) -> Option<Result<Extent, Unreadable>> {
        /// Most elements of a sparse accessor that are read only to check bounds.
        const SMALL: u64 = 1 << 16;
        let accessor = self.root.accessors.get(index.value())?;
        let format = Format::of(accessor)?;
        if self.decoded.count(index.value()).is_some() {
            return None;
        }
        match (&accessor.sparse, accessor.buffer_view) {
            (Some(_), _) if accessor.count.0 <= SMALL => {
                let values = self.elements(index, Pick::All, [0.0; 16], raws);
                Some(values.map(|values| extent_of(values.into_iter(), format)))
            }
            (None, Some(view)) => {
                let count = usize::try_from(accessor.count.0).ok()?;
                let run = self.view(view, accessor, format);
                Some(run.map(|run| {
                    let vectors = |element| stored::<3>(element, format);
                    extent_of_vectors(run.elements(count).map(vectors))
                        .unwrap_or_else(|| extent_of(run.elements(count).map(|element| raws(element, format)), format))
                }))
            }
            _ => None,
        }
    }

    fn elements<T: Copy>(
        &self,
        index: Index<Accessor>,
        pick: Pick,
        zero: T,
        read: impl Fn(&[u8], Format) -> T,
    ) -> Result<Vec<T>, Unreadable> {
        let accessor = self.root.accessors.get(index.value()).ok_or(Unreadable::Unknown)?;
        let format = Format::of(accessor).ok_or(Unreadable::Unknown)?;
        let count = usize::try_from(self.count(index)).map_err(|_| Unreadable::Unknown)?;
        let wanted = match pick {
            Pick::All => count,
            Pick::Only(list) => list.len(),
        };
        let mut values = match self.run(index, accessor, format)? {
            Some(run) => {
                let read = |element| read(element, format);
                // Each element takes at least a byte, which bounds the capacity.
                let mut values: Vec<T> = Vec::with_capacity(wanted.min(run.len()));
                match pick {
                    Pick::All => values.extend(run.elements(count).map(read)),
                    Pick::Only(list) => {
                        values.extend(list.iter().map_while(|&i| run.element(i as usize)).map(read));
                    }
                }
                if values.len() < wanted {
                    return Err(short(count, run.len()));
                }
                values
            }
            None => vec![zero; wanted],
        };
        if let Some(sparse) = &accessor.sparse {
            let replaced = self.replacements.of(index.value())?;
            let new = Run::packed(self.buffers, sparse.values.buffer_view, sparse.values.byte_offset.0, format)?;
            let lost = || short(replaced.len(), new.len());
            for (slot, replaced) in hits(replaced, pick) {
                let element = new.element(replaced.value as usize).ok_or_else(lost)?;
                values.get_mut(slot).into_iter().for_each(|value| *value = read(element, format));
            }
        }
        Ok(values)
    }

    /// Location of the elements of an accessor; `None` if they are not stored and thus zero.
    fn run(&self, index: Index<Accessor>, accessor: &Accessor, format: Format) -> Result<Option<Run<'a>>, Unreadable> {
        if let Some(bytes) = self.decoded.values(index.value()) {
            return Ok(Some(Run { bytes, stride: format.size(), format }));
        }
        accessor.buffer_view.map(|view| self.view(view, accessor, format)).transpose()
    }

    fn view(&self, view: Index<buffer::View>, accessor: &Accessor, format: Format) -> Result<Run<'a>, Unreadable> {
        let offset = accessor.byte_offset.unwrap_or_default().0;
        Ok(Run::packed(self.buffers, view, offset, format)?.strided(self.root, view))
    }
}

/// Replaced elements among those that are read, each with its index in the result.
fn hits<'a>(replaced: &'a [Replaced], pick: Pick<'a>) -> impl Iterator<Item = (usize, &'a Replaced)> {
    let (list, all) = match pick {
        Pick::All => (&[][..], replaced),
        Pick::Only(list) => (list, &[][..]),
    };
    let found = |element: u32| replaced.binary_search_by_key(&element, |r| r.element).ok().map(|at| &replaced[at]);
    let picked = list.iter().enumerate().filter_map(move |(slot, &element)| Some((slot, found(element)?)));
    all.iter().map(|r| (r.element as usize, r)).chain(picked)
}

fn short(count: usize, found: usize) -> Unreadable {
    let text = format!("{count} elements are declared, the data ends after {found}");
    Unreadable::Data(super::codes::Code::AccessorTooLong, text)
}

/// Floats of an element that is exactly `N` packed floats, as nearly all are.
#[inline(always)]
fn stored<const N: usize>(element: &[u8], format: Format) -> Option<[f32; N]> {
    let floats = element.as_chunks::<4>().0.first_chunk::<N>().filter(|_| is_floats::<N>(format))?;
    Some(floats.map(f32::from_le_bytes))
}

/// Returns whether elements are `N` packed floats.
#[inline(always)]
fn is_floats<const N: usize>(format: Format) -> bool {
    format.component == ComponentType::F32 && !format.is_matrix() && format.width() == N
}

/// Reads `N` bytes of an element; zeros past its end, which valid formats never reach.
fn bytes<const N: usize>(element: &[u8], at: usize) -> [u8; N] {
    element.get(at..at + N).and_then(|b| b.try_into().ok()).unwrap_or([0; N])
}

/// Component `k` as a float, converted as in glTF 2.0 §3.11.
fn float(element: &[u8], format: Format, k: usize) -> f32 {
    let at = format.offset(k);
    let scale = |value: f32, largest: f32| if format.normalized { (value / largest).max(-1.0) } else { value };
    match format.component {
        ComponentType::F32 => f32::from_le_bytes(bytes(element, at)),
        ComponentType::I8 => scale(f32::from(i8::from_le_bytes(bytes(element, at))), 127.0),
        ComponentType::U8 => scale(f32::from(u8::from_le_bytes(bytes(element, at))), 255.0),
        ComponentType::I16 => scale(f32::from(i16::from_le_bytes(bytes(element, at))), 32767.0),
        ComponentType::U16 => scale(f32::from(u16::from_le_bytes(bytes(element, at))), 65535.0),
        ComponentType::U32 => u32::from_le_bytes(bytes(element, at)) as f32,
    }
}

/// All components as stored, not normalised.
fn raws(element: &[u8], format: Format) -> [f64; 16] {
    std::array::from_fn(|k| if k < format.width() { raw(element, format, k) } else { 0.0 })
}

/// Minimum and maximum of each component; non-finite numbers are skipped.
fn extent_of(elements: impl Iterator<Item = [f64; 16]>, format: Format) -> Extent {
    let mut extent = [(f64::INFINITY, f64::NEG_INFINITY); 16];
    for element in elements {
        for ((lo, hi), value) in extent.iter_mut().zip(element).take(format.width()).filter(|(_, v)| v.is_finite()) {
            (*lo, *hi) = (lo.min(value), hi.max(value));
        }
    }
    extent
}

/// Fast path of [`extent_of`] for vectors of three floats; `None` for other formats and if any number is not finite.
fn extent_of_vectors(mut vectors: impl Iterator<Item = Option<[f32; 3]>>) -> Option<Extent> {
    let (mut lo, mut hi) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    // Products with 0 are NaN for non-finite numbers.
    let mut zero = Vec3::ZERO;
    vectors.try_for_each(|vector| {
        let v = Vec3::from(vector?);
        (lo, hi, zero) = (lo.min(v), hi.max(v), zero + v * 0.0);
        Some(())
    })?;
    let mut extent = [(f64::INFINITY, f64::NEG_INFINITY); 16];
    for (k, range) in extent.iter_mut().take(3).enumerate() {
        *range = (f64::from(lo[k]), f64::from(hi[k]));
    }
    (zero == Vec3::ZERO).then_some(extent)
}

/// Component `k` as stored, not normalised.
fn raw(element: &[u8], format: Format, k: usize) -> f64 {
    match format.component {
        ComponentType::U32 => f64::from(integer(element, format, k)),
        _ => f64::from(float(element, Format { normalized: false, ..format }, k)),
    }
}

/// Component `k` as an unsigned integer; zero for signed and floating-point components, which are not indices.
pub(super) fn integer(element: &[u8], format: Format, k: usize) -> u32 {
    let at = format.offset(k);
    match format.component {
        ComponentType::U8 => u32::from(u8::from_le_bytes(bytes(element, at))),
        ComponentType::U16 => u32::from(u16::from_le_bytes(bytes(element, at))),
        ComponentType::U32 => u32::from_le_bytes(bytes(element, at)),
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn format(component: ComponentType, shape: Type, normalized: bool) -> Format {
        Format { component, shape, normalized }
    }

    #[test]
    fn normalised_integers_reach_exactly_their_ends() {
        let at = |component, bytes: &[u8]| float(bytes, format(component, Type::Scalar, true), 0);
        assert_eq!(at(ComponentType::I8, &[0x80]), -1.0);
        assert_eq!(at(ComponentType::I8, &[0x81]), -1.0);
        assert_eq!(at(ComponentType::I8, &[127]), 1.0);
        assert_eq!(at(ComponentType::U8, &[255]), 1.0);
        assert_eq!(at(ComponentType::U8, &[51]), 0.2);
        assert_eq!(at(ComponentType::I16, &[0x00, 0x80]), -1.0);
        assert_eq!(at(ComponentType::I16, &[0xff, 0x7f]), 1.0);
        assert_eq!(at(ComponentType::U16, &[0xff, 0xff]), 1.0);
        assert_eq!(float(&[0x80], format(ComponentType::I8, Type::Scalar, false), 0), -128.0);
    }

    #[test]
    fn vectors_of_floats_have_the_extent_of_any_others() {
        let vector = format(ComponentType::F32, Type::Vec3, false);
        let bytes = |numbers: [f32; 6]| numbers.map(f32::to_le_bytes).concat();
        let elements = |bytes: &[u8]| bytes.chunks(12).map(<[u8]>::to_vec).collect::<Vec<_>>();
        for (numbers, quick) in [([1.0, -2.0, 3.0, -4.0, 5.0, 6.5], true), ([1.0, f32::NAN, 3.0, 4.0, 5.0, 6.0], false)]
        {
            let elements = elements(&bytes(numbers));
            let slow = extent_of(elements.iter().map(|e| raws(e, vector)), vector);
            let found = extent_of_vectors(elements.iter().map(|e| stored(e, vector)));
            assert_eq!(found, quick.then_some(slow));
        }
        assert_eq!(stored::<3>(&[0; 6], format(ComponentType::U16, Type::Vec3, true)), None);
    }

    #[test]
    fn matrix_columns_start_at_multiples_of_four_bytes() {
        let small = format(ComponentType::U8, Type::Mat2, false);
        assert_eq!((small.size(), small.offset(1), small.offset(2), small.offset(3)), (8, 1, 4, 5));
        let three = format(ComponentType::U8, Type::Mat3, false);
        assert_eq!((three.size(), three.offset(3), three.offset(8)), (12, 4, 10));
        let half = format(ComponentType::U16, Type::Mat3, false);
        assert_eq!((half.size(), half.offset(3), half.offset(6)), (24, 8, 16));
        assert_eq!(format(ComponentType::F32, Type::Mat4, false).size(), 64);
        assert_eq!(format(ComponentType::U8, Type::Vec3, false).size(), 3);
    }
}
