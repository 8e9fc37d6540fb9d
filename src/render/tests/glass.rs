//! Refracted rays: directions, total internal reflection, nesting, dispersion.

use super::*;
use crate::math::Vec4;
use crate::render::context::Context;
use crate::render::media::Medium;
use crate::render::media::around_eye::media_around;
use crate::render::optics;
use crate::scene::{AlphaMode, Environment, MetalRough};

fn glass(ior: f32) -> Material {
    material(Vec3::ZERO, Phong { transmission: Vec3::ONE, ior, ..phong() })
}

/// A square that faces +z whose red is (x + half) / (2 half): its colour tells where it was hit.
fn ruler(z: f32, half: f32) -> Mesh {
    let red = |p: &Vec3| {
        Vec4::new((p.x + half) / (2.0 * half), (p.x + half) / (2.0 * half), (p.x + half) / (2.0 * half), 1.0)
    };
    let mesh = square(z, half);
    Mesh { colors: mesh.positions.iter().map(red).collect(), ..mesh }
}

/// Looks at the origin from `degrees` beside the z axis, towards +x.
fn aslant(degrees: f64) -> Stage {
    let a = degrees.to_radians();
    let eye = DVec3::new(-libm::sin(a), 0.0, libm::cos(a)) * 10.0;
    stage(View::look_at(eye, DVec3::ZERO, DVec3::Y, Lens::orthographic(1.0)))
}

#[test]
fn a_slab_leaves_the_direction_and_shifts_the_ray_by_the_textbook_amount() {
    let (degrees, thickness, ior) = (50.0f64, 0.75, 1.5);
    let mut s = aslant(degrees);
    s.square(0.0, 9.0, glass(1.5)).square(-0.75, 9.0, glass(1.5));
    // The lower face of the slab points down, so that it is left there.
    s.scene.meshes[1].triangles.iter_mut().for_each(|t| t.swap(0, 1));
    s.scene.meshes[1].material = 0;
    s.mesh(ruler(-2.0, 4.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
    let tangent = |sine: f64| sine / (1.0 - sine * sine).sqrt();
    let sine = libm::sin(degrees.to_radians());
    let x = thickness * tangent(sine / ior) + (2.0 - thickness) * tangent(sine);
    assert!((f64::from(s.color().x) - (x + 4.0) / 8.0).abs() < 1e-6);
}

#[test]
fn beyond_the_critical_angle_everything_is_reflected() {
    let critical = optics::critical_angle(1.5, 1.0).unwrap_or_default().to_degrees();
    // The eye is inside the glass that fills z > 0: its surface faces down.
    let inside = |degrees: f64| {
        let mut s = aslant(degrees);
        s.square(0.0, 9.0, glass(1.5));
        s.scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        s.plane(DVec3::Z, -3.0, unlit(Vec3::X)).plane(DVec3::Z, 20.0, unlit(Vec3::Y));
        s.color()
    };
    assert_eq!(inside(critical - 0.1), Vec3::X);
    assert_eq!(inside(critical + 0.1), Vec3::Y);
}

#[test]
fn fresnel_shares_light_between_both_branches() {
    let both = Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, ior: 1.5, fresnel: true, ..phong() };
    // Down to grazing angles.
    for degrees in [60.0f64, 89.0, 89.8] {
        let mut s = aslant(degrees);
        s.square(0.0, 9.0, material(Vec3::ZERO, both.clone()));
        s.plane(DVec3::Z, -3.0, unlit(Vec3::X)).plane(DVec3::Z, 20.0, unlit(Vec3::Y));
        let share = optics::fresnel_dielectric(libm::cos(degrees.to_radians()), 1.0, 1.5) as f32;
        assert_near(s.color(), Vec3::new(1.0 - share, share, 0.0), 1e-5);
        let counts = s.render().counts;
        assert_eq!((counts.primary.queries, counts.reflected.queries, counts.refracted.queries), (1, 1, 1));
    }
}

#[test]
fn a_glass_ball_gathers_light_at_its_focus() {
    // Paraxial rays through a ball of index 1.5 meet at 1.5 radii from its centre.
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(0.02, 0.0, 5.0), DVec3::new(0.02, 0.0, 0.0), DVec3::Y, Lens::orthographic(1e-6));
    s.sphere(DVec3::ZERO, 1.0, glass(1.5)).mesh(ruler(-1.5, 0.02), DAffine3::IDENTITY, unlit(Vec3::ONE));
    assert!((s.color().x - 0.5).abs() < 0.01, "{}", s.color().x);
    // Both surfaces refract: a ball with a single refraction would show the ruler elsewhere.
    assert_eq!(s.render().counts.refracted.queries, 2);
}

