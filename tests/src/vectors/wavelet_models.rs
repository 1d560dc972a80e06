//! Wavelet models of the vectors in every storage; small, because firmware links them.

use super::models::Model;
use super::stream::Stream;
use crate::reference::model_file::Extras;
use crate::reference::multiscale::{Multiscale, Spread};
use crate::reference::storage::Storage;
use crate::reference::wavelet::{Grid, Wavelet};

/// A wavelet model with what its fits need.
pub struct WaveModel {
    pub model: Model,
    pub multiscale: Multiscale,
    pub spreads: [Option<Spread>; 2],
}

impl WaveModel {
    fn part_of(&self, multiscale: Multiscale, suffix: &str, fields: Vec<(&'static str, Vec<u32>)>) -> WaveModel {
        let Model { name, head, extras, sections, .. } = &self.model;
        let generator = Box::new(multiscale.clone());
        let model = Model::new(name.clone(), generator, *head, sections.clone(), extras.clone());
        let part = (format!("{}{suffix}", self.model.part.0), fields);
        WaveModel { model: Model { part, ..model }, multiscale, spreads: self.spreads.clone() }
    }

    /// With weights up to level `detail`, as the surface is at level `resolution`.
    pub fn at_levels(&self, detail: usize, resolution: usize) -> WaveModel {
        let multiscale = self.multiscale.clone().with_levels(detail, resolution);
        let fields = vec![("levels", vec![detail as u32, resolution as u32])];
        self.part_of(multiscale, &format!("_{detail}_{resolution}"), fields)
    }

    /// A window of what it was.
    pub fn in_window(&self, columns: [usize; 2], rows: [usize; 2]) -> WaveModel {
        let multiscale = self.multiscale.clone().with_window(columns, rows);
        let bounds = [columns, rows].concat();
        let mut fields = self.model.part.1.clone();
        fields.push(("window", bounds.iter().map(|&bound| bound as u32).collect()));
        let words: Vec<String> = bounds.iter().map(usize::to_string).collect();
        self.part_of(multiscale, &format!("_window_{}", words.join("_")), fields)
    }
}

/// All of them.
pub fn waves() -> Vec<WaveModel> {
    use Storage::{F16, F32, I8};
    use Wavelet::{Bilinear, Cubic};
    [
        ("wave_6", [3, 2], 0, Bilinear, [1, 1], F32),
        ("wave_15", [3, 2], 1, Cubic, [2, 2], F32),
        ("wave_25_i8", [2, 2], 2, Cubic, [2, 1], I8),
        ("wave_45_f16", [2, 3], 2, Bilinear, [1, 2], F16),
        ("wave_81_i8", [3, 3], 2, Cubic, [2, 2], I8),
    ]
    .map(|(name, base, levels, wavelet, dims, storage)| wave(name, Grid { base, levels }, wavelet, dims, storage))
    .into()
}

/// The numbers of a wavelet model, from a stream: a base of 100 mm, and less from level to level.
pub fn multiscale(name: &str, grid: Grid, wavelet: Wavelet, [d, e]: [usize; 2], storage: Storage) -> Multiscale {
    let mut stream = Stream::of(name);
    let nodes = grid.nodes();
    let mut term = |size: f64| -> Vec<[f32; 3]> {
        nodes.iter().map(|node| stream.point(size / f64::from(1 << (2 * node.level)))).collect()
    };
    let mut mean = term(100.0);
    mean.resize(grid.len().next_multiple_of(16), [0.0; 3]);
    let core = (0..d).map(|_| (0..e).map(|_| storage.stored(&term(10.0))).collect()).collect();
    Multiscale::new(grid, wavelet, mean, core)
}

fn wave(name: &str, grid: Grid, wavelet: Wavelet, dims: [usize; 2], storage: Storage) -> WaveModel {
    let multiscale = multiscale(name, grid, wavelet, dims, storage);
    let mut stream = Stream::of(&format!("spreads of {name}"));
    let spreads = dims.map(|dim| {
        let mean = stream.numbers(dim * grid.len(), 0.5);
        let scale = (0..dim * grid.len()).map(|_| 0.75 + stream.number::<f32>(0.25)).collect();
        Some(Spread { mean, scale })
    });
    let landmarks: Vec<u32> = (0..7).map(|k| k * (grid.len() as u32 - 1) / 6).collect();
    let landmark_names = (0..7).map(|k| format!("point {k}")).collect::<Vec<_>>().join("\n");
    let extras = match grid.len() {
        25 => Extras { landmarks, landmark_names, ..Extras::default() },
        _ => Extras::default(),
    };
    let (head, sections) = (multiscale.head(), multiscale.sections(&extras, &spreads));
    let model = Model::new(name.into(), Box::new(multiscale.clone()), head, sections, extras);
    WaveModel { model, multiscale, spreads }
}
