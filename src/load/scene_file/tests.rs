use super::*;
use crate::math::{DAffine3, Vec3};
use crate::scene::{AlphaMode, Falloff, LightKind, Projection, Reflection};

fn load_source(source: &Source) -> Result<Loaded, LoadError> {
    load_with(source, &LoadOptions::default())
}

fn load_with(source: &Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    load(source, options, &mut Budget::new(&options.limits))
}

fn load_text(text: &str) -> Result<Loaded, LoadError> {
    load_source(&Source::new("dir/test.toml".into(), text.into()))
}

fn faults(text: &str) -> Vec<String> {
    match load_text(text) {
        Err(LoadError::Input(list)) => list.iter().map(ToString::to_string).collect(),
        other => panic!("expected faults, got {other:?}"),
    }
}

#[test]
fn the_schema_in_the_module_head_is_read_without_a_fault() {
    let head = include_str!("mod.rs");
    let block = head.split("```toml\n").nth(1).unwrap().split("//! ```").next().unwrap();
    let text: String = block.lines().map(|l| l.trim_start_matches("//!").trim_start()).collect::<Vec<_>>().join("\n");
    // Its model does not exist, which is the only fault.
    let errors = faults(&text);
    assert!(errors.len() == 1 && errors[0].contains("bunny.obj"), "{errors:#?}");
    let without = text.replace("[[models]]", "[[unused]]");
    let (start, end) = (without.find("[[unused]]").unwrap(), without.find("[[meshes]]").unwrap());
    let scene = load_text(&format!("{}{}", &without[..start], &without[end..])).unwrap().scene;
    assert_eq!((scene.materials.len(), scene.spheres.len(), scene.planes.len()), (3, 1, 1));
    assert_eq!(
        scene.cones.iter().map(|c| (c.base_radius, c.apex_radius)).collect::<Vec<_>>(),
        [(1.0, 0.5), (1.0, 1.0)]
    );
    assert_eq!((scene.meshes[0].triangles.len(), scene.cameras.len(), scene.lights.len()), (2, 1, 4));
    assert_eq!((scene.hints.size, scene.hints.depth), (Some((800, 600)), Some(1)));
}

#[test]
fn a_picture_may_surround_the_scene() {
    let dir = tempfile::tempdir().unwrap();
    ::image::Rgb32FImage::from_pixel(4, 2, ::image::Rgb([2.0, 1.0, 0.5])).save(dir.path().join("sky.exr")).unwrap();
    let text = "environment = 'sky.exr'\nenvironment_rotation = 90\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n";
    let source = Source::new(dir.path().join("a.toml"), text.into());
    let loaded = load_source(&source).unwrap();
    assert_eq!(loaded.scene.environment, Environment::Panorama);
    let panorama = loaded.scene.panorama.unwrap();
    assert_eq!((panorama.width, panorama.texels[7]), (4, [2.0, 1.0, 0.5]));
    assert_eq!(panorama.rotation, std::f32::consts::FRAC_PI_2);
    assert_eq!(loaded.facts.files.len(), 2, "it belongs to the hash of the input");
    let alone = faults("environment = 'studio'\nenvironment_rotation = 9\n");
    assert!(alone[0].contains("names none"), "{alone:?}");
    assert!(faults("environment = 'no.exr'\n")[0].starts_with("dir/test.toml:1:"));
}

#[test]
fn an_unknown_key_names_the_nearest_with_its_line_and_column() {
    let errors = faults("[materials.red]\n  difuse = 1\n[[spheres]]\ncenter=[0,0,0]\nradius=1\nmatreial='red'\n");
    assert_eq!(
        errors,
        [
            "dir/test.toml:2:3: unknown key `difuse` in material; did you mean `diffuse`?",
            "dir/test.toml:6:1: unknown key `matreial` in sphere; did you mean `material`?",
        ]
    );
}

#[test]
fn broken_syntax_says_where() {
    let errors = faults("up = \"y\"\n[[spheres]\n");
    assert!(errors[0].starts_with("dir/test.toml:2:"), "{errors:?}");
    assert!(load_text("\u{feff}up = 'y'").is_ok());
    assert!(load_source(&Source::new("x.toml".into(), vec![0xff])).is_err());
}

