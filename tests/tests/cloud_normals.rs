//! Normals of clouds found again: those of scans, clothed bodies in motion and meshes, whose true normals are known.

use std::path::Path;

use habitus::io::{mesh, npy};
use habitus::mesh::Mesh;
use habitus::spatial::{CloudNormalOptions, Outside, TriangleTree, cloud_normals};
use habitus_tests::data::dir_or_skip;

/// A cloud and its true normals; zero where there is none.
struct Case {
    name: String,
    points: Vec<[f64; 3]>,
    truth: Vec<[f64; 3]>,
}

fn triples(values: &[f64]) -> Vec<[f64; 3]> {
    values.as_chunks::<3>().0.to_vec()
}

fn triangles(path: impl AsRef<Path>) -> Vec<[u32; 3]> {
    npy::read_u32(path).expect("triangles").1.as_chunks::<3>().0.to_vec()
}

/// The scan with the normals of the true surface, where that is at most `within` away.
fn scan(name: String, scan: &Mesh, surface: &TriangleTree, within: f64) -> Case {
    let closest = surface.closest_all(&scan.positions);
    let truth = closest.iter().map(|at| if at.distance <= within && !at.on_boundary { at.normal } else { [0.0; 3] });
    Case { name, points: scan.positions.clone(), truth: truth.collect() }
}

fn body_scans(data: &Path) -> Vec<Case> {
    let faces = triangles(data.join("bodies/model/triangles.npy"));
    let (shape, vertices) = npy::read_f64(data.join("bodies/scans/truth_vertices_i16.npy")).expect("the truth");
    let case = |number: usize| {
        let n = 3 * shape[1];
        let stored = &vertices[number * n..(number + 1) * n];
        let places: Vec<[f64; 3]> =
            triples(stored).iter().map(|p| [0.05 * p[0], 0.05 * p[1] + 1000.0, 0.05 * p[2]]).collect();
        let name = format!("bodies/scans/scan_{number:02}");
        let surface = TriangleTree::new(&places, &faces).expect("a surface");
        scan(name.clone(), &mesh::read(data.join(name + ".ply")).expect("a scan"), &surface, 10.0)
    };
    (0..shape[0]).map(case).collect()
}

fn face_scans(data: &Path) -> Vec<Case> {
    let faces = triangles(data.join("faces/model_triangles.npy"));
    let (shape, vertices) = npy::read_f64(data.join("faces/scans/truth_vertices.npy")).expect("the truth");
    let case = |number: usize| {
        let n = 3 * shape[1];
        let places = triples(&vertices[number * n..(number + 1) * n]);
        let name = format!("faces/scans/scan_{number:02}");
        let surface = TriangleTree::new(&places, &faces).expect("a surface");
        scan(name.clone(), &mesh::read(data.join(name + ".ply")).expect("a scan"), &surface, 2.0)
    };
    (0..shape[0]).map(case).collect()
}

fn clothed(data: &Path) -> Vec<Case> {
    let mut cases = Vec::new();
    for outfit in ["tight", "layered", "wide"] {
        let read = |name: &str| npy::read_f64(data.join("sequences").join(outfit).join(name)).expect("a sequence").1;
        let (points, normals, offsets) = (read("points_u16.npy"), read("normals_i8.npy"), read("point_offset.npy"));
        for frame in [0, 15, 30, 45] {
            let range = 3 * offsets[frame] as usize..3 * offsets[frame + 1] as usize;
            let truth = triples(&normals[range.clone()]).iter().map(|n| n.map(|x| x / 127.0)).collect();
            let points = triples(&points[range]).iter().map(|p| p.map(|x| 0.06 * x)).collect();
            cases.push(Case { name: format!("sequences/{outfit} {frame}"), points, truth });
        }
    }
    cases
}

