//! The bilinear generator of eq. 8.2, and its equivalence with the multilinear model of eq. 12.1.
//!
//! `c[l] = o[l] + sum_i id[l, i] x[i] + sum_j pose[l, j] y[j] + sum_ij a[l, i, j] x[i] y[j]`.
//! Moving the origin of the weights to `(v2, v3)`, `w2 = v2 + x` and `w3 = v3 + y`, turns 12.1 into 8.2. Conversely 8.2 is
//! a multilinear form without mean in the augmented weights `(1, x)` and `(1, y)`.

use crate::error::Error;
use crate::face::multilinear::MultilinearModel;

/// The parts of eq. 8.2. Blocks of `3 n_vertices` coordinates (mm, xyz after xyz) lie one after another.
#[derive(Debug, Clone, PartialEq)]
pub struct BilinearForm {
    /// `o`, the shape at weights zero: one block.
    pub offset: Vec<f64>,
    /// `a^id`: one block per identity weight.
    pub identity_linear: Vec<f64>,
    /// `a^pose`: one block per expression weight.
    pub pose_linear: Vec<f64>,
    /// `a`: the block of identity weight `i` and expression weight `j` is number `j identity_dim + i`.
    pub bilinear: Vec<f64>,
}

/// A multilinear form without mean: eq. 12.1 in the weights `(1, x)` and `(1, y)`.
#[derive(Debug, Clone, PartialEq)]
pub struct AugmentedCore {
    /// Number of identity weights with the leading 1.
    pub identity_dim: usize,
    /// Number of expression weights with the leading 1.
    pub pose_dim: usize,
    /// Block `k identity_dim + j` belongs to augmented weights `j` and `k`; block 0 is the offset.
    pub core: Vec<f64>,
}

impl BilinearForm {
    /// The model about its mean weights, so that zero weights give its average face.
    pub fn about_means(model: &MultilinearModel) -> Self {
        Self::about(model, &model.identity.weights.mean, &model.expression.weights.mean)
            .expect("the means have the model's sizes")
    }

    /// The model about the weights `v2`, `v3`.
    ///
    /// Errors: weights of another length than the mode's.
    pub fn about(model: &MultilinearModel, v2: &[f64], v3: &[f64]) -> Result<Self, Error> {
        let offset = model.shape(v2, v3)?;
        let (len, d_id, d_pose) = (model.mean.len(), v2.len(), v3.len());
        let (mut identity_linear, mut pose_linear) = (vec![0.0; len * d_id], vec![0.0; len * d_pose]);
        for k in 0..d_pose {
            for j in 0..d_id {
                let block = model.core_block(j, k);
                add_scaled(&mut identity_linear[j * len..][..len], v3[k], block);
                add_scaled(&mut pose_linear[k * len..][..len], v2[j], block);
            }
        }
        Ok(BilinearForm { offset, identity_linear, pose_linear, bilinear: model.core.clone() })
    }

    /// Number of identity weights.
    pub fn identity_dim(&self) -> usize {
        self.identity_linear.len() / self.offset.len()
    }

    /// Number of expression weights.
    pub fn pose_dim(&self) -> usize {
        self.pose_linear.len() / self.offset.len()
    }

    /// The shape of weights `x` (identity) and `y` (expression), mm.
    ///
    /// Errors: weights of another length than the form's.
    pub fn shape(&self, x: &[f64], y: &[f64]) -> Result<Vec<f64>, Error> {
        check_lengths(x, y, self.identity_dim(), self.pose_dim())?;
        let len = self.offset.len();
        let mut shape = self.offset.clone();
        for (block, &x) in self.identity_linear.chunks_exact(len).zip(x) {
            add_scaled(&mut shape, x, block);
        }
        for (block, &y) in self.pose_linear.chunks_exact(len).zip(y) {
            add_scaled(&mut shape, y, block);
        }
        let products = y.iter().flat_map(|&y| x.iter().map(move |&x| x * y));
        for (block, xy) in self.bilinear.chunks_exact(len).zip(products) {
            add_scaled(&mut shape, xy, block);
        }
        Ok(shape)
    }

    /// The same form in augmented weights.
    pub fn to_augmented(&self) -> AugmentedCore {
        let (len, d_id, d_pose) = (self.offset.len(), self.identity_dim(), self.pose_dim());
        let mut core = Vec::with_capacity(len * (d_id + 1) * (d_pose + 1));
        core.extend_from_slice(&self.offset);
        core.extend_from_slice(&self.identity_linear);
        for k in 0..d_pose {
            core.extend_from_slice(&self.pose_linear[k * len..][..len]);
            core.extend_from_slice(&self.bilinear[k * d_id * len..][..d_id * len]);
        }
        AugmentedCore { identity_dim: d_id + 1, pose_dim: d_pose + 1, core }
    }

    /// The inverse of [`to_augmented`](Self::to_augmented).
    ///
    /// Errors: sizes that do not belong together.
    pub fn from_augmented(augmented: &AugmentedCore) -> Result<Self, Error> {
        let (d_id, d_pose) = (augmented.identity_dim, augmented.pose_dim);
        let n_blocks = d_id * d_pose;
        if d_id < 2 || d_pose < 2 || !augmented.core.len().is_multiple_of(3 * n_blocks) || augmented.core.is_empty() {
            return Err(Error::input(format!(
                "a core of {} numbers does not hold {d_id} x {d_pose} blocks of vertices; augmented sizes start at 2",
                augmented.core.len()
            )));
        }
        let len = augmented.core.len() / n_blocks;
        let (first, rest) = augmented.core.split_at(d_id * len);
        let (offset, identity_linear) = first.split_at(len);
        let (mut pose_linear, mut bilinear) = (Vec::new(), Vec::new());
        for column in rest.chunks_exact(d_id * len) {
            pose_linear.extend_from_slice(&column[..len]);
            bilinear.extend_from_slice(&column[len..]);
        }
        Ok(BilinearForm { offset: offset.to_vec(), identity_linear: identity_linear.to_vec(), pose_linear, bilinear })
    }
}

impl AugmentedCore {
    /// The shape of augmented weights, each of which usually starts with a 1.
    ///
    /// Errors: weights of another length than the form's.
    pub fn shape(&self, w2: &[f64], w3: &[f64]) -> Result<Vec<f64>, Error> {
        check_lengths(w2, w3, self.identity_dim, self.pose_dim)?;
        let len = self.core.len() / (self.identity_dim * self.pose_dim);
        let mut shape = vec![0.0; len];
        let products = w3.iter().flat_map(|&y| w2.iter().map(move |&x| x * y));
        for (block, xy) in self.core.chunks_exact(len).zip(products) {
            add_scaled(&mut shape, xy, block);
        }
        Ok(shape)
    }
}

fn check_lengths(x: &[f64], y: &[f64], identity_dim: usize, pose_dim: usize) -> Result<(), Error> {
    if x.len() != identity_dim || y.len() != pose_dim {
        return Err(Error::input(format!(
            "{} identity and {} expression weights were given; this form takes {identity_dim} and {pose_dim}",
            x.len(),
            y.len()
        )));
    }
    Ok(())
}

fn add_scaled(out: &mut [f64], factor: f64, block: &[f64]) {
    out.iter_mut().zip(block).for_each(|(sum, x)| *sum += factor * x);
}
