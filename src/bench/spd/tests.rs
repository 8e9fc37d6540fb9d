//! Counts that can be derived by hand, and their reports.

use super::measure::{Measured, Plan, Setting, measure};
use super::published::SCENES;
use super::report::{Report, tables};
use super::rules::{Facing, Sent, Tally, send};
use crate::accel::{AccelKind, AccelParams, AnyAccel, BitSet, Shapes};
use crate::bench::machine::Machine;
use crate::bench::report::Format;
use crate::generate::Family;
use crate::load::{LoadOptions, Polygons, load_bytes};
use crate::render::World;
use crate::scene::Scene;
use std::path::Path;

/// Pixels per axis.
const PIXELS: u32 = 64;

/// Number of primary rays: 65 × 65.
const EYE_RAYS: u64 = 4225;

/// Camera on the z axis that sees exactly the square of side 4 in z = 0, and one light above it.
const VIEW: &str = "b 0 0 0\nv\nfrom 0 0 10\nat 0 0 0\nup 0 1 0\nangle 22.619864948040426\nhither 1\nresolution 512 512\n\
                    l 0 0 20\n";

const MATT: &str = "f 1 1 1 1 0 0 0 0\n";
const MIRROR: &str = "f 1 1 1 0.5 0.5 10 0 0\n";

fn scene(text: &str) -> Scene {
    let text = format!("{VIEW}{text}");
    let options = LoadOptions { polygons: Polygons::Whole, ..LoadOptions::default() };
    load_bytes(Path::new("scene.nff"), text.into_bytes(), &options).expect("it is NFF").scene
}

/// Square in the plane z with the given half side, facing +z if `up`.
fn square(half: f64, z: f64, up: bool) -> String {
    let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let line = |(x, y): &(f64, f64)| format!("{} {} {z}\n", x * half, y * half);
    let lines: Vec<String> = corners.iter().map(line).collect();
    format!("p 4\n{}", if up { lines.concat() } else { lines.into_iter().rev().collect() })
}

fn sent(scene: &Scene, facing: Facing) -> Sent {
    let world = World::new(scene);
    let shapes = Shapes { opaque: BitSet::filled(world.shapes.len(), true), ..world.shapes.clone() };
    let accel = AnyAccel::build(AccelKind::None, &shapes, &AccelParams::DEFAULT);
    send(scene, &world, &shapes, &accel, facing, PIXELS).expect("it has a camera")
}

fn tally(text: &str, facing: Facing) -> Tally {
    sent(&scene(text), facing).tally
}

#[test]
fn eye_rays_pass_through_the_corners_of_the_pixels() {
    // Slightly wider than half the view: 33 of 65 corners on each axis, where 32 pixels would be.
    let counted = tally(&format!("{MATT}{}", square(1.01, 0.0, true)), Facing::Outward);
    let hits = 33 * 33;
    let expected = Tally { primary: EYE_RAYS, primary_hits: hits, shadow: hits, ..Tally::default() };
    assert_eq!(counted, expected, "one light, nothing before it");
}

#[test]
fn a_face_seen_from_behind_sends_shadow_rays_only_where_normals_are_turned() {
    let text = format!("{MATT}{}", square(1.01, 0.0, false));
    assert_eq!(tally(&text, Facing::Outward).shadow, 0);
    assert_eq!(tally(&text, Facing::Turned).shadow, 33 * 33);
}

#[test]
fn two_mirrors_send_four_generations_after_the_eye_and_no_more() {
    // The camera is in between: rays go back and forth between the mirrors.
    let mirrors = format!("{MIRROR}{}{}", square(50.0, 0.0, true), square(50.0, 30.0, false));
    let counted = tally(&mirrors, Facing::Outward);
    assert_eq!((counted.primary_hits, counted.reflected, counted.refracted), (EYE_RAYS, 4 * EYE_RAYS, 0));
    assert_eq!(counted.secondary_hits, 4 * EYE_RAYS);
}

#[test]
fn what_lets_light_through_reflects_and_refracts_and_is_in_the_way_of_light() {
    let glass = format!("f 1 1 1 0 0 0 0.9 1.5\n{}{MATT}{}", square(1.0, 1.0, true), square(9.0, 0.0, true));
    let counted = tally(&glass, Facing::Outward);
    assert_eq!(counted.reflected, counted.refracted);
    assert!(counted.shadow_hits > 0, "the pane keeps the light from the floor below it");
}

