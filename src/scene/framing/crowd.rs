//! Crowds: instances of large meshes that are small compared to the model. Each is a part by itself, its faces not examined.

use super::bounds::Bounds;
use super::parts::{Facing, Part, area_scale, faces_of};
use crate::math::{DAffine3, DVec3};
use crate::scene::corners::{ObjectBox, object_boxes, placed_box};
use crate::scene::{Instance, Scene};

/// Number of faces above which the totals of a mesh are worth computing.
const MANY: usize = 1024;

/// Longest side of an instance that is one part, as a fraction of the model's: the gap before strays is far wider.
const SMALL: f64 = 1.0 / 32.0;

/// Totals over the faces of each mesh that has many faces and several instances; `None` for other meshes.
pub(super) struct Crowd {
    members: Vec<Option<Member>>,
}

#[derive(Clone, Copy)]
struct Member {
    /// Box of all corners.
    bounds: ObjectBox,
    /// Area of all faces.
    area: f64,
    faces: u64,
}

impl Crowd {
    pub(super) fn of(scene: &Scene) -> Self {
        let mut times = vec![0_u32; scene.meshes.len()];
        let standing = scene
            .instances
            .iter()
            .filter_map(|instance| scene.meshes.get(instance.mesh as usize).map(|_| instance.mesh));
        standing.for_each(|mesh| times[mesh as usize] += 1);
        let is_one = |i: usize| times[i] > 1 && scene.meshes[i].triangles.len() > MANY;
        if !(0..scene.meshes.len()).any(is_one) {
            return Self { members: Vec::new() };
        }
        let member = |(i, bounds): (usize, Option<ObjectBox>)| {
            let (mesh, bounds) = (&scene.meshes[i], bounds.filter(|_| is_one(i))?);
            let area = Facing::of(mesh, &DAffine3::IDENTITY).area;
            Some(Member { bounds, area, faces: faces_of(mesh) })
        };
        Self { members: object_boxes(scene).into_iter().enumerate().map(member).collect() }
    }

    /// Whether no mesh forms a crowd.
    pub(super) fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// All faces of an instance as one part, with a box a little too large; `None` if the instance is not small in `bounds`.
    pub(super) fn part(&self, instance: &Instance, bounds: &Bounds) -> Option<Part> {
        let member = self.members.get(instance.mesh as usize)?.as_ref()?;
        let corners = placed_box(member.bounds, instance);
        let (lo, hi) =
            corners.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        let is_small = (hi - lo).max_element() <= (bounds.hi - bounds.lo).max_element() * SMALL;
        let area = area_scale(&instance.world_from_object.matrix3)? * member.area;
        let center = (lo * 0.5 + hi * 0.5).clamp(lo, hi);
        (is_small && lo.is_finite() && hi.is_finite()).then_some(Part {
            lo,
            hi,
            center,
            normal: DVec3::ZERO,
            area,
            faces: member.faces,
        })
    }
}
