//! Sizes of a structure, in V. Havran's names.

/// Sizes of a built structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StructureStats {
    /// Inner nodes; a grid's top level counts as one.
    pub n_in: u64,
    /// Cells: leaves of grid and octrees.
    pub n_v: u64,
    /// Cells whose lists are empty.
    pub n_ev: u64,
    /// References: prims listed, over all cells.
    pub n_oiv: u64,
    /// Size of the structure in bytes, without the shapes.
    pub bytes: u64,
    /// Depth of the deepest cell, in levels below the top one; 0 for a plain grid.
    pub depth: u32,
}

impl StructureStats {
    /// Sizes of a structure that lists every prim once and builds nothing.
    pub(super) fn listing(prims: u32) -> Self {
        Self { n_oiv: u64::from(prims), ..Self::default() }
    }
}

/// Checks that each prim is listed once: `lists` counts its listings, `place` names the lists in the error.
pub(super) fn listed_once(lists: &[u32], place: &str) -> Result<(), String> {
    match lists.iter().position(|&n| n != 1) {
        Some(prim) => Err(format!("prim {prim} is in {} {place}", lists[prim])),
        None => Ok(()),
    }
}
