//! A small bilinear model with weights, samples and options, made from the fuzzer's bytes; and what the documentation of the
//! kernel says must be refused of it.

use std::ops::Range;

use arbitrary::{Arbitrary, Unstructured};
use habitus_core::Error;
use habitus_core::fit::FitOptions;
use habitus_core::format::limits::MAX_WEIGHT;
use habitus_core::format::{Mode, Model};
use habitus_core::prior;
use habitus_core::solve::levenberg_marquardt::Limits as CoreLimits;
use habitus_reference::bilinear::Bilinear;
use habitus_reference::fit::Options;
use habitus_reference::levenberg_marquardt::Limits;
use habitus_reference::model_file::Extras;
use habitus_reference::normal_equations::{Frame, Sample};
use habitus_reference::placement::{Placement, rotation_matrix};
use habitus_reference::prior::{Gaussian, Prior};

use crate::numbers::Number;

/// What the fuzzer chooses.
#[derive(Debug, Arbitrary)]
struct Choice {
    n: u8,
    dims: [u8; 2],
    /// Bits: identity-linear terms, pose-linear terms, placing, landmarks only, a further weight
    /// (when the two behind are zero), numbers within reach.
    flags: u8,
    seed: u32,
    offset_size: u8,
    term_size: u8,
    range: [u8; 2],
    frame: u8,
    priors: [(u8, Number); 2],
    noise: Number,
    iterations: u8,
    decrease: Number,
    damping: Number,
    rotation: [i8; 3],
    translation: [Number; 3],
    scale: Number,
    weights: [Number; 8],
    coefficients: Vec<(u16, Number)>,
    samples: Vec<SampleChoice>,
}

#[derive(Debug, Arbitrary)]
struct SampleChoice {
    kind: u8,
    corners: [u8; 3],
    barycentric: [Number; 3],
    /// Where the target lies from the point of the model in its placement.
    target: [Number; 3],
    normal: [Number; 3],
    weight: Number,
}

impl Choice {
    /// Makes numbers of what is refused for its size or sign, so that the case comes to its fit.
    fn tame(&mut self) {
        let number = |number: &mut Number| {
            if !(number.0.abs() <= 1e4) {
                number.0 = 0.25;
            }
        };
        let positive = |number: &mut Number| {
            number.0 = number.0.abs();
            if !(1e-6..=1e4).contains(&number.0) {
                number.0 = 1.5;
            }
        };
        self.weights.iter_mut().chain(&mut self.translation).for_each(number);
        for size in [&mut self.scale, &mut self.noise, &mut self.damping, &mut self.decrease] {
            positive(size);
        }
        self.decrease.0 *= 1e-5;
        self.priors.iter_mut().map(|(_, factor)| factor).for_each(positive);
        for sample in &mut self.samples {
            sample.barycentric.iter_mut().chain(&mut sample.target).for_each(number);
            positive(&mut sample.weight);
            // Without the normals that may have any length, and the vertex behind the last.
            sample.kind &= 0x17;
        }
    }
}

/// A case for both the kernel and the reference.
pub struct Case {
    pub model: Bilinear,
    pub extras: Extras,
    pub identity: Vec<f32>,
    pub pose: Vec<f32>,
    pub range: Range<usize>,
    pub samples: Vec<Option<Sample>>,
    pub placement: Placement<f32>,
    pub frame: Frame,
    pub landmarks_only: bool,
    place: bool,
    /// Kind and factor: none, Gaussian, box.
    priors: [(u8, f32); 2],
    noise: f32,
    limits: Limits<f32>,
}

/// Sizes of the terms, millimetres: of a face, and at the ends of what can be computed.
const SIZES: [f32; 8] = [100.0, 10.0, 1.0, 0.0, 1e-30, 1e5, 1e9, 1e12];

