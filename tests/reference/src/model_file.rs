//! Model files, byte by byte from `docs/model-file.md`.

use super::bilinear::Bilinear;
use super::prior::Gaussian;

/// What a model file of the vectors holds beside the generator.
#[derive(Debug, Clone, Default)]
#[allow(missing_docs)]
pub struct Extras {
    pub faces: Vec<[u32; 3]>,
    pub landmarks: Vec<u32>,
    pub landmark_names: String,
    pub identity: Option<Gaussian>,
    pub pose: Option<Gaussian>,
    pub provenance: String,
}

/// One section before it is placed in the file.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub struct Section {
    pub id: u32,
    pub may_ignore: bool,
    pub element: u32,
    pub shape: Vec<u32>,
    pub bytes: Vec<u8>,
}

/// What a byte leaves of itself in a checksum, bit by bit.
const REMAINDERS: [u32; 256] = {
    let mut remainders = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut crc = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
            bit += 1;
        }
        remainders[byte] = crc;
        byte += 1;
    }
    remainders
};

/// CRC-32 of zip and PNG.
pub fn crc32(bytes: impl IntoIterator<Item = u8>) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc = crc >> 8 ^ REMAINDERS[usize::from(crc as u8 ^ byte)];
    }
    !crc
}

pub(crate) fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

pub(crate) fn integers(values: impl IntoIterator<Item = u32>) -> Vec<u8> {
    values.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// What the header says.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Head {
    /// 1 bilinear, 2 linear, 3 skinned, 4 wavelet.
    pub kind: u32,
    pub n: usize,
    pub identity_dim: usize,
    pub pose_dim: usize,
    /// 1 identity-linear, 2 pose-linear or corrective terms, 4 dual quaternions.
    pub flags: u32,
}

/// The sections of a bilinear model.
pub fn sections(model: &Bilinear, extras: &Extras) -> Vec<Section> {
    let mut sections = vec![coefficients(model)];
    sections.extend(extra_sections(extras));
    sections
}

/// The sections that models of every kind may have.
pub fn extra_sections(extras: &Extras) -> Vec<Section> {
    let mut sections = Vec::new();
    let mut push = |id: u32, element: u32, shape: &[usize], bytes: Vec<u8>| {
        let shape = shape.iter().map(|&axis| axis as u32).collect();
        sections.push(Section { id, may_ignore: (14..=16).contains(&id), element, shape, bytes });
    };
    if !extras.faces.is_empty() {
        push(2, 2, &[extras.faces.len(), 3], integers(extras.faces.iter().flatten().copied()));
    }
    if !extras.landmarks.is_empty() {
        push(3, 2, &[extras.landmarks.len()], integers(extras.landmarks.iter().copied()));
        push(4, 1, &[extras.landmark_names.len()], extras.landmark_names.clone().into_bytes());
    }
    for (first, gaussian) in [(6, &extras.identity), (9, &extras.pose)] {
        if let Some(Gaussian { mean, scale, precision }) = gaussian {
            let d = mean.len();
            push(first, 3, &[d], floats(mean.iter().copied()));
            push(first + 1, 3, &[d], floats(scale.iter().copied()));
            push(first + 2, 3, &[d, d], floats(precision.iter().flatten().copied()));
        }
    }
    if !extras.provenance.is_empty() {
        push(16, 1, &[extras.provenance.len()], extras.provenance.clone().into_bytes());
    }
    sections
}

/// The coefficients in blocks of 16 vertices.
fn coefficients(model: &Bilinear) -> Section {
    let mut terms: Vec<&Vec<[f32; 3]>> = vec![&model.offset];
    terms.extend(model.pose_linear.iter().flatten());
    for (i, row) in model.bilinear.iter().enumerate() {
        terms.extend(model.identity_linear.iter().map(|linear| &linear[i]));
        terms.extend(row);
    }
    let blocks = model.n().div_ceil(16);
    let mut values = Vec::new();
    for block in 0..blocks {
        for term in &terms {
            for axis in 0..3 {
                values.extend((0..16).map(|lane| term.get(16 * block + lane).map_or(0.0, |point| point[axis])));
            }
        }
    }
    let shape = vec![blocks as u32, terms.len() as u32, 3, 16];
    Section { id: 1, may_ignore: false, element: 3, shape, bytes: floats(values) }
}

/// The header of a bilinear model.
pub fn head(model: &Bilinear) -> Head {
    let (identity_dim, pose_dim) = model.dims();
    let flags = u32::from(model.identity_linear.is_some()) + 2 * u32::from(model.pose_linear.is_some());
    Head { kind: 1, n: model.n(), identity_dim, pose_dim, flags }
}

/// The bytes of the file of a bilinear model.
pub fn bytes(model: &Bilinear, sections: &[Section]) -> Vec<u8> {
    file(&head(model), sections)
}

/// The bytes of a file.
pub fn file(head: &Head, sections: &[Section]) -> Vec<u8> {
    let mut table = Vec::new();
    let mut content = Vec::new();
    let table_end = 64 + 64 * sections.len();
    for section in sections {
        content.resize(content.len().next_multiple_of(64), 0);
        let mut shape = section.shape.clone();
        shape.resize(4, 1);
        let start = [section.id, u32::from(section.may_ignore), section.element, section.shape.len() as u32];
        table.extend(integers(start.into_iter().chain(shape)));
        table.extend(((table_end + content.len()) as u64).to_le_bytes());
        table.extend((section.bytes.len() as u64).to_le_bytes());
        table.extend(integers([crc32(section.bytes.iter().copied()), 0, 0, 0]));
        content.extend(&section.bytes);
    }
    content.resize(content.len().next_multiple_of(64), 0);
    let mut file = b"\x89HAB\r\n\x1a\n".to_vec();
    file.extend(integers([1, 64]));
    file.extend(((table_end + content.len()) as u64).to_le_bytes());
    let [n, identity_dim, pose_dim] = [head.n, head.identity_dim, head.pose_dim].map(|count| count as u32);
    file.extend(integers([head.kind, sections.len() as u32, n, identity_dim, pose_dim, head.flags]));
    file.extend(integers([1, 1, 0]));
    let crc = crc32(file.iter().chain(&table).copied());
    file.extend(crc.to_le_bytes());
    file.extend(table);
    file.extend(content);
    file
}
