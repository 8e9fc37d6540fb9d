//! Coarse meshes with vertex normals, which stand for round surfaces.

use super::*;
use crate::render::ray_tree::{Class, tell};

/// A ball of radius 1 about the y axis with this many faces around and from pole to pole, and its exact normals.
pub(super) fn ball(around: u32, down: u32) -> Mesh {
    let mut positions = Vec::new();
    for row in 0..=down {
        let (ring, y) = libm::sincosf(row as f32 / down as f32 * std::f32::consts::PI);
        positions.extend((0..around).map(|i| {
            let (sin, cos) = libm::sincosf(i as f32 / around as f32 * std::f32::consts::TAU);
            Vec3::new(ring * cos, y, ring * sin)
        }));
    }
    let corner = |row: u32, i: u32| row * around + i % around;
    let quads = (0..down).flat_map(|row| (0..around).map(move |i| (row, i)));
    let triangles = quads.flat_map(|(row, i)| {
        let [a, b, c, d] = [corner(row, i), corner(row, i + 1), corner(row + 1, i + 1), corner(row + 1, i)];
        [[a, b, c], [a, c, d]]
    });
    let triangles = triangles
        .filter(|[a, b, c]| {
            (positions[*a as usize] - positions[*b as usize]).length() > 1e-4
                && (positions[*b as usize] - positions[*c as usize]).length() > 1e-4
        })
        .collect();
    Mesh { normals: positions.clone(), positions, triangles, ..Mesh::default() }
}

fn matt() -> Material {
    material(Vec3::ONE, phong())
}

/// A view of the ball `mesh` from +z, lit by a sun.
fn lit_ball(mesh: Mesh, to_sun: DVec3) -> Stage {
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y, Lens::orthographic(2.0));
    s.settings.width = 48;
    s.settings.height = 48;
    s.mesh(mesh, DAffine3::IDENTITY, matt());
    sun(&mut s, to_sun);
    s
}

fn sun(s: &mut Stage, to_sun: DVec3) {
    let kind = LightKind::Directional { direction: -to_sun.normalize() };
    s.scene.lights = vec![Light {
        name: String::new(),
        intensity: Vec3::splat(std::f32::consts::PI),
        kind,
        shadows: true,
        size: 0.0,
    }];
}

/// Cosine between the sun and the interpolated normal of each pixel on the mesh, and the pixel's value.
fn cosines(s: &mut Stage, to_sun: DVec3) -> Vec<(f32, f32)> {
    s.settings.layers = true;
    let picture = s.render().picture;
    let layers = picture.layers.expect("layers were asked for");
    let sun = to_sun.normalize().as_vec3();
    let pixels = picture.beauty.iter().zip(&layers.normal).filter(|(color, _)| color[3] > 0.0);
    pixels.map(|(color, normal)| (Vec3::from(*normal).dot(sun).max(0.0), color[0])).collect()
}

#[test]
fn a_coarse_ball_is_lit_up_to_the_line_that_its_normals_tell() {
    for to_sun in [DVec3::new(1.0, 0.2, 0.1), DVec3::new(1.0, 1.0, 0.4), DVec3::new(-0.6, -1.0, -0.2)] {
        let pixels = cosines(&mut lit_ball(ball(12, 6), to_sun), to_sun);
        let dim = pixels.iter().filter(|(cosine, _)| *cosine > 0.0 && *cosine < 0.2).count();
        assert!(pixels.len() > 1000 && dim > 30, "{} pixels, {dim} near the line", pixels.len());
        for (cosine, shown) in pixels {
            assert!((cosine - shown).abs() < 1e-5, "{shown} where the cosine is {cosine}");
        }
    }
}

