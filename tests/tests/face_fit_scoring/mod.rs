//! The shared scans, a model trained from the shared tensor, and the scoring of fits against the truth.

pub mod simulated;

use std::path::Path;

use habitus::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use habitus::face::remainder::{N_COMPONENTS, remainder};
use habitus::face::tensor::ShapeTensor;
use habitus::face::training_data::{Template, tensor};
use habitus::io::model::{ModelSource, hab};
use habitus::io::{mesh, npy};
use habitus::mesh::Mesh;
use habitus::register::gpa::{GpaOptions, align_in_place, mean_of_shapes};
use habitus::spatial::PointTree;

/// Vertices of the narrow face.
pub const N_NARROW: usize = 6706;
/// A vertex of the truth is visible when a face point of the scan is at most so far from it, mm.
const VISIBLE: f64 = 2.5;

/// The shared data that fits need.
pub struct Shared {
    pub scans: Vec<Mesh>,
    landmarks: Vec<f64>,
    truth: Vec<f64>,
    up_index: Vec<u32>,
    up_weight: Vec<f64>,
    pub train: ShapeTensor,
    template: Template,
}

/// Vertex errors of one fit, mm.
pub struct Score {
    pub mean: f64,
    pub median: f64,
    pub q95: f64,
    /// Mean of the vertices that the scan does not show.
    pub hidden: f64,
    pub hidden_share: f64,
    pub note: String,
}

impl Shared {
    pub fn read(dir: &Path) -> Self {
        let faces = dir.join("faces");
        let numbers = |name: &str| npy::read_f64(faces.join(name)).expect("numbers").1;
        let scan = |k| mesh::read(faces.join(format!("scans/scan_{k:02}.ply"))).expect("a scan");
        let mut train = tensor(&faces.join("tensor_train.npy")).expect("a tensor");
        let len = train.shape_len();
        align_in_place(train.data_mut(), len, &GpaOptions::default()).expect("alignment");
        let (triangles, landmarks) = (faces.join("dec_triangles.npy"), faces.join("dec.json"));
        Shared {
            scans: (0..12).map(scan).collect(),
            landmarks: numbers("scans/landmarks13.npy"),
            truth: numbers("scans/truth_vertices.npy"),
            up_index: npy::read_u32(faces.join("dec_up_index.npy")).expect("indices").1,
            up_weight: numbers("dec_up_weight.npy"),
            template: Template::read(&train, Some(&triangles), Some(&landmarks), None).expect("a template"),
            train,
        }
    }

    /// The bytes of a model of this size.
    pub fn model(&self, (d_id, d_pose): (usize, usize)) -> Vec<u8> {
        self.model_of(&self.train, (d_id, d_pose))
    }

    /// The bytes of a model of this size from these shapes.
    pub fn model_of(&self, shapes: &ShapeTensor, (d_id, d_pose): (usize, usize)) -> Vec<u8> {
        let options =
            HosvdOptions { identity: ModeSize::Dimension(d_id), expression: ModeSize::Dimension(d_pose), hooi: None };
        let model = hosvd(shapes, &options).expect("a model").model;
        let mut source = ModelSource::of_multilinear(&model);
        source.faces = self.template.faces.clone();
        source.landmarks = self.template.landmarks.clone();
        source.landmark_names = self.template.landmark_names.clone();
        source.remainder = remainder(shapes, [d_id, d_pose], N_COMPONENTS).expect("a remainder").components;
        hab::bytes(&source).expect("a model file")
    }

    /// The landmarks as vertices of the small topology.
    pub fn landmark_vertices(&self) -> &[u32] {
        &self.template.landmarks
    }

    /// The landmarks of the mean training shape.
    pub fn mean_landmarks(&self) -> Vec<[f64; 3]> {
        let mean = mean_of_shapes(self.train.data(), self.train.shape_len());
        self.template.landmarks.iter().map(|&v| mean.as_chunks::<3>().0[v as usize]).collect()
    }

