use super::*;
use crate::accel::{Accel, AccelKind, AccelParams, AnyAccel, NO_PRIM, NoProbe};
use crate::math::random::Random;
use crate::math::{DAffine3, DVec3, Vec3};
use crate::render::shade::Reader;
use crate::render::surface::{HitPrim, Surface};
use crate::scene::{
    Bitmap, Filter, MetalRough, Mipmaps, Phong, Pixels, Reflection, Sampler, Texture, UvTransform, Wrap,
};

/// Random size between two powers of two.
fn size(random: &mut Random, from: f32, to: f32) -> f32 {
    libm::exp2f(from + (to - from) * random.unit())
}

/// Random element.
fn one<T: Copy>(random: &mut Random, of: &[T]) -> T {
    of[random.below(of.len())]
}

/// `usual` in three of four cases.
fn mostly<T: Copy>(random: &mut Random, usual: T, odd: &[T]) -> T {
    if random.below(4) == 0 { one(random, odd) } else { usual }
}

/// A map with bars of holes, some of whose texels are close to the threshold.
fn barred(random: &mut Random, (width, height): (u32, u32), most: u8) -> Bitmap {
    let (mut columns, mut filled) = (Vec::new(), false);
    while columns.len() < width as usize {
        columns.extend(std::iter::repeat_n(filled, random.below(1 + width as usize / 4)));
        filled = !filled;
    }
    let mut texel =
        |column: bool| [200, 150, 100, if column { 255 } else { random.below(usize::from(most) + 1) as u8 }];
    let texels = (0..width * height).map(|i| texel(columns[(i % width) as usize]));
    Bitmap { name: String::new(), width, height, pixels: Pixels::Rgba8(texels.collect()) }
}

/// A material cut out by a map, in all possible ways, and some that do not work.
fn cut_out(random: &mut Random) -> Material {
    let glass = Reflection::Phong(Phong { transmission: Vec3::splat(0.5), ..Phong::default() });
    let matt = Reflection::MetalRough(MetalRough::default());
    let plain = UvTransform::default();
    let turned = UvTransform { rotation: 0.7, scale: Vec2::new(-1.5, 0.5), offset: Vec2::new(0.3, 9.0) };
    let far = UvTransform { offset: Vec2::new(-5e5, 2e4), ..plain };
    let transform = mostly(random, plain, &[turned, far]);
    let map = TextureRef { texture: random.below(12) as u32, uv_set: random.below(8) as u32 / 7, transform };
    let mask = |cutoff: f32| AlphaMode::Mask { cutoff };
    Material {
        alpha_mode: mostly(random, mask(0.5), &[AlphaMode::Blend, mask(100.6 / 255.0), mask(1.0), AlphaMode::Opaque]),
        opacity: mostly(random, 1.0, &[0.5, 2.0, f32::INFINITY, f32::NAN]),
        base_color: mostly(random, Vec3::ONE, &[Vec3::splat(0.5), Vec3::splat(f32::INFINITY)]),
        base_color_map: (random.below(9) != 0).then_some(map),
        opacity_map: (random.below(8) == 0).then_some(TextureRef { texture: random.below(12) as u32, ..map }),
        double_sided: random.below(3) != 0,
        reflection: if random.below(16) == 0 { glass } else { matt },
        ..Material::default()
    }
}

