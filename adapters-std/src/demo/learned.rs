//! What the demonstration learns: the population, the model of it, and how good that is.

use super::{Clock, DemoOptions};
use crate::Error;
use crate::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use crate::face::multilinear::MultilinearModel;
use crate::face::remainder::{N_COMPONENTS, remainder};
use crate::face::tensor::ShapeTensor;
use crate::io::model::{ModelSource, hab};
use crate::measure::compactness::{Compactness, compactness};
use crate::measure::curves::Curves;
use crate::measure::vertex_error::{MeanError, mean_vertex_distances};
use crate::register::gpa::{GpaOptions, align_in_place};
use crate::synth::face_grid::LANDMARKS;
use crate::synth::face_motion::EXPRESSIONS;
use crate::synth::faces::{FaceOptions, FacePopulation};

/// Level of the grid on which the model is learned.
pub(super) const LEVEL: u32 = 4;
/// People that take part in the curves: each is left out once, which costs most of the time.
const CURVE_PEOPLE: usize = 40;
/// Random faces for each point of specificity.
const CURVE_SAMPLES: usize = 200;

/// The learned model.
pub(super) struct Learned {
    /// The model file.
    pub bytes: Vec<u8>,
    /// Training faces reproduced by the model, mm.
    pub training_error: f64,
    /// Of all training faces.
    pub compactness: Compactness,
    /// Of the first people.
    pub curves: Curves,
    /// How many of them.
    pub curve_people: usize,
}

impl Learned {
    pub fn of(options: &DemoOptions, clock: &mut Clock<'_>) -> Result<Self, Error> {
        if options.identities < 2 {
            return Err(Error::input(
                "the demonstration learns from people and leaves each out in turn: give at least two",
            ));
        }
        clock.stage("making the population", 1);
        let people =
            FacePopulation::of(&FaceOptions { identities: options.identities, seed: options.seed, level: LEVEL })?;
        clock.done(1);
        clock.stage("learning the model", 4);
        let (d2, d3, n) = (people.factors.len(), EXPRESSIONS.len(), people.grid.n_vertices());
        let mut shapes = ShapeTensor::from_array(d2, d3, n, &people.tensor)?;
        align_in_place(shapes.data_mut(), 3 * n, &GpaOptions::default())?;
        clock.done(1);
        let sizes = HosvdOptions {
            identity: ModeSize::Dimension(30.min(d2)),
            expression: ModeSize::Dimension(7.min(d3)),
            hooi: None,
        };
        let model = hosvd(&shapes, &sizes)?.model;
        clock.done(2);
        let errors = mean_vertex_distances(shapes.data(), &model.training_shapes()?, 3 * n);
        let training_error = MeanError::of(&errors).map_or(0.0, |error| error.mean);
        clock.done(3);
        let missed = remainder(&shapes, [model.identity.dim, model.expression.dim], N_COMPONENTS)?;
        let mut source = source(&model, &people, options);
        source.remainder = missed.components;
        let bytes = hab::bytes(&source)?;
        clock.done(4);

        clock.stage("measuring the model", 1);
        let curve_people = d2.min(CURVE_PEOPLE);
        let mut few = Vec::with_capacity(curve_people * d3 * 3 * n);
        for expression in 0..d3 {
            (0..curve_people).for_each(|identity| few.extend_from_slice(shapes.shape(identity, expression)));
        }
        let few = ShapeTensor::from_shapes(curve_people, d3, n, few)?;
        // Drawing random faces takes a tenth of the time.
        let clock = std::cell::RefCell::new(clock);
        let curves = Curves::of(
            &few,
            CURVE_SAMPLES,
            options.seed,
            &mut |done, total| clock.borrow_mut().told(9 * done, 10 * total),
            &mut |done, total| clock.borrow_mut().told(9 * total + done, 10 * total),
        )?;
        Ok(Learned { bytes, training_error, compactness: compactness(&model), curves, curve_people })
    }
}

fn source<'a>(model: &'a MultilinearModel, people: &FacePopulation, options: &DemoOptions) -> ModelSource<'a> {
    let mut source = ModelSource::of_multilinear(model);
    source.faces = people.faces.clone();
    source.landmarks = people.landmarks.to_vec();
    source.landmark_names = LANDMARKS.map(str::to_owned).to_vec();
    source.mirror = people.mirror.clone();
    source.pose_names = EXPRESSIONS.map(str::to_owned).to_vec();
    source.provenance = format!(
        "habitus {} demo; a procedural population of {} people (seed {}): no person was scanned",
        env!("CARGO_PKG_VERSION"),
        options.identities,
        options.seed
    );
    source
}
