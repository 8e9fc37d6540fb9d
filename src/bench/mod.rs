//! Measures and compares, but prints nothing: hard rays for a mesh with exact answers, and the rays of a real picture through
//! every structure with their costs.

pub mod aim;
pub mod baseline;
pub mod clock;
pub mod compare;
pub mod explain;
pub mod fit;
pub mod machine;
pub mod oracle;
pub mod pruning;
pub mod range;
pub mod rays;
pub mod replay;
pub mod report;
pub mod row;
pub mod spd;
pub mod star;
pub mod study;
pub mod sweep;
#[cfg(test)]
mod tests;
pub mod verify;