#[test]
fn wrong_values_say_what_would_be_right() {
    for (text, said) in [
        ("up = 'x'", "none of `y`, `z`"),
        ("background = 'wite'", "no colour"),
        ("[[spheres]]\ncenter=[0,0]\nradius=1", "must have 3 numbers, not 2"),
        ("[[spheres]]\ncenter=[0,0,0]\nradius=-1", "must be above 0"),
        ("[[spheres]]\ncenter=[0,0,inf]\nradius=1", "finite"),
        ("[[spheres]]\nradius=1", "no `center`"),
        ("[[spheres]]\ncenter=[0,0,0]\nradius=1\nmaterial='x'", "write [materials.x]"),
        ("spheres = 3", "list of tables"),
        ("[[cones]]\nbase=[0,0,0]\napex=[0,1,0]\nbase_radius=-1", "is -1, but must not be below 0"),
        ("[[cones]]\nbase=[0,0,0]\napex=[0,1,0]\nbase_radius=0", "both radii are 0"),
        ("[[cones]]\nbase=[0,1,0]\napex=[0,1,0]\nbase_radius=1", "test.toml:3:6: `base` and `apex` are the same point"),
        ("[[cones]]\nbase=[0,1,0]\nbase_radius=1", "this cone has no `apex`"),
        ("[[cone]]\nbase=[0,1,0]", "unknown key `cone` in the scene; did you mean `cones`?"),
        ("[[cylinders]]\nbase=[0,0,0]\ntop=[0,1,0]\nradius=0", "must be above 0"),
        ("[[cylinders]]\nbase=[0,0,0]\ntop=[0,0,0]\nradius=1", "`base` and `top` are the same point"),
        ("[[cylinders]]\nbase=[0,0,0]\ntop=[0,1,0]\nradius=1\napex_radius=1", "unknown key `apex_radius` in cylinder"),
        ("[materials]\nred = 1", "not a material table"),
        ("[materials.g]\nmetallic = 1", "add model = \"pbr\""),
        ("[materials.g]\nior = 'unobtainium'", "no known substance"),
        ("[[planes]]\nnormal=[0,0,0]", "must have a length"),
        ("[[lights]]\nkind='lamp'", "none of `point`"),
        ("[[lights]]\nkind='point'\nposition=[0,0,0]\nrange=3", "inverse-square"),
        ("[[lights]]\nkind='spot'\nposition=[0,0,0]\ndirection=[0,1,0]\ninner=50\nouter=20", "above `outer`"),
        ("[[cameras]]\neye=[0,0,0]", "looks nowhere"),
        ("[[cameras]]\neye=[0,0,1]\nfov=20\northo=3", "not both"),
        ("[[meshes]]\npositions=[[0,0,0]]\nfaces=[[0,0,7]]", "corner 7, but only 1 positions"),
        ("[[meshes]]\npositions=[[0,0,0]]\nfaces=[[0,0]]", "has 2 corners"),
        ("[[meshes]]\npositions=[]\nfaces=[]\nscale=0", "must not be 0"),
        ("[render]\nsize=[0,1]", "1 to 65535"),
        ("[render]\ndepth=1.5", "whole number"),
        ("[[models]]\nfile='../../etc/passwd'", "outside"),
        ("[[models]]\nfile='http://example.org/a.glb'", "a.glb"),
    ] {
        let errors = faults(text);
        assert!(errors.iter().any(|e| e.contains(said)), "{text}: {errors:?}");
    }
}

#[test]
fn all_faults_are_told_in_the_order_of_the_file() {
    let errors = faults("[[spheres]]\nradius=1\n[materials.a]\nx=1\n[[planes]]\n");
    let lines: Vec<_> = errors.iter().map(|e| e.split(':').nth(1).unwrap().to_owned()).collect();
    assert_eq!(lines, ["1", "4", "5"]);
}

#[test]
fn all_files_that_are_not_there_are_told_at_once() {
    let errors =
        faults("environment='no.exr'\n[[models]]\nfile='a.obj'\n[[models]]\nfile='../b.obj'\n[[models]]\nfile='c.obj'");
    let said = [
        "test.toml:1:13: 'no.exr' is not there",
        "3:6: 'a.obj' is not there",
        "5:6: '../b.obj' lies outside",
        "7:6: 'c.obj'",
    ];
    assert_eq!(errors.len(), said.len(), "{errors:?}");
    assert!(errors.iter().zip(said).all(|(error, said)| error.contains(said)), "{errors:?}");
    assert_eq!(faults(&"[[models]]\nfile='a.obj'\n".repeat(100)).len(), 21);
}

