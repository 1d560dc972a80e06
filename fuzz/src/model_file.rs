//! Model files: what is opened can be read to the end, gives finite numbers, and does not depend on where it lies.
//!
//! Bytes that begin as a model file does are opened as they are, and once more with length and checksums repaired, so that the
//! checks behind the checksums are reached. Other bytes are a list of changes of a sound file.

use habitus_core::Error;
use habitus_core::format::limits::{MAX_COEFFICIENT, MAX_WEIGHT};
use habitus_core::format::{Checksums, Kind, Mode, Model, SectionId, SectionSource, write, written_len};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::generator::{Generator, LANES, NUMBERS, Weights};

use crate::bits::{assert_finite, assert_same};
use crate::damage::{Damage, repair_checksums, repair_length};

/// Opens what the bytes make, and reads all of it.
pub fn check(bytes: &[u8]) {
    if bytes.first() != Some(&0x89) {
        if let Some(file) = Damage::file_of(bytes) {
            check_file(&file);
        }
        return;
    }
    check_file(bytes);
    let mut repaired = bytes.to_vec();
    repair_length(&mut repaired);
    repair_checksums(&mut repaired);
    if repaired != bytes {
        check_file(&repaired);
    }
}

fn check_file(file: &[u8]) {
    // The same bytes at another alignment: every one in turn, by the length of the file.
    let shift = 1 + file.len() / 4 % 15;
    let moved: Vec<u8> = std::iter::repeat_n(0, shift).chain(file.iter().copied()).collect();
    let (model, other) = match (Model::open(file), Model::open(&moved[shift..])) {
        (Ok(model), Ok(other)) => (model, other),
        (Err(error), other) => {
            assert_eq!(Some(error), other.err(), "refused by its alignment");
            assert!((300..400).contains(&(error.code() as i32)), "not an error of a file: {error:?}");
            // Without the checksums of its sections a file may be sound.
            if let Ok(model) = Model::open_with(file, Checksums::Skip) {
                let _ = numbers_of(&model);
            }
            return;
        }
        (Ok(_), Err(error)) => panic!("refused by its alignment: {error:?}"),
    };
    let skipped = Model::open_with(file, Checksums::Skip).expect("what is sound with its checksums is sound");
    for again in [&other, &skipped] {
        assert!(model.sections().iter().eq(again.sections().iter()), "other sections");
    }
    assert_same("numbers of the same file", &numbers_of(&other), &numbers_of(&model));
    check_written(&model, file);
}

/// Reads everything that the model hands out, with what the format promises of it; returns all numbers computed from it.
fn numbers_of(model: &Model<'_>) -> Vec<f32> {
    check_topology(model);
    check_texts(model);
    check_statistics(model);
    check_joints(model);
    let generator = model.generator().expect("an opened model has a generator");
    let (di, dp) = (generator.identity_dim(), generator.pose_dim());
    let mean = |mode| model.gaussian(mode).map(|gaussian| gaussian.mean.iter().collect());
    let signs = |d: usize| (0..d).map(|k| if k % 3 == 1 { -MAX_WEIGHT } else { MAX_WEIGHT }).collect();
    let (mean_x, mean_y): (Option<Vec<f32>>, Option<Vec<f32>>) = (mean(Mode::Identity), mean(Mode::Pose));
    let at: [(Vec<f32>, Vec<f32>); 3] = [
        (mean_x.unwrap_or(vec![0.0; di]), mean_y.unwrap_or(vec![0.0; dp])),
        (vec![1.5; di], vec![-0.75; dp]),
        (signs(di), signs(dp)),
    ];
    at.iter().flat_map(|(x, y)| evaluated(&generator, model.header().kind, x, y)).collect()
}

fn check_topology(model: &Model<'_>) {
    let n = model.header().n_vertices;
    if let Some(faces) = model.faces() {
        assert_eq!(faces.iter().count(), faces.len());
        assert!(faces.iter().flatten().all(|vertex| vertex < n));
        assert_eq!((faces.get(faces.len()), faces.get(usize::MAX)), (None, None));
    }
    if let Some(landmarks) = model.landmarks() {
        assert!(landmarks.iter().all(|vertex| vertex < n));
        assert_eq!(landmarks.get(landmarks.len()), None);
    }
    if let Some(mirror) = model.mirror() {
        assert_eq!(mirror.len(), n as usize);
        let back = |vertex: usize| mirror.get(mirror.get(vertex)? as usize);
        assert!((0..mirror.len()).all(|vertex| back(vertex) == Some(vertex as u32)), "a mirror that does not return");
    }
    for section in model.sections().iter() {
        let elements: usize = section.shape.iter().map(|&axis| axis as usize).product();
        assert_eq!(elements * section.element.bytes(), section.bytes.len());
        assert_eq!(model.sections().find(section.id), Some(section));
        assert!(SectionId::from_u32(section.id).is_some() || section.may_ignore);
    }
}

