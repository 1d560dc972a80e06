//! A model with its coefficients in fewer bytes, and how far it then lies from the original.

use std::f32::consts::FRAC_PI_2;

use habitus_core::format::{self, ElementType, Header, Kind, Mode, Model, SectionId, SectionSource};
use habitus_core::generator::{Block, Generator, LANES, NUMBERS, Weights};
use habitus_core::quantise::{f16_of, quantised};
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal, Uniform};
use rayon::prelude::*;

use crate::Error;
use crate::evaluate::evaluate_at;

/// Shapes over which the error is measured, and the standard deviations at which their weights are clipped.
const SAMPLES: usize = 200;
const CLIP: f64 = 3.0;

/// How far a quantised model lies from its original.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuantisationError {
    /// Mean distance of a vertex, mm.
    pub mean_mm: f64,
    /// Root of the mean squared distance of a vertex, mm.
    pub rms_mm: f64,
    /// Largest distance of a vertex, mm.
    pub largest_mm: f64,
}

/// The file of a model with its coefficients as `element`, with the measured error in section 20.
///
/// The error is taken over 200 seeded shapes whose weights are independent normal deviates, clipped at 3 (a wavelet model: of all its coefficients). The angles of a
/// body are zero: what is stored is the rest shape, and a joint moves its error without lengthening it. Where the body has corrective terms, which are stored too and
/// which only a pose brings out, the angles are drawn uniformly between the bounds of the joints, within a quarter turn to either side where there are none.
///
/// Errors: a model that is quantised already, an element type that coefficients cannot have, coefficients beyond 65504 for [`ElementType::F16`].
pub fn quantise(model: &Model<'_>, element: ElementType) -> Result<(Vec<u8>, QuantisationError), Error> {
    if model.element() != ElementType::F32 {
        return Err(Error::input(format!(
            "its coefficients are {:?} already; quantise the model that it was made from",
            model.element()
        )));
    }
    if !matches!(element, ElementType::F16 | ElementType::I8) {
        return Err(Error::input(format!("coefficients cannot be stored as {element:?}; F16 and I8 are there")));
    }
    let stored = stored(model, element)?;
    let plain = file(model, &stored, element, None)?;
    let error = measured(model, &reopened(&plain)?)?;
    let with_error = file(model, &stored, element, Some(error))?;
    Ok((with_error, error))
}

fn reopened(file: &[u8]) -> Result<Model<'_>, Error> {
    Model::open(file).map_err(|error| Error::Kernel { what: "the quantised model cannot be opened".into(), error })
}

/// Contents of the sections coefficients, offsets and ranges.
struct Stored {
    coefficients: Vec<u8>,
    offsets: Vec<u8>,
    ranges: Vec<u8>,
    n_terms: usize,
}

fn stored(model: &Model<'_>, element: ElementType) -> Result<Stored, Error> {
    let missing = || Error::Internal("an opened model has no coefficients".into());
    let section = model.sections().find(SectionId::Coefficients as u32).ok_or_else(missing)?;
    let n_terms = section.shape[1] as usize;
    let raw: Vec<f32> = section.bytes.as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw)).collect();
    let terms = raw.as_chunks::<NUMBERS>().0;
    if element == ElementType::F16
        && let Some(value) = raw.iter().skip(NUMBERS).find(|value| value.abs() > 65504.0)
    {
        return Err(Error::input(format!("a coefficient of {value} does not fit half precision; use i8")));
    }
    let (mut coefficients, mut ranges) = (Vec::new(), Vec::new());
    let mut offsets = Vec::new();
    let n = model.header().n_vertices as usize;
    for (block, terms) in terms.chunks_exact(n_terms).enumerate() {
        let used = LANES.min(n - block * LANES);
        let (offset, terms) = terms.split_first().ok_or_else(missing)?;
        offsets.extend(offset.iter().flat_map(|value| value.to_le_bytes()));
        for term in terms {
            if element == ElementType::F16 {
                coefficients.extend(term.iter().flat_map(|&value| f16_of(value).to_le_bytes()));
            } else {
                let term = quantised(&Block::load(term), used);
                coefficients.extend(term.codes.map(|code| code as u8));
                ranges.extend(term.ranges.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
            }
        }
    }
    Ok(Stored { coefficients, offsets, ranges, n_terms })
}

