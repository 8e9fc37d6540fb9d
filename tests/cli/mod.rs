//! The program from outside: everything that scripts and people rely on.

mod again;
mod animation;
mod archives;
mod backdrop;
mod bench;
mod collections;
mod costs;
mod diff;
mod endings;
mod explain;
mod formats;
mod generate;
mod instances;
mod interrupt;
mod messages;
mod other_commands;
mod output;
mod profile;
mod program;
mod pruning;
mod same_pixels;
mod sampling;
mod spd;
mod study;
mod surroundings;
mod trace;
