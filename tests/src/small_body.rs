//! A small body of known numbers: a trunk with a head and two arms, for programs and tests that need a skinned model and no training.
//!
//! 50 vertices, three components, five joints. Only additions, multiplications and divisions make its numbers, so they are the same wherever
//! this runs.

use habitus_core::format::{ElementType, Header, Kind, SectionId, SectionSource, write, written_len};
use habitus_core::generator::LANES;

/// Rings of four vertices of the trunk, from below: height and half widths, millimetres. The last two are the head.
const TRUNK: [[f32; 3]; 6] = [
    [900.0, 170.0, 110.0],
    [1050.0, 140.0, 100.0],
    [1250.0, 160.0, 110.0],
    [1420.0, 150.0, 90.0],
    [1500.0, 60.0, 60.0],
    [1620.0, 75.0, 90.0],
];
/// Rings of an arm: distance from the middle and half width.
const ARM: [[f32; 2]; 3] = [[200.0, 50.0], [450.0, 40.0], [720.0, 25.0]];
const ARM_HEIGHT: f32 = 1400.0;
/// The first vertex behind the rings of the trunk, the one above, the one below, then the arms.
const CAPS: usize = 4 * TRUNK.len();
const LEFT: usize = CAPS + 2;
const RIGHT: usize = LEFT + 4 * ARM.len();
const N_VERTICES: usize = RIGHT + 4 * ARM.len();
const IDENTITY: usize = 3;

/// Name, parent, axis (none: a ball), position of each joint. The subject's left is at positive x.
const JOINTS: [(&str, u32, [f32; 3], [f32; 3]); 5] = [
    ("pelvis", u32::MAX, [0.0; 3], [0.0, 950.0, 0.0]),
    ("chest", 0, [1.0, 0.0, 0.0], [0.0, 1150.0, 0.0]),
    ("head", 1, [0.0; 3], [0.0, 1500.0, 0.0]),
    ("left_arm", 1, [0.0; 3], [170.0, ARM_HEIGHT, 0.0]),
    ("right_arm", 1, [0.0, 0.0, 1.0], [-170.0, ARM_HEIGHT, 0.0]),
];

/// Bounds of the eleven angles, radians: pelvis, chest, head, left arm, right arm.
const LOWER: [f32; 11] = [-3.0, -3.0, -3.0, -0.5, -0.8, -1.2, -0.6, -1.0, -1.5, -1.5, -1.5];
const UPPER: [f32; 11] = [3.0, 3.0, 3.0, 1.2, 0.8, 1.2, 0.6, 1.0, 1.5, 1.5, 1.5];

