//! Instanced meshes look as if each instance were stored by itself.

use super::*;
use crate::accel::{AccelChoice, RayCounts};
use crate::generate::Family;
use crate::math::{DMat3, Vec2};
use crate::render::{Instancing, Sampling, Stochastic};
use crate::scene::{AlphaMode, MetalRough};

/// Objects of three meshes in front of a mirror: one mesh lets light through, one has normals and colours; they are turned,
/// stretched, mirrored and sheared, one is flat. Beside them a sphere, a plane and a mesh that is used once.
fn scene() -> Stage {
    let view = View::look_at(DVec3::new(2.0, -7.0, 4.0), DVec3::ZERO, DVec3::Z, Lens::perspective(0.7));
    let mut stage = stage(view);
    stage.settings = Settings { width: 40, height: 30, samples: 4, layers: true, ..Settings::default() };
    let solid = |base_color| Material {
        base_color,
        double_sided: true,
        reflection: Reflection::MetalRough(MetalRough { metallic: 0.0, roughness: 0.4, ..MetalRough::default() }),
        ..Material::default()
    };
    let star = crate::bench::star::star(12, 8);
    let normals = star.vertices.iter().map(|p| p.normalize_or(Vec3::Z)).collect();
    let star = Mesh { positions: star.vertices, triangles: star.triangles, normals, ..Mesh::default() };
    let square = Mesh { uvs: vec![vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y]], ..square(0.0, 1.0) };
    stage.mesh(star, place(DMat3::from_diagonal(DVec3::splat(0.5)), DVec3::ZERO), solid(Vec3::new(0.8, 0.3, 0.1)));
    stage.mesh(
        square,
        place(DMat3::IDENTITY * 0.6, DVec3::new(0.0, -2.0, 0.5)),
        Material {
            base_color: Vec3::new(0.2, 0.4, 0.9),
            opacity: 0.5,
            alpha_mode: AlphaMode::Blend,
            ..solid(Vec3::ONE)
        },
    );
    stage.mesh(super::square(-0.4, 0.3), place(DMat3::IDENTITY, DVec3::new(0.5, 0.0, 1.5)), solid(Vec3::splat(0.5)));
    for i in 0..14 {
        let turn = DMat3::from_rotation_z(f64::from(i)) * DMat3::from_rotation_x(0.4 * f64::from(i));
        let stretch = match i % 4 {
            0 => DMat3::from_diagonal(DVec3::new(0.4, 0.5, -0.3)),
            1 => DMat3::from_cols(DVec3::X * 0.5, DVec3::new(0.3, 0.4, 0.0), DVec3::Z * 0.4),
            2 => DMat3::from_diagonal(DVec3::new(0.4, 0.4, if i == 10 { 0.0 } else { 0.5 })),
            _ => DMat3::from_diagonal(DVec3::splat(0.3)),
        };
        let at = DVec3::new(f64::from(i % 5) - 2.0, f64::from(i / 5) - 1.0, 0.3 * f64::from(i % 3));
        let mesh = i % 2;
        let world_from_object = place(turn * stretch, at);
        stage.scene.instances.push(Instance { name: String::new(), mesh: mesh as u32, world_from_object });
    }
    let mirror = Phong { mirror: Vec3::splat(0.6), ..phong() };
    stage.plane(DVec3::Z, -0.8, material(Vec3::splat(0.3), mirror));
    stage.sphere(DVec3::new(-1.5, 1.0, 1.2), 0.5, solid(Vec3::new(0.1, 0.7, 0.2)));
    stage.lamp(DVec3::new(3.0, -4.0, 6.0), 1.0);
    stage
}

fn place(matrix3: DMat3, translation: DVec3) -> DAffine3 {
    DAffine3 { matrix3, translation }
}

