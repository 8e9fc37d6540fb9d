//! Whole files, built in memory.

use super::*;
use crate::load::{Limits, load_bytes};
use crate::math::Vec3;
use crate::scene::UpAxis;
use crate::scene::color::to_srgb;

/// A tetrahedron above the xy plane: four triangles on four positions.
const CORNERS: [[[f32; 3]; 3]; 4] = {
    let [a, b, c, d] = [[1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.5]];
    [[a, c, b], [a, b, d], [b, c, d], [c, a, d]]
};

pub(super) fn binary(header: &str) -> Vec<u8> {
    let mut out = header.as_bytes().to_vec();
    out.resize(80, 0);
    out.extend(4u32.to_le_bytes());
    for corners in CORNERS {
        // A wrong normal, as is common, and attributes.
        out.extend([9f32, f32::NAN, 0.0].iter().flat_map(|x| x.to_le_bytes()));
        out.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
        out.extend([0x12, 0x34]);
    }
    out
}

pub(super) fn text() -> String {
    let mut out = "solid tetra of ours\n".to_owned();
    for corners in CORNERS {
        out += " facet normal nan 0 0\n  outer loop\n";
        out.extend(corners.iter().map(|[x, y, z]| format!("   vertex {x:e} {y} {z:.3}\n")));
        out += "  endloop\n endfacet\n";
    }
    out + "endsolid tetra of ours\n"
}

pub(super) fn of(bytes: &[u8], options: &LoadOptions) -> Result<Loaded, String> {
    load_bytes(Path::new("a.stl"), bytes.to_vec(), options).map_err(|e| e.to_string())
}

fn plain(bytes: &[u8]) -> Loaded {
    of(bytes, &LoadOptions::default()).unwrap()
}

fn fault(bytes: &[u8]) -> String {
    of(bytes, &LoadOptions::default()).unwrap_err()
}

#[test]
fn remarks_before_and_between_solids_are_passed_over() {
    let loaded = plain(format!("# exported\n# by somebody\n{}# the end\n", text()).as_bytes());
    assert_eq!((loaded.facts.faces, loaded.warnings.len()), (4, 0), "{:?}", loaded.warnings);
}

#[test]
fn text_and_binary_give_the_same_scene() {
    let (ascii, bytes) = (plain(text().as_bytes()), plain(&binary("a tetrahedron")));
    assert_eq!((ascii.facts.format.as_str(), bytes.facts.format.as_str()), ("STL (ascii)", "STL (binary)"));
    assert_eq!(format!("{:?}", ascii.scene), format!("{:?}", bytes.scene));
    let mesh = &bytes.scene.meshes[0];
    assert_eq!((mesh.positions.len(), mesh.triangles.len(), bytes.facts.faces), (4, 4, 4), "equal places are one");
    assert!(mesh.normals.is_empty(), "flat");
    assert!(bytes.warnings.is_empty(), "{:?}", bytes.warnings);
    assert_eq!(bytes.scene.up, UpAxis::Z);
}

#[test]
fn a_binary_file_may_call_itself_solid() {
    let loaded = plain(&binary("solid facet\nexported from a program"));
    assert_eq!((loaded.facts.format.as_str(), loaded.facts.faces), ("STL (binary)", 4));
    assert!(loaded.facts.generator.contains("exported from"), "{}", loaded.facts.generator);
}

#[test]
fn keywords_come_in_any_case_on_any_lines_in_several_solids() {
    let shouted = text().to_uppercase().replace("  ", "\t");
    let in_a_row = text().replace("loop\n", "loop ").replace('\n', "\r\n");
    let split = text().replacen(" endfacet\n", " endfacet\nendsolid\nsolid second\n", 1);
    let expected = format!("{:?}", plain(text().as_bytes()).scene);
    for file in [shouted, in_a_row, split, text().replace("endsolid tetra of ours\n", "")] {
        assert_eq!(format!("{:?}", plain(file.as_bytes()).scene), expected, "{file}");
    }
}

#[test]
fn what_programs_add_and_leave_out_changes_nothing() {
    let expected = format!("{:?}", plain(text().as_bytes()).scene);
    for (from, to) in [
        ("endsolid tetra of ours", "endsolidtetra"),
        ("endsolid tetra of ours", "end solid tetra of ours"),
        ("endloop", "end loop"),
        ("endfacet", "end facet"),
        (" endfacet\n", ""),
        ("endfacet", "endfacet 0.5 0.25 1.0"),
        ("endfacet", "endfacet 128 64 255 255"),
        ("endfacet", "endfacet # remark of this"),
        ("endloop", "color 0.5 0.25 1.0\n endloop"),
        (" endfacet", "color 0.5 0.25 1.0 endfacet"),
        (" facet", "color 0.5 0.25 1.0\n facet"),
        ("  outer", "color 0.5 0.25 1.0\n  outer"),
    ] {
        let file = text().replace(from, to);
        let loaded = plain(file.as_bytes());
        assert_eq!((format!("{:?}", loaded.scene), loaded.warnings.len()), (expected.clone(), 0), "{file}");
        if to.contains('#') {
            continue;
        }
        let one = file.replacen('\n', "\r", 1).replace('\n', " ");
        assert_eq!(plain(one.as_bytes()).facts.faces, 4, "{one}");
    }
    assert!(fault(text().replace("endloop", "endlop").as_bytes()).contains("`endlop` where `endloop` should be"));
}

