//! Chooses which meshes are instanced, that is, stored once as objects with several places, and which are flattened.

use crate::accel::instances::{Object, ObjectTransform};
use crate::accel::{Cone, InstancedObjects};
use crate::math::DAffine3;
use crate::named::names;
use crate::scene::{Mesh, Scene};
use rayon::prelude::*;

/// How meshes with several instances are stored. Hits are the same either way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Instancing {
    /// Each mesh is stored once where that saves much memory.
    #[default]
    Auto,
    /// Each mesh is stored once.
    Keep,
    /// Each instance is stored separately, in world space.
    Flatten,
}

names!(Instancing, "way with instances", Auto => "auto", Keep => "keep", Flatten => "flatten");

/// Fewest triangles for which a mesh gets a tree of its own by default.
const WORTH_A_TREE: usize = 64;

/// Fewest triangles that instancing must save: flattened, this many take 20 MB with the tree over them, and one tree is faster to
/// trace than two.
const WORTH_KEEPING: usize = 1 << 18;

/// The objects of a scene, and the places of their instances.
pub(super) struct InstancePlan {
    /// All objects, not placed yet.
    pub instanced: InstancedObjects,
    /// Index of the object and the place of each instance; `None`: it is flattened.
    pub places: Vec<Option<(u32, ObjectTransform)>>,
}

impl InstancePlan {
    /// Chooses the objects and places their instances; instances whose transform is unsuitable are flattened all the same.
    /// `opaque` gives for each mesh whether it stops light, `to_frame` moves an instance into the scene's frame.
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

/// Returns the meshes that are instanced.
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

/// Size of the shapes in memory, instanced objects included, in bytes.
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