#[test]
fn light_that_cannot_leave_glass_is_reflected_only() {
    // The face looks away from the camera, which is thus inside the glass.
    let slab = format!("f 1 1 1 0 0 0 0.9 1.5\n{}", square(50.0, 0.0, false));
    let counted = tally(&slab, Facing::Outward);
    assert_eq!((counted.reflected, counted.refracted), (EYE_RAYS, EYE_RAYS), "steep enough");
    let dense = slab.replace("1.5", "6");
    let counted = tally(&dense, Facing::Outward);
    assert!(counted.refracted < counted.reflected, "6 sin 11° is more than 1: {counted:?}");
}

#[test]
fn published_sums_are_those_of_their_parts() {
    for scene in &SCENES {
        for octree in scene.octrees.map(|o| o.cost) {
            assert_eq!(octree.n_v, 7 * octree.n_in + 1, "{}", scene.name);
        }
        for grid in &scene.grids {
            assert_eq!(grid.cells.iter().map(|&n| u64::from(n)).product::<u64>(), grid.cost.n_v, "{}", scene.name);
            assert_eq!(grid.cost.n_ts, grid.cost.n_ets, "{}", scene.name);
        }
        let rays = scene.rays;
        assert!(rays.primary == 513 * 513 && rays.primary_hits <= rays.primary, "{}", scene.name);
    }
}

fn measured() -> Measured {
    // The scene is none of the published ones, but it is measured in the same way.
    let balls = (0..40).map(|i| format!("s {} {} {} 0.2\n", i % 5 - 2, i / 5 % 4 - 2, i / 20));
    let text = format!("{MIRROR}{}{}", square(3.0, -1.0, true), balls.collect::<String>());
    let plan = Plan { tests: 40_000, seed: 0, pixels: PIXELS };
    measure(&SCENES[0], &scene(&text), 7, plan, &mut |_, _| true).expect("it has a camera")
}

#[test]
fn published_rules_give_the_same_hits_and_cells_that_add_up() {
    let measured = measured();
    assert_eq!(measured.rows.len(), 7);
    for row in &measured.rows {
        assert_eq!(row.differing, 0, "{:?}", row.setting);
        assert!(row.rays > 0 && row.ours.n_it > 0.0 && row.ours.n_ets > row.ours.n_eets, "{:?}", row.setting);
        match row.setting {
            Setting::Grid { .. } => assert_eq!((row.ours.n_v, row.ours.n_in), (row.theirs.n_v, 0)),
            Setting::Octree { .. } => assert_eq!(row.ours.n_v, 7 * row.ours.n_in + 1),
        }
    }
    // Tests of octrees are compared per hit, those of grids per ray.
    let octree = measured.rows.last().expect("seven");
    let rays_per_hit = measured.outward.rays() as f64 / measured.outward.hits() as f64;
    assert!((measured.comparable(octree).n_it / octree.ours.n_it - rays_per_hit).abs() < 1e-9);
    assert_eq!(measured.comparable(&measured.rows[0]), measured.rows[0].ours);
}

#[test]
fn octrees_over_the_tetrahedra_have_exactly_the_published_cells() {
    // The same 4096 faces as in tetra.nff, in another order.
    let scene = Family::Tetra.scene(4096);
    let mesh = &scene.meshes[0];
    let opaque = BitSet::filled(mesh.triangles.len(), true);
    let shapes =
        Shapes { vertices: mesh.positions.clone(), triangles: mesh.triangles.clone(), opaque, ..Shapes::default() };
    let tetra = SCENES.iter().find(|s| s.name == "tetra").expect("it is one of the eight");
    for (setting, theirs) in Setting::all(tetra).into_iter().filter(|(s, _)| s.is_octree()) {
        let made_of = AnyAccel::build(setting.kind(), &shapes, &setting.params(0.0)).summary();
        let ours = [made_of.n_in - 1, made_of.n_v, made_of.n_ev, made_of.n_oiv];
        assert_eq!(ours, [theirs.n_in, theirs.n_v, theirs.n_ev, theirs.n_oiv], "{setting:?}");
    }
}

#[test]
fn every_format_has_both_columns() {
    let report = Report { machine: Machine::here(), tests: 1, seed: 0, scenes: vec![measured()] };
    for format in [Format::Json, Format::Csv, Format::Markdown, Format::Html] {
        let text = report.write(format);
        let published = if format == Format::Json || format == Format::Csv { "1787" } else { "1 787" };
        assert!(text.contains(published) && text.contains("octree"), "{format:?}\n{text}");
    }
    let text: String = tables(&report.scenes[0]).iter().map(|t| t.text()).collect();
    assert!(text.contains("959 244") && text.contains("1999"), "{text}");
    // The objects differ from the published ones, and so do the primary hits.
    assert!(!report.is_right());
}
