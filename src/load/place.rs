//! Coordinates in `f64` -> a centre in `f64` and `f32` coordinates relative to it.

use super::{Diagnostic, Loaded, Warnings};
use crate::math::frame::{center_of_most, spread};
use crate::math::{DVec3, Vec3};
use crate::scene::corners::{ObjectBox, placed_box};
use crate::scene::{Instance, Mesh, Scene};
use rayon::prelude::*;
use std::cell::OnceCell;
use std::path::Path;

/// Rounded positions, relative to `center`.
#[derive(Clone, Debug, Default)]
pub(super) struct Placed {
    pub center: DVec3,
    /// Rounded positions; not finite where those of the file are not, or are too large.
    pub positions: Vec<Vec3>,
    /// Largest distance between a position and its rounded one.
    pub max_rounding: f64,
}

/// Whether a position or size is finite and not so large that it counts as infinite.
pub(super) fn is_usable(p: DVec3) -> bool {
    p.is_finite() && p.abs().max_element() <= Scene::LARGEST
}

/// Removes instances of which any part is placed where coordinates count as infinite.
pub(super) fn leave_out_far(loaded: &mut Loaded, file: &Path) {
    let meshes = &loaded.scene.meshes;
    let boxes: Vec<OnceCell<ObjectBox>> = vec![OnceCell::new(); meshes.len()];
    let is_near = |instance: &Instance| {
        // A transform that neither moves nor enlarges needs no measuring: every coordinate was checked before.
        let (matrix, mesh) = (instance.world_from_object.matrix3, instance.mesh as usize);
        let largest = matrix.transpose().to_cols_array_2d().map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
        let is_no_larger = largest.iter().all(|&times| times <= 1.0);
        is_no_larger && instance.world_from_object.translation == DVec3::ZERO
            || placed_box(*boxes[mesh].get_or_init(|| meshes[mesh].around()), instance).into_iter().all(is_usable)
    };
    let before = loaded.scene.instances.len();
    let far = loaded.scene.instances.iter().find(|instance| !is_near(instance)).map(|far| far.name.clone());
    let Some(name) = far else { return };
    loaded.scene.instances.retain(is_near);
    let count = before - loaded.scene.instances.len();
    let text = "an object is left out: its transform places it over 1e18 away";
    let warning =
        Diagnostic::new(LeftOut::TOO_FAR.code, file, if name.is_empty() { name } else { format!("'{name}'") }, text);
    loaded.warnings.push(Diagnostic { count: u32::try_from(count).unwrap_or(u32::MAX), ..warning });
}

/// Why a shape was left out.
pub(super) struct LeftOut {
    code: &'static str,
    reason: &'static str,
    text: &'static str,
}

impl LeftOut {
    /// The shape lies where coordinates count as infinite.
    pub(super) const TOO_FAR: Self = Self {
        code: "shape-too-far",
        reason: "a coordinate over 1e18",
        text: "a shape is left out: a coordinate or size is over 1e18",
    };

    /// The shape is degenerate once its coordinates are rounded.
    pub(super) const COLLAPSED: Self = Self {
        code: "face-degenerate",
        reason: "two corners in one place",
        text: "a triangle is left out: two corners are in one place once coordinates are rounded",
    };

    /// Reports `count` shapes as dropped, if any; `file` and `place` are those of the first.
    pub(super) fn tell(
        &self,
        count: u64,
        file: &Path,
        place: String,
        dropped: &mut Vec<(String, u64)>,
        warnings: &mut Warnings,
    ) {
        if count > 0 {
            let warning = Diagnostic::new(self.code, file, place, self.text);
            warnings.push(Diagnostic { count: u32::try_from(count).unwrap_or(u32::MAX), ..warning });
            dropped.push((self.reason.into(), count));
        }
    }
}

/// Number of positions per parallel task.
const POSITIONS: usize = 1 << 13;

/// Subtracts the centre of all finite positions in `f64`, or of most of them where a few are far away, then rounds.
pub(super) fn place(positions: &[DVec3]) -> Placed {
    let (lo, hi) = bounds(positions);
    let sample = spread(positions.len()).map(|i| positions[i]).filter(|p| is_usable(*p));
    place_around(positions, center_of_most(lo, hi, sample))
}

/// Bounds of all finite positions; an inverted infinite box where there are none.
pub(super) fn bounds(positions: &[DVec3]) -> (DVec3, DVec3) {
    bounds_of(positions.par_iter().map(|&p| if is_usable(p) { p } else { DVec3::NAN }))
}

