//! Whole OBJ texts through the loader.

mod corners;

use super::*;
use crate::load::geometry::invariants::assert_sound;
use crate::load::{Limits, Polygons};
use crate::math::{DVec3, Vec2, Vec3, Vec4};
use crate::scene::{Material, Reflection, UpAxis};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn of(text: &str) -> Loaded {
    with(text.as_bytes(), &LoadOptions::default())
}

fn with(bytes: &[u8], options: &LoadOptions) -> Loaded {
    let source = Source::new("m.obj".into(), bytes.to_vec());
    load(&source, options, &mut Budget::new(&options.limits)).unwrap()
}

fn codes(loaded: &Loaded) -> Vec<(&str, u32)> {
    loaded.warnings.iter().map(|w| (w.code, w.count)).collect()
}

fn triangles(loaded: &Loaded) -> usize {
    loaded.scene.meshes.iter().map(|m| m.triangles.len()).sum()
}

#[test]
fn a_triangle_becomes_a_mesh_and_an_instance_with_a_plain_material() {
    let loaded = of(&format!("{TRIANGLE}f 1 2 3"));
    assert_eq!((loaded.scene.meshes.len(), loaded.scene.instances.len(), triangles(&loaded)), (1, 1, 1));
    assert_eq!(loaded.scene.materials[loaded.scene.meshes[0].material as usize].name, "plain");
    assert_eq!((loaded.facts.faces, loaded.warnings.len()), (1, 0));
    let instance = &loaded.scene.instances[0];
    let mesh = &loaded.scene.meshes[0];
    let world = |i: usize| instance.world_from_object.transform_point3(mesh.positions[i].as_dvec3());
    assert_eq!([world(0), world(1), world(2)], [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn triangles_alone_have_the_corners_they_have_beside_a_vertex_that_nothing_uses() {
    use crate::math::random::Random;
    let mut random = Random::new(3);
    let vertices: String = (0..40).map(|_| random.cube()).map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    let faces: String =
        (0..60).map(|i| format!("f {} {} {}\n", i % 40 + 1, (i + 7) % 40 + 1, (i + 13) % 40 + 1)).collect();
    let corners = |text: &str| -> Vec<[Vec3; 3]> {
        let loaded = of(text);
        let mesh = &loaded.scene.meshes[0];
        mesh.triangles.iter().map(|t| t.map(|corner| mesh.positions[corner as usize])).collect()
    };
    let alone = corners(&format!("{vertices}{faces}"));
    assert_eq!(alone, corners(&format!("{vertices}v 0 0 0\n{faces}")));
    let loaded = of(&format!("{vertices}{faces}"));
    assert_eq!((alone.len(), loaded.facts.faces), (60, 60));
    // Their vertices are the file's.
    assert_eq!(loaded.scene.meshes[0].triangles[..2], [[0, 7, 13], [1, 8, 14]]);
}

#[test]
fn every_encoding_and_line_end_gives_the_same_mesh() {
    let text = format!("{SQUARE}f 1 2 \\\n 3 4 # all\n");
    let expected = of(&text).scene.meshes[0].triangles.clone();
    assert_eq!(expected.len(), 2);
    let utf16: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_be_bytes).collect();
    let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
    let crlf = text.replace('\n', "\r\n").into_bytes();
    let cr = text.replace('\n', "\r").into_bytes();
    let latin = [b"# \xff\xfe\n".as_slice(), text.as_bytes()].concat();
    for bytes in [utf16, marked, crlf, cr, latin] {
        assert_eq!(with(&bytes, &LoadOptions::default()).scene.meshes[0].triangles, expected);
    }
}

#[test]
fn a_far_model_has_the_same_coordinates_as_one_at_the_origin() {
    let write = |shift: f64| {
        let points = [[0.0, 0.0, 0.0], [1.5, 0.25, 0.0], [0.75, 2.0, 0.5], [-0.125, 0.5, 0.0]];
        let lines = points.map(|p| format!("v {} {} {}\n", p[0] + shift, p[1] + shift, p[2] + shift));
        of(&format!("{}f 1 2 3\nf 1 3 4", lines.concat()))
    };
    let (near, far) = (write(0.0), write(1e7));
    assert_eq!(near.scene.meshes[0].positions, far.scene.meshes[0].positions);
    assert_eq!(far.facts.max_rounding, 0.0);
    let moved = |l: &Loaded| l.scene.instances[0].world_from_object.translation;
    assert_eq!(moved(&far) - moved(&near), DVec3::splat(1e7));
}

#[test]
fn a_far_scan_is_off_by_no_more_than_half_a_unit_of_its_last_digit() {
    // Points in a scanner's format: six decimals, on a sphere.
    let points: Vec<DVec3> = (0..300)
        .map(|i| {
            let (a, b) = (f64::from(i) * 0.7, f64::from(i) * 0.01 - 1.5);
            let p = DVec3::new(libm::cos(a) * libm::cos(b), libm::sin(b), libm::sin(a) * libm::cos(b)) * 0.1;
            (p * 1e6).round() / 1e6
        })
        .collect();
    let write = |shift: f64| {
        let line = |p: &DVec3| format!("v {:.6} {:.6} {:.6}\n", p.x + shift, p.y + shift, p.z + shift);
        let faces: String = (1..=100).map(|i| format!("f {} {} {}\n", 3 * i - 2, 3 * i - 1, 3 * i)).collect();
        of(&(points.iter().map(line).collect::<String>() + &faces))
    };
    let (near, far) = (write(0.0), write(1e7));
    let difference = near.scene.meshes[0].positions.iter().zip(&far.scene.meshes[0].positions);
    let largest = difference.map(|(a, b)| (*a - *b).abs().max_element()).fold(0.0, f32::max);
    assert!(largest <= 0.5e-6, "{largest}");
    assert!(far.facts.max_rounding <= 0.5e-6);
}

#[test]
fn objects_groups_and_materials_part_the_faces_and_keep_their_names() {
    let text = "o a b\nf 1 2 3\ng left\nf 1 2 3\nusemtl x\nf 1 2 3\no c\nf 1 2 3\nusemtl y\nf 1 2 3\no a b\nf 3 2 1";
    let loaded = of(&format!("{TRIANGLE}{text}"));
    let names: Vec<_> = loaded.scene.instances.iter().map(|i| i.name.as_str()).collect();
    assert_eq!(names, ["a b", "a b/left", "a b/left", "c", "c", "a b"]);
}

#[test]
fn faces_of_a_run_that_comes_back_join_it_and_keep_their_numbers() {
    let text = "usemtl r\nf 1 2 3 4\nusemtl b\nf 1 2 3\nusemtl r\nf 1 3 4\n";
    let loaded = of(&format!("{SQUARE}{text}"));
    assert_eq!(loaded.scene.meshes[0].face_of_triangle, [0, 0, 2]);
    assert_eq!(loaded.scene.meshes[1].face_of_triangle, [1]);
    assert_eq!(loaded.facts.faces, 3);
    assert!(of(&format!("{SQUARE}f 1 2 3\nf 1 3 4")).scene.meshes[0].face_of_triangle.is_empty());
}

#[test]
fn a_concave_face_is_cut_inside_and_a_whole_one_stays_whole() {
    let text = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nf 4 1 2 3\n";
    let loaded = of(text);
    let mesh = &loaded.scene.meshes[0];
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).z / 2.0
    };
    assert!(mesh.triangles.iter().all(|t| area(t) > 0.0));
    assert_eq!(mesh.triangles.iter().map(area).sum::<f32>(), 4.0);

    let whole = LoadOptions { polygons: Polygons::Whole, ..LoadOptions::default() };
    let loaded = with(text.as_bytes(), &whole);
    let mesh = &loaded.scene.meshes[0];
    assert_eq!((mesh.triangles.len(), mesh.polygons.len(), mesh.polygon_corners.len()), (0, 1, 4));
    assert_eq!(loaded.facts.faces, 1);
    let round = |corners: usize| {
        let at = |i: usize| std::f64::consts::TAU * i as f64 / corners as f64;
        let lines = (0..corners).map(|i| format!("v {} {} 0\n", libm::cos(at(i)), libm::sin(at(i))));
        let corners: String = (1..=corners).map(|i| format!(" {i}")).collect();
        let mesh = &with((lines.collect::<String>() + "f" + &corners).as_bytes(), &whole).scene.meshes[0];
        (mesh.triangles.len(), mesh.polygons.len())
    };
    assert_eq!((round(256), round(257)), ((0, 1), (255, 0)), "every test looks at all corners");
    let bent = with(text.replace("1 1 0", "1 1 0.01").as_bytes(), &whole);
    assert_eq!((bent.scene.meshes[0].triangles.len(), bent.scene.meshes[0].polygons.len()), (2, 0));
    // A corner off by one unit of the last digit is off the plane by a quarter of it; half a unit still counts as planar.
    let raised = |z: &str| format!("v 0 0 0.0000\nv 4 0 0\nv 4 4 {z}\nv 0 4 0\nf 1 2 3 4");
    assert_eq!(with(raised("0.0002").as_bytes(), &whole).scene.meshes[0].polygons.len(), 1);
    assert_eq!(with(raised("0.0003").as_bytes(), &whole).scene.meshes[0].polygons.len(), 0);
}

