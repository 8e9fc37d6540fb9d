use super::*;
use crate::load::Limits;
use crate::math::{DQuat, Vec2, Vec3, Vec4};
use crate::scene::{MetalRough, Phong};
use std::collections::HashSet;

fn budget() -> Budget {
    Budget::new(&Limits::default())
}

fn place(mesh: u32, world_from_object: DAffine3) -> Instance {
    Instance { name: "here".into(), mesh, world_from_object }
}

fn wires(positions: &[[f32; 3]], ends: &[[u32; 2]]) -> Wires {
    let positions = positions.iter().map(|&p| p.into()).collect();
    Wires { mesh: Mesh { name: "wires".into(), positions, ..Mesh::default() }, ends: ends.to_vec() }
}

fn red() -> Scene {
    let material = Material { base_color: Vec3::X, emission: Vec3::Y, double_sided: true, ..Material::plain() };
    Scene { materials: vec![material], ..Scene::default() }
}

fn drawn(wires: &[Wires], places: &[Instance]) -> (Scene, Facts, Vec<Diagnostic>) {
    drawn_in(red(), wires, places)
}

fn drawn_in(mut scene: Scene, wires: &[Wires], places: &[Instance]) -> (Scene, Facts, Vec<Diagnostic>) {
    let mut facts = Facts::default();
    let warnings = draw(wires, places, &mut scene, &mut budget(), &mut facts, Path::new("a.gltf"), None).unwrap();
    (scene, facts, warnings)
}

/// Corners of an instance in the world.
fn corners(scene: &Scene, instance: usize) -> Vec<DVec3> {
    let Instance { mesh, world_from_object, .. } = &scene.instances[instance];
    let positions = &scene.meshes[*mesh as usize].positions;
    positions.iter().map(|p| world_from_object.transform_point3(p.as_dvec3())).collect()
}

fn middle(points: &[DVec3]) -> DVec3 {
    points.iter().sum::<DVec3>() / points.len() as f64
}

/// Distances of the corners of a prism from the line between the centres of its ends.
fn thickness(corners: &[DVec3]) -> f64 {
    let (a, b) = (middle(&corners[..3]), middle(&corners[3..]));
    let along = (b - a).normalize();
    corners.iter().map(|c| (*c - a).reject_from(along).length()).fold(0.0, f64::max)
}

#[test]
fn a_point_far_away_makes_the_others_no_wider() {
    let near = |i: u16| [f32::from(i % 10) * 0.1, f32::from(i / 10) * 0.1, 0.0];
    let cloud: Vec<[f32; 3]> = (0..100).map(near).collect();
    let ends: Vec<[u32; 2]> = (0..101).map(|i| [i, i]).collect();
    let width = |positions: &[[f32; 3]]| {
        let of = wires(positions, &ends[..positions.len()]);
        drawn(&[of], &[place(0, DAffine3::IDENTITY)]).1.wires.point_width
    };
    let (alone, with_stray) = (width(&cloud), width(&[&cloud[..], &[[1e4, 0.0, 0.0]]].concat()));
    assert!((0.5..1.5).contains(&(with_stray / alone)), "{alone} alone, {with_stray} with a stray");
}

#[test]
fn points_and_lines_stand_where_the_file_has_them() {
    let of = wires(&[[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]], &[[0, 0], [0, 1]]);
    let shift = DAffine3::from_translation(DVec3::new(1e7, 0.0, -2.0));
    let (scene, facts, warnings) = drawn(&[of], &[place(0, shift)]);
    let corners = corners(&scene, 0);
    assert_eq!((corners.len(), scene.meshes[0].triangles.len()), (6 + 6, 8 + 8));
    let width = 5.0 / 256.0;
    assert!((middle(&corners[..6]) - shift.translation).length() < 1e-6, "{corners:?}");
    assert!(corners[..6].iter().all(|c| (*c - shift.translation).length() < width));
    let half = DVec3::new(0.6, 0.8, 0.0) * (width / 2.0);
    assert!((middle(&corners[6..9]) - (shift.translation - half)).length() < 1e-6);
    assert!((middle(&corners[9..]) - (shift.translation + DVec3::new(3.0, 4.0, 0.0) + half)).length() < 1e-6);
    assert_eq!(scene.meshes[0].face_of_triangle, [vec![0; 8], vec![1; 8]].concat());
    assert_eq!(facts.wires, WireFacts { points: 1, lines: 1, point_width: width, line_width: width });
    assert!(warnings.is_empty() && facts.dropped.is_empty() && scene.instances[0].name == "here");
}

#[test]
fn widths_are_those_of_the_world_however_a_place_stretches() {
    let of = wires(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1], [0, 2]]);
    let turn = DQuat::from_rotation_z(0.3);
    let stretched = DAffine3::from_scale_rotation_translation(DVec3::new(-10.0, 2.0, 0.0), turn, DVec3::Z);
    let (scene, facts, _) = drawn(&[of], &[place(0, stretched)]);
    let corners = corners(&scene, 0);
    let expected = facts.wires.line_width * std::f64::consts::PI / 27f64.sqrt();
    for prism in corners.chunks(6) {
        assert!((thickness(prism) - expected).abs() < 1e-5 * expected, "{prism:?}");
    }
    assert!((middle(&corners[3..6]) - turn * DVec3::X * -10.0 - DVec3::Z).length() < facts.wires.line_width);
}

