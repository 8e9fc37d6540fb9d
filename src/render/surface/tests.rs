use super::*;
use crate::math::{DAffine3, DVec3, Vec2, Vec4};
use crate::render::patch::Coordinates;
use crate::scene::{
    Bitmap, Instance, MetalRough, Pixels, Polygon, Reflection, Sampler, TexCoords, Texture, UvTransform,
};

/// A unit square in z = 0 that faces +z: u runs along x, v down along −y; texture 0 covers it.
fn scene(texels: Vec<[u8; 4]>, width: u32) -> Scene {
    let v = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let uv = |u: f32, v: f32| Vec2::new(u, v);
    let mesh = Mesh {
        positions: vec![v(0.0, 0.0), v(1.0, 0.0), v(1.0, 1.0), v(0.0, 1.0)],
        uvs: vec![vec![uv(0.0, 1.0), uv(1.0, 1.0), uv(1.0, 0.0), uv(0.0, 0.0)]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let height = texels.len() as u32 / width;
    Scene {
        meshes: vec![mesh],
        instances: vec![Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY }],
        materials: vec![Material::plain()],
        bitmaps: vec![Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels.into()) }],
        textures: vec![Texture { bitmap: 0, sampler: Sampler::default() }],
        ..Scene::default()
    }
}

fn map() -> TextureRef {
    TextureRef { texture: 0, uv_set: 0, transform: UvTransform::default() }
}

/// The surface seen from +z (or −z) at (0.5, 0.25), or wherever the instance has moved that point.
fn seen<T>(scene: &Scene, from: f32, look: impl FnOnce(Surface, &TextureStore) -> T) -> T {
    use crate::accel::{Accel, NoProbe, none::Unculled};
    let world = World::new(scene);
    let at = scene.instances[0].world_from_object.transform_point3(DVec3::new(0.5, 0.25, 0.0)) - world.center;
    let origin = at.as_vec3() + Vec3::Z * from;
    let ray = Ray { origin, t_min: 0.0, dir: Vec3::NEG_Z * from.signum(), t_max: 9.0, exclude: NO_PRIM, sample: 0 };
    let mut hits = [Hit::MISS];
    Unculled::new(&world.shapes).closest(&[ray], &mut hits, &mut (), &mut NoProbe);
    let target = HitPrim::new(scene, &world, hits[0].prim);
    let mut surface = Surface::new(&world, target, &ray, &hits[0], 1e-4);
    let store = TextureStore::new(scene);
    surface.shade_smoothly(&store);
    look(surface, &store)
}

fn normal(scene: &Scene, from: f32) -> Vec3 {
    seen(scene, from, |surface, _| surface.normal)
}

fn coordinates(scene: &Scene, map: &TextureRef) -> Coordinates {
    seen(scene, 1.0, |s, _| s.patch.as_ref().expect("a mesh has coordinates").coordinates(map))
}

#[track_caller]
fn assert_near(a: Vec3, b: Vec3) {
    // Precision of 8-bit normal maps.
    assert!((a - b).length() < 6e-3, "{a} is not {b}");
}

#[test]
fn coordinates_are_interpolated_and_change_with_the_pixel() {
    let at = coordinates(&scene(vec![[0; 4]], 1), &map());
    assert!((at.uv - Vec2::new(0.5, 0.75)).length() < 1e-6);
    let area = at.along.perp_dot(at.across).abs();
    assert!((area - 1e-8).abs() < 1e-11, "the footprint of a cone seen face on is as wide as the cone: {area}");
}

#[test]
fn coordinates_follow_scale_then_rotation_then_offset() {
    let transform =
        UvTransform { offset: Vec2::new(0.25, 0.5), rotation: std::f32::consts::FRAC_PI_2, scale: Vec2::new(2.0, 1.0) };
    let at = coordinates(&scene(vec![[0; 4]], 1), &TextureRef { transform, ..map() });
    // (0.5, 0.75) → (1, 0.75) → turned counter-clockwise as seen with v down: (0.75, −1) → moved.
    assert!((at.uv - Vec2::new(1.0, -0.5)).length() < 1e-6, "{}", at.uv);
}

