//! Messages and remedies of refused files.

use super::*;

fn told(bytes: &[u8]) -> Vec<String> {
    fault(bytes).lines().map(str::to_owned).collect()
}

#[test]
fn a_file_that_was_cut_off_says_so_before_what_is_missing() {
    let mut file = Builder::new();
    let position = file.triangle();
    let glb = file.primitive(json!({"attributes": {"POSITION": position}})).glb();
    let lines = told(&glb[..glb.len() - 20]);
    assert_eq!(
        lines[..2],
        [
            format!(
                "a.gltf: the header declares {} bytes, the file has {}; it was cut off; get it again",
                glb.len(),
                glb.len() - 20
            ),
            "a.gltf:chunk 1: it should have 36 bytes, only 16 are there; it was cut off; get it again".to_owned(),
        ]
    );
    assert!(lines.last().unwrap().contains("POSITION: 3 elements are declared, the data ends after 1; "), "{lines:?}");
}

#[test]
fn a_buffer_that_is_too_short_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = Builder::new();
    let position = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": position}}));
    file.set("buffers", json!([{"byteLength": 36, "uri": "data/short.bin"}]));
    std::fs::create_dir(folder.path().join("data")).unwrap();
    std::fs::write(folder.path().join("data/short.bin"), [0; 12]).unwrap();
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, file.root.to_string()).unwrap();
    let error = crate::load::load(&path, &LoadOptions::default()).unwrap_err().to_string();
    let why = "buffers[0]: 36 bytes are declared, 12 are there in 'data/short.bin'; it was cut off; get it again";
    assert!(error.lines().next().unwrap().ends_with(why), "{error}");
}

#[test]
fn json_that_cannot_be_read_says_where_and_why() {
    for (text, said) in [
        (
            "{\"asset\": {\n  \"version\" 2}}",
            "a.gltf:2:13: the JSON cannot be read: expected `:`; it is damaged; export it again",
        ),
        (
            "{\"asset\": {\"vers",
            "a.gltf:1:16: the JSON cannot be read: EOF while parsing a string; it was cut off; get it again",
        ),
        (
            "hello",
            "a.gltf: it begins neither with `glTF` nor with `{`, so it is no glTF; give it the extension of what it is, or export it again",
        ),
    ] {
        assert_eq!(told(text.as_bytes()), [said]);
    }
    let wide: Vec<u8> = "\u{feff}{}".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(told(&wide), ["a.gltf: the JSON is UTF-16 where UTF-8 should be; save it as UTF-8"]);
}

#[test]
fn what_is_not_there_is_counted() {
    let said = |json: &str| fault(json.as_bytes());
    let asset = r#""asset": {"version": "2.0"}"#;
    let lost = said(&format!(
        "{{{asset}, \"nodes\": [{{\"mesh\": 9}}], \"meshes\": [{{\"primitives\": [{{\"attributes\": {{}}}}]}}]}}"
    ));
    assert!(lost.contains("nodes[0].mesh: index 9, but only 1 mesh is there; it is damaged"), "{lost}");
    let lost = said(&format!("{{{asset}, \"scenes\": [{{\"nodes\": [4]}}], \"nodes\": [{{}}, {{}}]}}"));
    assert!(lost.contains("scenes[0].nodes[0]: index 4, but only 2 nodes are there; it is damaged"), "{lost}");
    let skew = said(&format!("{{{asset}, \"nodes\": [{{\"matrix\": [1, 2, 3]}}]}}"));
    assert!(skew.contains("nodes[0].matrix: 3 elements where 16 should be; it is damaged"), "{skew}");
}

#[test]
fn what_a_picture_can_do_without_is_told_to_be_left_out() {
    let mut file = Builder::new();
    let position = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": position}}));
    file.set("cameras", json!([{"type": "perspective", "perspective": {"znear": 1}}]));
    let warnings: Vec<String> = file.load().warnings.iter().map(ToString::to_string).collect();
    assert_eq!(warnings[0], "a.gltf:cameras[0].perspective: 'yfov' is missing; it is left out");
}
