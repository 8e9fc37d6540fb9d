//! OBJ, MTL and pictures in a folder, through the whole loader.

use crate::load::{LoadOptions, Loaded, MtlMode, Source, load_source};
use crate::math::{Vec2, Vec3};
use crate::scene::{AlphaMode, Material, Pixels, Reflection, TextureRef, Wrap};
use std::fs;
use std::path::Path;

const OBJ: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";

fn png(path: &Path, texel: [u8; 4]) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    ::image::RgbaImage::from_pixel(2, 2, ::image::Rgba(texel)).save(path).unwrap();
}

/// Loads `obj` beside `m.mtl` and pictures of one colour.
fn load(obj: &str, mtl: &str, pictures: &[(&str, [u8; 4])], mode: MtlMode) -> Loaded {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("m.mtl"), mtl).unwrap();
    for (name, texel) in pictures {
        png(&dir.path().join(name), *texel);
    }
    let source = Source::new(dir.path().join("m.obj"), obj.as_bytes().to_vec());
    load_source(&source, &LoadOptions { mtl: mode, ..LoadOptions::default() }).unwrap()
}

fn guess(mtl: &str, pictures: &[(&str, [u8; 4])]) -> (Loaded, Material) {
    let loaded = load(OBJ, mtl, pictures, MtlMode::Guess);
    let material = loaded.scene.materials[loaded.scene.meshes[0].material as usize].clone();
    (loaded, material)
}

fn texel(loaded: &Loaded, map: Option<&TextureRef>) -> [u8; 4] {
    let texture = &loaded.scene.textures[map.unwrap().texture as usize];
    match &loaded.scene.bitmaps[texture.bitmap as usize].pixels {
        Pixels::Rgba8(texels) => texels[0],
        Pixels::Rgb8(bytes) => [bytes[0], bytes[1], bytes[2], 255],
        Pixels::Rgba16(_) => panic!(),
    }
}

fn codes(loaded: &Loaded) -> Vec<&str> {
    loaded.warnings.iter().map(|w| w.code).collect()
}

#[test]
fn maps_come_with_their_options_and_every_file_is_listed() {
    let mtl = "newmtl a\nKd 1 1 1\nmap_Kd -s 2 3 1 -o 0.25 0.5 -clamp on tex/wood map.png\n";
    let (loaded, m) = guess(mtl, &[("tex/wood map.png", [1, 2, 3, 255])]);
    let map = m.base_color_map.as_ref().unwrap();
    assert_eq!(map.transform.scale, Vec2::new(2.0, 3.0));
    assert_eq!(map.transform.offset, Vec2::new(0.25, 1.0 - 3.0 - 0.5));
    assert_eq!(loaded.scene.textures[map.texture as usize].sampler.wrap_u, Wrap::Clamp);
    assert_eq!(texel(&loaded, Some(map)), [1, 2, 3, 255]);
    assert_eq!((loaded.warnings.len(), loaded.facts.files.len()), (0, 3));
}

#[test]
fn a_missing_picture_is_a_warning_and_its_material_plain() {
    let (loaded, m) = guess("newmtl a\nKd 0 0 0\nmap_Kd maps\\none.png\n", &[]);
    assert!(m.base_color_map.is_none() && m.base_color.min_element() > 0.3);
    assert_eq!(codes(&loaded), ["file-missing", "mtl-black-under-map"]);
    assert!(loaded.warnings[0].to_string().contains("m.mtl:3: picture 'maps\\none.png' is not there"));
}

#[test]
fn a_missing_library_is_a_warning_and_its_materials_are_plain_with_their_names() {
    let obj = OBJ.replace("m.mtl", "none.mtl").replace("usemtl a", "usemtl red wall");
    let loaded = load(&obj, "", &[], MtlMode::Literal);
    assert_eq!(codes(&loaded), ["file-missing", "mtl-undefined-material"]);
    assert_eq!(loaded.scene.materials[0].name, "red wall");
    assert_eq!(loaded.scene.materials[0].base_color, Material::plain().base_color);
}

