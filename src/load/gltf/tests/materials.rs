//! Materials, their extensions and their images.

use super::*;
use crate::scene::TextureRef;

#[test]
fn materials_carry_every_factor_and_slot() {
    let mut file = Builder::new();
    let positions = file.triangle();
    let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs, "TEXCOORD_1": uvs}, "material": 0}));
    file.set("images", json!([{"uri": picture()}]));
    file.set("samplers", json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728, "minFilter": 9985}]));
    file.set("textures", json!([{"source": 0, "sampler": 0}, {"source": 0}]));
    let names = [
        "ior",
        "specular",
        "transmission",
        "emissive_strength",
        "dispersion",
        "volume",
        "clearcoat",
        "iridescence",
        "sheen",
        "anisotropy",
        "diffuse_transmission",
    ];
    let used: Vec<String> =
        names.iter().map(|n| format!("KHR_materials_{n}")).chain(["KHR_texture_transform".into()]).collect();
    file.set("extensionsUsed", json!(used));
    let moved =
        json!({"KHR_texture_transform": {"offset": [0.5, 0.25], "rotation": 1.5, "scale": [2, 3], "texCoord": 1}});
    file.set("materials", json!([{
        "name": "glass", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25,
        "emissiveFactor": [1, 0.5, 0],
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.25,
            "baseColorTexture": {"index": 0, "extensions": moved},
            "metallicRoughnessTexture": {"index": 1, "texCoord": 1}},
        "occlusionTexture": {"index": 1, "strength": 0.5},
        "emissiveTexture": {"index": 1},
        "extensions": {
            "KHR_materials_ior": {"ior": 1.33}, "KHR_materials_emissive_strength": {"emissiveStrength": 8},
            "KHR_materials_specular": {"specularFactor": 0.75, "specularColorFactor": [2, 1, 1], "specularTexture": {"index": 1}},
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": {"index": 1}},
            "KHR_materials_volume": {
                "thicknessFactor": 1, "thicknessTexture": {"index": 1},
                "attenuationDistance": 0.5, "attenuationColor": [1, 0.25, 0]},
            "KHR_materials_iridescence": {
                "iridescenceFactor": 0.75, "iridescenceIor": 1.25, "iridescenceThicknessMaximum": 500,
                "iridescenceThicknessTexture": {"index": 1}},
            "KHR_materials_anisotropy": {
                "anisotropyStrength": 0.5, "anisotropyRotation": -2, "anisotropyTexture": {"index": 1}},
            "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.25, 0], "sheenRoughnessTexture": {"index": 1}},
            "KHR_materials_clearcoat": {
                "clearcoatFactor": 0.5, "clearcoatRoughnessFactor": 0.125, "clearcoatRoughnessTexture": {"index": 1},
                "clearcoatNormalTexture": {"index": 0, "scale": 0.25}},
            "KHR_materials_diffuse_transmission": {
                "diffuseTransmissionFactor": 0.25, "diffuseTransmissionTexture": {"index": 1},
                "diffuseTransmissionColorFactor": [1, 0.5, 0]},
            "KHR_materials_dispersion": {"dispersion": 0.5}},
    }]));
    let loaded = file.load();
    let scene = &loaded.scene;
    let material = &scene.materials[0];
    assert_eq!((material.base_color, material.opacity), (Vec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!((material.alpha_mode, material.double_sided), (AlphaMode::Mask { cutoff: 0.25 }, true));
    assert_eq!(material.emission, Vec3::new(8.0, 4.0, 0.0));
    assert_eq!(material.occlusion_strength, 0.5);
    let Reflection::MetalRough(surface) = &material.reflection else { panic!() };
    assert_eq!((surface.metallic, surface.roughness, surface.ior), (0.5, 0.25, 1.33));
    assert_eq!((surface.specular, surface.specular_color), (0.75, Vec3::new(2.0, 1.0, 1.0)));
    assert_eq!((surface.transmission, surface.thick, surface.dispersion), (0.9, true, 0.5));
    assert!(surface.specular_map.is_some() && surface.transmission_map.is_some());
    assert_eq!(surface.absorption.x, 0.0);
    assert!((surface.absorption.y - 2.0 * 4f32.ln()).abs() < 1e-5 && surface.absorption.z > 100.0);
    assert!(surface.thickness == 1.0 && surface.thickness_map.is_some(), "for what is seen through rough glass");
    let coat = surface.coat.as_ref().unwrap();
    assert_eq!((coat.strength, coat.roughness, coat.normal_scale), (0.5, 0.125, 0.25));
    assert!(coat.strength_map.is_none() && coat.roughness_map.is_some() && coat.normal_map.is_some());
    let iridescence = surface.iridescence.as_ref().unwrap();
    assert_eq!((iridescence.strength, iridescence.ior, iridescence.thickness), (0.75, 1.25, [100.0, 500.0]));
    assert!(iridescence.strength_map.is_none() && iridescence.thickness_map.is_some());
    let anisotropy = surface.anisotropy.as_ref().unwrap();
    assert_eq!((anisotropy.strength, anisotropy.rotation, anisotropy.map.is_some()), (0.5, -2.0, true));
    let sheen = surface.sheen.as_ref().unwrap();
    assert_eq!((sheen.color, sheen.roughness), (Vec3::new(0.5, 0.25, 0.0), 0.0));
    assert!(sheen.color_map.is_none() && sheen.roughness_map.is_some());
    let through = surface.diffuse_transmission.as_ref().unwrap();
    assert_eq!((through.share, through.color), (0.25, Vec3::new(1.0, 0.5, 0.0)));
    assert!(through.share_map.is_some() && through.color_map.is_none());
    let base = material.base_color_map.as_ref().unwrap();
    assert_eq!(
        (base.uv_set, base.transform.offset, base.transform.scale),
        (1, Vec2::new(0.5, 0.25), Vec2::new(2.0, 3.0))
    );
    assert_eq!(base.transform.rotation, 1.5);
    let sampler = scene.textures[base.texture as usize].sampler;
    assert_eq!((sampler.wrap_u, sampler.wrap_v), (Wrap::Clamp, Wrap::Mirror));
    assert_eq!((sampler.magnify, sampler.minify, sampler.mipmaps), (Filter::Nearest, Filter::Linear, Mipmaps::Nearest));
    assert_eq!((scene.textures.len(), scene.bitmaps.len()), (2, 1), "one picture, read in two ways");
    assert_eq!(scene.meshes[0].uvs.len(), 2);
}

#[test]
fn unlit_and_specular_glossiness_materials_keep_their_look() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.set("meshes", json!([{"primitives": [
        {"attributes": {"POSITION": positions}, "material": 0}, {"attributes": {"POSITION": positions}, "material": 1}]}]));
    file.set("extensionsUsed", json!(["KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness"]));
    file.set(
        "materials",
        json!([
            {"extensions": {"KHR_materials_unlit": {}}, "emissiveFactor": [1, 1, 1]},
            {"extensions": {"KHR_materials_pbrSpecularGlossiness": {
                "diffuseFactor": [0.5, 0.5, 0.5, 1], "specularFactor": [0.2, 0.1, 0], "glossinessFactor": 0.75}}},
        ]),
    );
    let scene = file.load().scene;
    assert!(matches!(scene.materials[0].reflection, Reflection::Unlit));
    assert_eq!(scene.materials[0].emission, Vec3::ZERO);
    let Reflection::MetalRough(surface) = &scene.materials[1].reflection else { panic!() };
    assert_eq!((surface.metallic, surface.roughness, surface.ior), (0.0, 0.25, 0.0));
    assert_eq!(surface.specular_color, Vec3::new(0.2, 0.1, 0.0));
    assert_eq!(scene.materials[1].base_color, Vec3::splat(0.5));
}

