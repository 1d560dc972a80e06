//! What a reader checks of a skeleton and of skinning weights.

use super::limits;
use super::model::Model;
use super::section::SectionId;
use super::view::{Floats, Indices};
use crate::Error;
use crate::generator::LANES;
use crate::workspace::saturated;

/// `Ok` when the sections that a skinned model needs are there and fit together.
pub(super) fn check(model: &Model<'_>) -> Result<(), Error> {
    for id in [
        SectionId::JointParents,
        SectionId::JointAxes,
        SectionId::JointPositions,
        SectionId::SkinStarts,
        SectionId::SkinJoints,
        SectionId::SkinWeights,
    ] {
        model.required(id)?;
    }
    let view = |id: SectionId| model.known(id).map_or(&[][..], |section| section.bytes);
    let axes = Floats::new(view(SectionId::JointAxes));
    let pose_dim: usize = (0..axes.len() / 3).map(|joint| if is_ball(axes, joint) { 3 } else { 1 }).sum();
    if pose_dim != model.header().pose_dim as usize {
        return Err(Error::BadContent { section: SectionId::JointAxes as u32, index: saturated(axes.len()) });
    }
    let starts = Indices::new(view(SectionId::SkinStarts));
    let joints = Indices::new(view(SectionId::SkinJoints));
    let weights = Floats::new(view(SectionId::SkinWeights));
    let n_joints = axes.len() / 3;
    for block in 0..starts.len().saturating_sub(1) {
        let from = starts.get(block).unwrap_or(0) as usize;
        let to = starts.get(block + 1).unwrap_or(0) as usize;
        check_block(model, block, from, joints.part(from, to.saturating_sub(from)), weights, n_joints)?;
    }
    Ok(())
}

/// The joints of one block: ascending, known; the weights of each vertex: at most eight, none negative, with sum 1.
fn check_block(
    model: &Model<'_>,
    block: usize,
    from: usize,
    joints: Option<Indices<'_>>,
    weights: Floats<'_>,
    n_joints: usize,
) -> Result<(), Error> {
    let bad = |id: SectionId, index: usize| Error::BadContent { section: id as u32, index: saturated(index) };
    let joints = joints.unwrap_or_default();
    let mut last = None;
    for (position, joint) in joints.iter().enumerate() {
        if joint as usize >= n_joints || last.is_some_and(|last| last >= joint) {
            return Err(bad(SectionId::SkinJoints, from + position));
        }
        last = Some(joint);
    }
    let n_vertices = model.header().n_vertices as usize;
    for lane in 0..LANES {
        let used = block * LANES + lane < n_vertices;
        let (mut sum, mut count) = (0.0, 0);
        for position in 0..joints.len() {
            let index = (from + position) * LANES + lane;
            let weight = weights.get(index).unwrap_or(f32::NAN);
            if !(0.0..=1.0).contains(&weight) || (weight != 0.0 && !used) {
                return Err(bad(SectionId::SkinWeights, index));
            }
            sum += weight;
            count += u32::from(weight != 0.0);
        }
        let fits = libm::fabsf(sum - 1.0) <= limits::WEIGHT_SUM_TOLERANCE && count <= limits::MAX_INFLUENCES;
        if used && !fits {
            return Err(bad(SectionId::SkinWeights, from * LANES + lane));
        }
    }
    Ok(())
}

/// A joint with no axis turns about all of them.
fn is_ball(axes: Floats<'_>, joint: usize) -> bool {
    (0..3).all(|axis| axes.get(3 * joint + axis) == Some(0.0))
}

/// First joint that does not come behind its parent (`u32::MAX`: none).
pub(super) fn first_wrong_parent(parents: Indices<'_>) -> Option<usize> {
    parents.iter().enumerate().position(|(joint, parent)| parent != u32::MAX && parent as usize >= joint)
}

/// First number of an axis that is neither zero nor of unit length.
pub(super) fn first_wrong_axis(axes: Floats<'_>) -> Option<usize> {
    let joint = (0..axes.len() / 3).position(|joint| {
        let square: f32 =
            (0..3).map(|axis| axes.get(3 * joint + axis).unwrap_or(f32::NAN)).map(|value| value * value).sum();
        !(is_ball(axes, joint) || libm::fabsf(square - 1.0) <= limits::AXIS_TOLERANCE)
    })?;
    Some(3 * joint)
}

/// First start that is not behind the one before: every block has an influence, the first begins at 0, the last ends at the last.
pub(super) fn first_wrong_start(starts: Indices<'_>, entries: u32) -> Option<usize> {
    if starts.get(0) != Some(0) {
        return Some(0);
    }
    let pairs = starts.iter().zip(starts.iter().skip(1));
    if let Some(block) = pairs.into_iter().position(|(start, end)| start >= end) {
        return Some(block + 1);
    }
    let last = starts.len().saturating_sub(1);
    (starts.get(last) != Some(entries)).then_some(last)
}
