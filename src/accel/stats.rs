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
