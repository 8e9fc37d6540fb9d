//! The mesh as it is, scaled by powers of two, and moved away from the origin in two ways.

use crate::accel::{BitSet, Shapes};
use crate::math::{DVec3, Vec3};
use crate::render::World;
use crate::scene::Scene;

/// Powers of two by which the mesh is scaled; that changes no digit of any number.
const SCALES: [i32; 2] = [-20, 20];

/// How far the mesh is moved, in units of the file.
const DISTANCES: [f64; 4] = [1e3, 1e5, 1e7, 1e9];

const IN_F32: &str = "moved in f32";

/// Direction of the move: no axis, and not of unit length.
const AWAY: DVec3 = DVec3::new(1.0, 0.7, 1.3);

/// The mesh after something was done to it.
#[derive(Clone, Debug)]
pub struct Variation {
    /// What was done.
    pub name: &'static str,
    /// How far, or how much; 0 for nothing.
    pub amount: f64,
    /// Its triangles alone.
    pub shapes: Shapes,
    /// Triangles that rounding left without three different corners, though they had them.
    pub collapsed: usize,
    /// Prims that are no triangles.
    pub others: usize,
}

/// Every variation, the unchanged mesh first.
pub fn all(scene: &Scene) -> Vec<Variation> {
    let world = World::new(scene);
    let others = world.shapes.len() - world.shapes.triangles.len();
    let original = only_triangles(&world.shapes);
    let proper = distinct(&original);
    let made = |name, amount, shapes: Shapes| {
        let collapsed = proper.saturating_sub(distinct(&shapes));
        Variation { name, amount, shapes, collapsed, others }
    };
    let mut all = vec![made("as it is", 0.0, original.clone())];
    for power in SCALES {
        let factor = libm::scalbnf(1.0, power);
        all.push(made("scaled", f64::from(factor), with_vertices(&original, |p| p * factor)));
    }
    for distance in DISTANCES {
        let moved = only_triangles(&World::new(&moved(scene, AWAY * distance)).shapes);
        all.push(made("moved before centring", distance, moved));
    }
    for distance in DISTANCES {
        let by = (AWAY * distance).as_vec3();
        all.push(made(IN_F32, distance, with_vertices(&original, |p| p + by)));
    }
    all
}

/// The scene somewhere else: transforms are composed in `f64`.
fn moved(scene: &Scene, by: DVec3) -> Scene {
    let mut moved = scene.clone();
    moved.instances.iter_mut().for_each(|i| i.world_from_object.translation += by);
    moved.spheres.clear();
    moved.planes.clear();
    moved
}

fn only_triangles(shapes: &Shapes) -> Shapes {
    let mut only =
        Shapes { vertices: shapes.vertices.clone(), triangles: shapes.triangles.clone(), ..Shapes::default() };
    only.opaque = BitSet::filled(only.len(), true);
    only
}

fn with_vertices(shapes: &Shapes, f: impl Fn(Vec3) -> Vec3) -> Shapes {
    Shapes { vertices: shapes.vertices.iter().map(|&p| f(p)).collect(), ..shapes.clone() }
}

/// Triangles with three different corners.
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
        let all = all(&scene());
        let extent = |v: &Variation| {
            let p = &v.shapes.vertices;
            (p[1] - p[0], p[3] - p[0])
        };
        assert_eq!(all.len(), 1 + 2 + 4 + 4);
        for v in &all {
            let exact = extent(v) == extent(&all[0]);
            match v.name {
                IN_F32 if v.amount >= 1e9 => assert_eq!((exact, v.collapsed), (false, 2)),
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
