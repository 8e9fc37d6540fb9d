//! Skinned meshes, posed by their joints with linear blend skinning.
//!
//! The joints alone place a skinned mesh: the transform of its node is ignored. Joints stand where their nodes do, at rest or
//! animated.

use super::accessor::{Format, Pick, Reader, Unreadable};
use super::codes::Code;
use super::graph::Graph;
use super::links::is_bind_matrix;
use super::report::Report;
use super::scene::{Draw, PosedMesh};
use crate::math::frame::{center_of_most, spread};
use crate::math::{DMat3, DMat4, DVec3, Vec3};
use crate::scene::Mesh;
use crate::scene::mesh::normal_from_object;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Root, Skin as Source};
use std::collections::HashSet;

/// Pose of the meshes that use a skin.
pub(super) struct Skin {
    /// Transforms from mesh space to world space, for each joint.
    pub(super) matrices: Vec<DMat4>,
    /// Origin of posed positions, common to all meshes with this skin.
    pub(super) center: DVec3,
}

/// Loads the skins of the document, by index; `None` for unusable ones. `posed` lists the meshes that use them.
pub(super) fn load(reader: Reader, graph: &Graph, posed: &[PosedMesh], report: &mut Report) -> Vec<Option<Skin>> {
    let root = reader.root;
    let middles = middles(reader, posed);
    (0..root.skins.len())
        .map(|i| {
            check_skeleton(root, graph, i, report);
            let matrices = matrices_of(reader, graph, i, report)?;
            let posed = |matrix: &DMat4| matrix.transform_point3(middles[i]);
            let (lo, hi) = finite_bounds(matrices.iter().map(posed));
            let center = center_of_most(lo, hi, spread(matrices.len()).map(|joint| posed(&matrices[joint])));
            Some(Skin { matrices, center })
        })
        .collect()
}

/// Centre of the meshes of each skin, before posing, by a sample of their positions; zero without any.
///
/// Declared bounds are not used: they may be wrong, and those of normalized integers are integers.
fn middles(reader: Reader, posed: &[PosedMesh]) -> Vec<DVec3> {
    /// Positions sampled of an accessor: their middle need not be exact, and a file may have very many accessors.
    const SAMPLE: u32 = 32;
    let sample = |index: Index<Accessor>| {
        let count = u32::try_from(reader.root.accessors.get(index.value())?.count.0).ok()?;
        let wanted: Vec<u32> = (0..count).step_by(count.div_ceil(SAMPLE).max(1) as usize).collect();
        // What cannot be read is reported where the mesh is.
        reader.floats::<3>(index, Pick::Only(&wanted)).ok()
    };
    let positions = |primitive: &Primitive| primitive.attributes.get(&Checked::Valid(Semantic::Positions)).copied();
    let mut points: Vec<Vec<DVec3>> = vec![Vec::new(); reader.root.skins.len()];
    let mut sampled = HashSet::new();
    for posed in posed {
        let Some((skin, of_skin)) = posed.skin.and_then(|skin| Some((skin, points.get_mut(skin)?))) else { continue };
        let primitives = reader.root.meshes.get(posed.mesh).into_iter().flat_map(|mesh| &mesh.primitives);
        let new = primitives.filter_map(positions).filter(|index| sampled.insert((skin, index.value())));
        let places = new.filter_map(sample).flatten().map(|p| Vec3::from(p).as_dvec3());
        of_skin.extend(places.filter(|p| p.is_finite()));
    }
    let middle = |points: Vec<DVec3>| {
        let (lo, hi) = finite_bounds(points.iter().copied());
        if points.is_empty() { DVec3::ZERO } else { center_of_most(lo, hi, spread(points.len()).map(|i| points[i])) }
    };
    points.into_iter().map(middle).collect()
}

/// Minimum and maximum of the finite points.
fn finite_bounds(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.filter(|p| p.is_finite()).fold(empty, |(lo, hi), p| (lo.min(p), hi.max(p)))
}

