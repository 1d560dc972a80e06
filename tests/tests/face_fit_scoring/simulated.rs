//! Simulated scans of the shared test tensor: what strengths of a fit are chosen on, so that they are not chosen on the scans that are reported.

use std::path::Path;

use habitus::face::training_data::tensor;
use habitus::io::npy;
use habitus::mesh::Mesh;
use habitus::spatial::{PointTree, Ray, TriangleTree};
use habitus_tests::random::Random;

use super::{Score, Shared, VISIBLE, scored};

/// A scan with its truth.
pub struct Simulated {
    pub scan: Mesh,
    pub landmarks: Vec<Option<[f64; 3]>>,
    /// Whether loose hair hangs over the forehead.
    pub has_hair: bool,
    truth: Vec<[f64; 3]>,
}

/// Faces seen under a steeper angle to the ray give no points: cosine of 74 degrees.
const GRAZING: f64 = 0.276;

impl Simulated {
    /// One scan of each of the twelve unseen identities, in expressions in turn, from 1 to 3 views; every second one without faces.
    pub fn all(dir: &Path, shared: &Shared, landmark_vertices: &[u32]) -> Vec<Simulated> {
        let shapes = tensor(&dir.join("faces/tensor_test.npy")).expect("a tensor");
        let triangles = npy::read_u32(dir.join("faces/model_triangles.npy")).expect("triangles").1;
        let triangles = &triangles.as_chunks::<3>().0[..13120];
        let mut random = Random::new(5);
        let mut all = Vec::new();
        for turn in 0..2 {
            for identity in 0..shapes.n_identities() {
                let expression = (identity + 5 * turn) % shapes.n_expressions();
                let small = shapes.shape(identity, expression).as_chunks::<3>().0;
                let truth = shared.upsampled(small);
                let landmarks =
                    landmark_vertices.iter().map(|&v| Some(small[v as usize].map(|x| x + 1.2 * random.normal())));
                let landmarks = landmarks.collect();
                let mut scan = scanned(&truth, triangles, 1 + (identity + turn) % 3, identity % 2 == 0, &mut random);
                let has_hair = identity % 4 == 3;
                if has_hair {
                    grow_hair(&mut scan, &mut random);
                }
                all.push(Simulated { scan, landmarks, has_hair, truth });
            }
        }
        all
    }

    pub fn score(&self, shared: &Shared, small: &[[f64; 3]]) -> Score {
        let near = PointTree::new(&self.scan.positions).expect("points").nearest_all(&self.truth);
        let visible: Vec<bool> = near.iter().map(|near| near.distance <= VISIBLE).collect();
        scored(&shared.upsampled(small), &self.truth, &visible)
    }
}

/// Orthographic range images from `n_views` sides, put together.
fn scanned(truth: &[[f64; 3]], triangles: &[[u32; 3]], n_views: usize, with_faces: bool, random: &mut Random) -> Mesh {
    let tree = TriangleTree::new(truth, triangles).expect("a mesh");
    let mut scan = Mesh::default();
    let pixel = 1.5 + 0.8 * random.unit();
    let sigma = 0.2 + 0.3 * random.unit();
    for view in 0..n_views {
        let side = [0.1, -0.7, 0.7][if n_views == 1 { 0 } else { (view + n_views) % 3 }];
        let (yaw, pitch) = (side + 0.2 * (random.unit() - 0.5), 0.3 * (random.unit() - 0.5));
        let forward = [yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos()];
        let right = [yaw.cos(), 0.0, -yaw.sin()];
        let up = cross(forward, right);
        let shift: [f64; 3] = std::array::from_fn(|_| 0.15 * random.normal());
        let waves: Vec<[f64; 4]> = (0..4)
            .map(|_| [0.12 * random.normal(), 0.08 * random.normal(), 0.08 * random.normal(), 6.3 * random.unit()])
            .collect();
        let half = (150.0 / pixel) as usize;
        let holes: Vec<([f64; 3], f64)> =
            (0..5).map(|_| (truth[random.below(truth.len())], 4.0 + 8.0 * random.unit())).collect();
        let side = 2 * half;
        let at = |k: usize| (k as f64 - half as f64) * pixel;
        let origin = |i: usize, j: usize| -> [f64; 3] {
            std::array::from_fn(|a| at(i) * right[a] + at(j) * up[a] + 400.0 * forward[a])
        };
        let rays: Vec<Ray> = (0..side * side)
            .map(|k| Ray { origin: origin(k % side, k / side), direction: forward.map(|x| -x), longest: 1000.0 })
            .collect();
        let mut number = vec![None; side * side];
        for (k, hit) in tree.first_hit_all(&rays).into_iter().enumerate() {
            let Some(hit) = hit else { continue };
            let [a, b, c] = triangles[hit.face as usize].map(|v| truth[v as usize]);
            let normal = cross(minus(b, a), minus(c, a));
            if dot(normal, forward) < GRAZING * dot(normal, normal).sqrt() {
                continue;
            }
            let (u, v) = (at(k % side), at(k / side));
            let smooth: f64 = waves.iter().map(|[amount, p, q, phase]| amount * (p * u + q * v + phase).sin()).sum();
            let depth = hit.t + sigma * random.normal() + smooth;
            let exact: [f64; 3] = std::array::from_fn(|x| rays[k].origin[x] - hit.t * forward[x]);
            if holes.iter().any(|(centre, radius)| dot(minus(exact, *centre), minus(exact, *centre)) < radius * radius)
            {
                continue;
            }
            number[k] = Some(scan.positions.len() as u32);
            scan.positions.push(std::array::from_fn(|x| rays[k].origin[x] - depth * forward[x] + shift[x]));
        }
        if !with_faces {
            continue;
        }
        for k in (0..side * side - side - 1).filter(|k| k % side + 1 < side) {
            let [a, b, c, d] = [k, k + 1, k + side + 1, k + side].map(|k| number[k]);
            for face in [[a, b, c], [a, c, d]] {
                let [Some(a), Some(b), Some(c)] = face else { continue };
                let corners = [a, b, c].map(|v: u32| scan.positions[v as usize]);
                let longest =
                    (0..3).map(|e| minus(corners[e], corners[(e + 1) % 3])).map(|e| dot(e, e)).fold(0.0, f64::max);
                if longest < 36.0 * pixel {
                    scan.faces.push([a, b, c]);
                }
            }
        }
    }
    scan
}

/// Lifts most points of the upper part by 2 to 14 mm, in strands.
fn grow_hair(scan: &mut Mesh, random: &mut Random) {
    let phase = 6.3 * random.unit();
    for point in &mut scan.positions {
        let line = 35.0 + 10.0 * (0.1 * point[0] + phase).sin();
        if point[1] > line && random.unit() < 0.85 {
            let strand = (0.35 * point[0] + 0.1 * point[1] + phase).sin();
            point[2] += 8.0 + 5.0 * strand + 1.0 * random.normal();
        }
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|x| a[x] - b[x])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|x| a[x] * b[x]).sum()
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