#[test]
fn a_ray_tree_has_the_rays_that_start_above_a_coarse_ball_and_knows_their_light() {
    let mut s = lit_ball(ball(12, 6), DVec3::new(1.0, 0.2, 0.1));
    (s.settings.width, s.settings.height) = (24, 24);
    let mut risers = 0;
    for pixel in (0..24).flat_map(|y| (0..24).map(move |x| (x, y))) {
        let told = s.with_job(AccelKind::DEFAULT, |job| tell(job, pixel, 0)).expect("there is such a pixel");
        let children: usize = told.queries.iter().map(|q| q.children.len()).sum();
        assert_eq!(children + 1, told.queries.len(), "{pixel:?}");
        let shadows = || told.queries.iter().filter(|q| q.class == Class::Shadow);
        assert!(shadows().all(|q| q.light == Some(0)), "{pixel:?}");
        let rising = shadows().filter(|q| q.riser).count();
        assert!(rising == 0 || shadows().count() == 2 * rising, "{pixel:?}");
        risers += rising;
    }
    assert!(risers > 20, "{risers}");
}

/// The ball, seen through the front of a one-sided mesh around it, each of whose faces is turned inwards.
fn ball_in_a_skin(skin: Mesh, scale: f64, to_sun: DVec3) -> Stage {
    let mut s = lit_ball(ball(12, 6), to_sun);
    let turned = skin.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let skin = Mesh { triangles: turned, normals: skin.normals.iter().map(|n| -*n).collect(), ..skin };
    let one_sided = Material { double_sided: false, ..matt() };
    s.mesh(skin, DAffine3::from_scale(DVec3::splat(scale)), one_sided);
    s
}

#[test]
fn a_skin_below_the_round_surface_keeps_the_light_out() {
    let to_sun = DVec3::new(1.0, 0.2, 0.1);
    for scale in [1.001, 1.01, 1.03, 1.2] {
        let picture = ball_in_a_skin(ball(12, 6), scale, to_sun).render().picture;
        let seen = picture.beauty.iter().filter(|color| color[3] > 0.0).count();
        let lit = picture.beauty.iter().filter(|color| color[0] > 0.0).count();
        assert!(seen > 1000 && lit == 0, "{lit} of {seen} points are lit under a skin of {scale}");
    }
}

#[test]
fn no_light_comes_into_a_closed_room_however_its_normals_lie() {
    let mut random = crate::math::random::Random::new(5);
    for wild in [false, true] {
        let mut room = ball(8, 5);
        if wild {
            room.normals = (0..room.positions.len()).map(|_| random.direction()).collect();
        }
        let mut s = stage(View::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, Lens::perspective(2.4)));
        s.settings.width = 40;
        s.settings.height = 40;
        s.mesh(room, DAffine3::IDENTITY, matt());
        for to_sun in [DVec3::X, DVec3::new(0.3, 0.8, -0.4), DVec3::new(0.1, -1.0, 1.0)] {
            sun(&mut s, to_sun);
            assert!(s.render().picture.beauty.iter().all(|color| *color == [0.0, 0.0, 0.0, 1.0]), "{to_sun}");
        }
    }
}

#[test]
fn a_flat_face_with_normals_of_its_own_is_lit_as_one_without() {
    for to_sun in [DVec3::new(1.0, 0.2, 0.3), DVec3::new(1.0, 0.0, 0.02)] {
        let mut flat = looking_down(5.0);
        flat.mesh(square(0.0, 2.0), DAffine3::from_rotation_y(0.3), matt());
        sun(&mut flat, to_sun);
        let without = flat.color();
        flat.scene.meshes[0].normals = vec![Vec3::Z; 4];
        assert_near(flat.color(), without, 1e-6);
        assert!(without.x > 0.0);
    }
}

#[test]
fn one_by_one_and_side_by_side_round_surfaces_get_the_same_light() {
    for to_sun in [DVec3::new(1.0, 0.2, 0.1), DVec3::new(0.2, -1.0, 0.4)] {
        let mut s = lit_ball(ball(12, 6), to_sun);
        s.mesh(ball(9, 4), DAffine3::from_translation(DVec3::new(1.2, 0.3, 0.4)), matt());
        s.lamp(DVec3::new(1.5, 2.0, 0.8), 1.0);
        let together = s.render().picture.beauty;
        s.settings.no_prune = true;
        assert!(together == s.render().picture.beauty, "{to_sun}");
    }
}