/// The bytes of the model file.
///
/// # Panics
/// When the kernel refuses to write it.
pub fn bytes() -> Vec<u8> {
    let header = Header {
        kind: Kind::Skinned,
        n_vertices: N_VERTICES as u32,
        identity_dim: IDENTITY as u32,
        pose_dim: LOWER.len() as u32,
        identity_linear: true,
        pose_linear: false,
        dual_quaternion: false,
    };
    let positions: Vec<f32> = JOINTS.iter().flat_map(|joint| joint.3).collect();
    let basis: Vec<f32> =
        JOINTS.iter().flat_map(|joint| (0..IDENTITY).flat_map(|component| moved(component, joint.3))).collect();
    let axes: Vec<f32> = JOINTS.iter().flat_map(|joint| joint.2).collect();
    let parents: Vec<u32> = JOINTS.iter().map(|joint| joint.1).collect();
    let unit: Vec<f32> =
        (0..IDENTITY * IDENTITY).map(|k| if k.is_multiple_of(IDENTITY + 1) { 1.0 } else { 0.0 }).collect();
    let (starts, held, weights) = skin(header.n_blocks());
    let landmarks =
        [CAPS, CAPS + 1, 0, 2, LEFT + 8, RIGHT + 8, LEFT + 4, RIGHT + 4, 13, 21].map(|vertex| vertex as u32);
    let landmark_names =
        "head_top\ncrotch\nleft_hip\nright_hip\nleft_hand\nright_hand\nleft_elbow\nright_elbow\nchest_front\nforehead";
    let joint_names = JOINTS.map(|joint| joint.0).join("\n");
    let provenance = "procedural body, no scan";
    let faces = faces();
    let (j, d, p, entries) = (JOINTS.len() as u32, IDENTITY as u32, LOWER.len() as u32, held.len() as u32);
    let terms = [header.n_blocks() as u32, header.n_terms() as u32, 3, LANES as u32];
    let parts: [(SectionId, &[u32], Vec<u8>); 19] = [
        (SectionId::Coefficients, &terms, floats(&coefficients(&header))),
        (SectionId::Faces, &[faces.len() as u32 / 3, 3], integers(&faces)),
        (SectionId::Landmarks, &[landmarks.len() as u32], integers(&landmarks)),
        (SectionId::LandmarkNames, &[landmark_names.len() as u32], landmark_names.into()),
        (SectionId::IdentityMean, &[d], floats(&[0.0; IDENTITY])),
        (SectionId::IdentityScale, &[d], floats(&[1.0; IDENTITY])),
        (SectionId::IdentityPrecision, &[d, d], floats(&unit)),
        (SectionId::Provenance, &[provenance.len() as u32], provenance.into()),
        (SectionId::JointParents, &[j], integers(&parents)),
        (SectionId::JointAxes, &[j, 3], floats(&axes)),
        (SectionId::JointPositions, &[j, 3], floats(&positions)),
        (SectionId::JointBasis, &[j, d, 3], floats(&basis)),
        (SectionId::JointNames, &[joint_names.len() as u32], joint_names.into()),
        (SectionId::SkinStarts, &[starts.len() as u32], integers(&starts)),
        (SectionId::SkinJoints, &[entries], integers(&held)),
        (SectionId::SkinWeights, &[entries, LANES as u32], floats(&weights)),
        (SectionId::PoseLower, &[p], floats(&LOWER)),
        (SectionId::PoseUpper, &[p], floats(&UPPER)),
        // One posture beside the standard one: arms down.
        (SectionId::PoseStarts, &[1, p], floats(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.25, 1.25])),
    ];
    let sections: Vec<SectionSource<'_>> = parts
        .iter()
        .map(|(id, shape, bytes)| SectionSource {
            id: *id as u32,
            may_ignore: id.may_ignore(),
            element: element(*id),
            shape,
            bytes,
        })
        .collect();
    let mut out = vec![0; written_len(&sections).expect("a small file fits the address space")];
    write(&header, &sections, &mut out).expect("the sections fit their header");
    out
}