fn check_texts(model: &Model<'_>) {
    for (names, count) in [
        (model.landmark_names(), model.landmarks().map(|all| all.len())),
        (model.pose_names(), model.pose_starts().map(|all| all.len() / model.header().pose_dim as usize)),
    ] {
        if let Some(names) = names {
            let lines: Vec<&str> = names.iter().collect();
            assert_eq!(Some(lines.len()), count, "one name for each");
            assert_eq!(lines.join("\n"), names.text());
            assert_eq!(names.get(lines.len()), None);
        }
    }
    let there = model.sections().find(SectionId::Provenance as u32).is_some();
    assert_eq!(model.provenance().is_some(), there);
}

fn check_statistics(model: &Model<'_>) {
    let header = model.header();
    for (mode, d) in [(Mode::Identity, header.identity_dim), (Mode::Pose, header.pose_dim)] {
        let d = d as usize;
        if let Some(gaussian) = model.gaussian(mode) {
            let lengths = [gaussian.mean.len(), gaussian.scale.len(), gaussian.precision.len()];
            assert_eq!(lengths, [d, d, d * d]);
            assert!(gaussian.mean.iter().all(|mean| mean.abs() <= MAX_WEIGHT));
            assert!(gaussian.scale.iter().all(|scale| scale > 0.0 && scale.is_finite()));
            for (i, j) in (0..d).flat_map(|i| (0..d).map(move |j| (i, j))) {
                let entry = gaussian.precision.get(i * d + j).expect("d x d entries");
                assert!(entry.is_finite() && Some(entry) == gaussian.precision.get(j * d + i));
                assert!(i != j || entry > 0.0);
            }
        }
        if let Some(spread) = model.spread(mode) {
            let count = if header.kind == Kind::Wavelet { header.n_vertices as usize } else { 1 };
            assert_eq!([spread.mean.len(), spread.scale.len()], [d * count; 2]);
            assert!(spread.mean.iter().all(|mean| mean.abs() <= MAX_WEIGHT));
            assert!(spread.scale.iter().all(|scale| scale > 0.0 && scale.is_finite()));
        }
        if let Some(spectrum) = model.spectrum(mode) {
            let values: Vec<f32> = spectrum.iter().collect();
            assert_finite("spectrum", &values);
            assert!(values.iter().all(|&value| value >= 0.0) && values.is_sorted_by(|a, b| a >= b));
        }
    }
    if let Some(starts) = model.pose_starts() {
        assert!(starts.len().is_multiple_of(header.pose_dim as usize));
        assert!(starts.iter().all(|start| start.abs() <= MAX_WEIGHT));
    }
    if let Some(remainder) = model.remainder() {
        assert!(remainder.len().is_multiple_of(3 * header.n_vertices as usize));
        assert!(remainder.iter().all(|number| number.abs() <= MAX_COEFFICIENT));
    }
}

/// The skeleton of a body: parents before children, axes of unit length, bounds in order.
fn check_joints(model: &Model<'_>) {
    if model.header().kind != Kind::Skinned {
        assert!(model.pose_bounds().is_none() && model.joint_names().is_none());
        return;
    }
    let skeleton = model.skeleton().expect("a body has a skeleton");
    let pose_dim = model.header().pose_dim as usize;
    assert_eq!(skeleton.angles().last().map(|angles| angles.end), Some(pose_dim));
    for index in 0..skeleton.n_joints() {
        let joint = skeleton.joint(index).expect("a joint");
        assert!(joint.parent.is_none_or(|parent| parent < index));
        let length = |axis: [f32; 3]| axis.iter().map(|value| value * value).sum::<f32>();
        assert!(joint.axis.is_none_or(|axis| (length(axis) - 1.0).abs() < 2e-4));
    }
    assert_eq!(skeleton.joint(skeleton.n_joints()), None);
    if let Some((lower, upper)) = model.pose_bounds() {
        assert_eq!((lower.len(), upper.len()), (pose_dim, pose_dim));
        assert!(lower.iter().zip(upper.iter()).all(|(lower, upper)| lower <= upper));
    }
    if let Some(names) = model.joint_names() {
        assert_eq!(names.iter().count(), skeleton.n_joints());
    }
}

