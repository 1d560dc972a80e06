//! A small wavelet model with levels, a window, weights and a fit, made from the fuzzer's bytes.

use std::ops::Range;

use arbitrary::{Arbitrary, Unstructured};
use habitus_core::Error;
use habitus_core::format::limits::MAX_WEIGHT;
use habitus_reference::model_file::{Extras, Section, file};
use habitus_reference::multiscale::{Multiscale, Spread};
use habitus_reference::normal_equations::{Frame, Sample};
use habitus_reference::placement::Placement;
use habitus_reference::storage::Storage;
use habitus_reference::wavelet::{Grid, Wavelet};

use crate::body_case::SIZES;
use crate::numbers::Number;

/// What the fuzzer chooses.
#[derive(Debug, Default, Arbitrary)]
pub struct Choice {
    pub base: [u8; 2],
    pub levels: u8,
    pub dims: [u8; 2],
    /// Bits: bilinear, weights within reach, a weight too many, scale sought, rotation sought, identity held, pose held, normals.
    pub flags: u8,
    pub storage: u8,
    pub seed: u32,
    pub offset_size: u8,
    pub term_size: u8,
    pub detail: u8,
    pub resolution: u8,
    pub window: [u8; 4],
    pub range: [u8; 2],
    /// Box, pull, first fitted level and number of them, passes, which vertices are measured.
    pub fit: [u8; 6],
    pub weights: Vec<Number>,
    pub coefficients: Vec<(u16, Number)>,
}

/// A case for both the kernel and the reference.
pub struct Case {
    /// At its levels and in its window.
    pub model: Multiscale,
    pub spreads: [Option<Spread>; 2],
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    pub range: Range<usize>,
    /// A fit, where numbers are such as surfaces have.
    pub fit: Option<Fit>,
}

/// What is fitted to; the weights of the case are the start.
pub struct Fit {
    pub samples: Vec<Option<Sample>>,
    pub frame: Frame,
    /// Identity and pose are sought.
    pub free: [bool; 2],
    pub kappa: f32,
    pub omega: f32,
    pub levels: Range<usize>,
    pub passes: u32,
    pub start: Placement<f32>,
}

