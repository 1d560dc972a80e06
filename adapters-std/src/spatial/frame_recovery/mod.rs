//! In which unit a scan is stored and which way is up and front, told by a template; or why that cannot be told.
//!
//! The unit is the one in which the scan is about as large as the template. The axes are found by laying the scan on the
//! template from each of the 24 rotations between axes (`besl1992`): the one that ends with the smallest residual counts, if
//! the residual is small and the second-best rotation is clearly worse. The same is done with the mirror image of the scan.

mod fit;
mod report;
#[cfg(test)]
mod tests;
mod turns;
mod unit;

pub use turns::AxisTurn;
pub use unit::{SizeCandidate, Unit};

use habitus_core::rotation::similarity::Similarity;
use rayon::prelude::*;

use crate::Error;
use crate::mesh::Mesh;
use fit::{Effort, Fit, Points, fit, normals_agree, start};

/// Alignments from all rotations, each harder than the one before, and how many rotations, of the scan and of its mirror
/// image, go on to the next.
const ROUNDS: [(Effort, usize); 3] = [
    (Effort { n_points: 60, max_steps: 8, settled: 5e-3 }, 10),
    (Effort { n_points: 120, max_steps: 20, settled: 2e-3 }, 4),
    (FINE, 4),
];
const FINE: Effort = Effort { n_points: 300, max_steps: 40, settled: 3e-4 };
/// What two rotations get that are not told apart by then.
const FINEST: Effort = Effort { n_points: 400, max_steps: 150, settled: 1e-6 };
/// The mirror image must fit this much better than the scan for the scan to count as mirrored, and the scan this much better
/// than its mirror image to count as not: no person is quite symmetric.
const MIRROR_SEPARATION: f64 = 0.8;
/// Residuals that differ by less than this part of the spacing of the points are equal: a ball laid on itself leaves residuals of a
/// spacing in any rotation, which differ by some hundredths.
const NOISE: f64 = 0.1;
/// Normals agree, or are opposite, when at least this part of them does.
const MOST_NORMALS: f64 = 0.75;

/// When a frame counts as found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameOptions {
    /// The unit, where it is known.
    pub unit: Option<Unit>,
    /// Smallest and largest diagonal of the scan's bounding box, in those of the template's.
    pub size_window: [f64; 2],
    /// Largest residual, in diagonals of the template.
    pub max_residual: f64,
    /// Largest residual, in residuals of the second-best rotation.
    pub separation: f64,
}

impl Default for FrameOptions {
    /// In the window of 0.6 to 1.5 no two units fit at once. Scans of other people leave residuals of up to 0.012 diagonals and
    /// 0.92 of the second-best rotation (`tests/tests/frames.rs`).
    fn default() -> Self {
        FrameOptions { unit: None, size_window: [0.6, 1.5], max_residual: 0.015, separation: 0.95 }
    }
}

/// Whether a scan is told from its mirror image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handedness {
    /// Its shape fits clearly better than its mirror image.
    ByShape,
    /// Its shape is about symmetric, but its normals point to the same side as those of the template.
    ByNormals,
    /// Its shape is about symmetric and it has no normals: it may be mirrored.
    Unknown,
}

/// The frame of a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// The unit of its coordinates.
    pub unit: Unit,
    /// Which of its axes are left, up and front.
    pub turn: AxisTurn,
    /// From the scan as stored to the template, mm: the unit as scale, the turn and what the scan is turned beyond it, the
    /// translation. Good to some degrees, as far as the two shapes are alike.
    pub motion: Similarity<f64>,
    /// Mean of the residuals of scan and template, mm.
    pub residual: f64,
    /// Whether the scan is told from its mirror image.
    pub handedness: Handedness,
}

impl Frame {
    /// The mesh in millimetres and with y up and z to the front: positions scaled and turned, normals turned, nothing moved.
    pub fn restored(&self, mesh: &Mesh) -> Mesh {
        let scale = self.unit.millimetres();
        Mesh {
            positions: mesh.positions.iter().map(|p| self.turn.applied(p.map(|x| x * scale))).collect(),
            normals: mesh.normals.iter().map(|n| self.turn.applied(*n)).collect(),
            ..mesh.clone()
        }
    }
}