#[test]
fn of_many_faults_the_first_are_listed_in_little_time() {
    // Unknown names, whose nearest is searched; on one line, where columns are far from its start.
    let materials: String = (0..20_000).map(|i| format!("[materials.m{i}]\n")).collect();
    let wrong = "{ center = [0, 0, 0], radius = 1, material = 'n', radios = 1 },".repeat(20_000);
    let start = std::time::Instant::now();
    let errors = faults(&format!("spheres = [{wrong}]\n{materials}"));
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
    assert_eq!((errors.len(), errors[20].as_str()), (21, "dir/test.toml: 39980 more faults"));
    assert!(
        errors[0].starts_with("dir/test.toml:1:57: `material` is `n`, but no [materials.n] is there"),
        "{}",
        errors[0]
    );
    assert!(
        errors[19].starts_with("dir/test.toml:1:629: unknown key `radios` in sphere; did you mean `radius`?"),
        "{}",
        errors[19]
    );
    // Also faults of syntax; a fault noted last may come first.
    let syntax = faults(&"=\n".repeat(100_000));
    assert_eq!((syntax.len(), start.elapsed().as_secs() < 60), (21, true));
    let first = faults(&format!("zzz = 1\n{}", "[[spheres]]\n".repeat(1000)));
    assert!(first[0].starts_with("dir/test.toml:1:1: unknown key `zzz`"), "{}", first[0]);
}

#[test]
fn many_materials_are_found_by_name_in_little_time() {
    let text: String = (0..100_000)
        .map(|i| format!("[materials.m{i}]\n[[spheres]]\ncenter=[0,0,0]\nradius=1\nmaterial='m{}'\n", 99_999 - i))
        .collect();
    let start = std::time::Instant::now();
    let scene = load_text(&text).unwrap().scene;
    assert_eq!((scene.materials.len(), scene.spheres[7].material), (100_000, 99_992));
    assert!(start.elapsed().as_secs() < 30, "{:?}", start.elapsed());
}

#[test]
fn meshes_far_from_the_origin_keep_their_digits_and_stand_together() {
    let quad = |x: &str| {
        format!(
            "[[meshes]]\npositions=[[5000000.{x},4000000,0],[5000001,4000000.1,0],[5000001,4000001,0]]\nfaces=[[0,1,2]]\n"
        )
    };
    let loaded = load_text(&format!(
        "{}{}[[meshes]]\npositions=[[0.1,0,0],[1,0,0],[0,1,0]]\nfaces=[[0,1,2]]\nscale=2\n",
        quad("1"),
        quad("25")
    ))
    .unwrap();
    assert!(loaded.facts.max_rounding < 1e-7 && loaded.warnings.is_empty(), "{:?}", loaded.facts);
    let [a, b, c] = [0, 1, 2].map(|i| loaded.scene.instances[i].world_from_object);
    assert_eq!((a, c.matrix3.x_axis), (b, DVec3::new(2.0, 0.0, 0.0)));
    let corner = a.transform_point3(loaded.scene.meshes[0].positions[0].as_dvec3());
    assert!(corner.distance(DVec3::new(5_000_000.1, 4e6, 0.0)) < 1e-7, "{corner}");
}

#[test]
fn shapes_too_far_away_are_left_out_with_the_place_of_the_first() {
    let text = "[[meshes]]\npositions=[[1e300,0,0],[0,0,0],[1,0,0],[0,1,0],[0,1e-40,0]]\nfaces=[[0,1,2],[1,2,3],[1,4,2]]\n\
                [[spheres]]\ncenter=[1e308,0,0]\nradius=1e308\n[[cylinders]]\nbase=[0,0,0]\ntop=[1,0,0]\nradius=1e19\n\
                [[cones]]\nbase=[0,0,0]\napex=[0,0,2e18]\nbase_radius=1\n[[planes]]\nnormal=[0,1,0]\npoint=[0,1e300,0]\n";
    let loaded = load_text(text).unwrap();
    let told: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(
        told,
        [
            "dir/test.toml:1:1: a shape is left out: a coordinate or size is over 1e18 (×5)",
            "dir/test.toml:1:1: a triangle is left out: two corners are in one place once coordinates are rounded",
        ]
    );
    let Scene { meshes, spheres, cones, planes, .. } = loaded.scene;
    assert_eq!((spheres.len(), cones.len(), planes.len(), loaded.facts.faces), (0, 0, 0, 1));
    assert!(meshes[0].positions.len() == 4 && meshes[0].positions.iter().all(|p| p.is_finite()));
}