#[test]
fn a_material_that_is_defined_twice_is_the_first_and_told_where_they_differ() {
    let load = |mtl: &str| load(OBJ, mtl, &[], MtlMode::Guess);
    let loaded = load("newmtl a\nKd 1 0 0\nnewmtl b\n\nnewmtl a\nKd 0 1 0\nnewmtl b\nNs 3\n");
    assert_eq!(codes(&loaded), ["mtl-defined-twice"], "no face is made of b");
    let text = loaded.warnings[0].to_string();
    assert!(
        text.contains("m.mtl:5: material 'a' is defined again; line 1 of ") && text.contains("m.mtl counts"),
        "{text}"
    );
    assert_eq!(loaded.scene.materials[0].base_color, Vec3::X);
    let map = "newmtl a\nKd 1 0 0\nmap_Kd none.png\n";
    assert_eq!(codes(&load(&format!("{map}\n{map}"))), ["file-missing"], "both say the same");
}

#[test]
fn a_library_of_the_models_name_is_used_when_none_is_named() {
    let obj = OBJ.replace("mtllib m.mtl\n", "");
    let loaded = load(&obj, "newmtl a\nKd 1 0 0", &[], MtlMode::Guess);
    assert_eq!(codes(&loaded), ["mtl-beside-model"]);
    assert_eq!(loaded.scene.materials[0].base_color, Vec3::X);
    assert_eq!(codes(&load(&obj, "newmtl a\nKd 1 0 0", &[], MtlMode::Literal)), ["mtl-undefined-material"]);
}

#[test]
fn names_with_spaces_signs_and_comments_meet() {
    for (newmtl, usemtl) in
        [("red wall", "red wall"), ("C#1", "C#1"), ("a # x", "a"), ("a", "a # y"), ("#3", "#3"), ("", "")]
    {
        let obj = OBJ.replace("usemtl a", &format!("usemtl {usemtl}"));
        let loaded = load(&obj, &format!("newmtl {newmtl}\nKd 1 0 0"), &[], MtlMode::Guess);
        assert_eq!(loaded.scene.materials[0].base_color, Vec3::X, "{newmtl} {usemtl} {:?}", loaded.warnings);
    }
}

#[test]
fn the_first_definition_counts_and_unused_ones_cost_nothing() {
    let mtl = "newmtl a\nKd 1 0 0\nnewmtl a\nKd 0 1 0\nnewmtl b\nmap_Kd none.png";
    let loaded = load(OBJ, mtl, &[], MtlMode::Guess);
    assert_eq!((loaded.scene.materials.len(), codes(&loaded)), (1, vec!["mtl-defined-twice"]));
    assert_eq!(loaded.scene.materials[0].base_color, Vec3::X);
}

#[test]
fn map_d_makes_a_surface_see_through_by_brightness_channel_or_alpha() {
    let opacity = |options: &str, d: [u8; 4], kd: [u8; 4]| {
        let mtl = format!("newmtl a\nKd 1 1 1\nmap_Kd k.png\nmap_d {options} d.png");
        let (loaded, m) = guess(&mtl, &[("k.png", kd), ("d.png", d)]);
        assert_eq!(m.alpha_mode, AlphaMode::Blend);
        assert_eq!(texel(&loaded, m.base_color_map.as_ref())[3], 255, "the diffuse map's own alpha is not used twice");
        texel(&loaded, m.opacity_map.as_ref())[0]
    };
    assert_eq!(opacity("", [90, 90, 90, 255], [1, 2, 3, 77]), 90);
    assert_eq!(opacity("", [1, 2, 3, 60], [1, 2, 3, 255]), 60);
    assert_eq!(opacity("-imfchan g", [1, 2, 3, 60], [1, 2, 3, 255]), 2);

    let (loaded, m) = guess("newmtl a\nKd 1 1 1\nmap_Kd k.png\nmap_d k.png", &[("k.png", [1, 2, 3, 60])]);
    assert_eq!((m.alpha_mode, m.opacity_map), (AlphaMode::Blend, None));
    assert_eq!(texel(&loaded, m.base_color_map.as_ref())[3], 60);
    let (loaded, m) = guess("newmtl a\nKd 1 1 1\nmap_Tr t.png", &[("t.png", [200; 4])]);
    assert_eq!(texel(&loaded, m.opacity_map.as_ref())[0], 55);
}