#[test]
fn a_grazing_footprint_is_long_along_the_ray_only() {
    let dir = Vec3::new(0.6f32.sqrt() * 1.0, 0.0, -(0.4f32.sqrt()));
    let print = Footprint::new(dir, Vec3::Z, 2.0);
    assert!((print.along.length() - 2.0 / 0.4f32.sqrt()).abs() < 1e-5 && print.along.y == 0.0);
    assert!((print.across.length() - 2.0).abs() < 1e-6);
    assert!(Footprint::new(Vec3::X, Vec3::Z, 1.0).along.is_finite());
    assert!(Footprint::new(Vec3::NEG_Z, Vec3::Z, 1.0).along.length() > 0.5);
}

/// A normal map of one colour: the unit vector (x, y, z) of tangent space.
fn with_normal_map(x: f32, y: f32, z: f32) -> Scene {
    let code = |c: f32| ((c * 0.5 + 0.5) * 255.0).round() as u8;
    let mut scene = scene(vec![[code(x), code(y), code(z), 255]], 1);
    scene.materials[0].normal_map = Some(map());
    scene
}

#[test]
fn a_normal_map_leans_along_u_and_against_v() {
    assert_near(normal(&with_normal_map(0.6, 0.0, 0.8), 1.0), Vec3::new(0.6, 0.0, 0.8));
    assert_near(normal(&with_normal_map(0.0, 0.6, 0.8), 1.0), Vec3::new(0.0, 0.6, 0.8));
    let mut flat = with_normal_map(0.6, 0.0, 0.8);
    flat.materials[0].normal_scale = 0.0;
    assert_near(normal(&flat, 1.0), Vec3::Z);
}

#[test]
fn given_tangents_are_used_with_their_handedness() {
    let mut scene = with_normal_map(0.0, 0.6, 0.8);
    scene.meshes[0].normals = vec![Vec3::Z; 4];
    scene.meshes[0].tangents = vec![Vec4::new(0.0, 1.0, 0.0, 1.0); 4];
    assert_near(normal(&scene, 1.0), Vec3::new(-0.6, 0.0, 0.8));
    scene.meshes[0].tangents = vec![Vec4::new(0.0, 1.0, 0.0, -1.0); 4];
    assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.0, 0.8));
}

#[test]
fn a_normal_map_is_decoded_in_the_frame_that_it_was_baked_in() {
    let texel = Vec3::new(0.3, 0.5, 0.8);
    let mut scene = with_normal_map(texel.x, texel.y, texel.z);
    // Corners of a box that is smoothed over its edges.
    let normals = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 1.0).normalize());
    let tangents = normals.map(|n| (Vec3::X - n * n.x).normalize());
    for (sign, mirror) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)] {
        scene.meshes[0].normals = normals.to_vec();
        scene.meshes[0].tangents = tangents.iter().map(|t| t.extend(sign)).collect();
        scene.instances[0].world_from_object = DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0));
        // The point is a quarter of the way to the second and to the third corner.
        let mix = |of: &[Vec3; 4]| of[0] * 0.5 + of[1] * 0.25 + of[2] * 0.25;
        let (n, t) = (mix(&normals), mix(&tangents));
        let turned = t * texel.x + n.cross(t) * sign * texel.y + n * texel.z;
        assert_near(normal(&scene, 1.0), turned.normalize() * Vec3::new(mirror as f32, 1.0, 1.0));
    }
}

