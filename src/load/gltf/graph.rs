//! The node hierarchy: a forest, or refused; and where each node stands, composed in `f64`.

use super::codes::Code;
use super::report::Report;
use super::schema::whole;
use crate::math::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use serde_json::Value;

/// Parents and places of all nodes, in a scene or not.
pub(super) struct Graph {
    /// The parent of each node.
    parents: Vec<Option<usize>>,
    /// From node to world space.
    pub(super) world: Vec<DAffine3>,
}

impl Graph {
    /// Checks the hierarchy and composes the transforms.
    ///
    /// Takes the JSON rather than the typed document, which would round numbers to `f32`.
    pub(super) fn new(root: &Value, report: &mut Report) -> Self {
        let nodes = list(root, "nodes");
        let parents = parents(nodes, report);
        refuse_loops(&parents, report);
        let local: Vec<_> = nodes.iter().enumerate().map(|(i, node)| local(i, node, report)).collect();
        check_scenes(root, &parents, report);
        Self { world: compose(&parents, &local), parents }
    }

    /// Nodes without a parent.
    pub(super) fn roots(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.parents.len()).filter(|&i| self.parents[i].is_none())
    }

    /// The parent of a node.
    pub(super) fn parent(&self, node: usize) -> Option<usize> {
        self.parents.get(node).copied().flatten()
    }

    /// The chain from a node up, itself first.
    pub(super) fn ancestors(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(node), |&n| self.parent(n))
    }
}

fn list<'a>(root: &'a Value, name: &str) -> &'a [Value] {
    root.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

fn indices<'a>(value: &'a Value, name: &str) -> impl Iterator<Item = usize> + use<'a> {
    let list = value.get(name).and_then(Value::as_array).into_iter().flatten();
    list.filter_map(|index| whole(index).and_then(|i| usize::try_from(i).ok()))
}

fn parents(nodes: &[Value], report: &mut Report) -> Vec<Option<usize>> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, child) in indices(node, "children").enumerate() {
            match parents.get_mut(child) {
                Some(slot @ None) => *slot = Some(i),
                // The same child twice in one list is told as a duplicate.
                Some(Some(other)) if *other != i => {
                    let text = format!("node {child} is already a child of node {other}");
                    report.add(Code::NodeParentOverride, format!("nodes[{i}].children[{k}]"), text);
                }
                _ => {}
            }
        }
    }
    parents
}

/// Refuses every loop of parents, each named once.
fn refuse_loops(parents: &[Option<usize>], report: &mut Report) {
    // Which walk came by first; a walk that meets itself has found a loop.
    let mut walk_of = vec![usize::MAX; parents.len()];
    for start in 0..parents.len() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|&n| walk_of[n] == usize::MAX) {
            walk_of[node] = start;
            next = parents[node];
        }
        if let Some(node) = next.filter(|&n| walk_of[n] == start) {
            report.add(Code::NodeLoop, format!("nodes[{node}]"), "the node is its own ancestor");
        }
    }
}

fn check_scenes(root: &Value, parents: &[Option<usize>], report: &mut Report) {
    for (i, scene) in list(root, "scenes").iter().enumerate() {
        for (k, node) in indices(scene, "nodes").enumerate() {
            if parents.get(node).is_some_and(Option::is_some) {
                let text = format!("node {node} is not a root of the hierarchy");
                report.add(Code::SceneNonRootNode, format!("scenes[{i}].nodes[{k}]"), text);
            }
        }
    }
}