#[test]
fn places_that_differ_by_a_shift_share_a_mesh() {
    let of = wires(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 1]]);
    let shifted = |x: f64| place(0, DAffine3::from_translation(DVec3::X * x));
    let turned = place(0, DAffine3::from_rotation_y(1.0));
    let (scene, facts, _) = drawn(&[of], &[shifted(0.0), shifted(5.0), turned]);
    assert_eq!(scene.instances.iter().map(|i| i.mesh).collect::<Vec<_>>(), [0, 0, 1]);
    assert_eq!((scene.meshes.len(), facts.wires.lines), (2, 1));
}

#[test]
fn without_normals_they_are_unlit_and_with_them_lit() {
    let mut of = wires(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 1], [1, 1]]);
    let (scene, ..) = drawn(std::slice::from_ref(&of), &[place(0, DAffine3::IDENTITY)]);
    let shown = &scene.materials[scene.meshes[0].material as usize];
    assert!(matches!(shown.reflection, Reflection::Unlit) && !shown.double_sided);
    assert_eq!((shown.base_color, shown.emission), (Vec3::X, Vec3::Y));
    assert!(!matches!(scene.materials[0].reflection, Reflection::Unlit), "faces keep the material");

    of.mesh.normals = vec![Vec3::Y, Vec3::Z];
    of.mesh.colors = vec![Vec4::ONE, Vec4::new(1.0, 0.0, 0.0, 1.0)];
    of.mesh.uvs = vec![Vec::new(), vec![Vec2::ZERO, Vec2::ONE]];
    let mirror = place(0, DAffine3::from_scale(DVec3::new(1.0, -2.0, 1.0)));
    let (scene, ..) = drawn(&[of], &[mirror]);
    let mesh = &scene.meshes[0];
    let shown = &scene.materials[mesh.material as usize];
    assert!(!matches!(shown.reflection, Reflection::Unlit) && shown.double_sided);
    assert_eq!(mesh.normals, [vec![Vec3::NEG_Y; 3], vec![Vec3::Z; 3 + 4]].concat());
    assert_eq!(mesh.positions.len(), 6 + 4, "points with normals are squares");
    assert_eq!((mesh.colors[0], mesh.colors[3], mesh.colors[9]), (Vec4::ONE, of_red(), of_red()));
    assert_eq!((mesh.uvs[0].len(), mesh.uvs[1][2], mesh.uvs[1][9]), (0, Vec2::ZERO, Vec2::ONE));
}

#[test]
fn nothing_passes_lit_wires_of_glass_which_is_told_once() {
    let glass = |reflection: Reflection| Material { reflection, ..Material::plain() };
    let thick = MetalRough {
        metallic: 0.0,
        transmission: 1.0,
        thick: true,
        thickness: 2.0,
        roughness: 0.5,
        ..MetalRough::default()
    };
    let phong = Phong { transmission: Vec3::ONE, specular: Vec3::X, ..Phong::default() };
    for surface in [Reflection::MetalRough(thick), Reflection::Phong(phong)] {
        let scene = Scene { materials: vec![glass(surface)], ..Scene::default() };
        let mut lit = wires(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 1]]);
        let plain = lit.clone();
        lit.mesh.normals = vec![Vec3::Y; 2];
        let places = [0, 1, 2].map(|mesh| place(mesh, DAffine3::IDENTITY));
        let (scene, _, warnings) = drawn_in(scene, &[lit.clone(), plain, lit], &places);
        let shown = |k: usize| &scene.materials[scene.meshes[k].material as usize];
        assert!(scene.materials[0].reflection.transmits(), "faces keep the material");
        assert!(shown(0).is_opaque() && shown(1).is_opaque() && shown(0).double_sided);
        assert_eq!(scene.meshes[0].material, scene.meshes[2].material);
        match &shown(0).reflection {
            Reflection::MetalRough(m) => assert_eq!((m.thick, m.thickness, m.roughness), (false, 0.0, 0.5)),
            Reflection::Phong(p) => assert_eq!(p.specular, Vec3::X),
            Reflection::Unlit => panic!("it has lost its light"),
        }
        let told: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert_eq!(told, ["a.gltf: a material that light passes is drawn solid on points and lines"]);
    }
}

fn of_red() -> Vec4 {
    Vec4::new(1.0, 0.0, 0.0, 1.0)
}

#[test]
fn ends_that_are_not_finite_are_left_out_and_told() {
    let of =
        wires(&[[0.0; 3], [1.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0]], &[[0, 1], [1, 2], [3, 3]]);
    let (scene, facts, warnings) = drawn(&[of], &[place(0, DAffine3::IDENTITY)]);
    assert_eq!(scene.meshes[0].triangles.len(), 8);
    let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
    assert_eq!((warning.code, warning.count, facts.dropped[0].1), ("line-not-finite", 2, 2));
    let nowhere = wires(&[[f32::NAN; 3]], &[[0, 0]]);
    let (scene, facts, _) = drawn(&[nowhere], &[place(0, DAffine3::IDENTITY)]);
    assert!(scene.meshes.is_empty() && scene.instances.is_empty() && facts.dropped[0].1 == 1);
}

