//! How well a model describes faces that it was not learned from, when their correspondence is known.

use crate::Error;
use crate::face::multilinear::MultilinearModel;
use crate::face::projection::{ProjectionOptions, Projector};
use crate::face::tensor::ShapeTensor;
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};

/// Mean vertex distance between the shapes of `unseen` and their nearest faces of the model (least squares over all vertices, no prior), mm.
///
/// Errors: another topology than the model's.
pub fn unseen_error(model: &MultilinearModel, unseen: &ShapeTensor) -> Result<MeanError, Error> {
    if unseen.n_vertices() != model.n_vertices() {
        return Err(Error::input(format!(
            "the test shapes have {} vertices, the model {}; give shapes in the model's topology",
            unseen.n_vertices(),
            model.n_vertices()
        )));
    }
    let found = Projector::new(model).project(unseen.data(), &ProjectionOptions::default())?;
    let weights: Vec<_> = found.into_iter().map(|projection| (projection.identity, projection.expression)).collect();
    let shapes = model.shapes(&weights)?;
    let errors = mean_vertex_distances(unseen.data(), &shapes, unseen.shape_len());
    MeanError::of(&errors).ok_or_else(|| Error::Internal("no test shapes".into()))
}
