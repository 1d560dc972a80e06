//! Equation 8.2 vertex by vertex: plain arrays of terms, no blocks.

/// A bilinear model: every term is one point per vertex.
#[derive(Debug, Clone)]
pub struct Bilinear {
    /// `o`: per vertex.
    pub offset: Vec<[f32; 3]>,
    /// `b_j`: per pose weight and vertex; none without pose-linear terms.
    pub pose_linear: Option<Vec<Vec<[f32; 3]>>>,
    /// `a_i`: per identity weight and vertex; none without identity-linear terms.
    pub identity_linear: Option<Vec<Vec<[f32; 3]>>>,
    /// `m_ij`: per identity weight, pose weight and vertex.
    pub bilinear: Vec<Vec<Vec<[f32; 3]>>>,
}

/// Value and derivatives of one vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearised<R = f32> {
    /// Position.
    pub value: [R; 3],
    /// By the identity weights, then by the pose weights.
    pub derivatives: Vec<[R; 3]>,
}

fn plus_scaled(sum: [f32; 3], weight: f32, term: [f32; 3]) -> [f32; 3] {
    [sum[0] + weight * term[0], sum[1] + weight * term[1], sum[2] + weight * term[2]]
}

impl Bilinear {
    /// Number of vertices.
    pub fn n(&self) -> usize {
        self.offset.len()
    }

    /// Number of identity weights and of pose weights.
    pub fn dims(&self) -> (usize, usize) {
        (self.bilinear.len(), self.bilinear[0].len())
    }

    /// `t_i = a_i + sum_j y_j m_ij`.
    fn identity_column(&self, i: usize, y: &[f32], v: usize) -> [f32; 3] {
        let mut t = self.identity_linear.as_ref().map_or([0.0; 3], |a| a[i][v]);
        for (j, &y) in y.iter().enumerate() {
            t = plus_scaled(t, y, self.bilinear[i][j][v]);
        }
        t
    }

    /// `o + sum_j y_j b_j`.
    fn pose_offset(&self, y: &[f32], v: usize) -> [f32; 3] {
        let mut value = self.offset[v];
        if let Some(b) = &self.pose_linear {
            for (j, &y) in y.iter().enumerate() {
                value = plus_scaled(value, y, b[j][v]);
            }
        }
        value
    }

    /// `b_j + sum_i x_i m_ij`.
    fn pose_column(&self, x: &[f32], j: usize, v: usize) -> [f32; 3] {
        let mut column = self.pose_linear.as_ref().map_or([0.0; 3], |b| b[j][v]);
        for (i, &x) in x.iter().enumerate() {
            column = plus_scaled(column, x, self.bilinear[i][j][v]);
        }
        column
    }

    /// Position of vertex `v` at identity weights `x` and pose weights `y`.
    pub fn value(&self, x: &[f32], y: &[f32], v: usize) -> [f32; 3] {
        let mut value = self.pose_offset(y, v);
        for (i, &x) in x.iter().enumerate() {
            value = plus_scaled(value, x, self.identity_column(i, y, v));
        }
        value
    }

    /// Position and derivatives.
    pub fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        let by_identity = (0..x.len()).map(|i| self.identity_column(i, y, v));
        let by_pose = (0..y.len()).map(|j| self.pose_column(x, j, v));
        Linearised { value: self.value(x, y, v), derivatives: by_identity.chain(by_pose).collect() }
    }

    /// Offset and columns when the identity is fixed.
    pub fn with_identity(&self, x: &[f32], v: usize) -> Linearised {
        let mut offset = self.offset[v];
        if let Some(a) = &self.identity_linear {
            for (i, &x) in x.iter().enumerate() {
                offset = plus_scaled(offset, x, a[i][v]);
            }
        }
        let (_, pose_dim) = self.dims();
        Linearised { value: offset, derivatives: (0..pose_dim).map(|j| self.pose_column(x, j, v)).collect() }
    }

    /// Offset and columns when the pose is fixed.
    pub fn with_pose(&self, y: &[f32], v: usize) -> Linearised {
        let (identity_dim, _) = self.dims();
        let columns = (0..identity_dim).map(|i| self.identity_column(i, y, v));
        Linearised { value: self.pose_offset(y, v), derivatives: columns.collect() }
    }
}

/// What remains when one group of weights is fixed, at the free weights `w`: `offset + sum_k w_k column_k`.
pub fn value_of_prepared(prepared: &Linearised, w: &[f32]) -> [f32; 3] {
    let mut value = prepared.value;
    for (&w, &column) in w.iter().zip(&prepared.derivatives) {
        value = plus_scaled(value, w, column);
    }
    value
}
