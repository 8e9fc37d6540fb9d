//! Guesses the up axis: OBJ does not specify it, nor do PLY and STL.
//!
//! Without evidence the kind of file decides: an OBJ is +Y. There +Z is chosen only on evidence: a comment
//! that says so, a comment of a program known to write +Z, coordinates of a map, or a model that stands on z = 0 with a
//! flat bottom there, reaches to both sides of y = 0, and is not a thin plate (which may as well lean against a wall).

use crate::load::place::Placed;
use crate::math::DVec3;
use crate::math::frame::{half_of, spread};
use crate::scene::{Mesh, UpAxis};

/// Programs that write +Z unless told otherwise, as their comments name them, in lower case.
const Z_WRITERS: [&str; 14] = [
    "freecad",
    "openscad",
    "tinkercad",
    "solidworks",
    "cadquery",
    "cloudcompare",
    "metashape",
    "photoscan",
    "opendronemap",
    "contextcapture",
    "realitycapture",
    "pix4d",
    "qgis",
    "ifcopenshell",
];

/// Default up axis of an OBJ.
pub(in crate::load) const UNSAID: (UpAxis, &str) = (UpAxis::Y, "OBJ does not say, and nothing speaks for +Z");

/// Guesses from the comments, then from the shape of meshes around the centre of all vertices, or else takes
/// `otherwise`; the text is the reason.
pub(in crate::load) fn guess(
    comments: &[String],
    meshes: &[Mesh],
    placed: &Placed,
    otherwise: (UpAxis, &str),
) -> (UpAxis, String) {
    for comment in comments {
        if let Some(axis) = stated_axis(comment) {
            return (axis, format!("a comment says so: '{comment}'"));
        }
    }
    let writes_z = |c: &&String| Z_WRITERS.iter().any(|w| c.to_lowercase().contains(w));
    if let Some(comment) = comments.iter().find(writes_z) {
        return (UpAxis::Z, format!("written by a program that uses +Z: '{comment}'"));
    }
    if lies_on_a_map(placed) {
        return (UpAxis::Z, "x and y are eastings and northings, as on maps, and z is a height".into());
    }
    if stands_on_z(meshes, placed.center) {
        return (UpAxis::Z, "it stands on z = 0 with a flat bottom there".into());
    }
    (otherwise.0, otherwise.1.into())
}

/// Up axis that a comment states, in whole words: `z-up`, `Y_UP`, `Up Axis: Z`, `zup`, but not `copy_updated`.
fn stated_axis(comment: &str) -> Option<UpAxis> {
    let text = comment.to_lowercase();
    let words: Vec<&str> = text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let says = |axis: &str| {
        let joined = [format!("{axis}up"), format!("upaxis{axis}"), format!("axis{axis}")];
        let at = |words: &[&str]| match words {
            ["up", a, ..] if *a == joined[2] => true,
            [a, "up", ..] if *a == axis => true,
            ["up", "axis", a, ..] | ["upaxis", a, ..] | ["up", "is", a, ..] if *a == axis => true,
            [a, ..] => joined[..2].iter().any(|joined| a == joined),
            [] => false,
        };
        (0..words.len()).any(|start| at(&words[start..]))
    };
    [(UpAxis::Z, "z"), (UpAxis::Y, "y")].into_iter().find_map(|(axis, name)| says(name).then_some(axis))
}

/// Whether x and y of most vertices are as large as metres on maps, and z is not: the origin of a national grid lies
/// outside of its country.
fn lies_on_a_map(placed: &Placed) -> bool {
    /// Least distance from the origin of a grid, and greatest height on Earth, in metres.
    const FAR: f64 = 1e5;
    const HIGH: f64 = 1e4;
    let place = |i: usize| placed.positions[i].as_dvec3() + placed.center;
    let is_far = |lo: f64, hi: f64| lo > FAR || hi < -FAR;
    half_of(spread(placed.positions.len()).map(place))
        .is_some_and(|(lo, hi)| is_far(lo.x, hi.x) && is_far(lo.y, hi.y) && -HIGH < lo.z && hi.z < HIGH)
}