/// The model's file with the coefficients replaced.
fn file(
    model: &Model<'_>,
    stored: &Stored,
    element: ElementType,
    error: Option<QuantisationError>,
) -> Result<Vec<u8>, Error> {
    let header: &Header = model.header();
    let (blocks, apart) = (header.n_blocks() as u32, stored.n_terms as u32 - 1);
    let figures: Vec<u8> = error.map_or(Vec::new(), |error| {
        [error.mean_mm, error.rms_mm, error.largest_mm].iter().flat_map(|value| (*value as f32).to_le_bytes()).collect()
    });
    let shapes = ([blocks, apart, 3, LANES as u32], [blocks, 3, LANES as u32], [blocks, apart, 3, 2], [3u32]);
    let own = |id: SectionId, element, shape, bytes| SectionSource {
        id: id as u32,
        may_ignore: id.may_ignore(),
        element,
        shape,
        bytes,
    };
    let f32 = ElementType::F32;
    let mut sources = vec![
        own(SectionId::Offsets, f32, &shapes.1[..], &stored.offsets[..]),
        own(SectionId::Coefficients, element, &shapes.0, &stored.coefficients),
    ];
    if !stored.ranges.is_empty() {
        sources.push(own(SectionId::Ranges, f32, &shapes.2, &stored.ranges));
    }
    if !figures.is_empty() {
        sources.push(own(SectionId::QuantisationError, f32, &shapes.3, &figures));
    }
    let sections: Vec<_> = model.sections().iter().filter(|s| s.id != SectionId::Coefficients as u32).collect();
    sources.extend(sections.iter().map(SectionSource::from_section));
    let len = format::written_len(&sources).ok_or_else(|| Error::input("the model exceeds the address space"))?;
    let mut out = vec![0; len];
    format::write(header, &sources, &mut out)
        .map_err(|error| Error::Kernel { what: "the quantised model cannot be written".into(), error })?;
    Ok(out)
}

/// Weights of each mode that the error is measured at.
fn drawn(model: &Model<'_>, seed: u64, dims: [usize; 2]) -> [Vec<f32>; 2] {
    let mut random = ChaCha12Rng::seed_from_u64(seed);
    let skinned = model.header().kind == Kind::Skinned;
    let mut weights = [Mode::Identity, Mode::Pose].map(|mode| {
        let spread = model.spread(mode);
        let dim = if mode == Mode::Identity { dims[0] } else { dims[1] };
        let weight = |k: usize| {
            let deviate: f64 = StandardNormal.sample(&mut random);
            let deviate = deviate.clamp(-CLIP, CLIP) as f32;
            let statistics = spread.as_ref().and_then(|g| Some((g.mean.get(k)?, g.scale.get(k)?)));
            match statistics {
                _ if skinned && mode == Mode::Pose => 0.0,
                Some((mean, scale)) => mean + deviate * scale,
                None => deviate,
            }
        };
        (0..dim).map(weight).collect::<Vec<f32>>()
    });
    if skinned && model.header().pose_linear {
        let bounds = model.pose_bounds();
        for (k, angle) in weights[1].iter_mut().enumerate() {
            let of_file = bounds.and_then(|(lower, upper)| Some((lower.get(k)?, upper.get(k)?)));
            let (low, high) = of_file.unwrap_or((-FRAC_PI_2, FRAC_PI_2));
            // Bounds that do not stand in order leave no choice.
            *angle = Uniform::new_inclusive(low, high).map_or(low, |within| within.sample(&mut random));
        }
    }
    weights
}

