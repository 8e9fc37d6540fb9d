//! Faults of parts that a picture can do without: declared bounds and cameras.

use super::*;

/// A triangle whose positions declare these bounds.
fn bounded(min: Value, max: Value) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.root["accessors"][positions]["min"] = min;
    file.root["accessors"][positions]["max"] = max;
    file.primitive(json!({"attributes": {"POSITION": positions}})).load()
}

#[test]
fn bounds_of_a_wrong_length_or_kind_are_told_and_nothing_hangs_on_them() {
    let right = json!([1, 1, 0]);
    for (min, code) in [
        (json!([0, 0]), "gltf-array-length-not-in-list"),
        (json!([0, 0, 0, 0]), "gltf-array-length-not-in-list"),
        (json!(["x", 0, 0]), "gltf-type-mismatch"),
        (json!(null), "gltf-type-mismatch"),
    ] {
        let loaded = bounded(min.clone(), right.clone());
        assert_eq!((codes(&loaded), loaded.facts.faces), (vec![code], 1), "{min}");
    }
    let told = bounded(json!([0, 0]), right).warnings[0].to_string();
    let expected = "a.gltf:accessors[0].min: 2 numbers for elements of 3; bounds are computed from the data";
    assert_eq!(told, expected);
    // Each number is compared with what it stands for.
    assert_eq!(codes(&bounded(json!([0, 0, 0]), json!([null, 1, 0]))), ["gltf-type-mismatch"]);
}

/// A triangle, and a node with this camera.
fn seen_by(camera: Value) -> Loaded {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}}));
    file.set("nodes", json!([{"mesh": 0, "children": [1]}, {"camera": 0}]));
    file.set("cameras", json!([camera])).load()
}

#[test]
fn a_camera_without_the_planes_that_rays_do_not_need_is_kept() {
    for camera in [
        json!({"type": "perspective", "perspective": {"yfov": 0.8}}),
        json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1}}),
    ] {
        let loaded = seen_by(camera);
        assert_eq!(loaded.scene.cameras.len(), 1);
        let told = || loaded.warnings.iter().filter(|w| w.place.starts_with("cameras"));
        assert!(told().count() > 0 && told().all(|w| w.text.ends_with("is missing")), "{:?}", loaded.warnings);
    }
}

#[test]
fn a_camera_that_cannot_be_read_is_left_out_of_a_model_that_can_be_drawn() {
    let told = |camera: Value| {
        let loaded = seen_by(camera);
        assert_eq!((loaded.facts.faces, loaded.scene.cameras.len()), (1, 0));
        let told = loaded.warnings.iter().filter(|w| w.place.starts_with("cameras"));
        told.map(ToString::to_string).collect::<Vec<_>>()
    };
    let missing = "a.gltf:cameras[0]: 'perspective' is missing; the camera is left out";
    assert_eq!(told(json!({"type": "perspective"})), [missing]);
    for camera in [
        json!({"type": "perspective", "perspective": {"znear": 0.1}}),
        json!({"type": "perspective", "perspective": {"yfov": "wide", "znear": 0.1}}),
        json!({"perspective": {"yfov": 1, "znear": 0.1}}),
        json!(7),
    ] {
        assert!(!told(camera.clone()).is_empty(), "{camera}");
    }
}

#[test]
fn of_two_projections_that_of_the_camera_s_type_counts() {
    let orthographic = json!({"xmag": 3, "ymag": 2, "znear": 0.1, "zfar": 3});
    let perspective = json!({"yfov": 1, "znear": 0.1});
    let loaded = seen_by(json!({"type": "orthographic", "perspective": perspective, "orthographic": orthographic}));
    assert_eq!(codes(&loaded), ["gltf-one-of-mismatch"]);
    assert_eq!(loaded.scene.cameras[0].projection, Projection::Orthographic { x_mag: 3.0, y_mag: 2.0 });
}