/// The transform of one node, from its matrix or its translation, rotation and scale.
fn local(i: usize, node: &Value, report: &mut Report) -> DAffine3 {
    let trs = ["translation", "rotation", "scale"].iter().any(|name| node.get(*name).is_some());
    if let Some(columns) = numbers::<16>(node, "matrix") {
        if trs {
            let text = "a matrix and translation, rotation or scale";
            report.add(Code::NodeMatrixTrs, format!("nodes[{i}].matrix"), text);
        }
        return from_columns(i, &columns, report);
    }
    let scale = numbers::<3>(node, "scale").map_or(DVec3::ONE, DVec3::from);
    let translation = numbers::<3>(node, "translation").map_or(DVec3::ZERO, DVec3::from);
    let rotation = numbers::<4>(node, "rotation").map_or(DQuat::IDENTITY, |q| unit(i, DQuat::from_array(q), report));
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

fn from_columns(i: usize, columns: &[f64; 16], report: &mut Report) -> DAffine3 {
    let matrix = DMat4::from_cols_array(columns);
    let affine = DAffine3::from_mat4(matrix);
    let last_row = matrix.row(3);
    if last_row.to_array() != [0.0, 0.0, 0.0, 1.0] || is_sheared(affine.matrix3) {
        let text = "the matrix is not made of translation, rotation and scale";
        report.add(Code::NodeMatrixNonTrs, format!("nodes[{i}].matrix"), text);
    }
    affine
}

fn is_sheared(m: DMat3) -> bool {
    /// Cosine between axes that rounding to six digits leaves well below.
    const SQUARE: f64 = 1e-3;
    let skew = |a: DVec3, b: DVec3| a.dot(b).abs() > SQUARE * (a.length() * b.length());
    skew(m.x_axis, m.y_axis) || skew(m.y_axis, m.z_axis) || skew(m.x_axis, m.z_axis)
}

/// A unit quaternion in the same direction; none for zero.
fn unit(i: usize, q: DQuat, report: &mut Report) -> DQuat {
    /// Rounding to `f32` and to six digits stays below.
    const UNIT: f64 = 1e-3;
    let length = q.length();
    if (length - 1.0).abs() > UNIT {
        let text = format!("the rotation has length {length:.6}, not 1");
        report.add(Code::RotationNonUnit, format!("nodes[{i}].rotation"), text);
    }
    if length > 0.0 { q / length } else { DQuat::IDENTITY }
}

/// `N` numbers of a property.
fn numbers<const N: usize>(node: &Value, name: &str) -> Option<[f64; N]> {
    let list: Vec<f64> = node.get(name)?.as_array()?.iter().filter_map(Value::as_f64).collect();
    list.try_into().ok()
}

/// World transforms; parents before children, without recursion, however deep the hierarchy is.
fn compose(parents: &[Option<usize>], local: &[DAffine3]) -> Vec<DAffine3> {
    let mut world: Vec<Option<DAffine3>> = vec![None; local.len()];
    let mut chain = Vec::new();
    for start in 0..local.len() {
        let mut next = Some(start);
        // The limit ends loops, which have refused the file already.
        while let Some(node) = next.filter(|&n| world[n].is_none() && chain.len() <= local.len()) {
            chain.push(node);
            next = parents[node];
        }
        let mut above = next.and_then(|n| world[n]).unwrap_or(DAffine3::IDENTITY);
        while let Some(node) = chain.pop() {
            above *= local[node];
            world[node] = Some(above);
        }
    }
    world.into_iter().map(Option::unwrap_or_default).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    fn graph(nodes: Value) -> (Graph, Vec<String>) {
        let mut report = Report::new(Path::new("a.gltf"));
        let graph = Graph::new(&json!({ "nodes": nodes }), &mut report);
        let mut codes: Vec<String> = report.warnings.clone().into_vec().iter().map(|w| w.code.to_string()).collect();
        if let Err(crate::load::LoadError::Input(faults)) = report.check() {
            codes.extend(faults.iter().map(|f| format!("{} {}", f.code, f.place)));
        }
        (graph, codes)
    }

    #[test]
    fn a_child_stands_where_its_parents_put_it_and_keeps_the_digits_of_doubles() {
        let (graph, codes) = graph(json!([
            {"translation": [0, 0, 1]},
            {"children": [0], "scale": [2, 2, -2]},
            {"children": [1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 6378137.0625,0,0,1]},
        ]));
        assert!(codes.is_empty(), "{codes:?}");
        assert_eq!(graph.world[0].transform_point3(DVec3::X), DVec3::new(6378139.0625, 0.0, -2.0));
        assert_eq!(graph.roots().collect::<Vec<_>>(), [2]);
        assert_eq!(graph.ancestors(0).collect::<Vec<_>>(), [0, 1, 2]);
    }

    #[test]
    fn loops_and_second_parents_are_refused() {
        let (_, codes) = graph(json!([{"children": [1]}, {"children": [2]}, {"children": [0]}, {"children": [3]}]));
        assert_eq!(codes, ["gltf-node-loop nodes[0]", "gltf-node-loop nodes[3]"]);
        let (_, codes) = graph(json!([{"children": [2]}, {"children": [2]}, {}]));
        assert_eq!(codes, ["gltf-node-parent-override nodes[1].children[0]"]);
    }

    #[test]
    fn a_very_deep_hierarchy_needs_no_deep_stack() {
        let nodes: Vec<Value> = (0..100_000)
            .map(|i| if i == 0 { json!({}) } else { json!({"children": [i - 1], "translation": [1, 0, 0]}) })
            .collect();
        let (graph, _) = graph(Value::Array(nodes));
        assert_eq!(graph.world[0].translation.x, 99_999.0);
    }

    #[test]
    fn odd_rotations_and_matrices_are_drawn_with_a_warning() {
        assert_eq!(graph(json!([{"rotation": [0, 0, 0, 0.5]}])).1, ["gltf-rotation-non-unit"]);
        let shear = json!([{"matrix": [1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1], "scale": [1, 1, 1]}]);
        assert_eq!(graph(shear).1, ["gltf-node-matrix-trs", "gltf-node-matrix-non-trs"]);
    }
}
