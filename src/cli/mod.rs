//! Words -> jobs -> messages and exit codes.