impl Choice {
    /// The choice of these bytes; `None` when they are too few.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        Choice::arbitrary_take_rest(Unstructured::new(bytes)).ok()
    }

    fn flag(&self, bit: u8) -> bool {
        self.flags >> bit & 1 == 1
    }

    /// The model and the case around it.
    pub fn case(&self) -> Case {
        let below = |byte: u8, limit: usize| usize::from(byte) % limit;
        let grid = Grid { base: self.base.map(|byte| 2 + below(byte, 3)), levels: below(self.levels, 3) };
        let (mut state, mut index) = (self.seed, 0usize);
        let mut number = |size: f32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let set = self.coefficients.iter().find(|(at, _)| usize::from(*at) == index);
            index += 1;
            set.map_or(size * ((state >> 8) as f32 / (1 << 23) as f32 - 1.0), |(_, number)| number.0)
        };
        let mut point = |size: f32| [number(size), number(size), number(size)];
        let sizes = [self.offset_size, self.term_size].map(|choice| SIZES[below(choice, SIZES.len())]);
        let mut mean: Vec<[f32; 3]> = (0..grid.len()).map(|_| point(sizes[0])).collect();
        mean.resize(grid.len().next_multiple_of(16), [0.0; 3]);
        let storage = Storage::ALL[below(self.storage, 3)];
        let [d, e] = self.dims.map(|byte| 1 + below(byte, 2));
        let mut term = || storage.stored(&(0..grid.len()).map(|_| point(sizes[1])).collect::<Vec<_>>());
        let core = (0..d).map(|_| (0..e).map(|_| term()).collect()).collect();
        let wavelet = Wavelet::ALL[usize::from(self.flag(0))];
        let [detail, resolution] = [self.detail, self.resolution].map(|byte| below(byte, grid.levels + 1));
        let model = Multiscale::new(grid, wavelet, mean, core).with_levels(detail, resolution);
        let bounds = |from: u8, to: u8, size: usize| {
            let from = below(from, size);
            [from, from + 1 + below(to, size - from)]
        };
        let [left, right, top, bottom] = self.window;
        let columns = bounds(left, right, grid.width(resolution));
        let model = model.with_window(columns, bounds(top, bottom, grid.height(resolution)));
        let [di, dp] = [d, e].map(|dim| dim * model.weighted());
        let weight = |k: usize| match self.weights.get(k % self.weights.len().max(1)) {
            Some(Number(weight)) if !self.flag(1) || weight.abs() <= 20.0 => *weight,
            _ => 0.25 * ((k * 7 % 11) as f32 - 5.0),
        };
        let further = self.flag(2) && self.seed.is_multiple_of(4);
        let spread = |dim: usize| Spread {
            mean: (0..dim * grid.len()).map(|k| 0.125 * ((k * 5 % 7) as f32 - 3.0)).collect(),
            scale: (0..dim * grid.len()).map(|k| 0.5 + 0.25 * (k % 3) as f32).collect(),
        };
        let columns = columns[1] - columns[0];
        let rows = model.window[1][1] - model.window[1][0];
        let limit = columns * rows + 3;
        let mut case = Case {
            spreads: [d, e].map(|dim| Some(spread(dim))),
            identity: (0..di + usize::from(further)).map(weight).collect(),
            pose: (0..dp).map(|k| weight(di + k)).collect(),
            range: below(self.range[0], limit)..below(self.range[1], limit),
            fit: None,
            model,
        };
        let small = |numbers: &[f32]| numbers.iter().all(|number| number.abs() <= 20.0);
        if sizes.iter().all(|&size| size <= 300.0)
            && self.coefficients.is_empty()
            && !further
            && small(&case.identity)
            && small(&case.pose)
        {
            case.fit = Some(self.fit(&case));
        }
        case
    }

    fn fit(&self, case: &Case) -> Fit {
        let [kappa, omega, from, count, passes, step] = self.fit.map(usize::from);
        let place = Placement { scale: 1.25, translation: [3.0, -4.0, 5.0], ..Placement::identity() };
        let other: Vec<f32> = case.identity.iter().map(|weight| 0.5 - weight).collect();
        let positions = case.model.positions(&other, &case.pose);
        let sample = |(vertex, &position): (usize, &[f32; 3])| {
            let far = 0.125 * (vertex * 3 % 5) as f32;
            let target = place.applied(position).map(|value| value + far);
            let normal = (self.flag(7) && vertex % 3 == 1).then_some([0.6, 0.0, 0.8]);
            let sample = Sample {
                corners: [vertex as u32, 0, 0],
                barycentric: [1.0, 0.0, 0.0],
                target,
                normal,
                weight: 0.5 + (vertex % 4) as f32,
            };
            // The first is always there.
            (vertex % (1 + step % 5) == 0).then_some(sample)
        };
        let limit = case.model.detail.min(case.model.resolution) + 1;
        let from = from % limit;
        Fit {
            samples: positions.iter().enumerate().map(sample).collect(),
            frame: if !self.flag(4) {
                Frame::Fixed
            } else if self.flag(3) {
                Frame::Similarity
            } else {
                Frame::Rigid
            },
            free: [!self.flag(5), !self.flag(6)],
            kappa: [0.25, 1.0, 3.0, f32::INFINITY][kappa % 4],
            omega: [0.0, 1e-3, 0.5, 10.0][omega % 4],
            levels: from..from + 1 + count % (limit - from),
            passes: 1 + passes as u32 % 2,
            start: place,
        }
    }
}

impl Case {
    /// The sections and the bytes of its file.
    pub fn file(&self) -> (Vec<Section>, Vec<u8>) {
        let sections = self.model.sections(&Extras::default(), &self.spreads);
        let bytes = file(&self.model.head(), &sections);
        (sections, bytes)
    }

    /// The error of the weights: a wrong number of them, or one beyond the limit.
    pub fn weights_refused(&self) -> Option<Error> {
        let expected = self.model.local_dims()[0] * self.model.weighted();
        if expected != self.identity.len() {
            return Some(Error::DimensionMismatch { expected: expected as u32, found: self.identity.len() as u32 });
        }
        let beyond = self.identity.iter().chain(&self.pose).position(|weight| !(weight.abs() <= MAX_WEIGHT));
        beyond.map(|index| Error::NotFinite { index: index as u32 })
    }
}
