//! Prims that stop light in some places and let it through in others, for rays that ask whether anything is in their way.

/// Who knows whether a prim that is not opaque stops light where a ray meets it.
pub trait Holes {
    /// Whether prim `prim` stops all light where ray number `ray` of those that were asked meets it, within its range. A
    /// function of both alone: it may be asked more than once, in any order.
    fn stops(&self, ray: usize, prim: u32) -> bool;
}
