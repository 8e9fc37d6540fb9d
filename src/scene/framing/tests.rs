use super::*;
use crate::math::{DAffine3, Vec3};
use crate::render::View;
use crate::scene::{Instance, Mesh, Sphere};

/// A scene of one mesh with the given triangles.
fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Scene {
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let instance = Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY };
    Scene { meshes: vec![mesh], instances: vec![instance], ..Scene::default() }
}

/// A box from `lo` to `hi`, with every side cut into `n × n` squares.
fn block(lo: Vec3, hi: Vec3, n: u32) -> Scene {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for axis in 0..3 {
        for end in [0.0, 1.0] {
            let base = positions.len() as u32;
            for i in 0..=n {
                for j in 0..=n {
                    let mut t = Vec3::splat(end);
                    (t[(axis + 1) % 3], t[(axis + 2) % 3]) = (i as f32 / n as f32, j as f32 / n as f32);
                    positions.push(lo + (hi - lo) * t);
                }
            }
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let at = |i: u32, j: u32| base + i * (n + 1) + j;
                let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
                let faces = if end == 1.0 { [[a, b, c], [a, c, d]] } else { [[c, b, a], [d, c, a]] };
                triangles.extend(faces);
            }
        }
    }
    mesh(positions, triangles)
}

/// Adds a small triangle at `place` to `scene`.
fn with_triangle(mut scene: Scene, place: Vec3, size: f32) -> Scene {
    let mesh = &mut scene.meshes[0];
    let base = mesh.positions.len() as u32;
    mesh.positions.extend([place, place + Vec3::X * size, place + Vec3::Y * size]);
    mesh.triangles.push([base, base + 1, base + 2]);
    scene
}

/// Projection of the outermost points of the model: least and greatest x and y, in half picture heights.
fn seen(scene: &Scene, camera: &Camera) -> (DVec3, DVec3) {
    let view = View::from_camera(camera);
    let points = scene.meshes[0].positions.iter().map(|p| view.project(p.as_dvec3()));
    points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
}

const PINHOLE: FrameLens = FrameLens::Perspective { y_fov: DEFAULT_FOV };

#[test]
fn a_far_triangle_is_a_stray_and_a_long_antenna_is_not() {
    let block = || block(Vec3::ZERO, Vec3::ONE, 8);
    let clean = robust_bounds(&block());
    assert_eq!((clean.lo, clean.hi, clean.strays), (DVec3::ZERO, DVec3::ONE, 0));

    for place in [Vec3::splat(3.0), Vec3::new(0.0, -1e6, 0.0), Vec3::new(1e30, 5.0, -1e20)] {
        let bounds = robust_bounds(&with_triangle(block(), place, 0.01));
        assert_eq!((bounds.lo, bounds.hi, bounds.strays), (DVec3::ZERO, DVec3::ONE, 1), "{place}");
        assert!(bounds.whole.0 != bounds.lo || bounds.whole.1 != bounds.hi);
    }

    // A thin triangle that starts on the block and ends far above.
    let mut antenna = with_triangle(block(), Vec3::new(0.5, 1.0, 0.5), 0.01);
    antenna.meshes[0].positions.last_mut().into_iter().for_each(|tip| tip.y = 9.0);
    let bounds = robust_bounds(&antenna);
    assert_eq!((bounds.hi.y, bounds.strays), (9.0, 0));
}

#[test]
fn two_equal_things_far_apart_are_both_the_model() {
    let mut scene = block(Vec3::ZERO, Vec3::ONE, 2);
    let mut other = scene.instances[0].clone();
    other.world_from_object = DAffine3::from_translation(DVec3::X * 100.0);
    scene.instances.push(other);
    assert_eq!(robust_bounds(&scene).hi.x, 101.0);
}

