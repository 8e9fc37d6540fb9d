//! Numbers as people read them.

pub(super) use crate::bench::report::number::{grouped, so_many};
