//! How coefficients are stored, what they stand for, and how weighted sums of them are formed.
//!
//! A term is one displacement per vertex. Vertices are counted with those that fill up the last block of sixteen, because a byte there stands for a number too.

use super::number::Number;

/// A term as it is stored.
#[derive(Debug, Clone, PartialEq)]
pub enum Term {
    /// `f32`.
    Floats(Vec<[f32; 3]>),
    /// Bit patterns of half precision.
    Halves(Vec<[u16; 3]>),
    /// Codes, and for each block of sixteen vertices scale and offset of x, of y, of z.
    #[allow(missing_docs)]
    Bytes { codes: Vec<[i8; 3]>, ranges: Vec<[[f32; 2]; 3]> },
}

/// Which of them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Storage {
    F32,
    F16,
    I8,
}

impl Storage {
    /// All.
    pub const ALL: [Self; 3] = [Self::F32, Self::F16, Self::I8];

    /// Stores a term of `n` vertices, which is filled up with zeros.
    pub fn stored(self, points: &[[f32; 3]]) -> Term {
        let n = points.len();
        let mut all = points.to_vec();
        all.resize(n.next_multiple_of(16), [0.0; 3]);
        match self {
            Storage::F32 => Term::Floats(all),
            Storage::F16 => Term::Halves(all.iter().map(|point| point.map(half_of)).collect()),
            Storage::I8 => {
                let (mut codes, mut ranges) = (vec![[0; 3]; all.len()], Vec::new());
                for block in (0..all.len()).step_by(16) {
                    let used = 16.min(n - block);
                    ranges.push([0, 1, 2].map(|axis| {
                        let of_axis: Vec<f32> = all[block..block + used].iter().map(|point| point[axis]).collect();
                        let (found, range) = codes_of(&of_axis);
                        for lane in 0..16 {
                            codes[block + lane][axis] = found[lane];
                        }
                        range
                    }));
                }
                Term::Bytes { codes, ranges }
            }
        }
    }
}

/// Codes of sixteen vertices of one axis, of which the first few are there, with scale and offset.
fn codes_of(values: &[f32]) -> ([i8; 16], [f32; 2]) {
    let least = values.iter().copied().fold(f32::INFINITY, |a, b| if b < a { b } else { a });
    let largest = values.iter().copied().fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a });
    let scale = (largest - least) / 255.0;
    let offset = least + 128.0 * scale;
    let nearest = |value: f32| {
        let steps = if scale > 0.0 { (value - offset) / scale } else { 0.0 };
        // Halves away from zero, at the ends of the codes.
        libm::roundf(steps).clamp(-128.0, 127.0) as i8
    };
    let mut codes = [nearest(0.0); 16];
    for (code, &value) in codes.iter_mut().zip(values) {
        *code = nearest(value);
    }
    (codes, [scale, offset])
}

/// What the bits of a half-precision number stand for: `(-1)^s 2^(e-25) (1024 + f)`, `(-1)^s 2^-24 f` for e = 0.
pub fn value_of_half(bits: u16) -> f32 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    let magnitude = match exponent {
        0 => fraction * 2f64.powi(-24),
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    (if bits >> 15 == 1 { -magnitude } else { magnitude }) as f32
}

/// The nearest half-precision number, ties to even; the largest finite one beyond the range.
pub fn half_of(value: f32) -> u16 {
    let sign = if value.is_sign_negative() { 0x8000 } else { 0 };
    let magnitude = f64::from(value).abs();
    // Patterns of magnitudes are in the order of their values: the last that is not above, and the one behind it.
    let (mut below, mut above) = (0u16, 0x7bffu16);
    while above - below > 1 {
        let middle = below.midpoint(above);
        if f64::from(value_of_half(middle)) <= magnitude { below = middle } else { above = middle }
    }
    let distance = |bits: u16| (f64::from(value_of_half(bits)) - magnitude).abs();
    let nearer = match distance(below).total_cmp(&distance(above)) {
        std::cmp::Ordering::Less => below,
        std::cmp::Ordering::Greater => above,
        std::cmp::Ordering::Equal => below + (below & 1),
    };
    sign | nearer
}

impl Term {
    /// Vertices, with those that fill up the last block.
    pub fn lanes(&self) -> usize {
        match self {
            Term::Floats(points) => points.len(),
            Term::Halves(points) => points.len(),
            Term::Bytes { codes, .. } => codes.len(),
        }
    }

    /// The displacement of a vertex: for bytes the sum that begins at zero with the weight 1.
    pub fn decoded<R: Number>(&self, v: usize) -> [R; 3] {
        match self {
            Term::Floats(points) => points[v].map(|value| R::of(value.into())),
            Term::Halves(points) => points[v].map(|bits| R::of(value_of_half(bits).into())),
            Term::Bytes { .. } => {
                let mut sum = Sum::zero();
                sum.add(self, v, R::of(1.0));
                sum.total()
            }
        }
    }
}

/// A weighted sum of terms at one vertex.
#[derive(Debug, Clone, Copy)]
pub struct Sum<R> {
    values: [R; 3],
    /// What the offsets of bytes add, kept apart until the end.
    offsets: Option<[R; 3]>,
}

impl<R: Number> Sum<R> {
    /// The empty sum.
    pub fn zero() -> Self {
        Sum { values: [R::of(0.0); 3], offsets: None }
    }

    /// The sum that begins with a term.
    pub fn of(term: &Term, v: usize) -> Self {
        match term {
            Term::Bytes { .. } => {
                let mut sum = Self::zero();
                sum.add(term, v, R::of(1.0));
                sum
            }
            _ => Sum { values: term.decoded(v), offsets: None },
        }
    }

    /// Adds `weight` times a term.
    pub fn add(&mut self, term: &Term, v: usize, weight: R) {
        if let Term::Bytes { codes, ranges } = term {
            let offsets = self.offsets.get_or_insert([R::of(0.0); 3]);
            for axis in 0..3 {
                let [scale, offset] = ranges[v / 16][axis].map(|value| R::of(value.into()));
                self.values[axis] = self.values[axis] + (weight * scale) * R::of(codes[v][axis].into());
                offsets[axis] = offsets[axis] + weight * offset;
            }
            return;
        }
        let point: [R; 3] = term.decoded(v);
        for axis in 0..3 {
            self.values[axis] = self.values[axis] + weight * point[axis];
        }
    }

    /// What it has come to.
    pub fn total(&self) -> [R; 3] {
        match self.offsets {
            Some(offsets) => [0, 1, 2].map(|axis| self.values[axis] + offsets[axis]),
            None => self.values,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_come_back() {
        for bits in (0..=u16::MAX).filter(|bits| bits >> 10 & 31 != 31) {
            assert_eq!(half_of(value_of_half(bits)), bits);
        }
        assert_eq!((half_of(1e9), half_of(-65536.0)), (0x7bff, 0xfbff));
    }
}
