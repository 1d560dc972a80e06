//! `.hab` files: specified in `docs/model-file.md`, checked and read in place by `habitus_core`, laid out here.

use std::path::Path;

use habitus_core::format::{self, ElementType, Header, Kind, Model, SectionId, SectionSource};
use habitus_core::generator::LANES;
use habitus_core::wavelet::Wavelet;
use rayon::prelude::*;

use super::source::{Coefficients, ModelSource};
use crate::io::atomic;
use crate::{Error, Place};

/// Opens the bytes of a model file that came from `path`, which the message of an error names.
pub fn opened<'a>(bytes: &'a [u8], path: &Path) -> Result<Model<'a>, Error> {
    Model::open(bytes).map_err(|error| {
        let problem =
            if bytes.is_empty() { "the file is empty; train or copy it again".into() } else { described(error) };
        Error::malformed(path, Place::Whole, problem)
    })
}

/// What is wrong, where, and for a damaged or foreign file what to do.
fn described(error: habitus_core::Error) -> String {
    use habitus_core::Error as Kernel;
    let section = match error {
        Kernel::BadChecksum { section }
        | Kernel::BadSection { section }
        | Kernel::MissingSection { section }
        | Kernel::BadContent { section, .. } => SectionId::from_u32(section),
        _ => None,
    };
    let place = section.map(|id| format!(" (section {}: {id:?})", id as u32)).unwrap_or_default();
    let remedy = match error {
        Kernel::BadMagic => "; give a model that `habitus train` has written",
        Kernel::Truncated { needed, found } if found > needed => {
            "; something was added to the file: copy or download it again"
        }
        Kernel::Truncated { .. } => "; the copy is incomplete: copy or download it again",
        Kernel::BadChecksum { .. } => "; copy or download it again, or train it anew",
        _ => "",
    };
    format!("{error}{place}{remedy}")
}

/// Writes a model to `path`, atomically. What is written has passed every check of the reader.
///
/// Errors: counts beyond the limits of the format, numbers that `f32` cannot hold, indices beyond the vertices; [`Error::Write`].
pub fn write(source: &ModelSource<'_>, path: &Path) -> Result<(), Error> {
    atomic::write(path, &bytes(source)?)
}

/// The bytes of the model file.
///
/// Errors: as [`write()`].
pub fn bytes(source: &ModelSource<'_>) -> Result<Vec<u8>, Error> {
    let header = source.coefficients.header()?;
    let sections = sections(source, &header)?;
    let parts: Vec<SectionSource<'_>> = sections.iter().map(Section::as_source).collect();
    let len = format::written_len(&parts).ok_or_else(|| Error::input("the model exceeds the address space"))?;
    let mut out = vec![0; len];
    format::write(&header, &parts, &mut out)
        .map_err(|error| Error::Kernel { what: "the model cannot be written".into(), error })?;
    Ok(out)
}

/// Bytes that the file of a model of these counts takes for its coefficients.
pub fn file_len(header: &Header) -> u64 {
    header.n_blocks() as u64 * header.n_terms() as u64 * 3 * LANES as u64 * 4
}

struct Section {
    id: SectionId,
    shape: Vec<u32>,
    bytes: Vec<u8>,
}

impl Section {
    fn as_source(&self) -> SectionSource<'_> {
        let element: ElementType = self.id.form().0;
        SectionSource {
            id: self.id as u32,
            may_ignore: self.id.may_ignore(),
            element,
            shape: &self.shape,
            bytes: &self.bytes,
        }
    }
}

