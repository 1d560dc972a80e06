//! What a model file is made of, before it is laid out as `.hab` sections.

use crate::Error;
use crate::face::bilinear_form::BilinearForm;
use crate::face::multilinear::MultilinearModel;
use crate::io::model::SkinSource;
use habitus_core::format::{Header, Kind};
use habitus_core::wavelet::{Grid, Wavelet};

/// Coefficients of a bilinear generator, in either of its two forms.
#[derive(Debug, Clone, Copy)]
pub enum Coefficients<'a> {
    /// Equation 12.1: mean and core tensor.
    Multilinear(&'a MultilinearModel),
    /// Equation 8.2 with both linear terms.
    Bilinear(&'a BilinearForm),
    /// Equation 9.1: a mean and components.
    Linear(LinearForm<'a>),
    /// Equations 9.1 to 9.3: the rest shape, with corrective terms or none (nine for each joint), and what poses it.
    Skinned(LinearForm<'a>, &'a [f64], &'a SkinSource),
    /// Chapter 15: a local model for each coefficient of a wavelet transform.
    Wavelet(WaveletForm<'a>),
}

/// Local models of the coefficients of a wavelet transform, in the order of their grid.
#[derive(Debug, Clone, Copy)]
pub struct WaveletForm<'a> {
    /// The grid, whose nodes are the vertices.
    pub grid: Grid,
    /// Which wavelet.
    pub wavelet: Wavelet,
    /// Identity weights of each coefficient.
    pub identity_dim: usize,
    /// Pose weights of each coefficient.
    pub pose_dim: usize,
    /// Mean of each coefficient, three coordinates, mm.
    pub mean: &'a [f64],
    /// Bilinear terms, the pose weight fastest, each of as many coordinates as the mean.
    pub core: &'a [f64],
}

/// A mean shape and components, `3 n_vertices` coordinates each.
#[derive(Debug, Clone, Copy)]
pub struct LinearForm<'a> {
    /// Mean shape, mm.
    pub mean: &'a [f64],
    /// Displacement of a weight of 1, one component after another, mm.
    pub components: &'a [f64],
}

impl LinearForm<'_> {
    fn dim(&self) -> usize {
        self.components.len() / self.mean.len().max(1)
    }
}

impl Coefficients<'_> {
    /// Counts of the file that will hold them.
    ///
    /// Errors: a count beyond `u32`.
    pub fn header(&self) -> Result<Header, Error> {
        let (kind, coordinates, identity, pose, linear) = match self {
            Coefficients::Multilinear(model) => {
                (Kind::Bilinear, model.mean.len(), model.identity.dim, model.expression.dim, [false, false])
            }
            Coefficients::Bilinear(form) => {
                (Kind::Bilinear, form.offset.len(), form.identity_dim(), form.pose_dim(), [true, true])
            }
            Coefficients::Linear(form) => (Kind::Linear, form.mean.len(), form.dim(), 0, [true, false]),
            Coefficients::Wavelet(form) => {
                (Kind::Wavelet, 3 * form.grid.len(), form.identity_dim, form.pose_dim, [false, false])
            }
            Coefficients::Skinned(form, corrections, skin) => {
                let linear = [true, !corrections.is_empty()];
                (Kind::Skinned, form.mean.len(), form.dim(), skin.pose_dim(), linear)
            }
        };
        let count = |value: usize| {
            u32::try_from(value).map_err(|_| Error::input(format!("a count of {value} does not fit a model file")))
        };
        Ok(Header {
            kind,
            n_vertices: count(coordinates / 3)?,
            identity_dim: count(identity)?,
            pose_dim: count(pose)?,
            identity_linear: linear[0],
            pose_linear: linear[1],
            dual_quaternion: matches!(self, Coefficients::Skinned(_, _, skin) if skin.dual_quaternion),
        })
    }

    /// The terms of equation 8.2 in the order of the file, `3 n_vertices` coordinates each (of the coefficients in a wavelet model).
    pub fn terms(&self) -> Vec<&[f64]> {
        match self {
            Coefficients::Multilinear(model) => {
                let (d_id, d_pose) = (model.identity.dim, model.expression.dim);
                let bilinear = (0..d_id).flat_map(|i| (0..d_pose).map(move |j| model.core_block(i, j)));
                std::iter::once(&model.mean[..]).chain(bilinear).collect()
            }
            Coefficients::Bilinear(form) => {
                let len = form.offset.len();
                let (d_id, d_pose) = (form.identity_dim(), form.pose_dim());
                let mut terms = vec![&form.offset[..]];
                terms.extend(form.pose_linear.chunks_exact(len));
                for i in 0..d_id {
                    terms.push(&form.identity_linear[i * len..][..len]);
                    terms.extend((0..d_pose).map(|j| &form.bilinear[(j * d_id + i) * len..][..len]));
                }
                terms
            }
            Coefficients::Linear(form) => {
                std::iter::once(form.mean).chain(form.components.chunks_exact(form.mean.len())).collect()
            }
            Coefficients::Wavelet(form) => {
                std::iter::once(form.mean).chain(form.core.chunks_exact(form.mean.len().max(1))).collect()
            }
            Coefficients::Skinned(form, corrections, _) => {
                let len = form.mean.len();
                let components = form.components.chunks_exact(len).chain(corrections.chunks_exact(len));
                std::iter::once(form.mean).chain(components).collect()
            }
        }
    }
}