#[test]
fn strays_at_several_places_all_come_off() {
    let mut scene = block(Vec3::ZERO, Vec3::ONE, 16);
    for place in [Vec3::X * 2.0, Vec3::X * 50.0, Vec3::X * -7e5, Vec3::Z * 1e9, Vec3::splat(4.0)] {
        scene = with_triangle(scene, place, 0.01);
    }
    let bounds = robust_bounds(&scene);
    assert_eq!((bounds.lo, bounds.hi, bounds.strays), (DVec3::ZERO, DVec3::ONE, 5));
}

#[test]
fn nothing_to_see_still_has_finite_bounds_and_a_camera() {
    let point = Sphere { name: String::new(), center: DVec3::ONE, radius: 0.0, material: 0 };
    for scene in [Scene::default(), Scene { spheres: vec![point], ..Scene::default() }] {
        let bounds = robust_bounds(&scene);
        for lens in [PINHOLE, FrameLens::Orthographic] {
            let camera = frame(&scene, &bounds, NamedView::Iso.direction(UpAxis::Y), lens, f64::NAN);
            let ray = View::from_camera(&camera).primary(3.0, 5.0, 10, 10);
            assert!(ray.origin.is_finite() && ray.dir.is_finite());
        }
    }
}

#[test]
fn the_model_touches_the_border_on_two_sides_and_stays_inside_the_others() {
    let scene = block(Vec3::new(-3.0, 0.0, 2.0), Vec3::new(1.0, 1.5, 2.7), 2);
    let bounds = robust_bounds(&scene);
    let directions = NamedView::ALL.map(|view| view.direction(UpAxis::Y));
    for direction in directions.into_iter().chain([default_direction(&scene, &bounds)]) {
        for (lens, aspect) in [(PINHOLE, 4.0 / 3.0), (PINHOLE, 0.5), (FrameLens::Orthographic, 2.0)] {
            let (lo, hi) = seen(&scene, &frame(&scene, &bounds, direction, lens, aspect));
            let fill = (hi.x / aspect).max(-lo.x / aspect).max(hi.y).max(-lo.y);
            assert!((fill - 0.92).abs() < 1e-9, "{direction:?} {lens:?}: {fill}");
            // The fuller axis is centred exactly.
            let lopsided = if (hi.x - lo.x) / aspect > hi.y - lo.y { (hi.x + lo.x) / aspect } else { hi.y + lo.y };
            assert!(lopsided.abs() < 1e-9, "{direction:?} {lens:?}: {lopsided}");
        }
    }
}

#[test]
fn a_framed_ball_is_seen_whole_and_no_smaller_than_it_must() {
    let ball = Sphere { name: String::new(), center: DVec3::new(5.0, 1.0, 0.0), radius: 2.0, material: 0 };
    let scene = Scene { spheres: vec![ball], ..Scene::default() };
    let bounds = robust_bounds(&scene);
    let camera = frame(&scene, &bounds, NamedView::Right.direction(UpAxis::Y), PINHOLE, 1.0);
    let view = View::from_camera(&camera);
    // The outline of a ball at distance d appears at an angle of asin(r / d).
    let outline = (2.0 / (view.eye - DVec3::new(5.0, 1.0, 0.0)).length()).asin().tan() / (DEFAULT_FOV / 2.0).tan();
    assert!((outline - 0.92).abs() < 1e-9, "{outline}");
}

#[test]
fn a_model_stays_inside_while_the_camera_goes_around_it() {
    let scene = block(Vec3::new(-3.0, -0.5, -0.2), Vec3::new(5.0, 1.0, 0.3), 3);
    for up in [UpAxis::Y, UpAxis::Z] {
        let scene = Scene { up, ..scene.clone() };
        let bounds = robust_bounds(&scene);
        for lens in [FrameLens::Perspective { y_fov: 0.7 }, FrameLens::Orthographic] {
            let first = frame_around(&scene, &bounds, default_direction(&scene, &bounds), lens, 1.5);
            let mut widest = 0.0f64;
            for turn in 0..36 {
                let angle = f64::from(turn) * std::f64::consts::TAU / 36.0;
                let (lo, hi) = seen(&scene, &turned(&first, up, bounds.center(), angle));
                let reach = (hi.x / 1.5).max(-lo.x / 1.5).max(hi.y).max(-lo.y);
                assert!(reach < 0.9201, "{up:?} {lens:?} {turn}: {reach}");
                widest = widest.max(reach);
            }
            assert!(widest > 0.85, "{up:?} {lens:?}: {widest}");
        }
    }
}