#[test]
fn the_alpha_of_a_diffuse_map_is_used_only_by_guess_and_never_where_it_is_0_everywhere() {
    let mtl = "newmtl a\nKd 1 1 1\nmap_Kd k.png";
    let (loaded, m) = guess(mtl, &[("k.png", [1, 2, 3, 60])]);
    assert_eq!((m.alpha_mode, codes(&loaded)), (AlphaMode::Blend, vec!["mtl-diffuse-alpha"]));
    assert_eq!(guess(mtl, &[("k.png", [1, 2, 3, 0])]).1.alpha_mode, AlphaMode::Opaque);
    let literal = load(OBJ, mtl, &[("k.png", [1, 2, 3, 60])], MtlMode::Literal);
    assert_eq!(literal.scene.materials[0].alpha_mode, AlphaMode::Opaque);
}

#[test]
fn a_normal_map_written_as_bump_map_is_known_by_its_texels() {
    let mtl = "newmtl a\nKd 1 1 1\nbump -bm 0.5 b.png";
    let (loaded, m) = guess(mtl, &[("b.png", [128, 128, 255, 255])]);
    assert!(m.bump_map.is_none() && m.normal_map.is_some());
    assert_eq!((m.normal_scale, codes(&loaded)), (0.5, vec!["mtl-normal-as-bump"]));
    let (loaded, m) = guess(mtl, &[("b.png", [128; 4])]);
    assert!(m.bump_map.is_some() && m.normal_map.is_none());
    assert_eq!((m.bump_scale, codes(&loaded)), (0.5 / 64.0, vec!["mtl-bump-height"]));
    let literal = load(OBJ, mtl, &[("b.png", [128, 128, 255, 255])], MtlMode::Literal);
    assert_eq!(literal.scene.materials[0].bump_scale, 0.5);
}

#[test]
fn a_displacement_is_drawn_as_bump_unless_there_is_one_and_it_is_said() {
    let (loaded, m) = guess("newmtl a\nKd 1 1 1\ndisp -bm 2 b.png", &[("b.png", [128, 128, 255, 255])]);
    assert!(m.bump_map.is_some() && m.normal_map.is_none(), "heights are never normals");
    assert_eq!((m.bump_scale, codes(&loaded)), (2.0 / 64.0, vec!["mtl-displacement-as-bump", "mtl-bump-height"]));
    let (loaded, _) = guess("newmtl a\nKd 1 1 1\nbump b.png\nmap_disp d.png", &[("b.png", [9; 4]), ("d.png", [9; 4])]);
    assert_eq!(codes(&loaded), ["mtl-bump-height"]);
}

#[test]
fn roughness_and_metal_maps_share_one_texture() {
    let mtl = "newmtl a\nKd 1 1 1\nPr 0\nPm 1\nmap_Pr r.png\nmap_Pm m.png\nnorm n.png";
    let (loaded, m) = guess(mtl, &[("r.png", [50; 4]), ("m.png", [70; 4]), ("n.png", [128, 128, 255, 255])]);
    let Reflection::MetalRough(s) = &m.reflection else { panic!() };
    assert_eq!((s.roughness, s.metallic), (1.0, 1.0));
    assert_eq!(texel(&loaded, s.metal_rough_map.as_ref())[1..3], [50, 70]);
    assert!(m.normal_map.is_some());
    let mesh = &loaded.scene.meshes[0];
    assert_eq!(mesh.tangents.len(), mesh.positions.len(), "a normal map needs tangents");
}

