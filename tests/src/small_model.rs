//! A small bilinear model of known numbers, for programs and tests that need a file and no training.
//!
//! A bulging mask of 12 x 14 vertices. Only additions, multiplications and divisions make its numbers, so they
//! are the same wherever this runs.

use habitus_core::format::{ElementType, Header, Kind, SectionId, SectionSource, write, written_len};
use habitus_core::generator::LANES;

const COLUMNS: usize = 12;
const ROWS: usize = 14;
const IDENTITY: usize = 4;
const POSE: usize = 3;

/// The bytes of the model file.
///
/// # Panics
/// When the kernel refuses to write it.
pub fn bytes() -> Vec<u8> {
    let header = Header {
        kind: Kind::Bilinear,
        n_vertices: (COLUMNS * ROWS) as u32,
        identity_dim: IDENTITY as u32,
        pose_dim: POSE as u32,
        identity_linear: true,
        pose_linear: true,
        dual_quaternion: false,
    };
    let coefficients = coefficients(&header);
    let unit = |n: usize| (0..n * n).map(move |k| if k % (n + 1) == 0 { 1.0f32 } else { 0.0 });
    let landmarks = landmarks();
    let faces: Vec<u32> = (0..ROWS - 1)
        .flat_map(|row| (0..COLUMNS - 1).map(move |column| (row * COLUMNS + column) as u32))
        .flat_map(|a| [a, a + COLUMNS as u32, a + 1, a + 1, a + COLUMNS as u32, a + COLUMNS as u32 + 1])
        .collect();
    let floats = |values: &mut dyn Iterator<Item = f32>| values.flat_map(f32::to_le_bytes).collect::<Vec<u8>>();
    let integers = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let (n, m) = (IDENTITY as u32, POSE as u32);
    let parts: Vec<(SectionId, Vec<u32>, Vec<u8>)> = vec![
        (
            SectionId::Coefficients,
            vec![header.n_blocks() as u32, header.n_terms() as u32, 3, LANES as u32],
            floats(&mut coefficients.into_iter()),
        ),
        (SectionId::Faces, vec![faces.len() as u32 / 3, 3], integers(&faces)),
        (SectionId::Landmarks, vec![landmarks.len() as u32], integers(&landmarks)),
        (SectionId::IdentityMean, vec![n], floats(&mut (0..IDENTITY).map(|_| 0.0))),
        (SectionId::IdentityScale, vec![n], floats(&mut (0..IDENTITY).map(|_| 1.0))),
        (SectionId::IdentityPrecision, vec![n, n], floats(&mut unit(IDENTITY))),
        (SectionId::PoseMean, vec![m], floats(&mut (0..POSE).map(|_| 0.0))),
        (SectionId::PoseScale, vec![m], floats(&mut (0..POSE).map(|_| 1.0))),
        (SectionId::PosePrecision, vec![m, m], floats(&mut unit(POSE))),
        (SectionId::Provenance, vec![24], b"procedural mask, no scan".to_vec()),
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

/// Vertices of the mask.
pub(crate) const N_VERTICES: usize = COLUMNS * ROWS;

/// Vertex of each of its thirteen landmarks.
pub(crate) fn landmarks() -> Vec<u32> {
    [(5, 3), (6, 3), (2, 4), (4, 4), (7, 4), (9, 4), (4, 7), (7, 7), (5, 8), (3, 10), (8, 10), (5, 11), (6, 13)]
        .map(|(column, row)| (row * COLUMNS + column) as u32)
        .to_vec()
}

fn element(id: SectionId) -> ElementType {
    id.form().0
}

/// The terms block by block: offset, pose, then for each identity weight its linear and its bilinear terms.
fn coefficients(header: &Header) -> Vec<f32> {
    let mut out = Vec::with_capacity(header.n_blocks() * header.n_terms() * 3 * LANES);
    for block in 0..header.n_blocks() {
        for term in 0..header.n_terms() {
            for axis in 0..3 {
                for lane in 0..LANES {
                    let vertex = block * LANES + lane;
                    out.push(if vertex < COLUMNS * ROWS { coefficient(term, axis, vertex) } else { 0.0 });
                }
            }
        }
    }
    out
}

/// One coordinate of one term at a vertex, millimetres: the mask, or a smooth displacement of it.
pub(crate) fn coefficient(term: usize, axis: usize, vertex: usize) -> f32 {
    // From -1 at the subject's right and the top to 1 at the left and the chin.
    let u = (vertex % COLUMNS) as f32 * (2.0 / (COLUMNS - 1) as f32) - 1.0;
    let v = (vertex / COLUMNS) as f32 * (2.0 / (ROWS - 1) as f32) - 1.0;
    if term == 0 {
        return mask(u, v)[axis];
    }
    // A bump that wanders over the mask from term to term.
    let (k, a) = (term as f32, axis as f32);
    let (du, dv) = (u - 0.9 + 0.09 * k, v + 0.8 - 0.08 * k + 0.2 * a);
    let bump = 1.0 / (1.0 + 6.0 * du * du + 4.0 * dv * dv);
    (3.0 - 0.1 * k) * (bump - 0.3) * [0.6, 1.0, -0.8][axis]
}

/// The mask itself, millimetres.
pub(crate) fn mask(u: f32, v: f32) -> [f32; 3] {
    let nose = 18.0 / (1.0 + 30.0 * u * u + 12.0 * (v - 0.1) * (v - 0.1));
    [70.0 * u, -95.0 * v, 60.0 - 40.0 * u * u - 25.0 * v * v + nose]
}
