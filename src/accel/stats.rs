//! What a structure is made of, in V. Havran's names.

/// Sizes of a built structure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StructureStats {
    /// Interior nodes; a grid's top level counts as one.
    pub n_in: u64,
    /// Cells: leaves of grid and octrees.
    pub n_v: u64,
    /// Cells with nothing listed.
    pub n_ev: u64,
    /// References: prims listed, over all cells.
    pub n_oiv: u64,
    /// Bytes of the structure, without the shapes.
    pub bytes: u64,
    /// Levels of the deepest cell below the top level; 0 for a plain grid.
    pub depth: u32,
}

impl StructureStats {
    /// Every prim listed once, and nothing built.
    pub(super) fn listing(prims: u32) -> Self {
        Self { n_oiv: u64::from(prims), ..Self::default() }
    }
}

/// Checks that each prim is listed once: `lists` has how often each is, `place` is what lists them.
pub(super) fn listed_once(lists: &[u32], place: &str) -> Result<(), String> {
    match lists.iter().position(|&n| n != 1) {
        Some(prim) => Err(format!("prim {prim} is in {} {place}", lists[prim])),
        None => Ok(()),
    }
}