/// Bounds of positions.
pub(super) fn bounds_of(places: impl IndexedParallelIterator<Item = DVec3>) -> (DVec3, DVec3) {
    let nothing = || (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let both = |(lo, hi): (DVec3, DVec3), (low, high): (DVec3, DVec3)| (lo.min(low), hi.max(high));
    let with = |all, p: DVec3| if p.is_finite() { both(all, (p, p)) } else { all };
    places.with_min_len(POSITIONS).fold(nothing, with).reduce(nothing, both)
}

/// Subtracts `center` in `f64`, then rounds.
pub(super) fn place_around(positions: &[DVec3], center: DVec3) -> Placed {
    let mut rounded = vec![Vec3::NAN; positions.len()];
    let round = |(to, from): (&mut [Vec3], &[DVec3])| {
        let mut max_rounding = 0.0f64;
        for (to, p) in to.iter_mut().zip(from).filter(|(_, p)| is_usable(**p)) {
            let exact = *p - center;
            *to = exact.as_vec3();
            max_rounding = max_rounding.max(to.as_dvec3().distance(exact));
        }
        max_rounding
    };
    let parts = rounded.par_chunks_mut(POSITIONS).zip(positions.par_chunks(POSITIONS));
    let max_rounding = parts.map(round).reduce(|| 0.0, f64::max);
    Placed { center, positions: rounded, max_rounding }
}

/// Removes triangles with two corners at one position after rounding; returns their number. The mesh holds the face that each
/// triangle was cut from.
pub(super) fn leave_out_collapsed(mesh: &mut Mesh) -> u64 {
    let place = |corner: u32| mesh.positions[corner as usize];
    let is_wide = |[a, b, c]: &[u32; 3]| place(*a) != place(*b) && place(*b) != place(*c) && place(*c) != place(*a);
    let wide: Vec<bool> = mesh.triangles.iter().map(is_wide).collect();
    let mut kept = wide.iter();
    mesh.triangles.retain(|_| kept.next().copied().unwrap_or(false));
    let mut kept = wide.iter();
    mesh.face_of_triangle.retain(|_| kept.next().copied().unwrap_or(false));
    (wide.len() - mesh.triangles.len()) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_measured_and_relative_to_the_center() {
        let far = [DVec3::new(1e7, 0.0, 0.0), DVec3::new(1e7 + 0.1, 1.0, 0.0)];
        let placed = place(&far);
        assert!((placed.center.x - 1e7).abs() < 1.0);
        assert!(placed.max_rounding > 0.0 && placed.max_rounding < 1e-8, "{}", placed.max_rounding);
    }

    #[test]
    fn objects_that_transforms_place_too_far_away_are_left_out_and_told() {
        use crate::math::DAffine3;
        let mesh = |far: f32| Mesh { positions: vec![Vec3::ZERO, Vec3::splat(far)], ..Mesh::default() };
        let of = |name: &str, mesh, world_from_object| Instance { name: name.into(), mesh, world_from_object };
        let scaled = |by: f64| DAffine3::from_scale(DVec3::new(1.0, by, 1.0));
        let moved = |by: f64| DAffine3::from_translation(DVec3::Z * by);
        let instances = vec![
            of("as it is", 0, DAffine3::IDENTITY),
            of("large", 0, scaled(1e18)),
            of("larger", 0, scaled(2e18)),
            of("far", 1, moved(0.9e18)),
            of("farther", 1, moved(-1.1e18)),
            of("nowhere", 0, moved(f64::NAN)),
            of("far and large", 1, scaled(1e9)),
        ];
        let scene = Scene { meshes: vec![mesh(1.0), mesh(1e10)], instances, ..Scene::default() };
        let mut loaded = Loaded { scene, ..Loaded::default() };
        leave_out_far(&mut loaded, "a.glb".as_ref());
        let left: Vec<&str> = loaded.scene.instances.iter().map(|instance| instance.name.as_str()).collect();
        assert_eq!(left, ["as it is", "large", "far"]);
        let [told] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
        assert_eq!((told.code, told.place.as_str(), told.count), ("shape-too-far", "'larger'", 4));
        leave_out_far(&mut loaded, "a.glb".as_ref());
        assert_eq!(loaded.warnings.len(), 1);
    }

    #[test]
    fn triangles_that_rounding_has_collapsed_are_left_out_with_their_faces() {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X];
        let triangles = vec![[0, 1, 2], [1, 3, 2], [0, 2, 3]];
        let mut mesh = Mesh { positions, triangles, face_of_triangle: vec![0, 1, 2], ..Mesh::default() };
        assert_eq!(leave_out_collapsed(&mut mesh), 1);
        assert_eq!((mesh.triangles, mesh.face_of_triangle), (vec![[0, 1, 2], [0, 2, 3]], vec![0, 2]));
    }

    #[test]
    fn positions_out_of_range_do_not_move_the_center() {
        let placed = place(&[DVec3::ZERO, DVec3::ONE, DVec3::splat(1e300), DVec3::NAN]);
        assert!(placed.center.abs().max_element() <= 1.0);
        assert!(placed.positions[2].is_nan() && placed.positions[3].is_nan());
    }
}