#[test]
fn lines_without_length_and_a_place_without_size_are_points() {
    let of = wires(&[[2.0; 3], [2.0; 3]], &[[0, 1], [0, 0]]);
    let (scene, facts, warnings) = drawn(&[of], &[place(0, DAffine3::IDENTITY)]);
    assert_eq!((scene.meshes[0].positions.len(), warnings), (6 + 6, Vec::new()));
    assert_eq!(facts.wires, WireFacts { points: 1, lines: 1, point_width: 1.0, line_width: 1.0 });
}

#[test]
fn crowds_are_thinner_and_simpler() {
    let asked = Widths::new([CROWD, 4096], 256.0, Some([0.3, 0.2]));
    assert_eq!((asked.point, asked.line, asked.crowd), (0.3, 0.2, true));
    let few = Widths::new([CROWD - 1, 4096], 256.0, None);
    assert_eq!(few, Widths { point: 1.0, line: 1.0, crowd: false });
    let many = Widths::new([4 * CROWD, 4 * 4096], 256.0, None);
    assert_eq!(many, Widths { point: 0.5, line: 0.5, crowd: true });

    let side = 257u32;
    let positions: Vec<[f32; 3]> = (0..side * side).map(|i| [(i % side) as f32, (i / side) as f32, 0.0]).collect();
    let ends: Vec<[u32; 2]> = (0..side * side).map(|i| [i; 2]).collect();
    let (scene, facts, _) = drawn(&[wires(&positions, &ends)], &[place(0, DAffine3::IDENTITY)]);
    assert_eq!(scene.meshes[0].triangles.len(), 4 * (side * side) as usize);
    assert!((facts.wires.point_width - 256.0 * 2f64.sqrt() / 257.0).abs() < 1e-9);
}

#[test]
fn more_than_memory_allows_is_refused_before_it_is_made() {
    let of = wires(&[[0.0; 3], [1.0, 0.0, 0.0]], &[[0, 1]; 1000]);
    let [kept, held] = bake::cost(&of, &Widths::new([0, 1000], 1.0, None));
    let with = |memory: u64| {
        let mut budget = Budget::new(&Limits { memory, ..Limits::default() });
        let places = [place(0, DAffine3::IDENTITY)];
        draw(std::slice::from_ref(&of), &places, &mut red(), &mut budget, &mut Facts::default(), Path::new("a"), None)
            .is_ok()
    };
    assert!(with(kept + held) && !with(kept + held - 1));
    assert_eq!([kept, held], [1000 * (6 * 12 + 8 * 16); 2]);
}

#[test]
fn no_corner_of_a_solid_meets_another() {
    // A line a million times as long as it is wide, far from the file's origin.
    let of = wires(&[[1e6, 0.0, 0.0], [1e6 + 1.0, 1.0, 0.0]], &[[0, 1], [0, 0]]);
    let (scene, _, warnings) = drawn(&[of], &[place(0, DAffine3::IDENTITY)]);
    let distinct: HashSet<_> = scene.meshes[0].positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
    assert_eq!((distinct.len(), warnings), (12, Vec::new()));
}

#[test]
fn many_wires_are_the_solids_of_each_in_their_order() {
    // Enough wires for several parallel tasks, points and lines mixed, some with NaN positions.
    let at = |i: u16| match i {
        _ if i % 5000 == 17 => [f32::NAN; 3],
        _ => [f32::from(i % 100), f32::from(i / 100), f32::from(i % 7)],
    };
    let positions: Vec<[f32; 3]> = (0..10_000).map(at).collect();
    let ends: Vec<[u32; 2]> = (0..9_999).map(|i| [i, if i % 3 == 0 { i + 1 } else { i }]).collect();
    let (scene, ..) = drawn(&[wires(&positions, &ends)], &[place(0, DAffine3::IDENTITY)]);
    let (mesh, whole) = (&scene.meshes[0], corners(&scene, 0));
    assert_eq!(mesh.triangles.len(), mesh.face_of_triangle.len());
    let mut next = 0;
    for (number, &[a, b]) in (0u32..).zip(&ends) {
        let [x, y] = [a, b].map(|i| DVec3::from(positions[i as usize].map(f64::from)));
        if !(x.is_finite() && y.is_finite()) {
            continue;
        }
        let first = next;
        while mesh.face_of_triangle.get(next) == Some(&number) {
            next += 1;
        }
        let solid: Vec<DVec3> = mesh.triangles[first..next].as_flattened().iter().map(|&i| whole[i as usize]).collect();
        assert_eq!(solid.len(), 24, "wire {number}");
        assert!((middle(&solid) - (x + y) / 2.0).length() < 1e-3, "wire {number}");
    }
    assert_eq!(next, mesh.triangles.len());
}