#[test]
fn maps_of_sheen_coat_and_grain_are_drawn_and_zeros_under_them_count_as_1() {
    let maps = "map_Ps s.png\nmap_Pc -imfchan g c.png\nmap_Pcr c.png\nmap_aniso a.png\nmap_anisor t.png\n";
    let mtl = format!("newmtl a\nKd 1 1 1\nPr 0.5\nPs 0\nPc 0.5\naniso 0\nanisor 0\n{maps}");
    let files = [("s.png", [90; 4]), ("c.png", [20, 60, 20, 255]), ("a.png", [51; 4]), ("t.png", [255; 4])];
    let (loaded, m) = guess(&mtl, &files);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    let Reflection::MetalRough(s) = &m.reflection else { panic!("physically based") };
    let (sheen, coat, anisotropy) =
        (s.sheen.as_ref().unwrap(), s.coat.as_ref().unwrap(), s.anisotropy.as_ref().unwrap());
    assert_eq!((sheen.color, coat.strength, coat.roughness), (Vec3::ONE, 0.5, 1.0));
    assert_eq!((anisotropy.strength, anisotropy.rotation), (1.0, 0.0));
    assert_eq!(texel(&loaded, coat.strength_map.as_ref())[0], 60);
    assert_eq!(texel(&loaded, coat.roughness_map.as_ref())[1], 49, "brightness");
    assert!(sheen.color_map.is_some() && anisotropy.map.is_some());

    let (_, plain) = guess("newmtl a\nKd 1 1 1\nPc 1\naniso 0.5\nmap_Pc 0\nmap_aniso none.png", &[]);
    let Reflection::MetalRough(s) = &plain.reflection else { panic!("physically based") };
    assert!(s.coat.as_ref().unwrap().strength_map.is_none() && s.anisotropy.as_ref().unwrap().map.is_none());
    assert_eq!(s.anisotropy.as_ref().unwrap().strength, 0.5, "a map that is not there changes nothing");
}

#[test]
fn a_packed_map_with_roughness_first_is_drawn() {
    let (loaded, m) = guess("newmtl a\nKd 1 1 1\nmap_RMA p.png", &[("p.png", [10, 20, 30, 255])]);
    let Reflection::MetalRough(s) = &m.reflection else { panic!("physically based") };
    assert_eq!((s.roughness, s.metallic, loaded.warnings.len()), (1.0, 1.0, 0));
    assert_eq!(texel(&loaded, s.metal_rough_map.as_ref())[1..3], [10, 20]);
    assert_eq!(texel(&loaded, m.occlusion_map.as_ref())[0], 30);
}

#[test]
fn everything_invisible_is_opaque_but_a_single_hidden_part_stays_hidden() {
    let both = "newmtl a\nKd 1 1 1\nd 0\nnewmtl b\nKd 1 1 1\nd 0";
    let (loaded, m) = guess(both, &[]);
    assert_eq!((m.opacity, codes(&loaded)), (1.0, vec!["mtl-invisible"]));
    let two = format!("{OBJ}usemtl b\nf 1 2 3");
    let loaded = load(&two, "newmtl a\nKd 1\nd 0\nnewmtl b\nKd 1\n", &[], MtlMode::Guess);
    assert_eq!(loaded.scene.materials.iter().map(|m| m.opacity).collect::<Vec<_>>(), [0.0, 1.0]);
}

#[test]
fn files_outside_the_models_folder_are_refused_with_the_root_that_would_do() {
    let (loaded, _) = guess("newmtl a\nKd 1 1 1\nmap_Kd /etc/hostname", &[]);
    assert_eq!(codes(&loaded), ["file-outside-root"]);
    assert!(loaded.warnings[0].remedy.contains("--root"));
}

