//! The models of the vectors: every number of vertices just below, at and above blocks of 16, with and without linear terms.

use super::stream::Stream;
use super::text::File;
use super::wavelet_models::WaveModel;
use crate::reference::bilinear::Bilinear;
use crate::reference::generator::Generator;
use crate::reference::model_file::{Extras, Head, Section, file, head, sections};
use crate::reference::prior::Gaussian;

/// Numbers of vertices.
pub const COUNTS: [usize; 7] = [1, 15, 16, 17, 47, 48, 49];

/// A model and its file.
pub struct Model {
    pub name: String,
    pub generator: Box<dyn Generator>,
    pub head: Head,
    pub extras: Extras,
    pub sections: Vec<Section>,
    pub bytes: Vec<u8>,
    /// Which part of a wavelet model the cases are about: a suffix of their names, and their fields `levels` and `window`.
    pub part: (String, Vec<(&'static str, Vec<u32>)>),
}

impl Model {
    pub fn new(
        name: String,
        generator: Box<dyn Generator>,
        head: Head,
        sections: Vec<Section>,
        extras: Extras,
    ) -> Self {
        let bytes = file(&head, &sections);
        Model { name, generator, head, extras, sections, bytes, part: Default::default() }
    }

    /// What its cases are called.
    pub fn label(&self) -> String {
        format!("{}{}", self.name, self.part.0)
    }
}

/// All models.
pub struct Models {
    all: Vec<Model>,
    bodies: Vec<Model>,
    waves: Vec<WaveModel>,
}

impl Models {
    pub fn new() -> Self {
        let mut all = Vec::new();
        for n in COUNTS {
            if [1, 16, 17, 49].contains(&n) {
                all.push(model(format!("plain_{n}"), n, [2, 2], [false, false], Extras::default()));
            }
            all.push(model(format!("linear_{n}"), n, [2, 2], [true, true], Extras::default()));
        }
        // The mixed forms, with other numbers of weights.
        all.push(model("identity_linear".into(), 17, [3, 1], [true, false], Extras::default()));
        all.push(model("pose_linear".into(), 17, [1, 3], [false, true], Extras::default()));
        let extras = Extras {
            faces: (0..8).map(|k| [k, k + 1, k + 2]).collect(),
            landmarks: vec![0, 3, 7, 12, 15, 16, 21, 30, 33, 40, 44],
            landmark_names: (0..11).map(|k| format!("point {k}")).collect::<Vec<_>>().join("\n"),
            identity: Some(gaussian("identity", 3)),
            pose: Some(gaussian("pose", 2)),
            provenance: "numbers of a stream, for the golden vectors".into(),
        };
        all.push(model("whole".into(), 45, [3, 2], [false, true], extras));
        Models { all, bodies: super::body_models::bodies(), waves: super::wavelet_models::waves() }
    }

    pub fn named(&self, name: &str) -> &Model {
        self.all.iter().chain(&self.bodies).find(|model| model.name == name).expect("a model of this name")
    }

    /// Linear and skinned models, and those in half precision and bytes.
    pub fn bodies(&self) -> impl Iterator<Item = &Model> {
        self.bodies.iter()
    }

    /// A wavelet model.
    pub fn wave(&self, name: &str) -> &WaveModel {
        self.waves.iter().find(|wave| wave.model.name == name).expect("a wavelet model of this name")
    }

    /// Wavelet models.
    pub fn waves(&self) -> impl Iterator<Item = &WaveModel> {
        self.waves.iter()
    }

    /// The bilinear models in `f32`.
    pub fn iter(&self) -> impl Iterator<Item = &Model> {
        self.all.iter()
    }

    pub fn text(&self) -> String {
        let mut file = File::new("Model files that the cases name.");
        for model in self.all.iter().chain(&self.bodies).chain(self.waves.iter().map(|wave| &wave.model)) {
            file.case("model", &model.name).integer("length", model.bytes.len()).bytes("bytes", &model.bytes);
        }
        file.text()
    }
}

fn model(name: String, n: usize, [di, dp]: [usize; 2], [identity, pose]: [bool; 2], extras: Extras) -> Model {
    let mut stream = Stream::of(&name);
    let mut term = |size: f64| stream.points::<f32>(n, size);
    let generator = Bilinear {
        offset: term(100.0),
        pose_linear: pose.then(|| (0..dp).map(|_| term(10.0)).collect()),
        identity_linear: identity.then(|| (0..di).map(|_| term(10.0)).collect()),
        bilinear: (0..di).map(|_| (0..dp).map(|_| term(10.0)).collect()).collect(),
    };
    let sections = sections(&generator, &extras);
    let head = head(&generator);
    Model::new(name, Box::new(generator), head, sections, extras)
}

/// A Gaussian with a dominant diagonal.
pub fn gaussian(name: &str, d: usize) -> Gaussian {
    let mut stream = Stream::of(name);
    let mean = stream.numbers(d, 0.25);
    let scale = (0..d).map(|_| 0.5 + stream.number::<f32>(0.25)).collect();
    let mut precision = vec![vec![0.0; d]; d];
    for i in 0..d {
        for j in 0..=i {
            let entry: f32 = if i == j { 4.0 + stream.number::<f32>(1.0) } else { stream.number(0.5) };
            (precision[i][j], precision[j][i]) = (entry, entry);
        }
    }
    Gaussian { mean, scale, precision }
}
