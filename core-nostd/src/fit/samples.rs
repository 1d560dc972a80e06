//! Which point of the model belongs to which measured point.

/// A point on the surface of a model: a vertex, or a point of a triangle by barycentric weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Vertices.
    pub vertices: [u32; 3],
    /// Their weights, sum 1. A vertex of weight 0 is not looked at.
    pub barycentric: [f32; 3],
}

impl SurfacePoint {
    /// A vertex.
    pub const fn vertex(vertex: u32) -> Self {
        SurfacePoint { vertices: [vertex, 0, 0], barycentric: [1.0, 0.0, 0.0] }
    }
}

/// A point of the model and where it was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Point of the model.
    pub point: SurfacePoint,
    /// Measured position in the frame of the scan, millimetres.
    pub target: [f32; 3],
    /// Unit normal of the scan at the target: with it only the distance along the normal counts (point to plane).
    pub normal: Option<[f32; 3]>,
    /// Weight of the squared distance, at least 0; 0 leaves the sample out.
    pub weight: f32,
}

/// A sequence of samples.
pub trait Samples {
    /// Number of samples.
    fn len(&self) -> usize;

    /// Sample `index`; `None` leaves it out.
    fn get(&self, index: usize) -> Option<Sample>;

    /// No samples.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Samples for [Sample] {
    fn len(&self) -> usize {
        self.len()
    }

    fn get(&self, index: usize) -> Option<Sample> {
        self.get(index).copied()
    }
}