#[test]
fn smoothing_groups_share_normals_inside_and_not_across() {
    // Two faces that meet at a right angle along the z axis, and a third behind.
    let text = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\n";
    let smooth = of(&format!("{text}s 1\nf 1 2 3\nf 2 1 4"));
    let mesh = &smooth.scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.normals.len()), (4, 4));
    let at = |p: Vec3| {
        let center = smooth.scene.instances[0].world_from_object.translation.as_vec3();
        mesh.normals[mesh.positions.iter().position(|&q| q + center == p).unwrap()]
    };
    assert!((at(Vec3::ZERO) - Vec3::new(1.0, 1.0, 0.0).normalize()).length() < 1e-6, "{}", at(Vec3::ZERO));
    assert!((at(Vec3::X) - Vec3::Y).length() < 1e-6);

    let apart = of(&format!("{text}s 1\nf 1 2 3\ns 2\nf 2 1 4"));
    assert_eq!(apart.scene.meshes[0].positions.len(), 6);
    for off in ["s off\n", "s 0\n", ""] {
        let flat = of(&format!("{text}{off}f 1 2 3\nf 2 1 4"));
        assert!(flat.scene.meshes[0].normals.is_empty());
    }
    // A smoothing group extends across materials and objects.
    let across = of(&format!("{text}s 1\nusemtl a\nf 1 2 3\nusemtl b\nf 2 1 4"));
    assert_eq!(across.scene.meshes[0].normals[0], across.scene.meshes[1].normals[1]);
}