/// The picture with all layers, counted, and the number of instances kept.
fn rendered(stage: &Stage, how: Instancing, kind: AccelKind) -> (Rendered, usize) {
    let world = World::placing(&stage.scene, how);
    let (accel, _) = world.structure(AccelChoice::Kind(kind), &AccelParams::DEFAULT);
    assert!(accel.check().is_ok(), "{:?}", accel.check());
    let textures = TextureStore::new(&stage.scene);
    let (scene, view, settings) = (&stage.scene, &stage.view, &stage.settings);
    let job = Job { scene, world: &world, accel: &accel, textures: &textures, view, settings };
    let rendered = render_counted(&job, &());
    assert!(crate::render::render(&job, &()).picture == rendered.picture, "counted and not counted");
    (rendered, world.instanced.placed().len())
}

#[test]
fn a_picture_and_its_layers_are_the_same_bits_whether_or_not_instances_are_kept() {
    let stage = scene();
    let (flat, none) = rendered(&stage, Instancing::Flatten, AccelKind::FastOctree);
    assert_eq!(none, 0);
    let all = |counts: &crate::render::ClassCounts| {
        let mut all = RayCounts::default();
        [counts.primary, counts.shadow, counts.reflected, counts.refracted].into_iter().for_each(|c| all += c);
        (all.queries, all.found)
    };
    for kind in [AccelKind::FastOctree, AccelKind::FastBvh] {
        let (kept, count) = rendered(&stage, Instancing::Keep, kind);
        assert_eq!(count, 15, "one is flat, and one mesh is seen once");
        assert!(kept.picture == flat.picture, "{kind}");
        assert_eq!(all(&kept.counts), all(&flat.counts), "{kind}: rays and hits");
    }
}

#[test]
fn what_is_known_to_stop_light_changes_no_bit() {
    // A round mesh with some see-through faces: in kept instances it is unknown which faces are opaque, and without pruning no
    // prim is known to be.
    let mut stage = scene();
    stage.scene.materials[0].alpha_mode = AlphaMode::Blend;
    let star = &mut stage.scene.meshes[0];
    star.colors = (0..star.positions.len()).map(|i| Vec3::ONE.extend(if i % 9 == 0 { 0.5 } else { 1.0 })).collect();
    stage.scene.environment = crate::scene::Environment::Studio;
    stage.lamp(DVec3::new(-6.0, -1.0, 0.5), 0.8).lamp(DVec3::new(4.0, 5.0, 1.0), 0.8);
    let world = World::new(&stage.scene);
    let open = (0..world.len() as u32).filter(|&prim| !world.shapes.opaque.get(prim)).count();
    assert!(open > 100 && open < world.len() - 100, "{open} of {}", world.len());

    let rare = Stochastic { min_samples: 4, max_samples: 32, error: 0.02, ..Stochastic::default() };
    for sampling in [Sampling::Uniform, Sampling::Stochastic(rare)] {
        stage.settings.sampling = sampling;
        let (flat, _) = rendered(&stage, Instancing::Flatten, AccelKind::FastOctree);
        let (kept, _) = rendered(&stage, Instancing::Keep, AccelKind::FastOctree);
        assert!(kept.picture == flat.picture, "kept, {sampling:?}");

        let world = world.clone().without_pruning();
        let (accel, _) = world.structure(AccelChoice::Kind(AccelKind::FastOctree), &AccelParams::DEFAULT);
        let textures = TextureStore::new(&stage.scene).without_pruning();
        let settings = &Settings { no_prune: true, ..stage.settings };
        let (scene, view) = (&stage.scene, &stage.view);
        let job = Job { scene, world: &world, accel: &accel, textures: &textures, view, settings };
        assert!(render_counted(&job, &()).picture == flat.picture, "without pruning, {sampling:?}");
    }
}

