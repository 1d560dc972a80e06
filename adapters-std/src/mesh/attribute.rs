//! Numbers of the vertices beyond position, normal and colour.

/// The type in which a file stores a number. All fit into `f64` exactly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// The bytes that a number of the type takes.
    pub fn n_bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::F64 => 8,
        }
    }

    /// Whether the type holds the number exactly, with the sign of a zero; the real types hold what is no number.
    pub fn holds(self, value: f64) -> bool {
        let held = match self {
            Scalar::I8 => f64::from(value as i8),
            Scalar::U8 => f64::from(value as u8),
            Scalar::I16 => f64::from(value as i16),
            Scalar::U16 => f64::from(value as u16),
            Scalar::I32 => f64::from(value as i32),
            Scalar::U32 => f64::from(value as u32),
            Scalar::F32 if value.is_nan() => return true,
            Scalar::F32 => f64::from(value as f32),
            Scalar::F64 => return true,
        };
        held.to_bits() == value.to_bits()
    }
}

/// One number per vertex, with a name: a label, a confidence, a distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// The name, unique in its mesh; that of the PLY property.
    pub name: String,
    /// The type in which files store it.
    pub scalar: Scalar,
    /// One value per vertex, each exact in `scalar`.
    pub values: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use super::Scalar;

    #[test]
    fn types_hold_their_range_and_nothing_else() {
        for (scalar, held, not) in [
            (Scalar::I8, [-128.0, 127.0], [128.0, -0.0]),
            (Scalar::U8, [0.0, 255.0], [-1.0, 0.5]),
            (Scalar::I16, [-32768.0, 32767.0], [32768.0, f64::NAN]),
            (Scalar::U16, [0.0, 65535.0], [65536.0, f64::INFINITY]),
            (Scalar::I32, [-2147483648.0, 1.0], [2147483648.0, 1e300]),
            (Scalar::U32, [0.0, 4294967295.0], [4294967296.0, -1.0]),
            (Scalar::F32, [0.25, f64::NAN], [0.1, 1e300]),
        ] {
            assert!(held.iter().all(|&value| scalar.holds(value)), "{scalar:?}");
            assert!(not.iter().all(|&value| !scalar.holds(value) && Scalar::F64.holds(value)), "{scalar:?}");
        }
    }
}