#[test]
fn transforms_act_in_the_order_scale_rotate_translate() {
    let at = |keys: &str| {
        let text = format!("[[meshes]]\npositions=[[1,0,0]]\nfaces=[]\n{keys}");
        load_text(&text).unwrap().scene.instances[0].world_from_object.transform_point3(DVec3::X)
    };
    let steps = at("scale=2\nrotate=[0,90,0]\ntranslate=[0,1,0]");
    assert!(steps.abs_diff_eq(DVec3::new(0.0, 1.0, -2.0), 1e-12), "{steps}");
    assert!(at("rotate={axis=[0,0,2],angle=90}").abs_diff_eq(DVec3::Y, 1e-12));
    assert_eq!(at("matrix=[[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]"), DVec3::new(6.0, 0.0, 0.0));
    // About x, then y: z goes to -y and stays there.
    let text = "[[meshes]]\npositions=[]\nfaces=[]\nrotate=[90,90,0]";
    let place = load_text(text).unwrap().scene.instances[0].world_from_object;
    assert!(place.transform_vector3(DVec3::Z).abs_diff_eq(DVec3::NEG_Y, 1e-12));
}

#[test]
fn colours_are_linear_numbers_or_srgb_words() {
    let text = "[materials.a]\ndiffuse=[0.5,0.25,0.125]\nspecular=0.5\nmirror='#ffffff'\nior='water'\nopacity=0.5";
    let material = load_text(text).unwrap().scene.materials.remove(0);
    assert_eq!(material.base_color, Vec3::new(0.5, 0.25, 0.125));
    assert_eq!(material.alpha_mode, AlphaMode::Blend);
    let Reflection::Phong(phong) = material.reflection else { panic!("not Phong") };
    assert_eq!((phong.ambient, phong.specular), (material.base_color, Vec3::splat(0.5)));
    assert_eq!((phong.mirror, phong.ior), (Vec3::ONE, 1.33));
}

#[test]
fn lights_and_cameras_come_out_in_radians_and_world_space() {
    let text = "[[lights]]\nkind='spot'\nposition=[0,1,0]\ndirection=[0,-3,0]\nouter=90\nintensity=2\n\
                [[lights]]\nkind='ambient'\ncolor=0.2\n\
                [[cameras]]\neye=[0,0,25]\nfov=50\n[[cameras]]\neye=[0,9,0]\northo=4";
    let scene = load_text(text).unwrap().scene;
    let LightKind::Spot { direction, outer, falloff, .. } = scene.lights[0].kind else { panic!("not a spot") };
    assert_eq!((direction, falloff), (DVec3::NEG_Y, Falloff::None));
    assert!((outer - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!((scene.lights[0].intensity, scene.ambient), (Vec3::splat(2.0), Vec3::splat(0.2)));
    assert_eq!(scene.cameras[0].world_from_camera, DAffine3::from_translation(DVec3::new(0.0, 0.0, 25.0)));
    // Straight down: up lies along the view, and the camera's axes are independent nevertheless.
    assert!((scene.cameras[1].world_from_camera.matrix3.determinant() - 1.0).abs() < 1e-12);
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { x_mag: 2.0, y_mag: 2.0 });
}

#[test]
fn a_scene_file_that_names_itself_ends_in_a_message() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.toml");
    std::fs::write(&path, "[[models]]\nfile = \"a.toml\"\n").unwrap();
    let error = crate::load::load(&path, &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("a.toml:2:8") && error.contains("do not nest"), "{error}");
}

#[test]
fn the_material_of_a_model_replaces_those_of_all_its_shapes() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(
        dir.path().join("m.nff"),
        "f 0 1 0 1 0 1 0 0\ns 0 0 0 1\nc 2 0 0 1 2 1 0 1\np 3 0 0 0 1 0 0 0 1 0\n",
    )
    .unwrap();
    let text = "[materials.green]\n[materials.red]\n[[spheres]]\ncenter=[9,9,9]\nradius=1\nmaterial='green'\n\
                [[models]]\nfile='m.nff'\nmaterial='red'\n[[models]]\nfile='m.nff'\n";
    let source = Source::new(dir.path().join("a.toml"), text.into());
    let scene = load_source(&source).unwrap().scene;
    let named = |material: u32| scene.materials[material as usize].name.as_str();
    assert_eq!(
        scene.spheres.iter().map(|s| named(s.material)).collect::<Vec<_>>(),
        ["green", "red", "0 1 0 1 0 1 0 0"]
    );
    assert_eq!(scene.cones.iter().map(|c| named(c.material)).collect::<Vec<_>>(), ["red", "0 1 0 1 0 1 0 0"]);
    assert_eq!(scene.meshes.iter().map(|m| named(m.material)).collect::<Vec<_>>(), ["red", "0 1 0 1 0 1 0 0"]);
}

