//! Cells and octree nodes as flat arrays, and the splitting of crowded cells.

use super::lattice::{Cube, Lattice};
use super::overlap::Overlap;
use super::{EMPTY, GridParams, NODE};
use crate::accel::Shapes;
use crate::math::DVec3;

/// Number of references allowed in any scene, in addition to [`GridParams::references`] per prim.
const FREE_REFERENCES: f64 = 1024.0;

/// All cells with their lists, and the octree nodes between them and the top grid.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Eight entries per node: another node, marked [`NODE`], or a cell.
    pub nodes: Vec<[u32; 8]>,
    /// Index of the first reference of each cell, and one past the last.
    first: Vec<u32>,
    /// Listed prims, ascending within a cell.
    pub refs: Vec<u32>,
}

/// Offsets by which a part's nodes and cells moved when it was appended.
pub(super) struct Moved {
    node: u32,
    cell: u32,
}

impl Moved {
    /// Translates an entry of the part into one of the whole.
    pub(super) fn entry(&self, entry: u32) -> u32 {
        match entry {
            EMPTY => EMPTY,
            e if e & NODE != 0 => e + self.node,
            e => e + self.cell,
        }
    }
}

impl Cells {
    /// Creates the arrays with the empty cell alone.
    pub(super) fn new() -> Self {
        Self { nodes: Vec::new(), first: vec![0, 0], refs: Vec::new() }
    }

    /// Prims listed in a cell.
    #[inline]
    pub(super) fn list(&self, cell: u32) -> &[u32] {
        &self.refs[self.first[cell as usize] as usize..self.first[cell as usize + 1] as usize]
    }

    /// Number of distinct cells; all empty ones are cell 0.
    pub(super) fn len(&self) -> usize {
        self.first.len() - 1
    }

    /// Size of the arrays, in bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.first) + size_of_val(&*self.refs)
    }

    fn push_cell(&mut self, prims: impl IntoIterator<Item = u32>) -> u32 {
        let before = self.refs.len();
        self.refs.extend(prims);
        if self.refs.len() == before {
            return EMPTY;
        }
        self.first.push(index(self.refs.len()));
        index(self.len() - 1)
    }

    /// Appends the cells and nodes of another builder.
    pub(super) fn append(&mut self, part: Self) -> Moved {
        let moved = Moved { node: index(self.nodes.len()), cell: index(self.len() - 1) };
        let refs = index(self.refs.len());
        self.nodes.extend(part.nodes.iter().map(|node| node.map(|e| moved.entry(e))));
        self.first.extend(part.first[2..].iter().map(|f| f + refs));
        self.refs.extend(part.refs);
        moved
    }
}

/// Turns the lists of top cells into cells or octrees.
pub(super) struct Refiner<'a> {
    shapes: &'a Shapes,
    lattice: &'a Lattice,
    step_cost: f64,
    leaf_size: Option<u32>,
    /// Factor by which the number of references may grow below the top cells.
    growth: f64,
    cells: Cells,
}

impl<'a> Refiner<'a> {
    pub(super) fn new(shapes: &'a Shapes, lattice: &'a Lattice, params: &GridParams, listed: usize) -> Self {
        let growth = (f64::from(shapes.bounded()) * params.references + FREE_REFERENCES) / listed.max(1) as f64;
        let GridParams { step_cost, leaf_size, .. } = *params;
        Self { shapes, lattice, step_cost, leaf_size, growth, cells: Cells::new() }
    }

    pub(super) fn into_cells(self) -> Cells {
        self.cells
    }

    /// Adds a top cell that lists these prims, split if that pays, and returns its entry.
    pub(super) fn cell(&mut self, cube: Cube, prims: &[u32]) -> u32 {
        if cube.level == 0 || !self.could_pay(prims.len()) {
            return self.cells.push_cell(prims.iter().copied());
        }
        let overlaps: Vec<Overlap> = prims.iter().map(|&p| Overlap::new(self.shapes, p, self.lattice)).collect();
        let members: Vec<u32> = (0..index(prims.len())).collect();
        self.split(cube, &members, self.growth, &Crowd { prims, overlaps: &overlaps })
    }

