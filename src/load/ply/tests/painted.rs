//! Colours of faces and edges, and pictures.

use super::{FORMATS, Value, encoded, of, plain};
use crate::load::{Limits, LoadOptions, Loaded};
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::Mesh;
use crate::scene::color::from_srgb;

/// An existing picture, relative to the folder of a file without one.
const PICTURE: &str = "models/pictures/rainbow.jpg";

/// Two triangles that share an edge, with texture coordinates and colours.
pub(in crate::load::ply) fn roof(format: &str) -> Vec<u8> {
    let header = format!(
        "comment TextureFile {PICTURE}\ncomment TextureFile models/none.png\n\
         element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
         property int texnumber\nproperty uchar red\nproperty uchar green\nproperty uchar blue"
    );
    let mut values = Vec::new();
    for place in [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 1.0]] {
        values.extend(place.map(Value::Float));
    }
    for (corners, uvs, picture, color) in [
        ([0, 1, 2], [0.0, 0.0, 0.5, 0.0, 0.0, 0.5], 0, [255, 0, 0]),
        ([1, 3, 2], [0.5, 0.0, 1.0, 1.0, 0.0, 0.75], 1, [0, 0, 255]),
    ] {
        values.push(Value::Byte(3));
        values.extend(corners.map(Value::Int));
        values.push(Value::Byte(6));
        values.extend(uvs.map(Value::Float));
        values.push(Value::Int(picture));
        values.extend(color.map(Value::Byte));
    }
    encoded(format, &header, &values)
}

fn codes(loaded: &Loaded) -> Vec<&str> {
    loaded.warnings.iter().map(|w| w.code).collect()
}

/// Three triangles of a fan, with `before` ahead of the corners in the header, and further values of each face.
fn fan(before: &str, face: &str, of_faces: [&str; 3]) -> Loaded {
    let [a, b, c] = of_faces;
    let text = format!(
        "ply\nformat ascii 1.0\n{before}element vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
         element face 3\nproperty list uchar int vertex_indices\n{face}end_header\n\
         0 0 0\n1 0 0\n1 1 0\n0 1 0\n-1 1 0\n3 0 1 2 {a}\n3 0 2 3 {b}\n3 0 3 4 {c}\n"
    );
    plain(text.as_bytes())
}

/// Colours of the corners of each triangle.
fn corners(mesh: &Mesh) -> Vec<[Vec4; 3]> {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.colors[i as usize])).collect()
}

const COLORS: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

#[test]
fn faces_have_their_colours_up_to_their_edges() {
    let loaded = fan("", COLORS, ["255 0 0", "255 0 0", "0 0 255"]);
    let mesh = &loaded.scene.meshes[0];
    let (red, blue) = (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0));
    assert_eq!(corners(mesh), [[red; 3], [red; 3], [blue; 3]]);
    assert_eq!(mesh.positions.len(), 7, "two places have two colours");
    assert_eq!((loaded.scene.materials[0].base_color, codes(&loaded).len()), (Vec3::ONE, 0), "{:?}", loaded.warnings);
    let clear = fan("", &format!("{COLORS}property uchar alpha\n"), ["9 9 9 255", "9 9 9 51", "9 9 9 255"]);
    let alphas: Vec<f32> = corners(&clear.scene.meshes[0]).iter().map(|corners| corners[0].w).collect();
    assert_eq!(alphas, [1.0, 0.2, 1.0]);
}

#[test]
fn edges_have_their_colours_and_what_vertices_say_counts_before_both() {
    let file = |vertex: &str, of_vertices: [&str; 3]| {
        let [a, b, c] = of_vertices;
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
             element edge 2\nproperty int vertex1\nproperty int vertex2\n{COLORS}end_header\n\
             0 0 0 {a}\n1 0 0 {b}\n1 1 0 {c}\n0 1 255 0 0\n1 2 0 0 255\n"
        );
        plain(text.as_bytes())
    };
    let edges = file("", [""; 3]);
    assert!(edges.warnings.is_empty() && edges.facts.wires.lines == 2, "{:?}", edges.warnings);
    let mut seen: Vec<_> = edges.scene.meshes[0].colors.iter().map(Vec4::to_array).collect();
    seen.dedup();
    seen.sort_by(|a, b| a.partial_cmp(b).unwrap());
    seen.dedup();
    assert_eq!(seen, [[0.0, 0.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0]]);
    let vertices = file(COLORS, ["0 255 0"; 3]);
    assert_eq!(codes(&vertices), ["ply-edge-colors"]);
    assert!(vertices.scene.meshes[0].colors.iter().all(|&c| c == Vec4::new(0.0, 1.0, 0.0, 1.0)));
}

