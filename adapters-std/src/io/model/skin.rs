//! A skeleton and its skinning weights, before they are laid out as `.hab` sections.

use habitus_core::format::SectionId;
use habitus_core::format::limits::{MAX_INFLUENCES, MAX_JOINTS};
use habitus_core::generator::LANES;

use crate::Error;

/// One joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointSource {
    /// Name.
    pub name: String,
    /// The joint that carries it; comes before it.
    pub parent: Option<usize>,
    /// Axis of a revolute joint; `None` turns about all axes.
    pub axis: Option<[f64; 3]>,
    /// Position in the mean shape, mm.
    pub position: [f64; 3],
    /// Derivative of the position by each identity weight, mm; empty when joints stay.
    pub basis: Vec<[f64; 3]>,
}

/// A section: identifier, shape, content.
type Laid = (SectionId, Vec<usize>, Vec<u8>);

/// A skeleton with the weights of every vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct SkinSource {
    /// The joints, parents first.
    pub joints: Vec<JointSource>,
    /// For each vertex the joints that hold it and their weights, at most eight; they are divided by their sum.
    pub weights: Vec<Vec<(usize, f64)>>,
    /// Lower and upper bound of each angle, radians, or none.
    pub bounds: Option<(Vec<f64>, Vec<f64>)>,
    /// Blend dual quaternions instead of matrices.
    pub dual_quaternion: bool,
}

impl SkinSource {
    /// Angles of all joints.
    pub fn pose_dim(&self) -> usize {
        self.joints.iter().map(|joint| if joint.axis.is_some() { 1 } else { 3 }).sum()
    }

    /// The sections.
    ///
    /// Errors: no or too many joints, a parent behind its child, an axis that is not of unit length, a vertex that no joint or more than eight hold, that a joint
    /// which does not exist holds, or whose weights are negative.
    pub(super) fn sections(&self) -> Result<Vec<Laid>, Error> {
        self.check()?;
        let j = self.joints.len();
        let floats =
            |values: &mut dyn Iterator<Item = f64>| values.flat_map(|value| (value as f32).to_le_bytes()).collect();
        let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let parents: Vec<u32> =
            self.joints.iter().map(|joint| joint.parent.map_or(u32::MAX, |parent| parent as u32)).collect();
        let names = self.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join("\n").into_bytes();
        let (starts, joints, weights) = self.blocks();
        let mut sections = vec![
            (SectionId::JointParents, vec![j], words(&parents)),
            (
                SectionId::JointAxes,
                vec![j, 3],
                floats(&mut self.joints.iter().flat_map(|joint| joint.axis.unwrap_or_default())),
            ),
            (SectionId::JointPositions, vec![j, 3], floats(&mut self.joints.iter().flat_map(|joint| joint.position))),
            (SectionId::JointNames, vec![names.len()], names),
            (SectionId::SkinStarts, vec![starts.len()], words(&starts)),
            (SectionId::SkinJoints, vec![joints.len()], words(&joints)),
            (SectionId::SkinWeights, vec![joints.len(), LANES], weights.iter().flat_map(|w| w.to_le_bytes()).collect()),
        ];
        let d = self.joints[0].basis.len();
        if d > 0 {
            let basis = &mut self.joints.iter().flat_map(|joint| joint.basis.iter().copied().flatten());
            sections.push((SectionId::JointBasis, vec![j, d, 3], floats(basis)));
        }
        if let Some((lower, upper)) = &self.bounds {
            sections.push((SectionId::PoseLower, vec![lower.len()], floats(&mut lower.iter().copied())));
            sections.push((SectionId::PoseUpper, vec![upper.len()], floats(&mut upper.iter().copied())));
        }
        Ok(sections)
    }

    fn check(&self) -> Result<(), Error> {
        let j = self.joints.len();
        if !(1..=MAX_JOINTS as usize).contains(&j) {
            return Err(Error::input(format!("{j} joints: a skeleton has 1 to {MAX_JOINTS}")));
        }
        for (index, joint) in self.joints.iter().enumerate() {
            let name = &joint.name;
            if joint.parent.is_some_and(|parent| parent >= index) {
                return Err(Error::input(format!(
                    "joint {index} ({name}) stands before its parent; sort parents first"
                )));
            }
            if joint.basis.len() != self.joints[0].basis.len() {
                return Err(Error::input(format!(
                    "joint {index} ({name}) follows another number of weights than the first"
                )));
            }
        }
        for (vertex, weights) in self.weights.iter().enumerate() {
            let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
            let sound =
                weights.iter().all(|&(joint, weight)| joint < j && weight >= 0.0) && sum > 0.0 && sum.is_finite();
            if !sound || weights.iter().filter(|(_, weight)| *weight > 0.0).count() > MAX_INFLUENCES as usize {
                return Err(Error::input(format!(
                    "vertex {vertex} wants 1 to {MAX_INFLUENCES} joints below {j} with weights that are not negative; it has {weights:?}"
                )));
            }
        }
        Ok(())
    }

    /// For each block of sixteen vertices the joints that hold any of them, ascending, each with sixteen weights.
    fn blocks(&self) -> (Vec<u32>, Vec<u32>, Vec<f32>) {
        let (mut starts, mut joints, mut all) = (vec![0], Vec::new(), Vec::new());
        for block in self.weights.chunks(LANES) {
            let mut held: Vec<usize> =
                block.iter().flatten().filter(|(_, w)| *w > 0.0).map(|(joint, _)| *joint).collect();
            held.sort_unstable();
            held.dedup();
            for joint in held {
                joints.push(joint as u32);
                let weight = |vertex: &Vec<(usize, f64)>| {
                    let sum: f64 = vertex.iter().map(|(_, weight)| weight).sum();
                    let own: f64 = vertex.iter().filter(|(other, _)| *other == joint).map(|(_, weight)| weight).sum();
                    (own / sum) as f32
                };
                let row = block.iter().map(weight).chain(std::iter::repeat(0.0)).take(LANES);
                all.extend(row);
            }
            starts.push(joints.len() as u32);
        }
        (starts, joints, all)
    }
}