#[test]
fn pictures_that_are_made_take_from_the_memory_that_may_be_taken() {
    let dir = tempfile::tempdir().unwrap();
    ::image::GrayImage::new(3000, 1).save(dir.path().join("row.png")).unwrap();
    ::image::GrayImage::new(1, 3000).save(dir.path().join("column.png")).unwrap();
    fs::write(dir.path().join("m.mtl"), "newmtl a\nKd 1 1 1\nmap_Pr row.png\nmap_Pm column.png\n").unwrap();
    let source = Source::new(dir.path().join("m.obj"), OBJ.as_bytes().to_vec());
    let mut options = LoadOptions::default();
    options.limits.memory = 10_000_000;
    let loaded = load_source(&source, &options).unwrap();
    assert_eq!(codes(&loaded), ["image-unusable"]);
    let told = loaded.warnings[0].to_string();
    let expected = "m.mtl:3: image 'row.png + column.png' cannot be used: 60000000 bytes are needed where";
    assert!(told.contains(expected) && told.ends_with("drawn without it; raise --max-memory"), "{told}");
    let Reflection::MetalRough(m) = &loaded.scene.materials[0].reflection else { panic!("not metal") };
    assert!(m.metal_rough_map.is_none() && loaded.scene.bitmaps.is_empty());
}

#[test]
fn an_ambient_map_is_the_diffuse_one_where_there_is_no_other() {
    let (loaded, m) = guess("newmtl a\nmap_Ka a.png\n", &[("a.png", [1, 2, 3, 255])]);
    assert_eq!(texel(&loaded, m.base_color_map.as_ref()), [1, 2, 3, 255]);
    assert_eq!(codes(&loaded), ["mtl-ambient-map"]);
    let both = "newmtl a\nKd 1 1 1\nmap_Ka a.png\nmap_Kd b.png\n";
    let (loaded, m) = guess(both, &[("a.png", [1, 2, 3, 255]), ("b.png", [4, 5, 6, 255])]);
    assert_eq!(texel(&loaded, m.base_color_map.as_ref()), [4, 5, 6, 255]);
    assert_eq!(codes(&loaded), ["mtl-ambient"]);
    let (loaded, _) = guess(&both.replace("a.png", "b.png"), &[("b.png", [4, 5, 6, 255])]);
    assert!(loaded.warnings.is_empty());
}

#[test]
fn a_name_may_have_quotes_and_a_remark_behind_it() {
    let text = "newmtl a\nKd 1 1 1\nmap_Kd \"tex a.png\" # bricks\n";
    let (loaded, m) = guess(text, &[("tex a.png", [1, 2, 3, 255])]);
    assert_eq!(texel(&loaded, m.base_color_map.as_ref()), [1, 2, 3, 255], "{:?}", loaded.warnings);
}

#[test]
fn maps_may_be_tga_and_bmp_pictures() {
    for name in ["wood.tga", "wood.bmp", "Wood.TGA"] {
        let (loaded, m) = guess(&format!("newmtl a\nKd 1 1 1\nmap_Kd {name}\n"), &[(name, [1, 2, 3, 255])]);
        assert_eq!(texel(&loaded, m.base_color_map.as_ref()), [1, 2, 3, 255], "{:?}", loaded.warnings);
        assert!(loaded.warnings.is_empty());
    }
}

