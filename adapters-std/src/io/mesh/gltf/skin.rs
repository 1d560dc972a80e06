//! Skins: joints with their frames in the bind pose, and the weights with which they move the vertices.
//!
//! The transform of a node with a skin means nothing; its mesh is where its joints put it. The mesh is read in the bind
//! pose, placed so that its first root joint stands where the scene has it: by that joint's transform times its inverse
//! bind matrix. Those matrices are `f32`, so that the product is known to seven digits only; where it agrees to `f32`'s
//! precision with no transform, or with that of a node above the joint, as it does in files as programs write them, the
//! placement is that one, exactly.

use glam::{DAffine3, DMat3, DVec3};

use super::super::Joint;
use super::accessor::{Document, Values};
use super::json::{Object, index_below};
use super::nodes::Nodes;
use super::placement::Placement;
use super::problem::{Problem, Within};
use super::view::Component;

/// Most groups of four joints that move a vertex; programs write one or two.
pub(super) const MAX_SETS: usize = 64;

/// A skin as it is read.
pub(super) struct ReadSkin {
    pub joints: Vec<Joint>,
    /// For each joint in the order of the document, its index in `joints`.
    pub slots: Vec<u32>,
    pub placement: Placement,
    /// Joints that the scene shows in another pose than the bind pose.
    pub n_posed: usize,
}

/// The skin `index` of the document.
pub(super) fn skin(document: &Document<'_>, nodes: &Nodes<'_>, index: u64) -> Result<ReadSkin, Problem> {
    let (index, object) = document.listed("skins", index)?;
    read(document, nodes, object).at_root(|| format!("skins[{index}]"))
}

fn read(document: &Document<'_>, nodes: &Nodes<'_>, object: Object<'_>) -> Result<ReadSkin, Problem> {
    let n_nodes = nodes.objects.len();
    document.charge(n_nodes as u64).within(|| "joints".into())?;
    let list = object.list("joints")?;
    // For each node the position in the list.
    let mut position_of = vec![None; n_nodes];
    let mut joint_nodes = Vec::with_capacity(list.len());
    for (position, value) in list.iter().enumerate() {
        let place = || format!("joints[{position}]");
        let node = index_below(value, n_nodes, "nodes").within(place)?;
        if position_of[node].replace(position).is_some() {
            return Err(Problem::at(place(), format!("nodes[{node}] is listed a second time")));
        }
        joint_nodes.push(node);
    }
    if joint_nodes.is_empty() {
        return Err(Problem::at("joints", "there is none; a skin has at least one"));
    }
    let inverses = inverse_binds(document, object, joint_nodes.len())?;
    let parents = joint_parents(nodes, &position_of, &joint_nodes);
    let order = parents_first(&parents);
    let mut slots = vec![0; order.len()];
    order.iter().enumerate().for_each(|(slot, &position)| slots[position] = slot as u32);

    let to_scene = |position: usize| nodes.worlds[joint_nodes[position]] * inverses[position];
    let root = order[0];
    let computed = to_scene(root);
    let above = nodes.above(joint_nodes[root]).map(|node| nodes.worlds[node]);
    let reach = inverses[root].inverse().translation.length();
    let known = std::iter::once(DAffine3::IDENTITY).chain(above).find(|known| agree(*known, computed, reach, 1e-5));
    let world = known.unwrap_or(computed);
    let placement = Placement::of(world);
    let mut joints = Vec::with_capacity(order.len());
    let mut n_posed = 0;
    for &position in &order {
        let bind = inverses[position].inverse();
        n_posed += usize::from(!agree(world, to_scene(position), bind.translation.length(), 1e-4));
        let frame = placement.frame(bind);
        if !frame.as_flattened().iter().all(|x| x.is_finite()) {
            let problem = format!("the matrix of joint {position} has no inverse, or its node is scaled to nothing");
            return Err(Problem::at("inverseBindMatrices", problem));
        }
        let name = nodes.objects[joint_nodes[position]].text("name").within(|| format!("joints[{position}]"))?;
        let parent = parents[position].map(|parent| slots[parent]);
        joints.push(Joint { name: name.unwrap_or_default().to_owned(), parent, bind: frame });
    }
    Ok(ReadSkin { joints, slots, placement, n_posed })
}

