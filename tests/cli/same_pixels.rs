//! Structure and number of threads do not show in the pixels.

use super::program::{Folder, picture};
use crate::common::{bits, models};

#[test]
fn every_model_gives_the_same_bits_with_every_structure_and_any_threads() {
    let folder = Folder::with_cube();
    let mut inputs = models();
    inputs.push(folder.path("cube.obj"));
    for input in inputs {
        let input = input.to_str().unwrap();
        let mut first = None;
        for accel in ["none", "grid-octree"] {
            for threads in ["1", "2", "7"] {
                let size = ["render", "--size", "40x30", "--samples", "4", "--float", "--layers", "-o", "out.exr"];
                let run = folder.run(&[&size, ["--accel", accel, "--threads", threads, input].as_slice()].concat());
                run.ends(0);
                let these = bits(&picture(&folder.path("out.exr")));
                let those = first.get_or_insert_with(|| these.clone());
                assert!(*those == these, "{input}: {accel} with {threads} threads differs from none with 1");
            }
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
