//! Small models for the unit tests.

use std::vec::Vec;

use crate::format::{ElementType, Header, Kind, SectionId, SectionSource, write, written_len};
use crate::generator::Block;
use crate::quantise::{f16_of, quantised};

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
    Header {
        kind: Kind::Bilinear,
        n_vertices,
        identity_dim,
        pose_dim,
        identity_linear: linear,
        pose_linear: linear,
        dual_quaternion: false,
    }
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

/// The coefficients of `n_blocks x n_terms` terms, offsets included, as the sections of a storage.
pub fn stored(
    values: &[f32],
    n_terms: usize,
    used: usize,
    element: ElementType,
) -> Vec<(SectionId, ElementType, Vec<u32>, Vec<u8>)> {
    let blocks: Vec<&[[f32; 48]]> = values.as_chunks::<48>().0.chunks_exact(n_terms).collect();
    let n_blocks = blocks.len() as u32;
    let terms = n_terms as u32;
    if element == ElementType::F32 {
        return vec![(SectionId::Coefficients, element, vec![n_blocks, terms, 3, 16], bytes_of(values))];
    }
    let offsets: Vec<f32> = blocks.iter().flat_map(|block| block[0]).collect();
    let mut sections = vec![(SectionId::Offsets, ElementType::F32, vec![n_blocks, 3, 16], bytes_of(&offsets))];
    let (mut bytes, mut ranges) = (Vec::new(), Vec::new());
    for (index, block) in blocks.iter().enumerate() {
        for term in &block[1..] {
            if element == ElementType::F16 {
                bytes.extend(term.iter().flat_map(|&value| f16_of(value).to_le_bytes()));
            } else {
                let term = quantised(&Block::load(term), used.saturating_sub(16 * index).min(16));
                bytes.extend(term.codes.map(|code| code as u8));
                ranges.extend(term.ranges.into_iter().flatten());
            }
        }
    }
    sections.push((SectionId::Coefficients, element, vec![n_blocks, terms - 1, 3, 16], bytes));
    if element == ElementType::I8 {
        sections.push((SectionId::Ranges, ElementType::F32, vec![n_blocks, terms - 1, 3, 2], bytes_of(&ranges)));
    }
    sections
}

/// A small body: joints (parent, axis of a revolute one), corrective terms, dual quaternions, storage.
#[derive(Debug, Clone)]
pub struct Body {
    pub n_vertices: u32,
    pub identity_dim: u32,
    pub joints: Vec<(u32, Option<[f32; 3]>)>,
    pub corrections: bool,
    pub dual: bool,
    pub element: ElementType,
}

impl Body {
    pub fn new(n_vertices: u32, identity_dim: u32) -> Self {
        let joints = vec![
            (u32::MAX, None),
            (0, Some([1.0, 0.0, 0.0])),
            (1, Some([0.0, 0.6, 0.8])),
            (2, None),
            (0, Some([0.0, 0.0, 1.0])),
        ];
        Body { n_vertices, identity_dim, joints, corrections: false, dual: false, element: ElementType::F32 }
    }

    pub fn header(&self) -> Header {
        let pose_dim = self.joints.iter().map(|(_, axis)| if axis.is_some() { 1 } else { 3 }).sum();
        Header {
            kind: Kind::Skinned,
            n_vertices: self.n_vertices,
            identity_dim: self.identity_dim,
            pose_dim,
            identity_linear: true,
            pose_linear: self.corrections,
            dual_quaternion: self.dual,
        }
    }

    pub fn file(&self, seed: u32) -> Vec<u8> {
        let header = self.header();
        let mut stream = Stream::new(seed);
        let (j, d, n) = (self.joints.len(), self.identity_dim, self.n_vertices as usize);
        let n_terms = header.n_terms() + if self.corrections { 9 * j } else { 0 };
        let mut values = Vec::new();
        for block in 0..header.n_blocks() {
            for term in 0..n_terms {
                for lane in 0..48 {
                    let used = block * 16 + lane % 16 < n;
                    let size = if term == 0 { 300.0 } else { 10.0 };
                    values.push(if used { size * stream.next() } else { 0.0 });
                }
            }
        }
        let mut sections = stored(&values, n_terms, n, self.element);
        let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let parents: Vec<u32> = self.joints.iter().map(|joint| joint.0).collect();
        let axes: Vec<f32> = self.joints.iter().flat_map(|joint| joint.1.unwrap_or_default()).collect();
        let positions: Vec<f32> = stream.take(3 * j).iter().map(|value| 200.0 * value).collect();
        let basis: Vec<f32> = stream.take(3 * j * d as usize).iter().map(|value| 5.0 * value).collect();
        let (mut starts, mut joints, mut weights) = (vec![0], Vec::new(), Vec::new());
        for block in 0..header.n_blocks() {
            // Two or three joints a block, a random share of each.
            let first = block % (j - 2);
            let held: Vec<usize> = (first..first + 2 + block % 2).collect();
            let shares: Vec<Vec<f32>> = (0..16)
                .map(|lane| {
                    let raw: Vec<f32> = held.iter().map(|_| (1.0 + stream.next()).max(0.01)).collect();
                    let used = if block * 16 + lane < n { 1.0 } else { 0.0 };
                    raw.iter().map(|value| used * value / raw.iter().sum::<f32>()).collect()
                })
                .collect();
            for (position, joint) in held.iter().enumerate() {
                joints.push(*joint as u32);
                weights.extend(shares.iter().map(|share| share[position]));
            }
            starts.push(joints.len() as u32);
        }
        let (j, entries, f) = (j as u32, joints.len() as u32, ElementType::F32);
        let u = ElementType::U32;
        sections.extend([
            (SectionId::JointParents, u, vec![j], words(&parents)),
            (SectionId::JointAxes, f, vec![j, 3], bytes_of(&axes)),
            (SectionId::JointPositions, f, vec![j, 3], bytes_of(&positions)),
            (SectionId::JointBasis, f, vec![j, d, 3], bytes_of(&basis)),
            (SectionId::SkinStarts, u, vec![starts.len() as u32], words(&starts)),
            (SectionId::SkinJoints, u, vec![entries], words(&joints)),
            (SectionId::SkinWeights, f, vec![entries, 16], bytes_of(&weights)),
            (SectionId::PoseLower, f, vec![header.pose_dim], bytes_of(&vec![-1.0; header.pose_dim as usize])),
            (SectionId::PoseUpper, f, vec![header.pose_dim], bytes_of(&vec![2.0; header.pose_dim as usize])),
            (SectionId::JointNames, ElementType::U8, vec![2 * j - 1], "j\n".repeat(j as usize).trim_end().into()),
        ]);
        file_of_sections(&header, &sections)
    }
}