#[cfg(unix)]
#[test]
fn a_picture_of_many_names_is_read_and_charged_once() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("sub")).unwrap();
    png(&dir.path().join("a.png"), [1, 2, 3, 255]);
    let names = (0..60).map(|i| format!("newmtl m{i}\nKd 1 1 1\nmap_Kd {}a.png\n", "sub/../".repeat(i)));
    fs::write(dir.path().join("m.mtl"), names.collect::<String>()).unwrap();
    // Padding after the picture that decoders ignore.
    let mut bytes = fs::read(dir.path().join("a.png")).unwrap();
    bytes.resize(1_000_000, 0);
    fs::write(dir.path().join("a.png"), bytes).unwrap();
    let uses: String = (0..60).map(|i| format!("usemtl m{i}\nf 1/1 2/2 3/3\n")).collect();
    let obj = format!("{}{uses}", OBJ.replace("usemtl a\nf 1/1 2/2 3/3\n", ""));
    let source = Source::new(dir.path().join("m.obj"), obj.into());
    let mut options = LoadOptions::default();
    options.limits.memory = 1_800_000;
    let loaded = load_source(&source, &options).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    assert_eq!((loaded.scene.meshes.len(), loaded.scene.bitmaps.len()), (60, 1));
    options.limits.memory = 900_000;
    let told = load_source(&source, &options).unwrap().warnings;
    assert_eq!((told.len(), told[0].code), (1, "image-unusable"));
}

#[test]
fn a_comment_behind_the_name_of_a_picture_is_none_of_it_unless_there_is_such_a_file() {
    let color = |line: &str, pictures: &[(&str, [u8; 4])]| {
        let (loaded, m) = guess(&format!("newmtl a\nKd 1 1 1\n{line}\n"), pictures);
        m.base_color_map.is_some().then(|| texel(&loaded, m.base_color_map.as_ref())[0])
    };
    let (red, odd) = (("red.png", [1, 0, 0, 255]), ("red.png # 2.png", [2, 0, 0, 255]));
    for line in ["map_Kd red.png # the paint", "map_Kd -s 2 2 1 red.png #paint", "map_Kd red.png # -bm 2"] {
        assert_eq!(color(line, &[red]), Some(1), "{line}");
    }
    assert_eq!(color("map_Kd red.png # 2.png", &[red, odd]), Some(2));
    assert_eq!((color("map_Kd none.png # red.png", &[red]), color("map_Kd # red.png", &[red])), (None, None));
}

#[test]
fn numbers_that_are_read_otherwise_than_written_are_told() {
    for line in ["Kd 1 0 zz", "Kd 0.8 nan 0.2", "Kd 0.8 0.2", "Kd 0.8x 0.1 0.2", "Ns 10x", "d 0.5x"] {
        let (loaded, _) = guess(&format!("newmtl a\nKd 1 1 1\n{line}\n"), &[]);
        assert!(codes(&loaded).contains(&"mtl-bad-number"), "{line}: {:?}", loaded.warnings);
    }
    for line in ["Kd 0.8", "Kd 0.8 0.1 0.2", "Ns 10", "d 1"] {
        let (loaded, _) = guess(&format!("newmtl a\nKd 1 1 1\n{line}\n"), &[]);
        assert!(!codes(&loaded).contains(&"mtl-bad-number"), "{line}: {:?}", loaded.warnings);
    }
}

#[test]
fn glass_of_a_physically_based_material_has_the_colour_of_its_filter() {
    let glass =
        |filter: &str| guess(&format!("newmtl a\nKd 0.8 0.8 0.8\nillum 6\nNi 1.5\nTf {filter}\nPr 0\nPm 0\n"), &[]).1;
    let (red, clear) = (glass("1 0.25 0.25"), glass("1 1 1"));
    assert_eq!(red.base_color, clear.base_color * Vec3::new(1.0, 0.25, 0.25));
    assert!(red.metal_rough().is_some_and(|m| m.transmission == 1.0));
}

#[test]
fn a_light_grey_picture_is_a_height_and_no_normal_map() {
    let of = |texel: [u8; 4]| guess("newmtl a\nKd 1 1 1\nmap_Bump b.png\n", &[("b.png", texel)]).1;
    for grey in [195, 200, 205] {
        assert!(of([grey, grey, grey, 255]).normal_map.is_none(), "{grey}");
    }
    assert!(of([128, 128, 255, 255]).normal_map.is_some());
}
