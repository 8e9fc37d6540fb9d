//! Uniform grid whose crowded cells are refined by octrees, with a per-ray mailbox.