/// A linear model.
pub fn linear_file(n_vertices: u32, dim: u32, element: ElementType, seed: u32) -> Vec<u8> {
    let kind = Kind::Linear;
    let header = Header {
        kind,
        n_vertices,
        identity_dim: dim,
        pose_dim: 0,
        identity_linear: true,
        pose_linear: false,
        dual_quaternion: false,
    };
    let sections = stored(&coefficients(&header, seed), header.n_terms(), n_vertices as usize, element);
    file_of_sections(&header, &sections)
}

/// A bilinear model without anything but its coefficients.
pub fn bilinear_file(header: &Header, element: ElementType, seed: u32) -> Vec<u8> {
    let n = header.n_vertices as usize;
    file_of_sections(header, &stored(&coefficients(header, seed), header.n_terms(), n, element))
}

/// A small wavelet model.
#[derive(Debug, Clone)]
pub struct Waves {
    pub base: [u32; 2],
    pub levels: u32,
    pub bilinear: bool,
    pub dims: [u32; 2],
    pub element: ElementType,
}

impl Waves {
    pub fn new(base: [u32; 2], levels: u32) -> Self {
        Waves { base, levels, bilinear: false, dims: [3, 2], element: ElementType::F32 }
    }

    pub fn header(&self) -> Header {
        let [width, height] = self.base.map(|size| ((size - 1) << self.levels) + 1);
        Header { kind: Kind::Wavelet, ..header(width * height, self.dims[0], self.dims[1], false) }
    }

    /// Means of about 100 mm at the base and less on finer levels, terms of about a tenth.
    pub fn values(&self, seed: u32) -> Vec<f32> {
        let header = self.header();
        let base = (self.base[0] * self.base[1]) as usize;
        let mut values = coefficients(&header, seed);
        let per_block = 48 * header.n_terms();
        for (k, value) in values.iter_mut().enumerate() {
            if k / per_block * 16 + k % 16 >= base {
                *value *= 0.1;
            }
        }
        values
    }

    pub fn file(&self, seed: u32) -> Vec<u8> {
        let (header, f) = (self.header(), ElementType::F32);
        let n = header.n_vertices;
        let mut sections = stored(&self.values(seed), header.n_terms(), n as usize, self.element);
        let grid = [self.base[0], self.base[1], self.levels, u32::from(self.bilinear)];
        let words = |values: &[u32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
        let mut stream = Stream::new(seed + 1);
        for (ids, dim) in [
            ([SectionId::IdentityMean, SectionId::IdentityScale], self.dims[0]),
            ([SectionId::PoseMean, SectionId::PoseScale], self.dims[1]),
        ] {
            let count = n * dim;
            let mean: Vec<f32> = stream.take(count as usize).iter().map(|value| 1.0 + 0.2 * value).collect();
            let scale: Vec<f32> = stream.take(count as usize).iter().map(|value| 0.6 + 0.2 * value).collect();
            sections.push((ids[0], f, vec![count], bytes_of(&mean)));
            sections.push((ids[1], f, vec![count], bytes_of(&scale)));
        }
        sections.push((SectionId::Landmarks, ElementType::U32, vec![4], words(&[0, n / 3, n / 2, n - 1])));
        sections.push((SectionId::Grid, ElementType::U32, vec![4], words(&grid)));
        file_of_sections(&header, &sections)
    }
}

pub fn file_of_sections(header: &Header, sections: &[(SectionId, ElementType, Vec<u32>, Vec<u8>)]) -> Vec<u8> {
    let sources: Vec<SectionSource<'_>> = sections
        .iter()
        .map(|(id, element, shape, bytes)| SectionSource {
            id: *id as u32,
            may_ignore: id.may_ignore(),
            element: *element,
            shape,
            bytes,
        })
        .collect();
    file_of(header, &sources)
}
