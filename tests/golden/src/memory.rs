//! The caller's memory, and the inputs that are read from the text into it.

use habitus_core::workspace::Workspace;

use crate::result::Problem;
use crate::text::{Case, Cases, decimal, hexadecimal};

/// Memory of the caller; every case starts anew in it.
#[derive(Debug)]
pub struct Memory<'m> {
    /// `f32` inputs, outputs and workspaces.
    pub floats: &'m mut [f32],
    /// The same in `f64`.
    pub doubles: &'m mut [f64],
    /// A model file.
    pub bytes: &'m mut [u8],
    /// Indices.
    pub indices: &'m mut [u32],
}

/// How much of each kind is needed.
#[derive(Debug, Clone, Copy)]
#[allow(missing_docs)]
pub struct Requirement {
    pub floats: usize,
    pub doubles: usize,
    pub bytes: usize,
    pub indices: usize,
}

impl Memory<'_> {
    /// All of it, for one case; numbers zeroed, so that nothing of the last case can pass for a result.
    pub(crate) fn pieces(&mut self) -> Pieces<'_> {
        self.floats.fill(0.0);
        self.doubles.fill(0.0);
        Pieces {
            floats: Workspace::new(self.floats),
            doubles: Workspace::new(self.doubles),
            bytes: Workspace::new(self.bytes),
            indices: Workspace::new(self.indices),
        }
    }
}

/// What is left of the memory.
pub(crate) struct Pieces<'m> {
    floats: Workspace<'m, f32>,
    doubles: Workspace<'m, f64>,
    bytes: Workspace<'m, u8>,
    indices: Workspace<'m, u32>,
}

/// `f32` or `f64` as this crate sees them: bit patterns of a number of digits.
pub(crate) trait Number: habitus_core::Real + 'static {
    const DIGITS: usize;
    fn of_bits(bits: u64) -> Self;
    fn bits(self) -> u64;
    fn taken<'m>(pieces: &mut Pieces<'m>, count: usize) -> Result<&'m mut [Self], Problem>;
}

macro_rules! number {
    ($t:ident, $bits:ident, $digits:literal, $pieces:ident) => {
        impl Number for $t {
            const DIGITS: usize = $digits;
            fn of_bits(bits: u64) -> Self {
                $t::from_bits(bits as $bits)
            }
            fn bits(self) -> u64 {
                u64::from(self.to_bits())
            }
            fn taken<'m>(pieces: &mut Pieces<'m>, count: usize) -> Result<&'m mut [Self], Problem> {
                pieces.$pieces.take(count).map_err(|_| Problem::Memory)
            }
        }
    };
}

number!(f32, u32, 8, floats);
number!(f64, u64, 16, doubles);

impl<'m> Pieces<'m> {
    /// So many zeros.
    pub fn zeros<R: Number>(&mut self, count: usize) -> Result<&'m mut [R], Problem> {
        R::taken(self, count)
    }

    /// The numbers of a field; none without the field.
    pub fn numbers<R: Number>(&mut self, case: &Case<'_>, key: &'static str) -> Result<&'m mut [R], Problem> {
        let Some(values) = case.field(key) else { return Ok(&mut []) };
        let numbers = R::taken(self, values.count())?;
        for (number, word) in numbers.iter_mut().zip(values) {
            *number = R::of_bits(hexadecimal(word, R::DIGITS).ok_or(Problem::Text(key))?);
        }
        Ok(numbers)
    }

    /// The integers of a field; none without the field.
    pub fn integers(&mut self, case: &Case<'_>, key: &'static str) -> Result<&'m mut [u32], Problem> {
        let Some(values) = case.field(key) else { return Ok(&mut []) };
        let integers = self.indices.take(values.count()).map_err(|_| Problem::Memory)?;
        for (integer, word) in integers.iter_mut().zip(values) {
            *integer = decimal(word).ok_or(Problem::Text(key))?;
        }
        Ok(integers)
    }

    /// The model file that the case names, with the changes of its fields `patch` (position, new byte) and `length`.
    pub fn model(&mut self, case: &Case<'_>, models: &str) -> Result<&'m mut [u8], Problem> {
        let name = case.word("model").ok_or(Problem::Text("model"))?;
        let model = Cases::new(models).find(|model| model.name == name).ok_or(Problem::Text("model"))?;
        let length = integer(&model, "length")? as usize;
        let kept = if case.word("length").is_some() { integer(case, "length")? as usize } else { length };
        let bytes = self.bytes.take(length.max(kept)).map_err(|_| Problem::Memory)?;
        bytes.fill(0);
        let mut rest = bytes.iter_mut();
        for word in model.field("bytes").ok_or(Problem::Text("bytes"))? {
            if let Some(count) = word.strip_prefix("00*") {
                for _ in 0..decimal(count).ok_or(Problem::Text("bytes"))? {
                    *rest.next().ok_or(Problem::Text("bytes"))? = 0;
                }
            } else {
                for pair in word.as_bytes().chunks(2) {
                    let pair = core::str::from_utf8(pair).ok().and_then(|pair| hexadecimal(pair, 2));
                    *rest.next().ok_or(Problem::Text("bytes"))? = pair.ok_or(Problem::Text("bytes"))? as u8;
                }
            }
        }
        let mut patch = case.field("patch").into_iter().flatten();
        while let Some(position) = patch.next() {
            let value = patch.next().and_then(|word| hexadecimal(word, 2)).ok_or(Problem::Text("patch"))?;
            let byte = decimal(position).and_then(|position| bytes.get_mut(position as usize));
            *byte.ok_or(Problem::Text("patch"))? = value as u8;
        }
        bytes.get_mut(..kept).ok_or(Problem::Text("length"))
    }
}

/// The one integer of a field.
pub(crate) fn integer(case: &Case<'_>, key: &'static str) -> Result<u32, Problem> {
    case.word(key).and_then(decimal).ok_or(Problem::Text(key))
}

/// The one number of a field.
pub(crate) fn number<R: Number>(case: &Case<'_>, key: &'static str) -> Result<R, Problem> {
    let bits = case.word(key).and_then(|word| hexadecimal(word, R::DIGITS));
    bits.map(R::of_bits).ok_or(Problem::Text(key))
}

/// So many numbers of a field.
pub(crate) fn array<R: Number, const N: usize>(case: &Case<'_>, key: &'static str) -> Result<[R; N], Problem> {
    let mut numbers = [R::ZERO; N];
    let values = case.field(key).ok_or(Problem::Text(key))?;
    if values.count() != N {
        return Err(Problem::Text(key));
    }
    for (number, word) in numbers.iter_mut().zip(values) {
        *number = R::of_bits(hexadecimal(word, R::DIGITS).ok_or(Problem::Text(key))?);
    }
    Ok(numbers)
}
