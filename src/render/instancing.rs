//! Which meshes are instanced, stored once as objects that stand in several places, and which are flattened.

use crate::accel::instances::{Object, ObjectTransform};
use crate::accel::{Cone, InstancedObjects};
use crate::math::DAffine3;
use crate::named::names;
use crate::scene::{Mesh, Scene};
use rayon::prelude::*;

/// What becomes of meshes with several instances. What rays hit is the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instancing {
    /// Each mesh is stored once where that saves much memory.
    #[default]
    Auto,
    /// Each mesh is stored once.
    Keep,
    /// Each instance is stored by itself.
    Flatten,
}

names!(Instancing, "way with instances", Auto => "auto", Keep => "keep", Flatten => "flatten");

/// Triangles from which on a mesh is worth a tree of its own by default.
const WORTH_A_TREE: usize = 64;

/// Triangles that instancing must save: flattened, so many take 20 MB with the tree over them, and rays through one tree are
/// sooner answered than through two.
const WORTH_KEEPING: usize = 1 << 18;

/// The objects of a scene, and where instances of them stand.
pub(super) struct InstancePlan {
    /// All objects, which stand nowhere yet.
    pub instanced: InstancedObjects,
    /// For each instance the index of its object and its place; `None`: it is flattened.
    pub places: Vec<Option<(u32, ObjectTransform)>>,
}

impl InstancePlan {
    /// Chooses, and finds where instances stand; those that stand in no ordinary way are flattened all the same.
    /// `opaque` tells of each mesh whether it stops light, `to_frame` moves an instance into the scene's frame.
    pub(super) fn of(
        scene: &Scene,
        how: Instancing,
        opaque: impl Fn(usize) -> bool,
        to_frame: impl Fn(&DAffine3) -> DAffine3 + Sync,
    ) -> Self {
        let mut instanced = InstancedObjects::default();
        let mut objects: Vec<Option<u32>> = vec![None; scene.meshes.len()];
        for i in chosen(scene, how) {
            let mesh = &scene.meshes[i];
            objects[i] = Some(instanced.add(Object::new(&mesh.positions, &mesh.triangles, opaque(i))));
        }
        if instanced.objects().is_empty() {
            return Self { instanced, places: vec![None; scene.instances.len()] };
        }
        let place = |instance: &crate::scene::Instance| {
            let object = objects[instance.mesh as usize]?;
            let shapes = instanced.objects()[object as usize].shapes();
            Some((object, ObjectTransform::new(to_frame(&instance.world_from_object), shapes)?))
        };
        let places = scene.instances.par_iter().map(place).collect();
        Self { instanced, places }
    }
}

/// The meshes that are instanced.
fn chosen(scene: &Scene, how: Instancing) -> Vec<usize> {
    let least = match how {
        Instancing::Auto => WORTH_A_TREE,
        Instancing::Keep => 1,
        Instancing::Flatten => return Vec::new(),
    };
    let mut uses = vec![0usize; scene.meshes.len()];
    scene.instances.iter().for_each(|i| uses[i.mesh as usize] += 1);
    let suits = |mesh: &Mesh| mesh.triangles.len() >= least && mesh.polygons.is_empty();
    let chosen: Vec<usize> = (0..scene.meshes.len()).filter(|&i| uses[i] > 1 && suits(&scene.meshes[i])).collect();
    let saved: usize = chosen.iter().map(|&i| (uses[i] - 1) * scene.meshes[i].triangles.len()).sum();
    if how == Instancing::Auto && saved < WORTH_KEEPING { Vec::new() } else { chosen }
}

/// Bytes of shapes as they are stored, instanced objects with them.
pub(super) fn bytes(shapes: &crate::accel::Shapes, instanced: &InstancedObjects) -> usize {
    size_of_val(&*shapes.vertices)
        + size_of_val(&*shapes.triangles)
        + size_of_val(&*shapes.polygons)
        + size_of_val(&*shapes.polygon_corners)
        + size_of_val(&*shapes.spheres)
        + shapes.cones.len() * size_of::<Cone>()
        + size_of_val(&*shapes.planes)
        + instanced.bytes()
}
