//! (to be written)
/// x
pub struct View;