/// A triangle of any shape, far or near, with any coordinates.
fn triangle(random: &mut Random) -> Mesh {
    let (far, large) = (mostly(random, 0.5, &[0.0, 3e3]), size(random, -6.0, 3.0));
    let (at, along) = (random.cube() * far, random.cube() * large);
    let slim = mostly(random, 1.0, &[1e-1, 1e-2, 1e-4]);
    let across = along * random.unit() + random.cube() * (large * slim);
    let repeats = mostly(random, 1.0, &[3.0, 4e4]);
    let from = mostly(random, 0.0, &[5e5, -2e4]);
    let uv = |random: &mut Random| Vec2::new(from + random.unit() * repeats, random.unit() * repeats);
    let uvs = vec![[(); 3].map(|()| uv(random)).to_vec(), [(); 3].map(|()| uv(random)).to_vec()];
    let plain = [Vec4::ONE, Vec4::new(0.5, 1.0, 0.3, 0.9), Vec4::new(0.5, 0.2, 0.1, 0.4)];
    let odd = [Vec4::splat(3.0), Vec4::new(f32::INFINITY, 1.0, 1.0, 1.0), Vec4::new(1.0, f32::NAN, 1.0, 1.0)];
    let colors = match random.below(8) {
        0 => plain.to_vec(),
        1 => vec![Vec4::ONE, Vec4::ONE, one(random, &odd)],
        _ => Vec::new(),
    };
    let uvs = uvs.into_iter().take(1 + random.below(2)).collect();
    Mesh { positions: vec![at, at + along, at + across], triangles: vec![[0, 1, 2]], uvs, colors, ..Mesh::default() }
}

/// Triangles that maps cut out, each placed by itself.
fn scene(random: &mut Random) -> Scene {
    let mut scene = Scene::default();
    let wraps = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    for (i, size) in
        [(512, 8), (256, 16), (201, 9), (64, 64), (63, 31), (1024, 2)].into_iter().cycle().take(12).enumerate()
    {
        let most = mostly(random, 0, &[100, 127]);
        scene.bitmaps.push(barred(random, size, most));
        let sampler = Sampler {
            magnify: one(random, &[Filter::Linear, Filter::Nearest]),
            minify: one(random, &[Filter::Linear, Filter::Nearest]),
            mipmaps: one(random, &[Mipmaps::Linear, Mipmaps::Nearest, Mipmaps::None]),
            wrap_u: one(random, &wraps),
            wrap_v: one(random, &wraps),
        };
        scene.textures.push(Texture { bitmap: i as u32, sampler });
    }
    for i in 0..64 {
        scene.materials.push(cut_out(random));
        scene.meshes.push(Mesh { material: i, ..triangle(random) });
        let mirrored = if random.below(3) == 0 { -1.0 } else { 1.0 };
        let place = DAffine3::from_scale(DVec3::new(mirrored, 1.0, 1.0));
        scene.instances.push(Instance { world_from_object: place, mesh: i, name: String::new() });
    }
    scene
}

/// A ray to a random point of a triangle, and its cone.
fn toward(random: &mut Random, corners: [Vec3; 3], prim: u32) -> (Ray, [f32; 2]) {
    let (mut u, mut v) = (random.unit(), random.unit());
    if u + v > 1.0 {
        (u, v) = (1.0 - u, 1.0 - v);
    }
    let [a, b, c] = corners;
    let (at, large) = (a + (b - a) * u + (c - a) * v, (b - a).length());
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let flat = mostly(random, 1.0, &[0.1, 1e-2, 1e-3]);
    let (aslant, sign) = (random.cube(), one(random, &[-1.0, 1.0]));
    let dir = aslant - normal * normal.dot(aslant) + normal * (flat * sign);
    let origin = at - dir * (large * size(random, -3.0, 8.0));
    let longer = mostly(random, 1.0, &[1e-3, 40.0]);
    let (dir, t) = ((at - origin) * longer, 1.0 / longer);
    let ray = Ray { origin, t_min: t * 0.9, dir, t_max: t * 1.1, exclude: NO_PRIM, sample: prim };
    let (width, spread) = (large * size(random, -20.0, -4.0), size(random, -24.0, -8.0) / longer);
    (ray, [one(random, &[0.0, width]), one(random, &[0.0, spread])])
}

