//! Equation 8.2 with terms in half precision or bytes.

use super::bilinear::{Bilinear, Linearised};
use super::model_file::{Extras, Head, Section, extra_sections, head};
use super::skin_file::stored_coefficients;
use super::storage::{Storage, Sum, Term};

/// A bilinear model whose terms are stored; the offset is `f32`.
#[derive(Debug, Clone)]
pub struct StoredBilinear {
    head: Head,
    /// Filled up with zeros.
    offset: Vec<[f32; 3]>,
    pose_linear: Option<Vec<Term>>,
    identity_linear: Option<Vec<Term>>,
    bilinear: Vec<Vec<Term>>,
}

fn plus_scaled(sum: [f32; 3], weight: f32, term: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| sum[axis] + weight * term[axis])
}

impl StoredBilinear {
    /// Stores a model.
    pub fn new(model: &Bilinear, storage: Storage) -> Self {
        let all = |terms: &Vec<Vec<[f32; 3]>>| terms.iter().map(|term| storage.stored(term)).collect::<Vec<Term>>();
        let mut offset = model.offset.clone();
        offset.resize(model.n().next_multiple_of(16), [0.0; 3]);
        StoredBilinear {
            head: head(model),
            offset,
            pose_linear: model.pose_linear.as_ref().map(all),
            identity_linear: model.identity_linear.as_ref().map(all),
            bilinear: model.bilinear.iter().map(all).collect(),
        }
    }

    /// What its file's header says.
    pub fn head(&self) -> Head {
        self.head
    }

    /// The sections of its file.
    pub fn sections(&self, extras: &Extras) -> Vec<Section> {
        let mut terms: Vec<&Term> = self.pose_linear.iter().flatten().collect();
        for (i, row) in self.bilinear.iter().enumerate() {
            terms.extend(self.identity_linear.iter().map(|linear| &linear[i]));
            terms.extend(row);
        }
        let mut sections = stored_coefficients(&self.offset, &terms);
        sections.extend(extra_sections(extras));
        sections
    }

    /// Number of vertices, and with those that fill up the last block.
    pub fn counts(&self) -> (usize, usize) {
        (self.head.n, self.offset.len())
    }

    /// `t_i`, summed as the storage sums: it begins with the linear term, or with nothing.
    fn identity_column(&self, i: usize, y: &[f32], v: usize) -> [f32; 3] {
        let mut sum = self.identity_linear.as_ref().map_or(Sum::zero(), |a| Sum::of(&a[i], v));
        for (term, &y) in self.bilinear[i].iter().zip(y) {
            sum.add(term, v, y);
        }
        sum.total()
    }

    /// `o + sum_j y_j b_j` of the decoded terms.
    fn pose_offset(&self, y: &[f32], v: usize) -> [f32; 3] {
        let mut value = self.offset[v];
        for (term, &y) in self.pose_linear.iter().flatten().zip(y) {
            value = plus_scaled(value, y, term.decoded(v));
        }
        value
    }

    /// `b_j + sum_i x_i m_ij` of the decoded terms.
    fn pose_column(&self, x: &[f32], j: usize, v: usize) -> [f32; 3] {
        let mut column = self.pose_linear.as_ref().map_or([0.0; 3], |b| b[j].decoded(v));
        for (row, &x) in self.bilinear.iter().zip(x) {
            column = plus_scaled(column, x, row[j].decoded(v));
        }
        column
    }

    /// Position and derivatives.
    pub fn linearised(&self, x: &[f32], y: &[f32], v: usize) -> Linearised {
        let columns: Vec<[f32; 3]> = (0..x.len()).map(|i| self.identity_column(i, y, v)).collect();
        let mut value = self.pose_offset(y, v);
        for (&x, &column) in x.iter().zip(&columns) {
            value = plus_scaled(value, x, column);
        }
        let by_pose = (0..y.len()).map(|j| self.pose_column(x, j, v));
        Linearised { value, derivatives: columns.iter().copied().chain(by_pose).collect() }
    }

    /// Offset and columns when the identity is fixed.
    pub fn with_identity(&self, x: &[f32], v: usize) -> Linearised {
        let mut value = self.offset[v];
        for (term, &x) in self.identity_linear.iter().flatten().zip(x) {
            value = plus_scaled(value, x, term.decoded(v));
        }
        Linearised { value, derivatives: (0..self.head.pose_dim).map(|j| self.pose_column(x, j, v)).collect() }
    }

    /// Offset and columns when the pose is fixed.
    pub fn with_pose(&self, y: &[f32], v: usize) -> Linearised {
        let columns = (0..self.head.identity_dim).map(|i| self.identity_column(i, y, v));
        Linearised { value: self.pose_offset(y, v), derivatives: columns.collect() }
    }
}
