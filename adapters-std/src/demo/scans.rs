//! Raw scans of people that the model has not seen, in a topology that it does not have, with their truth in its own.

use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, Normal};

use super::learned::LEVEL;
use super::{Clock, DemoOptions};
use crate::Error;
use crate::mesh::Mesh;
use crate::mesh::decimation::{DecimationOptions, decimated};
use crate::register::rigid::Similarity;
use crate::spatial::PointTree;
use crate::synth::face_motion::EXPRESSIONS;
use crate::synth::faces::{FaceOptions, FacePopulation};
use crate::synth::scanner::{Label, Scan, ScanOptions, Viewpoint, scanned};

/// Triangles of what is scanned: a finer grid than the model's, decimated to about as many.
const SUBJECT_FACES: usize = 16_000;
/// Standard deviation of the landmarks per axis, mm.
pub(super) const LANDMARK_NOISE: f64 = 1.0;
/// A vertex was seen when a true place of a scanned point is so near, mm: a pixel and a half.
const SEEN: f64 = 2.7;
/// Fewest landmarks that are marked, even if hidden ones must be guessed.
const FEWEST_LANDMARKS: usize = 6;

/// A scan of one unseen person with one expression.
pub(super) struct UnseenScan {
    /// Index of the expression.
    pub expression: usize,
    /// The truth on the vertices of the model, in the frame of the scan, with colours.
    pub truth: Mesh,
    /// Vertices and triangles of what was scanned.
    pub subject: [usize; 2],
    /// The scan: its own points and triangles.
    pub scan: Scan,
    /// Whether each vertex of the model was seen by the scanner.
    pub seen: Vec<bool>,
    /// Where all landmarks were marked, in the frame of the scan.
    pub landmarks: Vec<[f64; 3]>,
    /// Which of them are on the scan.
    pub marked: Vec<bool>,
}

impl UnseenScan {
    /// One scan of each unseen person, each with another expression.
    pub fn all(options: &DemoOptions, clock: &mut Clock<'_>) -> Result<Vec<Self>, Error> {
        clock.stage("scanning unseen people", options.unseen);
        let of_level = |level| {
            let seed = options.seed.wrapping_add(1);
            FacePopulation::of(&FaceOptions { identities: options.unseen, seed, level })
        };
        let (people, fine) = (of_level(LEVEL)?, of_level(LEVEL + 1)?);
        let mut stream = ChaCha12Rng::seed_from_u64(options.seed.wrapping_add(2));
        let scan = |person: usize| {
            let scan = UnseenScan::of(&people, &fine, person, options.seed, &mut stream);
            clock.done(person + 1);
            scan
        };
        (0..options.unseen).map(scan).collect()
    }

    fn of(
        people: &FacePopulation,
        fine: &FacePopulation,
        person: usize,
        seed: u64,
        stream: &mut ChaCha12Rng,
    ) -> Result<Self, Error> {
        let expression = person % EXPRESSIONS.len();
        let face = |of: &FacePopulation| {
            of.mesh(person, expression).ok_or_else(|| Error::Internal("no such procedural face".into()))
        };
        let subject = decimated(&face(fine)?, &DecimationOptions::to_faces(SUBJECT_FACES))?.mesh;
        let scan = scanned(&subject, &scanner(person, seed))?;
        let mut truth = face(people)?;
        truth.positions.iter_mut().for_each(|point| *point = scan.placement.point(*point));
        let places: Vec<[f64; 3]> =
            scan.truth.iter().flatten().map(|at| scan.placement.point(at.position(&subject))).collect();
        let near = PointTree::new(&places)?.nearest_all(&truth.positions);
        let seen: Vec<bool> = near.iter().map(|near| near.distance <= SEEN).collect();
        let noise = Normal::new(0.0, LANDMARK_NOISE).map_err(|error| Error::Internal(error.to_string()))?;
        let vertices = people.landmarks.map(|vertex| vertex as usize);
        let landmarks = vertices.map(|vertex| truth.positions[vertex].map(|x| x + noise.sample(stream))).to_vec();
        let mut marked: Vec<bool> = vertices.iter().map(|&vertex| seen[vertex]).collect();
        if marked.iter().filter(|marked| **marked).count() < FEWEST_LANDMARKS {
            marked.fill(true);
        }
        let subject = [subject.positions.len(), subject.faces.len()];
        Ok(UnseenScan { expression, truth, subject, scan, seen, landmarks, marked })
    }

    /// A mesh in the frame of the scan, upright.
    pub fn upright(&self, mesh: &Mesh) -> Mesh {
        let placement: &Similarity = &self.scan.placement;
        Mesh {
            positions: mesh.positions.iter().map(|p| placement.inverse_point(*p)).collect(),
            normals: Vec::new(),
            ..mesh.clone()
        }
    }

    /// The scan without what is not of the person, upright: for pictures beside others.
    pub fn upright_person(&self) -> Mesh {
        let mesh = &self.scan.mesh;
        let labels = mesh.attributes.first().map_or(&[][..], |labels| &labels.values);
        let is_person = |vertex: &u32| labels.get(*vertex as usize) == Some(&f64::from(Label::Surface as u8));
        let faces: Vec<[u32; 3]> = mesh.faces.iter().filter(|face| face.iter().all(is_person)).copied().collect();
        let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        let mut place = vec![0_u32; mesh.positions.len()];
        used.iter().zip(0..).for_each(|(&old, new)| place[old as usize] = new);
        let faces = faces.into_iter().map(|face| face.map(|vertex| place[vertex as usize])).collect();
        let person = Mesh { attributes: Vec::new(), ..mesh.rearranged(&used, faces) };
        self.upright(&person)
    }
}

/// Scanners differ: one view from the side, two, or three; some have things in the way; none stands where the model does.
fn scanner(person: usize, seed: u64) -> ScanOptions {
    let views = match person % 3 {
        0 => Viewpoint::on_arc(2, 70.0),
        1 => Viewpoint::on_arc(3, 110.0),
        _ => vec![Viewpoint { yaw_deg: 28.0, pitch_deg: 6.0 }],
    };
    ScanOptions {
        views,
        blobs: if person % 4 == 3 { 2 } else { 0 },
        placement_turn_deg: 35.0,
        placement_shift: 400.0,
        seed: seed.wrapping_mul(1000).wrapping_add(person as u64),
        ..ScanOptions::default()
    }
}