#[test]
fn one_camera_for_several_scenes_sees_all_of_each_and_steps_back_no_further() {
    let scenes = [(0.0, 1.0), (2.0, 3.5)].map(|(lo, hi)| block(Vec3::splat(lo), Vec3::splat(hi), 2));
    let bounds = scenes.each_ref().map(robust_bounds);
    let direction = NamedView::Front.direction(UpAxis::Y);
    let mut fit = Fit::new(direction, bounds[0].center(), FrameLens::Perspective { y_fov: 0.5 }, 1.0);
    scenes.iter().zip(&bounds).for_each(|(scene, bounds)| fit.add(scene, bounds));
    let camera = fit.camera(bounds[0].union(&bounds[1]).radius());
    let seen = scenes.map(|scene| seen(&scene, &camera));
    let (lo, hi) = (seen[0].0.min(seen[1].0), seen[0].1.max(seen[1].1));
    assert!((lo.x + 0.92).abs() < 1e-6 && (hi.x - 0.92).abs() < 1e-6, "{lo} {hi}");
}

#[test]
fn named_views_look_at_the_side_they_name() {
    for (view, from, top) in [
        (NamedView::Front, DVec3::Z, DVec3::Y),
        (NamedView::Left, DVec3::NEG_X, DVec3::Y),
        (NamedView::Top, DVec3::Y, DVec3::NEG_Z),
    ] {
        assert_eq!(view.direction(UpAxis::Y), Direction { from, up: top });
    }
    // Z-up programs have the front of models at −y.
    assert_eq!(NamedView::Front.direction(UpAxis::Z), Direction { from: DVec3::NEG_Y, up: DVec3::Z });
    assert_eq!(NamedView::Top.direction(UpAxis::Z), Direction { from: DVec3::Z, up: DVec3::Y });
    for view in NamedView::ALL {
        assert_eq!(view.name().parse(), Ok(view));
    }
    assert!("side".parse::<NamedView>().is_err());
}

#[test]
fn a_card_is_looked_at_face_on_from_the_side_it_faces() {
    let card = |triangle: [u32; 3]| {
        mesh(vec![Vec3::ZERO, Vec3::X, Vec3::ONE - Vec3::Z, Vec3::Y], vec![triangle, triangle.map(|i| (i + 2) % 4)])
    };
    let from = |scene: &Scene| default_direction(scene, &robust_bounds(scene)).from;
    assert!((from(&card([0, 1, 2])) - DVec3::Z).length() < 1e-12);
    assert!((from(&card([2, 1, 0])) - DVec3::NEG_Z).length() < 1e-12);
    // Mirrored cards keep their front, scaled evenly or not.
    for scale in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(-1.0, 1.5, 1.0)] {
        let mut mirrored = card([0, 1, 2]);
        mirrored.instances[0].world_from_object = DAffine3::from_scale(scale);
        assert!((from(&mirrored) - DVec3::Z).length() < 1e-12, "{scale}");
    }

    // A floor that faces down, and a bent panel that faces left, thicker than a card.
    let bent = |turned: bool| {
        let corner =
            |i: u32| Vec3::new([0.0, 0.2, 0.0][i as usize / 2], (i % 2) as f32, [0.0, 0.5, 1.0][i as usize / 2]);
        let faces = [[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]];
        let faces = faces.map(|[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] });
        (0..6).map(corner).collect::<Vec<_>>().into_iter().fold(mesh(Vec::new(), faces.to_vec()), |mut scene, p| {
            scene.meshes[0].positions.push(p);
            scene
        })
    };
    assert!(from(&bent(false)).x * from(&bent(true)).x < 0.0, "each from the side that it faces");
    let floor = |faces: [u32; 3]| {
        let corners = vec![Vec3::ZERO, Vec3::X * 2.0, Vec3::new(2.0, 0.0, 2.0), Vec3::Z * 2.0];
        mesh(corners, vec![faces, faces.map(|i| (i + 2) % 4)])
    };
    assert!(from(&floor([2, 1, 0])).y > 0.5 && from(&floor([0, 1, 2])).y < -0.5);

    let cube = from(&block(Vec3::ZERO, Vec3::ONE, 2));
    assert!(cube.x > 0.2 && cube.y > 0.2 && cube.z > 0.7, "{cube}");
    let floor = from(&block(Vec3::ZERO, Vec3::new(4.0, 0.1, 3.0), 2));
    assert!(floor.y > 0.5 && floor.z > 0.5, "{floor}");
}