#[test]
fn ways_up_from_round_surfaces_meet_the_same_whether_or_not_instances_are_kept() {
    // Under leaves with some see-through faces, within the bulge that the normals of a square describe; seen from aside.
    let eye = DVec3::new(0.0, -6.0, 0.35);
    let mut stage = stage(View::look_at(eye, DVec3::ZERO, DVec3::Z, Lens::perspective(0.3)));
    stage.settings = Settings { width: 96, height: 48, samples: 4, ..Settings::default() };
    let lean = |p: &Vec3| Vec3::new(p.x, p.y, 1.2).normalize();
    let ground = square(0.0, 0.9);
    let normals = ground.positions.iter().map(lean).collect();
    stage.mesh(Mesh { normals, ..ground }, DAffine3::IDENTITY, material(Vec3::ONE, phong()));
    let leaf = square(0.0, 0.2);
    let colors = (0..4).map(|i| Vec3::ONE.extend(if i == 1 { 0.5 } else { 1.0 })).collect();
    let blended = Material { alpha_mode: AlphaMode::Blend, ..unlit(Vec3::splat(0.1)) };
    stage.mesh(Mesh { colors, ..leaf }, place(DMat3::IDENTITY, DVec3::new(-0.4, -0.3, 0.1)), blended);
    for (x, y, z) in [(0.2, -0.3, 0.15), (-0.2, 0.2, 0.12), (0.45, 0.25, 0.08), (0.0, -0.05, 0.2)] {
        let world_from_object = place(DMat3::from_rotation_z(x), DVec3::new(x, y, z));
        stage.scene.instances.push(Instance { name: String::new(), mesh: 1, world_from_object });
    }
    for (x, y) in [(5.0, 1.0), (-5.0, 2.0), (1.0, 6.0), (-2.0, -5.0)] {
        stage.lamp(DVec3::new(x, y, 0.3), 1.0);
    }
    let (flat, _) = rendered(&stage, Instancing::Flatten, AccelKind::FastOctree);
    let (kept, _) = rendered(&stage, Instancing::Keep, AccelKind::FastOctree);
    let differ = flat.picture.beauty.iter().zip(&kept.picture.beauty).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels");
}

#[test]
fn prims_of_kept_instances_lead_back_to_where_they_came_from() {
    let scene = scene().scene;
    let (flat, kept) = (World::new(&scene), World::placing(&scene, Instancing::Keep));
    assert!(kept.shapes.triangles.len() < flat.shapes.triangles.len() / 3);
    assert_eq!((flat.len(), flat.triangles()), (kept.len(), kept.triangles()));
    for prim in 0..flat.len() as u32 {
        assert_eq!(flat.source(prim), kept.source(prim));
        assert_eq!(flat.material(&scene, prim), kept.material(&scene, prim));
        assert_eq!(format!("{:?}", flat.prim(prim)), format!("{:?}", kept.prim(prim)));
    }
}

#[test]
fn instances_are_kept_without_being_asked_for_where_that_saves_much() {
    let kept = |triangles| World::placing(&Family::Instances.scene(triangles), Instancing::Auto);
    assert!(kept(100_000).instanced.is_empty());
    let world = kept(400_000);
    let (places, stored) = (world.instanced.placed().len(), world.instanced.stored());
    assert!(places > 150 && places * stored == world.triangles() as usize, "{places} times {stored}");
    assert!(world.shapes.triangles.is_empty());
}

#[test]
fn memory_of_a_hundred_times_the_instances_is_hardly_more() {
    let bytes = |triangles| {
        let world = World::placing(&Family::Instances.scene(triangles), Instancing::Keep);
        let (accel, _) = world.structure(AccelChoice::Kind(AccelKind::FastOctree), &AccelParams::DEFAULT);
        (world.instanced.placed().len(), world.bytes() as u64 + accel.summary().bytes)
    };
    let ((few, small), (many, large)) = (bytes(24_000), bytes(2_400_000));
    assert!(many > 90 * few, "{few} and {many} instances");
    assert!(large < 5 * small, "{small} and {large} bytes");
}