#[test]
fn a_file_on_one_line_is_read_and_one_without_its_end_is_told_of() {
    let whole = plain(text().as_bytes());
    let one = plain(text().replace('\n', " ").as_bytes());
    assert_eq!((one.facts.faces, one.warnings.len()), (whole.facts.faces, whole.warnings.len()));
    let nameless = plain(text().replace("tetra of ours\n", " ").as_bytes());
    assert_eq!(nameless.facts.faces, whole.facts.faces);
    let open = plain(text().rsplit_once("endsolid").unwrap().0.as_bytes());
    assert_eq!(open.facts.faces, whole.facts.faces);
    let told = open.warnings.iter().map(ToString::to_string).find(|w| w.contains("endsolid")).unwrap();
    assert_eq!(told, "a.stl:30: the file ends without `endsolid`; it may have been cut off");
}

#[test]
fn several_solids_on_one_line_are_read_in_time_that_is_proportional_to_them() {
    let one = text().replace('\n', " ");
    let named = one.replace("endsolid tetra of ours", "endsolid a solid name");
    let solids = |count| plain(named.repeat(count).as_bytes());
    assert_eq!((solids(1).facts.faces, solids(3).facts.faces, solids(3).warnings.len()), (4, 12, 0));
    let start = std::time::Instant::now();
    assert_eq!(solids(10_000).facts.faces, 40_000);
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

#[test]
fn zeros_behind_a_text_are_no_part_of_it() {
    let loaded = plain(format!("{}{}", text(), "\0".repeat(300)).as_bytes());
    assert_eq!((loaded.facts.faces, loaded.warnings.len()), (4, 0));
}

#[test]
fn both_zeros_are_one_place_and_near_places_are_two() {
    let facet =
        |x: &str| format!("facet normal 0 0 1 outer loop vertex {x} 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet\n");
    let file = format!("solid\n{}{}{}endsolid", facet("0"), facet("-0"), facet("1e-30"));
    let loaded = plain(file.as_bytes());
    assert_eq!(loaded.scene.meshes[0].positions.len(), 4);
    assert_eq!(loaded.scene.meshes[0].triangles[0], loaded.scene.meshes[0].triangles[1]);
}

#[test]
fn a_wish_for_an_axis_counts() {
    let options = LoadOptions { up: Some(UpAxis::Y), ..LoadOptions::default() };
    let loaded = of(&binary(""), &options).unwrap();
    assert_eq!((loaded.scene.up, loaded.facts.up_reason), (UpAxis::Y, None));
    assert!(plain(&binary("")).facts.up_reason.is_some());
}

#[test]
fn faults_name_the_line_or_the_byte() {
    let whole = binary("");
    let cut = fault(&whole[..whole.len() - 1]);
    assert!(cut.starts_with("a.stl:byte 234: the header claims 4 triangles, but only 3 are there"), "{cut}");
    let header = fault(&whole[..50]);
    assert!(header.starts_with("a.stl:byte 50: the file ends inside its header of 84 bytes"), "{header}");
    let expected = [
        (text().replacen("vertex", "vortex", 1), "a.stl:4: `vortex` where `vertex` should be"),
        (text().replacen("1.500", "tall", 1), "a.stl:13: `tall` where a number should be"),
        (text()[..100].to_owned(), "a.stl:6: the file ends where `vertex` should follow"),
        (text().replacen("solid", "solid x\nliquid", 1), "a.stl:2: `liquid` where `solid`, `facet` or `endsolid`"),
        ("solid\nfacet normal 0 0 1\nouter".into(), "a.stl:3: the file ends where `loop` should follow"),
    ];
    for (file, message) in expected {
        let fault = fault(file.as_bytes());
        assert!(fault.starts_with(message) && fault.lines().count() == 1, "{fault}\n{message}");
    }
}

#[test]
fn what_is_beyond_the_last_triangle_is_told_and_not_looked_at() {
    let mut longer = binary("");
    longer.extend(b"a footer");
    let loaded = plain(&longer);
    let text = "a.stl:byte 284: 8 bytes follow the 4 triangles that the header claims; they are not read";
    assert_eq!((loaded.facts.faces, loaded.warnings[0].to_string().as_str()), (4, text));
    assert!(plain(b"solid nothing\nendsolid nothing\n").scene.meshes.is_empty());
}

#[test]
fn a_count_takes_no_memory() {
    let mut huge = binary("");
    huge[80..84].copy_from_slice(&(u32::MAX - 1).to_le_bytes());
    assert!(fault(&huge).contains("claims 4294967294 triangles, but only 4"));
    let small = LoadOptions { limits: Limits { memory: 500, ..Limits::default() }, ..LoadOptions::default() };
    assert!(of(&binary(""), &small).unwrap_err().ends_with("raise --max-memory"));
}

#[test]
fn coordinates_that_are_not_finite_drop_their_faces() {
    let loaded = plain(text().replace("1.500", "nan").as_bytes());
    assert_eq!((loaded.facts.faces, loaded.warnings[0].code, loaded.warnings[0].count), (1, "face-not-finite", 3));
    assert!(loaded.scene.meshes[0].positions.iter().all(|p: &Vec3| p.is_finite()));
}

#[test]
fn attributes_are_colours_in_either_order_where_something_says_so() {
    /// The tetrahedron with these attributes; returns the sRGB codes of each triangle, 0…31.
    fn painted(header: &str, attributes: [u16; 4]) -> Vec<[f32; 3]> {
        let mut bytes = binary(header);
        for (record, attributes) in bytes[84..].as_chunks_mut::<50>().0.iter_mut().zip(attributes) {
            record[48..].copy_from_slice(&attributes.to_le_bytes());
        }
        let loaded = plain(&bytes);
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let mesh = &loaded.scene.meshes[0];
        let codes =
            |color: crate::math::Vec4| color.truncate().to_array().map(|c| (to_srgb(c) * 31.0 * 1e3).round() / 1e3);
        let color = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| mesh.colors[i as usize]);
            assert!(a == b && b == c && a.w == 1.0);
            codes(a)
        };
        mesh.triangles.iter().map(color).collect()
    }
    let own = 1 << 15;
    let (low, high) = ([31.0, 15.0, 0.0], [0.0, 15.0, 31.0]);
    let parts = 31 | 15 << 5;
    let grey = (to_srgb(0.6) * 31.0 * 1e3).round() / 1e3;
    assert_eq!(painted("VisCAM", [own | parts, parts, own, own | parts]), [high, [grey; 3], [0.0; 3], high]);
    // The header is a string here: bytes of codes below 128.
    let header = "COLOR=\x33\x66\x00\x7f,MATERIAL=";
    let whole = [31.0 * 0.2, 31.0 * 0.4, 0.0].map(|c: f32| (c * 1e3).round() / 1e3);
    assert_eq!(painted(header, [parts, own | parts, 0, parts]), [low, whole, [0.0; 3], low]);
    assert_eq!(painted(header, [0; 4]), [whole; 4], "nothing but the colour of the whole");
    assert_eq!(painted(header, [own | parts, own, own | parts, own]), [low, [0.0; 3], low, [0.0; 3]], "MeshLab's");
    assert_eq!(painted(header, [own | parts; 4]), [whole; 4], "nothing differs: no colours of their own");
    for plain_header in ["", "COLOR"] {
        assert!(plain(&binary(plain_header)).scene.meshes[0].colors.is_empty(), "{plain_header}");
    }
}