fn sections(source: &ModelSource<'_>, header: &Header) -> Result<Vec<Section>, Error> {
    let mut sections = vec![coefficients(source, header)?];
    let mut add = |id: SectionId, axes: &[usize], bytes: Vec<u8>| -> Result<(), Error> {
        if !bytes.is_empty() {
            let shape = axes.iter().map(|&axis| u32::try_from(axis)).collect::<Result<_, _>>();
            let shape = shape.map_err(|_| Error::input(format!("{id:?} of shape {axes:?} is too large for a file")))?;
            sections.push(Section { id, shape, bytes });
        }
        Ok(())
    };
    let words = |values: &[u32]| -> Vec<u8> { values.iter().flat_map(|value| value.to_le_bytes()).collect() };
    let text = |lines: &[String]| lines.join("\n").into_bytes();
    let (identity, pose) = (header.identity_dim as usize, header.pose_dim as usize);
    // A wavelet model has so many weights for each coefficient.
    let each = if header.kind == Kind::Wavelet { header.n_vertices as usize } else { 1 };
    add(SectionId::Faces, &[source.faces.len(), 3], words(source.faces.as_flattened()))?;
    add(SectionId::Landmarks, &[source.landmarks.len()], words(&source.landmarks))?;
    let names = text(&source.landmark_names);
    add(SectionId::LandmarkNames, &[names.len()], names)?;
    add(SectionId::Mirror, &[source.mirror.len()], words(&source.mirror))?;
    let (prior, d) = (&source.identity_prior, identity * each);
    add(SectionId::IdentityMean, &[d], floats(&prior.mean)?)?;
    add(SectionId::IdentityScale, &[d], floats(&prior.scale)?)?;
    add(SectionId::IdentityPrecision, &[d, d], floats(&symmetric(&prior.precision, d))?)?;
    let (prior, d) = (&source.pose_prior, pose * each);
    add(SectionId::PoseMean, &[d], floats(&prior.mean)?)?;
    add(SectionId::PoseScale, &[d], floats(&prior.scale)?)?;
    add(SectionId::PosePrecision, &[d, d], floats(&symmetric(&prior.precision, d))?)?;
    add(SectionId::PoseStarts, &[source.pose_starts.len() / pose.max(1), pose], floats(&source.pose_starts)?)?;
    let names = text(&source.pose_names);
    add(SectionId::PoseNames, &[names.len()], names)?;
    add(SectionId::IdentitySpectrum, &[source.identity_spectrum.len()], spectrum(&source.identity_spectrum)?)?;
    add(SectionId::PoseSpectrum, &[source.pose_spectrum.len()], spectrum(&source.pose_spectrum)?)?;
    let provenance = source.provenance.clone().into_bytes();
    add(SectionId::Provenance, &[provenance.len()], provenance)?;
    if let Coefficients::Skinned(_, _, skin) = source.coefficients {
        for (id, axes, bytes) in skin.sections()? {
            add(id, &axes, bytes)?;
        }
    }
    if let Coefficients::Wavelet(form) = source.coefficients {
        let [width, height] = [form.grid.width(0), form.grid.height(0)].map(|size| size as u32);
        let kind = if form.wavelet == Wavelet::Cubic { 0 } else { 1 };
        add(SectionId::Grid, &[4], words(&[width, height, form.grid.levels() as u32, kind]))?;
    }
    let n = header.n_vertices as usize;
    add(SectionId::Remainder, &[source.remainder.len() / (3 * n).max(1), n, 3], floats(&source.remainder)?)?;
    Ok(sections)
}

/// The terms block by block: 16 vertices side by side, x, then y, then z; lanes behind the last vertex are zero.
fn coefficients(source: &ModelSource<'_>, header: &Header) -> Result<Section, Error> {
    let terms = source.coefficients.terms();
    if terms.len() != header.n_terms() && header.kind == Kind::Wavelet
        || terms.iter().any(|term| term.len() != 3 * header.n_vertices as usize)
    {
        return Err(Error::input(
            "the terms of a model have not all the length of its mean, or are not as many as its weights ask for",
        ));
    }
    let (n, blocks) = (header.n_vertices as usize, header.n_blocks());
    let block_bytes = terms.len() * 3 * LANES * 4;
    let mut bytes = vec![0; blocks * block_bytes];
    bytes.par_chunks_exact_mut(block_bytes).enumerate().for_each(|(block, out)| {
        let lanes = LANES.min(n - block * LANES);
        for (term, out) in terms.iter().zip(out.chunks_exact_mut(3 * LANES * 4)) {
            for lane in 0..lanes {
                for axis in 0..3 {
                    let value = term[3 * (block * LANES + lane) + axis] as f32;
                    out[4 * (axis * LANES + lane)..][..4].copy_from_slice(&value.to_le_bytes());
                }
            }
        }
    });
    let shape = [blocks, terms.len(), 3, LANES].map(|axis| axis as u32).to_vec();
    Ok(Section { id: SectionId::Coefficients, shape, bytes })
}

fn floats(values: &[f64]) -> Result<Vec<u8>, Error> {
    if let Some(value) = values.iter().find(|value| !(**value as f32).is_finite()) {
        return Err(Error::input(format!("{value} cannot be stored as a 32-bit number")));
    }
    Ok(values.iter().flat_map(|&value| (value as f32).to_le_bytes()).collect())
}