fn matrices_of(reader: Reader, graph: &Graph, i: usize, report: &mut Report) -> Option<Vec<DMat4>> {
    let skin = reader.root.skins.get(i)?;
    let joints: Vec<DMat4> =
        skin.joints.iter().map(|joint| graph.world.get(joint.value()).copied().unwrap_or_default().into()).collect();
    let Some(index) = skin.inverse_bind_matrices else { return Some(joints) };
    let place = format!("skins[{i}].inverseBindMatrices");
    let accessor = reader.root.accessors.get(index.value())?;
    if !is_bind_matrix(Format::of(accessor)?) {
        return None;
    }
    // An accessor without data provides no matrices.
    if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
        return Some(joints);
    }
    // Reads only one matrix per joint: many skins may share one long list.
    let wanted: Vec<u32> = (0..u32::try_from(joints.len()).ok()?).collect();
    if accessor.count.0 < joints.len() as u64 {
        return None;
    }
    let inverse = match reader.floats::<16>(index, Pick::Only(&wanted)) {
        Ok(inverse) => inverse,
        Err(Unreadable::Nowhere(_) | Unreadable::Unknown) => return None,
        Err(Unreadable::Buffer(why)) => {
            report.warnings.push(why);
            return None;
        }
        Err(Unreadable::Data(code, text)) => {
            report.warn(code, place, text);
            return None;
        }
    };
    if inverse.iter().any(|m| [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0]) {
        report.add(Code::AccessorInvalidIbm, place, "the last row of a matrix is not 0 0 0 1");
    }
    let bind = |m: &[f32; 16]| {
        let mut m = DMat4::from_cols_array(&m.map(f64::from));
        (m.x_axis.w, m.y_axis.w, m.z_axis.w, m.w_axis.w) = (0.0, 0.0, 0.0, 1.0);
        m
    };
    Some(joints.iter().zip(&inverse).map(|(joint, m)| *joint * bind(m)).collect())
}

/// Warns of skins in a scene whose joints are not in that scene.
pub(super) fn check_scene(root: &Root, graph: &Graph, scene: usize, draws: &[Draw], report: &mut Report) {
    let Some(scene) = root.scenes.get(scene) else { return };
    let trees: HashSet<usize> = scene.nodes.iter().map(|node| graph.tree(node.value())).collect();
    let elsewhere = |skin: &Source| skin.joints.iter().any(|joint| !trees.contains(&graph.tree(joint.value())));
    let elsewhere: Vec<bool> = root.skins.iter().map(elsewhere).collect();
    let mut nodes: Vec<usize> = draws.iter().map(|draw| draw.node).collect();
    nodes.dedup();
    for i in nodes {
        let skin = root.nodes.get(i).and_then(|node| node.skin);
        if skin.is_some_and(|skin| elsewhere.get(skin.value()) == Some(&true)) {
            report.add(Code::NodeSkinNoScene, format!("nodes[{i}].skin"), "its joints are not in the scene");
        }
    }
}

/// Checks that the joints of a skin have a common root, and that `skeleton` is one.
fn check_skeleton(root: &Root, graph: &Graph, i: usize, report: &mut Report) {
    let Some(skin) = root.skins.get(i) else { return };
    let Some(span) = graph.span(skin.joints.iter().map(|joint| joint.value())) else { return };
    if !graph.is_one_tree(&span) {
        report.add(Code::SkinNoCommonRoot, format!("skins[{i}].joints"), "the joints hang on no common node");
    } else if let Some(skeleton) = skin.skeleton.filter(|s| !graph.holds(s.value(), &span)) {
        let text = format!("node {} is above not every joint", skeleton.value());
        report.add(Code::SkinSkeletonInvalid, format!("skins[{i}].skeleton"), text);
    }
}

/// Joints and weights of every vertex, in any number of sets of four.
#[derive(Default)]
pub(super) struct Influences {
    pub(super) joints: Vec<Vec<[u32; 4]>>,
    pub(super) weights: Vec<Vec<[f32; 4]>>,
}

/// Faults in the influences of a mesh.
#[derive(Default)]
pub(super) struct Oddities {
    pub(super) outside: bool,
    pub(super) negative: bool,
    pub(super) unequal: bool,
}

impl Influences {
    /// Weighted mean of the joint matrices at a vertex; the first joint's matrix if all weights are zero.
    fn blend(&self, vertex: usize, matrices: &[DMat4], odd: &mut Oddities) -> DMat4 {
        let (mut sum, mut total) = (DMat4::ZERO, 0.0);
        for (joints, weights) in self.joints.iter().zip(&self.weights) {
            let (Some(joints), Some(weights)) = (joints.get(vertex), weights.get(vertex)) else { continue };
            for (&joint, &weight) in joints.iter().zip(weights) {
                odd.negative |= weight < 0.0;
                // NaN counts as zero.
                if !(weight > 0.0 && weight.is_finite()) {
                    continue;
                }
                match matrices.get(joint as usize) {
                    Some(matrix) => {
                        sum += *matrix * f64::from(weight);
                        total += f64::from(weight);
                    }
                    None => odd.outside = true,
                }
            }
        }
        /// Tolerance of the sum: eight 8-bit weights may each be off by half a step.
        const WHOLE: f64 = 0.02;
        odd.unequal |= (total - 1.0).abs() > WHOLE;
        if total > 0.0 { sum * (1.0 / total) } else { matrices.first().copied().unwrap_or(DMat4::IDENTITY) }
    }
}