#[test]
fn a_crowd_is_framed_as_closely_as_if_each_corner_had_been_looked_at() {
    let mut crowd = block(Vec3::ZERO, Vec3::new(1.0, 2.0, 0.5), 6);
    let placed = |i: u32| {
        let t = f64::from(i);
        let place = DVec3::new(f64::from(i % 7) * 3.0, t * 0.01, f64::from(i % 11) * 3.0);
        let world_from_object = DAffine3::from_translation(place) * DAffine3::from_rotation_y(t);
        Instance { name: String::new(), mesh: 0, world_from_object }
    };
    crowd.instances = (0..300).map(placed).collect();
    // The same as a single mesh, every corner of which is examined.
    let mut melted = mesh(Vec::new(), Vec::new());
    for instance in &crowd.instances {
        let base = melted.meshes[0].positions.len() as u32;
        let places = crowd.meshes[0].positions.iter();
        let places = places.map(|p| instance.world_from_object.transform_point3(p.as_dvec3()).as_vec3());
        melted.meshes[0].positions.extend(places);
        melted.meshes[0].triangles.extend(crowd.meshes[0].triangles.iter().map(|t| t.map(|i| i + base)));
    }
    let bounds = robust_bounds(&crowd);
    let direction = default_direction(&crowd, &bounds);
    for lens in [PINHOLE, FrameLens::Orthographic] {
        for way in [frame, frame_around] {
            let camera = way(&crowd, &bounds, direction, lens, 1.5);
            // Corners of the second were rounded to f32, and must not fall out of the box.
            let room = Bounds { lo: bounds.lo - 1e-3, hi: bounds.hi + 1e-3, ..bounds };
            let other = way(&melted, &room, direction, lens, 1.5);
            let (a, b) = (camera.world_from_camera.translation, other.world_from_camera.translation);
            assert!(a.distance(b) < 1e-4 * bounds.radius(), "{a} {b}");
        }
    }
}

#[test]
fn a_scene_that_faces_back_is_seen_as_one_that_was_turned_to_the_front() {
    let turned = |v: DVec3| DVec3::new(-v.x, v.y, -v.z);
    for size in
        [Vec3::new(1.0, 2.0, 0.5), Vec3::new(0.1, 2.0, 1.0), Vec3::new(1.0, 0.1, 2.0), Vec3::new(1.0, 2.0, 0.02)]
    {
        let front = block(-size, size, 2);
        let mut back = front.clone();
        back.faces_back = true;
        back.meshes[0].positions.iter_mut().for_each(|p| *p = turned(p.as_dvec3()).as_vec3());
        let bounds = robust_bounds(&front);
        let seen = |scene| [default_direction(scene, &bounds), named_direction(scene, NamedView::Top)];
        for (front, back) in seen(&front).into_iter().zip(seen(&back)) {
            assert!(back.from.distance(turned(front.from)) < 1e-12, "{size}: {front:?} {back:?}");
            assert!(back.up.distance(turned(front.up)) < 1e-12, "{size}: {front:?} {back:?}");
        }
    }
    let mut upright_z = block(Vec3::ZERO, Vec3::ONE, 1);
    (upright_z.up, upright_z.faces_back) = (UpAxis::Z, true);
    assert_eq!(named_direction(&upright_z, NamedView::Front).from, DVec3::Y);
}