#[test]
fn corners_without_a_normal_are_flat_or_smooth_beside_those_with_one() {
    let text = format!("{SQUARE}vn 1 0 1\nf 1//1 2//1 3//1\nf 1 3 4");
    let mesh = &of(&text).scene.meshes[0];
    assert_eq!(mesh.normals.len(), mesh.positions.len());
    let normals = |t: usize| mesh.triangles[t].map(|i| mesh.normals[i as usize]);
    assert!(normals(0).iter().all(|n| (*n - Vec3::new(1.0, 0.0, 1.0).normalize()).length() < 1e-6));
    assert_eq!(normals(1), [Vec3::Z; 3]);
    let one = of(&format!("{TRIANGLE}vn 1 0 1\nf 1//1 2 3"));
    assert_eq!(one.scene.meshes[0].normals[1..], [Vec3::Z; 2]);
}

#[test]
fn a_face_wound_against_its_normals_is_turned_round() {
    let loaded = of(&format!("{TRIANGLE}vn 0 0 -1\nf 1//1 2//1 3//1"));
    let mesh = &loaded.scene.meshes[0];
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    assert!((b - a).cross(c - a).z < 0.0);
    assert_eq!(codes(&loaded), [("obj-turned-face", 1)]);
}

#[test]
fn texture_coordinates_point_down_and_may_be_given_on_some_corners() {
    let loaded = of(&format!("{TRIANGLE}vt 0.25 0.75\nvt 0.5\nf 1/1 2/2 3"));
    assert_eq!(loaded.scene.meshes[0].uvs, [[Vec2::new(0.25, 0.25), Vec2::new(0.5, 1.0), Vec2::ZERO]]);
    assert!(of(&format!("{TRIANGLE}vt 0 0\nf 1 2 3")).scene.meshes[0].uvs.is_empty());
}

#[test]
fn colours_of_vertices_without_a_material_are_shown_as_they_are() {
    let base = |text: &str| of(text).scene.materials[0].base_color;
    let (white, plain) = (Vec3::ONE, Material::plain().base_color);
    assert_eq!(base("v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3"), white);
    assert_eq!(base("v 0 0 0 1 1 1\nv 1 0 0 1 1 1\nv 0 1 0 1 1 1\nusemtl lost\nf 1 2 3"), white);
    assert!(base("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3") == plain && plain != white);
}

#[test]
fn vertex_colors_are_decoded_and_missing_ones_are_white() {
    let loaded = of("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3");
    let expected = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::ONE, Vec4::new(0.0, 0.0, 0.0, 1.0)];
    assert_eq!(loaded.scene.meshes[0].colors, expected);
    let bytes = of("v 0 0 0 255 0 0\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3");
    assert_eq!(bytes.scene.meshes[0].colors, expected);
    assert_eq!(codes(&bytes), [("obj-color-bytes", 1)]);
    assert!(of("v 0 0 0 1 1 1\nv 1 0 0\nv 0 1 0\nf 1 2 3").scene.meshes[0].colors.is_empty());
}

