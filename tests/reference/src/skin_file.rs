//! The sections of linear and skinned models in every storage, byte by byte.

use super::linear::Linear;
use super::model_file::{Extras, Head, Section, extra_sections, floats, integers};
use super::skinned::Skinned;
use super::storage::{Storage, Term};

pub(crate) fn section(id: u32, element: u32, shape: &[usize], bytes: Vec<u8>) -> Section {
    let shape = shape.iter().map(|&axis| axis as u32).collect();
    Section { id, may_ignore: id == 25, element, shape, bytes }
}

/// Header of a linear model.
pub fn linear_head(model: &Linear) -> Head {
    Head { kind: 2, n: model.n, identity_dim: model.components.len(), pose_dim: 0, flags: 1 }
}

/// Header of a body.
pub fn skinned_head(body: &Skinned) -> Head {
    let flags = 1 + 2 * u32::from(!body.corrective.is_empty()) + 4 * u32::from(body.dual);
    let (identity_dim, pose_dim) = (body.rest.components.len(), body.skeleton.pose_dim());
    Head { kind: 3, n: body.rest.n, identity_dim, pose_dim, flags }
}

/// The sections of a linear model.
pub fn linear_sections(model: &Linear, extras: &Extras) -> Vec<Section> {
    let mut sections = coefficients(model, &[]);
    sections.extend(extra_sections(extras));
    sections
}

/// The sections of a body.
pub fn skinned_sections(body: &Skinned, extras: &Extras) -> Vec<Section> {
    let mut sections = coefficients(&body.rest, &body.corrective);
    let joints = &body.skeleton.joints;
    let j = joints.len();
    sections.push(section(21, 2, &[j], integers(joints.iter().map(|joint| joint.parent.map_or(!0, |p| p as u32)))));
    sections.push(section(22, 3, &[j, 3], floats(joints.iter().flat_map(|joint| joint.axis.unwrap_or_default()))));
    sections.push(section(23, 3, &[j, 3], floats(joints.iter().flat_map(|joint| joint.position))));
    if let Some(basis) = &body.skeleton.basis {
        let numbers = basis.iter().flatten().flatten().copied();
        sections.push(section(24, 3, &[j, body.rest.components.len(), 3], floats(numbers)));
    }
    let (mut starts, mut held, mut weights) = (vec![0], Vec::new(), Vec::new());
    for block in (0..body.rest.mean.len()).step_by(16) {
        for joint in 0..j {
            let lanes = &body.weights[joint][block..block + 16];
            if lanes.iter().any(|&weight| weight != 0.0) {
                held.push(joint as u32);
                weights.extend(lanes);
            }
        }
        starts.push(held.len() as u32);
    }
    let entries = held.len();
    sections.push(section(26, 2, &[starts.len()], integers(starts)));
    sections.push(section(27, 2, &[entries], integers(held)));
    sections.push(section(28, 3, &[entries, 16], floats(weights)));
    sections.extend(extra_sections(extras));
    sections
}

fn coefficients(model: &Linear, corrective: &[Term]) -> Vec<Section> {
    stored_coefficients(&model.mean, &model.components.iter().chain(corrective).collect::<Vec<_>>())
}

/// Coefficients in blocks of sixteen vertices; offsets and ranges apart where they are not `f32`.
pub fn stored_coefficients(offset: &[[f32; 3]], terms: &[&Term]) -> Vec<Section> {
    let blocks = offset.len() / 16;
    let storage = match terms.first() {
        Some(Term::Halves(_)) => Storage::F16,
        Some(Term::Bytes { .. }) => Storage::I8,
        _ => Storage::F32,
    };
    let of_offset = |block: usize| -> Vec<u8> {
        let points = &offset[16 * block..16 * block + 16];
        floats((0..3).flat_map(|axis| points.iter().map(move |point| point[axis])))
    };
    let (mut bytes, mut ranges) = (Vec::new(), Vec::new());
    for block in 0..blocks {
        if storage == Storage::F32 {
            bytes.extend(of_offset(block));
        }
        for term in terms {
            for (axis, v) in (0..3).flat_map(|axis| (16 * block..16 * block + 16).map(move |v| (axis, v))) {
                match term {
                    Term::Floats(points) => bytes.extend(points[v][axis].to_le_bytes()),
                    Term::Halves(points) => bytes.extend(points[v][axis].to_le_bytes()),
                    Term::Bytes { codes, .. } => bytes.extend(codes[v][axis].to_le_bytes()),
                }
            }
            if let Term::Bytes { ranges: of_blocks, .. } = term {
                ranges.extend(of_blocks[block].iter().flatten());
            }
        }
    }
    let apart = [blocks, terms.len(), 3, 16];
    let offsets = || section(18, 3, &[blocks, 3, 16], (0..blocks).flat_map(of_offset).collect());
    match storage {
        Storage::F32 => vec![section(1, 3, &[blocks, terms.len() + 1, 3, 16], bytes)],
        Storage::F16 => vec![section(1, 4, &apart, bytes), offsets()],
        Storage::I8 => {
            let ranges = section(19, 3, &[blocks, terms.len(), 3, 2], floats(ranges.into_iter().copied()));
            vec![section(1, 5, &apart, bytes), offsets(), ranges]
        }
    }
}