/// A triangle whose material has both descriptions, with missing pictures.
fn both_descriptions(specular_glossiness: Value) -> Loaded {
    let mut file = Builder::new();
    let (positions, uvs) = (file.triangle(), file.floats("VEC2", &[0.; 6]));
    file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
    file.set("extensionsUsed", json!(["KHR_materials_pbrSpecularGlossiness"]));
    file.set("images", json!([{"uri": "none.png"}, {"uri": "gloss.png"}]));
    file.set("textures", json!([{"source": 0}, {"source": 1}]));
    file.set(
        "materials",
        json!([{
            "pbrMetallicRoughness": {
                "baseColorFactor": [0, 0, 1, 1], "baseColorTexture": {"index": 0}, "metallicFactor": 0},
            "extensions": {"KHR_materials_pbrSpecularGlossiness": specular_glossiness},
        }]),
    );
    file.load()
}

#[test]
fn specular_glossiness_goes_before_its_fallback_of_which_nothing_is_read() {
    let loaded = both_descriptions(json!({"diffuseFactor": [1, 0, 0, 0.5], "glossinessFactor": 0.75}));
    let material = &loaded.scene.materials[0];
    assert_eq!((material.base_color, material.opacity), (Vec3::X, 0.5));
    let surface = material.metal_rough().unwrap();
    assert_eq!((surface.roughness, surface.ior), (0.25, 0.0));
    assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn gloss_in_a_map_becomes_roughness_in_one() {
    let mut file = Builder::new();
    let (positions, uvs) = (file.triangle(), file.floats("VEC2", &[0.; 6]));
    let primitive = |material| json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": material});
    file.set("meshes", json!([{"primitives": [primitive(0), primitive(1), primitive(2)]}]));
    file.set("extensionsUsed", json!(["KHR_materials_pbrSpecularGlossiness"]));
    let texels = image::RgbaImage::from_raw(2, 1, vec![255, 0, 0, 255, 0, 0, 255, 51]).unwrap();
    file.set("images", json!([{"uri": encoded(&texels.into())}, {"uri": "none.png"}]));
    file.set("textures", json!([{"source": 0}, {"source": 1}]));
    let material = |extension: Value| {
        json!({
            "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 1], "metallicRoughnessTexture": {"index": 1}},
            "extensions": {"KHR_materials_pbrSpecularGlossiness": extension}})
    };
    let (map, lost) = (json!({"index": 0}), json!({"index": 1}));
    file.set(
        "materials",
        json!([
            material(json!({"specularGlossinessTexture": map})),
            material(json!({"specularGlossinessTexture": map, "glossinessFactor": 0.5, "specularFactor": [1, 0.5, 0]})),
            material(json!({"specularGlossinessTexture": lost})),
        ]),
    );
    let loaded = file.load();
    assert_eq!(codes(&loaded), ["file-missing"]);
    let scene = &loaded.scene;
    let bitmap = |map: &Option<TextureRef>| {
        let texture = &scene.textures[map.as_ref().unwrap().texture as usize];
        match &scene.bitmaps[texture.bitmap as usize].pixels {
            Pixels::Rgba8(texels) => texels.to_vec(),
            other => panic!("{other:?}"),
        }
    };
    let greens = |map: &Option<TextureRef>| bitmap(map).iter().map(|texel| texel[1]).collect::<Vec<_>>();
    let surface = |i: usize| scene.materials[i].metal_rough().unwrap();
    for (i, color, greens_there) in [(0, Vec3::ONE, [0, 204]), (1, Vec3::new(1.0, 0.5, 0.0), [128, 230])] {
        let m = surface(i);
        assert_eq!((m.roughness, m.metallic, m.specular_color), (1.0, 0.0, color), "{i}");
        assert_eq!(bitmap(&m.specular_color_map), [[255, 0, 0, 255], [0, 0, 255, 51]], "{i}");
        assert_eq!(greens(&m.metal_rough_map), greens_there, "{i}");
    }
    assert_eq!(scene.bitmaps.len(), 3, "colours once, roughness for each factor");
    assert!(surface(2).metal_rough_map.is_none() && surface(2).specular_color_map.is_none());
    assert_eq!(surface(2).roughness, 0.0, "as glossy as its factor says where the map is lost");
    assert!((0..3).all(|i| scene.materials[i].base_color == Vec3::ONE), "the fallback counts for nothing");
}

#[test]
fn a_missing_or_broken_image_costs_its_map_and_a_warning() {
    for uri in ["none.png", "data:image/png;base64,AAAA"] {
        let mut file = Builder::new();
        let positions = file.triangle();
        file.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
        file.set("images", json!([{"uri": uri}]));
        file.set("textures", json!([{"source": 0}]));
        file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
        let loaded = file.load();
        assert!(loaded.scene.materials[0].base_color_map.is_none());
        assert!(loaded.scene.textures.is_empty());
        assert!(codes(&loaded).iter().any(|c| ["file-missing", "image-unusable"].contains(c)), "{:?}", codes(&loaded));
    }
}

#[test]
fn a_texture_without_an_image_is_told() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
    file.set("textures", json!([{}]));
    file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
    let loaded = file.load();
    let told: Vec<String> = loaded.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.iter().filter(|t| t.contains("textures[0]: the texture names no image")).count(), 1, "{told:?}");
}

