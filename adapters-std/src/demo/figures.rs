//! What the demonstration measured.

use habitus_core::format::Model;
use serde::Serialize;
use serde_json::{Map, Value, json};

use super::DemoOptions;
use super::fits::{FaceFit, Found};
use super::learned::Learned;
use super::scans::UnseenScan;
use crate::measure::curves::described;
use crate::synth::face_motion::EXPRESSIONS;
use crate::synth::scanner::Label;

/// What the demonstration measured. All errors are distances between corresponding vertices, mm, against the known truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DemoFigures {
    /// The population is procedural: no person was scanned.
    pub procedural: bool,
    /// People learned from.
    pub identities: usize,
    /// Expressions of each.
    pub expressions: usize,
    /// Vertices of a face.
    pub vertices: usize,
    /// Identity weights of the model.
    pub identity_dim: usize,
    /// Expression weights of the model.
    pub expression_dim: usize,
    /// Bytes of the model file.
    pub model_bytes: usize,
    /// Seed.
    pub seed: u64,
    /// Training faces reproduced by the model.
    pub training_error_mm: f64,
    /// Unseen faces against the mean face, placed on them by least squares over all vertices: what a fit must beat.
    pub unseen_mean_face_error_mm: f64,
    /// Unseen faces fitted to 13 landmarks with 1 mm of noise per axis, in an unknown placement.
    pub unseen_landmark_fit_error_mm: f64,
    /// Unseen faces fitted to their raw scans, with the landmarks that are on them.
    pub unseen_scan_fit_error_mm: f64,
    /// The same, over the vertices that the scanner saw.
    pub unseen_scan_fit_seen_error_mm: f64,
    /// The same, over those that it did not see.
    pub unseen_scan_fit_hidden_error_mm: f64,
    /// Unseen faces fitted to all their vertices, in an unknown placement: what the model can express.
    pub unseen_point_fit_error_mm: f64,
    /// One for each unseen face.
    pub scans: Vec<ScanFigures>,
    /// People that take part in the curves of generalization and specificity.
    pub curve_identities: usize,
    /// Compactness and the curves, as `measure model` names them.
    #[serde(flatten)]
    pub quality: Map<String, Value>,
}

/// One unseen face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScanFigures {
    /// Its expression.
    pub expression: &'static str,
    /// Vertices of what was scanned.
    pub subject_vertices: usize,
    /// Triangles of what was scanned.
    pub subject_faces: usize,
    /// Views that were laid together.
    pub views: usize,
    /// Points of the scan.
    pub points: usize,
    /// Triangles of the scan.
    pub faces: usize,
    /// Points of the scan that are not of the person.
    pub clutter: usize,
    /// Flying points.
    pub outliers: usize,
    /// Share of the model's vertices that the scanner saw, %.
    pub seen_percent: f64,
    /// Landmarks that are on the scan.
    pub landmarks: usize,
    /// The mean face placed on it.
    pub mean_face_error_mm: f64,
    /// Fitted to the landmarks alone.
    pub landmark_fit_error_mm: f64,
    /// Fitted to the scan.
    pub scan_fit: ErrorFigures,
    /// Fitted to all true points.
    pub point_fit_error_mm: f64,
}

/// Errors over the vertices of a face.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ErrorFigures {
    /// Mean.
    pub mean_mm: f64,
    /// Half of the vertices are within.
    pub median_mm: f64,
    /// 95 % of the vertices are within.
    pub quantile_95_mm: f64,
    /// Largest.
    pub largest_mm: f64,
    /// Mean over the vertices that the scanner saw; none: it saw none.
    pub seen_mean_mm: Option<f64>,
    /// Mean over those that it did not see; none: it saw all.
    pub hidden_mean_mm: Option<f64>,
}

