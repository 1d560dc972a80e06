//! Sixteen vertices side by side: x of all, then y, then z.

/// Vertices of a block.
pub const LANES: usize = 16;
/// Numbers of a block.
pub const NUMBERS: usize = 3 * LANES;
/// Bytes of a block of `f32`.
pub(crate) const RAW_BYTES: usize = 4 * NUMBERS;

/// One term of a block as it lies in the file: 3 x 16 little-endian `f32` at any alignment.
pub type RawBlock = [u8; RAW_BYTES];

/// Coordinates (or derivatives) of sixteen vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(64))]
pub struct Block {
    /// x of the sixteen vertices, y, z.
    pub axes: [[f32; LANES]; 3],
}

impl Block {
    /// All zero.
    pub const ZERO: Self = Block { axes: [[0.0; LANES]; 3] };

    /// The numbers of a stored term.
    #[inline(always)]
    pub(crate) fn of_raw(term: &RawBlock) -> Self {
        let mut block = Block::ZERO;
        for (axis, bytes) in block.axes.iter_mut().zip(term.as_chunks::<{ 4 * LANES }>().0) {
            for (value, raw) in axis.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *value = f32::from_le_bytes(*raw);
            }
        }
        block
    }

    /// The block that [`Block::store`] has written.
    #[inline(always)]
    pub fn load(numbers: &[f32; NUMBERS]) -> Self {
        let mut block = Block::ZERO;
        for (axis, from) in block.axes.iter_mut().zip(numbers.as_chunks::<LANES>().0) {
            *axis = *from;
        }
        block
    }

    /// Writes x of the vertices, then y, then z.
    #[inline(always)]
    pub fn store(&self, numbers: &mut [f32; NUMBERS]) {
        for (to, axis) in numbers.as_chunks_mut::<LANES>().0.iter_mut().zip(&self.axes) {
            *to = *axis;
        }
    }

    /// `self + weight * other`, every product rounded before it is added.
    #[inline(always)]
    pub(crate) fn plus_scaled(mut self, weight: f32, other: &Block) -> Self {
        for (axis, other) in self.axes.iter_mut().zip(&other.axes) {
            for (value, other) in axis.iter_mut().zip(other) {
                *value += weight * *other;
            }
        }
        self
    }

    /// `self + weights * other`, with a weight for each lane, every product rounded before it is added.
    #[inline(always)]
    pub(crate) fn plus_weighted(mut self, weights: &[f32; LANES], other: &Block) -> Self {
        for (axis, other) in self.axes.iter_mut().zip(&other.axes) {
            for ((value, weight), other) in axis.iter_mut().zip(weights).zip(other) {
                *value += weight * *other;
            }
        }
        self
    }

    /// Coordinates of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> [f32; 3] {
        self.axes.map(|axis| axis.get(lane).copied().unwrap_or(0.0))
    }

    /// Writes the lanes from `first` on, xyz interleaved, as many as `out` holds.
    #[inline(always)]
    pub(crate) fn write_interleaved(&self, first: usize, out: &mut [f32]) {
        let [x, y, z] = &self.axes;
        if let (0, Some(out)) = (first, out.first_chunk_mut::<NUMBERS>()) {
            // The whole block: a fixed length that the compiler shuffles in registers.
            for (lane, vertex) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                *vertex = [x[lane & 15], y[lane & 15], z[lane & 15]];
            }
            return;
        }
        let lanes = x.iter().zip(y).zip(z).skip(first);
        for (vertex, ((x, y), z)) in out.as_chunks_mut::<3>().0.iter_mut().zip(lanes) {
            *vertex = [*x, *y, *z];
        }
    }
}

/// The three coordinates of one lane of a stored term.
#[inline(always)]
pub(crate) fn lane_of_raw(term: &RawBlock, lane: usize) -> [f32; 3] {
    let (numbers, _) = term.as_chunks::<4>();
    [0, LANES, 2 * LANES].map(|axis| numbers.get(axis + lane).map_or(0.0, |raw| f32::from_le_bytes(*raw)))
}

/// The three coordinates of one lane of a block that lies in memory.
#[inline(always)]
pub(crate) fn lane_of_numbers(numbers: &[f32; NUMBERS], lane: usize) -> [f32; 3] {
    [0, LANES, 2 * LANES].map(|axis| numbers.get(axis + lane).copied().unwrap_or(0.0))
}