impl Case {
    /// The case of these bytes; `None` when they are too few.
    pub fn of(bytes: &[u8]) -> Option<Self> {
        let mut choice = Choice::arbitrary_take_rest(Unstructured::new(bytes)).ok()?;
        if choice.flags >> 5 & 1 == 1 {
            choice.tame();
        }
        let n = 1 + usize::from(choice.n % 40);
        let (di, dp) = (1 + usize::from(choice.dims[0] % 4), 1 + usize::from(choice.dims[1] % 3));
        let flag = |bit: u8| choice.flags >> bit & 1 == 1;
        let model = model(&choice, n, di, dp);
        let weights: Vec<f32> = choice.weights.iter().map(|number| number.0).collect();
        let further = flag(4) && choice.flags >> 6 == 0;
        let identity = weights[..di + usize::from(further && choice.seed.is_multiple_of(2))].to_vec();
        let pose = weights[4..][..dp + usize::from(further && choice.seed % 2 == 1)].to_vec();
        let placement = Placement {
            scale: choice.scale.0,
            rotation: rotation_matrix(choice.rotation.map(|angle| f32::from(angle) / 32.0)),
            translation: choice.translation.map(|number| number.0),
        };
        let landmarks_only = flag(3);
        let extras = extras(&choice, n, di, dp);
        let point = |v: usize| if v < n { model.value(&weights[..di], &weights[4..4 + dp], v) } else { [0.0; 3] };
        let samples = match landmarks_only {
            true => at_landmarks(&choice, &extras.landmarks, &placement, point),
            false => choice.samples.iter().take(40).map(|sample| free_sample(sample, n, &placement, point)).collect(),
        };
        let frame = [Frame::Fixed, Frame::Rigid, Frame::Similarity][usize::from(choice.frame % 3)];
        let priors = choice.priors.map(|(kind, factor)| (kind % 3, factor.0));
        Some(Case {
            extras,
            identity,
            pose,
            range: usize::from(choice.range[0]) % (n + 3)..usize::from(choice.range[1]) % (n + 3),
            samples,
            placement,
            frame,
            landmarks_only,
            place: flag(2),
            priors,
            noise: choice.noise.0,
            limits: Limits {
                max_iterations: u32::from(choice.iterations % 12),
                relative_decrease: choice.decrease.0,
                damping: choice.damping.0,
            },
            model,
        })
    }

    /// The error of the weights: a wrong number of them, or one beyond the limit.
    pub fn weights_refused(&self) -> Option<Error> {
        let (di, dp) = self.model.dims();
        for (expected, found) in [(di, self.identity.len()), (dp, self.pose.len())] {
            if expected != found {
                return Some(Error::DimensionMismatch { expected: expected as u32, found: found as u32 });
            }
        }
        let beyond = self.identity.iter().chain(&self.pose).position(|weight| !(weight.abs() <= MAX_WEIGHT));
        beyond.map(|index| Error::NotFinite { index: index as u32 })
    }

    /// The error of a placement that is no similarity transform.
    pub fn placement_refused(&self) -> Option<Error> {
        let sound = self.placement.numbers().iter().all(|number| number.is_finite()) && self.placement.scale > 0.0;
        (!sound).then_some(Error::NotFinite { index: 0 })
    }

    /// The error of the first sample that breaks a rule.
    pub fn first_sample_refused(&self) -> Option<Error> {
        self.samples.iter().enumerate().find_map(|(index, sample)| self.sample_refused(index as u32, sample.as_ref()?))
    }

    fn sample_refused(&self, index: u32, sample: &Sample) -> Option<Error> {
        let normal = sample.normal.unwrap_or_default();
        let numbers = [sample.target, normal, sample.barycentric];
        let weight_fits = sample.weight >= 0.0 && sample.weight.is_finite();
        if !weight_fits || numbers.iter().flatten().any(|number| !number.is_finite()) {
            return Some(Error::NotFinite { index });
        }
        let square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        if sample.normal.is_some() && !(0.95..=1.05).contains(&square) {
            return Some(Error::BadSample { index });
        }
        let n = self.model.n() as u32;
        let used = sample.corners.iter().zip(sample.barycentric).filter(|(_, part)| *part != 0.0);
        let beyond = used.map(|(&vertex, _)| vertex).find(|&vertex| vertex >= n);
        beyond.map(|index| Error::IndexOutOfRange { index, limit: n })
    }