#[test]
fn what_is_said_to_be_a_void_is_shaded_as_nothing_and_what_is_said_to_stop_light_does() {
    let mut random = Random::new(17);
    let (mut all, mut voids, mut said) = (0, 0, [0; 2]);
    for round in 0..12 {
        let scene = scene(&mut random);
        let world = World::new(&scene);
        let textures = TextureStore::new(&scene);
        let alpha_voids = AlphaVoids::of(&scene, &world, &textures).unwrap();
        alpha_voids.maps.found.get_or_init(|| alpha_voids.survey());
        let accel = AnyAccel::build(AccelKind::None, &world.shapes, &AccelParams::DEFAULT);
        for prim in (0..world.triangles()).flat_map(|prim| std::iter::repeat_n(prim, 400)) {
            let (ray, cone) = toward(&mut random, world.triangle(prim), prim);
            // Its hit with this prim, whatever else it hits.
            let mut met = [Hit::BEFORE_ALL];
            while met[0].is_some() || met[0] == Hit::BEFORE_ALL {
                let after = met;
                accel.next(&[ray], &after, &mut met, &mut accel.scratch(), &mut NoProbe);
                if met[0].prim == prim {
                    break;
                }
            }
            let [hit] = met;
            if hit.prim != prim {
                continue;
            }
            let from = one(&mut random, &[f32::NEG_INFINITY, f32::NEG_INFINITY, hit.t * 0.9, hit.t * 1.1]);
            let sight = Sight { ray: &ray, cone, from };
            let what = || format!("round {round}: {:?}, {ray:?} {cone:?} {hit:?}", scene.materials[prim as usize]);
            let target = HitPrim::new(&scene, &world, prim);
            all += 1;
            if alpha_voids.rejects(&sight, prim) {
                let surface = Surface::new(&world, target, &ray, &hit, cone[0] + cone[1] * hit.t);
                assert!(surface.front || target.material.double_sided, "its back is crossed: {}", what());
                assert!(hit.t > from, "it may be met once more: {}", what());
                let reader = Reader { store: &textures, patch: surface.patch.as_ref(), known: &[] };
                let coverage = target.material.alpha_mode.covers(reader.base(target.material).w);
                assert!(coverage <= 0.0, "{coverage} of it is there: {}", what());
                assert!(!target.material.reflection.transmits(), "{}", what());
                voids += 1;
            }
            if let Some(stops) = alpha_voids.stops(&ray, prim) {
                let coverage =
                    target.opacity(&hit, &textures).map(|opacity| target.material.alpha_mode.covers(opacity));
                assert_eq!(coverage, Some(f32::from(u8::from(stops))), "{}", what());
                said[usize::from(stops)] += 1;
            }
        }
    }
    assert!(voids > all / 40 && said.into_iter().all(|count| count > voids), "of {all} {voids} and {said:?}");
}

#[test]
fn rays_that_are_asked_together_are_told_what_each_is_told_alone() {
    let mut random = Random::new(18);
    let scene = scene(&mut random);
    let world = World::new(&scene);
    let textures = TextureStore::new(&scene);
    let alpha_voids = AlphaVoids::of(&scene, &world, &textures).unwrap();
    alpha_voids.maps.found.get_or_init(|| alpha_voids.survey());
    let mut passed = 0;
    for prim in (0..world.triangles()).flat_map(|prim| std::iter::repeat_n(prim, 30)) {
        let rays: Vec<(Ray, [f32; 2])> = (0..40).map(|_| toward(&mut random, world.triangle(prim), prim)).collect();
        let (rays, cones): (Vec<Ray>, Vec<[f32; 2]>) = rays.into_iter().unzip();
        let [widths, spreads] = [0, 1].map(|k| cones.iter().map(|cone| cone[k]).collect::<Vec<f32>>());
        let filter = alpha_voids.filter(&rays, Cones::PrimaryRays([&widths, &spreads]));
        let mask = (0..32).filter(|_| random.below(3) != 0).fold(0, |mask, ray| mask | 1 << ray);
        let alone = (0..32).filter(|&ray| mask >> ray & 1 == 1 && filter.rejects(8 + ray, prim));
        let alone = alone.fold(0, |mask, ray| mask | 1 << ray);
        assert_eq!(filter.rejects_of(8, mask, prim), alone, "{:?}", scene.materials[prim as usize]);
        passed += alone.count_ones();
    }
    assert!(passed > 1000, "{passed}");
}
