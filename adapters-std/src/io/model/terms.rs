//! The coefficients of a model file as plain numbers, of whatever kind the model is and however they are stored.

use habitus_core::format::{ElementType, Kind, Model, SectionId};
use habitus_core::generator::{Block, LANES, NUMBERS};
use habitus_core::quantise::{F16, F32, I8, Storage, Term, Terms};

use crate::Error;

/// Coefficients of a model as numpy wants them: one term after another, `[vertex, 3]` each (of a wavelet model: `[coefficient, 3]`).
#[derive(Debug, Clone, PartialEq)]
pub struct PlainTerms {
    /// `o` or the mean, `[n, 3]`.
    pub offset: Vec<f32>,
    /// Pose-linear terms of a bilinear model, `[d_pose, n, 3]`, or empty.
    pub pose_linear: Vec<f32>,
    /// Identity-linear terms, in a linear model and in a body the components, `[d_id, n, 3]`, or empty.
    pub identity_linear: Vec<f32>,
    /// Bilinear terms, `[d_id, d_pose, n, 3]`; empty in a linear model and in a body.
    pub bilinear: Vec<f32>,
    /// What corrects the rest shape of a body by the rotations of its joints, `[joints, 9, n, 3]`, or empty.
    pub corrections: Vec<f32>,
}

/// Takes the coefficients of a model out of their blocks, decoded.
pub fn plain_terms(model: &Model<'_>) -> Result<PlainTerms, Error> {
    let header = *model.header();
    let terms = match model.element() {
        ElementType::F16 => decoded::<F16<'_>>(model)?,
        ElementType::I8 => decoded::<I8<'_>>(model)?,
        _ => decoded::<F32<'_>>(model)?,
    };
    let mut terms = terms.into_iter();
    let mut next = |count: usize| -> Vec<f32> { terms.by_ref().take(count).flatten().collect() };
    let mut plain = PlainTerms {
        offset: next(1),
        pose_linear: Vec::new(),
        identity_linear: Vec::new(),
        bilinear: Vec::new(),
        corrections: Vec::new(),
    };
    let (identity, pose) = (header.identity_dim as usize, header.pose_dim as usize);
    if matches!(header.kind, Kind::Linear | Kind::Skinned) {
        plain.identity_linear = next(identity);
        plain.corrections = next(usize::MAX);
        return Ok(plain);
    }
    if header.pose_linear {
        plain.pose_linear = next(pose);
    }
    for _ in 0..identity {
        if header.identity_linear {
            plain.identity_linear.extend(next(1));
        }
        plain.bilinear.extend(next(pose));
    }
    Ok(plain)
}

/// The terms in the order of the file, `3 n` numbers each.
fn decoded<'a, S: Storage<'a>>(model: &Model<'a>) -> Result<Vec<Vec<f32>>, Error> {
    let short = || Error::Internal("an opened model has too few coefficients".into());
    let section = |id: SectionId| model.sections().find(id as u32);
    let bytes = |id: SectionId| section(id).map_or(&[][..], |section| section.bytes);
    let coefficients = section(SectionId::Coefficients).ok_or_else(short)?;
    // The offset stands apart where the others are no `f32`.
    let n_terms = coefficients.shape[1] as usize + usize::from(S::ELEMENT != ElementType::F32);
    let storage = S::new(coefficients.bytes, bytes(SectionId::Offsets), bytes(SectionId::Ranges));
    let n = model.header().n_vertices as usize;
    let mut terms = vec![vec![0.0; 3 * n]; n_terms];
    for block in 0..model.header().n_blocks() {
        let (offset, behind) = storage.block(block, n_terms).ok_or_else(short)?;
        let mut numbers = [0.0; NUMBERS];
        numbers.iter_mut().zip(offset.as_chunks::<4>().0).for_each(|(to, raw)| *to = f32::from_le_bytes(*raw));
        let blocks = std::iter::once(Block::load(&numbers)).chain(behind.iter().map(Term::block));
        for (term, Block { axes: [x, y, z] }) in terms.iter_mut().zip(blocks) {
            let vertices = term.as_chunks_mut::<3>().0.iter_mut().skip(block * LANES);
            for (vertex, ((x, y), z)) in vertices.zip(x.into_iter().zip(y).zip(z)) {
                *vertex = [x, y, z];
            }
        }
    }
    Ok(terms)
}