/// Eigenvalues as the format wants them: rounding leaves tiny negative ones of a singular covariance.
fn spectrum(values: &[f64]) -> Result<Vec<u8>, Error> {
    floats(&values.iter().map(|value| value.max(0.0)).collect::<Vec<_>>())
}

/// The mean of a matrix and its transpose, so that both triangles round to the same numbers.
fn symmetric(matrix: &[f64], d: usize) -> Vec<f64> {
    (0..matrix.len()).map(|k| 0.5 * (matrix[k] + matrix[k % d * d + k / d])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::face::bilinear_form::BilinearForm;
    use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
    use crate::face::tensor::ShapeTensor;
    use habitus_core::generator::{Generator, Weights};

    fn tensor() -> ShapeTensor {
        let (d2, d3, n) = (5, 3, 21);
        let data = (0..d2 * d3 * n * 3).map(|k| 50.0 * ((k * k % 97) as f64 / 97.0 - 0.5)).collect();
        ShapeTensor::from_shapes(d2, d3, n, data).unwrap()
    }

    /// Both forms of the same model, through the file and the kernel, give the shape that training gives in f64.
    #[test]
    fn a_written_model_evaluates_to_the_trained_shape() {
        let size = |dim| ModeSize::Dimension(dim);
        let options = HosvdOptions { identity: size(4), expression: size(2), hooi: None };
        let model = hosvd(&tensor(), &options).unwrap().model;
        let form = BilinearForm::about_means(&model);
        let (w2, w3) = model.training_weights(3, 1);
        let expected = model.shape(&w2, &w3).unwrap();
        let moved = |w: &[f64], mean: &[f64]| -> Vec<f32> { w.iter().zip(mean).map(|(w, m)| (w - m) as f32).collect() };
        let plain = |w: &[f64]| -> Vec<f32> { w.iter().map(|&w| w as f32).collect() };
        let about = (moved(&w2, &model.identity.weights.mean), moved(&w3, &model.expression.weights.mean));
        for (coefficients, (identity, pose)) in
            [(Coefficients::Multilinear(&model), (plain(&w2), plain(&w3))), (Coefficients::Bilinear(&form), about)]
        {
            let mut source = ModelSource::of_multilinear(&model);
            source.coefficients = coefficients;
            source.provenance = "test".into();
            let file = bytes(&source).unwrap();
            let opened = opened(&file, Path::new("test.hab")).unwrap();
            let generator = opened.bilinear().unwrap();
            let mut out = vec![0.0; expected.len()];
            generator.evaluate(Weights { identity: &identity, pose: &pose }, 0..21, &mut out).unwrap();
            for (found, expected) in out.iter().zip(&expected) {
                assert!((f64::from(*found) - expected).abs() < 2e-5, "{found} {expected}");
            }
        }
    }

    #[test]
    fn errors_name_the_file_and_the_remedy() {
        let model = hosvd(&tensor(), &HosvdOptions::default()).unwrap().model;
        let file = bytes(&ModelSource::of_multilinear(&model)).unwrap();
        let message = |bytes: &[u8]| opened(bytes, Path::new("face.hab")).unwrap_err().to_string();
        assert!(
            message(b"solid cube").starts_with("face.hab: not a .hab model file; give a model"),
            "{}",
            message(b"solid cube")
        );
        assert_eq!(message(b""), "face.hab: the file is empty; train or copy it again");
        assert!(message(&file[..1000]).contains("copy or download it again"));
        let mut damaged = file.clone();
        damaged[2000] ^= 1;
        assert!(message(&damaged).contains("Coefficients"), "{}", message(&damaged));
    }

    #[test]
    fn refuses_what_the_format_cannot_hold() {
        let mut model = hosvd(&tensor(), &HosvdOptions::default()).unwrap().model;
        let mut source = ModelSource::of_multilinear(&model);
        source.faces = vec![[0, 1, 21]];
        assert!(matches!(
            bytes(&source),
            Err(Error::Kernel { error: habitus_core::Error::BadContent { section: 2, index: 2 }, .. })
        ));
        model.mean[0] = 1e300;
        assert!(bytes(&ModelSource::of_multilinear(&model)).is_err());
    }
}
