use super::*;
use crate::load::Polygons;

fn load_with(text: &str, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let source = Source::new("a.nff".into(), text.into());
    load(&source, options, &mut Budget::new(&options.limits))
}

fn load_text(text: &str) -> Result<Loaded, LoadError> {
    load_with(text, &LoadOptions::default())
}

fn scene(text: &str) -> Scene {
    load_text(text).unwrap().scene
}

const VIEW: &str = "v\nfrom 2 1 3\nat 0 0 0\nup 0 0 1\nangle 45\nhither 0.01\nresolution 512 256\n";

#[test]
fn every_statement_is_read() {
    let text = format!(
        "# a comment\nb 0.1 0.2 0.3\n{VIEW}l 4 3 2\nl 1 -4 4 1 0 0\nf 1 0.5 0 0.5 0.25 30 0 0\n\
         p 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\ns 0 0 1 0.5\nc 0 0 0 1 0 0 2 0\n\
         f 1 1 1 0 0.1 9 0.8 1.5\npp 3\n0 0 0 0 0 2\n1 0 0 0 1 1\n0 1 0 1 0 0\nc 0 0 0 -1\n0 0 2 -1\n"
    );
    let loaded = load_text(&text).unwrap();
    let scene = &loaded.scene;
    assert_eq!((scene.lights.len(), scene.spheres.len(), scene.cones.len(), scene.meshes.len()), (2, 1, 2, 2));
    assert_eq!((scene.meshes[0].triangles.len(), scene.meshes[0].normals.len()), (2, 0));
    assert_eq!((scene.meshes[1].triangles.len(), scene.meshes[1].normals[0]), (1, Vec3::Z));
    assert_eq!((scene.cones[0].apex_radius, scene.cones[1].base_radius, scene.cones[1].material), (0.0, 1.0, 1));
    assert_eq!(scene.background, Some(Background::Color(Vec3::new(0.1, 0.2, 0.3))));
    assert_eq!((scene.hints.size, scene.hints.camera, scene.up), (Some((512, 256)), Some(0), UpAxis::Z));
    assert_eq!((loaded.facts.faces, loaded.facts.format.as_str()), (2, "NFF"));
    assert!(loaded.warnings.is_empty());
}

#[test]
fn a_fill_becomes_phong_with_mirror_and_glass() {
    let scene = scene(
        "f 1 0.5 0 0.5 0.25 30 0 0\ns 0 0 0 1\nf 1 1 1 0 0.1 9 0.8 1.5\ns 0 0 0 2\nf 1 0.5 0 0.5 0.25 30 0 0\ns 0 0 0 3\n",
    );
    assert_eq!(scene.spheres.iter().map(|s| s.material).collect::<Vec<_>>(), [0, 1, 0]);
    let phong = |i: usize| match &scene.materials[i].reflection {
        Reflection::Phong(phong) => phong.clone(),
        other => panic!("{other:?}"),
    };
    assert_eq!(scene.materials[0].base_color, Vec3::new(0.5, 0.25, 0.0));
    assert_eq!((phong(0).mirror, phong(0).specular), (Vec3::new(0.25, 0.125, 0.0), Vec3::splat(0.25)));
    assert_eq!((phong(0).ior, phong(1).ior, phong(1).transmission), (1.0, 1.5, Vec3::splat(0.8)));
}

#[test]
fn lights_and_the_ambient_term_get_weaker_the_more_there_are() {
    let scene = scene("l 1 2 3\nl 1 2 3\nl 1 2 3\nl 1 2 3 0 1 0\n");
    assert_eq!((scene.ambient, scene.lights[3].intensity), (Vec3::splat(0.25), Vec3::new(0.0, 0.25, 0.0)));
}

#[test]
fn what_is_wrong_is_told_with_its_line() {
    for (text, said) in [
        ("b 0 0 0\n\nq 3\n", "a.nff:3: `q` is no statement; NFF has v, b, l, f, p, pp, s and c"),
        ("s 0 0 0 one\n", "a.nff:1: `one` is no number, in `s`"),
        ("s 0 0\n0 nan\n", "a.nff:2: `nan` is no number, in `s`"),
        ("p 4\n0 0 0\n1 0 0\n", "a.nff:3: the file ends inside `p`, where a number should follow"),
        ("p 2\n0 0 0\n1 0 0\n", "a.nff:1: `p` has 2, which is no whole number from 3 to 1000000"),
        ("v from 0 0 0 at 0 0 0", "are the same point"),
        ("v\nfrom 1 2 3\nat 1 2 3\nup 0 0 1\nangle 45\n", "a.nff:3: `from` and `at` are the same point"),
        (
            "v\nfrom 0 0 1\nangle 190\nhither 1\n",
            "a.nff:3: `angle` is 190; give it more than 0 and less than 180 degrees",
        ),
    ] {
        let error = load_text(text).unwrap_err().to_string();
        assert!(error.contains(said), "{text}: {error}");
    }
}

