//! What stands before the scanner: the subject, and clutter that is none of it but hides it and is seen.

use glam::DVec3;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;

use super::chance::{Purpose, between, direction, stream};
use super::options::ScanOptions;
use crate::Error;
use crate::mesh::Mesh;
use crate::spatial::{RayHit, TriangleTree};

/// Coordinates beyond this, in mm, are those of no subject: single precision in files would be coarser than a scanner.
const FARTHEST: f64 = 1e6;

/// The subject with its clutter.
#[derive(Debug)]
pub(super) struct Room<'a> {
    subject: &'a Mesh,
    tree: TriangleTree,
    /// Unit normals of all faces, those of the subject first; zero without area.
    normals: Vec<DVec3>,
    /// The middle of the subject's box.
    pub centre: DVec3,
    /// Nothing of the room is farther from there.
    pub reach: f64,
    /// Half the diagonal of the subject's box.
    pub radius: f64,
}

impl<'a> Room<'a> {
    /// The room that the options describe.
    ///
    /// # Errors
    /// [`Error::Input`] for a subject that fails [`Mesh::check`], is a cloud, or is larger than a kilometre.
    pub fn around(subject: &'a Mesh, options: &ScanOptions) -> Result<Self, Error> {
        subject.check()?;
        if subject.faces.is_empty() {
            return Err(Error::input(
                "a cloud cannot be scanned, rays pass between its points: give a mesh with triangles",
            ));
        }
        let seen = subject.faces.iter().flatten().map(|&vertex| DVec3::from_array(subject.positions[vertex as usize]));
        let (low, high) = seen.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        if !(low.abs().max(high.abs()).max_element() <= FARTHEST) {
            return Err(Error::input(format!(
                "the mesh reaches farther than {FARTHEST} mm from its origin: is its unit the one that was told?"
            )));
        }
        let (centre, radius) = (0.5 * (low + high), 0.5 * (high - low).length());
        let mut positions = subject.positions.clone();
        let mut faces = subject.faces.clone();
        if options.floor {
            put_floor(&mut positions, &mut faces, DVec3::new(centre.x, low.y, centre.z), 0.7 * radius);
        }
        let mut random = stream(options.seed, Purpose::Clutter);
        for _ in 0..options.blobs {
            let size = between(&mut random, options.blob_radius);
            let away = between(&mut random, [0.9, 1.4]) * radius;
            let at = centre + direction(&mut random) * away;
            put_blob(&mut positions, &mut faces, at, size, &mut random);
        }
        let tree = TriangleTree::new(&positions, &faces)?;
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|vertex| DVec3::from_array(positions[vertex as usize]));
            (b - a).cross(c - a).normalize_or_zero()
        };
        let normals = faces.iter().map(normal).collect();
        // Vertices that no face uses do not count.
        let squared = |vertex: &u32| (DVec3::from_array(positions[*vertex as usize]) - centre).length_squared();
        let reach = faces.iter().flatten().map(squared).fold(0.0, f64::max).sqrt();
        Ok(Room { subject, tree, normals, centre, reach, radius })
    }

    /// Where the ray first meets something.
    pub fn first_hit(&self, origin: DVec3, direction: DVec3) -> Option<RayHit> {
        self.tree.first_hit(origin.to_array(), direction.to_array(), f64::INFINITY)
    }

    /// The unit normal of a face.
    pub fn normal(&self, face: u32) -> DVec3 {
        self.normals[face as usize]
    }

    /// Whether the face is one of the subject's.
    pub fn is_subject(&self, face: u32) -> bool {
        (face as usize) < self.subject.faces.len()
    }

    /// The vertices of the subject that can be seen: those of its faces.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.subject.faces.iter().flatten().map(|&vertex| DVec3::from_array(self.subject.positions[vertex as usize]))
    }
}

/// Two triangles that face up, a square of this half width.
fn put_floor(positions: &mut Vec<[f64; 3]>, faces: &mut Vec<[u32; 3]>, middle: DVec3, half: f64) {
    let first = positions.len() as u32;
    for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)] {
        positions.push((middle + half * DVec3::new(x, 0.0, z)).to_array());
    }
    faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}

/// Rings of vertices around a blob, without its poles, and vertices in a ring.
const RINGS: usize = 11;
const SECTORS: usize = 20;

/// A ball with three bumps and dents.
fn put_blob(positions: &mut Vec<[f64; 3]>, faces: &mut Vec<[u32; 3]>, at: DVec3, size: f64, random: &mut ChaCha12Rng) {
    let waves: [(DVec3, f64); 3] =
        std::array::from_fn(|_| (3.0 * direction(random), std::f64::consts::TAU * random.random::<f64>()));
    let mut put = |d: DVec3| {
        let bumps: f64 = waves.iter().map(|(wave, phase)| (wave.dot(d) + phase).sin()).sum();
        positions.push((at + d * size * (1.0 + 0.1 * bumps)).to_array());
        positions.len() as u32 - 1
    };
    let top = put(DVec3::Y);
    for ring in 1..=RINGS {
        let (sin, cos) = (std::f64::consts::PI * ring as f64 / (RINGS + 1) as f64).sin_cos();
        for sector in 0..SECTORS {
            let (x, z) = (std::f64::consts::TAU * sector as f64 / SECTORS as f64).sin_cos();
            put(DVec3::new(sin * x, cos, sin * z));
        }
    }
    let bottom = put(-DVec3::Y);
    let vertex = |ring: usize, sector: usize| top + 1 + (ring * SECTORS + sector % SECTORS) as u32;
    for sector in 0..SECTORS {
        faces.push([top, vertex(0, sector), vertex(0, sector + 1)]);
        faces.push([bottom, vertex(RINGS - 1, sector + 1), vertex(RINGS - 1, sector)]);
        for ring in 0..RINGS - 1 {
            let [a, b] = [vertex(ring, sector), vertex(ring, sector + 1)];
            let [c, d] = [vertex(ring + 1, sector), vertex(ring + 1, sector + 1)];
            faces.extend([[a, c, d], [a, d, b]]);
        }
    }
}