// On systems where file names are case-sensitive.
#[cfg(target_os = "linux")]
#[test]
fn images_and_buffers_named_in_another_case_are_read_and_told() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("tex")).unwrap();
    ::image::RgbImage::new(1, 1).save(dir.path().join("tex/a.png")).unwrap();
    let mut file = Builder::new();
    let (positions, uvs) = (file.triangle(), file.floats("VEC2", &[0.; 6]));
    let bytes = std::mem::take(&mut file.bytes);
    std::fs::write(dir.path().join("Data.bin"), &bytes).unwrap();
    file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
    file.set("buffers", json!([{"uri": "data.BIN", "byteLength": bytes.len()}]));
    file.set("images", json!([{"uri": "TEX/a.PNG"}]));
    file.set("textures", json!([{"source": 0}]));
    file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
    let loaded = load_bytes(&dir.path().join("a.gltf"), file.gltf(), &LoadOptions::default()).unwrap();
    assert_eq!((loaded.facts.faces, loaded.scene.bitmaps.len(), loaded.facts.files.len()), (1, 1, 3));
    let notes = loaded.warnings.iter().filter(|w| w.code == "file-elsewhere");
    let told: Vec<_> = notes.map(|w| (w.place.as_str(), w.text.as_str())).collect();
    let expected = [
        ("buffers[0].uri", "'data.BIN' is taken from 'Data.bin'"),
        ("images[0].uri", "'TEX/a.PNG' is taken from 'tex/a.png'"),
    ];
    assert_eq!(told, expected);
}