#[test]
fn an_air_bubble_in_glass_is_entered_and_left_with_the_indices_turned_round() {
    let mut s = aslant(30.0);
    // Glass of two faces with a slab of air in it; directions before and after agree whatever lies between.
    for (z, material, down) in [(0.0, 0, false), (-0.5, 1, false), (-1.0, 1, true), (-1.5, 0, true)] {
        s.square(z, 9.0, glass(if material == 0 { 1.5 } else { 1.0 }));
        let mesh = s.scene.meshes.len() - 1;
        s.scene.meshes[mesh].material = material;
        if down {
            s.scene.meshes[mesh].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        }
    }
    s.scene.materials[1] = glass(1.0);
    s.mesh(ruler(-2.0, 4.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
    let tangent = |sine: f64| sine / (1.0 - sine * sine).sqrt();
    let x = tangent(0.5) + tangent(0.5 / 1.5);
    assert!((f64::from(s.color().x) - (x + 4.0) / 8.0).abs() < 1e-6);
}

#[test]
fn thick_gltf_glass_bends_and_thin_glass_does_not() {
    let pane = |thick: bool| {
        let mut s = aslant(50.0);
        let m = MetalRough { transmission: 1.0, metallic: 0.0, roughness: 0.0, thick, ..MetalRough::default() };
        s.square(0.0, 9.0, Material { reflection: Reflection::MetalRough(m), ..Material::default() });
        s.mesh(ruler(-1.0, 4.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
        s.color().x
    };
    let sine = libm::sin(50f64.to_radians());
    let tangent = |sine: f64| sine / (1.0 - sine * sine).sqrt();
    let open = 1.0 - optics::fresnel_dielectric(libm::cos(50f64.to_radians()), 1.0, 1.5);
    assert!((f64::from(pane(true)) - open * (tangent(sine / 1.5) + 4.0) / 8.0).abs() < 1e-5);
    let schlick = 0.04 + 0.96 * libm::pow(1.0 - libm::cos(50f64.to_radians()), 5.0);
    assert!((f64::from(pane(false)) - (1.0 - schlick) * (tangent(sine) + 4.0) / 8.0).abs() < 1e-5);
}

#[test]
fn the_inside_of_a_volume_absorbs_light_by_the_length_of_the_way_through() {
    let absorption = Vec3::new(0.1, 0.5, 2.0);
    for (ior, degrees) in [(1.0, 0.0), (1.0, 40.0), (1.5, 40.0)] {
        let mut s = aslant(degrees);
        for z in [0.0, -2.0] {
            let m = MetalRough {
                transmission: 1.0,
                metallic: 0.0,
                roughness: 0.0,
                thick: true,
                ior,
                absorption,
                ..MetalRough::default()
            };
            s.square(z, 9.0, Material { reflection: Reflection::MetalRough(m), ..Material::default() });
        }
        // One volume with two faces; the lower one faces down.
        s.scene.meshes[1].material = s.scene.meshes[0].material;
        s.scene.meshes[1].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        s.square(-3.0, 90.0, unlit(Vec3::ONE));
        let (cos, sin) = (libm::cos(f64::to_radians(degrees)), libm::sin(f64::to_radians(degrees)));
        let sine = sin / f64::from(ior);
        let length = 2.0 / (1.0 - sine * sine).sqrt();
        let open = (1.0 - optics::fresnel_dielectric(cos, 1.0, f64::from(ior))).powi(2) as f32;
        let seen = s.color();
        for k in 0..3 {
            let expected = open * (-f64::from(absorption[k]) * length).exp() as f32;
            assert!(
                (seen[k] - expected).abs() < 2e-3 * expected.max(0.5),
                "{ior} at {degrees}: {seen}, {k}: {expected}"
            );
        }
    }
}

/// Clear glTF glass of this index, without reflections of its own where it is thin.
fn clear(ior: f32, thick: bool, absorption: Vec3) -> Material {
    let specular = if thick { 1.0 } else { 0.0 };
    let m = MetalRough {
        transmission: 1.0,
        metallic: 0.0,
        roughness: 0.0,
        thick,
        ior,
        specular,
        absorption,
        ..MetalRough::default()
    };
    Material { reflection: Reflection::MetalRough(m), ..Material::default() }
}

#[test]
fn a_pane_without_an_inside_within_a_volume_changes_nothing() {
    let absorption = Vec3::new(0.1, 0.5, 2.0);
    let seen = |pane: bool| {
        let mut s = aslant(40.0);
        s.square(0.0, 9.0, clear(1.5, true, absorption)).square(-2.0, 9.0, unlit(Vec3::ZERO));
        s.scene.meshes[1].material = 0;
        s.scene.meshes[1].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        s.mesh(ruler(-3.0, 4.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
        if pane {
            s.square(-1.0, 9.0, Material { double_sided: true, ..clear(1.5, false, Vec3::ZERO) });
        }
        s.color()
    };
    assert_near(seen(true), seen(false), 1e-6);
}

#[test]
fn an_eye_within_a_volume_sees_what_that_leaves_of_the_light() {
    let absorption = Vec3::new(0.1, 0.5, 2.0);
    for (ior, lens) in [(1.0, Lens::perspective(0.1)), (1.5, Lens::perspective(0.1)), (1.0, Lens::orthographic(0.1))] {
        let mut s = looking_down(0.0);
        s.view = View::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, lens);
        s.sphere(DVec3::ZERO, 1.5, clear(ior, true, absorption));
        s.sphere(DVec3::ZERO, 9.0, unlit(Vec3::ONE));
        let open = 1.0 - optics::fresnel_dielectric(1.0, f64::from(ior), 1.0) as f32;
        let left = (absorption * -1.5).exp();
        // Light reflected inside gets out in the end: each share attenuated over its longer path.
        let all = left * open / (Vec3::ONE - left * left * (1.0 - open));
        assert_near(s.color(), all, 1e-4);
        // A pane seen from behind is no volume.
        let mut s = looking_down(3.0);
        s.square(0.0, 9.0, clear(1.0, true, absorption));
        s.scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        s.square(-1.0, 9.0, unlit(Vec3::ONE));
        assert_near(s.color(), Vec3::ONE, 1e-6);
    }
}

#[test]
fn a_prism_splits_white_light_and_bends_blue_more() {
    let split = |dispersion: f32| {
        let mut s = aslant(60.0);
        let prism = Phong { transmission: Vec3::ONE, ior: 1.6, dispersion, ..phong() };
        s.square(0.0, 9.0, material(Vec3::ZERO, prism));
        s.mesh(ruler(-3.0, 9.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
        (s.color(), s.render().counts.refracted.queries)
    };
    let (color, rays) = split(0.0);
    assert!(color.x == color.z && rays == 1);
    let (color, rays) = split(0.5);
    // Blue is refracted more, so it hits the ruler nearer the middle.
    assert!(color.z < color.y && color.y < color.x && rays == 12, "{color} {rays}");
}

#[test]
fn a_white_scene_seen_through_a_prism_stays_white() {
    let mut s = aslant(30.0);
    let prism = Phong { transmission: Vec3::ONE, ior: 1.6, dispersion: 0.5, ..phong() };
    s.square(0.0, 9.0, material(Vec3::ZERO, prism));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    assert_near(s.color(), Vec3::ONE, 1e-5);
    // At each wavelength reflection and transmission sum to 1.
    let mirror =
        Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, fresnel: true, ior: 1.6, dispersion: 5.0, ..phong() };
    s.scene.materials[0] = material(Vec3::ZERO, mirror);
    assert_near(s.color(), Vec3::ONE, 1e-5);
}

#[test]
fn a_light_behind_frosted_phong_glass_shines_through() {
    let mut s = looking_down(5.0);
    let frosted = Phong { transmission: Vec3::splat(0.5), ior: 1.5, shininess: 4.0, ..phong() };
    s.square(0.0, 9.0, material(Vec3::ZERO, frosted)).lamp(DVec3::Z * -3.0, 0.8);
    assert_near(s.color(), Vec3::splat(0.4), 1e-5);
    s.scene.lights[0].kind = LightKind::Point { position: DVec3::new(3.0, 0.0, -3.0), falloff: Falloff::None };
    let beside = s.color().x;
    assert!(beside > 0.0 && beside < 0.4);
}

/// Light arrives refracted at the inside of a wall; straight on, it would be added at each of hundreds of reflections.
#[test]
fn a_lamp_is_seen_in_glass_from_outside_and_in_no_wall_from_inside() {
    let phong = Phong { specular: Vec3::ONE, shininess: 8.0, transmission: Vec3::ONE, ior: 1.5, ..phong() };
    let clear =
        MetalRough { transmission: 1.0, thick: true, metallic: 0.0, ior: 1.5, roughness: 0.3, ..MetalRough::default() };
    for glass in
        [material(Vec3::ZERO, phong), Material { reflection: Reflection::MetalRough(clear), ..Material::default() }]
    {
        let mut s = looking_down(5.0);
        s.square(0.0, 9.0, glass).lamp(DVec3::Z * 4.0, 20.0);
        s.settings.depth = Some(0);
        assert!(s.color().x > 0.05, "{:?}", s.color());
        // Now the eye faces the inside.
        s.scene.meshes[0].triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert_eq!(s.color(), Vec3::ZERO);
    }
}

/// S7 (stack of plates): every pane is entered and left, and the ray comes out shifted but not turned.
#[test]
fn a_hundred_plates_of_glass_shift_a_ray_and_leave_its_direction() {
    let (degrees, ior, step) = (50.0f64, 1.5f64, 1e-3);
    let sine = libm::sin(degrees.to_radians());
    let tangent = |sine: f64| sine / (1.0 - sine * sine).sqrt();
    let at_wall = |wall: f32| {
        let mut s = aslant(degrees);
        // A plate from each even height to the odd one below it.
        for interface in 0..200u16 {
            s.square(-f32::from(interface) * step as f32, 9.0, glass(ior as f32));
            if interface % 2 == 1 {
                s.scene.meshes[usize::from(interface)].triangles.iter_mut().for_each(|t| t.swap(0, 1));
            }
            s.scene.meshes[usize::from(interface)].material = 0;
        }
        s.mesh(ruler(wall, 16.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
        s.settings.depth = Some(200);
        assert_eq!(s.render().counts.refracted.queries, 200);
        f64::from(s.color().x) * 32.0 - 16.0
    };
    let expected = |wall: f64| 0.1 * tangent(sine / ior) + (wall - 0.1) * tangent(sine);
    let (near, far) = (at_wall(-1.0), at_wall(-9.0));
    // Colours resolve positions to 2⁻²⁴ of 32.
    assert!((near - expected(1.0)).abs() < 1e-5, "{near} for {}", expected(1.0));
    let ulp = f64::from(f32::EPSILON);
    assert!((far - near - 8.0 * tangent(sine)).abs() < 200.0 * ulp * 8.0, "{far} {near}");
}

/// Where a ray 0.3 beside the centre of concentric spheres, (radius, index) from the outermost on, hits a plane 6 below it: the
/// position found and the expected one, and the number of refracted rays.
fn through_spheres(spheres: &[(f64, f32)]) -> (f64, f64, u64) {
    let impact = 0.3f64;
    let mut s = looking_down(5.0);
    let (eye, at) = (DVec3::new(impact, 0.0, 5.0), DVec3::new(impact, 0.0, 0.0));
    s.view = View::look_at(eye, at, DVec3::Y, Lens::orthographic(1e-6));
    for &(radius, ior) in spheres {
        s.sphere(DVec3::ZERO, radius, glass(ior));
    }
    s.settings.depth = Some(64);
    s.mesh(ruler(-6.0, 8.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
    // n r sin θ is constant along a path through concentric spheres (P. Bouguer, 1729).
    let angle = |n: f32, r: f64| libm::asin(impact / (f64::from(n) * r));
    let outside = std::iter::once(1.0).chain(spheres.iter().map(|&(_, ior)| ior));
    let turned = |(n, &(r, ior)): (f32, &(f64, f32))| 2.0 * (angle(n, r) - angle(ior, r));
    let turned: f64 = outside.zip(spheres).map(turned).sum();
    // The path is symmetric: it comes out at distance `impact` from the line through the centre turned by that angle.
    let x = (impact - 6.0 * libm::sin(turned)) / libm::cos(turned);
    (f64::from(s.color().x) * 16.0 - 8.0, x, s.render().counts.refracted.queries)
}

/// S12 (nesting): each boundary has the indices of its two sides, however deep it lies.
#[test]
fn bodies_within_bodies_bend_as_snells_law_says_at_every_boundary() {
    // Water in a glass shell in air; and a dozen nested bodies, of alternating indices and of one index.
    let spheres = |ior: [f32; 2]| (0..12).map(move |i| (2.0 - 0.1 * f64::from(i), ior[i as usize % 2]));
    let water = vec![(2.0, 1.5), (1.0, 1.33)];
    for spheres in [water, spheres([1.5, 1.1]).collect(), spheres([1.3, 1.3]).collect()] {
        let (found, x, refracted) = through_spheres(&spheres);
        assert!((found - x).abs() < 1e-4, "{found} for {x}: {spheres:?}");
        assert_eq!(refracted, 2 * spheres.len() as u64);
    }
}

/// S15 (furnace): reflection and transmission of smooth glass and mirrors sum to the light that arrives.
#[test]
fn glass_and_mirrors_in_an_evenly_bright_room_cannot_be_seen() {
    let both = Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, ior: 1.5, fresnel: true, ..phong() };
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(0.3, 0.1, 5.0), DVec3::new(0.3, 0.1, 0.0), DVec3::Y, Lens::orthographic(3.0));
    s.sphere(DVec3::ZERO, 1.0, material(Vec3::ZERO, both));
    s.sphere(DVec3::new(1.2, 0.5, -2.0), 0.8, material(Vec3::ZERO, Phong { mirror: Vec3::ONE, ..phong() }));
    s.scene.environment = Environment::Constant(Vec3::ONE);
    let depth = 64;
    s.settings = Settings { depth: Some(depth), width: 16, height: 16, ..s.settings };
    let rendered = s.render();
    assert!(rendered.counts.refracted.queries > 500);
    let seen: Vec<_> = rendered.picture.beauty.iter().filter(|p| p[3] > 0.0).collect();
    assert!(seen.len() > 100);
    for pixel in seen {
        // Light still inside after so many bounces, at grazing hits of the ball, is lost.
        assert_near(Vec3::from_slice(pixel), Vec3::ONE, 1e-6 * depth as f32);
    }
}

#[test]
fn glass_that_mirrors_and_passes_all_light_at_once_has_no_endless_tree_of_rays() {
    let all = Phong { transmission: Vec3::ONE, mirror: Vec3::splat(0.9), ior: 1.5, ..phong() };
    let mut s = looking_down(5.0);
    s.view = View::look_at(DVec3::new(0.3, 0.1, 5.0), DVec3::new(0.3, 0.1, 0.0), DVec3::Y, Lens::orthographic(2.0));
    for i in 0..8 {
        let corner = |k: i32| f64::from(i >> k & 1) * 2.1 - 1.05;
        s.sphere(DVec3::new(corner(0), corner(1), corner(2)), 1.0, material(Vec3::ZERO, all.clone()));
    }
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.settings = Settings { depth: Some(256), cutoff: 1.0 / 512.0, width: 4, height: 4, ..s.settings };
    let rendered = s.render();
    let rays = rendered.counts.refracted.queries + rendered.counts.reflected.queries;
    assert!(rays > 1000 && rays < 100_000, "{rays}");
    // The ends of branches lose some light.
    let seen: Vec<_> = rendered.picture.beauty.iter().filter(|p| p[3] > 0.0).map(|p| p[0]).collect();
    assert!(seen.len() > 8 && seen.iter().all(|light| (0.5..1.0 + 1e-5).contains(light)), "{seen:?}");
}

/// A square of glass whose inside lies above it: it is left there.
fn lower(s: &mut Stage, z: f32, material: u32) {
    s.square(z, 9.0, Material::default());
    if let Some(mesh) = s.scene.meshes.last_mut() {
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        mesh.material = material;
    }
}

#[test]
fn what_touches_glass_from_behind_is_seen_whichever_comes_first_in_the_file() {
    for glass_first in [true, false] {
        let mut s = aslant(30.0);
        let (slab, table) = (glass(1.5), unlit(Vec3::new(1.0, 0.5, 0.25)));
        if !glass_first {
            s.square(-1.0, 9.0, table.clone());
        }
        s.square(0.0, 9.0, slab);
        let material = s.scene.materials.len() as u32 - 1;
        lower(&mut s, -1.0, material);
        if glass_first {
            s.square(-1.0, 9.0, table);
        }
        assert_eq!(s.color(), Vec3::new(1.0, 0.5, 0.25), "glass first: {glass_first}");
        assert_eq!(s.render_by(AccelKind::DEFAULT).picture, s.render().picture);
    }
}

#[test]
fn a_table_under_a_glass_is_seen_all_over_a_picture_by_points_and_by_batches_of_them() {
    let mut s = stage(View::look_at(DVec3::new(1.0, -4.0, 6.0), DVec3::ZERO, DVec3::Y, Lens::perspective(0.3)));
    (s.settings.width, s.settings.height) = (24, 16);
    let slab = s.add_material(glass(1.5));
    for (at, is_top) in [(0.0, true), (-1.0, false)] {
        if is_top {
            s.square(at, 9.0, Material::default()).scene.meshes[0].material = slab
        } else {
            lower(&mut s, at, slab)
        }
    }
    s.square(-1.0, 9.0, unlit(Vec3::new(1.0, 0.5, 0.25)));
    let picture = s.render().picture;
    assert!(picture.beauty.iter().all(|pixel| *pixel == [1.0, 0.5, 0.25, 1.0]), "{:?}", picture.beauty);
    assert_eq!(s.render_by(AccelKind::DEFAULT).picture, picture);
}

#[test]
fn a_hole_in_the_place_of_other_surfaces_changes_nothing_of_what_is_seen_of_them() {
    let absent = || Material { opacity: 0.4, alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..unlit(Vec3::Y) };
    let below = |s: &mut Stage, top: f32, material: u32| {
        s.square(top, 9.0, Material::default()).scene.meshes.last_mut().unwrap().material = material;
        lower(s, top - 1.0, material);
    };
    let painted = |with_hole: bool| {
        let mut s = aslant(30.0);
        s.square(0.0, 9.0, Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..unlit(Vec3::X) });
        if with_hole {
            s.square(0.0, 9.0, absent());
        }
        let slab = s.add_material(glass(1.5));
        below(&mut s, 0.0, slab);
        s.square(-3.0, 9.0, unlit(Vec3::Z)).color()
    };
    assert_eq!((painted(false), painted(true)), (Vec3::new(0.5, 0.0, 0.5), Vec3::new(0.5, 0.0, 0.5)));
    // Water on glass, and holes where they meet, and in the water.
    let layered = |holes: &[f32]| {
        let mut s = aslant(30.0);
        let water = s.add_material(clear(1.33, true, Vec3::new(0.1, 0.5, 1.0)));
        below(&mut s, 1.0, water);
        for &hole in holes {
            s.square(hole, 9.0, absent());
        }
        let slab = s.add_material(clear(1.5, true, Vec3::ZERO));
        below(&mut s, 0.0, slab);
        s.square(-3.0, 9.0, unlit(Vec3::ONE)).color()
    };
    let seen = layered(&[]);
    assert!(seen.x > seen.y && seen.y > seen.z && seen.z > 0.1, "{seen}");
    for holes in [&[0.0][..], &[0.3], &[0.7, 0.0, 0.2]] {
        assert_eq!(layered(holes), seen, "{holes:?}");
    }
}

#[test]
fn what_is_painted_on_glass_is_seen_once_whichever_comes_first_in_the_file() {
    for (label_first, apart) in [(true, 0.0), (false, 0.0), (true, 0.01)] {
        let mut s = aslant(30.0);
        let label = Material { opacity: 0.5, alpha_mode: AlphaMode::Blend, ..unlit(Vec3::X) };
        if label_first {
            s.square(apart, 9.0, label.clone());
        }
        s.square(0.0, 9.0, glass(1.5));
        let slab = s.scene.materials.len() as u32 - 1;
        lower(&mut s, -1.0, slab);
        if !label_first {
            s.square(apart, 9.0, label);
        }
        s.square(-3.0, 9.0, unlit(Vec3::Z));
        assert_eq!(s.color(), Vec3::new(0.5, 0.0, 0.5), "label first: {label_first}, {apart} apart");
    }
}

#[test]
fn slabs_that_touch_bend_light_as_if_a_hair_were_between_them() {
    let tangent = |sine: f64| sine / (1.0 - sine * sine).sqrt();
    let sine = libm::sin(40f64.to_radians());
    for (upper_first, indices) in [(true, [1.5, 2.0]), (false, [1.5, 2.0]), (true, [1.5, 1.5]), (false, [1.5, 1.5])] {
        let mut s = aslant(40.0);
        let [upper, below] = indices.map(|ior| s.add_material(glass(ior)));
        // One material for both where they are alike.
        let below = if indices[0] == indices[1] { upper } else { below };
        let slabs = [(0.0, -0.5, upper), (-0.5, -1.25, below)];
        for k in if upper_first { [0, 1] } else { [1, 0] } {
            let (top, bottom, material) = slabs[k];
            s.square(top, 9.0, Material::default());
            s.scene.meshes.last_mut().unwrap().material = material;
            lower(&mut s, bottom, material);
        }
        s.mesh(ruler(-2.0, 4.0), DAffine3::IDENTITY, unlit(Vec3::ONE));
        let [n, m] = indices.map(f64::from);
        let x = 0.5 * tangent(sine / n) + 0.75 * tangent(sine / m) + 0.75 * tangent(sine);
        let seen = f64::from(s.color().x);
        assert!((seen - (x + 4.0) / 8.0).abs() < 2e-6, "{seen}, upper first: {upper_first}, {indices:?}");
    }
}

#[test]
fn an_eye_within_bodies_of_one_material_leaves_each_of_them() {
    // A ball in another one: the eye leaves the inner wall within glass, and the outer one into the open.
    let both = Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, ior: 1.5, fresnel: true, ..phong() };
    let mut s = looking_down(0.0);
    s.view = View::look_at(DVec3::new(0.1, 0.2, 0.0), DVec3::new(0.1, 0.2, -1.0), DVec3::Y, Lens::orthographic(1e-3));
    for radius in [2.0, 1.0] {
        s.sphere(DVec3::ZERO, radius, material(Vec3::ZERO, both.clone()));
        s.scene.spheres.last_mut().unwrap().material = 0;
    }
    s.scene.environment = Environment::Constant(Vec3::ONE);
    s.settings.cutoff = 0.1;
    let counts = s.render().counts;
    // Straight through the inner wall, and a little is reflected at the outer one.
    assert_eq!((counts.primary.queries, counts.reflected.queries, counts.refracted.queries), (1, 0, 2));
    assert!((s.color().x - 0.96).abs() < 2e-3, "{}", s.color().x);
}

/// A cube of two triangles a side, wound outwards.
fn cube(half: f32) -> Mesh {
    let corner = |i: u32| Vec3::from([0, 1, 2].map(|axis| if i >> axis & 1 == 1 { half } else { -half }));
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

#[test]
fn walls_that_are_met_on_their_edges_and_corners_are_left_once() {
    // Some directions hit the diagonals of sides, and some the corners of the cubes.
    let mut s = looking_down(0.0);
    s.view = View::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, Lens::orthographic(1.0));
    let around = |s: &Stage| {
        s.with_job(AccelKind::DEFAULT, |job| {
            let context = Context::new(job.scene, job.world, job.textures, job.settings);
            media_around(&context, job.accel, job.view)
        })
    };
    for count in 1..4 {
        s.mesh(cube(1.0 + count as f32), DAffine3::IDENTITY, glass(1.5)).scene.meshes[count - 1].material = 0;
        assert_eq!(around(&s), vec![Medium { material: 0, ior: 1.5 }; count]);
    }
}

#[test]
fn an_eye_in_glass_behind_more_walls_than_are_looked_through_is_still_in_it() {
    let mut s = looking_down(10.0);
    let both = Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, ior: 1.8, fresnel: true, ..phong() };
    s.square(0.0, 9.0, material(Vec3::ZERO, both)).square(-3.0, 99.0, unlit(Vec3::X));
    s.sphere(DVec3::ZERO, 100.0, glass(1.33));
    // Behind the visible square.
    for i in 0..1100 {
        s.square(-4.0 - 0.01 * f64::from(i) as f32, 1.0, unlit(Vec3::Y));
    }
    let share = 1.0 - optics::fresnel_dielectric(1.0, 1.33, 1.8) as f32;
    assert_near(s.color(), Vec3::X * share, 1e-6);
}

#[test]
fn an_eye_in_clear_water_sees_by_its_index() {
    let both = |ior| Phong { transmission: Vec3::ONE, mirror: Vec3::ONE, ior, fresnel: true, ..phong() };
    let mut s = looking_down(10.0);
    s.square(0.0, 9.0, material(Vec3::ZERO, both(1.8))).square(-3.0, 99.0, unlit(Vec3::X));
    let share = |outside| 1.0 - optics::fresnel_dielectric(1.0, outside, 1.8) as f32;
    assert_near(s.color(), Vec3::X * share(1.0), 1e-6);
    s.sphere(DVec3::ZERO, 100.0, glass(1.33));
    assert_near(s.color(), Vec3::X * share(1.33), 1e-6);
}
