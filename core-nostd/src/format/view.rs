//! Typed views of a section's bytes: any alignment, any host byte order, no copy.

/// A view of little-endian `f32`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Floats<'a> {
    bytes: &'a [[u8; 4]],
}

/// A view of little-endian `u32`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Indices<'a> {
    bytes: &'a [[u8; 4]],
}

macro_rules! view {
    ($name:ident, $element:ident) => {
        impl<'a> $name<'a> {
            /// Whole elements of `bytes`.
            pub(crate) fn new(bytes: &'a [u8]) -> Self {
                $name { bytes: bytes.as_chunks().0 }
            }

            /// Number of elements.
            pub fn len(&self) -> usize {
                self.bytes.len()
            }

            /// No elements.
            pub fn is_empty(&self) -> bool {
                self.bytes.is_empty()
            }

            /// Element `index`.
            #[inline]
            pub fn get(&self, index: usize) -> Option<$element> {
                self.bytes.get(index).map(|bytes| $element::from_le_bytes(*bytes))
            }

            /// The elements in order.
            #[inline]
            pub fn iter(&self) -> impl ExactSizeIterator<Item = $element> + DoubleEndedIterator + use<'a> {
                self.bytes.iter().map(|bytes| $element::from_le_bytes(*bytes))
            }

            /// `len` elements from `from` on.
            pub fn part(&self, from: usize, len: usize) -> Option<Self> {
                let bytes = self.bytes.get(from..from.checked_add(len)?)?;
                Some($name { bytes })
            }
        }
    };
}

view!(Floats, f32);
view!(Indices, u32);

/// A view of triangles.
#[derive(Debug, Clone, Copy)]
pub struct Faces<'a> {
    corners: Indices<'a>,
}

impl<'a> Faces<'a> {
    pub(super) fn new(corners: Indices<'a>) -> Self {
        Faces { corners }
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.corners.len() / 3
    }

    /// No triangles.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Vertices of triangle `index`, counter-clockwise from outside.
    pub fn get(&self, index: usize) -> Option<[u32; 3]> {
        let first = index.checked_mul(3)?;
        let corner = |k: usize| self.corners.get(first.checked_add(k)?);
        Some([corner(0)?, corner(1)?, corner(2)?])
    }

    /// The triangles in order.
    pub fn iter(&self) -> impl Iterator<Item = [u32; 3]> + use<'a> {
        let faces = *self;
        (0..faces.len()).filter_map(move |index| faces.get(index))
    }
}

/// A view of lines of text.
#[derive(Debug, Clone, Copy)]
pub struct Lines<'a> {
    text: &'a str,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Lines { text }
    }

    /// The lines in order.
    pub fn iter(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        // Not `str::split`, whose searcher keeps a panic path in the linked program.
        let mut rest = Some(self.text);
        core::iter::from_fn(move || {
            let text = rest?;
            let end = text.bytes().position(|byte| byte == b'\n').unwrap_or(text.len());
            let (line, behind) = text.split_at_checked(end)?;
            // A line feed is one byte.
            rest = behind.get(1..);
            Some(line)
        })
    }

    /// Line `index`.
    pub fn get(&self, index: usize) -> Option<&'a str> {
        self.iter().nth(index)
    }

    /// All lines as one text.
    pub fn text(&self) -> &'a str {
        self.text
    }
}