/// Poses a mesh by its joints. Its positions become relative to the skin's centre, so that vertices shared by several primitives
/// are rounded alike.
pub(super) fn pose(mesh: &mut Mesh, influences: &Influences, Skin { matrices, center }: &Skin) -> Oddities {
    let mut odd = Oddities::default();
    let mut placed = Vec::with_capacity(mesh.positions.len());
    let mut mirrored = vec![false; mesh.positions.len()];
    for (vertex, position) in mesh.positions.iter().enumerate() {
        let matrix = influences.blend(vertex, matrices, &mut odd);
        placed.push(matrix.transform_point3(position.as_dvec3()));
        let linear = DMat3::from_mat4(matrix);
        mirrored[vertex] = linear.determinant() < 0.0;
        if let Some(normal) = mesh.normals.get_mut(vertex) {
            *normal = unit(normal_from_object(&linear) * normal.as_dvec3(), *normal);
        }
        if let Some(tangent) = mesh.tangents.get_mut(vertex) {
            let direction = unit(linear * tangent.truncate().as_dvec3(), tangent.truncate());
            *tangent = direction.extend(if mirrored[vertex] { -tangent.w } else { tangent.w });
        }
    }
    // Mirroring joints turn faces inside out; glTF requires front faces to stay front faces.
    for triangle in &mut mesh.triangles {
        let inside_out = triangle.iter().filter(|v| mirrored.get(**v as usize) == Some(&true)).count();
        if inside_out >= 2 {
            triangle.swap(1, 2);
        }
    }
    mesh.positions = placed.iter().map(|p| (*p - *center).as_vec3()).collect();
    odd
}

fn unit(v: DVec3, otherwise: Vec3) -> Vec3 {
    v.try_normalize().map_or(otherwise, DVec3::as_vec3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DAffine3, Vec4};

    #[test]
    fn a_vertex_between_two_joints_goes_half_way_with_each() {
        let mut mesh = Mesh { positions: vec![Vec3::ZERO, Vec3::X], normals: vec![Vec3::Z; 2], ..Mesh::default() };
        let influences = Influences {
            joints: vec![vec![[0, 1, 9, 0], [1, 0, 0, 0]]],
            weights: vec![vec![[0.5, 0.5, 0.25, 0.0], [2.0, -1.0, 0.0, 0.0]]],
        };
        let matrices = [DMat4::IDENTITY, DAffine3::from_translation(DVec3::new(0.0, 2.0, 0.0)).into()];
        let skin = Skin { matrices: matrices.to_vec(), center: DVec3::Y };
        let odd = pose(&mut mesh, &influences, &skin);
        let at = |i: usize| mesh.positions[i].as_dvec3() + skin.center;
        assert_eq!(at(0), DVec3::new(0.0, 1.0, 0.0));
        assert_eq!(at(1), DVec3::new(1.0, 2.0, 0.0));
        assert!(odd.outside && odd.negative && odd.unequal);
    }

    /// Poses one triangle per joint, facing +z, with tangents along x.
    fn posed(matrices: &[DMat4]) -> Mesh {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let each = |k: u32| [3 * k, 3 * k + 1, 3 * k + 2];
        let mut mesh = Mesh {
            positions: matrices.iter().flat_map(|_| triangle).collect(),
            normals: vec![Vec3::Z; 3 * matrices.len()],
            tangents: vec![Vec3::X.extend(1.0); 3 * matrices.len()],
            triangles: (0..matrices.len() as u32).map(each).collect(),
            ..Mesh::default()
        };
        let joints = (0..matrices.len() as u32).flat_map(|k| [[k, 0, 0, 0]; 3]).collect();
        let weights = vec![[1.0, 0.0, 0.0, 0.0]; 3 * matrices.len()];
        let skin = Skin { matrices: matrices.to_vec(), center: DVec3::ZERO };
        pose(&mut mesh, &Influences { joints: vec![joints], weights: vec![weights] }, &skin);
        mesh
    }

    #[test]
    fn faces_of_joints_that_mirror_are_turned_round_and_no_others() {
        let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
        for matrices in [vec![DMat4::IDENTITY, mirror, mirror], vec![mirror, DMat4::IDENTITY, DMat4::IDENTITY]] {
            let mesh = posed(&matrices);
            for (k, matrix) in matrices.iter().enumerate() {
                let [a, b, c] = mesh.triangles[k].map(|v| mesh.positions[v as usize]);
                assert_eq!((b - a).cross(c - a).normalize(), Vec3::Z);
                assert_eq!(mesh.normals[3 * k], Vec3::Z);
                let side = if *matrix == mirror { -1.0 } else { 1.0 };
                assert_eq!(mesh.tangents[3 * k], Vec4::new(side, 0.0, 0.0, side));
            }
        }
    }

    #[test]
    fn what_a_joint_flattens_keeps_the_normal_of_where_it_turns_to() {
        let turned = DMat4::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        for height in [1.0, 1e-9, 0.0] {
            let mesh = posed(&[turned * DMat4::from_scale(DVec3::new(1.0, 1.0, height))]);
            assert!((mesh.normals[0] - Vec3::Y).length() < 1e-6, "{}", mesh.normals[0]);
        }
    }
}