/// A rotation and how well the scan fits with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameCandidate {
    /// The rotation between axes that is nearest to the motion.
    pub turn: AxisTurn,
    /// Whether it is the mirror image of the scan (in x) that was moved.
    pub mirrored: bool,
    /// From the scan in millimetres (or its mirror image) to the template.
    pub motion: Similarity<f64>,
    /// The angle by which the motion differs from the turn, degrees.
    pub off_axes: f64,
    /// Mean distance of the nearest 80 % of the scan from the template, mm.
    pub of_scan: f64,
    /// Mean distance of the nearest 60 % of the template from the scan, mm.
    pub of_template: f64,
}

impl FrameCandidate {
    /// The mean of both residuals, mm.
    pub fn residual(&self) -> f64 {
        0.5 * (self.of_scan + self.of_template)
    }
}

/// All that was found out about the frame of a scan. Its `Display` is a table.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameRecovery {
    /// The sizes in all units.
    pub sizes: Vec<SizeCandidate>,
    /// The best rotations and the best ones of the mirror image, the smallest residual first; empty when the unit is not known.
    pub candidates: Vec<FrameCandidate>,
    /// Part of the normals of the scan that agree with the template, where both have normals.
    pub normals_agree: Option<f64>,
    /// The frame, or the reason why there is none.
    pub outcome: Result<Frame, String>,
}

impl FrameRecovery {
    /// The frame.
    ///
    /// # Errors
    /// [`Error::Input`] with the reason and all candidates.
    pub fn frame(&self) -> Result<Frame, Error> {
        self.outcome.clone().map_err(|reason| Error::input(format!("{reason}\n{}", self.table())))
    }
}

/// A template, prepared for any number of scans.
pub struct FrameTemplate {
    points: Points,
    diagonal: f64,
}

impl FrameTemplate {
    /// Prepares a mesh or a cloud in millimetres, y up, z to the front.
    ///
    /// # Errors
    /// Those of [`Mesh::check`]; [`Error::Input`] for a template without extent.
    pub fn new(template: &Mesh) -> Result<Self, Error> {
        let diagonal = diagonal(template, "template")?;
        Ok(FrameTemplate { points: Points::new(template, 1.0, FINE.n_points, 1)?, diagonal })
    }

    /// The unit and the axes of a scan, with all that speaks for them and against them.
    ///
    /// A refusal is no error here; see [`FrameRecovery::frame`]. It names two units that fit or none, a residual above the
    /// limit, a second rotation that fits about as well (a ball, a cube), a mirror image that fits clearly better, or normals
    /// opposite to those of the template.
    ///
    /// Cost: about a quarter of a million searches for a nearest point. Determinism: the same result for any number of threads.
    ///
    /// # Errors
    /// Those of [`Mesh::check`]; [`Error::Input`] for a scan without extent or faces without area.
    pub fn recovery(&self, scan: &Mesh, options: &FrameOptions) -> Result<FrameRecovery, Error> {
        let sizes = unit::sizes(diagonal(scan, "scan")?, self.diagonal, options.size_window);
        let mut recovery =
            FrameRecovery { sizes, candidates: Vec::new(), normals_agree: None, outcome: Err(String::new()) };
        let fitting: Vec<Unit> = recovery.sizes.iter().filter(|size| size.fits).map(|size| size.unit).collect();
        let unit = match (options.unit, &fitting[..]) {
            (Some(unit), _) | (None, &[unit]) => unit,
            (None, several) => {
                recovery.outcome = Err(format!(
                    "the unit of the scan cannot be told: it is as large as the template in {}; give the unit",
                    if several.is_empty() { "none" } else { "more than one" }
                ));
                return Ok(recovery);
            }
        };
        let points = Points::new(scan, unit.millimetres(), FINE.n_points, 2)?;
        let mirrored = points.mirrored()?;
        let mut candidates = self.candidates(&points, false, options.separation);
        let reflected = self.candidates(&mirrored, true, options.separation);
        recovery.normals_agree =
            candidates.first().and_then(|best| normals_agree(&points, &self.points, &best.motion, FINE.n_points));
        let noise = NOISE * points.spacing().max(self.points.spacing());
        recovery.outcome = self.judged(unit, &candidates, &reflected, recovery.normals_agree, noise, options);
        candidates.extend(reflected);
        candidates.sort_by(|a, b| a.residual().total_cmp(&b.residual()));
        recovery.candidates = candidates;
        Ok(recovery)
    }

