//! `format` of the kernel: opening any bytes, every view, writing.

use crate::memory::{Input, Output, status};
use habitus_core::Error;
use habitus_core::format::{Checksums, Mode, Model, SectionId, SectionSource, write, written_len};

/// Opens bytes and sums everything that a model hands out.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_model(bytes: Input<u8>, verify: bool, index: usize) -> i32 {
    // SAFETY: the caller's promise.
    let bytes = unsafe { bytes.slice() };
    let checksums = if verify { Checksums::Verify } else { Checksums::Skip };
    match Model::open_with(bytes, checksums) {
        Ok(model) => contents(&model, index),
        Err(error) => error.code() as i32,
    }
}

fn contents(model: &Model<'_>, index: usize) -> i32 {
    let mut sum = model.header().n_terms() + model.header().n_blocks();
    for section in model.sections().iter() {
        sum += section.bytes.len() + section.rank;
        sum += SectionId::from_u32(section.id).map_or(0, |id| usize::from(id.may_ignore()));
    }
    if let Some(faces) = model.faces() {
        sum += faces.iter().map(|face| face.iter().copied().max().unwrap_or(0) as usize).sum::<usize>();
        sum += faces.get(index).map_or(0, |[a, _, _]| a as usize) + faces.len();
    }
    for indices in [model.landmarks(), model.mirror()].into_iter().flatten() {
        sum += indices.iter().rev().map(|index| index as usize).sum::<usize>() + indices.len();
        sum += indices.part(index, 3).and_then(|part| part.get(1)).unwrap_or(0) as usize;
    }
    for lines in [model.landmark_names(), model.pose_names(), model.joint_names()].into_iter().flatten() {
        sum += lines.iter().map(str::len).sum::<usize>() + lines.get(index).map_or(0, str::len);
    }
    sum += model.provenance().map_or(0, str::len) + model.provenance_lines().map_or(0, |lines| lines.iter().count());
    sum += model.sections().find(index as u32).map_or(0, |section| section.bytes.len());
    let mut total = 0.0f32;
    for mode in [Mode::Identity, Mode::Pose] {
        if let Some(gaussian) = model.gaussian(mode) {
            for floats in [gaussian.mean, gaussian.scale, gaussian.precision] {
                total += floats.iter().sum::<f32>() + floats.get(index).unwrap_or(0.0);
                sum += usize::from(floats.is_empty());
            }
        }
        total += model.spectrum(mode).map_or(0.0, |floats| floats.iter().sum());
    }
    if let Some((lower, upper)) = model.pose_bounds() {
        total += lower.iter().chain(upper.iter()).sum::<f32>();
    }
    total += model.quantisation_error().map_or(0.0, |errors| errors.iter().sum());
    sum += model.skeleton().map_or(0, |skeleton| skeleton.n_joints() + skeleton.pose_dim());
    sum += model.element().bytes();
    for floats in [model.pose_starts(), model.remainder()].into_iter().flatten() {
        total += floats.iter().sum::<f32>();
    }
    (sum as i32).wrapping_add(total as i32)
}

/// Weights at so many standard deviations, by both kinds of statistics.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_weights_into(bytes: Input<u8>, deviations: Input<f32>, weights: Output<f32>) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, deviations, weights) = unsafe { (bytes.slice(), deviations.slice(), weights.slice()) };
    let mut run = || {
        let gaussian = Model::open(bytes)?.gaussian(Mode::Identity).ok_or(Error::Empty)?;
        gaussian.weights_into(deviations, weights)?;
        gaussian.spread().weights_into(deviations, weights)
    };
    status(run())
}

/// Opens a model and writes its sections again.
#[unsafe(no_mangle)]
unsafe extern "C" fn check_write(bytes: Input<u8>, out: Output<u8>) -> i32 {
    // SAFETY: the caller's promise.
    let (bytes, out) = unsafe { (bytes.slice(), out.slice()) };
    status(copy(bytes, out))
}

fn copy(bytes: &[u8], out: &mut [u8]) -> Result<(), Error> {
    let model = Model::open(bytes)?;
    if let Some(section) = model.sections().iter().next() {
        let needed = written_len(&[SectionSource::from_section(&section)]).ok_or(Error::Empty)?;
        out.get(..needed).ok_or(Error::Empty)?;
    }
    for section in model.sections().iter() {
        write(model.header(), &[SectionSource::from_section(&section)], out)?;
    }
    Ok(())
}
