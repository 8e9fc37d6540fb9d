//! The Standard Procedural Databases, measured by the rules of 1999.
//!
//! E. Haines, *A Proposal for Standard Graphics Environments*, 1987, gives scenes, the rules by which rays are sent ([`rules`]),
//! and the numbers of rays. V. Havran and F. Sixta, *Comparison of Hierarchical Grids*, and V. Havran, *Comparison of Octree
//! Traversal Algorithms*, both in Ray Tracing News 12 (1), 1999, give the costs of a uniform grid and an octree on them
//! ([`published`]). The same quantities are counted here and compared with theirs ([`measure`]).

pub mod measure;
pub mod published;
pub mod report;
pub mod rules;
#[cfg(test)]
mod tests;