    /// The best rotations, the smallest residual first, each between other axes.
    fn candidates(&self, scan: &Points, mirrored: bool, separation: f64) -> Vec<FrameCandidate> {
        let mut motions: Vec<Similarity<f64>> =
            AxisTurn::all().iter().map(|turn| start(scan, &self.points, turn.matrix())).collect();
        let mut best = Vec::new();
        for (effort, n_kept) in ROUNDS {
            best = self.improved(scan, &motions, mirrored, effort);
            best.truncate(n_kept);
            motions = best.iter().map(|candidate| candidate.motion).collect();
        }
        if let [first, second, rest @ ..] = &best[..]
            && !(first.residual() <= separation * second.residual())
        {
            let mut polished = self.improved(scan, &motions[..2], mirrored, FINEST);
            polished.extend_from_slice(rest);
            best = best_of_each_turn(polished);
        }
        best
    }

    /// What the motions become, the smallest residual first, each between other axes.
    fn improved(
        &self,
        scan: &Points,
        motions: &[Similarity<f64>],
        mirrored: bool,
        effort: Effort,
    ) -> Vec<FrameCandidate> {
        let candidate = |from: &Similarity<f64>| {
            let Fit { motion, of_scan, of_template } = fit(scan, &self.points, *from, effort);
            let (turn, off_axes) = AxisTurn::nearest(&motion.rotation);
            FrameCandidate { turn, mirrored, motion, off_axes, of_scan, of_template }
        };
        best_of_each_turn(motions.par_iter().map(candidate).collect())
    }

    fn judged(
        &self,
        unit: Unit,
        candidates: &[FrameCandidate],
        reflected: &[FrameCandidate],
        normals: Option<f64>,
        noise: f64,
        options: &FrameOptions,
    ) -> Result<Frame, String> {
        let (Some(best), Some(mirror)) = (candidates.first(), reflected.first()) else {
            return Err("the axes of the scan cannot be told: no rotation was tried; please report it".into());
        };
        let residual = best.residual();
        if mirror.residual() < MIRROR_SEPARATION * residual {
            return Err(
                "the scan seems to be mirrored: its mirror image fits the template clearly better; reflect it in one \
                        axis, or give a scan of the template's kind"
                    .into(),
            );
        }
        let limit = options.max_residual * self.diagonal;
        if !(residual <= limit) {
            return Err(format!(
                "the axes of the scan cannot be told: the best rotation leaves a residual of {residual:.3} mm, the limit is \
                 {limit:.3} mm; is it a scan of the template's kind, in the right unit and without much clutter?"
            ));
        }
        if let Some(second) = candidates.get(1)
            && !(residual <= options.separation * second.residual() && residual + noise <= second.residual())
        {
            return Err(format!(
                "the axes of the scan cannot be told: two rotations fit about as well ({}; {}); turn the scan by hand",
                best.turn, second.turn
            ));
        }
        let handedness = match normals {
            _ if residual < MIRROR_SEPARATION * mirror.residual() => Handedness::ByShape,
            Some(part) if part >= MOST_NORMALS => Handedness::ByNormals,
            Some(part) if part <= 1.0 - MOST_NORMALS => {
                return Err(
                    "the scan is mirrored or inside out: its normals are opposite to those of the template; reflect \
                            it in one axis, or flip its faces"
                        .into(),
                );
            }
            _ => Handedness::Unknown,
        };
        let motion = Similarity { scale: unit.millimetres(), ..best.motion };
        Ok(Frame { unit, turn: best.turn, motion, residual, handedness })
    }
}

/// The best of the fits near each turn, the smallest residual first.
fn best_of_each_turn(mut fits: Vec<FrameCandidate>) -> Vec<FrameCandidate> {
    fits.sort_by(|a, b| a.residual().total_cmp(&b.residual()));
    let mut best: Vec<FrameCandidate> = Vec::new();
    for fit in fits {
        if best.iter().all(|better| better.turn != fit.turn) {
            best.push(fit);
        }
    }
    best
}

fn diagonal(mesh: &Mesh, what: &str) -> Result<f64, Error> {
    mesh.check()?;
    let diagonal = mesh
        .bounding_box()
        .map_or(0.0, |(low, high)| glam::DVec3::from_array(low).distance(glam::DVec3::from_array(high)));
    if !(diagonal > 0.0 && diagonal.is_finite()) {
        return Err(Error::input(format!(
            "a {what} of size {diagonal}: give one with different, not too large points"
        )));
    }
    Ok(diagonal)
}
