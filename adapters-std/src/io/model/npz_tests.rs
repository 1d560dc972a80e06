//! Every small model of the project, of each kind in each storage, as an archive.

use std::path::PathBuf;

use habitus_core::format::Mode;

use super::*;
use crate::generate::positions;
use crate::io::model::samples::{corrected_body, firmware_model};
use crate::io::npy::npz::NpzReader;

/// The arrays of a model file that are named here, and the names of all.
struct Archive {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

impl Archive {
    fn of(file: &[u8]) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("model.npz");
        write(&Model::open(file).expect("a model"), &path).expect("an archive");
        Archive { path, _folder: folder }
    }

    fn names(&self) -> Vec<String> {
        NpzReader::open(&self.path).expect("an archive").names()
    }

    fn f64(&self, name: &str) -> (Vec<usize>, Vec<f64>) {
        NpzReader::open(&self.path).expect("an archive").f64(name).expect("an array")
    }
}

const STORAGES: [&str; 3] = ["", "-f16", "-i8"];

/// The sum of terms with weights, the first with a weight of 1.
fn summed(offset: &[f64], terms: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut sum = offset.to_vec();
    for (term, weight) in terms.chunks_exact(offset.len()).zip(weights) {
        sum.iter_mut().zip(term).for_each(|(sum, term)| *sum += weight * term);
    }
    sum
}

fn near(found: &[f64], expected: &[f32]) {
    assert_eq!(found.len(), expected.len());
    let most = found.iter().zip(expected).map(|(a, &b)| (a - f64::from(b)).abs()).fold(0.0, f64::max);
    assert!(most < 1e-3, "{most} mm");
}

fn weights(count: usize) -> Vec<f32> {
    (0..count).map(|k| 0.5 - 0.25 * (k % 4) as f32).collect()
}

fn doubled(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&value| f64::from(value)).collect()
}

/// What numpy sums from the archive is what the kernel computes, in every storage.
#[test]
fn arrays_sum_to_the_shapes_of_the_kernel() {
    for storage in STORAGES {
        let file = firmware_model(&format!("linear{storage}"));
        let (model, archive) = (Model::open(&file).expect("a model"), Archive::of(&file));
        let (mean, components) = (archive.f64("mean").1, archive.f64("components").1);
        let x = weights(7);
        near(&summed(&mean, &components, &doubled(&x)), &positions(&model, &x, &[]).expect("a shape"));

        let file = firmware_model(&format!("small{storage}"));
        let (model, archive) = (Model::open(&file).expect("a model"), Archive::of(&file));
        let (x, y) = (weights(4), weights(3));
        let mut shape = summed(&archive.f64("mean").1, &archive.f64("expression_linear").1, &doubled(&y));
        shape = summed(&shape, &archive.f64("identity_linear").1, &doubled(&x));
        let (core_shape, core) = archive.f64("core");
        assert_eq!(core_shape, [4, 3, 168, 3]);
        let products: Vec<f64> = x.iter().flat_map(|x| y.iter().map(move |y| f64::from(x * y))).collect();
        near(&summed(&shape, &core, &products), &positions(&model, &x, &y).expect("a shape"));
    }
}

#[test]
fn a_body_holds_its_skeleton_and_who_holds_a_vertex() {
    for storage in STORAGES {
        let file = firmware_model(&format!("body{storage}"));
        let (model, archive) = (Model::open(&file).expect("a model"), Archive::of(&file));
        let x = weights(3);
        let shape = summed(&archive.f64("mean").1, &archive.f64("components").1, &doubled(&x));
        near(&shape, &positions(&model, &x, &[0.0; 11]).expect("a shape"));
        for (name, shape) in [
            ("joint_parents", vec![5]),
            ("joint_axes", vec![5, 3]),
            ("joint_positions", vec![5, 3]),
            ("joint_basis", vec![5, 3, 3]),
            ("pose_lower", vec![11]),
            ("pose_upper", vec![11]),
            ("pose_starts", vec![1, 11]),
            ("identity_mean", vec![3]),
            ("identity_precision", vec![3, 3]),
            ("dual_quaternions", vec![1]),
        ] {
            assert_eq!(archive.f64(name).0, shape, "{name}");
        }
        let [vertices, joints, weights] =
            ["influence_vertices", "influence_joints", "influence_weights"].map(|name| archive.f64(name).1);
        let mut sums = [0.0; 50];
        for ((vertex, joint), weight) in vertices.iter().zip(joints).zip(weights) {
            assert!(joint < 5.0 && weight > 0.0);
            sums[*vertex as usize] += weight;
        }
        assert!(sums.iter().all(|sum| (sum - 1.0).abs() < 1e-5), "{sums:?}");
    }
    let archive = Archive::of(&corrected_body());
    assert_eq!(archive.f64("corrections").0, [2, 9, 20, 3]);
}

#[test]
fn a_wavelet_model_holds_its_grid_and_the_weights_of_every_coefficient() {
    let plain = Archive::of(&firmware_model("wavelet")).f64("coefficients");
    for storage in STORAGES {
        let archive = Archive::of(&firmware_model(&format!("wavelet{storage}")));
        for (name, shape) in [
            ("coefficients_mean", vec![425, 3]),
            ("grid", vec![4]),
            ("identity_mean", vec![425, 2]),
            ("identity_scale", vec![425, 2]),
            ("expression_mean", vec![425, 2]),
            ("expression_scale", vec![425, 2]),
            ("landmarks", vec![13]),
            ("faces", vec![768, 3]),
        ] {
            assert_eq!(archive.f64(name).0, shape, "{name}");
        }
        let (shape, values) = archive.f64("coefficients");
        assert_eq!(shape, [2, 2, 425, 3]);
        let most = plain.1.iter().fold(0.0f64, |most, value| most.max(value.abs()));
        let off = values.iter().zip(&plain.1).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off <= most / 127.0, "{storage}: {off} of {most}");
    }
}

/// Nothing numeric is forgotten: as many numbers as the file has, in whatever storage.
#[test]
fn no_number_of_the_file_is_left_out() {
    for kind in ["small", "linear", "body", "wavelet"] {
        for storage in STORAGES {
            let file = firmware_model(&format!("{kind}{storage}"));
            let (model, archive) = (Model::open(&file).expect("a model"), Archive::of(&file));
            let names = archive.names();
            let stored_elsewhere = [
                SectionId::Coefficients as u32,
                SectionId::Offsets as u32,
                SectionId::Ranges as u32,
                SectionId::SkinStarts as u32,
                SectionId::SkinJoints as u32,
                SectionId::SkinWeights as u32,
            ];
            let expected = model
                .sections()
                .iter()
                .filter(|section| section.element != ElementType::U8 && !stored_elsewhere.contains(&section.id))
                .count();
            let of_kind = match kind {
                "small" => 4,
                "body" => 2 + 3 + 1,
                _ => 2,
            };
            assert_eq!(names.len(), expected + of_kind, "{kind}{storage}: {names:?}");
            assert_eq!(names.contains(&"quantisation_error".into()), !storage.is_empty());
            assert_eq!(model.spread(Mode::Identity).is_some(), names.contains(&"identity_mean".into()));
        }
    }
}
