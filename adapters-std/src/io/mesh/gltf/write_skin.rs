//! The skin of a document: joints as nodes below one that scales to metres, inverse bind matrices, joints and weights of
//! the vertices in groups of four.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::buffer::Target;
use gltf_json::mesh::Semantic;
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Node};

use super::super::losses::Rounding;
use super::super::{Joint, Skin};
use super::skin::{MAX_SETS, divided_by_sum};
use super::write::{Attributes, Growing, METRES};

impl Growing {
    /// Writes the skin; returns it and the node above its joints.
    pub(super) fn skin(
        &mut self,
        skin: &Skin,
        n_vertices: usize,
        attributes: &mut Attributes,
    ) -> Result<(Index<gltf_json::Skin>, Index<Node>), String> {
        if skin.joints.is_empty() || skin.joints.len() > usize::from(u16::MAX) + 1 {
            let n = skin.joints.len();
            return Err(format!(
                "a skin of {n} joints; 1 to 65536 are possible: leave the skin out, or divide the mesh"
            ));
        }
        let frames = frames(&skin.joints)?;
        self.influences(skin, n_vertices, attributes)?;
        let matrices = self.inverse_binds(&frames)?;
        let mut nodes: Vec<Node> = Vec::with_capacity(frames.len());
        for (index, joint) in skin.joints.iter().enumerate() {
            let local = match joint.parent {
                Some(parent) => frames[parent as usize].inverse() * frames[index],
                None => frames[index],
            };
            let mut node = placed(local).map_err(|problem| format!("joint {index}: {problem}"))?;
            node.name = Some(joint.name.clone()).filter(|name| !name.is_empty());
            nodes.push(node);
        }
        let first = self.root.nodes.len();
        let node_of = |joint: usize| Index::<Node>::new((first + joint) as u32);
        let mut roots = Vec::new();
        for (index, joint) in skin.joints.iter().enumerate() {
            match joint.parent {
                Some(parent) => nodes[parent as usize].children.get_or_insert_default().push(node_of(index)),
                None => roots.push(node_of(index)),
            }
        }
        let joints = (0..nodes.len()).map(node_of).collect();
        self.root.nodes.extend(nodes);
        let above = self.root.push(Node { children: Some(roots), scale: Some(METRES), ..Node::default() });
        let skin = gltf_json::Skin {
            extensions: None,
            extras: None,
            inverse_bind_matrices: Some(matrices),
            joints,
            name: None,
            skeleton: None,
        };
        Ok((self.root.push(skin), above))
    }

    fn inverse_binds(&mut self, frames: &[DAffine3]) -> Result<Index<Accessor>, String> {
        let start = self.buffer.len();
        let mut rounding = Rounding::default();
        for (joint, frame) in frames.iter().enumerate() {
            let inverse = frame.inverse();
            let numbers = inverse.to_cols_array();
            let short = numbers.map(|x| x as f32);
            if !short.iter().all(|x| x.is_finite()) {
                return Err(format!("the frame of joint {joint} has no inverse of finite f32: give it three axes"));
            }
            rounding.include(&numbers, &short);
            for (column, last) in short.as_chunks::<3>().0.iter().zip([0.0f32, 0.0, 0.0, 1.0]) {
                self.buffer.extend(column.iter().chain([&last]).flat_map(|x| x.to_le_bytes()));
            }
        }
        rounding.note("inverse frame of a joint", "inverse frames of joints", &mut self.losses);
        let accessor = self.accessor(start, frames.len(), ComponentType::F32, Type::Mat4, None);
        Ok(self.root.push(accessor))
    }

