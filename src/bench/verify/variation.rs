//! Variations of a mesh: unchanged, scaled by powers of two, and moved away from the origin in two ways.

use crate::accel::{BitSet, Shapes};
use crate::math::{DVec3, Vec3};
use crate::render::World;
use crate::scene::Scene;

/// Direction of a move: along no axis, and not of unit length.
const AWAY: DVec3 = DVec3::new(1.0, 0.7, 1.3);

/// Transformation of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    None,
    /// Scaled by a power of two, which changes no mantissa.
    Scaled(i32),
    /// Moved through the instance transforms before the scene is centred, in units of the file.
    MovedBeforeCentring(f64),
    /// Moved by changing the stored vertices, in units of the file.
    MovedInF32(f64),
}

const CHANGES: [Change; 11] = [
    Change::None,
    Change::Scaled(-20),
    Change::Scaled(20),
    Change::MovedBeforeCentring(1e3),
    Change::MovedBeforeCentring(1e5),
    Change::MovedBeforeCentring(1e7),
    Change::MovedBeforeCentring(1e9),
    Change::MovedInF32(1e3),
    Change::MovedInF32(1e5),
    Change::MovedInF32(1e7),
    Change::MovedInF32(1e9),
];

/// The mesh after a transformation.
#[derive(Clone, Debug)]
pub struct Variation {
    /// Name of the transformation.
    pub name: &'static str,
    /// Distance of the move or factor of the scaling; 0 for the unchanged mesh.
    pub amount: f64,
    /// Whether the frame is centred, as that of rendered scenes is.
    pub centred: bool,
    /// Triangles of the mesh; other prims are left out.
    pub shapes: Shapes,
    /// Triangles of whose three different corners rounding made some coincide.
    pub collapsed: usize,
    /// Number of prims that are not triangles.
    pub others: usize,
}

/// Makes the variations of a scene one at a time, as each takes as much memory as the mesh.
#[derive(Clone, Debug)]
pub struct Variations {
    /// Meshes, instances and materials, without textures and lights.
    scene: Scene,
    original: Shapes,
    others: usize,
}

impl Variations {
    /// Number of variations.
    pub const COUNT: usize = CHANGES.len();

    /// Prepares the variations of a scene.
    pub fn new(scene: &Scene) -> Self {
        let shapes = World::new(scene).shapes;
        let Scene { meshes, instances, materials, .. } = scene;
        Self {
            scene: Scene {
                meshes: meshes.clone(),
                instances: instances.clone(),
                materials: materials.clone(),
                ..Scene::default()
            },
            original: only_triangles(&shapes),
            others: shapes.len() - shapes.triangles.len(),
        }
    }

    /// Variation `i`, below [`Self::COUNT`]; the first is the unchanged mesh.
    pub fn get(&self, i: usize) -> Variation {
        let original = &self.original;
        let (name, amount, shapes) = match CHANGES[i] {
            Change::None => ("as it is", 0.0, original.clone()),
            Change::Scaled(power) => {
                let factor = libm::scalbnf(1.0, power);
                ("scaled", f64::from(factor), with_vertices(original, |p| p * factor))
            }
            Change::MovedBeforeCentring(distance) => ("moved before centring", distance, self.moved(AWAY * distance)),
            Change::MovedInF32(distance) => {
                let by = (AWAY * distance).as_vec3();
                ("moved in f32", distance, with_vertices(original, |p| p + by))
            }
        };
        let collapsed = distinct(original).saturating_sub(distinct(&shapes));
        let centred = !matches!(CHANGES[i], Change::MovedInF32(_));
        Variation { name, amount, centred, shapes, collapsed, others: self.others }
    }

    /// Triangles of the moved scene; transforms are composed in `f64`.
    fn moved(&self, by: DVec3) -> Shapes {
        let mut scene = self.scene.clone();
        scene.instances.iter_mut().for_each(|i| i.world_from_object.translation += by);
        only_triangles(&World::new(&scene).shapes)
    }
}

fn only_triangles(shapes: &Shapes) -> Shapes {
    let mut only =
        Shapes { vertices: shapes.vertices.clone(), triangles: shapes.triangles.clone(), ..Shapes::default() };
    only.face_runs = shapes.face_runs.iter().map(|&[triangle, _]| [triangle, 0]).collect();
    only.opaque = BitSet::filled(only.len(), true);
    only
}

fn with_vertices(shapes: &Shapes, f: impl Fn(Vec3) -> Vec3) -> Shapes {
    Shapes { vertices: shapes.vertices.iter().map(|&p| f(p)).collect(), ..shapes.clone() }
}

/// Number of triangles with three different corners.
fn distinct(shapes: &Shapes) -> usize {
    let corners = |t: &[u32; 3]| t.map(|i| shapes.vertices[i as usize]);
    shapes.triangles.iter().map(corners).filter(|[a, b, c]| a != b && b != c && c != a).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::DAffine3;
    use crate::scene::{Instance, Material, Mesh};

    fn scene() -> Scene {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.01, 0.01, 3.0)];
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3]], ..Mesh::default() };
        let instance = Instance { name: String::new(), mesh: 0, world_from_object: DAffine3::IDENTITY };
        Scene { meshes: vec![mesh], instances: vec![instance], materials: vec![Material::plain()], ..Scene::default() }
    }

    #[test]
    fn moving_before_centring_loses_nothing_and_moving_in_f32_does() {
        let variations = Variations::new(&scene());
        let all: Vec<Variation> = (0..Variations::COUNT).map(|i| variations.get(i)).collect();
        let extent = |v: &Variation| {
            let p = &v.shapes.vertices;
            (p[1] - p[0], p[3] - p[0])
        };
        for v in &all {
            let exact = extent(v) == extent(&all[0]);
            match v.name {
                "moved in f32" if v.amount >= 1e9 => assert_eq!((exact, v.collapsed), (false, 2)),
                "moved before centring" if v.amount <= 1e7 => {
                    assert!((extent(v).1 - extent(&all[0]).1).abs().max_element() < 1e-6);
                    assert_eq!(v.collapsed, 0);
                }
                _ => {}
            }
        }
        assert_eq!(all[1].shapes.vertices[1], all[0].shapes.vertices[1] / 1_048_576.0);
    }
}
