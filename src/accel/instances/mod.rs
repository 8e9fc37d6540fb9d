//! Objects that are stored once and stand in several places.
//!
//! A scene may show a mesh a thousand times. Flattened, it is stored a thousand times; instanced, its triangles and the tree
//! over them are stored once ([`Object`]), and [`TwoLevel`] holds a tree over the places where they stand. What is hit is
//! the same bit for bit, for a triangle that a ray comes near is put into the scene's frame by the function that
//! flattening uses ([`placed`]), and is tested there. Only boxes are asked in the object's own frame ([`ObjectTransform`] has
//! the proof that this loses no hit).
//!
//! Prims have the numbers of the flattened scene: [`InstancedObjects::find`] leads from there to what is stored.

mod levels;
mod place;
#[cfg(test)]
mod tests;

pub use levels::{LevelScratch, TwoLevel};
pub use place::{ObjectTransform, placed};

use super::shapes::Prim;
use super::{NO_PRIM, Shapes};
use crate::math::triangle::Triangle;

/// Triangles in a frame of their own.
#[derive(Clone, Debug)]
pub struct Object {
    /// Vertices that triangles use, and triangles; nothing else.
    shapes: Shapes,
    /// Whether all of it stops light.
    pub opaque: bool,
}

impl Object {
    /// Of `vertices`, those that no triangle uses are left out. One triangle at least; indices are within range.
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

    /// The triangles.
    pub fn shapes(&self) -> &Shapes {
        &self.shapes
    }
}

/// An object where it stands.
#[derive(Clone, Debug)]
pub struct PlacedObject {
    /// Index into [`InstancedObjects::objects`].
    pub object: u32,
    /// The number of its first triangle among the prims of the scene; the others follow.
    pub first: u32,
    /// Stored prims with lower numbers.
    before: u32,
    /// How it stands there.
    pub place: ObjectTransform,
}

/// Objects that are stored once, and the places where they stand; nothing by default.
#[derive(Clone, Debug, Default)]
pub struct InstancedObjects {
    objects: Vec<Object>,
    /// By their first prims, ascending.
    placed: Vec<PlacedObject>,
    /// Triangles of all that are placed.
    shown: u32,
}

/// What a prim of the scene is.
#[derive(Clone, Copy, Debug)]
pub enum PrimLocation<'k> {
    /// A prim of the shapes in the scene's frame, by its number there.
    Stored(u32),
    /// A triangle of an object, by its number there.
    Placed(&'k PlacedObject, u32),
}

impl InstancedObjects {
    /// Adds an object that stands nowhere yet; its index.
    pub fn add(&mut self, object: Object) -> u32 {
        self.objects.push(object);
        index(self.objects.len()) - 1
    }

    /// Puts an object somewhere; places come in the order of their first prims. `first` is that of this one.
    pub fn put(&mut self, object: u32, first: u32, place: ObjectTransform) {
        self.placed.push(PlacedObject { object, first, before: first - self.shown, place });
        self.shown += self.count(object);
    }

    /// Whether no object is placed.
    pub fn is_empty(&self) -> bool {
        self.placed.is_empty()
    }

    /// The objects that are stored once.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Where all of it stands.
    pub fn placed(&self) -> &[PlacedObject] {
        &self.placed
    }

    /// Triangles that are shown, those of an object once for each place.
    pub fn shown(&self) -> u32 {
        self.shown
    }

    /// Triangles that are stored.
    pub fn stored(&self) -> usize {
        self.objects.iter().map(|o| o.shapes.triangles.len()).sum()
    }

    /// Bytes of vertices, triangles and places.
    pub fn bytes(&self) -> usize {
        let shapes = |o: &Object| size_of_val(&*o.shapes.vertices) + size_of_val(&*o.shapes.triangles);
        self.objects.iter().map(shapes).sum::<usize>() + size_of_val(&*self.placed)
    }

    fn count(&self, object: u32) -> u32 {
        index(self.objects[object as usize].shapes.triangles.len())
    }

    /// What prim `prim` of the scene is. [`NO_PRIM`] is stored as itself.
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

    /// The number among the prims of the scene of a stored one.
    #[inline]
    pub fn number(&self, stored: u32) -> u32 {
        let behind = if stored == NO_PRIM { 0 } else { self.placed.partition_point(|p| p.before <= stored) };
        match behind.checked_sub(1).map(|i| &self.placed[i]) {
            Some(placed) => placed.first + self.count(placed.object) + (stored - placed.before),
            None => stored,
        }
    }

    /// Triangle `triangle` of an object where it stands.
    pub fn triangle(&self, placed: &PlacedObject, triangle: u32) -> Triangle {
        self.objects[placed.object as usize].shapes.triangle(triangle).map(|corner| placed.place.corner(corner))
    }

    /// What prim `prim` of the scene is, in the scene's frame; `shapes` are those that are not instanced.
    #[inline]
    pub fn prim<'a>(&self, shapes: &'a Shapes, prim: u32) -> Prim<'a> {
        match self.find(prim) {
            PrimLocation::Stored(prim) => shapes.prim(prim),
            PrimLocation::Placed(placed, triangle) => Prim::Triangle(self.triangle(placed, triangle)),
        }
    }

    /// From now on no instanced object is opaque: filters decide what it lets through.
    pub fn open_all(&mut self) {
        self.objects.iter_mut().for_each(|object| object.opaque = false);
    }
}

#[expect(clippy::cast_possible_truncation, reason = "`Scene::check` and loading refuse more than `Scene::MOST_PRIMS`")]
fn index(i: usize) -> u32 {
    i as u32
}