#[test]
fn faces_show_their_part_of_their_picture_in_every_encoding() {
    for format in FORMATS {
        let loaded = plain(&roof(format));
        let scene = &loaded.scene;
        assert_eq!((scene.meshes.len(), scene.bitmaps.len(), scene.textures.len()), (2, 1, 1), "{format}");
        let of = |mesh: &Mesh| scene.materials[mesh.material as usize].clone();
        let (shown, lost) = (&scene.meshes[0], &scene.meshes[1]);
        assert_eq!(of(shown).base_color_map.map(|map| (map.texture, map.uv_set)), Some((0, 0)));
        assert_eq!((of(shown).base_color, of(shown).name.as_str()), (Vec3::ONE, PICTURE));
        let uvs: Vec<Vec2> = shown.triangles[0].iter().map(|&i| shown.uvs[0][i as usize]).collect();
        assert_eq!(uvs, [[0.0, 1.0], [0.5, 1.0], [0.0, 0.5]].map(Vec2::from), "v points up in the file and down here");
        assert!(shown.colors.is_empty(), "the picture alone is seen");
        assert!(of(lost).base_color_map.is_none() && lost.colors[0] == Vec4::new(0.0, 0.0, 1.0, 1.0));
        assert_eq!(codes(&loaded), ["file-missing", "colors-under-picture"]);
        let told = loaded.warnings[0].to_string();
        assert!(
            told.starts_with("a.ply:4: picture 'models/none.png' is not there; faces are drawn without it"),
            "{told}"
        );
        assert_eq!(loaded.facts.files.len(), 2, "the picture is one of the files that the model is made of");
    }
}

const UVS: &str = "property list uchar float texcoord\n";

#[test]
fn equal_coordinates_of_a_vertex_are_one_and_seams_are_kept() {
    let picture = format!("comment TextureFile {PICTURE}\n");
    let smooth = fan(&picture, UVS, ["6 0 0 .5 0 1 1", "6 0 0 1 1 0 1", "6 0 0 0 1 -1 1"]);
    assert_eq!(smooth.scene.meshes[0].positions.len(), 5);
    let seam = fan(&picture, UVS, ["6 0 0 .5 0 1 1", "6 0 0 1 1 0 1", "6 .5 .5 0 1 -1 1"]);
    assert_eq!((seam.scene.meshes.len(), seam.scene.meshes[0].positions.len()), (1, 6));
    assert!(codes(&smooth).is_empty() && codes(&seam).is_empty());
}

#[test]
fn a_face_whose_place_in_a_picture_makes_no_sense_is_plain_and_told() {
    let picture = format!("comment TextureFile \"{PICTURE}\"\n");
    let odd = fan(&picture, UVS, ["6 0 0 .5 0 1 1", "4 0 0 1 1", "5 0 0 1 1 0"]);
    let faces = |loaded: &Loaded| loaded.scene.meshes.iter().map(|mesh| mesh.triangles.len()).collect::<Vec<_>>();
    assert_eq!((codes(&odd), odd.warnings[0].count, faces(&odd)), (vec!["ply-uneven-texcoords"], 2, vec![2, 1]));
    let told = odd.warnings[0].to_string();
    assert!(told.starts_with("a.ply:face 1: a face has not two texture coordinates for each corner"), "{told}");
    let without = fan(&picture, UVS, ["0", "6 0 0 .5 0 1 1", "6 0 0 nan 0 1 1"]);
    assert_eq!((codes(&without).len(), faces(&without)), (0, vec![2, 1]));
    let numbered = format!("{UVS}property int texnumber\n");
    let some = fan(&picture, &numbered, ["6 0 0 .5 0 1 1 0", "6 0 0 .5 0 1 1 -1", "6 0 0 .5 0 1 1 1"]);
    assert_eq!((codes(&some), faces(&some)), (vec!["ply-no-such-picture"], vec![2, 1]));
}

#[test]
fn pictures_are_shown_by_coordinates_of_vertices_and_not_without_any() {
    let file = |comment: &str, vertex: &str, of_vertex: [&str; 3]| {
        let [a, b, c] = of_vertex;
        let text = format!(
            "ply\nformat ascii 1.0\nobj_info by hand\n{comment}element vertex 3\nproperty float x\nproperty float y\n\
             property float z\n{vertex}element face 1\nproperty list uchar int vertex_indices\nend_header\n\
             0 0 0 {a}\n1 0 0 {b}\n0 1 0 {c}\n3 0 1 2\n"
        );
        plain(text.as_bytes())
    };
    let uvs = "property float texture_u\nproperty float texture_v\n";
    let picture = format!("comment texturefile {PICTURE}\n");
    let shown = file(&picture, uvs, ["0 0", "1 0", "0 1"]);
    assert!(shown.warnings.is_empty() && shown.scene.materials[0].base_color_map.is_some(), "{:?}", shown.warnings);
    let none = file(&picture, "", [""; 3]);
    assert_eq!((codes(&none), none.scene.bitmaps.len()), (vec!["picture-unused"], 0));
    assert!(none.warnings[0].to_string().starts_with("a.ply:4: picture '"), "{}", none.warnings[0]);
    let outside = file("comment TextureFile /etc/hostname\n", uvs, ["0 0", "1 0", "0 1"]);
    assert_eq!(codes(&outside), ["file-outside-root"]);
    let unnamed = file("comment TextureFile\n", uvs, ["0 0", "1 0", "0 1"]);
    assert!(unnamed.warnings.is_empty() && unnamed.scene.materials[0].base_color_map.is_none());
}

