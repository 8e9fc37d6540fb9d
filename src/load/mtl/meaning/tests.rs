//! One material at a time, without files.

use super::*;
use crate::load::Limits;
use crate::load::limits::Budget;
use crate::load::mtl::parse::parse;

fn of(text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<&'static str>) {
    let (material, warnings) = read(text, mode, maps);
    (material, warnings.iter().map(|w| w.code).collect())
}

fn read(text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<Diagnostic>) {
    read_of("", text, mode, maps)
}

fn read_of(comment: &str, text: &str, mode: MtlMode, maps: &[Slot]) -> (Material, Vec<Diagnostic>) {
    let mut warnings = Warnings::default();
    let (text, file) = (format!("newmtl m\n{text}"), Path::new("m.mtl"));
    let mut budget = Budget::new(&Limits::default());
    let mtl = parse(text.as_bytes(), file, &mut budget, &mut warnings).remove(0);
    let has_map = |slot| maps.contains(&slot);
    let mut meaning = Meaning {
        mtl: &mtl,
        mode,
        writer: Writer::of(comment.as_bytes()),
        file: Path::new("m.mtl"),
        warnings: &mut warnings,
        has_map: &has_map,
        all_invisible: false,
    };
    let material = meaning.material();
    (material, warnings.into_vec())
}

/// Reads a material of a file that begins with this comment.
fn guess_of(comment: &str, text: &str, maps: &[Slot]) -> (Material, Vec<&'static str>) {
    let (material, warnings) = read_of(comment, text, MtlMode::Guess, maps);
    (material, warnings.iter().map(|w| w.code).collect())
}

fn guess(text: &str) -> (Material, Vec<&'static str>) {
    of(text, MtlMode::Guess, &[])
}

fn literal(text: &str) -> Material {
    of(text, MtlMode::Literal, &[]).0
}

