//! The tree of nodes: who is below whom, where each stands, and which are shown.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use super::accessor::Document;
use super::json::{Object, checked_index, index_below};
use super::problem::{Problem, Within};

/// The nodes of a document.
pub(super) struct Nodes<'a> {
    pub objects: Vec<Object<'a>>,
    pub parents: Vec<Option<usize>>,
    /// The transform of each node into the axes of the scene, metres.
    pub worlds: Vec<DAffine3>,
    /// All nodes, parents before children.
    pub order: Vec<usize>,
    /// The nodes of the scene, a node in front of its children and those in the order in which it lists them.
    pub shown: Vec<usize>,
}

impl<'a> Nodes<'a> {
    /// The nodes of the document. Those of its scene are shown; of a document without scenes, all.
    pub(super) fn of(document: &Document<'a>) -> Result<Self, Problem> {
        let list = document.root.list("nodes")?;
        let n = list.len();
        let mut objects = Vec::with_capacity(n);
        let mut children = Vec::with_capacity(n);
        let mut parents = vec![None; n];
        for (index, value) in list.iter().enumerate() {
            let object = Object::of(value).within(|| format!("nodes[{index}]"))?;
            let below = children_of(object, index, &mut parents).within(|| format!("nodes[{index}]"))?;
            children.push(below);
            objects.push(object);
        }
        let roots: Vec<usize> = (0..n).filter(|&node| parents[node].is_none()).collect();
        let order = preorder(&roots, &children);
        if order.len() < n {
            let mut reached = vec![false; n];
            order.iter().for_each(|&node| reached[node] = true);
            let node = reached.iter().position(|reached| !reached).unwrap_or(0);
            return Err(Problem::at(format!("nodes[{node}]"), "it is below itself: nodes form trees"));
        }
        let mut worlds = vec![DAffine3::IDENTITY; n];
        for &node in &order {
            let local = local(objects[node]).within(|| format!("nodes[{node}]"))?;
            worlds[node] = parents[node].map_or(local, |parent| worlds[parent] * local);
        }
        let shown = match scene(document)? {
            None => order.clone(),
            Some(roots) => {
                let mut reached = vec![false; n];
                roots.iter().for_each(|&node| reached[node] = true);
                for &node in &order {
                    if parents[node].is_some_and(|parent| reached[parent])
                        && std::mem::replace(&mut reached[node], true)
                    {
                        let problem = "the scene lists it and a node above it: list roots alone";
                        return Err(Problem::at(format!("nodes[{node}]"), problem));
                    }
                }
                preorder(&roots, &children)
            }
        };
        Ok(Nodes { objects, parents, worlds, order, shown })
    }

    /// The nodes above this one, the nearest first.
    pub(super) fn above(&self, node: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(self.parents[node], |&node| self.parents[node])
    }
}

fn children_of(object: Object<'_>, parent: usize, parents: &mut [Option<usize>]) -> Result<Vec<usize>, Problem> {
    let list = object.list("children")?;
    let mut children = Vec::with_capacity(list.len());
    for (position, value) in list.iter().enumerate() {
        let place = || format!("children[{position}]");
        let child = index_below(value, parents.len(), "nodes").within(place)?;
        if let Some(other) = parents[child].replace(parent) {
            let problem = format!("nodes[{child}] is already below nodes[{other}]: nodes form trees");
            return Err(Problem::at(place(), problem));
        }
        children.push(child);
    }
    Ok(children)
}

/// The roots and all below them, each in front of its children. Every node has one parent at most, so none comes twice.
fn preorder(roots: &[usize], children: &[Vec<usize>]) -> Vec<usize> {
    let mut order = Vec::new();
    let mut open: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(node) = open.pop() {
        order.push(node);
        open.extend(children[node].iter().rev());
    }
    order
}

/// The nodes that the scene lists.
fn scene(document: &Document<'_>) -> Result<Option<Vec<usize>>, Problem> {
    let index = document.root.whole("scene")?;
    if index.is_none() && document.root.list("scenes")?.is_empty() {
        return Ok(None);
    }
    let (index, scene) = document.listed("scenes", index.unwrap_or(0)).within(|| "scene".into())?;
    let n_nodes = document.root.list("nodes")?.len();
    let mut roots = Vec::new();
    let mut listed = vec![false; n_nodes];
    for (position, value) in scene.list("nodes").within(|| format!("scenes[{index}]"))?.iter().enumerate() {
        let place = || format!("scenes[{index}].nodes[{position}]");
        let node = index_below(value, n_nodes, "nodes").within(place)?;
        if std::mem::replace(&mut listed[node], true) {
            return Err(Problem::at(place(), format!("nodes[{node}] is listed a second time")));
        }
        roots.push(node);
    }
    Ok(Some(roots))
}