    /// Splits the cube if that is expected to pay, and each octant in turn; returns the entry.
    ///
    /// `growth` is the number of references the cell may turn into, per reference it has. A split divides it by its own
    /// growth of the lists, the same on every path; so prims that no split can separate end in one list, not in millions.
    fn split(&mut self, cube: Cube, members: &[u32], growth: f64, crowd: &Crowd) -> u32 {
        let leaf = |cells: &mut Cells| cells.push_cell(members.iter().map(|&m| crowd.prims[m as usize]));
        if cube.level == 0 || !self.could_pay(members.len()) {
            return leaf(&mut self.cells);
        }
        let masks: Vec<u8> = members.iter().map(|&m| crowd.octants(m, cube)).collect();
        let listed: u32 = masks.iter().map(|m| m.count_ones()).sum();
        let growth = growth * members.len() as f64 / f64::from(listed.max(1));
        if growth < 1.0 || !self.pays(members.len(), listed) {
            return leaf(&mut self.cells);
        }

        let node = self.cells.nodes.len();
        self.cells.nodes.push([EMPTY; 8]);
        let mut inside = Vec::with_capacity(members.len());
        for octant in 0..8 {
            inside.clear();
            inside.extend(members.iter().zip(&masks).filter(|(_, m)| *m >> octant & 1 == 1).map(|(&m, _)| m));
            self.cells.nodes[node][octant as usize] = self.split(cube.octant(octant), &inside, growth, crowd);
        }
        index(node) | NODE
    }

    /// Whether splitting a cell of `prims` prims into octants with `listed` references pays. A ray through a cube meets each
    /// octant with probability 1/4 (the ratio of their surfaces), which gives the expected cost of the octants against that
    /// of the whole. The test also ends splitting where octants keep nearly all prims. With a leaf size, exceeding it is
    /// reason enough (A. Glassner, *Space Subdivision for Fast Ray Tracing*, 1984).
    fn pays(&self, prims: usize, listed: u32) -> bool {
        if let Some(leaf_size) = self.leaf_size {
            return prims > leaf_size as usize;
        }
        0.25 * (8.0 * self.step_cost + f64::from(listed)) < self.step_cost + prims as f64
    }

    /// Whether splitting pays if no prim is listed twice.
    fn could_pay(&self, prims: usize) -> bool {
        prims > 1 && self.pays(prims, index(prims))
    }
}

/// Prims of one top cell.
struct Crowd<'a> {
    prims: &'a [u32],
    overlaps: &'a [Overlap],
}

impl Crowd<'_> {
    /// Bit mask of the octants of the cube that member `m` overlaps.
    fn octants(&self, m: u32, cube: Cube) -> u8 {
        let overlap = &self.overlaps[m as usize];
        let half = cube.octant(7).lo;
        let middle = DVec3::new(f64::from(half[0]), f64::from(half[1]), f64::from(half[2]));

        // Most prims are small: their boxes overlap one octant or two.
        let (below, above) = (overlap.lo.cmple(middle).bitmask(), middle.cmple(overlap.hi).bitmask());
        let meets = |axis: usize, lower: u8| {
            (if below >> axis & 1 == 1 { lower } else { 0 }) | (if above >> axis & 1 == 1 { !lower } else { 0 })
        };
        let candidates = meets(0, 0b0101_0101) & meets(1, 0b0011_0011) & meets(2, 0b0000_1111);
        (0..8).filter(|&o| candidates >> o & 1 == 1 && overlap.test(cube.octant(o))).fold(0, |mask, o| mask | 1 << o)
    }
}

#[expect(clippy::cast_possible_truncation, reason = "2³² references would be 16 GB; prims and cells are fewer")]
fn index(i: usize) -> u32 {
    i as u32
}
