//! `synth faces`: a population of procedural faces in exact correspondence.
//!
//! A person is a vector of latent factors ([`drawn_factors`]); a face is a person with an expression
//! ([`face_positions`]); a [`FacePopulation`] is the registered tensor of many of them with topology, landmarks and
//! mirror map, everything that training a multilinear model asks for.

use super::face_colour::colour;
use super::face_grid::{FaceGrid, Node};
use super::face_motion::{EXPRESSIONS, Motion};
use super::face_shape::{FaceShape, N_FACTORS};
use super::face_surface::{Rest, follows_lids};
use crate::Error;
use crate::mesh::Mesh;
use rand::SeedableRng;
use rand_chacha::ChaCha12Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Latent factors are drawn again beyond this many standard deviations, so that no face is a monster.
pub const FACTOR_LIMIT: f64 = 2.2;

/// Index of the factor by which left and right act unlike.
const ONE_SIDED: usize = 30;

/// What population to make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceOptions {
    /// Number of people.
    pub identities: usize,
    /// Seed of the generator; person k of a seed is the same whatever the number of people.
    pub seed: u64,
    /// Level of the grid, see [`FaceGrid::of_level`].
    pub level: u32,
}

impl Default for FaceOptions {
    fn default() -> Self {
        FaceOptions { identities: 60, seed: 1, level: 4 }
    }
}

/// Faces of several people with several expressions, on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct FacePopulation {
    /// The grid.
    pub grid: FaceGrid,
    /// Positions in mm, `[identity, expression, vertex, 3]`.
    pub tensor: Vec<f32>,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
    /// Vertices of the landmarks, in the order of [`LANDMARKS`](super::face_grid::LANDMARKS).
    pub landmarks: [u32; 13],
    /// The vertex of the other side, for every vertex.
    pub mirror: Vec<u32>,
    /// Latent factors of each person, in the order of [`IDENTITY_FACTORS`](super::face_shape::IDENTITY_FACTORS).
    pub factors: Vec<[f64; N_FACTORS]>,
}

impl FacePopulation {
    /// Draws the people and makes all their faces.
    pub fn of(options: &FaceOptions) -> Result<Self, Error> {
        if options.identities == 0 {
            return Err(Error::input("a population needs at least one identity"));
        }
        let grid = FaceGrid::of_level(options.level)?;
        let mut stream = ChaCha12Rng::seed_from_u64(options.seed);
        let factors: Vec<_> = (0..options.identities).map(|_| drawn_factors(&mut stream)).collect();
        let nodes = grid.nodes();
        let motions = (0..EXPRESSIONS.len()).map(average_motion).collect::<Result<Vec<_>, _>>()?;
        let people: Vec<Vec<f32>> = factors.par_iter().map(|person| coordinates(&nodes, person, &motions)).collect();
        let tensor = people.concat();
        let (faces, landmarks, mirror) = (grid.faces(), grid.landmarks(), grid.mirror());
        Ok(FacePopulation { grid, tensor, faces, landmarks, mirror, factors })
    }

    /// The extents of the tensor: people, expressions, vertices, 3.
    pub fn extents(&self) -> [usize; 4] {
        [self.factors.len(), EXPRESSIONS.len(), self.grid.n_vertices(), 3]
    }

    /// One face as a coloured mesh; none when there is no such person or expression.
    pub fn mesh(&self, identity: usize, expression: usize) -> Option<Mesh> {
        let length = 3 * self.grid.n_vertices();
        let start = (identity * EXPRESSIONS.len() + expression) * length;
        let face = self.tensor.get(start..start + length).filter(|_| expression < EXPRESSIONS.len())?;
        let positions = face.chunks_exact(3).map(|p| [p[0], p[1], p[2]].map(f64::from)).collect();
        let colours = face_colours(&self.grid, self.factors.get(identity)?, expression).ok()?;
        Some(Mesh { positions, faces: self.faces.clone(), colours, ..Mesh::default() })
    }
}