#[test]
fn images_of_materials_that_are_not_drawn_are_not_decoded() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": 1}));
    file.set("images", json!([{"uri": "none.png"}]));
    file.set("textures", json!([{"source": 0}]));
    file.set("materials", json!([{"emissiveTexture": {"index": 0}}, {"name": "used"}]));
    let loaded = file.load();
    assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
    assert_eq!(loaded.scene.materials.len(), 1);
    assert_eq!(loaded.scene.materials[0].name, "used");
}

#[test]
fn what_has_a_direction_brings_tangents_and_the_rest_does_not() {
    for (slot, expected) in [("normalTexture", 3), ("anisotropy", 3), ("emissiveTexture", 0)] {
        let mut file = Builder::new();
        let positions = file.triangle();
        let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
        file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
        file.set("images", json!([{"uri": picture()}]));
        file.set("textures", json!([{"source": 0}]));
        let mut material = json!({});
        match slot {
            "anisotropy" => {
                file.set("extensionsUsed", json!(["KHR_materials_anisotropy"]));
                material["extensions"] = json!({"KHR_materials_anisotropy": {"anisotropyStrength": 1}});
            }
            _ => material[slot] = json!({"index": 0}),
        }
        file.set("materials", json!([material]));
        assert_eq!(file.load().scene.meshes[0].tangents.len(), expected, "{slot}");
    }
}

/// A texture of 4×4 pixels as UASTC: one block of mode 8, a solid colour.
#[cfg(feature = "basisu")]
fn ktx2([r, g, b]: [u8; 3]) -> String {
    let bits = 0b10111 | u128::from(r) << 5 | u128::from(g) << 13 | u128::from(b) << 21 | 255 << 29;
    let bytes = crate::load::ktx::tests::file(0, (4, 4), 0, 166, &bits.to_le_bytes());
    format!("data:image/ktx2;base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

#[cfg(feature = "basisu")]
#[test]
fn a_ktx2_texture_is_drawn_where_there_is_no_plain_one() {
    let texture = |plain: bool| {
        let mut file = Builder::new();
        let positions = file.triangle();
        let uvs = file.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
        file.primitive(json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0}));
        file.set("images", json!([{"uri": ktx2([9, 90, 200]), "mimeType": "image/ktx2"}, {"uri": picture()}]));
        let mut texture = json!({"extensions": {"KHR_texture_basisu": {"source": 0}}});
        if plain {
            texture["source"] = json!(1);
        } else {
            file.set("extensionsRequired", json!(["KHR_texture_basisu"]));
        }
        file.set("textures", json!([texture]));
        file.set("extensionsUsed", json!(["KHR_texture_basisu"]));
        file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
        let loaded = file.load();
        assert!(codes(&loaded).is_empty(), "{:?}", loaded.warnings);
        assert!(loaded.scene.materials[0].base_color_map.is_some());
        loaded.scene.bitmaps[0].clone()
    };
    let compressed = texture(false);
    assert_eq!((compressed.width, compressed.height), (4, 4));
    assert!(matches!(&compressed.pixels, Pixels::Rgb8(p) if p[..3] == [9, 90, 200]));
    assert_eq!(texture(true).width, 1, "the plain one has lost less");
}

#[test]
fn ktx2_without_its_extension_is_told() {
    let mut file = Builder::new();
    let positions = file.triangle();
    file.primitive(json!({"attributes": {"POSITION": positions}, "material": 0}));
    let start = base64::engine::general_purpose::STANDARD.encode(b"\xabKTX 20\xbb\r\n\x1a\n");
    file.set("images", json!([{"uri": format!("data:image/ktx2;base64,{start}")}]));
    file.set("textures", json!([{"source": 0}]));
    file.set("materials", json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]));
    let loaded = file.load();
    let told = codes(&loaded);
    for code in ["gltf-image-non-enabled-mime-type", "gltf-texture-invalid-image-mime-type", "image-unusable"] {
        assert!(told.contains(&code), "{code}: {told:?}");
    }
}
