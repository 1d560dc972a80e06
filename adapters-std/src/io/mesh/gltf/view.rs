//! Parts of buffers, and the numbers in them.

use super::problem::{Datum, Problem};

/// The type of the numbers of an accessor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    pub(super) fn numbered(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    pub(super) fn n_bytes(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    /// The largest integer, which normalised numbers are divided by.
    pub(super) fn largest(self) -> f64 {
        match self {
            Component::I8 => f64::from(i8::MAX),
            Component::U8 => f64::from(u8::MAX),
            Component::I16 => f64::from(i16::MAX),
            Component::U16 => f64::from(u16::MAX),
            Component::U32 => f64::from(u32::MAX),
            Component::F32 => 1.0,
        }
    }

    /// The number in the first bytes of `bytes`, which has at least [`Component::n_bytes`].
    fn number(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Component::I8, [a, ..]) => f64::from(i8::from_le_bytes([*a])),
            (Component::U8, [a, ..]) => f64::from(*a),
            (Component::I16, [a, b, ..]) => f64::from(i16::from_le_bytes([*a, *b])),
            (Component::U16, [a, b, ..]) => f64::from(u16::from_le_bytes([*a, *b])),
            (Component::U32, [a, b, c, d, ..]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
            (Component::F32, [a, b, c, d, ..]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
            _ => 0.0,
        }
    }
}

/// A part of a buffer.
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    /// Where they begin.
    pub start: Datum,
    pub stride: Option<u64>,
}

impl View<'_> {
    /// Appends `count` elements of `width` numbers from `offset` on, and says where they stand.
    pub(super) fn push_numbers(
        &self,
        numbers: &mut Vec<f64>,
        component: Component,
        width: usize,
        count: usize,
        offset: u64,
    ) -> Result<Origin, Problem> {
        let size = width * component.n_bytes();
        let stride = self.stride.unwrap_or(size as u64);
        if stride < size as u64 {
            let problem = format!("its byteStride of {stride} is less than the {size} bytes of an element");
            return Err(Problem::at("bufferView", problem));
        }
        let origin = Origin {
            first: Datum {
                byte: self.start.byte.saturating_add(usize::try_from(offset).unwrap_or(usize::MAX)),
                ..self.start
            },
            stride: usize::try_from(stride).unwrap_or(usize::MAX),
            size: component.n_bytes(),
        };
        let Some(last) = (count as u64).checked_sub(1) else { return Ok(origin) };
        let end = stride.checked_mul(last).and_then(|bytes| bytes.checked_add(size as u64)?.checked_add(offset));
        let n_bytes = self.bytes.len();
        if end.is_none_or(|end| end > n_bytes as u64) {
            let problem = format!(
                "{count} elements of {size} bytes, {stride} apart, from byte {offset} on, but the view has {n_bytes}"
            );
            return Err(Problem::at("byteOffset", problem));
        }
        // Offset and stride end within the view, so they fit into `usize`; a stride without a second element need not.
        let elements = self.bytes[offset as usize..].chunks(origin.stride);
        for element in elements.take(count) {
            numbers.extend(element[..size].chunks_exact(component.n_bytes()).map(|bytes| component.number(bytes)));
        }
        Ok(origin)
    }
}

/// Where the numbers of an accessor stand: those of an element side by side, elements a stride apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Origin {
    first: Datum,
    stride: usize,
    /// The bytes of a number.
    size: usize,
}

impl Origin {
    /// The number `at` of an element that the view holds.
    pub(super) fn datum(self, element: usize, at: usize) -> Datum {
        Datum { byte: self.first.byte + element * self.stride + at * self.size, ..self.first }
    }
}
