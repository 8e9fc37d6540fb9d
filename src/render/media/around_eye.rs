//! Media around the eye: its rays start inside them, are refracted where they leave them, and absorbed from the start.

use crate::accel::{Accel, Hit, NoProbe, Ray};
use crate::math::Vec3;
use crate::render::context::Context;
use crate::render::media::{Media, MediaTable, Medium};
use crate::render::seam::is_same_crossing;
use crate::render::shade::has_inside;
use crate::render::surface::{HitPrim, Surface};
use crate::render::view::View;
use crate::scene::{Material, Reflection};

/// Maximum number of surfaces examined along one direction; where more lie behind each other, that direction is ignored.
const FACES: usize = 1024;

/// Media around the eye of a view, the innermost last, if any material has an inside: those that rays leave without having
/// entered them, in every direction. Panes without an inside are left in this way only in some directions.
pub(in crate::render) fn media_around<A: Accel>(context: &Context, accel: &A, view: &View) -> Vec<Medium> {
    if !context.scene.materials.iter().any(has_inside) {
        return Vec::new();
    }
    let mut scratch = accel.scratch();
    let mut left = directions(view).filter_map(|dir| left_along(context, accel, &mut scratch, view, dir));
    let Some(first) = left.next() else { return Vec::new() };
    let around = left.fold(first, |around, left| in_both(&around, left));
    // The medium left first is the innermost.
    let medium = |&material: &u32| Medium { material, ior: index(&context.scene.materials[material as usize]) };
    around.iter().rev().map(medium).collect()
}

/// The view direction, and those to the corners of a cube.
fn directions(view: &View) -> impl Iterator<Item = Vec3> {
    let corner = |i: u32| Vec3::from([0, 1, 2].map(|k| if i >> k & 1 == 1 { 1.0 } else { -1.0 }));
    std::iter::once(view.forward.as_vec3()).chain((0..8).map(corner))
}

/// Elements of the first list that are in the second, too, as often as there: bodies of one material may be nested.
fn in_both(first: &[u32], mut second: Vec<u32>) -> Vec<u32> {
    let is_in_both = |material: &&u32| {
        let at = second.iter().position(|other| other == *material);
        at.map(|at| second.swap_remove(at)).is_some()
    };
    first.iter().filter(is_in_both).copied().collect()
}

/// Materials that a ray leaves without having entered, with repetitions; `None` where the way does not end.
fn left_along<A: Accel>(
    context: &Context,
    accel: &A,
    scratch: &mut A::Scratch,
    view: &View,
    dir: Vec3,
) -> Option<Vec<u32>> {
    let origin = (view.eye - context.world.center).as_vec3();
    let ray = Ray::new(origin, dir);
    let (mut table, mut entered, mut left) = (MediaTable::default(), Media::OUTSIDE, Vec::new());
    let mut hit = [Hit::MISS];
    accel.closest(&[ray], &mut hit, scratch, &mut NoProbe);
    let mut crossed = Hit::MISS;
    for _ in 0..FACES {
        if !hit[0].is_some() {
            return Some(left);
        }
        let is_repeated = is_same_crossing(|prim| context.face(prim), &ray, &crossed, &hit[0]);
        crossed = hit[0];
        let target = HitPrim::new(context.scene, context.world, hit[0].prim);
        if has_inside(target.material) && !is_repeated {
            let entering = Surface::new(context.world, target, &ray, &hit[0], 0.0).front;
            let beyond = table.cross(entered, Medium { material: target.material_id, ior: 1.0 }, entering).beyond;
            if !entering && beyond == entered {
                left.push(target.material_id);
            }
            entered = beyond;
        }
        let after = hit;
        accel.next(&[ray], &after, &mut hit, scratch, &mut NoProbe);
    }
    None
}

/// Index of refraction inside a material.
fn index(material: &Material) -> f32 {
    let ior = match &material.reflection {
        Reflection::Phong(phong) => phong.ior,
        Reflection::MetalRough(m) => m.ior,
        Reflection::Unlit => 0.0,
    };
    if ior > 0.0 { ior } else { 1.0 }
}
