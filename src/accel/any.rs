//! The choice of a structure: the enum meets the user, the trait meets the ray.

use std::fmt;
use std::str::FromStr;

use super::{GridOctree, GridParams, Shapes, Splitting, StructureStats, Unculled, Wide};

/// Which structure culls.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AccelKind {
    /// Every ray against every shape.
    None,
    /// A uniform grid, its crowded cells refined by octrees, with a mailbox.
    GridOctree,
    /// The same cuts as boxes in nodes of eight.
    FastOctree,
    /// Boxes in nodes of eight, cut by surface area.
    FastBvh,
}

impl Default for AccelKind {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl AccelKind {
    /// The one that is used when none is named.
    pub const DEFAULT: Self = Self::FastOctree;

    /// Every kind, in the order of the help text.
    pub const ALL: [Self; 4] = [Self::None, Self::GridOctree, Self::FastOctree, Self::FastBvh];

    /// As typed and printed.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::GridOctree => "grid-octree",
            Self::FastOctree => "fast-octree",
            Self::FastBvh => "fast-bvh",
        }
    }
}

impl fmt::Display for AccelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no structure has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no structure is named {0:?}; there are: none, grid-octree, fast-octree, fast-bvh")]
pub struct UnknownAccel(String);

impl FromStr for AccelKind {
    type Err = UnknownAccel;

    fn from_str(name: &str) -> Result<Self, UnknownAccel> {
        Self::ALL.into_iter().find(|k| k.name() == name).ok_or_else(|| UnknownAccel(name.into()))
    }
}

/// A built structure. Match once per image; each variant implements [`Accel`](super::Accel).
#[derive(Clone, Debug)]
pub enum AnyAccel<'a> {
    /// [`AccelKind::None`].
    None(Unculled<'a>),
    /// [`AccelKind::GridOctree`].
    GridOctree(GridOctree<'a>),
    /// [`AccelKind::FastOctree`] or [`AccelKind::FastBvh`].
    Wide(Wide<'a>),
}

impl<'a> AnyAccel<'a> {
    /// Builds a structure over `shapes`; `params` only matter to kinds with a grid.
    pub fn build(kind: AccelKind, shapes: &'a Shapes, params: &GridParams) -> Self {
        match kind {
            AccelKind::None => Self::None(Unculled::new(shapes)),
            AccelKind::GridOctree => Self::GridOctree(GridOctree::build(shapes, params)),
            AccelKind::FastOctree => Self::Wide(Wide::build(shapes, Splitting::Octree)),
            AccelKind::FastBvh => Self::Wide(Wide::build(shapes, Splitting::SurfaceArea)),
        }
    }

    /// Which kind it is.
    pub fn kind(&self) -> AccelKind {
        match self {
            Self::None(_) => AccelKind::None,
            Self::GridOctree(_) => AccelKind::GridOctree,
            Self::Wide(a) => match a.splitting() {
                Splitting::Octree => AccelKind::FastOctree,
                Splitting::SurfaceArea => AccelKind::FastBvh,
            },
        }
    }

    /// What it is made of.
    pub fn summary(&self) -> StructureStats {
        match self {
            Self::None(a) => a.summary(),
            Self::GridOctree(a) => a.summary(),
            Self::Wide(a) => a.summary(),
        }
    }

    /// Visits everything and proves that no hit can be lost; the error says which prim and cell disagree, and how.
    pub fn check(&self) -> Result<StructureStats, String> {
        match self {
            Self::None(a) => Ok(a.summary()),
            Self::GridOctree(a) => a.check(),
            Self::Wide(a) => a.check(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_found_by_its_name() {
        for kind in AccelKind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
        }
        let error = "gird".parse::<AccelKind>().map_err(|e| e.to_string());
        let names = AccelKind::ALL.map(AccelKind::name).join(", ");
        assert_eq!(error, Err(format!("no structure is named \"gird\"; there are: {names}")));
    }
}
