//! Meshes and their cameras.

use std::path::Path;

use meshray::accel::{BitSet, Shapes};
use meshray::generate::Family;
use meshray::math::{DVec3, Vec3};
use meshray::render::World;

/// A mesh to trace rays through.
pub(crate) struct Mesh {
    pub name: String,
    pub shapes: Shapes,
    pub camera: Camera,
}

/// A camera, and the light of its shadow rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Camera {
    pub eye: DVec3,
    pub target: DVec3,
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov: f64,
    pub light: DVec3,
}

impl Mesh {
    /// Reads the mesh `name` from `folder`, in the file's own coordinates; its camera is the row of that name in a table.
    pub(crate) fn read(folder: &Path, name: &str, cameras: &str) -> Result<Self, String> {
        let file = folder.join(format!("{name}.obj"));
        let failed = |what: &dyn std::fmt::Display| format!("{}: {what}", file.display());
        let camera = Camera::find(cameras, name).ok_or_else(|| failed(&"no camera is named so"))?;
        let (models, _) = tobj::load_obj(&file, &tobj::GPU_LOAD_OPTIONS).map_err(|e| failed(&e))?;
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        for model in models {
            let base = u32::try_from(vertices.len()).map_err(|e| failed(&e))?;
            #[expect(clippy::cast_possible_truncation, reason = "coordinates are f32 for everybody here")]
            vertices.extend(model.mesh.positions.chunks(3).map(|p| Vec3::new(p[0] as f32, p[1] as f32, p[2] as f32)));
            triangles.extend(model.mesh.indices.chunks(3).map(|t| [t[0] + base, t[1] + base, t[2] + base]));
        }
        Ok(Self { name: name.into(), shapes: shapes(vertices, triangles), camera })
    }

    /// A generated landscape of about `triangles` triangles, seen from above one of its corners.
    pub(crate) fn mountain(triangles: usize) -> Self {
        let world = World::new(&Family::Mountain.scene(triangles));
        let (lo, hi) = (world.bounds.0 - world.center, world.bounds.1 - world.center);
        let (size, up) = (hi - lo, DVec3::Z);
        let camera = Camera {
            eye: DVec3::new(lo.x + 0.1 * size.x, lo.y + 0.1 * size.y, hi.z + 0.2 * size.z),
            target: (lo + hi) * 0.5,
            up,
            fov: 50.0,
            light: DVec3::new(hi.x, lo.y, hi.z + size.x),
        };
        Self { name: "mountain".into(), shapes: shapes(world.shapes.vertices, world.shapes.triangles), camera }
    }
}

fn shapes(vertices: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Shapes {
    Shapes { opaque: BitSet::filled(triangles.len(), true), vertices, triangles, ..Shapes::default() }
}

impl Camera {
    /// Finds the row of a table that starts with this name: eye, target, up, angle, light.
    fn find(table: &str, name: &str) -> Option<Self> {
        let row = table.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(','))?;
        let numbers: Vec<f64> =
            row.split(',').map(|n| n.trim().parse::<f32>().map(f64::from)).collect::<Result<_, _>>().ok()?;
        let point = |i: usize| DVec3::new(numbers[i], numbers[i + 1], numbers[i + 2]);
        (numbers.len() == 13).then(|| Self {
            eye: point(0),
            target: point(3),
            up: point(6),
            fov: numbers[9],
            light: point(10),
        })
    }
}