fn meshes(data: &Path) -> Vec<Case> {
    let names = [
        "meshes/cat",
        "meshes/fish",
        "meshes/koala",
        "meshes/penguin",
        "meshes/scorpion",
        "meshes/sphere",
        "meshes/spot_full",
        "meshes/torus",
        "bodies/model/average_body",
    ];
    let case = |name: &str| {
        let mesh = mesh::read(data.join(format!("{name}.ply"))).expect("a mesh");
        Case { name: name.into(), truth: mesh.vertex_normals_by_angle(), points: mesh.positions }
    };
    names.into_iter().map(case).collect()
}

/// What became of the normals of a cloud.
struct Figures {
    /// Part of the points whose normal points to the right side.
    right: f64,
    /// Mean angle between the lines of the normals, degrees.
    angle: f64,
}

fn figures(case: &Case, outside: Outside) -> Figures {
    let start = std::time::Instant::now();
    let found = cloud_normals(&case.points, &CloudNormalOptions { outside, ..Default::default() }).expect("a cloud");
    let seconds = start.elapsed().as_secs_f64();
    let (mut n, mut n_right, mut angles) = (0, 0, 0.0);
    for (normal, truth) in found.normals.iter().zip(&case.truth).filter(|(_, truth)| **truth != [0.0; 3]) {
        let cosine: f64 = (0..3).map(|axis| normal[axis] * truth[axis]).sum();
        n += 1;
        n_right += usize::from(cosine > 0.0);
        angles += cosine.abs().min(1.0).acos().to_degrees();
    }
    let figures = Figures { right: f64::from(n_right as u32) / f64::from(n), angle: angles / f64::from(n) };
    println!(
        "{:28} {:6} points  {:3} parts  {:2} without  right {:7.3} %  angle {:5.2} deg  {seconds:.3} s  {:.2?}",
        case.name,
        case.points.len(),
        found.parts.len(),
        found.n_without_normal,
        100.0 * figures.right,
        figures.angle,
        found.parts.iter().take(4).map(|part| part.certainty).collect::<Vec<_>>()
    );
    figures
}

/// Asserts floors of what was measured: mean and smallest part of right signs, largest mean angle in degrees.
fn check(cases: &[Case], outside: impl Fn(usize) -> Outside, [mean_right, least_right, angle]: [f64; 3]) {
    let all: Vec<Figures> = cases.iter().enumerate().map(|(number, case)| figures(case, outside(number))).collect();
    let mean = |of: fn(&Figures) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
    let (right, least) = (mean(|f| f.right), all.iter().map(|f| f.right).fold(1.0, f64::min));
    println!("{} clouds: right {right:.4}, at least {least:.4}; angle {:.2} deg\n", all.len(), mean(|f| f.angle));
    assert!(right > mean_right && least > least_right && mean(|f| f.angle) < angle);
}

#[test]
fn normals_of_body_scans_are_found_again() {
    let Some(data) = dir_or_skip("normals_of_body_scans_are_found_again") else { return };
    check(&body_scans(&data), |_| Outside::Around, [0.99, 0.98, 9.0]);
}

#[test]
fn normals_of_face_scans_are_found_again() {
    let Some(data) = dir_or_skip("normals_of_face_scans_are_found_again") else { return };
    let cases = face_scans(&data);
    check(&cases, |_| Outside::Around, [0.99, 0.95, 6.0]);
    // A scanner 600 mm in front of the face.
    let (_, rigid) = npy::read_f64(data.join("faces/scans/truth_rigid.npy")).expect("the truth");
    let scanner = |number: usize| {
        let m = &rigid[16 * number..16 * number + 16];
        Outside::Towards([0, 4, 8].map(|row| m[row + 2] * 600.0 + m[row + 3]))
    };
    check(&cases, scanner, [0.99, 0.98, 6.0]);
}

#[test]
fn normals_of_clothed_bodies_and_meshes_are_found_again() {
    let Some(data) = dir_or_skip("normals_of_clothed_bodies_and_meshes_are_found_again") else { return };
    check(&clothed(&data), |_| Outside::Around, [0.985, 0.95, 9.0]);
    check(&meshes(&data), |_| Outside::Around, [0.97, 0.88, 7.0]);
}