#[test]
fn what_zbrush_paints_vertices_with_is_their_colour_where_they_have_none() {
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let painted = |paint: &str| of(&format!("{vertices}{paint}\nf 1 2 3")).scene.meshes[0].colors.clone();
    let [red, black] = [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 0.0, 1.0)];
    assert_eq!(painted("#MRGB ffff0000ffffffff\n# more\n#MRGB 00000000ff123456"), [red, Vec4::ONE, black]);
    assert_eq!(painted("#MRGB ffff0000ff00"), [red, Vec4::ONE, Vec4::ONE], "cut off");
    assert!(painted("#MRGB zz").is_empty() && painted("#MRGB").is_empty());
    let own = of("v 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\n#MRGB ff00ff00\nf 1 2 3");
    assert_eq!(own.scene.meshes[0].colors, [red, Vec4::ONE, Vec4::ONE]);
}

#[test]
fn an_opacity_of_a_vertex_is_not_left_out_without_a_word() {
    let loaded = of("v 0 0 0 1 0 0 1\nv 1 0 0 1 0 0 0.5\nv 0 1 0 1 0 0 0.25\nf 1 2 3");
    assert_eq!(codes(&loaded), [("obj-vertex-alpha", 2)]);
}

#[test]
fn faces_without_three_finite_different_corners_are_dropped_and_counted() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nv 0 -inf 0\nv 1e99 0 0\nv 1 0 0\n";
    let loaded = of(&format!("{text}f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 2 6\nf 1 2 2\nf 1 2 7\nf 1 2\nf 1 2 2 3\n"));
    assert_eq!(triangles(&loaded), 2, "a quad with two equal corners is a triangle");
    assert_eq!(codes(&loaded), [("obj-few-corners", 1), ("obj-not-finite", 3), ("obj-equal-corners", 2)]);
    assert_eq!(loaded.facts.dropped.iter().map(|d| d.1).collect::<Vec<_>>(), [1, 3, 2]);
    assert_eq!(loaded.facts.faces, 2);
    let collinear = of("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3");
    assert_eq!(triangles(&collinear), 1, "three different corners in a row stay");
}