#[test]
fn the_transform_of_a_normal_map_turns_its_frame_as_transformed_coordinates_do() {
    let turned = |scale: [f32; 2], rotation| UvTransform { offset: Vec2::ZERO, scale: scale.into(), rotation };
    let quarter = std::f32::consts::FRAC_PI_2;
    for (transform, expected) in [
        (turned([1.0, 1.0], quarter), Vec3::new(0.2, -0.6, 0.77)),
        (turned([1.0, -1.0], 0.0), Vec3::new(0.6, -0.2, 0.77)),
        (turned([-3.0, 2.0], 0.0), Vec3::new(-0.6, 0.2, 0.77)),
        (turned([2.0, 5.0], 0.0), Vec3::new(0.6, 0.2, 0.77)),
        (turned([-1.0, -1.0], quarter), Vec3::new(-0.2, 0.6, 0.77)),
    ] {
        let mut scene = with_normal_map(0.6, 0.2, 0.77);
        scene.materials[0].normal_map = Some(TextureRef { transform, ..map() });
        assert_near(normal(&scene, 1.0), expected);
        crate::load::tangents::generate(&mut scene.meshes[0], TexCoords::default());
        assert_near(normal(&scene, 1.0), expected);
        scene.meshes[0].tangents_along = None;
        assert_near(normal(&scene, 1.0), expected);
    }
}

#[test]
fn tangents_made_along_turned_coordinates_of_unequal_sides_are_those_of_the_coordinates() {
    for (scale, rotation) in [([1.0, 1.0], 0.6), ([2.0, -0.5], 0.0), ([-3.0, 2.0], -1.1)] {
        let mut scene = with_normal_map(0.6, 0.2, 0.77);
        // Four times as long as it is wide.
        scene.meshes[0].positions.iter_mut().for_each(|p| p.x *= 4.0);
        let transform = UvTransform { offset: Vec2::new(0.1, 0.2), scale: scale.into(), rotation };
        let mapped = TextureRef { transform, ..map() };
        scene.materials[0].normal_map = Some(mapped);
        let expected = normal(&scene, 1.0);
        crate::load::tangents::generate(&mut scene.meshes[0], mapped.coordinates());
        assert_near(normal(&scene, 1.0), expected);
    }
}

#[test]
fn tangents_made_along_turned_coordinates_turn_back_for_a_map_that_is_not() {
    for (scale, rotation) in [([1.0, 1.0], 0.6), ([1.0, -1.0], 0.0), ([-3.0, 3.0], -1.1)] {
        let transform = UvTransform { offset: Vec2::ZERO, scale: scale.into(), rotation };
        let mut scene = with_normal_map(0.6, 0.2, 0.77);
        let turned = TextureRef { transform, ..map() };
        crate::load::tangents::generate(&mut scene.meshes[0], turned.coordinates());
        assert_eq!(scene.meshes[0].tangents_along, Some(turned.coordinates()));
        assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.2, 0.77));
    }
}

#[test]
fn tangents_that_were_made_for_one_set_of_coordinates_are_of_no_other() {
    let mut scene = with_normal_map(0.6, 0.2, 0.77);
    let turned = scene.meshes[0].uvs[0].iter().map(|uv| Vec2::new(-uv.y, uv.x)).collect();
    scene.meshes[0].uvs.push(turned);
    scene.materials[0].normal_map = Some(TextureRef { uv_set: 1, ..map() });
    let expected = normal(&scene, 1.0);
    assert!((expected - Vec3::new(0.6, 0.2, 0.77)).length() > 0.1, "{expected}");
    crate::load::tangents::generate(&mut scene.meshes[0], TexCoords::default());
    assert_near(normal(&scene, 1.0), expected);
    // A file's tangents hold for all coordinate sets.
    scene.meshes[0].tangents_along = None;
    assert_near(normal(&scene, 1.0), Vec3::new(0.6, 0.2, 0.77));
}