    fn influences(&mut self, skin: &Skin, n_vertices: usize, attributes: &mut Attributes) -> Result<(), String> {
        let mut all = skin.influences.clone();
        if all.len() != n_vertices {
            return Err(format!("the skin has weights of {} vertices; the mesh has {n_vertices}", all.len()));
        }
        let (mut n_unmoved, mut n_divided) = (0, 0);
        for (vertex, influences) in all.iter_mut().enumerate() {
            for &(joint, weight) in influences.iter() {
                if joint as usize >= skin.joints.len() {
                    let n = skin.joints.len();
                    return Err(format!("joint {joint} moves vertex {vertex}, but there are {n}, counted from 0"));
                }
                if !(weight >= 0.0 && f64::from(weight as f32) < f64::INFINITY) {
                    return Err(format!("vertex {vertex} has the weight {weight}; 0 to 1 is expected"));
                }
            }
            influences.retain(|(_, weight)| *weight as f32 != 0.0);
            if influences.is_empty() {
                // The format has no vertex that no joint moves.
                n_unmoved += 1;
                influences.push((0, 1.0));
            }
            n_divided += usize::from(divided_by_sum(influences));
        }
        let (one, several) =
            ("vertex that no joint moves (follows the first)", "vertices that no joint moves (follow the first)");
        self.losses.note(n_unmoved, one, several);
        let (one, several) =
            ("vertex whose weights do not sum to 1 (made so)", "vertices whose weights do not sum to 1 (made so)");
        self.losses.note(n_divided, one, several);
        let n_sets = all.iter().map(|influences| influences.len().div_ceil(4)).max().unwrap_or(0);
        if n_sets > MAX_SETS {
            return Err(format!("a vertex is moved by more than {} joints: keep the strongest", 4 * MAX_SETS));
        }
        let mut rounding = Rounding::default();
        let short = skin.joints.len() <= usize::from(u8::MAX) + 1;
        for set in 0..n_sets {
            let group = |influences: &[(u32, f64)]| -> [(u32, f64); 4] {
                std::array::from_fn(|at| influences.get(4 * set + at).copied().unwrap_or((0, 0.0)))
            };
            let start = self.buffer.len();
            for (joint, _) in all.iter().flat_map(|influences| group(influences)) {
                // The number of joints has been checked.
                match short {
                    true => self.buffer.push(joint as u8),
                    false => self.buffer.extend_from_slice(&(joint as u16).to_le_bytes()),
                }
            }
            let component = if short { ComponentType::U8 } else { ComponentType::U16 };
            let target = Some(Target::ArrayBuffer);
            let accessor = self.accessor(start, n_vertices, component, Type::Vec4, target);
            attributes.insert(Valid(Semantic::Joints(set as u32)), self.root.push(accessor));
            let start = self.buffer.len();
            for (_, weight) in all.iter().flat_map(|influences| group(influences)) {
                rounding.include(&[weight], &[weight as f32]);
                self.buffer.extend_from_slice(&(weight as f32).to_le_bytes());
            }
            let accessor = self.accessor(start, n_vertices, ComponentType::F32, Type::Vec4, target);
            attributes.insert(Valid(Semantic::Weights(set as u32)), self.root.push(accessor));
        }
        rounding.note("weight of a joint", "weights of joints", &mut self.losses);
        Ok(())
    }
}

/// The frames of the joints, whose parents stand in front of them.
fn frames(joints: &[Joint]) -> Result<Vec<DAffine3>, String> {
    let mut frames = Vec::with_capacity(joints.len());
    for (index, joint) in joints.iter().enumerate() {
        if let Some(parent) = joint.parent.filter(|&parent| parent as usize >= index) {
            return Err(format!("joint {index} has the parent {parent}; parents stand in front of their children"));
        }
        let [x, y, z, position] = joint.bind.map(DVec3::from);
        frames.push(DAffine3 { matrix3: DMat3::from_cols(x, y, z), translation: position });
    }
    Ok(frames)
}

/// A node with the transform as translation, rotation and scale.
fn placed(local: DAffine3) -> Result<Node, String> {
    let DMat3 { x_axis, y_axis, z_axis } = local.matrix3;
    let mut scale = DVec3::new(x_axis.length(), y_axis.length(), z_axis.length());
    if local.matrix3.determinant() < 0.0 {
        scale.x = -scale.x;
    }
    let axes = DMat3::from_cols(x_axis / scale.x, y_axis / scale.y, z_axis / scale.z);
    let (xy, yz, zx) = (axes.x_axis.dot(axes.y_axis), axes.y_axis.dot(axes.z_axis), axes.z_axis.dot(axes.x_axis));
    // Negated, so that what is no number is refused too.
    if !([xy, yz, zx].iter().all(|dot| dot.abs() < 1e-5) && local.translation.is_finite()) {
        return Err("the axes of its frame are not perpendicular in that of its parent, as the format asks for".into());
    }
    let short = |vector: DVec3| vector.to_array().map(|x| x as f32);
    let rotation = DQuat::from_mat3(&axes).normalize().to_array().map(|x| x as f32);
    let (translation, scale) = (short(local.translation), short(scale));
    if !translation.iter().chain(&rotation).chain(&scale).all(|x| x.is_finite()) {
        return Err("its frame does not fit into f32".into());
    }
    Ok(Node {
        translation: Some(translation).filter(|&translation| translation != [0.0; 3]),
        rotation: Some(UnitQuaternion(rotation)).filter(|rotation| rotation.0 != [0.0, 0.0, 0.0, 1.0]),
        scale: Some(scale).filter(|&scale| scale != [1.0; 3]),
        ..Node::default()
    })
}