#[test]
fn shapes_without_extent_are_left_out_and_counted() {
    let loaded = load_text("s 0 0 0 0\nc 0 0 0 1 0 0 0 2\np 3\n0 0 0\n1 1 1\n2 2 2\ns 0 0 0 1\n").unwrap();
    assert_eq!((loaded.scene.spheres.len(), loaded.scene.cones.len(), loaded.scene.meshes.len()), (1, 0, 0));
    assert!(loaded.warnings[0].to_string().contains("3 shapes without extent"));
}

#[test]
fn a_concave_polygon_is_cut_or_stays_whole() {
    let text = "p 5\n0 0 0\n4 0 0\n4 4 0\n2 1 0\n0 4 0\n";
    let cut = scene(text);
    assert_eq!((cut.meshes[0].triangles.len(), cut.meshes[0].polygons.len()), (3, 0));
    let options = LoadOptions { polygons: Polygons::Whole, ..LoadOptions::default() };
    let whole = load_with(text, &options).unwrap().scene;
    assert_eq!((whole.meshes[0].triangles.len(), whole.meshes[0].polygons[0].len), (0, 5));
}

#[test]
fn equal_corners_are_shared_and_far_ones_keep_their_digits() {
    let far = scene("p 3\n1e7 0 0\n1e7 1 0\n1e7 0 0.125\np 3\n1e7 1 0\n1e7 0 0\n1e7 0 -0.125\n");
    let (mesh, place) = (&far.meshes[0], far.instances[0].world_from_object);
    assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
    assert_eq!(place.transform_point3(mesh.positions[2].as_dvec3()), DVec3::new(1e7, 0.0, 0.125));
}

#[test]
fn shapes_too_far_away_are_left_out_and_counted_and_move_nothing() {
    let text = "p 3 1e200 0 0 2e200 0 0 1e200 1e200 0\np 3 1e39 0 0 2e39 0 0 1e39 1e39 0\np 3 0.1 0 0 1.1 0 0 0.1 1 0\n\
                s 1e300 0 0 1e300\nc 0 0 0 1 1e308 0 0 1\ns 0 0 0 1e19\n";
    let loaded = load_text(text).unwrap();
    let told: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told, ["a.nff: a shape is left out: a coordinate or size is over 1e18 (×5)"]);
    assert_eq!((loaded.facts.faces, loaded.facts.dropped[0].1), (1, 5));
    assert!(loaded.facts.max_rounding < 1e-7, "{}", loaded.facts.max_rounding);
    assert_eq!((loaded.scene.spheres.len(), loaded.scene.cones.len()), (0, 0));
}

#[test]
fn triangles_that_a_far_one_makes_too_small_are_counted() {
    let loaded = load_text("p 3 1e10 0 0 2e10 0 0 1e10 1e10 0\np 3 0 0 0 1 0 0 0 1 0\n").unwrap();
    assert_eq!((loaded.facts.faces, loaded.warnings[0].code), (1, "face-degenerate"));
}

#[test]
fn memory_over_the_budget_is_refused_before_it_is_taken() {
    let of = |text: String, memory: u64| {
        let mut options = LoadOptions::default();
        options.limits.memory = memory;
        load_with(&text, &options).map_err(|e| e.to_string())
    };
    let texts = [
        "s 0 0 0 1\n".repeat(1000),
        "c 0 0 0 1 1 1 1 1\n".repeat(1000),
        "l 0 0 0\n".repeat(1000),
        (0..1000).map(|i| format!("f {i} 0 0 1 0 1 0 0\n")).collect(),
        (0..1000).map(|i| format!("p 3 {i} 0 0 1 0 1 0 1 0\n")).collect(),
    ];
    for text in texts {
        let fault = of(text.clone(), 60_000).unwrap_err();
        assert!(fault.starts_with("a.nff: ") && fault.ends_with("raise --max-memory"), "{fault}");
        assert!(of(text, 10_000_000).is_ok());
    }
}

#[test]
fn many_fills_are_told_apart_in_little_time() {
    let text: String = (0..200_000).map(|i| format!("f {i} 0 0 1 0 1 0 0\ns 0 0 0 1\n")).collect();
    let start = std::time::Instant::now();
    let scene = scene(&format!("{text}f 7 0 0 1 0 1 0 0\ns 0 0 0 1\n"));
    assert_eq!((scene.materials.len(), scene.spheres[200_000].material), (200_000, 7));
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}
