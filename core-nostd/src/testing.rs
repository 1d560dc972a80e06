//! Small models for the unit tests.

use std::vec::Vec;

use crate::format::{ElementType, Header, Kind, SectionId, SectionSource, write, written_len};

/// A stream of numbers in -1..1 (xorshift).
pub struct Stream(u32);

impl Stream {
    pub fn new(seed: u32) -> Self {
        Stream(seed.wrapping_mul(2654435769) | 1)
    }

    pub fn next(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 8) as f32 / 8388608.0 - 1.0
    }

    pub fn take(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.next()).collect()
    }
}

pub fn header(n_vertices: u32, identity_dim: u32, pose_dim: u32, linear: bool) -> Header {
    Header { kind: Kind::Bilinear, n_vertices, identity_dim, pose_dim, identity_linear: linear, pose_linear: linear }
}

pub fn bytes_of(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// Coefficients with an offset of about 100 mm and terms of about 10 mm; lanes behind the last vertex are zero.
pub fn coefficients(header: &Header, seed: u32) -> Vec<f32> {
    let mut stream = Stream::new(seed);
    let mut values = Vec::new();
    for block in 0..header.n_blocks() {
        for term in 0..header.n_terms() {
            for lane in 0..48 {
                let used = block * 16 + lane % 16 < header.n_vertices as usize;
                let size = if term == 0 { 100.0 } else { 10.0 };
                values.push(if used { size * stream.next() } else { 0.0 });
            }
        }
    }
    values
}

/// A whole model with every section, as the bytes of a file.
pub fn model_file(header: &Header, seed: u32) -> Vec<u8> {
    let coefficients = bytes_of(&coefficients(header, seed));
    let (n, di, dp) = (header.n_vertices, header.identity_dim, header.pose_dim);
    let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let faces = words(&(0..n.saturating_sub(2)).flat_map(|v| [v, v + 1, v + 2]).collect::<Vec<_>>());
    let landmarks = words(&(0..n.min(8)).map(|k| k * (n - 1) / 7.min(n)).collect::<Vec<_>>());
    let names = (0..n.min(8)).map(|k| format!("point_{k}")).collect::<Vec<_>>().join("\n");
    let mirror = words(&(0..n).map(|v| n - 1 - v).collect::<Vec<_>>());
    let precision =
        |d: u32| bytes_of(&(0..d * d).map(|k| if k / d == k % d { d as f32 } else { 0.25 }).collect::<Vec<_>>());
    let mean = |d: u32| bytes_of(&(0..d).map(|k| 0.1 * k as f32).collect::<Vec<_>>());
    let scale = |d: u32| bytes_of(&(0..d).map(|_| 1.0 / (d as f32).sqrt()).collect::<Vec<_>>());
    let spectrum = bytes_of(&[5.0, 3.0, 1.0]);
    let starts = bytes_of(&Stream::new(9).take(2 * dp as usize));
    let parts: Vec<(SectionId, Vec<u32>, Vec<u8>)> = vec![
        (SectionId::Coefficients, vec![header.n_blocks() as u32, header.n_terms() as u32, 3, 16], coefficients),
        (SectionId::Faces, vec![n - 2, 3], faces),
        (SectionId::Landmarks, vec![n.min(8)], landmarks),
        (SectionId::LandmarkNames, vec![names.len() as u32], names.into_bytes()),
        (SectionId::Mirror, vec![n], mirror),
        (SectionId::IdentityMean, vec![di], mean(di)),
        (SectionId::IdentityScale, vec![di], scale(di)),
        (SectionId::IdentityPrecision, vec![di, di], precision(di)),
        (SectionId::PoseMean, vec![dp], mean(dp)),
        (SectionId::PoseScale, vec![dp], scale(dp)),
        (SectionId::PosePrecision, vec![dp, dp], precision(dp)),
        (SectionId::PoseStarts, vec![2, dp], starts),
        (SectionId::PoseNames, vec![11], b"first\nother".to_vec()),
        (SectionId::IdentitySpectrum, vec![3], spectrum.clone()),
        (SectionId::PoseSpectrum, vec![3], spectrum),
        (SectionId::Provenance, vec![4], b"test".to_vec()),
        (SectionId::Remainder, vec![2, n, 3], bytes_of(&Stream::new(11).take(6 * n as usize))),
    ];
    let sources: Vec<SectionSource<'_>> = parts
        .iter()
        .map(|(id, shape, bytes)| SectionSource {
            id: *id as u32,
            may_ignore: id.may_ignore(),
            element: id.form().0,
            shape,
            bytes,
        })
        .collect();
    file_of(header, &sources)
}

pub fn file_of(header: &Header, sources: &[SectionSource<'_>]) -> Vec<u8> {
    let mut out = vec![0; written_len(sources).unwrap()];
    write(header, sources, &mut out).unwrap();
    out
}

/// A section of `f32`.
pub fn float_section<'a>(id: SectionId, shape: &'a [u32], bytes: &'a [u8]) -> SectionSource<'a> {
    SectionSource { id: id as u32, may_ignore: false, element: ElementType::F32, shape, bytes }
}

/// Cases of a property test: 1 000 per change (`PROPTEST_CASES` overrides, 100 000 before a release).
pub fn cases() -> u32 {
    std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(1000)
}