/// The transform of a node into its parent: a matrix by columns, or translation, rotation (quaternion) and scale.
fn local(node: Object<'_>) -> Result<DAffine3, Problem> {
    if let Some(matrix) = node.numbers::<16>("matrix")? {
        let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, t0, t1, t2, t3] = matrix;
        if [x3, y3, z3, t3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(Problem::at("matrix", "its last row is not 0 0 0 1: it is no affine transform"));
        }
        let columns = [[x0, x1, x2], [y0, y1, y2], [z0, z1, z2]].map(DVec3::from);
        let matrix = DMat3::from_cols(columns[0], columns[1], columns[2]);
        return Ok(DAffine3 { matrix3: matrix, translation: DVec3::new(t0, t1, t2) });
    }
    let translation = node.numbers::<3>("translation")?.map_or(DVec3::ZERO, DVec3::from);
    let scale = node.numbers::<3>("scale")?.map_or(DVec3::ONE, DVec3::from);
    let rotation = match node.numbers::<4>("rotation")? {
        None => DQuat::IDENTITY,
        Some(parts) => {
            let rotation = DQuat::from_array(parts);
            let length = rotation.length();
            if !(0.9..1.1).contains(&length) {
                return Err(Problem::at("rotation", format!("a quaternion of length {length}; 1 is expected")));
            }
            rotation.normalize()
        }
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

/// The index of a mesh or skin that a node uses, checked against the document.
pub(super) fn used(document: &Document<'_>, node: Object<'_>, key: &str, list: &str) -> Result<Option<usize>, Problem> {
    let Some(index) = node.whole(key)? else { return Ok(None) };
    checked_index(index, document.root.list(list)?.len(), list).within(|| key.to_owned()).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};
    use std::path::Path;

    fn with_nodes<T>(root: Value, then: impl FnOnce(Nodes<'_>) -> T) -> Result<T, String> {
        let said = |problem: Problem| problem.to_string();
        let document = Document::new(&root, None, 0, Path::new("a")).map_err(said)?;
        Nodes::of(&document).map(then).map_err(said)
    }

    #[test]
    fn transforms_go_down_the_tree_and_the_scene_gives_the_order() {
        let half = 0.5f64.sqrt();
        let root = json!({
            "nodes": [
                {"translation": [1, 2, 3], "children": [3, 1]},
                {"scale": [2, 2, 2]},
                {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
                {"rotation": [0, 0, half, half]},
            ],
            "scenes": [{"nodes": [1]}, {"nodes": [2, 0]}], "scene": 1,
        });
        with_nodes(root, |nodes| {
            assert_eq!(nodes.shown, [2, 0, 3, 1]);
            assert_eq!(nodes.worlds[1].transform_point3(DVec3::X), DVec3::new(3.0, 2.0, 3.0));
            assert_eq!(nodes.worlds[2].transform_point3(DVec3::ZERO), DVec3::new(5.0, 6.0, 7.0));
            assert!(nodes.worlds[3].transform_point3(DVec3::X).distance(DVec3::new(1.0, 3.0, 3.0)) < 1e-15);
            assert_eq!(nodes.above(3).collect::<Vec<_>>(), [0]);
        })
        .unwrap();
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        for (root, message) in [
            (json!({"nodes": [{"children": [1]}, {"children": [0]}]}), "nodes[0]: it is below itself"),
            (json!({"nodes": [{}, {"children": [1]}]}), "nodes[1]: it is below itself"),
            (json!({"nodes": [{"children": [2]}, {"children": [2]}, {}]}), "nodes[1].children[0]: nodes[2] is already"),
            (json!({"nodes": [{"children": [1]}]}), "nodes[0].children[0]: it names nodes[1], but there are 1"),
            (json!({"nodes": [{"children": 1}]}), "nodes[0].children: 1 where a list"),
            (json!({"nodes": [7]}), "nodes[0]: 7 where an object"),
            (json!({"nodes": [{}], "scenes": [{"nodes": [1]}]}), "scenes[0].nodes[0]: it names nodes[1]"),
            (json!({"nodes": [{}], "scenes": [{"nodes": [0, 0]}]}), "scenes[0].nodes[1]: nodes[0] is listed a second"),
            (
                json!({"nodes": [{"children": [1]}, {}], "scenes": [{"nodes": [0, 1]}]}),
                "nodes[1]: the scene lists it and",
            ),
            (json!({"scene": 1, "scenes": [{}]}), "scene: it names scenes[1]"),
            (json!({"nodes": [{"matrix": [1, 2]}]}), "nodes[0].matrix: a list of 2 where a list of 16 numbers"),
            (json!({"nodes": [{"matrix": [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2]}]}), "matrix: its last row"),
            (json!({"nodes": [{"rotation": [0, 0, 0, 0]}]}), "nodes[0].rotation: a quaternion of length 0"),
        ] {
            let error = with_nodes(root, |_| ()).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
