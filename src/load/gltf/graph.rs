//! The node hierarchy, which has to be a forest, and the world transform of each node, composed in `f64`.

use super::codes::Code;
use super::report::Report;
use super::schema::{list, position};
use super::tree::Value;
use crate::math::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use std::collections::HashMap;
use std::ops::Range;

/// Parents and transforms of all nodes, in a scene or not.
pub(super) struct Graph {
    /// The parent of each node.
    parents: Vec<Option<usize>>,
    /// For each node, the range of preorder numbers of its subtree; the first is the node's own.
    family: Vec<Range<usize>>,
    /// End of the number range of each tree, ascending.
    tree_ends: Vec<usize>,
    /// All nodes, parents before their children.
    order: Vec<usize>,
    /// Transforms from a node to its parent's space, as in the file.
    local: Vec<Local>,
    /// Transforms from a node to world space.
    pub(super) world: Vec<DAffine3>,
}

/// The transform of a node.
#[derive(Clone, Copy, Debug)]
enum Local {
    Matrix(DAffine3),
    Parts { translation: DVec3, rotation: DQuat, scale: DVec3 },
}

/// Replacements by an animation for a node's translation, rotation and scale.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Moved {
    pub(super) translation: Option<DVec3>,
    /// Unit length.
    pub(super) rotation: Option<DQuat>,
    pub(super) scale: Option<DVec3>,
}

impl Local {
    /// Transform of a node with animated parts; a matrix stays unchanged.
    fn affine(self, moved: Moved) -> DAffine3 {
        match self {
            Self::Matrix(affine) => affine,
            Self::Parts { translation, rotation, scale } => DAffine3::from_scale_rotation_translation(
                moved.scale.unwrap_or(scale),
                moved.rotation.unwrap_or(rotation),
                moved.translation.unwrap_or(translation),
            ),
        }
    }
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
        let order = order(&parents);
        let family = families(&parents, &order);
        let tops = order.iter().filter(|&&node| parents[node].is_none());
        let tree_ends = tops.map(|&node| family[node].end).collect();
        let mut graph = Self { world: Vec::new(), local, order, family, tree_ends, parents };
        graph.place(&HashMap::new());
        graph
    }

    /// Recomputes all world transforms with the animated parts of some nodes.
    pub(super) fn place(&mut self, moved: &HashMap<usize, Moved>) {
        let of = |node: usize| moved.get(&node).copied().unwrap_or_default();
        self.world = self.local.iter().enumerate().map(|(node, local)| local.affine(of(node))).collect();
        for &node in &self.order {
            if let Some(parent) = self.parents[node] {
                self.world[node] = self.world[parent] * self.world[node];
            }
        }
    }

    /// Returns whether a node's transform is a matrix, which has no parts to animate.
    pub(super) fn has_matrix(&self, node: usize) -> bool {
        matches!(self.local.get(node), Some(Local::Matrix(_)))
    }

    /// Returns the nodes without a parent.
    pub(super) fn roots(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.parents.len()).filter(|&i| self.parents[i].is_none())
    }

    /// Smallest range of preorder numbers that contains these nodes; `None` when there are none.
    pub(super) fn span(&self, nodes: impl Iterator<Item = usize>) -> Option<Range<usize>> {
        let numbers = nodes.filter_map(|node| Some(self.family.get(node)?.start));
        numbers.fold(None, |span: Option<Range<usize>>, n| {
            Some(span.map_or(n..n + 1, |s| s.start.min(n)..s.end.max(n + 1)))
        })
    }

    /// Returns whether all nodes of a span are in the subtree of this node.
    pub(super) fn holds(&self, node: usize, span: &Range<usize>) -> bool {
        self.family.get(node).is_some_and(|family| family.start <= span.start && span.end <= family.end)
    }

    /// Returns whether all nodes of a span are in one tree.
    pub(super) fn is_one_tree(&self, span: &Range<usize>) -> bool {
        self.tree_ends.get(self.tree_at(span.start)).is_some_and(|&end| span.end <= end)
    }

    /// Index of the tree that contains a node.
    pub(super) fn tree(&self, node: usize) -> usize {
        self.family.get(node).map_or(usize::MAX, |family| self.tree_at(family.start))
    }

    fn tree_at(&self, number: usize) -> usize {
        self.tree_ends.partition_point(|&end| end <= number)
    }
}