/// A person's latent factors: standard normal, within [`FACTOR_LIMIT`].
pub fn drawn_factors(stream: &mut ChaCha12Rng) -> [f64; N_FACTORS] {
    std::array::from_fn(|_| {
        loop {
            let factor: f64 = StandardNormal.sample(stream);
            if factor.abs() <= FACTOR_LIMIT {
                return factor;
            }
        }
    })
}

/// One person's face with one expression (an index of [`EXPRESSIONS`]): the vertices in mm.
///
/// The same function makes every population, so a face of factors that no population holds is an unseen one.
pub fn face_positions(grid: &FaceGrid, factors: &[f64; N_FACTORS], expression: usize) -> Result<Vec<[f64; 3]>, Error> {
    let motion = motion_of(factors, expression)?;
    let shape = motion.lids(&FaceShape::of(factors));
    let one_sided = factors[ONE_SIDED];
    Ok(grid.nodes().iter().map(|node| Rest::of(node, &shape).moved(&shape, &motion, one_sided)).collect())
}

/// One person's faces with these average motions, `[expression, vertex, 3]`: the face at rest is made once, but for
/// the lids.
fn coordinates(nodes: &[Node], factors: &[f64; N_FACTORS], motions: &[Motion]) -> Vec<f32> {
    let neutral = FaceShape::of(factors);
    let rest: Vec<Rest> = nodes.iter().map(|node| Rest::of(node, &neutral)).collect();
    let mut coordinates = Vec::with_capacity(3 * nodes.len() * motions.len());
    for motion in motions.iter().map(|average| average.with_habits(factors)) {
        let shape = motion.lids(&neutral);
        let same_lids = shape == neutral;
        for (node, rest) in nodes.iter().zip(&rest) {
            let point = if same_lids || !follows_lids(node) {
                rest.moved(&shape, &motion, factors[ONE_SIDED])
            } else {
                Rest::of(node, &shape).moved(&shape, &motion, factors[ONE_SIDED])
            };
            coordinates.extend(point.map(|coordinate| coordinate as f32));
        }
    }
    coordinates
}

/// The sRGB colours of the vertices of the same face: they follow skin, lips and brows, but not the moving lids over
/// the iris, which keeps its place.
pub fn face_colours(grid: &FaceGrid, factors: &[f64; N_FACTORS], expression: usize) -> Result<Vec<[u8; 3]>, Error> {
    let shape = motion_of(factors, expression)?.lids(&FaceShape::of(factors));
    Ok(grid.nodes().iter().map(|node| colour(node, &shape)).collect())
}

fn motion_of(factors: &[f64; N_FACTORS], expression: usize) -> Result<Motion, Error> {
    Ok(average_motion(expression)?.with_habits(factors))
}