#[test]
fn points_and_lines_are_drawn_in_the_colours_of_their_material_and_vertices() {
    let text = "v 0 0 0 1 0 0\nv 4 0 0 0 0 1\nv 0 3 0\ng ship\nl 1 2 3 # keel\np 3\nusemtl b\nl -1 -3";
    let loaded = of(text);
    let (scene, wires) = (&loaded.scene, loaded.facts.wires);
    assert_eq!((wires.points, wires.lines, wires.line_width), (1, 3, 5.0 / 256.0));
    assert_eq!(scene.meshes.iter().map(|m| m.triangles.len()).collect::<Vec<_>>(), [24, 8]);
    assert_eq!((scene.meshes[0].name.as_str(), scene.instances[1].name.as_str()), ("ship", "ship"));
    let shown = scene.meshes.iter().map(|mesh| &scene.materials[mesh.material as usize]);
    assert_eq!(shown.clone().map(|m| m.name.as_str()).collect::<Vec<_>>(), [Material::plain().name.as_str(), "b"]);
    assert!(shown.clone().all(|m| matches!(m.reflection, Reflection::Unlit)));
    let ends = [scene.meshes[0].colors[0], scene.meshes[0].colors[5]].map(|c| c.truncate().to_array());
    assert_eq!(ends, [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    assert_sound(&loaded);
}

#[test]
fn lines_that_name_nothing_and_curves_are_warnings_and_an_empty_scene_is_no_error() {
    let loaded = of(&format!("{TRIANGLE}l 1 2 9\np x\ncurv 0 1 1 2"));
    assert_eq!(codes(&loaded), [("obj-bad-line", 2), ("obj-free-form", 1), ("obj-no-faces", 1)]);
    assert!(loaded.scene.meshes.is_empty() && loaded.scene.instances.is_empty());
    assert!(of("").scene.meshes.is_empty());
}

#[test]
fn the_up_axis_is_guessed_with_a_reason_unless_it_is_given() {
    let text = format!("# FreeCAD\n{TRIANGLE}f 1 2 3");
    let guessed = of(&text);
    assert_eq!(guessed.scene.up, UpAxis::Z);
    assert!(guessed.facts.up_reason.unwrap().contains("FreeCAD"));
    let given = with(text.as_bytes(), &LoadOptions { up: Some(UpAxis::Y), ..LoadOptions::default() });
    assert_eq!((given.scene.up, given.facts.up_reason), (UpAxis::Y, None));
}

#[test]
fn a_coordinate_that_cannot_be_there_costs_no_corner_where_the_file_has_none_at_all() {
    let face = "f 1/4294967295 2/2000000000 3/7 4";
    let loaded = of(&format!("{SQUARE}{face}"));
    assert_eq!((triangles(&loaded), codes(&loaded)), (2, vec![("obj-absent-attribute", 3)]));
    let source = Source::new("m.obj".into(), format!("{SQUARE}vt 0 0\n{face}").into_bytes());
    let options = LoadOptions::default();
    let Err(LoadError::Input(faults)) = load(&source, &options, &mut Budget::new(&options.limits)) else { panic!() };
    assert!(faults[0].to_string().contains("texture coordinate 4294967295, but there are 1"), "{}", faults[0]);
}

#[test]
fn tangents_for_a_normal_map_are_charged_before_they_are_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    ::image::RgbImage::from_pixel(1, 1, ::image::Rgb([128, 128, 255])).save(path("flat.png")).unwrap();
    std::fs::write(path("m.mtl"), "newmtl a\nnorm flat.png\n").unwrap();
    let faces = "f 1/1 2/1 3/1\n".repeat(2000);
    let read = |material: &str| {
        let text = format!("mtllib m.mtl\n{TRIANGLE}vt 0 0\nusemtl {material}\n{faces}");
        let source = Source::new(path("m.obj"), text.into_bytes());
        let options = LoadOptions::default();
        load(&source, &options, &mut Budget::new(&Limits { memory: 1_500_000, ..Limits::default() }))
    };
    assert!(read("none").is_ok());
    let Err(LoadError::Input(faults)) = read("a") else { panic!() };
    assert_eq!(faults[0].code, "over-memory");
}

#[test]
fn of_several_faults_the_first_is_told_with_the_number_of_its_kind() {
    let source = Source::new("m.obj".into(), format!("{TRIANGLE}f 1 2 9\nf 0 1 2\nf 1 2 8\n").into_bytes());
    let options = LoadOptions::default();
    let Err(LoadError::Input(faults)) = load(&source, &options, &mut Budget::new(&options.limits)) else { panic!() };
    let told = faults[0].to_string();
    assert!(told.starts_with("m.obj:4: corner 3 of the face names vertex 9") && told.contains("(×2)"), "{told}");
}

#[test]
fn a_face_whose_corners_rounding_joins_is_told_as_such() {
    let far =
        "v .1 .1 0\nv .3 .1 0\nv .1 .3 0\nf 1 2 3\nv 20000000.1 .1 0\nv 20000000.3 .1 0\nv 20000000.1 .3 0\nf 4 5 6\n";
    let obj = format!("{far}v 0 0 0\nv 20000000 0 0\nv 0 20000000 0\nf 7 8 9\nf 7 7 8\n");
    let loaded = of(&obj);
    assert_eq!(codes(&loaded), [("obj-equal-corners", 1), ("obj-rounded-face", 2)]);
    assert_eq!(loaded.facts.dropped.iter().map(|(_, n)| n).sum::<u64>(), 3);
}

#[test]
fn vertices_alone_are_points_in_their_colours_lit_by_their_normals() {
    let cloud = |more: &str| of(&format!("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n{more}"));
    let loaded = cloud("");
    assert_eq!((loaded.facts.wires.points, loaded.facts.faces, codes(&loaded)), (3, 0, vec![]));
    let colors: Vec<Vec4> = loaded.scene.meshes.iter().flat_map(|mesh| mesh.colors.clone()).collect();
    for color in [Vec4::new(1.0, 0.0, 0.0, 1.0), Vec4::new(0.0, 0.0, 1.0, 1.0)] {
        assert!(colors.contains(&color), "{colors:?}");
    }
    let is_lit = |loaded: &Loaded| loaded.scene.materials.iter().all(|m| m.reflection != Reflection::Unlit);
    assert!(!is_lit(&loaded) && is_lit(&cloud("vn 0 0 1\nvn 0 0 1\nvn 0 0 1\n")));
    // Where vertices are joined, or were meant to be, unused ones are not drawn.
    assert_eq!(cloud("f 1 2 3\n").facts.wires.points, 0);
    assert_eq!(cloud("f 1 2\n").facts.wires.points, 0);
}

#[test]
fn colours_of_vertices_that_are_no_numbers_are_told() {
    for color in ["1 0 zz", "nan 0 0", "1 0 0x"] {
        let loaded = of(&format!("v 0 0 0 {color}\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
        assert_eq!(codes(&loaded), [("obj-odd-number", 1)], "{color}");
    }
}