fn measured(original: &Model<'_>, quantised: &Model<'_>) -> Result<QuantisationError, Error> {
    let kernel = |error| Error::Kernel { what: "the quantised model cannot be evaluated".into(), error };
    let generators = (original.generator().map_err(kernel)?, quantised.generator().map_err(kernel)?);
    let n = generators.0.vertex_count();
    let dims = [generators.0.identity_dim(), generators.0.pose_dim()];
    let one = |seed: usize| -> Result<[f64; 3], habitus_core::Error> {
        let [identity, pose] = drawn(original, seed as u64, dims);
        let shape = |generator: &habitus_core::generator::any::AnyGenerator<'_>| {
            let mut state = vec![0.0; generator.state_req(false).numbers()];
            let mut out = vec![0.0f32; 3 * n];
            let at = generator.begin(Weights { identity: &identity, pose: &pose }, false, &mut state)?;
            evaluate_at(generator, at, 0..n, &mut out)?;
            Ok(out)
        };
        let (plain, stored) = (shape(&generators.0)?, shape(&generators.1)?);
        let pairs = plain.as_chunks::<3>().0.iter().zip(stored.as_chunks::<3>().0);
        Ok(pairs.fold([0.0, 0.0, 0.0], |[sum, squares, most], (a, b)| {
            let square: f64 = (0..3).map(|axis| f64::from(a[axis] - b[axis]).powi(2)).sum();
            [sum + square.sqrt(), squares + square, f64::max(most, square.sqrt())]
        }))
    };
    let all: Result<Vec<_>, _> = (0..SAMPLES).into_par_iter().map(one).collect();
    let totals = all
        .map_err(kernel)?
        .iter()
        .fold([0.0, 0.0, 0.0f64], |[sum, squares, most], one| [sum + one[0], squares + one[1], most.max(one[2])]);
    let count = (SAMPLES * n) as f64;
    Ok(QuantisationError { mean_mm: totals[0] / count, rms_mm: (totals[1] / count).sqrt(), largest_mm: totals[2] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::model::samples::{corrected_body, firmware_model, plain_body};

    /// A body whose corrective terms are ten times as large as its components is not measured in the only pose that hides them.
    #[test]
    fn corrective_terms_are_measured_in_poses_within_the_bounds() {
        let body = corrected_body();
        let corrected = Model::open(&body).expect("a model");
        for seed in 0..SAMPLES as u64 {
            let [_, pose] = drawn(&corrected, seed, [2, 2]);
            assert!(pose[0].abs() <= std::f32::consts::PI && (0.5..=1.5).contains(&pose[1]), "{pose:?}");
            assert!(pose[0] != 0.0);
        }
        let body = plain_body();
        let plain = Model::open(&body).expect("a model");
        assert_eq!(drawn(&plain, 3, [2, 2])[1], [0.0; 2]);
        // The identities are the same.
        assert_eq!(drawn(&plain, 3, [2, 2])[0], drawn(&corrected, 3, [2, 2])[0]);
        let mean = |model: &Model<'_>| quantise(model, ElementType::I8).expect("quantised").1.mean_mm;
        assert!(mean(&corrected) > 1.5 * mean(&plain), "{} {}", mean(&corrected), mean(&plain));
    }

    /// The figures of models without corrective terms are what they were: the files of the firmware were made with them.
    #[test]
    fn other_figures_do_not_move() {
        for kind in ["small", "linear", "body", "wavelet"] {
            for (storage, element) in [("f16", ElementType::F16), ("i8", ElementType::I8)] {
                let bytes = firmware_model(kind);
                let (file, _) = quantise(&Model::open(&bytes).expect("a model"), element).expect("quantised");
                assert!(file == firmware_model(&format!("{kind}-{storage}")), "{kind} {storage}");
            }
        }
    }
}