/// Whether the shape stands on z = 0 and not on, or behind, y = 0.
fn stands_on_z(meshes: &[Mesh], center: DVec3) -> bool {
    /// Tolerance of touching, relative to the size.
    const TOUCH: f64 = 1e-4;
    /// Smallest share of a bottom in the whole surface.
    const BOTTOM: f64 = 0.02;
    let points = meshes.iter().flat_map(|m| &m.positions).map(|p| p.as_dvec3() + center);
    let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let size = hi - lo;
    let touch = TOUCH * size.max_element();
    let both_sides = lo.y < -0.25 * size.y && hi.y > 0.25 * size.y;
    let on_zero = lo.z.abs() <= touch && size.z >= 0.25 * size.x.max(size.y);
    if !(both_sides && on_zero) {
        return false;
    }

    let (mut whole, mut on_z, mut on_y) = (0.0, 0.0, 0.0);
    for mesh in meshes {
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3() + center);
            let area = (b - a).cross(c - a).length();
            let highest = a.max(b).max(c);
            whole += area;
            on_z += if highest.z <= lo.z + touch { area } else { 0.0 };
            on_y += if highest.y <= lo.y + touch { area } else { 0.0 };
        }
    }
    on_z >= BOTTOM * whole && on_y < 0.25 * on_z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    fn up(comments: &[&str], mesh: &Mesh) -> UpAxis {
        let comments: Vec<_> = comments.iter().map(|&c| c.to_owned()).collect();
        guess(&comments, std::slice::from_ref(mesh), &Placed::default(), UNSAID).0
    }

    /// A pyramid with its square bottom at height 0 of axis `up`, and its mirror image.
    fn pyramid(up: usize) -> Mesh {
        let corners = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]];
        let turn = |[a, b, c]: [f32; 3]| if up == 2 { Vec3::new(a, b, c) } else { Vec3::new(b, c, a) };
        let triangles = vec![[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        Mesh { positions: corners.map(turn).to_vec(), triangles, ..Mesh::default() }
    }

    #[test]
    fn eastings_and_northings_speak_for_z() {
        let at = |x: f64, y: f64, z: f64| {
            let mut positions = vec![Vec3::ZERO, Vec3::new(600.0, 600.0, 80.0), Vec3::new(20.0, 7.0, 30.0)];
            positions.resize(9, Vec3::ONE);
            // A stray vertex at 0.
            positions.push(-DVec3::new(x, y, z).as_vec3());
            guess(&[], &[], &Placed { center: DVec3::new(x, y, z), positions, ..Placed::default() }, UNSAID).0
        };
        assert_eq!([at(432_100.0, 5_411_222.0, 302.0), at(-3.2e5, -1.1e6, 0.0)], [UpAxis::Z; 2]);
        // Heights along y, and objects that are merely far away.
        assert_eq!([at(432_100.0, 302.0, 5_411_222.0), at(1e5, 1e5, 1e5), at(0.0, 0.0, 0.0)], [UpAxis::Y; 3]);
        assert_eq!(guess(&[], &[], &Placed::default(), UNSAID).0, UpAxis::Y, "nothing is nowhere");
    }

    #[test]
    fn comments_decide_first() {
        assert_eq!(up(&["Exported, Up Axis: Z"], &pyramid(1)), UpAxis::Z);
        assert_eq!(up(&["y-up"], &pyramid(2)), UpAxis::Y);
        assert_eq!(up(&["+Y_UP"], &pyramid(2)), UpAxis::Y);
        for said in ["zUp", "UpAxisZ", "up_axisZ", "up-axis=Z", "Z is... up: +Z-up"] {
            assert_eq!(up(&[said], &pyramid(1)), UpAxis::Z, "{said}");
        }
        assert_eq!(up(&["FreeCAD v0.21"], &pyramid(1)), UpAxis::Z);
        assert_eq!(up(&["Created by Upton, FreeCAD"], &pyramid(1)), UpAxis::Z);
        for name in ["body_copy_updated", "battery-upper-case", "key up", "Exported by UP Studio"] {
            assert_eq!(up(&[name], &pyramid(2)), UpAxis::Z, "{name}");
        }
        assert_eq!([up(&["object quartz_upper"], &pyramid(1)), up(&["Hertz Up"], &pyramid(1))], [UpAxis::Y; 2]);
        assert_eq!(up(&["Blender v2.9 OBJ File"], &pyramid(1)), UpAxis::Y);
    }

    #[test]
    fn a_flat_bottom_on_the_ground_decides_next() {
        assert_eq!(up(&[], &pyramid(2)), UpAxis::Z);
        assert_eq!(up(&[], &pyramid(1)), UpAxis::Y);
    }

    #[test]
    fn without_evidence_y_is_up() {
        let mut raised = pyramid(2);
        raised.positions.iter_mut().for_each(|p| p.z += 0.5);
        assert_eq!(up(&[], &raised), UpAxis::Y);
        assert_eq!(up(&[], &Mesh::default()), UpAxis::Y);
    }
}