#[test]
fn what_has_no_colour_beside_what_has_one_is_plain_and_each_is_written_in_its_own_way() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 4\n{xyz}element face 1\nproperty list uchar int vertex_indices\n\
         property float red\nproperty float green\nproperty float blue\nelement tristrips 1\n\
         property list int int vertex_indices\nelement edge 1\nproperty int vertex1\nproperty int vertex2\n{COLORS}\
         end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 255 0 128\n3 1 3 2\n0 3 0 255 0\n"
    );
    let loaded = plain(text.as_bytes());
    assert_eq!(codes(&loaded), ["color-bytes"]);
    let mesh = &loaded.scene.meshes[0];
    let grey = crate::scene::Material::plain().base_color;
    let seen = corners(mesh);
    assert_eq!(seen[0][0], from_srgb([1.0, 0.0, 128.0 / 255.0]).extend(1.0));
    assert!((seen[1][0].truncate() - grey).abs().max_element() < 1e-5, "{:?}", seen[1]);
    let wire = &loaded.scene.meshes[1];
    assert!(wire.is_wire && wire.colors.iter().all(|&c| c == Vec4::new(0.0, 1.0, 0.0, 1.0)), "{:?}", wire.colors);
}

#[test]
fn of_two_colours_of_a_face_the_first_counts() {
    let twice =
        format!("{COLORS}property uchar diffuse_red\nproperty uchar diffuse_green\nproperty uchar diffuse_blue\n");
    let loaded = fan("", &twice, ["255 0 0 0 0 255"; 3]);
    assert_eq!(corners(&loaded.scene.meshes[0]), [[Vec4::new(1.0, 0.0, 0.0, 1.0); 3]; 3]);
}

#[test]
fn names_of_pictures_are_read_as_those_of_other_files() {
    let vertices =
        "element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float s\nproperty float t\n";
    let body = format!(
        "{vertices}element face 1\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
    );
    let file = |name: &[u8]| [b"ply\nformat ascii 1.0\ncomment TextureFile ", name, b"\n", body.as_bytes()].concat();
    let latin = plain(&file(b"Fl\xe4che.png"));
    assert!(latin.warnings[0].text.contains("'Fläche.png' is not there"), "{:?}", latin.warnings);
    let long = plain(&file(&[b'a'; 5000]));
    assert!(long.warnings.is_empty(), "no name, but a comment: {:?}", long.warnings);
    let no_room = LoadOptions { limits: Limits { memory: 800, ..Limits::default() }, ..LoadOptions::default() };
    assert!(of(&file(&[b'a'; 4000]), &no_room).unwrap_err().contains("16000 bytes are needed"));
}

#[test]
fn a_picture_of_several_names_is_read_once() {
    let other = PICTURE.replacen('/', "/./", 1);
    let pictures = format!("comment TextureFile {PICTURE}\ncomment TextureFile {other}\n");
    let numbered = format!("{UVS}property int texnumber\n");
    let loaded = fan(&pictures, &numbered, ["6 0 0 .5 0 1 1 0", "6 0 0 .5 0 1 1 1", "6 0 0 .5 0 1 1 0"]);
    assert_eq!((loaded.scene.bitmaps.len(), loaded.scene.materials.len(), loaded.scene.meshes.len()), (1, 1, 2));
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn coordinates_without_a_picture_and_pictures_without_a_face_are_told() {
    let without = fan("", UVS, ["6 0 0 .5 0 1 1"; 3]);
    assert_eq!((codes(&without), without.scene.meshes[0].uvs.len()), (vec!["ply-no-picture"], 0));
    let numbered = format!("{UVS}property int texnumber\n");
    let picture = format!("comment TextureFile {PICTURE}\n");
    let unused = fan(&picture, &numbered, ["6 0 0 .5 0 1 1 -1"; 3]);
    assert_eq!((codes(&unused), unused.scene.meshes.len()), (vec!["picture-unused"], 1));
    assert!(unused.warnings[0].text.ends_with("no face shows it"), "{}", unused.warnings[0]);
}

#[test]
fn pictures_and_colours_take_no_memory_that_was_not_granted() {
    let memory = |memory| LoadOptions { limits: Limits { memory, ..Limits::default() }, ..LoadOptions::default() };
    // Memory of the file, four vertices, two faces with colours and coordinates; then of their vertices, and of a picture.
    let told = [1500, 2400, 100_000].map(|bytes| of(&roof("ascii"), &memory(bytes)));
    assert!(told[0].as_ref().is_err_and(|e| e.ends_with("raise --max-memory")), "{:?}", told[0].as_ref().err());
    assert!(told[1].as_ref().is_err_and(|e| e.ends_with("raise --max-memory")), "{:?}", told[1].as_ref().err());
    let poor = told[2].as_ref().unwrap();
    assert!(poor.scene.bitmaps.is_empty() && codes(poor).contains(&"image-unusable"), "{:?}", poor.warnings);
    assert_eq!(corners(&poor.scene.meshes[0])[0][0], from_srgb([1.0, 0.0, 0.0]).extend(1.0));
}