#[test]
fn triangles_behind_a_header_that_counts_none_are_drawn_and_told() {
    let mut bytes = binary("");
    bytes[80..84].fill(0);
    let loaded = plain(&bytes);
    let text = "a.stl:byte 80: the header claims 0 triangles, but 4 are there; they are drawn";
    assert_eq!((loaded.facts.faces, loaded.warnings[0].to_string().as_str()), (4, text));
    bytes[80..84].fill(0xff);
    assert_eq!(plain(&bytes).warnings[0].to_string(), text.replace("claims 0", "claims 4294967295"));
    bytes[80..84].fill(0);
    // An incomplete triangle does not count.
    bytes.pop();
    let loaded = plain(&bytes);
    assert_eq!((loaded.facts.faces, loaded.warnings[0].code), (0, "stl-bytes-behind"));
}

#[test]
fn corners_that_are_no_numbers_as_c_prints_them_cost_their_facet() {
    let loaded = plain(text().replacen("1.500", "-nan(ind)", 1).as_bytes());
    assert_eq!((loaded.facts.faces, loaded.warnings[0].code), (3, "face-not-finite"));
}

#[test]
fn decimal_commas_are_read_and_told_once() {
    let told = |file: String| plain(file.as_bytes()).warnings.iter().map(ToString::to_string).collect::<Vec<_>>();
    let (points, commas) = (text(), text().replace("1.500", "1,500"));
    assert_eq!(plain(commas.as_bytes()).scene.meshes[0].positions, plain(points.as_bytes()).scene.meshes[0].positions);
    let count = commas.matches("1,500").count();
    let warning = told(commas);
    assert!(warning.len() == 1 && count > 1, "{warning:?}");
    assert!(warning[0].starts_with("a.stl:13: `1,500` is read with a decimal point and `e`"), "{warning:?}");
    assert!(warning[0].contains(&count.to_string()), "{warning:?}");
}
