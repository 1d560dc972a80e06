//! Deterministic bilinear models at three sizes.

use habitus::io::model::quantise;
use habitus_core::format::{Checksums, ElementType, Header, Kind, Model, SectionId, SectionSource, write, written_len};
use habitus_core::generator::NUMBERS;
use habitus_core::generator::bilinear::Bilinear;

/// Counts of a model.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// What the tables call it.
    pub name: &'static str,
    /// Vertices.
    pub vertices: usize,
    /// Identity weights.
    pub identity: usize,
    /// Pose weights.
    pub pose: usize,
}

/// Fits in the first cache.
pub const TOY: Size = Size { name: "toy", vertices: 200, identity: 5, pose: 3 };
/// Fits in the last cache: 15 MB.
pub const SMALL: Size = Size { name: "small", vertices: 5996, identity: 30, pose: 7 };
/// Fits in no cache: 802 MB.
pub const BIG: Size = Size { name: "big", vertices: 26719, identity: 100, pose: 25 };

/// A model file in memory whose coefficients start at the line of the cache that was asked for.
pub struct ModelMemory {
    bytes: Vec<u8>,
    from: usize,
    len: usize,
    /// Identity weights.
    pub identity: Vec<f32>,
    /// Pose weights.
    pub pose: Vec<f32>,
}

/// A number in -1..1 that is a function of `k`; `peer.cpp` has the same.
pub fn noise(k: usize) -> f32 {
    let mixed = (k as u32 ^ 0x9e37).wrapping_mul(0x85eb_ca6b);
    let mixed = (mixed ^ (mixed >> 13)).wrapping_mul(0xc2b2_ae35);
    (mixed >> 8) as f32 / 8_388_608.0 - 1.0
}

impl ModelMemory {
    /// Makes the model of a size, `shift` bytes behind a multiple of 64.
    ///
    /// # Panics
    /// When the memory does not suffice, or on a fault of the writer.
    pub fn new(size: Size, shift: usize) -> Self {
        let header = Header {
            kind: Kind::Bilinear,
            n_vertices: size.vertices as u32,
            identity_dim: size.identity as u32,
            pose_dim: size.pose as u32,
            identity_linear: false,
            pose_linear: false,
            dual_quaternion: false,
        };
        let (blocks, terms) = (header.n_blocks(), header.n_terms());
        let mut coefficients = vec![0u8; 4 * blocks * terms * NUMBERS];
        for (at, raw) in coefficients.as_chunks_mut::<4>().0.iter_mut().enumerate() {
            let (block, k) = (at / (terms * NUMBERS), at % (terms * NUMBERS));
            if block * 16 + k % 16 < size.vertices {
                let scale = if k < NUMBERS { 100.0 } else { 1.0 };
                *raw = (scale * noise(at)).to_le_bytes();
            }
        }
        let shape = [blocks as u32, terms as u32, 3, 16];
        let id = SectionId::Coefficients as u32;
        let source =
            SectionSource { id, may_ignore: false, element: ElementType::F32, shape: &shape, bytes: &coefficients };
        let len = written_len(&[source]).expect("fits the address space");
        let mut bytes = vec![0; len + 128];
        let from = bytes.as_ptr().align_offset(64) + shift;
        write(&header, &[source], &mut bytes[from..from + len]).expect("a valid model");
        let identity = (0..size.identity).map(|k| noise(1_000_000 + k)).collect();
        let pose = (0..size.pose).map(|k| noise(2_000_000 + k)).collect();
        ModelMemory { bytes, from, len, identity, pose }
    }

    /// The file of the same model in another storage.
    ///
    /// # Panics
    /// As [`ModelMemory::new`].
    pub fn stored(&self, element: ElementType) -> Vec<u8> {
        let model = Model::open_with(&self.bytes[self.from..self.from + self.len], Checksums::Skip);
        quantise(&model.expect("the model that was written"), element).expect("a model of f32").0
    }

    /// The generator.
    ///
    /// # Panics
    /// On a fault of the reader.
    pub fn generator(&self) -> Bilinear<'_> {
        let file = &self.bytes[self.from..self.from + self.len];
        Model::open_with(file, Checksums::Skip).and_then(|model| model.bilinear()).expect("the model that was written")
    }
}