#[test]
fn a_mirrored_instance_mirrors_its_normal_map() {
    for tangents in [vec![], vec![Vec4::new(1.0, 0.0, 0.0, 1.0); 4]] {
        for (x, y) in [(0.6, 0.0), (0.0, 0.6)] {
            let mut scene = with_normal_map(x, y, 0.8);
            scene.meshes[0].normals = vec![Vec3::Z; 4];
            scene.meshes[0].tangents.clone_from(&tangents);
            scene.instances[0].world_from_object = DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0));
            assert_near(normal(&scene, 1.0), Vec3::new(-x, y, 0.8));
        }
    }
}

#[test]
fn the_back_of_a_face_has_its_whole_normal_turned_round() {
    assert_near(normal(&with_normal_map(0.6, 0.0, 0.8), -1.0), Vec3::new(-0.6, 0.0, -0.8));
}

#[test]
fn smooth_normals_are_interpolated_and_scaled_as_normals() {
    let mut scene = scene(vec![[0; 4]], 1);
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    scene.meshes[0].normals = vec![tilted; 4];
    assert_near(normal(&scene, 1.0), tilted);
    scene.instances[0].world_from_object = DAffine3::from_scale(DVec3::new(2.0, 1.0, 1.0));
    assert_near(normal(&scene, 1.0), Vec3::new(0.3, 0.0, 0.8).normalize());
}

#[test]
fn a_normal_that_points_away_is_turned_until_it_is_seen() {
    let facing_z = |normal| facing(normal, Vec3::Y, Vec3::Z);
    let turned = facing_z(Vec3::new(0.8, 0.0, -0.6));
    assert!(turned.dot(Vec3::Z) > 0.0 && turned.x > 0.9 && turned.is_normalized());
    assert_eq!(facing_z(Vec3::Z), Vec3::Z);
    assert!(facing_z(Vec3::NEG_Z).is_normalized());
    // A face's own normal stays, at however grazing an angle, as long as it is visible.
    let flat = Vec3::new(1.0, 0.0, 1e-3).normalize();
    assert_eq!(facing(flat, flat, Vec3::Z), flat);
    let as_given = flat + Vec3::splat(2e-7);
    assert_eq!(facing(as_given, flat, Vec3::Z), as_given);
    assert!(facing(flat, Vec3::X, Vec3::Z) != flat && facing(-flat, -flat, Vec3::Z).z > 0.0);
}

#[test]
fn a_bump_map_leans_against_its_slope() {
    // Heights rise along u from 0 to 1 in four texels; away from the border the slope is 1 a texture.
    let texels = [0u8, 64, 128, 192].map(|h| [h, h, h, 255]).to_vec();
    let mut scene = scene(texels, 4);
    scene.materials[0].bump_map = Some(map());
    scene.materials[0].bump_scale = 0.5;
    let slope = 64.0 / 255.0 * 4.0 * 0.5;
    assert_near(normal(&scene, 1.0), Vec3::new(-slope, 0.0, 1.0).normalize());
}

#[test]
fn attributes_of_whole_polygons_are_those_of_their_fan() {
    let mut scene = scene(vec![[0; 4]], 1);
    let mesh = &mut scene.meshes[0];
    mesh.triangles.clear();
    mesh.polygon_corners = vec![0, 1, 2, 3];
    mesh.polygons = vec![Polygon { first: 0, len: 4, face: 0 }];
    let at = coordinates(&scene, &map());
    assert!((at.uv - Vec2::new(0.5, 0.75)).length() < 1e-6, "{}", at.uv);
}

#[test]
fn surfaces_without_coordinates_or_texture_are_safe() {
    let mut scene = scene(vec![[0, 0, 255, 255]], 1);
    let missing = TextureRef { texture: 7, uv_set: 3, transform: UvTransform::default() };
    scene.materials[0].normal_map = Some(missing);
    scene.materials[0].bump_map = Some(missing);
    scene.materials[0].reflection =
        Reflection::MetalRough(MetalRough { metal_rough_map: Some(missing), ..MetalRough::default() });
    assert_near(normal(&scene, 1.0), Vec3::Z);
}
