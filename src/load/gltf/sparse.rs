//! Sparse parts of accessors: the elements that they replace, read and checked once for the whole file.

use super::accessor::{Format, Run, Unreadable, integer};
use super::buffers::Buffers;
use super::codes::Code;
use super::report::Report;
use crate::load::limits::{Budget, OverBudget};
use gltf::json::accessor::{Accessor, Type};
use gltf::json::validation::Checked;
use gltf::json::{Root, accessor::sparse::Sparse};

/// Replaced elements of each accessor.
pub(super) struct Replacements(Vec<Result<Vec<Replaced>, Unreadable>>);

/// One replaced element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Replaced {
    /// Index of the element in the accessor.
    pub(super) element: u32,
    /// Index of its value among the sparse values.
    pub(super) value: u32,
}

impl Replacements {
    /// Reads the indices of every sparse accessor.
    ///
    /// # Errors
    /// If the lists would exceed the rest of `budget`.
    pub(super) fn load(
        root: &Root,
        buffers: &Buffers,
        budget: &mut Budget,
        report: &mut Report,
    ) -> Result<Self, OverBudget> {
        let mut all = Vec::with_capacity(root.accessors.len());
        for (i, accessor) in root.accessors.iter().enumerate() {
            let Some(sparse) = &accessor.sparse else {
                all.push(Ok(Vec::new()));
                continue;
            };
            budget.take(sparse.count.0, size_of::<Replaced>() as u64)?;
            all.push(read(buffers, accessor, sparse, &format!("accessors[{i}].sparse.indices"), report));
        }
        Ok(Self(all))
    }

    /// Replaced elements of an accessor, ascending and distinct.
    pub(super) fn of(&self, accessor: usize) -> Result<&[Replaced], Unreadable> {
        match self.0.get(accessor) {
            Some(Ok(list)) => Ok(list),
            Some(Err(why)) => Err(why.clone()),
            None => Ok(&[]),
        }
    }
}

fn read(
    buffers: &Buffers,
    accessor: &Accessor,
    sparse: &Sparse,
    place: &str,
    report: &mut Report,
) -> Result<Vec<Replaced>, Unreadable> {
    let Checked::Valid(component) = sparse.indices.component_type else { return Err(Unreadable::Unknown) };
    let format = Format { component: component.0, shape: Type::Scalar, normalized: false };
    let run = Run::packed(buffers, sparse.indices.buffer_view, sparse.indices.byte_offset.0, format)?;
    let count = usize::try_from(sparse.count.0).map_err(|_| Unreadable::Unknown)?;
    let elements: Vec<u32> = run.elements(count).map(|element| integer(element, format, 0)).collect();
    if elements.len() < count {
        let text = format!("{count} indices are declared, the data ends after {}", elements.len());
        report.add(Code::AccessorTooLong, place, text);
    }
    let length = accessor.count.0;
    if let Some(at) = elements.iter().position(|&element| u64::from(element) >= length) {
        let text = format!("index {} at position {at}, but only {length} elements exist", elements[at]);
        report.add(Code::AccessorSparseIndexOob, place, text);
        return Ok(Vec::new());
    }
    let replaced = elements.iter().zip(0..).map(|(&element, value)| Replaced { element, value });
    let mut replaced: Vec<Replaced> = replaced.collect();
    if let Some(at) = elements.windows(2).position(|pair| pair[0] >= pair[1]) {
        let text = format!("index {} at position {} follows {}", elements[at + 1], at + 1, elements[at]);
        report.add(Code::AccessorSparseIndicesNonIncreasing, place, text);
        // The last of several values for an element counts, and is sorted first.
        replaced.sort_unstable_by_key(|r| (r.element, std::cmp::Reverse(r.value)));
        replaced.dedup_by_key(|r| r.element);
    }
    Ok(replaced)
}
