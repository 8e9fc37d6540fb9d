//! The Standard Procedural Databases, measured as they were in 1999.
//!
//! E. Haines, *A Proposal for Standard Graphics Environments*, 1987, gives scenes, the rules by which rays are sent
//! ([`rules`]) and how many there are. V. Havran and F. Sixta, *Comparison of Hierarchical Grids*, and V. Havran,
//! *Comparison of Octree Traversal Algorithms*, both in Ray Tracing News 12 (1), 1999, give what a uniform grid and an
//! octree cost on them ([`published`]). The same is counted here and put beside ([`measure`]).

pub mod measure;
pub mod published;
pub mod report;
pub mod rules;
#[cfg(test)]
mod tests;
