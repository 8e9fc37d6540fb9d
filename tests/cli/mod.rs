//! The program from outside: what scripts and people rely on.

mod again;
mod backdrop;
mod endings;
mod interrupt;
mod messages;
mod other_commands;
mod output;
mod program;
mod same_pixels;