fn element(id: SectionId) -> ElementType {
    id.form().0
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn integers(values: &[u32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Where a vertex lies in the mean.
fn position(vertex: usize) -> [f32; 3] {
    // Four corners about an axis, counter-clockwise.
    let corner = |k: usize| [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0f32]][k % 4];
    match vertex {
        CAPS => [0.0, 1720.0, 0.0],
        vertex if vertex == CAPS + 1 => [0.0, 850.0, 0.0],
        vertex if vertex < CAPS => {
            let ([height, width, depth], [x, z]) = (TRUNK[vertex / 4], corner(vertex));
            [width * x, height, depth * z]
        }
        _ => {
            let side = if vertex < RIGHT { 1.0 } else { -1.0 };
            let along = (vertex - if vertex < RIGHT { LEFT } else { RIGHT }) / 4;
            let ([x, width], [y, z]) = (ARM[along], corner(vertex - LEFT));
            [side * x, ARM_HEIGHT + width * y, width * z]
        }
    }
}

/// What one standard deviation of a component does to a point: taller, wider, longer arms.
fn moved(component: usize, [x, y, z]: [f32; 3]) -> [f32; 3] {
    match component {
        0 => [0.01 * x, 0.04 * y, 0.01 * z],
        1 => [0.06 * x, 0.0, 0.12 * z],
        _ => {
            let beyond = if x > 170.0 {
                x - 170.0
            } else if x < -170.0 {
                x + 170.0
            } else {
                0.0
            };
            [0.08 * beyond, 0.0, 0.0]
        }
    }
}

/// The terms block by block: the mean, then the components.
fn coefficients(header: &Header) -> Vec<f32> {
    let mut out = Vec::with_capacity(header.n_blocks() * header.n_terms() * 3 * LANES);
    for block in 0..header.n_blocks() {
        for term in 0..header.n_terms() {
            for axis in 0..3 {
                for vertex in block * LANES..(block + 1) * LANES {
                    let value = |vertex: usize| match term {
                        0 => position(vertex)[axis],
                        _ => moved(term - 1, position(vertex))[axis],
                    };
                    out.push(if vertex < N_VERTICES { value(vertex) } else { 0.0 });
                }
            }
        }
    }
    out
}

/// The share with which each joint holds a vertex.
fn shares(vertex: usize) -> [f32; 5] {
    let mut shares = [0.0; 5];
    let (joint, share) = match vertex {
        CAPS => (2, 1.0),
        vertex if vertex == CAPS + 1 => (0, 1.0),
        vertex if vertex < CAPS => [(0, 1.0), (0, 0.75), (1, 0.75), (1, 1.0), (2, 0.5), (2, 1.0)][vertex / 4],
        vertex => {
            let (joint, first) = if vertex < RIGHT { (3, LEFT) } else { (4, RIGHT) };
            (joint, if vertex < first + 4 { 0.5 } else { 1.0 })
        }
    };
    shares[joint] = share;
    // The rest is the trunk's.
    shares[if joint == 1 { 0 } else { 1 }] += 1.0 - share;
    shares
}

/// First entry of each block, the joint of each entry, its weights.
fn skin(n_blocks: usize) -> (Vec<u32>, Vec<u32>, Vec<f32>) {
    let (mut starts, mut held, mut weights) = (vec![0], Vec::new(), Vec::new());
    for block in 0..n_blocks {
        let vertices = || block * LANES..(block + 1) * LANES;
        let share = |vertex: usize, joint: usize| if vertex < N_VERTICES { shares(vertex)[joint] } else { 0.0 };
        for joint in 0..JOINTS.len() {
            if vertices().any(|vertex| share(vertex, joint) > 0.0) {
                held.push(joint as u32);
                weights.extend(vertices().map(|vertex| share(vertex, joint)));
            }
        }
        starts.push(held.len() as u32);
    }
    (starts, held, weights)
}

/// Triangles between the rings, counter-clockwise from outside; the hands closed, the arms open where the trunk is.
fn faces() -> Vec<u32> {
    let mut faces = Vec::new();
    let mut add = |a: usize, b: usize, c: usize, outward: bool| {
        let triangle = if outward { [a, b, c] } else { [a, c, b] };
        faces.extend(triangle.map(|vertex| vertex as u32));
    };
    let mut tube = |first: usize, rings: usize, outward: bool| {
        for ring in 0..rings - 1 {
            for k in 0..4 {
                let [a, b] = [first + 4 * ring + k, first + 4 * ring + (k + 1) % 4];
                add(a, a + 4, b, outward);
                add(b, a + 4, b + 4, outward);
            }
        }
    };
    tube(0, TRUNK.len(), true);
    // Corners go about the left arm's axis as about none of the others.
    tube(LEFT, ARM.len(), false);
    tube(RIGHT, ARM.len(), true);
    for k in 0..4 {
        let next = (k + 1) % 4;
        add(CAPS - 4 + k, CAPS, CAPS - 4 + next, true);
        add(k, CAPS + 1, next, false);
    }
    for (hand, outward) in [(LEFT + 8, true), (RIGHT + 8, false)] {
        add(hand, hand + 1, hand + 2, outward);
        add(hand, hand + 2, hand + 3, outward);
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a mesh whose triangles look outward the signed volume over each part is above zero.
    #[test]
    fn triangles_look_outward() {
        let faces = faces();
        let volume = |part: std::ops::Range<usize>| -> f32 {
            let triangles = faces.as_chunks::<3>().0.iter().filter(|corners| part.contains(&(corners[0] as usize)));
            let middle = position(part.start);
            triangles
                .map(|corners| {
                    let [a, b, c] = corners.map(|vertex| {
                        let at = position(vertex as usize);
                        [at[0] - middle[0], at[1] - middle[1], at[2] - middle[2]]
                    });
                    let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                    a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]
                })
                .sum()
        };
        for part in [0..LEFT, LEFT..RIGHT, RIGHT..N_VERTICES] {
            assert!(volume(part.clone()) > 0.0, "{part:?}");
        }
        for triangle in faces.as_chunks::<3>().0 {
            assert!(triangle.iter().all(|&vertex| (vertex as usize) < N_VERTICES));
        }
    }
}