impl DemoFigures {
    pub(super) fn of(
        options: &DemoOptions,
        learned: &Learned,
        model: &Model<'_>,
        scans: &[UnseenScan],
        fits: &[FaceFit],
    ) -> Self {
        let over = |found: fn(&FaceFit) -> &Found| mean(fits.iter().map(|fit| of(&found(fit).errors))).unwrap_or(0.0);
        // Over the vertices of all faces together: some are seen nearly whole.
        let pooled = |seen: bool| mean(partial(scans, fits, seen).into_iter()).unwrap_or(0.0);
        let header = model.header();
        DemoFigures {
            procedural: true,
            identities: options.identities,
            expressions: EXPRESSIONS.len(),
            vertices: header.n_vertices as usize,
            identity_dim: header.identity_dim as usize,
            expression_dim: header.pose_dim as usize,
            model_bytes: learned.bytes.len(),
            seed: options.seed,
            training_error_mm: learned.training_error,
            unseen_mean_face_error_mm: over(|fit| &fit.mean_face),
            unseen_landmark_fit_error_mm: over(|fit| &fit.by_landmarks),
            unseen_scan_fit_error_mm: over(|fit| &fit.by_scan),
            unseen_scan_fit_seen_error_mm: pooled(true),
            unseen_scan_fit_hidden_error_mm: pooled(false),
            unseen_point_fit_error_mm: over(|fit| &fit.by_points),
            scans: scans.iter().zip(fits).map(|(scan, fit)| ScanFigures::of(scan, fit)).collect(),
            curve_identities: learned.curve_people,
            quality: quality(learned),
        }
    }
}

impl ScanFigures {
    fn of(scan: &UnseenScan, fit: &FaceFit) -> Self {
        let seen = scan.seen.iter().filter(|seen| **seen).count();
        ScanFigures {
            expression: EXPRESSIONS[scan.expression],
            subject_vertices: scan.subject[0],
            subject_faces: scan.subject[1],
            views: scan.scan.views.len(),
            points: scan.scan.mesh.positions.len(),
            faces: scan.scan.mesh.faces.len(),
            clutter: scan.scan.count(Label::Clutter),
            outliers: scan.scan.count(Label::Outlier),
            seen_percent: 100.0 * seen as f64 / scan.seen.len().max(1) as f64,
            landmarks: scan.marked.iter().filter(|marked| **marked).count(),
            mean_face_error_mm: of(&fit.mean_face.errors),
            landmark_fit_error_mm: of(&fit.by_landmarks.errors),
            scan_fit: ErrorFigures::of(&fit.by_scan.errors, &scan.seen),
            point_fit_error_mm: of(&fit.by_points.errors),
        }
    }
}

impl ErrorFigures {
    fn of(errors: &[f64], seen: &[bool]) -> Self {
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let place = (share * sorted.len() as f64).ceil() as usize;
            sorted.get(place.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        let part =
            |which: bool| mean(errors.iter().zip(seen).filter(|(_, seen)| **seen == which).map(|(error, _)| *error));
        ErrorFigures {
            mean_mm: of(errors),
            median_mm: quantile(0.5),
            quantile_95_mm: quantile(0.95),
            largest_mm: quantile(1.0),
            seen_mean_mm: part(true),
            hidden_mean_mm: part(false),
        }
    }
}

/// The errors of the fits to scans at the vertices that were seen, or at those that were not.
pub(super) fn partial(scans: &[UnseenScan], fits: &[FaceFit], seen: bool) -> Vec<f64> {
    let pairs = scans.iter().zip(fits).flat_map(|(scan, fit)| scan.seen.iter().zip(&fit.by_scan.errors));
    pairs.filter(|(is_seen, _)| **is_seen == seen).map(|(_, error)| *error).collect()
}

fn quality(learned: &Learned) -> Map<String, Value> {
    let all = &learned.compactness;
    let mut quality = Map::new();
    quality.insert(
        "compactness".into(),
        json!({ "identity_percent": all.identity.percent, "expression_percent": all.expression.percent }),
    );
    quality.extend(learned.curves.named().map(|(name, _, curve)| (name.to_owned(), described(curve))));
    quality
}

/// The mean of what is there.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

fn of(errors: &[f64]) -> f64 {
    mean(errors.iter().copied()).unwrap_or(0.0)
}
