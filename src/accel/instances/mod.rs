//! Instancing: objects that are stored once and placed several times.
//!
//! A scene may show a mesh a thousand times. Flattened, it is stored a thousand times; instanced, its triangles and the tree
//! over them are stored once ([`Object`]), and [`TwoLevel`] holds a tree over the places. Hits are the same bit for bit: a
//! triangle that a ray comes near is transformed into the scene's frame by the function that flattening uses ([`placed`]),
//! and tested there. Only box tests happen in the object's own frame ([`ObjectTransform`] has the proof that this loses no
//! hit).
//!
//! Prims are numbered as in the flattened scene: [`InstancedObjects::find`] maps these numbers to the stored prims.

mod levels;
mod place;
#[cfg(test)]
mod tests;

pub use levels::{LevelScratch, TwoLevel};
pub use place::{ObjectTransform, placed};

use super::shapes::Prim;
use super::{NO_PRIM, Shapes};
use crate::math::triangle::Triangle;

/// Triangle mesh in a frame of its own.
#[derive(Clone, Debug)]
pub struct Object {
    /// The triangles and the vertices they use; nothing else.
    shapes: Shapes,
    /// Whether all triangles are opaque.
    pub opaque: bool,
}

impl Object {
    /// Creates an object of at least one triangle, with indices within range; `vertices` that no triangle uses are left out.
    pub fn new(vertices: &[crate::math::Vec3], triangles: &[[u32; 3]], opaque: bool) -> Self {
        let mut used = vec![false; vertices.len()];
        triangles.iter().flatten().for_each(|&i| used[i as usize] = true);
        let mut before = 0;
        let place = |&used: &bool| {
            before += u32::from(used);
            before - u32::from(used)
        };
        let moved: Vec<u32> = used.iter().map(place).collect();
        let shapes = Shapes {
            vertices: vertices.iter().zip(&used).filter(|(_, used)| **used).map(|(v, _)| *v).collect(),
            triangles: triangles.iter().map(|t| t.map(|i| moved[i as usize])).collect(),
            ..Shapes::default()
        };
        Self { shapes, opaque }
    }

    /// Triangles of the object.
    pub fn shapes(&self) -> &Shapes {
        &self.shapes
    }
}

/// An object at one of its places.
#[derive(Clone, Debug)]
pub struct PlacedObject {
    /// Index into [`InstancedObjects::objects`].
    pub object: u32,
    /// Number of the object's first triangle among the prims of the scene; the others follow.
    pub first: u32,
    /// Number of stored prims with lower numbers.
    before: u32,
    /// Transform of the object.
    pub place: ObjectTransform,
}

/// Objects that are stored once, and their places; empty by default.
#[derive(Clone, Debug, Default)]
pub struct InstancedObjects {
    objects: Vec<Object>,
    /// Placed objects, ascending by their first prims.
    placed: Vec<PlacedObject>,
    /// Total number of triangles of all placed objects.
    shown: u32,
}

/// Location of a prim of the scene.
#[derive(Clone, Copy, Debug)]
pub enum PrimLocation<'k> {
    /// A prim of the shapes in the scene's frame, by its number there.
    Stored(u32),
    /// A triangle of a placed object, by its number in the object.
    Placed(&'k PlacedObject, u32),
}

impl InstancedObjects {
    /// Adds an object without a place and returns its index.
    pub fn add(&mut self, object: Object) -> u32 {
        self.objects.push(object);
        index(self.objects.len()) - 1
    }

    /// Places an object whose first prim is `first`; calls must come in ascending order of `first`.
    pub fn put(&mut self, object: u32, first: u32, place: ObjectTransform) {
        self.placed.push(PlacedObject { object, first, before: first - self.shown, place });
        self.shown += self.count(object);
    }

    /// Whether no object is placed.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// Objects that are stored once.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Placed objects.
    pub fn placed(&self) -> &[PlacedObject] {
        &self.placed
    }

    /// Number of triangles shown: those of an object count once per place.
    pub fn shown(&self) -> u32 {
        self.shown
    }

    /// Number of triangles stored.
    pub fn stored(&self) -> usize {
        self.objects.iter().map(|o| o.shapes.triangles.len()).sum()
    }

    /// Size of vertices, triangles and places, in bytes.
    pub fn bytes(&self) -> usize {
        let shapes = |o: &Object| size_of_val(&*o.shapes.vertices) + size_of_val(&*o.shapes.triangles);
        self.objects.iter().map(shapes).sum::<usize>() + size_of_val(&*self.placed)
    }

    fn count(&self, object: u32) -> u32 {
        index(self.objects[object as usize].shapes.triangles.len())
    }

    /// Location of prim `prim` of the scene. [`NO_PRIM`] is stored as itself.
    #[inline]
    pub fn find(&self, prim: u32) -> PrimLocation<'_> {
        if self.placed.is_empty() || prim == NO_PRIM {
            return PrimLocation::Stored(prim);
        }
        self.find_among(prim)
    }

    #[inline(never)]
    fn find_among(&self, prim: u32) -> PrimLocation<'_> {
        let behind = self.placed.partition_point(|p| p.first <= prim);
        let Some(placed) = behind.checked_sub(1).map(|i| &self.placed[i]) else { return PrimLocation::Stored(prim) };
        let (triangle, count) = (prim - placed.first, self.count(placed.object));
        if triangle < count {
            PrimLocation::Placed(placed, triangle)
        } else {
            PrimLocation::Stored(placed.before + (triangle - count))
        }
    }

    /// Number in the scene of a stored prim.
    #[inline]
    pub fn number(&self, stored: u32) -> u32 {
        let behind = if stored == NO_PRIM { 0 } else { self.placed.partition_point(|p| p.before <= stored) };
        match behind.checked_sub(1).map(|i| &self.placed[i]) {
            Some(placed) => placed.first + self.count(placed.object) + (stored - placed.before),
            None => stored,
        }
    }

    /// Triangle `triangle` of a placed object, in the scene's frame.
    pub fn triangle(&self, placed: &PlacedObject, triangle: u32) -> Triangle {
        self.objects[placed.object as usize].shapes.triangle(triangle).map(|corner| placed.place.corner(corner))
    }

    /// Prim `prim` of the scene, in the scene's frame; `shapes` are those that are not instanced.
    #[inline]
    pub fn prim<'a>(&self, shapes: &'a Shapes, prim: u32) -> Prim<'a> {
        match self.find(prim) {
            PrimLocation::Stored(prim) => shapes.prim(prim),
            PrimLocation::Placed(placed, triangle) => Prim::Triangle(self.triangle(placed, triangle)),
        }
    }

    /// Makes every instanced object non-opaque from now on: filters decide what it lets through.
    pub fn open_all(&mut self) {
        self.objects.iter_mut().for_each(|object| object.opaque = false);
    }
}

#[expect(clippy::cast_possible_truncation, reason = "`Scene::check` and loading refuse more than `Scene::MOST_PRIMS`")]
fn index(i: usize) -> u32 {
    i as u32
}
