//! What a model file holds, and what is refused.

use habitus_core::format::{Mode, Model};

use super::Context;
use crate::backend::Backend;
use crate::result::Problem;

pub(super) fn open<B: Backend>(context: &mut Context<'_, '_, '_, B>) -> Result<(), Problem> {
    let Context { models, case, pieces, tally, .. } = context;
    let model = Model::open(pieces.model(case, models)?)?;
    let header = model.header();
    let flags =
        u32::from(header.identity_linear) | u32::from(header.pose_linear) << 1 | u32::from(header.dual_quaternion) << 2;
    let counts = [header.kind as u32, header.n_vertices, header.identity_dim, header.pose_dim, flags];
    tally.compare_integers("header", &counts)?;
    for (position, section) in model.sections().iter().enumerate() {
        let [a, b, c, d] = section.shape;
        let may_ignore = u32::from(section.may_ignore);
        let length = u32::try_from(section.bytes.len()).unwrap_or(u32::MAX);
        let found = [section.id, may_ignore, section.element as u32, section.rank as u32, a, b, c, d, length];
        tally.compare_integers_part("sections", position * found.len(), &found)?;
    }
    for (key, mode) in [("identity_gaussian", Mode::Identity), ("pose_gaussian", Mode::Pose)] {
        let Some(gaussian) = model.gaussian(mode) else { continue };
        let all = gaussian.mean.iter().chain(gaussian.scale.iter()).chain(gaussian.precision.iter());
        for (position, value) in all.enumerate() {
            tally.compare_part(key, position, &[value])?;
        }
    }
    for (position, vertex) in model.landmarks().into_iter().flat_map(|all| all.iter()).enumerate() {
        tally.compare_integers_part("landmarks", position, &[vertex])?;
    }
    for (position, corner) in model.faces().into_iter().flat_map(|faces| faces.iter()).flatten().enumerate() {
        tally.compare_integers_part("faces", position, &[corner])?;
    }
    Ok(())
}