fn phong(material: &Material) -> &Phong {
    match &material.reflection {
        Reflection::Phong(phong) => phong,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_plain_diffuse_material_is_phong_seen_from_both_sides() {
    let (m, warnings) = guess("Kd 0.5 0.25 0\nillum 1\nKs 1 1 1\nNs 10");
    assert_eq!((m.base_color, m.opacity, m.alpha_mode), (Vec3::new(0.5, 0.25, 0.0), 1.0, AlphaMode::Opaque));
    assert!(m.double_sided && warnings.is_empty());
    let p = phong(&m);
    assert_eq!((p.ambient, p.specular, p.mirror, p.transmission), (m.base_color, Vec3::ZERO, Vec3::ZERO, Vec3::ZERO));
}

#[test]
fn ambient_is_guessed_from_the_diffuse_color_and_literal_is_ka() {
    let (m, warnings) = guess("Ka 1 1 1\nKd 0.5 0 0");
    assert_eq!((phong(&m).ambient, warnings), (Vec3::new(0.5, 0.0, 0.0), vec!["mtl-ambient"]));
    assert_eq!(phong(&literal("Ka 1 1 1\nKd 0.5 0 0")).ambient, Vec3::ONE);
}

#[test]
fn dissolve_blends_unless_illum_or_a_filter_makes_it_glass() {
    let (m, warnings) = guess("Kd 1 1 1\nd 0.25\nillum 2");
    assert_eq!((m.opacity, m.alpha_mode, warnings.len()), (0.25, AlphaMode::Blend, 0));
    assert_eq!(phong(&m).transmission, Vec3::ZERO);

    let (m, _) = guess("Kd 1 1 1\nd 0.25\nillum 6\nNi 1.52\nKs 0.1 0.1 0.1\nNs 9");
    assert_eq!((m.opacity, m.alpha_mode, m.base_color), (1.0, AlphaMode::Opaque, Vec3::splat(0.25)));
    let p = phong(&m);
    assert_eq!((p.transmission, p.mirror, p.ior, p.fresnel), (Vec3::splat(0.75 * 0.9), Vec3::splat(0.1), 1.52, false));

    let (m, _) = guess("Kd 0 0 0\nTf 1 0.5 0\nillum 2\nNi 1.5");
    assert_eq!(phong(&m).transmission, Vec3::new(1.0, 0.5, 0.0));
    assert_eq!(phong(&m).mirror, Vec3::ZERO);
    let (m, warnings) = guess("Kd 0 0 0\nTf 1 0.5 0\nillum 7\nd 0.5");
    assert_eq!((phong(&m).transmission, phong(&m).ior), (Vec3::new(0.5, 0.25, 0.0), 1.5));
    assert_eq!(warnings, ["mtl-no-ior"]);
}

#[test]
fn glass_lets_through_what_it_does_not_mirror() {
    for (text, passed) in [
        ("illum 6\nTf 1 0.5 0", Vec3::new(0.75, 0.25, 0.0)),
        ("illum 4\nd 0.5", Vec3::new(0.375, 0.25, 0.0)),
        ("illum 2\nTf 1 0.5 0", Vec3::new(1.0, 0.5, 0.0)),
        ("illum 7\nTf 1 0.5 0", Vec3::new(1.0, 0.5, 0.0)),
    ] {
        let text = format!("Kd 0 0 0\nKs 0.25 0.5 1\nNs 9\nNi 1.5\n{text}");
        assert_eq!(phong(&guess(&text).0).transmission, passed, "{text}");
        assert_eq!(phong(&literal(&text)).transmission, passed, "{text}");
    }
    let too_much = "Kd 0 0 0\nNs 9\nNi 1.5\nillum 6\nTf 1 1 1\nKs";
    assert_eq!(phong(&guess(&format!("{too_much} 2 0.5 1")).0).transmission, Vec3::new(0.0, 0.5, 0.0));
    let (m, warnings) = guess(&format!("{too_much} 1 1 1"));
    assert_eq!((phong(&m).transmission, phong(&m).ior), (Vec3::ZERO, 1.5));
    assert_eq!(warnings, ["mtl-opaque-glass"]);
}

#[test]
fn opaque_filters_of_careless_exporters_make_no_glass() {
    for text in ["Kd 1 1 1\nTf 1 1 1\nillum 2", "Kd 1 1 1\nTf 0 0 0\nillum 2", "Kd 1 1 1\nd 1\nTr 0\nillum 4"] {
        assert_eq!(phong(&guess(text).0).transmission, Vec3::ZERO, "{text}");
    }
    for text in ["Kd 1 1 1\nTf 0.588 0.588 0.588\nd 1\nillum 2", "Kd 1 1 1\nTf 0.5 0.5 0.5\nTr 0\nillum 2"] {
        assert_eq!(phong(&guess(text).0).transmission, Vec3::ZERO, "{text}");
        assert_eq!(phong(&literal(text)).transmission, Vec3::ZERO, "{text}");
    }
    assert_ne!(phong(&guess("Kd 1 1 1\nTf 0.5 0.5 0.5\nd 1\nillum 6").0).transmission, Vec3::ZERO);
    assert_eq!(guess("Kd 1 1 1\nKs 1\nNs 9\nillum 7").1, ["mtl-opaque-glass"]);
    assert_ne!(phong(&literal("Kd 1 1 1\nillum 7\nTf 0.5")).transmission, Vec3::ZERO);
}

#[test]
fn only_illum_and_specular_together_make_a_mirror() {
    let mirror = |illum: i32, ks: f64| {
        let (m, warnings) = guess(&format!("Kd 0 0 0\nKs {ks} {ks} {ks}\nNs 50\nillum {illum}"));
        (phong(&m).mirror, phong(&m).fresnel, warnings)
    };
    assert_eq!(mirror(2, 1.0), (Vec3::ZERO, false, vec![]));
    assert_eq!(mirror(3, 0.5), (Vec3::splat(0.5), false, vec![]));
    assert_eq!(mirror(5, 0.5), (Vec3::splat(0.5), true, vec![]));
    assert_eq!(mirror(8, 0.5), (Vec3::splat(0.5), false, vec![]));
    assert_eq!(mirror(3, 0.0), (Vec3::ZERO, false, vec!["mtl-black-mirror"]));
}

#[test]
fn tr_is_the_rest_of_d_and_d_wins() {
    assert_eq!(guess("Kd 1\nTr 0.25").0.opacity, 0.75);
    let (m, warnings) = guess("Kd 1\nd 0.75\nTr 0.5");
    assert_eq!((m.opacity, warnings), (0.75, vec!["mtl-tr-contradicts-d"]));
    let (m, warnings) = guess("Kd 1\nTr 1");
    assert_eq!((m.opacity, warnings), (1.0, vec!["mtl-tr-as-opacity"]));
    assert_eq!(literal("Kd 1\nTr 1").opacity, 0.0);
}

#[test]
fn parts_outside_of_0_to_1_are_told_and_the_nearest_counts() {
    let (m, warnings) = guess("Kd 1\nd -1");
    assert_eq!((m.opacity, warnings), (0.0, vec!["mtl-range"]));
    assert_eq!(guess("Kd 1\nd 0").1, ["mtl-unseen"]);
    let (m, warnings) = guess("Kd 1\nPm 5\nPr 0.5");
    assert_eq!((m.metal_rough().unwrap().metallic, warnings), (1.0, vec!["mtl-range"]));
    assert!(guess("Kd 1\nPm 1\nPr 0\nd 1").1.is_empty());
    // Colours are not clamped: light may be brighter than white.
    let (m, warnings) = guess("Kd 1.5 1 0\nKe 4 4 4");
    assert_eq!((m.base_color, warnings), (Vec3::new(1.5, 1.0, 0.0), vec!["mtl-range"]));
    assert_eq!(guess("Kd 2.5 2.5 2.5").0.base_color, Vec3::splat(2.5));
    assert_eq!(literal("Kd 255 128 0").base_color, Vec3::new(255.0, 128.0, 0.0));
    let (m, warnings) = guess("Kd 255 128 0");
    assert_eq!(warnings, ["mtl-color-bytes"]);
    assert!((m.base_color - Vec3::new(1.0, 0.2158605, 0.0)).abs().max_element() < 1e-5, "{}", m.base_color);
    let (m, warnings) = guess("Kd 1 -1 0.5\nKe 0 -2 0");
    assert_eq!((m.base_color, m.emission), (Vec3::new(1.0, 0.0, 0.5), Vec3::ZERO));
    assert_eq!(warnings, ["mtl-range"; 2]);
}

#[test]
fn black_under_a_map_is_white_and_under_a_lost_one_grey() {
    let (m, warnings) = of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]);
    assert_eq!((m.base_color, warnings), (Vec3::ONE, vec!["mtl-black-under-map"]));
    let (m, _) = of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Guess, &[]);
    assert_eq!(m.base_color, Vec3::splat(NO_DIFFUSE));
    assert_eq!(of("Kd 0 0 0\nmap_Kd a.png", MtlMode::Literal, &[Slot::Diffuse]).0.base_color, Vec3::ZERO);
    assert_eq!(of("Ke 0 0 0\nKd 1\nmap_Ke a.png", MtlMode::Guess, &[Slot::Emission]).0.emission, Vec3::ONE);
    assert_eq!(of("map_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]).0.base_color, Vec3::ONE);
    assert_eq!(guess("Ns 1").1, ["mtl-no-diffuse"]);
}

#[test]
fn what_programs_write_of_everything_makes_no_mirrors_and_no_glass() {
    // Maya, Cinema 4D, VTK.
    for (comment, text, told) in [
        ("", "illum 4\nKd .5 .5 .5\nKa 0 0 0\nTf 1 1 1\nNi 1\nKs .5 .5 .5\nNs 18", "mtl-opaque-glass"),
        ("", "illum 7\nKd .8 .8 .8\nKa 0 0 0\nKs 1 1 1\nNs 43", "mtl-opaque-glass"),
        ("# by the Visualization Toolkit", "Kd 1 0 0\nKs 1 1 1\nNs 9\nillum 3", "mtl-illum-of-writer"),
    ] {
        let (m, warnings) = guess_of(comment, text, &[]);
        assert!(warnings.contains(&told), "{text}: {warnings:?}");
        let p = phong(&m);
        assert_eq!((p.mirror, p.transmission), (Vec3::ZERO, Vec3::ZERO), "{text}");
        assert!(p.specular != Vec3::ZERO, "{text}");
    }
    assert_eq!(phong(&literal("Kd 1\nKs 1\nNs 9\nillum 7")).mirror, Vec3::ONE);

    let (m, warnings) = guess_of("# VTK, the Visualization Toolkit", "Kd 1 0 0\nTr 0.2", &[]);
    assert_eq!((m.opacity, warnings), (0.2, vec!["mtl-tr-as-opacity"]));
    assert_eq!(guess_of("# VTK, the Visualization Toolkit", "Kd 1 0 0\nTr 1", &[]).0.opacity, 1.0);
    // 3ds Max writes the opacity as `Tf`, too.
    let (m, warnings) = guess("Kd .26 .26 .26\nNi 1.5\nd 0.1\nTr 0.9\nTf 0.1 0.1 0.1\nillum 2");
    assert_eq!((m.opacity, m.alpha_mode, warnings), (0.1, AlphaMode::Blend, vec!["mtl-filter-is-opacity"]));
    assert_eq!(phong(&m).transmission, Vec3::ZERO);
}

#[test]
fn metals_of_blender_are_metals() {
    let text = "Ns 10\nKa 1 1 1\nKd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nNi 1.5\nd 1\nillum 3";
    let (m, warnings) = guess_of("# Blender 3.3.0 MTL File: 'a.blend'", text, &[]);
    let metal = m.metal_rough().unwrap();
    assert_eq!((metal.metallic, metal.roughness, warnings), (1.0, 0.9, vec!["mtl-illum-of-writer"]));
    assert!(matches!(guess_of("# another", text, &[]).0.reflection, Reflection::Phong(_)));
}

#[test]
fn what_blender_blends_is_no_glass_and_its_glass_is_what_has_a_filter() {
    let of = |text: &str| guess_of("# Blender 3.6.0 MTL File: 'a.blend'", text, &[]);
    let (m, warnings) = of("Ns 250\nKa 1 1 1\nKd 0.8 0.8 0.8\nKs 0.5 0.5 0.5\nNi 1.45\nd 0.3\nillum 9");
    assert_eq!((m.opacity, m.alpha_mode), (0.3, AlphaMode::Blend));
    assert_eq!(warnings, ["mtl-illum-of-writer", "mtl-ambient"]);
    assert_eq!((phong(&m).mirror, phong(&m).transmission), (Vec3::ZERO, Vec3::ZERO));
    // A metal of opacity 0.5.
    let (m, warnings) = of("Ns 10\nKa 1 1 1\nKd 0.8 0.6 0.2\nKs 0.5 0.5 0.5\nNi 1.5\nd 0.5\nillum 6");
    let metal = m.metal_rough().unwrap();
    assert_eq!((metal.metallic, metal.transmission, m.alpha_mode), (1.0, 0.0, AlphaMode::Blend));
    assert_eq!(warnings, ["mtl-illum-of-writer"]);

    let physical = "Ns 1000\nKd 0.9 1 0.9\nKs 0.5 0.5 0.5\nNi 1.45\nd 1\nillum 2\nPr 0.1\nPm 0";
    let passed = |m: &Material| m.metal_rough().map(|m| (m.transmission, m.thick)).unwrap();
    assert_eq!(passed(&of(physical).0), (0.0, false));
    let (m, _) = of(&format!("{physical}\nTf 1 1 1"));
    assert_eq!((passed(&m), m.base_color), ((1.0, true), Vec3::new(0.9, 1.0, 0.9)));
    assert_eq!(passed(&of(&format!("{physical}\nTf 0.5 0.5 0.5")).0), (0.5, true));
    // Other programs write a white filter for every material.
    assert_eq!(passed(&guess_of("# another", &format!("{physical}\nTf 1 1 1"), &[]).0), (0.0, false));
}

#[test]
fn maps_take_the_place_of_colors_where_they_did_in_the_program_that_wrote_them() {
    let of = |comment: &str, text: &str| guess_of(comment, text, &[Slot::Diffuse]);
    for comment in ["# 3ds Max Wavefront OBJ Exporter", "# Blender MTL File: 'a'", "# Created with AliceVision"] {
        let (m, warnings) = of(comment, "Kd 0.588 0.588 0.588\nmap_Kd a.png");
        assert_eq!((m.base_color, warnings), (Vec3::ONE, vec!["mtl-color-under-map"]), "{comment}");
        assert_eq!(of(comment, "Kd 1 1 1\nmap_Kd a.png").1.len(), 0);
    }
    assert_eq!(of("", "Kd 0.5 0.5 0.5\nmap_Kd a.png").0.base_color, Vec3::splat(0.5));
}

#[test]
fn materials_of_which_nothing_is_known_are_grey() {
    let unknown = "illum 4\nKd 0.00 0.00 0.00\nKa 0.00 0.00 0.00\nTf 1.00 1.00 1.00\nNi 0.00";
    let (m, warnings) = guess(unknown);
    assert_eq!(m.base_color, Vec3::splat(NO_DIFFUSE));
    assert!(warnings.contains(&"mtl-no-diffuse"), "{warnings:?}");
    assert_eq!(literal(unknown).base_color, Vec3::ZERO);
    // Black by intention.
    assert_eq!(guess("Kd 0 0 0\nNi 1").0.base_color, Vec3::ZERO);
    assert_eq!(of("Kd 0.5 0.5 0.5\nd 0\nmap_Kd a.png", MtlMode::Guess, &[Slot::Diffuse]).0.opacity, 1.0);
}

#[test]
fn a_highlight_without_width_is_none_and_without_exponent_satin() {
    let (m, warnings) = guess("Kd 1\nKs 1\nNs 0\nillum 2");
    assert_eq!((phong(&m).specular, warnings), (Vec3::ZERO, vec!["mtl-flat-highlight"]));
    let told = read("Kd 1\nKs 1\nNs -3", MtlMode::Guess, &[]).1.remove(0).text;
    assert!(told.starts_with("Ns -3 would spread the highlight"), "{told}");
    assert_eq!(guess("Kd 1\nKs 1\nNs 0.2\nillum 2").1, ["mtl-flat-highlight"]);
    let (m, warnings) = guess("Kd 1\nKs 1");
    assert_eq!((phong(&m).shininess, warnings), (32.0, vec!["mtl-no-shininess"]));
    assert_eq!(phong(&literal("Kd 1\nKs 1\nNs 0")).shininess, 0.0);
}

#[test]
fn physical_fields_make_a_metal_rough_material() {
    let (m, warnings) = guess("Kd 1 0 0\nPr 0.25\nPm 0.75\nNi 1.45\nKs 0.5 0.5 0.5");
    let Reflection::MetalRough(s) = &m.reflection else { panic!() };
    assert_eq!((s.roughness, s.metallic, s.ior, s.transmission), (0.25, 0.75, 1.45, 0.0));
    assert!(warnings.is_empty());
    let (m, _) = guess("Kd 1 1 1\nPr 0\nd 0.1\nillum 9\nNi 1.5");
    let Reflection::MetalRough(s) = &m.reflection else { panic!() };
    assert!((s.transmission - 0.9).abs() < 1e-6 && s.thick && m.base_color == Vec3::ONE);
    let (m, _) = guess("Kd 1\nPm 1\nNs 98");
    let Reflection::MetalRough(s) = &m.reflection else { panic!() };
    assert!((s.roughness - 0.02f32.sqrt().sqrt()).abs() < 1e-6);
}

#[test]
fn illum_0_is_constant_only_literally() {
    assert!(matches!(literal("Kd 1\nillum 0").reflection, Reflection::Unlit));
    assert_eq!(guess("Kd 1\nillum 0").1, ["mtl-constant"]);
}

#[test]
fn sheen_clear_coat_and_anisotropy_are_drawn() {
    let (material, warnings) = guess("Kd 1 1 1\nPr 0.2\nPs 0.4\nPc 0.5\nPcr 0.6\naniso 0.7\nanisor 0.25");
    let Reflection::MetalRough(m) = &material.reflection else { panic!("physically based") };
    let (sheen, coat, anisotropy) =
        (m.sheen.as_ref().unwrap(), m.coat.as_ref().unwrap(), m.anisotropy.as_ref().unwrap());
    assert_eq!((sheen.color, coat.strength, coat.roughness), (Vec3::splat(0.4), 0.5, 0.6));
    assert_eq!((anisotropy.strength, anisotropy.rotation), (0.7, std::f32::consts::FRAC_PI_2));
    assert!(warnings.is_empty(), "{warnings:?}");
    let (plain, _) = guess("Pr 0.2\nPs 0\nPc 0\nPcr 0.03\naniso 0\nanisor 0");
    let Reflection::MetalRough(m) = &plain.reflection else { panic!("physically based") };
    assert!(!m.has_lobes(), "exporters write zeros for what a material does not have");
}