/// Positions of all vertices.
fn positions(generator: &impl Generator, weights: Weights<'_>) -> Vec<f32> {
    let n = generator.vertex_count();
    let mut state = vec![f32::NAN; generator.state_req(false).numbers()];
    let at = generator.begin(weights, false, &mut state).expect("weights within the limits");
    let mut out = vec![f32::NAN; 3 * n];
    generator.evaluate_at(at, 0..n, &mut out).expect("all vertices");
    assert_finite("positions", &out);
    let cut = n / 3;
    let mut parts = vec![f32::NAN; 3 * n];
    let (front, back) = parts.split_at_mut(3 * cut);
    generator.evaluate_at(at, 0..cut, front).expect("a range");
    generator.evaluate_at(at, cut..n, back).expect("a range");
    assert_same("positions by ranges", &parts, &out);
    out
}

/// Positions, derivatives and prepared forms at weights within the limits: all finite, and the same by every way.
fn evaluated(generator: &AnyGenerator<'_>, kind: Kind, x: &[f32], y: &[f32]) -> Vec<f32> {
    let n = generator.vertex_count();
    let weights = Weights { identity: x, pose: y };
    let mut whole = positions(generator, weights);
    let blocks = generator.block_count();
    let mut state = vec![f32::NAN; generator.state_req(true).numbers()];
    let at = generator.begin(weights, true, &mut state).expect("weights within the limits");
    let mut values = vec![f32::NAN; blocks * NUMBERS];
    let mut jacobian = vec![f32::NAN; blocks * NUMBERS * generator.dim()];
    generator.linearise_at(at, 0..blocks, &mut values, &mut jacobian).expect("all blocks");
    assert_finite("derivatives", &jacobian);
    let vertex_of = |values: &[f32], v: usize| [0, 1, 2].map(|axis| values[(v / LANES * 3 + axis) * LANES + v % LANES]);
    let of_blocks: Vec<f32> = (0..n).flat_map(|v| vertex_of(&values, v)).collect();
    assert_same("positions of the linearised blocks", &of_blocks, &whole);

    for (fixed, given) in [(Mode::Pose, y), (Mode::Identity, x)] {
        let requirement = generator.prepared_req(fixed, &(0..blocks));
        if kind == Kind::Linear {
            assert_eq!(requirement, Err(Error::WrongKind { expected: 1, found: 2 }));
            continue;
        }
        let mut memory = vec![f32::NAN; requirement.expect("a form of this kind").numbers()];
        let prepared = generator.prepared(fixed, given, 0..blocks, &mut memory).expect("all blocks");
        let free = match fixed {
            Mode::Identity => Weights { identity: &[], pose: y },
            Mode::Pose => Weights { identity: x, pose: &[] },
        };
        let out = positions(&prepared, free);
        if fixed == Mode::Pose && kind == Kind::Bilinear {
            assert_same("positions with the pose fixed", &out, &whole);
        }
    }
    whole.extend(values);
    whole.extend(jacobian);
    whole
}

/// What was read is written, byte for byte when it was laid out as it would be written.
fn check_written(model: &Model<'_>, file: &[u8]) {
    let all: Vec<_> = model.sections().iter().collect();
    let sources: Vec<SectionSource<'_>> = all.iter().map(SectionSource::from_section).collect();
    let mut out = vec![0xAA; written_len(&sources).expect("a small file")];
    write(model.header(), &sources, &mut out).expect("the sections of a sound file");
    let again = Model::open(&out).expect("what was written is sound");
    assert_eq!(again.header(), model.header());
    for (found, expected) in again.sections().iter().zip(&all) {
        assert_eq!((found.id, found.shape, found.bytes), (expected.id, expected.shape, expected.bytes));
    }
    let aligned = |section: &&[u8]| (section.as_ptr() as usize - file.as_ptr() as usize).is_multiple_of(64);
    if out.len() == file.len() && all.iter().map(|section| section.bytes).all(|section| aligned(&section)) {
        assert_eq!(out, file, "written otherwise than read");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// The changes are worth something only if some files survive them and the others are refused for many reasons.
    #[test]
    fn changed_files_are_opened_or_refused_for_many_reasons() {
        let mut state = 7u32;
        let mut byte = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        let mut outcomes = BTreeMap::new();
        for length in (0..1000).map(|k| 1 + k % 40) {
            let bytes: Vec<u8> = (0..length).map(|_| byte()).collect();
            check(&bytes);
            if let Some(file) = Damage::file_of(&bytes) {
                let code = Model::open(&file).map_or_else(|error| error.code() as i32, |_| 0);
                *outcomes.entry(code).or_insert(0) += 1;
            }
        }
        assert!(outcomes.get(&0).is_some_and(|&opened| opened >= 100), "{outcomes:?}");
        assert!(outcomes.len() >= 7, "codes and their files: {outcomes:?}");
        assert!(!outcomes.contains_key(&304), "a checksum was not repaired: {outcomes:?}");
    }
}
