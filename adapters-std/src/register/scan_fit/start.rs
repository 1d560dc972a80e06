//! Where a fit begins: unit and placement of the scan from its landmarks, and the sides of the landmarks.

use habitus_core::fit::{Frame, Sample, SurfacePoint};
use habitus_core::format::{Kind, Model};
use habitus_core::generator::any::AnyGenerator;
use habitus_core::rotation::similarity::Similarity;

use super::held::Held;
use super::problem::{Belief, improved, widened};
use super::state::{Priors, State};
use super::suspects::{self, EXCHANGED, figure, lie_off};
use super::target::Region;
use crate::Error;
use crate::mesh::LARGEST_COORDINATE;
use crate::register::rigid::alignment;
use crate::spatial::frame_recovery::Unit;

/// Landmarks that a start needs.
pub(super) const FEWEST: usize = 4;
/// Smallest and largest size of the landmarks, in those of the model's mean: no two units fit at once.
const SIZES: [f64; 2] = [0.7, 1.4];
/// Units that are tried.
const UNITS: [Unit; 4] = [Unit::Millimetre, Unit::Centimetre, Unit::Metre, Unit::Inch];
/// Largest root mean square residual of the landmarks after the start, mm.
pub(super) const MOST_RESIDUAL: f64 = 12.0;

/// A landmark of the model and where the scan has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Landmark {
    /// Vertex of the model.
    pub vertex: u32,
    /// Position, mm, about the centre of the region.
    pub position: [f64; 3],
}

/// The beginning of a fit.
pub(super) struct Start {
    pub unit: Unit,
    pub region: Region,
    pub landmarks: Vec<Landmark>,
    pub state: State,
    /// Root mean square residual of the landmarks, mm.
    pub residual: f64,
}

impl Start {
    /// From landmarks in the order of the model, in the unit of the scan (`None`: not marked).
    pub(super) fn new(
        model: &Model<'_>,
        priors: &Priors,
        landmarks: &[Option<[f64; 3]>],
        unit: Option<Unit>,
        sigma: f64,
    ) -> Result<Self, Error> {
        let vertices = model.landmarks().ok_or_else(|| {
            Error::input("the model has no landmarks, so it cannot be placed in a scan; train it with --landmarks")
        })?;
        if vertices.len() != landmarks.len() {
            return Err(Error::input(format!(
                "{} landmarks were given; the model has {}: give one for each, or none where it was not marked",
                landmarks.len(),
                vertices.len()
            )));
        }
        let marked: Vec<(usize, [f64; 3])> =
            landmarks.iter().enumerate().filter_map(|(k, position)| Some((k, (*position)?))).collect();
        if marked.len() < FEWEST {
            return Err(Error::input(format!(
                "{} landmarks do not place a scan; give at least {FEWEST}",
                marked.len()
            )));
        }
        let names: Vec<&str> = model.landmark_names().map(|names| names.iter().collect()).unwrap_or_default();
        let name = |at: usize| {
            let k = marked.get(at).map_or(at, |&(k, _)| k);
            names.get(k).map_or_else(|| format!("{k} (counted from 0)"), |name| (*name).to_owned())
        };
        // NaN is no such place either.
        let is_place = |position: &[f64; 3]| position.iter().all(|x| x.abs() <= LARGEST_COORDINATE);
        if let Some(at) = marked.iter().position(|(_, position)| !is_place(position)) {
            let what =
                if marked[at].1.iter().all(|x| x.is_finite()) { "too far away to be a place" } else { "not finite" };
            return Err(Error::input(format!("the landmark {} is {what}: mark it anew, or leave it out", name(at))));
        }
        let held = Held::new(&bilinear(model)?, &priors.mean_state(), 0)?;
        let mean = held.positions();
        let of_model = |k: usize| vertices.get(k).and_then(|v| mean.get(v as usize)).copied().unwrap_or_default();
        let places: Vec<[f64; 3]> = marked.iter().map(|&(k, _)| of_model(k)).collect();
        let raw: Vec<[f64; 3]> = marked.iter().map(|&(_, position)| position).collect();
        let source = places.as_flattened().to_vec();
        let sizes = suspects::size(&places, &raw);
        let wild = suspects::wild(&sizes);
        let tame = |points: &[[f64; 3]]| -> Vec<f64> {
            points.iter().enumerate().filter(|(at, _)| !wild.contains(at)).flat_map(|(_, p)| *p).collect()
        };
        let named = |error: Error| Error::input(format!("the landmarks do not place the scan: {error}"));
        alignment(&tame(&places), &tame(&raw), None, true).map_err(named)?;
        let unit = fitting_unit(sizes.0, unit)?;
        let unit_mm = unit.millimetres();
        suspects::refuse_wild(&name, &places, &raw, unit_mm, &wild)?;

        let n = marked.len() as f64;
        let centre: [f64; 3] = std::array::from_fn(|axis| marked.iter().map(|(_, p)| p[axis]).sum::<f64>() / n);
        let position = |p: [f64; 3]| std::array::from_fn(|axis| (p[axis] - centre[axis]) * unit_mm);
        let target: Vec<f64> = marked.iter().flat_map(|&(_, p)| position(p)).collect();
        let (placed, as_given) = robust_alignment(&source, &target)?;
        let sides = with_exchanged_sides(model, &marked, &of_model, &target)?;
        suspects::refuse_exchanged(&name, &places, target.as_chunks::<3>().0, as_given, sides)?;
        refuse_exchanged_sides(as_given, sides)?;

        let landmarks: Vec<Landmark> = marked
            .iter()
            .map(|&(k, p)| Landmark { vertex: vertices.get(k).unwrap_or(0), position: position(p) })
            .collect();
        let mut state = priors.mean_state();
        state.placement = placed;
        let all = bilinear(model)?;
        let belief = Belief { of_weights: priors, factors: [1.0; 2], smooth: &[] };
        for _ in 0..4 {
            let held = Held::new(&all, &state, usize::MAX)?;
            let samples = landmark_samples(&held, &landmarks, &state.placement, sigma);
            state = improved(&held, &samples, belief, Frame::Rigid, &state, 5)?;
        }
        let held = Held::new(&all, &state, 0)?;
        let distances = residuals(&held, &landmarks, &state.placement);
        let residual = rms(&distances);
        if !(residual <= MOST_RESIDUAL) {
            return Err(far_landmarks(&name, &distances, residual));
        }
        let radius = 1.2 * farthest(&mean, &source);
        let front = state.placement.rotation.map(|row| f64::from(row[2]));
        Ok(Start { unit, region: Region { unit_mm, centre, radius, front }, landmarks, state, residual })
    }
}

