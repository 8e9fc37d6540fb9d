//! No culling: every ray against every shape. The specification of every other structure.
