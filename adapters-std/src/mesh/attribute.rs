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