/// The error of landmarks that no face of the model has; it names the one that lies off when the others do not.
fn far_landmarks(name: &dyn Fn(usize) -> String, distances: &[f64], residual: f64) -> Error {
    let farthest = (0..distances.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
    let others: Vec<f64> =
        distances.iter().enumerate().filter(|&(k, _)| k != farthest).map(|(_, &distance)| distance).collect();
    if rms(&others) <= MOST_RESIDUAL / 2.0
        && let Some(&far) = distances.get(farthest)
    {
        return lie_off(&[(name(farthest), far)], rms(&others));
    }
    Error::input(format!(
        "the landmarks are {} mm (root mean square) from those of any face of the model, at most {MOST_RESIDUAL} are accepted: \
         are they in the right order, on a scan of the model's kind?",
        figure(residual, 1)
    ))
}

/// `Ok` for a model of the kind that scans are fitted with.
///
/// # Errors
/// [`Error::Input`] for another.
pub fn expect_bilinear(model: &Model<'_>) -> Result<(), Error> {
    let kind = model.header().kind;
    if kind == Kind::Bilinear {
        return Ok(());
    }
    Err(Error::input(format!(
        "the model is of the kind {kind:?}; scans are fitted with bilinear models, which habitus train face makes"
    )))
}

/// The generator of a bilinear model, however its coefficients are stored.
pub(super) fn bilinear<'a>(model: &Model<'a>) -> Result<AnyGenerator<'a>, Error> {
    expect_bilinear(model)?;
    model.generator().map_err(|error| Error::Kernel { what: "the model cannot be evaluated".into(), error })
}

/// Samples of the landmarks with the standard deviation `sigma` (mm per axis), less for those that lie far off.
pub(super) fn landmark_samples(
    held: &Held,
    landmarks: &[Landmark],
    placement: &Similarity<f32>,
    sigma: f64,
) -> Vec<Sample> {
    let far = residuals(held, landmarks, placement);
    let limit = 4.0 * sigma;
    landmarks
        .iter()
        .zip(far)
        .map(|(landmark, residual)| {
            let robust = limit * limit / (limit * limit + residual * residual);
            Sample {
                point: SurfacePoint::vertex(landmark.vertex),
                target: landmark.position.map(|x| x as f32),
                normal: None,
                weight: (robust * robust / (sigma * sigma)) as f32,
            }
        })
        .collect()
}

/// Distances of the landmarks from those of the model, mm.
pub(super) fn residuals(held: &Held, landmarks: &[Landmark], placement: &Similarity<f32>) -> Vec<f64> {
    let (positions, place) = (held.positions(), widened(placement));
    let residual = |landmark: &Landmark| {
        let p = place.applied(positions.get(landmark.vertex as usize).copied().unwrap_or_default());
        glam::DVec3::from_array(p).distance(glam::DVec3::from_array(landmark.position))
    };
    landmarks.iter().map(residual).collect()
}

