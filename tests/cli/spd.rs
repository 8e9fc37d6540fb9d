//! Our counts beside those published for the Standard Procedural Databases.

use super::program::Folder;

/// One ball on a floor, under the name of a published scene.
const BALLS: &str = "b 0 0 0\nv\nfrom 0 0 10\nat 0 0 0\nup 0 1 0\nangle 30\nhither 1\nresolution 512 512\nl 3 3 20\n\
                     f 1 1 1 0.5 0.5 10 0 0\np 4\n9 9 0\n-9 9 0\n-9 -9 0\n9 -9 0\ns 0 0 1 1\n";

#[test]
fn other_scenes_than_the_published_ones_are_told_from_them() {
    let folder = Folder::new().file("balls.nff", BALLS);
    let run = folder.run(&["bench", "--spd", ".", "--slow-tests", "2000", "--report", "spd.json", "-q"]);
    // In both scenes every eye ray hits something; but the published scene has 7382 objects.
    let run = run.ends(1);
    for words in
        ["balls: 2 objects (7 382 published)", "same hits, bit for bit", "equal to Havran and Sixta's in 1 of 1"]
    {
        assert!(run.text().contains(words), "{words}\n{}", run.text());
    }
    let report = String::from_utf8_lossy(&folder.read("spd.json")).into_owned();
    assert!(report.contains("meshray-spd/1") && report.contains("octree-7"), "{report}");
}

#[test]
fn a_folder_without_the_scenes_is_an_error_that_names_them() {
    let folder = Folder::with_cube();
    folder.run(&["bench", "--spd", "."]).ends(3).says(&["holds none of balls.nff"]);
    folder.run(&["bench", "cube.obj", "--spd", "."]).ends(2);
    folder.run(&["bench", "--spd", ".", "--size", "64x48"]).ends(2).says(&["--size"]);
    folder
        .file("tetra.nff", "f 1 1 1 1 0 0 0 0\np 3\n0 0 0\n1 0 0\n0 1 0\n")
        .run(&["bench", "--spd", "."])
        .ends(3)
        .says(&["tetra.nff", "no `v`"]);
}