fn average_motion(expression: usize) -> Result<Motion, Error> {
    let last = EXPRESSIONS.len() - 1;
    Motion::of(expression)
        .ok_or_else(|| Error::input(format!("expression {expression} does not exist: they are 0 to {last}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::face_grid::LANDMARKS;
    use std::collections::HashMap;
    use std::sync::OnceLock;

    const AVERAGE: [f64; N_FACTORS] = [0.0; N_FACTORS];

    /// The default population, made once for all tests.
    fn people() -> &'static FacePopulation {
        static PEOPLE: OnceLock<FacePopulation> = OnceLock::new();
        PEOPLE.get_or_init(|| FacePopulation::of(&FaceOptions::default()).unwrap())
    }

    fn average(level: u32) -> (FaceGrid, Vec<[f64; 3]>) {
        let grid = FaceGrid::of_level(level).unwrap();
        let positions = face_positions(&grid, &AVERAGE, 0).unwrap();
        (grid, positions)
    }

    /// Twice the area vector of a triangle.
    fn area_vector(positions: &[[f64; 3]], face: &[u32; 3]) -> [f64; 3] {
        let [p, q, r] = face.map(|vertex| positions[vertex as usize]);
        let (e, f) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
        [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
    }

    fn dot(p: [f64; 3], q: [f64; 3]) -> f64 {
        p[0] * q[0] + p[1] * q[1] + p[2] * q[2]
    }

    /// Pairs of triangles that share an edge.
    fn neighbours(faces: &[[u32; 3]]) -> Vec<(usize, usize)> {
        let mut first = HashMap::new();
        let mut pairs = Vec::new();
        for (index, face) in faces.iter().enumerate() {
            for corner in 0..3 {
                let (p, q) = (face[corner], face[(corner + 1) % 3]);
                if let Some(other) = first.insert((p.min(q), p.max(q)), index) {
                    pairs.push((other, index));
                }
            }
        }
        pairs
    }

    fn assert_sound(people: &FacePopulation, least_area: f64) {
        let pairs = neighbours(&people.faces);
        for identity in 0..people.factors.len() {
            for (expression, name) in EXPRESSIONS.iter().enumerate() {
                let positions = people.mesh(identity, expression).unwrap().positions;
                let vectors: Vec<_> = people.faces.iter().map(|face| area_vector(&positions, face)).collect();
                let least = vectors.iter().map(|v| dot(*v, *v).sqrt() / 2.0).fold(f64::INFINITY, f64::min);
                assert!(least > least_area, "person {identity}, {name}: a triangle of {least} mm^2");
                let cosine = |(a, b): &(usize, usize)| {
                    let (p, q) = (vectors[*a], vectors[*b]);
                    dot(p, q) / (dot(p, p) * dot(q, q)).sqrt()
                };
                let sharpest = pairs.iter().map(cosine).fold(f64::INFINITY, f64::min);
                assert!(sharpest > -0.92, "person {identity}, {name}: neighbours at a cosine of {sharpest}");
            }
        }
    }

    #[test]
    fn no_triangle_of_the_default_population_is_degenerate_or_folded() {
        assert_sound(people(), 0.02);
    }

    #[test]
    fn other_seeds_and_levels_are_sound_too() {
        for (seed, level, least_area) in [(2, 4, 0.02), (3, 3, 0.1), (4, 5, 0.004)] {
            assert_sound(&FacePopulation::of(&FaceOptions { identities: 8, seed, level }).unwrap(), least_area);
        }
    }

    #[test]
    fn same_seed_gives_the_same_people_and_another_seed_others() {
        let options = FaceOptions { identities: 3, seed: 7, level: 3 };
        let first = FacePopulation::of(&options).unwrap();
        assert_eq!(first, FacePopulation::of(&options).unwrap());
        assert_ne!(first.tensor, FacePopulation::of(&FaceOptions { seed: 8, ..options }).unwrap().tensor);
        let more = FacePopulation::of(&FaceOptions { identities: 5, ..options }).unwrap();
        assert_eq!(first.tensor, more.tensor[..first.tensor.len()], "more people leave the first as they are");
    }

    #[test]
    fn a_population_holds_the_faces_of_its_factors() {
        let people = FacePopulation::of(&FaceOptions { identities: 2, seed: 5, level: 3 }).unwrap();
        for (expression, name) in EXPRESSIONS.iter().enumerate() {
            let alone = face_positions(&people.grid, &people.factors[1], expression).unwrap();
            let alone: Vec<[f64; 3]> = alone.iter().map(|p| p.map(|coordinate| f64::from(coordinate as f32))).collect();
            assert_eq!(people.mesh(1, expression).unwrap().positions, alone, "{name}");
        }
    }

    #[test]
    fn expressions_differ_between_people() {
        let people = people();
        let (n_identities, n_expressions) = (people.factors.len(), EXPRESSIONS.len());
        let length = 3 * people.grid.n_vertices();
        let face = |identity: usize, expression: usize| {
            let start = (identity * n_expressions + expression) * length;
            &people.tensor[start..start + length]
        };
        for (expression, name) in EXPRESSIONS.iter().enumerate().skip(1) {
            let (mut displaced, mut residual) = (0.0, 0.0);
            for k in 0..length {
                let moves = (0..n_identities).map(|i| f64::from(face(i, expression)[k] - face(i, 0)[k]));
                let moves: Vec<f64> = moves.collect();
                let mean = moves.iter().sum::<f64>() / n_identities as f64;
                displaced += moves.iter().map(|d| d * d).sum::<f64>();
                residual += moves.iter().map(|d| (d - mean).powi(2)).sum::<f64>();
            }
            let rms = |sum: f64| (sum / (n_identities * people.grid.n_vertices()) as f64).sqrt();
            println!("{name}: displacement {:.2} mm rms, {:.2} about the mean", rms(displaced), rms(residual));
            assert!(rms(displaced) > 1.0, "{name} moves the face by {} mm rms only", rms(displaced));
            assert!(rms(residual) > 0.3, "{name} varies by {} mm rms only", rms(residual));
        }
    }

    #[test]
    fn surprise_opens_a_hole_between_the_lips() {
        let (grid, neutral) = average(4);
        let surprise = face_positions(&grid, &AVERAGE, 2).unwrap();
        let lower = grid.slit_row * grid.columns + grid.columns / 2;
        let gap = |face: &[[f64; 3]]| face[lower + grid.columns][1] - face[lower][1];
        assert!((0.0..0.5).contains(&gap(&neutral)), "closed lips are {} mm apart", gap(&neutral));
        assert!(gap(&surprise) > 15.0, "open lips are {} mm apart", gap(&surprise));
        let strip = |v: &u32| *v as usize == lower || *v as usize == lower + grid.columns;
        assert!(grid.faces().iter().all(|face| face.iter().filter(|v| strip(v)).count() < 2), "a face spans the slit");
    }

    #[test]
    fn mirror_is_an_involution_and_mirrors_the_average_face_exactly() {
        let (grid, positions) = average(3);
        let mirror = grid.mirror();
        for (vertex, [x, y, z]) in positions.iter().enumerate() {
            let other = mirror[vertex] as usize;
            assert_eq!(mirror[other] as usize, vertex);
            assert_eq!(positions[other], [-x, *y, *z]);
        }
    }

    #[test]
    fn landmarks_lie_where_their_names_say() {
        let (grid, positions) = average(4);
        let at = |name: &str| {
            let index = LANDMARKS.iter().position(|landmark| *landmark == name).unwrap();
            positions[grid.landmarks()[index] as usize]
        };
        let front = positions.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(at("nose_tip")[2], front, "the nose tip is the most forward point");
        for name in LANDMARKS {
            let x = at(name)[0];
            let expected = if name.starts_with("left_") {
                1.0
            } else if name.starts_with("right_") {
                -1.0
            } else {
                0.0
            };
            assert!(if expected == 0.0 { x == 0.0 } else { x * expected > 5.0 }, "{name} lies at x = {x}");
        }
        assert!(at("left_eye_outer")[0] > at("left_eye_inner")[0] + 20.0);
        let down = ["left_eye_inner", "nose_tip", "subnasal", "upper_lip_middle", "lower_lip_middle", "chin"];
        assert!(down.map(|name| -at(name)[1]).is_sorted(), "{:?}", down.map(at));
        let mouth = at("left_mouth_corner")[0] - at("right_mouth_corner")[0];
        assert!((40.0..60.0).contains(&mouth), "the mouth is {mouth} mm wide");
    }

    #[test]
    fn faces_have_life_size_and_look_forward() {
        let (grid, positions) = average(4);
        let extent = |axis: usize| {
            let values = positions.iter().map(|p| p[axis]);
            values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min)
        };
        assert!((130.0..150.0).contains(&extent(0)), "{} mm wide", extent(0));
        assert!((185.0..210.0).contains(&extent(1)), "{} mm high", extent(1));
        let forward: f64 = grid.faces().iter().map(|face| area_vector(&positions, face)[2]).sum();
        assert!(forward > 0.0, "faces are counter-clockwise from the front");
    }

    #[test]
    fn wrong_options_are_refused_with_the_remedy() {
        let message = |options| FacePopulation::of(&options).unwrap_err().to_string();
        let options = FaceOptions::default();
        assert!(message(FaceOptions { identities: 0, ..options }).contains("at least one identity"));
        assert!(message(FaceOptions { level: 9, ..options }).contains("from 3 to 6, not 9: the default is 4"));
        let grid = FaceGrid::of_level(3).unwrap();
        assert!(face_positions(&grid, &AVERAGE, 8).unwrap_err().to_string().contains("they are 0 to 7"));
    }
}
