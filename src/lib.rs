//! meshray renders the mesh files people download (glTF 2.0, OBJ, PLY, STL) into pictures, on any CPU, and reports what
//! the picture cost. It is a Whitted ray tracer (T. Whitted, "An Improved Illumination Model for Shaded Display", 1980)
//! accelerated by a uniform grid with octrees in crowded cells; every acceleration structure gives the same hits as
//! testing everything, bit for bit.
//!
//! # Data flow
//! A file becomes a [`scene::Scene`] and warnings ([`load`]). [`render::World`] places its shapes in one centred `f32`
//! frame; a structure over them ([`accel`]) intersects rays with them. [`render`] sends rays through it in waves, tile by
//! tile, and gives linear pixels, which [`image`] turns into a PNG, EXR, JPEG or WebP.
//!
//! ```text
//! file --load--> Scene --World--> shapes --accel--> structure --render--> linear pixels --image--> file
//! ```
//!
//! # Example
//! ```
//! use meshray::accel::{AccelChoice, AccelParams};
//! use meshray::image::{FileKind, Metadata, Output};
//! use meshray::load::{LoadOptions, load_bytes};
//! use meshray::render::texture::TextureStore;
//! use meshray::render::{Job, Settings, View, World, render};
//! use meshray::scene::{default_light, framing};
//!
//! // Usually `load::load("ship.glb".as_ref(), ..)`; this is a scene file with one red sphere.
//! let text = b"[materials.red]\ndiffuse = 'red'\n[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nmaterial = 'red'\n";
//! let mut scene = load_bytes("ball.toml".as_ref(), text.to_vec(), &LoadOptions::default())?.scene;
//!
//! // A camera that sees all of it, and light where the file brings none.
//! let settings = Settings { width: 64, height: 48, ..Settings::default() };
//! let bounds = framing::robust_bounds(&scene);
//! let camera = framing::default_camera(&scene, &bounds, 64.0 / 48.0);
//! default_light::add_if_missing(&mut scene, &camera);
//!
//! let world = World::new(&scene);
//! let (accel, _) = world.structure(AccelChoice::Auto, &AccelParams::DEFAULT);
//! let job = Job {
//!     scene: &scene,
//!     world: &world,
//!     accel: &accel,
//!     textures: &TextureStore::new(&scene),
//!     view: &View::from_camera(&camera),
//!     settings: &settings,
//! };
//! let picture = render(&job, &()).picture;
//! let [red, green, _, alpha] = picture.beauty[24 * 64 + 32];
//! assert!(alpha == 1.0 && red > 2.0 * green, "the middle shows the sphere");
//!
//! let png = meshray::image::encode(&picture, FileKind::Png, &Output::default(), &Metadata::new())?;
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Rendering a mesh of your own to a given error
//! A mesh made in memory, a camera, a lamp, and a bound on the error of the picture:
//! ```
//! use meshray::accel::{AccelChoice, AccelParams};
//! use meshray::image::{Output, rgba8};
//! use meshray::math::{DAffine3, DVec3, Vec3};
//! use meshray::render::{Job, Lens, Quality, Sampling, Settings, TextureStore, View, World, render};
//! use meshray::scene::{Environment, Instance, Light, LightKind, Material, Mesh, Scene};
//!
//! // A pyramid without a floor.
//! let rim = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Vec3::new(x, y, 0.0));
//! let pyramid = Mesh {
//!     positions: [Vec3::Z].into_iter().chain(rim).collect(),
//!     triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]],
//!     ..Mesh::default()
//! };
//! let sun = LightKind::Directional { direction: DVec3::new(0.0, 1.0, -1.0).normalize() };
//! let scene = Scene {
//!     materials: vec![Material::plain()],
//!     meshes: vec![pyramid],
//!     instances: vec![Instance { name: "pyramid".into(), mesh: 0, world_from_object: DAffine3::IDENTITY }],
//!     lights: vec![Light { name: "sun".into(), intensity: Vec3::splat(3.0), kind: sun, shadows: true, size: 0.02 }],
//!     environment: Environment::Constant(Vec3::splat(0.1)),
//!     ..Scene::default()
//! };
//! scene.check()?;
//!
//! let settings =
//!     Settings { width: 64, height: 48, sampling: Sampling::Stochastic(Quality::Draft.stochastic()), ..Settings::default() };
//! settings.validate()?;
//! let view = View::look_at(DVec3::new(0.0, -4.0, 2.0), DVec3::ZERO, DVec3::Z, Lens::perspective(0.6));
//! let world = World::new(&scene);
//! let (accel, _) = world.structure(AccelChoice::Auto, &AccelParams::DEFAULT);
//! let textures = TextureStore::new(&scene);
//! let job = Job { scene: &scene, world: &world, accel: &accel, textures: &textures, view: &view, settings: &settings };
//! let rendered = render(&job, &());
//!
//! let error = rendered.sampled.rmse().expect("stochastic sampling knows");
//! assert!(error < 0.1, "a bound on the root of the mean squared error");
//! let pixels = rgba8(&rendered.picture, &Output::default());
//! assert!(pixels[30 * 64 + 32][0] > 100, "the side that the sun shines on");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//! In a program that is not optimised this takes many times as long; the README says how to have the library optimised
//! nevertheless.
//!
//! # Tracing rays of your own
//! A mesh made in memory, the hits of rays on it, and the number of tests they took:
//! ```
//! use meshray::accel::{Accel, AccelKind, AccelParams, AccelChoice, Hit, NoProbe, RayCounts};
//! use meshray::math::{DAffine3, DVec3, Vec3};
//! use meshray::render::World;
//! use meshray::render::world::PrimSource;
//! use meshray::scene::{Instance, Material, Mesh, Scene};
//!
//! let square = Mesh {
//!     positions: vec![Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y],
//!     triangles: vec![[0, 1, 2], [0, 2, 3]],
//!     ..Mesh::default()
//! };
//! // A mesh is there where an instance places it.
//! let place = DAffine3::from_translation(DVec3::new(100.0, 0.0, 0.0));
//! let scene = Scene {
//!     materials: vec![Material::plain()],
//!     meshes: vec![square],
//!     instances: vec![Instance { name: "square".into(), mesh: 0, world_from_object: place }],
//!     ..Scene::default()
//! };
//! scene.check()?;
//!
//! // `new` keeps nothing back, so that every structure can hold it.
//! let world = World::new(&scene);
//! let (structure, _) = world.structure(AccelChoice::Kind(AccelKind::GridOctree), &AccelParams::DEFAULT);
//! let rays = [100.75, 100.25, 99.0].map(|x| world.ray(DVec3::new(x, 0.5, 2.0), DVec3::NEG_Z));
//! let (mut hits, mut scratch) = ([Hit::MISS; 3], structure.scratch());
//! structure.closest(&rays, &mut hits, &mut scratch, &mut NoProbe);
//!
//! assert_eq!(hits.map(|hit| hit.is_some()), [true, true, false]);
//! assert_eq!(world.source(hits[1].prim), PrimSource::Triangle { instance: 0, triangle: 1 });
//! let there = world.refine(&rays[0], &hits[0]);
//! assert_eq!((hits[0].t, there.normal), (2.0, Vec3::Z));
//! assert_eq!(world.to_world(there.position), DVec3::new(100.75, 0.5, 0.0));
//!
//! // The same rays once more, counted; `NoProbe` costs nothing.
//! let mut counts = RayCounts::default();
//! structure.closest(&rays, &mut hits, &mut scratch, &mut counts);
//! assert!(counts.n_it <= 6, "never more than each ray against each triangle");
//! # Ok::<(), meshray::scene::SceneFault>(())
//! ```
//!
//! # Lifetimes
//! A [`render::World`] owns all shapes. Structures borrow it, and a [`render::TextureStore`] borrows the scene: they are made
//! where they are used, as above, and live for as long as a request, a command or a thread's scope. A program that keeps a
//! mesh for as long as it runs leaks it: `let world: &'static World = Box::leak(Box::new(World::new(&scene)))`.
//!
//! # Modules
//! | module | contents |
//! |---|---|
//! | [`math`] | numbers only: error bounds, eight SIMD lanes, rays against triangle, polygon, sphere, cone, plane, box |
//! | [`scene`] | plain data with indices; which features a scene needs, default camera and light |
//! | [`load`] | files -> scene and warnings: glTF, OBJ + MTL, PLY, STL, NFF, scene files |
//! | [`accel`] | shapes -> hits of rays: `none`, `transform`, `spheres`, `boxes`, `bvh`, `grid`, `grid-octree`, `grid-bvh`, `octree`, `fast-octree`, `fast-bvh`; counts |
//! | [`mod@render`] | rays -> linear pixels: waves, shading models, lights and shadows, optics, textures |
//! | [`image`] | linear pixels <-> files: tone mapping, formats, metadata, differences |
//! | [`mod@bench`] | measures and compares: hard rays, exact answers, results |
//! | [`generate`] | scenes of any size for measurements |
//! | [`save`] | scenes -> glTF, OBJ |
//! | [`stopwatch`] | wall-clock and processor time |
//! | [`named`] | enums whose values have names, as typed and printed |
//! | [`number`] | numbers formatted for people |
//! | [`huge_pages`] | arrays in large pages |
//! | [`threads`] | worker threads, each pinned to a processor |
//! | `cli` | words -> jobs -> messages and exit codes (feature `cli`) |
//!
//! `scene` and `accel` use `math`; `load` uses `scene`; `render` uses `scene`, `accel` and `image`; `bench` uses
//! `render`, `accel`, `scene`, `image` and `generate`; `cli` uses all. `accel` sees shapes only:
//! another renderer could use it as it is.
//!
//! # What a caller can rely on
//! - The same scene and settings give the same pixels for every structure and number of threads.
//! - Files are not trusted: other files they name are read only below a root folder, sizes are checked before memory is
//!   taken, and broken input ends in a [`load::LoadError`] with place and remedy.
//! - Nothing but `cli` prints; warnings are values.

#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic"))]

pub mod accel;
pub mod bench;
mod catch_panic;
#[cfg(feature = "cli")]
pub mod cli;
pub mod generate;
pub mod huge_pages;
pub mod image;
mod jpeg;
pub mod load;
pub mod math;
pub mod named;
pub mod number;
mod parts;
pub mod render;
pub mod save;
pub mod scene;
pub mod stopwatch;
#[cfg(all(unix, feature = "cli"))]
mod sys;
pub mod threads;