/// The matrices from the space of the mesh to those of the joints; without them nothing is moved.
fn inverse_binds(document: &Document<'_>, skin: Object<'_>, n_joints: usize) -> Result<Vec<DAffine3>, Problem> {
    let Some(accessor) = skin.whole("inverseBindMatrices")? else { return Ok(vec![DAffine3::IDENTITY; n_joints]) };
    let read = || {
        let values = document.values(accessor, &["MAT4"])?;
        if values.component != Component::F32 || values.len() < n_joints {
            let problem = format!("{} matrices for {n_joints} joints; as many of f32 are expected", values.len());
            return Err(Problem::here(problem));
        }
        let mut matrices = Vec::with_capacity(n_joints);
        for (joint, matrix) in values.elements::<16>().iter().take(n_joints).enumerate() {
            let [x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3, t0, t1, t2, t3] = *matrix;
            if [x3, y3, z3, t3] != [0.0, 0.0, 0.0, 1.0] || !matrix.iter().all(|x| x.is_finite()) {
                let problem = format!("the matrix of joint {joint} is no affine transform, whose last row is 0 0 0 1");
                return Err(Problem::here(problem).with(values.datum(joint, 0)));
            }
            let columns = [[x0, x1, x2], [y0, y1, y2], [z0, z1, z2]].map(DVec3::from);
            let matrix3 = DMat3::from_cols(columns[0], columns[1], columns[2]);
            matrices.push(DAffine3 { matrix3, translation: DVec3::new(t0, t1, t2) });
        }
        Ok(matrices)
    };
    read().within(|| "inverseBindMatrices".into())
}

/// For each joint the nearest joint above it.
fn joint_parents(nodes: &Nodes<'_>, position_of: &[Option<usize>], joint_nodes: &[usize]) -> Vec<Option<usize>> {
    let mut above: Vec<Option<usize>> = vec![None; position_of.len()];
    for &node in &nodes.order {
        above[node] = nodes.parents[node].and_then(|parent| position_of[parent].or(above[parent]));
    }
    joint_nodes.iter().map(|&node| above[node]).collect()
}

/// The joints in their order when parents stand in front of their children in it; else sorted by their depth.
fn parents_first(parents: &[Option<usize>]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..parents.len()).collect();
    if parents.iter().enumerate().any(|(joint, parent)| parent.is_some_and(|parent| parent > joint)) {
        let depths = depths(parents);
        order.sort_by_key(|&joint| depths[joint]);
    }
    order
}

/// The number of joints above each.
fn depths(parents: &[Option<usize>]) -> Vec<usize> {
    let mut depths: Vec<Option<usize>> = vec![None; parents.len()];
    let mut chain = Vec::new();
    for joint in 0..parents.len() {
        let mut at = Some(joint);
        while let Some(open) = at.filter(|&open| depths[open].is_none()) {
            chain.push(open);
            at = parents[open];
        }
        let mut depth = at.and_then(|known| depths[known]).map_or(0, |depth| depth + 1);
        while let Some(open) = chain.pop() {
            depths[open] = Some(depth);
            depth += 1;
        }
    }
    depths.into_iter().map(|depth| depth.unwrap_or(0)).collect()
}

/// Whether two transforms are the same but for a relative `tolerance`, over points as far as `reach` from the origin.
fn agree(a: DAffine3, b: DAffine3, reach: f64, tolerance: f64) -> bool {
    let largest = |matrix: DMat3| matrix.to_cols_array().iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let linear = largest(b.matrix3);
    let shift = tolerance * (linear * reach + b.translation.length());
    largest(a.matrix3 - b.matrix3) <= tolerance * linear && (a.translation - b.translation).length() <= shift
}

/// The joints that move a vertex, as positions in the skin's list, and their weights.
type Influences = Vec<(u32, f64)>;

