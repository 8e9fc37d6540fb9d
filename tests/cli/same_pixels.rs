//! Structure, number of threads and instruction set do not affect the pixels.

use super::program::{Folder, picture};
use crate::common::{bits, models};
use meshray::accel::AccelKind;
use meshray::math::simd::Level;

const THREADS: [&str; 3] = ["1", "2", "7"];

/// Renders with each structure and compares the bits: the default one with each number of threads, the others with one of the
/// numbers, in turn.
fn all_agree(folder: &Folder, input: &str, size: &str, structures: &[&str]) {
    let mut first = None;
    for (i, accel) in structures.iter().enumerate() {
        let is_default = *accel == AccelKind::DEFAULT.name();
        for threads in if is_default { &THREADS } else { &THREADS[i % 3..][..1] } {
            let how = ["--size", size, "--accel", accel, "--threads", threads, "--max-samples", "8"];
            let run =
                folder.run(&[&["render", "--float", "--layers", "-o", "out.exr", input], how.as_slice()].concat());
            run.ends(0);
            let these = bits(&picture(&folder.path("out.exr")));
            let those = first.get_or_insert_with(|| these.clone());
            assert!(*those == these, "{input}: {accel} with {threads} threads differs");
        }
    }
}

/// Tracing every ray against every prim takes minutes: here slow structures render only a model of a few prims, and the others
/// through the library, smaller (`models`).
#[test]
fn every_model_gives_the_same_bits_with_every_structure_and_any_threads() {
    let all = AccelKind::ALL.map(AccelKind::name);
    let affordable = AccelKind::ALL.into_iter().filter(|kind| !kind.is_slow());
    let affordable: Vec<_> = affordable.map(AccelKind::name).collect();
    let folder = Folder::with_cube();
    all_agree(&folder, "cube.obj", "48x36", &all);
    for input in models() {
        all_agree(&folder, input.to_str().unwrap(), "48x36", &affordable);
    }
}

#[test]
fn every_instruction_set_of_the_machine_gives_the_same_bits() {
    let folder = Folder::with_cube();
    for input in models() {
        let with = |level: &str| {
            let how = ["--size", "48x36", "--max-samples", "8", "--simd", level, "-o", "out.exr"];
            folder.run(&[&["render", "--float", "--layers", input.to_str().unwrap()], how.as_slice()].concat()).ends(0);
            bits(&picture(&folder.path("out.exr")))
        };
        let first = with(Level::PORTABLE.word());
        for level in Level::all() {
            assert!(first == with(level.word()), "{}: {} differs", input.display(), level.name());
        }
    }
}

#[test]
fn a_file_is_the_same_bytes_each_time() {
    let folder = Folder::with_cube();
    for name in ["a.png", "a.exr"] {
        folder.render(&["cube.obj", "-o", name]).ends(0);
        let first = folder.read(name);
        folder.render(&["cube.obj", "-o", name]).ends(0);
        assert!(first == folder.read(name), "{name}");
    }
}
