//! Scenes with one cause each, which must be found.

use super::*;
use crate::generate::Family;
use crate::math::random::Random;
use crate::math::{DAffine3, DVec3, Vec3, Vec4};
use crate::render::view::Lens;
use crate::scene::{AlphaMode, Falloff, Instance, Light, LightKind, Material, Mesh, MetalRough, Reflection};

/// Sphere of about 2 `side`² triangles.
fn ball(center: Vec3, radius: f32, side: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let point = |i: u32, j: u32| {
        let (a, b) = (std::f32::consts::PI * i as f32 / side as f32, std::f32::consts::TAU * j as f32 / side as f32);
        center + radius * Vec3::new(libm::sinf(a) * libm::cosf(b), libm::sinf(a) * libm::sinf(b), libm::cosf(a))
    };
    for i in 0..side {
        for j in 0..side {
            let base = mesh.positions.len() as u32;
            mesh.positions.extend([point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
            mesh.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
    }
    mesh
}

fn triangle_soup(count: usize, mut corners: impl FnMut(&mut Random) -> [Vec3; 3]) -> Mesh {
    let mut random = Random::new(7);
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(corners(&mut random));
        mesh.triangles.push([base, base + 1, base + 2]);
    }
    mesh
}

fn matt() -> Material {
    let reflection = Reflection::MetalRough(MetalRough { metallic: 0.0, roughness: 1.0, ..MetalRough::default() });
    Material {
        name: "matt".into(),
        base_color: Vec3::splat(0.7),
        double_sided: true,
        reflection,
        ..Material::default()
    }
}

/// Scene of meshes with one material each, and one light.
fn scene(parts: Vec<(Mesh, Material)>) -> Scene {
    let mut scene = Scene::default();
    for (mesh, material) in parts {
        let number = scene.meshes.len() as u32;
        scene.materials.push(material);
        scene.meshes.push(Mesh { material: number, ..mesh });
        let world_from_object = DAffine3::IDENTITY;
        scene.instances.push(Instance { name: String::new(), mesh: number, world_from_object });
    }
    scene.lights.push(lamp(DVec3::new(3.0, -4.0, 5.0), 1.0));
    scene
}

fn lamp(position: DVec3, intensity: f32) -> Light {
    let kind = LightKind::Point { position, falloff: Falloff::None };
    Light { name: String::new(), intensity: Vec3::splat(intensity), kind, shadows: true, size: 0.0 }
}

/// Case that views the scene from outside, in few pixels.
fn case(scene: Scene, accel: AccelKind) -> Case {
    let bounds = crate::scene::framing::robust_bounds(&scene);
    let eye = bounds.center() + DVec3::new(0.4, -1.0, 0.5).normalize() * bounds.radius() * 2.6;
    let view = View::look_at(eye, bounds.center(), DVec3::Z, Lens::perspective(0.8));
    let settings = Settings { width: 40, height: 30, samples: 1, ..Settings::default() };
    Case { scene, view, settings, accel, params: AccelParams::DEFAULT }
}

/// Asserts that `cause` comes first, and that its saving predicts that of a picture of four times as many pixels.
#[track_caller]
fn assert_is_explained_by(case: &Case, cause: Cause) -> Finding {
    let (usual, findings) = explain(case, |_| true).unwrap();
    let told: Vec<_> = findings.iter().map(|f| format!("{}: {:.3}, {}", f.cause, f.saving, f.evidence)).collect();
    let first = &findings[0];
    assert!(first.cause == cause && first.saving > 0.15, "{usual:?}\n{told:#?}");

    let larger = Case { settings: Settings { width: 80, height: 60, ..case.settings.clone() }, ..case.clone() };
    let without = suspects(&larger).into_iter().find(|s| s.cause == cause).unwrap().without;
    let cost = |case: &Case| Bill::of(case).sum().cost() as f64;
    let measured = 1.0 - cost(&without) / cost(&larger);
    assert!(
        (first.saving / measured - 1.0).abs() < 0.25,
        "{cause}: {:.3} predicted, {measured:.3} measured",
        first.saving
    );
    first.clone()
}

#[test]
fn huge_triangles_among_small_ones_are_found() {
    let mut parts = vec![(ball(Vec3::ZERO, 0.5, 24), matt())];
    let huge = |random: &mut Random| [0, 1, 2].map(|_| random.direction() * 1.5);
    parts.push((triangle_soup(60, huge), matt()));
    let found = assert_is_explained_by(&case(scene(parts), AccelKind::FastBvh), Cause::HugeTriangles);
    assert!(found.evidence.contains("1212") && found.cause.keeps_the_picture(), "{}", found.evidence);
}

#[test]
fn a_cluster_in_a_large_box_is_found_and_the_hierarchy_recommended() {
    let mut stadium = Family::Stadium.scene(3000);
    stadium.lights.push(lamp(DVec3::Z * 100.0, 1.0));
    // View as chosen by somebody interested in the small object.
    let mut case = case(stadium, AccelKind::Grid);
    case.view = View::look_at(DVec3::new(0.0, -4.0, 3.0), DVec3::ZERO, DVec3::Z, Lens::perspective(0.4));
    let found = assert_is_explained_by(&case, Cause::DenseCluster);
    assert_eq!(found.remedy, "--accel fast-bvh");
}

#[test]
fn triangles_are_huge_or_not_where_their_instance_stands() {
    let turned = |first: f64, second: f64| {
        let mut scene = scene(vec![(ball(Vec3::ZERO, 0.5, 24), matt()), (ball(Vec3::ZERO, 1.0, 3), matt())]);
        scene.instances[1].world_from_object = DAffine3::from_scale(DVec3::splat(first));
        let other = DAffine3::from_scale_rotation_translation(DVec3::splat(second), Default::default(), DVec3::X * 0.4);
        scene.instances.push(Instance { world_from_object: other, ..scene.instances[1].clone() });
        let suspects = suspects(&case(scene, AccelKind::FastBvh));
        let huge = suspects.into_iter().find(|s| s.cause == Cause::HugeTriangles).unwrap();
        (huge.evidence, mend::triangles(&huge.without.scene).count())
    };
    let (large_first, small_first) = (turned(4.0, 0.05), turned(0.05, 4.0));
    assert!(large_first.1 > 24 * 24 * 2 + 500, "{large_first:?}");
    assert_eq!(large_first, small_first);
}

#[test]
fn a_structure_that_divides_no_space_is_not_said_to_divide_any() {
    for accel in [AccelKind::None, AccelKind::Spheres, AccelKind::Bvh, AccelKind::Grid] {
        let found = suspects(&case(scene(vec![(ball(Vec3::ZERO, 0.5, 6), matt())]), accel));
        assert!(found.iter().all(|s| s.cause != Cause::DenseCluster), "{accel}");
        assert!(found.iter().any(|s| s.cause == Cause::Structure && s.remedy == "--accel fast-bvh"), "{accel}");
    }
}

#[test]
fn what_is_cut_keeps_its_vertices_normals_colours_and_places_in_its_texture() {
    let corners = vec![Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0];
    let mesh = Mesh {
        normals: vec![Vec3::X, Vec3::Y, Vec3::Z],
        colors: vec![Vec4::X, Vec4::Y, Vec4::Z],
        uvs: vec![corners.iter().map(|p| p.truncate() * 0.25).collect()],
        positions: corners,
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let cut = mend::cut(&scene(vec![(mesh, matt())]), |_| Some(1.0), 1000);
    let mesh = &cut.meshes[cut.instances[0].mesh as usize];
    assert!(mesh.triangles.len() >= 32, "{}", mesh.triangles.len());
    for (i, place) in mesh.positions.iter().enumerate() {
        let [x, y] = [place.x, place.y].map(|c| c * 0.25);
        assert_eq!(mesh.uvs[0][i], place.truncate() * 0.25);
        assert!((mesh.colors[i] - Vec4::new(1.0 - x - y, x, y, 0.0)).length() < 1e-6);
        assert!((mesh.normals[i].length() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn faces_that_show_another_side_or_material_or_let_light_through_are_no_copies() {
    let copies = |second: Mesh, [a, b]: [Material; 2]| {
        mend::without_copies(&scene(vec![(ball(Vec3::ZERO, 1.0, 4), a), (second, b)])).1
    };
    let all = ball(Vec3::ZERO, 1.0, 4).triangles.len();
    let same = || ball(Vec3::ZERO, 1.0, 4);
    let turned = || {
        let mut mesh = same();
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh
    };
    let one_sided = || Material { double_sided: false, ..matt() };
    let red = Material { base_color: Vec3::X, ..matt() };
    let glassy = || Material { alpha_mode: AlphaMode::Blend, ..matt() };
    assert_eq!(copies(same(), [matt(), matt()]), all);
    assert_eq!(copies(turned(), [matt(), matt()]), all);
    assert_eq!(copies(same(), [one_sided(), one_sided()]), all);
    assert_eq!(copies(turned(), [one_sided(), one_sided()]), 0);
    assert_eq!(copies(same(), [matt(), red]), 0);
    assert_eq!(copies(same(), [glassy(), glassy()]), 0);
}

#[test]
fn shells_upon_shells_are_found() {
    let parts = (0..6).map(|_| (ball(Vec3::ZERO, 1.0, 24), matt())).collect();
    let found = assert_is_explained_by(&case(scene(parts), AccelKind::FastBvh), Cause::Shells);
    assert!(found.evidence.starts_with(&(5 * 2 * 24 * 24).to_string()), "{}", found.evidence);
}

#[test]
fn slivers_are_found() {
    let sliver = |random: &mut Random| {
        let (place, along) = (random.direction() * 0.3, random.direction());
        let aside = along.any_orthonormal_vector() * 0.004;
        [place - along, place + along, place + aside]
    };
    let parts = vec![(triangle_soup(600, sliver), matt())];
    assert_is_explained_by(&case(scene(parts), AccelKind::FastBvh), Cause::Slivers);
}

#[test]
fn cards_that_are_mostly_clear_are_found() {
    let card = |i: usize| {
        let y = i as f32 * 0.05;
        let positions = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| Vec3::new(x, y, z)).to_vec();
        Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() }
    };
    let leaf = Material { name: "leaf".into(), opacity: 0.1, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..matt() };
    let mut parts: Vec<_> = (0..30).map(|i| (card(i), leaf.clone())).collect();
    parts.push((ball(Vec3::Y * 3.0, 0.5, 16), matt()));
    let found = assert_is_explained_by(&case(scene(parts), AccelKind::FastBvh), Cause::AlphaCards);
    assert!(found.remedy.contains("leaf") && !found.cause.keeps_the_picture());
}

#[test]
fn glass_in_glass_is_found() {
    let clear =
        MetalRough { metallic: 0.0, roughness: 0.0, transmission: 1.0, thick: true, ior: 1.5, ..MetalRough::default() };
    let glass = Material { name: "glass".into(), reflection: Reflection::MetalRough(clear), ..matt() };
    let parts = (0..4).map(|i| (ball(Vec3::ZERO, 1.0 - 0.2 * i as f32, 16), glass.clone())).collect();
    let found = assert_is_explained_by(&case(scene(parts), AccelKind::FastBvh), Cause::Depth);
    assert_eq!(found.remedy, "--depth 2");
    assert_eq!(found.evidence, "rays are mirrored and bent again and again");
}

#[test]
fn many_lights_are_found() {
    let mut many = scene(vec![(ball(Vec3::ZERO, 1.0, 24), matt())]);
    let around = (0..9).map(|i| 0.7 * f64::from(i)).map(|a| DVec3::new(libm::cos(a), libm::sin(a), 1.0) * 4.0);
    many.lights.extend(around.map(|place| lamp(place, 0.2)));
    let found = assert_is_explained_by(&case(many, AccelKind::FastBvh), Cause::Lights);
    assert!(found.evidence.starts_with("10 lights"), "{}", found.evidence);
}

#[test]
fn a_plain_mesh_has_nothing_to_explain() {
    let plain = case(scene(vec![(ball(Vec3::ZERO, 1.0, 24), matt())]), AccelKind::FastBvh);
    let (usual, findings) = explain(&plain, |_| true).unwrap();
    assert!(usual.sum().tests > 0 && findings.iter().all(|f| f.saving < 0.1), "{findings:?}");
    assert_eq!(explain(&case(Family::Stadium.scene(500), AccelKind::Grid), |_| false), None, "it can be ended");
}

#[test]
fn what_transforms_points_for_each_prim_costs_them_and_another_structure_saves_them() {
    let case = case(scene(vec![(ball(Vec3::ZERO, 1.0, 20), matt())]), AccelKind::Transform);
    let (usual, findings) = explain(&case, |_| true).expect("it goes on");
    assert!(usual.sum().transforms > 100 * usual.sum().rays && usual.sum().cost() > usual.sum().transforms);
    assert!(findings[0].cause == Cause::Structure && findings[0].saving > 0.9, "{findings:?}");
}

#[test]
fn a_saving_is_of_as_many_rays_and_small_ones_of_rays_that_were_drawn_anew_are_chance() {
    let work = |rays: u64, tests: u64| Work { rays, tests, ..Work::default() };
    let usual = Bill([work(1000, 10_000), work(500, 5000), Work::default(), Work::default()]);
    let found = |shadow: Work, cause: Cause| {
        let case = case(scene(vec![(ball(Vec3::ZERO, 1.0, 4), matt())]), AccelKind::Grid);
        let suspect = Suspect { cause, evidence: String::new(), remedy: String::new(), without: case };
        Finding::of(&usual, Bill([work(1000, 10_000), shadow, Work::default(), Work::default()]), suspect)
    };
    let alike = found(work(1000, 10_000), Cause::Shells);
    assert!(alike.saving.abs() < 1e-12 && alike.is_drawn_anew && !alike.is_worth_it());
    let cheaper = found(work(1000, 8800), Cause::Shells);
    assert!((cheaper.saving - 0.04).abs() < 1e-12 && !cheaper.is_worth_it(), "chance");
    for rays in [500, 501] {
        let same_rays = found(work(rays, rays * 44 / 5), Cause::Shells);
        assert!(
            (same_rays.saving - 0.04).abs() < 1e-4 && !same_rays.is_drawn_anew && same_rays.is_worth_it(),
            "{rays}"
        );
    }
    let fewer = found(work(250, 2500), Cause::Lights);
    assert!((fewer.saving - 1.0 / 6.0).abs() < 1e-12 && !fewer.is_drawn_anew && fewer.is_worth_it());
}