    /// The landmarks of scan `k`.
    pub fn landmarks(&self, k: usize) -> Vec<Option<[f64; 3]>> {
        self.landmarks.as_chunks::<3>().0[13 * k..13 * (k + 1)].iter().map(|&p| Some(p)).collect()
    }

    /// The narrow face of a fit in the small topology.
    pub fn upsampled(&self, small: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let rows = self.up_index.as_chunks::<3>().0.iter().zip(self.up_weight.as_chunks::<3>().0);
        let mixed = |(index, weight): (&[u32; 3], &[f64; 3])| {
            std::array::from_fn(|axis| (0..3).map(|j| weight[j] * small[index[j] as usize][axis]).sum())
        };
        rows.map(mixed).collect()
    }

    /// The truth of scan `k`, narrow face.
    pub fn truth(&self, k: usize) -> &[[f64; 3]] {
        &self.truth.as_chunks::<3>().0[9409 * k..][..N_NARROW]
    }

    /// The errors of a fit (small topology, mm, frame of the scan).
    pub fn score(&self, k: usize, small: &[[f64; 3]]) -> Score {
        let scan = &self.scans[k];
        let labels = &scan.attributes.iter().find(|a| a.name == "label").expect("labels").values;
        let face: Vec<[f64; 3]> =
            scan.positions.iter().zip(labels).filter(|&(_, &label)| label == 0.0).map(|(p, _)| *p).collect();
        let near = PointTree::new(&face).expect("points").nearest_all(self.truth(k));
        let visible: Vec<bool> = near.iter().map(|near| near.distance <= VISIBLE).collect();
        scored(&self.upsampled(small), self.truth(k), &visible)
    }
}

/// Errors over the visible vertices, and the mean over the others.
pub fn scored(found: &[[f64; 3]], truth: &[[f64; 3]], visible: &[bool]) -> Score {
    let distance = |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|x| (a[x] - b[x]) * (a[x] - b[x])).sum::<f64>().sqrt();
    let all: Vec<(f64, bool)> =
        found.iter().zip(truth).zip(visible).map(|((a, b), &visible)| (distance(a, b), visible)).collect();
    let of = |wanted: bool| all.iter().filter(|(_, v)| *v == wanted).map(|(d, _)| *d).collect::<Vec<f64>>();
    let (mut seen, hidden) = (of(true), of(false));
    seen.sort_by(f64::total_cmp);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    Score {
        mean: mean(&seen),
        median: seen[seen.len() / 2],
        q95: seen[seen.len() * 95 / 100],
        hidden: mean(&hidden),
        hidden_share: hidden.len() as f64 / all.len() as f64,
        note: String::new(),
    }
}

/// Prints the table of the twelve scans and returns mean and median over the clean ones.
pub fn print_table(title: &str, scores: &[Score], best: f64) -> (f64, f64) {
    println!(
        "\n{title}: vertex errors against the truth, mm\n| scan | mean | median | 95 % | hidden mean | hidden share | |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (k, s) in scores.iter().enumerate() {
        println!(
            "| {k:02} | {:.3} | {:.3} | {:.3} | {:.3} | {:.2} | {} |",
            s.mean, s.median, s.q95, s.hidden, s.hidden_share, s.note
        );
    }
    let mut clean: Vec<f64> =
        scores.iter().enumerate().filter(|(k, _)| ![8, 9].contains(k)).map(|(_, s)| s.mean).collect();
    let mean = clean.iter().sum::<f64>() / clean.len() as f64;
    clean.sort_by(f64::total_cmp);
    let median = 0.5 * (clean[clean.len() / 2] + clean[(clean.len() - 1) / 2]);
    println!(
        "clean mean {mean:.3} (projection of the truth {best}, ratio {:.2}), clean median {median:.3}; 08 {:.2} and 09 {:.2} of it",
        mean / best,
        scores[8].mean / median,
        scores[9].mean / median
    );
    (mean, median)
}
