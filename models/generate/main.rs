//! Writes the computed models of this folder: `cargo run --example generate-models`.
//!
//! Every shape and texture is a formula, and transcendental functions come from `libm`, so that the files come out the
//! same on every machine. With `--check` nothing is written, and a file that would change ends the run with an error.

mod animated;
mod bare;
mod glass;
mod glb;
mod metal;
mod picture;
mod shape;
mod sky;
mod still_life;
mod textured;

use std::io;
use std::path::Path;

fn main() -> io::Result<()> {
    let check = std::env::args().any(|word| word == "--check");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("models");
    let models = [
        ("still-life.glb", still_life::model()),
        ("textured.glb", textured::model()),
        ("glass.glb", glass::model()),
        ("metal.glb", metal::model()),
        ("animated.glb", animated::model()),
        ("gear.stl", bare::gear()),
        ("football.ply", bare::football()),
        ("evening.hdr", sky::evening()?),
    ];
    for (name, bytes) in models {
        let path = folder.join(name);
        if !check {
            std::fs::write(path, bytes)?;
        } else if std::fs::read(path)? != bytes {
            return Err(io::Error::other(format!("{name} is not what this program writes: run it without --check")));
        }
    }
    Ok(())
}