    /// The error of a fit as far as the reference does not look: of the arguments, in the order in which they are checked.
    pub fn fit_refused(&self) -> Option<Error> {
        if self.landmarks_only && self.extras.landmarks.is_empty() {
            return Some(Error::Unsupported { section: 3 });
        }
        let there = [self.extras.identity.is_some(), self.extras.pose.is_some()];
        let fits =
            |(&(kind, factor), there): (&(u8, f32), bool)| kind == 0 || !there || (factor > 0.0 && factor.is_finite());
        let factors_fit = self.priors.iter().zip(there).all(fits);
        let noise_fits = self.noise > 0.0 && self.noise.is_finite();
        let early = self
            .weights_refused()
            .or((!factors_fit).then_some(Error::BadOption { option: 1 }))
            .or((!noise_fits).then_some(Error::BadOption { option: 2 }))
            .or_else(|| self.first_sample_refused());
        let weighs = self.samples.iter().flatten().any(|sample| sample.weight > 0.0);
        early.or_else(|| if weighs && !self.place { self.placement_refused() } else { None })
    }

    /// Options for the reference.
    pub fn options(&self) -> Options<'_> {
        Options {
            frame: self.frame,
            place: self.place,
            identity_prior: reference_prior(&self.extras.identity, self.priors[0]),
            pose_prior: reference_prior(&self.extras.pose, self.priors[1]),
            noise: self.noise,
            limits: self.limits,
        }
    }

    /// The same options for the kernel, with the Gaussians of the opened model.
    pub fn core_options<'a>(&self, model: &Model<'a>) -> FitOptions<'a> {
        let of = |mode: Mode, (kind, factor): (u8, f32)| match (kind, model.gaussian(mode)) {
            (1, Some(gaussian)) => prior::Prior::Gaussian(gaussian, factor),
            (2, Some(gaussian)) => prior::Prior::Box(gaussian.spread(), factor),
            _ => prior::Prior::None,
        };
        let Limits { max_iterations, relative_decrease, damping } = self.limits;
        FitOptions {
            frame: self.core_frame(),
            place: self.place,
            identity_prior: of(Mode::Identity, self.priors[0]),
            pose_prior: of(Mode::Pose, self.priors[1]),
            noise: self.noise,
            limits: CoreLimits { max_iterations, relative_decrease, damping },
        }
    }

    /// The motions that are variables.
    pub fn core_frame(&self) -> habitus_core::fit::Frame {
        use habitus_core::fit::Frame as Core;
        match self.frame {
            Frame::Fixed => Core::Fixed,
            Frame::Rigid => Core::Rigid,
            Frame::Similarity => Core::Similarity,
        }
    }
}

fn reference_prior(gaussian: &Option<Gaussian>, (kind, factor): (u8, f32)) -> Prior<'_> {
    match (kind, gaussian) {
        (1, Some(gaussian)) => Prior::Gaussian(gaussian, factor),
        (2, Some(gaussian)) => Prior::Box(gaussian, factor),
        _ => Prior::None,
    }
}

/// A model whose terms come from a stream, but for those that the fuzzer sets.
fn model(choice: &Choice, n: usize, di: usize, dp: usize) -> Bilinear {
    let mut state = choice.seed;
    let mut index = 0;
    let linear = [choice.flags & 1 != 0, choice.flags & 2 != 0];
    let n_terms = 1 + di * (dp + usize::from(linear[0])) + if linear[1] { dp } else { 0 };
    let count = 3 * n * n_terms;
    let mut term = |size: u8| -> Vec<[f32; 3]> {
        let size = SIZES[usize::from(size) % SIZES.len()];
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let set = choice.coefficients.iter().find(|(at, _)| usize::from(*at) % count == index);
            index += 1;
            set.map_or(size * ((state >> 8) as f32 / (1 << 23) as f32 - 1.0), |(_, number)| number.0)
        };
        (0..n).map(|_| [number(), number(), number()]).collect()
    };
    Bilinear {
        offset: term(choice.offset_size),
        pose_linear: linear[1].then(|| (0..dp).map(|_| term(choice.term_size)).collect()),
        identity_linear: linear[0].then(|| (0..di).map(|_| term(choice.term_size)).collect()),
        bilinear: (0..di).map(|_| (0..dp).map(|_| term(choice.term_size)).collect()).collect(),
    }
}

