//! A small procedural population, its model, and a scan of a face of the model with known truth: made once.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use habitus::io::mesh as mesh_files;
use habitus::mesh::Mesh;
use serde_json::Value;

use crate::program::{Folder, habitus, json};

/// The identity and the expression of the truth, in standard deviations.
const IDENTITY: &str = "1,-0.8,0.6,0.5";
const EXPRESSION: &str = "0.7,-0.5,0.3,0.2,0.1";

/// Files and what is in them.
pub struct Work {
    folder: PathBuf,
    /// The face as it stands in the scan.
    pub truth: Mesh,
    pub scan: Mesh,
    /// Names and positions of the landmarks, on vertices of the scan, in the order of the model.
    pub landmarks: Vec<(String, [f64; 3])>,
    /// These vertices.
    pub vertices: Vec<usize>,
}

impl Work {
    /// The path of a file.
    pub fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Writes a file and returns its path.
    pub fn text(&self, name: &str, text: &str) -> String {
        std::fs::write(self.folder.join(name), text).expect("written");
        self.path(name)
    }

    /// Writes a mesh and returns its path.
    pub fn mesh(&self, name: &str, mesh: &Mesh) -> String {
        mesh_files::write(self.path(name), mesh).expect("written");
        self.path(name)
    }

    /// The landmarks as triples, moved by `place`, in a file of this name.
    pub fn triples(&self, name: &str, place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
        let line = |(_, p): &(String, [f64; 3])| place(*p).map(|x| format!("{x:?}")).join(" ");
        self.text(name, &self.landmarks.iter().map(line).collect::<Vec<_>>().join("\n"))
    }

    /// The landmarks `which` as a labelled list.
    pub fn labelled(&self, name: &str, which: &[usize]) -> String {
        let entry = |&k: &usize| {
            let (label, p) = &self.landmarks[k];
            format!("{label}\n{:?} {:?} {:?}\n", p[0], p[1], p[2])
        };
        self.text(name, &format!("{}\n{}", which.len(), which.iter().map(entry).collect::<String>()))
    }

    /// Fits the model to a scan; the object and the fitted vertices.
    pub fn fitted(&self, scan: &str, landmarks: &str, more: &[&str]) -> (Value, Vec<[f64; 3]>) {
        let number = std::sync::atomic::AtomicUsize::fetch_add(&NEXT, 1, std::sync::atomic::Ordering::Relaxed);
        let output = self.path(&format!("fitted_{number}.npy"));
        let model = self.path("face.hab");
        let arguments = [&["fit", &model, scan, "--landmarks", landmarks, "-o", &output], more].concat();
        let object = json(&arguments);
        (object, mesh_files::read(output).expect("a cloud").positions)
    }

    /// The fit of the scan as it was made, from all landmarks.
    pub fn plain(&self) -> &(Value, Vec<[f64; 3]>) {
        static PLAIN: OnceLock<(Value, Vec<[f64; 3]>)> = OnceLock::new();
        let landmarks = || self.triples("plain.txt", |p| p);
        PLAIN.get_or_init(|| self.fitted(&self.path("scans/scan_00.ply"), &landmarks(), &[]))
    }

    /// Runs a fit that must be refused: status 1 and one sentence, which is returned.
    pub fn refused(&self, model: &str, scan: &str, landmarks: &str, more: &[&str]) -> String {
        let model = self.path(model);
        let output = habitus(&[&["fit", &model, scan, "--landmarks", landmarks], more].concat());
        let said = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(1), "{scan} {landmarks} {more:?}: {said}");
        let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
        assert_eq!(errors.len(), 1, "one sentence: {said}");
        errors[0].to_owned()
    }

    /// Mean distance of the vertices from the truth.
    pub fn error(&self, vertices: &[[f64; 3]]) -> f64 {
        mean_distance(vertices, &self.truth.positions)
    }
}

static NEXT: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);

pub fn mean_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distance = |(p, q): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    a.iter().zip(b).map(distance).sum::<f64>() / a.len() as f64
}

/// `train face` of the population with everything, or without the options named.
pub fn train(folder: &Path, without: &[&str], output: &str) {
    let part = |name: &str| folder.join("faces").join(name).display().to_string();
    let (tensor, output) = (part("tensor.npy"), folder.join(output).display().to_string());
    let mut words = vec!["train", "face", &tensor, "--identity-dim", "4", "--expression-dim", "5", "-o", &output];
    if !without.is_empty() {
        words.extend(["--remainder", "0"]);
    }
    let options = [
        ("--template", part("template.ply")),
        ("--landmarks", part("landmarks.json")),
        ("--mirror", part("mirror.npy")),
    ];
    for (option, file) in options.iter().filter(|(option, _)| !without.contains(option)) {
        words.extend([*option, file]);
    }
    json(&words);
}

pub fn work() -> &'static Work {
    static WORK: OnceLock<Work> = OnceLock::new();
    WORK.get_or_init(|| {
        let Folder(folder) = Folder::new("cli_fit", "");
        let path = |name: &str| folder.join(name).display().to_string();
        json(&["synth", "faces", "--identities", "8", "--level", "3", "-o", &path("faces")]);
        train(&folder, &[], "face.hab");
        let (model, face, scans) = (path("face.hab"), path("face.ply"), path("scans"));
        json(&["generate", &model, "--identity", IDENTITY, "--expression", EXPRESSION, "-o", &face]);
        let options = ["--pixel", "4", "--holes", "2", "--place", "180,500"];
        json(&[&["synth", "scans", &face, "-o", &scans], &options[..]].concat());
        let scan = mesh_files::read(path("scans/scan_00.ply")).expect("a scan");
        let truth = mesh_files::read(path("scans/truth_00.ply")).expect("its truth");
        let told: Value =
            serde_json::from_slice(&std::fs::read(path("faces/landmarks.json")).expect("read")).expect("JSON");
        let names = told["landmarks13_names"].as_array().expect("names");
        let on_face = told["landmarks13"].as_array().expect("vertices");
        let nearest = |vertex: &Value| {
            let p = truth.positions[vertex.as_u64().expect("an index") as usize];
            let square = |q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
            let all = scan.positions.iter().map(square).enumerate();
            all.min_by(|a, b| a.1.total_cmp(&b.1)).expect("a vertex").0
        };
        let vertices: Vec<usize> = on_face.iter().map(nearest).collect();
        let named =
            |(name, &vertex): (&Value, &usize)| (name.as_str().expect("a name").to_owned(), scan.positions[vertex]);
        let landmarks = names.iter().zip(&vertices).map(named).collect();
        Work { folder, truth, scan, landmarks, vertices }
    })
}