/// Distribution of the weights of a mode over the training data.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ModePrior {
    /// Mean of the weights.
    pub mean: Vec<f64>,
    /// Standard deviation by which each weight is measured.
    pub scale: Vec<f64>,
    /// Inverse covariance, `d x d`; none for a wavelet model, whose means and scales are those of all coefficients.
    pub precision: Vec<f64>,
}

/// Everything that a model file holds.
#[derive(Debug, Clone)]
pub struct ModelSource<'a> {
    /// The generator.
    pub coefficients: Coefficients<'a>,
    /// Triangles, or none.
    pub faces: Vec<[u32; 3]>,
    /// Vertex of each landmark, or none.
    pub landmarks: Vec<u32>,
    /// Name of each landmark, or none.
    pub landmark_names: Vec<String>,
    /// Vertex of the other side for each vertex, or none.
    pub mirror: Vec<u32>,
    /// Prior of the identity weights.
    pub identity_prior: ModePrior,
    /// Prior of the pose weights.
    pub pose_prior: ModePrior,
    /// Pose weights of each training expression, one row after another.
    pub pose_starts: Vec<f64>,
    /// Name of each of these rows, or none.
    pub pose_names: Vec<String>,
    /// Eigenvalues of the identity mode before truncation, mm^2.
    pub identity_spectrum: Vec<f64>,
    /// Eigenvalues of the pose mode before truncation, mm^2.
    pub pose_spectrum: Vec<f64>,
    /// Principal components of what the model misses of unseen shapes, `3 n_vertices` numbers each, or none ([`crate::face::remainder`]).
    pub remainder: Vec<f64>,
    /// Where the model comes from.
    pub provenance: String,
}

impl<'a> ModelSource<'a> {
    /// A trained multilinear model with its priors, starts and spectra, without topology.
    pub fn of_multilinear(model: &'a MultilinearModel) -> Self {
        let prior = |mode: &crate::face::multilinear::Mode| ModePrior {
            mean: mode.weights.mean.clone(),
            scale: vec![mode.weights.scale(); mode.dim],
            precision: mode.weights.precision(),
        };
        ModelSource {
            identity_prior: prior(&model.identity),
            pose_prior: prior(&model.expression),
            pose_starts: (0..model.expression.count).flat_map(|row| model.expression.row(row)).collect(),
            identity_spectrum: model.identity.eigenvalues.clone(),
            pose_spectrum: model.expression.eigenvalues.clone(),
            ..ModelSource::new(Coefficients::Multilinear(model))
        }
    }

    /// A generator with nothing beside it.
    pub fn new(coefficients: Coefficients<'a>) -> Self {
        ModelSource {
            coefficients,
            faces: Vec::new(),
            landmarks: Vec::new(),
            landmark_names: Vec::new(),
            mirror: Vec::new(),
            identity_prior: ModePrior::default(),
            pose_prior: ModePrior::default(),
            pose_starts: Vec::new(),
            pose_names: Vec::new(),
            identity_spectrum: Vec::new(),
            pose_spectrum: Vec::new(),
            remainder: Vec::new(),
            provenance: String::new(),
        }
    }
}