/// Standard deviation per axis of which `distances` are the lengths, from their median; single large ones do not change it.
pub(super) fn spread(distances: &[f64]) -> f64 {
    /// Median length of three independent normal deviates.
    const MEDIAN: f64 = 1.538;
    let mut sorted = distances.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) / MEDIAN
}

/// Root mean square.
pub(super) fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// The unit in which the landmarks are about as large as the model's; `size` is their size in the unit of the scan.
fn fitting_unit(size: f64, declared: Option<Unit>) -> Result<Unit, Error> {
    let ratio = |unit: Unit| size * unit.millimetres();
    let fits = |unit: &Unit| (SIZES[0]..=SIZES[1]).contains(&ratio(*unit));
    match declared {
        Some(unit) if fits(&unit) => Ok(unit),
        Some(unit) => Err(Error::input(format!(
            "in {} the landmarks are {} times as large as the model's, {} to {} are accepted: is the unit right, is it a scan of the model's kind?",
            called(unit),
            figure(ratio(unit), 3),
            SIZES[0],
            SIZES[1]
        ))),
        None => UNITS.into_iter().find(fits).ok_or_else(|| {
            let all: Vec<String> = UNITS.iter().map(|&u| format!("{} in {}", figure(ratio(u), 3), called(u))).collect();
            Error::input(format!(
                "the unit of the scan cannot be told: its landmarks are {} times as large as the model's; give --unit, or a scan of the model's kind",
                all.join(", ")
            ))
        }),
    }
}

/// The unit in a sentence, where its symbol may be mistaken for a word.
fn called(unit: Unit) -> &'static str {
    if unit == Unit::Inch { "inches" } else { unit.symbol() }
}

/// The rigid motion of `source` onto `target` in which single landmarks that lie far off count less, and the root mean square residual.
pub(super) fn robust_alignment(source: &[f64], target: &[f64]) -> Result<(Similarity<f32>, f64), Error> {
    let mut weights = vec![1.0; source.len() / 3];
    let mut distances = Vec::new();
    let mut found = alignment(source, target, None, false)?;
    for _ in 0..5 {
        distances = source
            .as_chunks::<3>()
            .0
            .iter()
            .zip(target.as_chunks::<3>().0)
            .map(|(p, q)| glam::DVec3::from_array(found.point(*p)).distance(glam::DVec3::from_array(*q)))
            .collect::<Vec<f64>>();
        let scale = 2.0 * rms(&distances).max(3.0);
        weights.iter_mut().zip(&distances).for_each(|(w, d)| *w = (scale * scale / (scale * scale + d * d)).powi(2));
        found = alignment(source, target, Some(&weights), false)?;
    }
    let single = Similarity {
        scale: 1.0,
        rotation: found.rotation.map(|row| row.map(|x| x as f32)),
        translation: found.translation.map(|x| x as f32),
    };
    Ok((single, rms(&distances)))
}

/// Refuses landmarks that fit clearly better with left and right exchanged.
fn refuse_exchanged_sides(as_given: f64, exchanged: f64) -> Result<(), Error> {
    if exchanged < EXCHANGED * as_given {
        return Err(Error::input(format!(
            "left and right of the landmarks seem to be exchanged: they are {as_given:.1} mm (root mean square) from the model's as given and \
             {exchanged:.1} mm with the sides exchanged; left is the subject's left (+x)"
        )));
    }
    Ok(())
}

/// How well the landmarks fit with left and right exchanged, mm (root mean square); infinite where their names do not tell the sides.
fn with_exchanged_sides(
    model: &Model<'_>,
    marked: &[(usize, [f64; 3])],
    of_model: &dyn Fn(usize) -> [f64; 3],
    target: &[f64],
) -> Result<f64, Error> {
    let Some(names) = model.landmark_names() else { return Ok(f64::INFINITY) };
    let names: Vec<&str> = names.iter().collect();
    let other = |k: usize| {
        let name = names.get(k)?;
        let exchanged = match name.split_once("left") {
            Some((before, behind)) => format!("{before}right{behind}"),
            None => name.replacen("right", "left", 1),
        };
        names.iter().position(|name| *name == exchanged)
    };
    let sources: Option<Vec<[f64; 3]>> = marked.iter().map(|&(k, _)| Some(of_model(other(k)?))).collect();
    let Some(sources) = sources else { return Ok(f64::INFINITY) };
    Ok(robust_alignment(sources.as_flattened(), target)?.1)
}

/// Distance of the farthest vertex from the middle of the landmarks.
fn farthest(mean: &[[f64; 3]], landmarks: &[f64]) -> f64 {
    let points = landmarks.as_chunks::<3>().0;
    let middle = points.iter().map(|p| glam::DVec3::from_array(*p)).sum::<glam::DVec3>() / points.len().max(1) as f64;
    mean.iter().map(|p| middle.distance(glam::DVec3::from_array(*p))).fold(0.0, f64::max)
}

#[cfg(test)]
#[path = "start_tests.rs"]
mod tests;