fn indices<'a>(value: &'a Value, name: &str) -> impl Iterator<Item = usize> + use<'a> {
    let list = value.get(name).and_then(Value::as_array).into_iter().flatten();
    list.filter_map(position)
}

fn parents(nodes: &[Value], report: &mut Report) -> Vec<Option<usize>> {
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        for (k, child) in indices(node, "children").enumerate() {
            match parents.get_mut(child) {
                Some(slot @ None) => *slot = Some(i),
                // A child listed twice by one node is reported as a duplicate.
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

/// Refuses every loop of parents, reporting each once.
fn refuse_loops(parents: &[Option<usize>], report: &mut Report) {
    // The first walk to visit each node; a walk that meets itself has found a loop.
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

/// Transform of one node, from its matrix or its translation, rotation and scale.
fn local(i: usize, node: &Value, report: &mut Report) -> Local {
    let trs = ["translation", "rotation", "scale"].iter().any(|name| node.get(name).is_some());
    if let Some(columns) = numbers::<16>(node, "matrix") {
        if trs {
            let text = "a matrix and translation, rotation or scale";
            report.add(Code::NodeMatrixTrs, format!("nodes[{i}].matrix"), text);
        }
        return Local::Matrix(from_columns(i, &columns, report));
    }
    let scale = numbers::<3>(node, "scale").map_or(DVec3::ONE, DVec3::from);
    let translation = numbers::<3>(node, "translation").map_or(DVec3::ZERO, DVec3::from);
    let rotation = numbers::<4>(node, "rotation").map_or(DQuat::IDENTITY, |q| unit(i, DQuat::from_array(q), report));
    Local::Parts { translation, rotation, scale }
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
    /// Largest cosine between orthogonal axes; rounding to six digits stays well below.
    const SQUARE: f64 = 1e-3;
    let skew = |a: DVec3, b: DVec3| a.dot(b).abs() > SQUARE * (a.length() * b.length());
    skew(m.x_axis, m.y_axis) || skew(m.y_axis, m.z_axis) || skew(m.x_axis, m.z_axis)
}

/// Normalises a quaternion; the identity for zero.
fn unit(i: usize, q: DQuat, report: &mut Report) -> DQuat {
    /// Tolerance of unit length; rounding to `f32` and to six digits stays below.
    const UNIT: f64 = 1e-3;
    let length = q.length();
    if (length - 1.0).abs() > UNIT {
        let text = format!("the rotation has length {length:.6}, not 1");
        report.add(Code::RotationNonUnit, format!("nodes[{i}].rotation"), text);
    }
    if length > 0.0 { q / length } else { DQuat::IDENTITY }
}

/// The `N` numbers of a property; `None` if it is missing or has another length.
fn numbers<const N: usize>(node: &Value, name: &str) -> Option<[f64; N]> {
    let list: Vec<f64> = node.get(name)?.as_array()?.iter().filter_map(Value::as_f64).collect();
    list.try_into().ok()
}

/// Sorts all nodes, parents before children, without recursion, however deep the hierarchy is.
///
/// The order within a loop does not matter: a loop has already refused the file.
fn order(parents: &[Option<usize>]) -> Vec<usize> {
    let mut seen = vec![false; parents.len()];
    let (mut order, mut chain) = (Vec::with_capacity(parents.len()), Vec::new());
    for start in 0..parents.len() {
        let mut next = Some(start);
        while let Some(node) = next.filter(|&n| !std::mem::replace(&mut seen[n], true)) {
            chain.push(node);
            next = parents[node];
        }
        order.extend(chain.drain(..).rev());
    }
    order
}

/// Assigns preorder numbers, by which every subtree is a contiguous range.
fn families(parents: &[Option<usize>], order: &[usize]) -> Vec<Range<usize>> {
    let mut sizes = vec![1; parents.len()];
    for &node in order.iter().rev() {
        if let Some(parent) = parents[node] {
            sizes[parent] += sizes[node];
        }
    }
    // Start of the next child's range for each node; the last entry is for nodes without a parent.
    let mut free = vec![0; parents.len() + 1];
    let mut families = vec![0..0; parents.len()];
    for &node in order {
        let start = &mut free[parents[node].unwrap_or(parents.len())];
        families[node] = *start..*start + sizes[node];
        *start += sizes[node];
        free[node] = families[node].start + 1;
    }
    families
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::path::Path;

    fn graph(nodes: serde_json::Value) -> (Graph, Vec<String>) {
        let mut report = Report::new(Path::new("a.gltf"));
        let graph = Graph::new(&json!({ "nodes": nodes }).into(), &mut report);
        let mut codes: Vec<String> = report.warnings.clone().into_vec().iter().map(|w| w.code.to_string()).collect();
        if let Err(crate::load::LoadError::Input(faults)) = report.check() {
            codes.extend(faults.iter().map(|f| format!("{} {} ×{}", f.code, f.place, f.count)));
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
    }

    #[test]
    fn a_moved_node_takes_its_children_along_and_keeps_what_is_not_moved() {
        let (mut graph, _) = graph(json!([
            {"children": [1], "translation": [1, 0, 0], "scale": [2, 2, 2]},
            {"translation": [0, 1, 0]},
            {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]},
        ]));
        let quarter = DQuat::from_array([0.0, 0.0, 0.5f64.sqrt(), 0.5f64.sqrt()]);
        let away = Moved { translation: Some(DVec3::Z), ..Moved::default() };
        let turned = Moved { rotation: Some(quarter), ..Moved::default() };
        graph.place(&HashMap::from([(0, turned), (1, away), (2, away)]));
        let at = |node: usize| graph.world[node].transform_point3(DVec3::X);
        assert!((at(0) - DVec3::new(1.0, 2.0, 0.0)).length() < 1e-12, "{}", at(0));
        assert!((at(1) - DVec3::new(1.0, 2.0, 2.0)).length() < 1e-12, "{}", at(1));
        assert_eq!(at(2), DVec3::new(6.0, 0.0, 0.0));
        assert!(graph.has_matrix(2) && !graph.has_matrix(0) && !graph.has_matrix(7));
    }

    #[test]
    fn what_hangs_on_a_node_is_known_by_a_range_of_numbers() {
        let (graph, _) = graph(json!([{"children": [3, 1]}, {"children": [4]}, {"children": [5]}, {}, {}, {}]));
        let span = |nodes: &[usize]| graph.span(nodes.iter().copied()).unwrap();
        for (node, under) in [(0, &[0, 1, 3, 4][..]), (1, &[1, 4]), (2, &[2, 5]), (3, &[3]), (4, &[4]), (5, &[5])] {
            for other in 0..6 {
                assert_eq!(graph.holds(node, &span(&[other])), under.contains(&other), "{node} {other}");
            }
        }
        assert!(graph.is_one_tree(&span(&[3, 4])) && !graph.holds(1, &span(&[3, 4])));
        assert!(!graph.is_one_tree(&span(&[3, 5])));
        assert!(graph.span([].into_iter()).is_none());
    }

    #[test]
    fn loops_and_second_parents_are_refused() {
        let (_, codes) = graph(json!([{"children": [1]}, {"children": [2]}, {"children": [0]}, {"children": [3]}]));
        assert_eq!(codes, ["gltf-node-loop nodes[0] ×2"]);
        let (_, codes) = graph(json!([{"children": [2]}, {"children": [2]}, {}]));
        assert_eq!(codes, ["gltf-node-parent-override nodes[1].children[0] ×1"]);
    }

    #[test]
    fn a_very_deep_hierarchy_needs_no_deep_stack() {
        let nodes: Vec<serde_json::Value> = (0..100_000)
            .map(|i| if i == 0 { json!({}) } else { json!({"children": [i - 1], "translation": [1, 0, 0]}) })
            .collect();
        let (graph, _) = graph(nodes.into());
        assert_eq!(graph.world[0].translation.x, 99_999.0);
    }

    #[test]
    fn odd_rotations_and_matrices_are_drawn_with_a_warning() {
        assert_eq!(graph(json!([{"rotation": [0, 0, 0, 0.5]}])).1, ["gltf-rotation-non-unit"]);
        let shear = json!([{"matrix": [1,0,0,0, 1,1,0,0, 0,0,1,0, 0,0,0,1], "scale": [1, 1, 1]}]);
        assert_eq!(graph(shear).1, ["gltf-node-matrix-trs", "gltf-node-matrix-non-trs"]);
    }
}
