//! Inputs of the vectors: a stream of numbers that is the same for ever.

use crate::reference::number::Number;

/// SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, Fast splittable pseudorandom number generators, 2014).
#[derive(Debug)]
pub struct Stream {
    state: u64,
}

impl Stream {
    /// The stream of a name.
    pub fn of(name: &str) -> Self {
        // FNV-1a: a different stream for every name.
        let hash = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        Stream { state: name.bytes().fold(0xcbf2_9ce4_8422_2325, hash) }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// A number in `-size..size`.
    pub fn number<R: Number>(&mut self, size: f64) -> R {
        R::of(size * ((self.next() >> 11) as f64 / (1u64 << 52) as f64 - 1.0))
    }

    /// So many numbers.
    pub fn numbers<R: Number>(&mut self, count: usize, size: f64) -> Vec<R> {
        (0..count).map(|_| self.number(size)).collect()
    }

    /// Three numbers.
    pub fn point<R: Number>(&mut self, size: f64) -> [R; 3] {
        [0; 3].map(|_| self.number(size))
    }

    /// So many points.
    pub fn points<R: Number>(&mut self, count: usize, size: f64) -> Vec<[R; 3]> {
        (0..count).map(|_| self.point(size)).collect()
    }

    /// An index below `limit`.
    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }
}