/// Landmarks at every second vertex, and Gaussians whose matrices need not be definite.
fn extras(choice: &Choice, n: usize, di: usize, dp: usize) -> Extras {
    let within = |number: Number, limit: f32| if number.0.abs() <= limit { number.0 } else { 0.5 };
    let gaussian = |d: usize, first: usize| Gaussian {
        mean: (0..d).map(|k| within(choice.weights[first + k], MAX_WEIGHT)).collect(),
        scale: (0..d).map(|k| within(choice.weights[7 - k], f32::MAX).abs().max(1e-30)).collect(),
        precision: (0..d)
            .map(|i| (0..d).map(|j| if i == j { 2.0 } else { within(choice.weights[(i + j) % 8], 1e30) }).collect())
            .collect(),
    };
    let landmarks: Vec<u32> = if choice.seed.is_multiple_of(16) { vec![] } else { (0..n as u32).step_by(2).collect() };
    Extras {
        landmark_names: landmarks.iter().map(|k| k.to_string()).collect::<Vec<_>>().join("\n"),
        landmarks,
        identity: (choice.priors[0].0 < 240).then(|| gaussian(di, 0)),
        pose: (choice.priors[1].0 < 240).then(|| gaussian(dp, 4)),
        ..Extras::default()
    }
}

fn moved(target: [f32; 3], by: [Number; 3]) -> [f32; 3] {
    [0, 1, 2].map(|k| target[k] + by[k].0)
}

/// A target for each landmark, as far as there are choices for it.
fn at_landmarks(
    choice: &Choice,
    landmarks: &[u32],
    placement: &Placement<f32>,
    point: impl Fn(usize) -> [f32; 3],
) -> Vec<Option<Sample>> {
    let sample = |(index, &vertex): (usize, &u32)| {
        let chosen = choice.samples.get(index % choice.samples.len().max(1))?;
        (chosen.kind % 8 != 7).then(|| Sample {
            corners: [vertex, 0, 0],
            barycentric: [1.0, 0.0, 0.0],
            target: moved(placement.applied(point(vertex as usize)), chosen.target),
            normal: None,
            weight: 1.0,
        })
    };
    landmarks.iter().enumerate().map(sample).collect()
}

fn free_sample(
    choice: &SampleChoice,
    n: usize,
    placement: &Placement<f32>,
    point: impl Fn(usize) -> [f32; 3],
) -> Option<Sample> {
    let kind = choice.kind;
    if kind % 8 == 7 {
        return None;
    }
    // One vertex behind the last is a case of its own.
    let corners = choice.corners.map(|corner| usize::from(corner) % (n + usize::from(kind >= 248)));
    let barycentric = match kind % 3 {
        0 => [1.0, 0.0, 0.0],
        1 => [0.5, 0.3125, 0.1875],
        _ => choice.barycentric.map(|number| number.0),
    };
    let normal = match kind / 8 % 4 {
        0 | 1 => None,
        2 => Some(unit(choice.normal.map(|number| number.0))),
        _ => Some(choice.normal.map(|number| number.0)),
    };
    let weight = if (kind / 32).is_multiple_of(2) { choice.weight.0.abs() } else { choice.weight.0 };
    Some(Sample {
        target: moved(placement.applied(point(corners[0])), choice.target),
        corners: corners.map(|corner| corner as u32),
        barycentric,
        normal,
        weight,
    })
}

/// The direction of a vector; x for one that has none.
fn unit([x, y, z]: [f32; 3]) -> [f32; 3] {
    let length = (x * x + y * y + z * z).sqrt();
    if length > 1e-10 && length.is_finite() { [x / length, y / length, z / length] } else { [1.0, 0.0, 0.0] }
}