#[test]
fn what_several_models_show_is_read_once_and_stands_as_if_it_were_read_for_each() {
    let dir = tempfile::tempdir().unwrap();
    let text = "f 0 1 0 1 0 1 0 0\ns 0 0 0 1\nc 2 0 0 1 2 1 0 1\np 3 0 0 0 1 0 0 0 1 0\nl 1 2 3\n";
    ["m.nff", "copy.nff"].iter().for_each(|name| std::fs::write(dir.path().join(name), text).unwrap());
    let load = |second: &str| {
        let text = format!(
            "[[models]]\nfile='m.nff'\ntranslate=[1,2,3]\n[[models]]\nfile='{second}'\nrotate=[10,20,30]\nscale=2\n\
             [[models]]\nfile='m.nff'\nup='z'\n"
        );
        load_source(&Source::new(dir.path().join("a.toml"), text.into())).unwrap()
    };
    let (once, each) = (load("m.nff"), load("copy.nff"));
    let stored = |loaded: &Loaded| (loaded.scene.meshes.len(), loaded.scene.materials.len());
    // The model that is turned upright is stored apart.
    assert_eq!((stored(&once), stored(&each)), ((2, 2), (3, 3)));
    let placed = |loaded: &Loaded| {
        let Scene { instances, spheres, cones, lights, cameras, .. } = &loaded.scene;
        let instances: Vec<_> = instances.iter().map(|i| i.world_from_object).collect();
        let spheres: Vec<_> = spheres.iter().map(|s| (s.center, s.radius)).collect();
        let cones: Vec<_> = cones.iter().map(|c| (c.base, c.apex, c.base_radius)).collect();
        format!("{instances:?} {spheres:?} {cones:?} {lights:?} {cameras:?} {}", loaded.facts.faces)
    };
    assert_eq!(placed(&once), placed(&each));
    let materials: Vec<u32> = once.scene.spheres.iter().map(|s| s.material).collect();
    assert_eq!(materials, [0, 0, 1]);
    assert_eq!(once.scene.instances.iter().map(|i| i.mesh).collect::<Vec<_>>(), [0, 0, 1]);
}

#[test]
fn the_text_and_all_models_share_one_budget() {
    let dir = tempfile::tempdir().unwrap();
    let cells = 100;
    let mut obj: String = (0..cells * cells).map(|i| format!("v {} {} 0\n", i % cells, i / cells)).collect();
    obj.extend((1..cells * (cells - 1)).map(|i| format!("f {i} {} {}\n", i + 1, i + cells)));
    std::fs::write(dir.path().join("m.obj"), &obj).unwrap();
    let fault = |text: String, memory: u64| {
        let mut options = LoadOptions::default();
        options.limits.memory = memory;
        let source = Source::new(dir.path().join("a.toml"), text.into());
        load_with(&source, &options).map(|loaded| loaded.scene.meshes.len()).map_err(|e| e.to_string())
    };
    // Each with a material of its own, or they would be read and stored once.
    let model = |i: usize| format!("[materials.m{i}]\n[[models]]\nfile='m.obj'\nmaterial='m{i}'\n");
    let models = |count: usize| (0..count).map(model).collect::<String>();
    // Reading a model takes most; what is kept is a fraction of that, but adds up.
    assert_eq!(fault(models(10), 8_000_000), Ok(10));
    let many = fault(models(100), 8_000_000).unwrap_err();
    assert!(many.contains("bytes are needed where") && many.ends_with("--max-memory"), "{many}");
    assert_eq!(fault(models(100), 80_000_000), Ok(100));
    let positions = format!("[[meshes]]\npositions=[{}]\nfaces=[]\n", "[1,2,3],".repeat(10_000));
    let text = fault(positions.clone(), 5_000_000).unwrap_err();
    assert!(text.ends_with("raise --max-memory"), "{text}");
    assert_eq!(fault(positions, 50_000_000), Ok(1));
}

#[test]
fn a_material_called_plain_is_not_that_of_shapes_without_one() {
    let text = "[materials.plain]\ndiffuse = [1, 0, 0]\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n\
                [[spheres]]\ncenter = [3, 0, 0]\nradius = 1\nmaterial = \"plain\"\n[[spheres]]\ncenter = [6, 0, 0]\nradius = 1\n";
    let scene = load_text(text).unwrap().scene;
    let color = |sphere: usize| scene.materials[scene.spheres[sphere].material as usize].base_color;
    assert_eq!(color(1), Vec3::X);
    assert_eq!([color(0), color(2)], [Material::plain().base_color; 2]);
}