/// The influences of each vertex.
///
/// Also the number of vertices whose weights had to be divided by their sum, because it was not 1.
pub(super) fn influences(
    document: &Document<'_>,
    attributes: Object<'_>,
    n_vertices: usize,
    slots: &[u32],
) -> Result<(Vec<Influences>, usize), Problem> {
    let mut influences: Vec<Influences> = vec![Vec::new(); n_vertices];
    for set in 0..=MAX_SETS {
        let (joints_key, weights_key) = (format!("JOINTS_{set}"), format!("WEIGHTS_{set}"));
        let (joints, weights) = match (attributes.whole(&joints_key)?, attributes.whole(&weights_key)?) {
            (Some(joints), Some(weights)) => (joints, weights),
            (None, None) => break,
            (Some(_), None) => return Err(Problem::at(weights_key, format!("it is missing beside {joints_key}"))),
            (None, Some(_)) => return Err(Problem::at(joints_key, format!("it is missing beside {weights_key}"))),
        };
        if set == MAX_SETS {
            return Err(Problem::at(joints_key, format!("more than {} joints for a vertex", 4 * MAX_SETS)));
        }
        let four = |key: &str, accessor: u64| -> Result<Values, Problem> {
            let values = document.values(accessor, &["VEC4"]).within(|| key.to_owned())?;
            if values.len() != n_vertices {
                return Err(Problem::at(key, format!("{} elements for {n_vertices} vertices", values.len())));
            }
            Ok(values)
        };
        let (joints, weights) = (four(&joints_key, joints)?, four(&weights_key, weights)?);
        let pairs = joints.numbers.iter().zip(&weights.numbers).enumerate().filter(|(_, (_, weight))| **weight != 0.0);
        for (number, (&joint, &weight)) in pairs {
            let (vertex, at) = (number / 4, number % 4);
            if !(weight > 0.0 && weight < f64::INFINITY) {
                let problem = format!("the weight {weight} of vertex {vertex}; 0 to 1 is expected");
                return Err(Problem::at(weights_key, problem).with(weights.datum(vertex, at)));
            }
            let Some(slot) = slots.get(joint as usize).filter(|_| joint >= 0.0 && joint.fract() == 0.0) else {
                let problem = format!("joint {joint} moves vertex {vertex}, but the skin has {}", slots.len());
                return Err(Problem::at(joints_key, problem).with(joints.datum(vertex, at)));
            };
            match influences[vertex].iter_mut().find(|(known, _)| known == slot) {
                Some((_, known)) => *known += weight,
                None => influences[vertex].push((*slot, weight)),
            }
        }
    }
    let n_divided = influences.iter_mut().map(|weights| usize::from(divided_by_sum(weights))).sum();
    Ok((influences, n_divided))
}

/// Makes the weights sum to 1 where they do not but for rounding; says whether they had to be changed.
pub(super) fn divided_by_sum(weights: &mut [(u32, f64)]) -> bool {
    let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
    // The format's own tolerance.
    if weights.is_empty() || (sum - 1.0).abs() <= 2e-7 * weights.len() as f64 {
        return false;
    }
    weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_come_behind_their_parents() {
        assert_eq!(parents_first(&[None, Some(0), Some(0)]), [0, 1, 2]);
        assert_eq!(parents_first(&[Some(1), Some(3), None, None]), [2, 3, 1, 0]);
        assert_eq!(depths(&[Some(1), Some(3), None, None]), [2, 1, 0, 0]);
    }

    #[test]
    fn transforms_agree_relative_to_what_they_move() {
        let shifted = |x: f64| DAffine3::from_translation(DVec3::new(x, 0.0, 0.0));
        assert!(agree(shifted(0.0), shifted(0.001), 1000.0, 1e-5));
        assert!(!agree(shifted(0.0), shifted(0.1), 1000.0, 1e-5));
        assert!(!agree(DAffine3::IDENTITY, DAffine3::from_scale(DVec3::splat(0.001)), 1.0, 1e-5));
    }

    #[test]
    fn weights_are_divided_only_where_their_sum_is_not_one() {
        let mut weights = vec![(0, 0.25), (1, 0.75 + 1e-7)];
        assert!(!divided_by_sum(&mut weights));
        assert_eq!(weights[1].1, 0.75 + 1e-7);
        let mut weights = vec![(0, 1.0), (1, 3.0)];
        assert!(divided_by_sum(&mut weights));
        assert_eq!(weights, [(0, 0.25), (1, 0.75)]);
        assert!(!divided_by_sum(&mut []));
    }
}
