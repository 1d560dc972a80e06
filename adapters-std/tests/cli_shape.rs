//! `habitus clean` with normals and frames, `habitus convert` with other triangles and points, as a user meets them.

// Each of these tests needs a part of it.
#[allow(dead_code)]
mod program;

use std::path::Path;

use habitus::io::mesh::{self as mesh_files, MeshFile, MorphTarget, WriteOptions};
use habitus::mesh::field::{Field, Grid};
use habitus::mesh::isosurface::{Border, isosurface};
use habitus::mesh::{Mesh, Topology};
use program::{Folder, habitus, json, refused};

/// Balls grown together: centres and radii.
fn balls(balls: &[([f64; 3], f64)]) -> Mesh {
    let distance = |p: [f64; 3]| {
        let to_ball = |(c, r): &([f64; 3], f64)| (0..3).map(|k| (p[k] - c[k]).powi(2)).sum::<f64>().sqrt() - r;
        balls.iter().map(to_ball).fold(f64::INFINITY, f64::min)
    };
    let grid = Grid::around([-60.0, -95.0, -50.0], [70.0, 95.0, 60.0], 8.0, 8.0).unwrap();
    isosurface(&Field::sampled(grid, distance).unwrap(), 0.0, Border::Closed).unwrap()
}

fn ball() -> Mesh {
    balls(&[([0.0; 3], 40.0)])
}

/// A shape without any symmetry.
fn blobs() -> Mesh {
    balls(&[
        ([0.0, 0.0, 0.0], 40.0),
        ([0.0, 60.0, 10.0], 30.0),
        ([45.0, 10.0, 0.0], 20.0),
        ([-30.0, -30.0, 25.0], 22.0),
        ([10.0, -55.0, -12.0], 35.0),
    ])
}

/// Stored in inches, z up and facing -y.
fn stored([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x / 25.4, -z / 25.4, y / 25.4]
}

fn near(a: [f64; 3], b: [f64; 3], limit: f64) -> bool {
    (0..3).all(|axis| (a[axis] - b[axis]).abs() <= limit)
}

#[test]
fn clean_gives_a_cloud_normals() {
    let folder = Folder::new("cli_shape", "normals");
    let cloud = folder.write("ball.ply", &Mesh { faces: Vec::new(), ..ball() });
    let out = folder.path("out.ply");
    let outward = |mesh: &Mesh| {
        let product = |(p, n): (&[f64; 3], &[f64; 3])| (0..3).map(|k| p[k] * n[k]).sum::<f64>();
        mesh.positions.iter().zip(&mesh.normals).filter(|pair| product(*pair) > 0.0).count()
    };
    let said = json(&["clean", &cloud, "--normals", "-o", &out]);
    let read = mesh_files::read(&out).unwrap();
    assert_eq!((read.normals.len(), outward(&read)), (read.positions.len(), read.positions.len()));
    assert_eq!((&said["normals"]["from"], &said["normals"]["parts"]), (&"neighbours".into(), &1.into()));
    assert_eq!(
        (&said["normals"]["uncertain_points"], &said["normals"]["points_without_normal"]),
        (&0.into(), &0.into())
    );
    // Towards its middle.
    json(&["clean", &cloud, "--normals", "--towards", "-1,0,0.5", "--neighbours", "10", "-o", &out]);
    assert_eq!(outward(&mesh_files::read(&out).unwrap()), 0);
    let mesh = folder.write("mesh.ply", &ball());
    assert_eq!(json(&["clean", &mesh, "--normals", "-o", &out])["normals"]["from"], "faces");
    assert_eq!(outward(&mesh_files::read(&out).unwrap()), read.positions.len());
    assert!(refused(&["clean", &mesh, "--normals", "--towards", "0,0,0"], 1).contains("leave it out"));
    for spoilt in ["1,2", "1,2,x", "1,2,3,x", "1,2,inf"] {
        assert!(refused(&["clean", &cloud, "--normals", "--towards", spoilt], 2).contains("not three numbers"));
    }
    refused(&["clean", &cloud, "--towards", "0,0,0"], 2);
    assert!(refused(&["clean", &cloud, &cloud, "--normals"], 1).contains("give one input"));
}

#[test]
fn clean_warns_of_a_sheet_that_may_face_either_way() {
    let folder = Folder::new("cli_shape", "sheet");
    let positions = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
    let sheet = folder.write("sheet.ply", &Mesh { positions, ..Mesh::default() });
    let said = json(&["clean", &sheet, "--normals"]);
    assert_eq!(said["normals"]["uncertain_points"], 400);
    assert!(said["warnings"][0].as_str().unwrap().contains("--towards"), "{said}");
    assert_eq!(json(&["clean", &sheet, "--normals", "--towards", "0,0,9"])["normals"]["uncertain_points"], 0);
}

#[test]
fn clean_finds_the_unit_and_the_axes_by_a_template() {
    let folder = Folder::new("cli_shape", "frame");
    let template = folder.write("template.ply", &blobs());
    let original = blobs();
    let displacement = [0.0, 3.0, 1.0];
    let scan = MeshFile {
        mesh: Mesh { positions: original.positions.iter().map(|p| stored(*p)).collect(), ..original.clone() },
        morphs: vec![MorphTarget {
            name: "up".into(),
            displacements: vec![stored(displacement); original.positions.len()],
        }],
        ..MeshFile::default()
    };
    let (input, out) = (folder.path("scan.glb"), folder.path("out.glb"));
    mesh_files::write_file(&input, &scan, &WriteOptions::default()).unwrap();
    let said = json(&["clean", &input, "--template", &template, "-o", &out, "--normals"]);
    let frame = &said["frame"];
    assert_eq!((&frame["unit"], &frame["mm_per_unit"]), (&"in".into(), &25.4.into()));
    assert_eq!(frame["axes"], "up +z, front -y, left +x");
    assert_eq!(frame["rotation"], serde_json::json!([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]));
    assert_eq!(frame["not_mirrored_by"], "shape");
    assert!(frame["residual_mm"].as_f64().unwrap() < frame["second_residual_mm"].as_f64().unwrap());
    let file = mesh_files::read_file(&out, &Default::default()).unwrap();
    assert_eq!(file.mesh.positions.len(), original.positions.len());
    for (at, (p, n)) in file.mesh.positions.iter().zip(&file.mesh.normals).enumerate() {
        assert!(near(*p, original.positions[at], 1e-4));
        assert!(near(*n, original.vertex_normals()[at], 1e-3));
        assert!(near(file.morphs[0].displacements[at], displacement, 1e-5));
    }
    let text = String::from_utf8(habitus(&["clean", &input, "--template", &template]).stdout).unwrap();
    assert!(text.contains("frame: unit in; up +z, front -y, left +x; residual"), "{text}");
    // In a unit that it has not it is too small.
    let wrong = refused(&["clean", &input, "--template", &template, "--unit", "cm"], 1);
    assert!(wrong.contains("axes of the scan cannot be told") && wrong.contains("degrees off the axes"), "{wrong}");
    refused(&["clean", &input, "--template", &template, "--unit", "yd"], 2);
}

#[test]
fn clean_refuses_a_frame_that_cannot_be_told() {
    let folder = Folder::new("cli_shape", "refused");
    let (template, out) = (folder.write("template.ply", &blobs()), folder.path("out.ply"));
    let round = folder.write("ball.ply", &ball());
    let said = refused(&["clean", &round, "--template", &round, "-o", &out], 1);
    assert!(said.contains("ball.ply: the axes of the scan cannot be told: two rotations fit about as well"), "{said}");
    assert!(said.contains("turn the scan by hand") && said.contains("residual, mm"), "{said}");
    let mut small = blobs();
    small.positions.iter_mut().for_each(|p| *p = p.map(|x| x * 0.2));
    let small = folder.write("small.ply", &small);
    let said = refused(&["clean", &small, "--template", &template, "-o", &out], 1);
    assert!(said.contains("the unit of the scan cannot be told") && said.contains("size / template"), "{said}");
    assert!(!Path::new(&out).exists());
}

#[test]
fn convert_makes_fewer_faces() {
    let folder = Folder::new("cli_shape", "faces");
    let (input, out) = (folder.write("blobs.ply", &blobs()), folder.path("out.obj"));
    let said = json(&["convert", &input, "--faces", "300", "-o", &out]);
    assert_eq!((&said["written_faces"], &said["decimation"]["faces"]), (&300.into(), &300.into()));
    assert_eq!(said["faces"], blobs().faces.len());
    let read = mesh_files::read(&out).unwrap();
    assert_eq!(read.faces.len(), 300);
    assert!(Topology::new(read.positions.len(), &read.faces).is_closed());
    let said = json(&["convert", &input, "--faces", "0", "-o", &out]);
    assert!(said["warnings"][0].as_str().unwrap().contains("faces are left"), "{said}");
    let cloud = folder.write("cloud.ply", &Mesh { faces: Vec::new(), ..ball() });
    let message = refused(&["convert", &cloud, "--faces", "10", "-o", &out], 1);
    assert!(message.contains("cloud.ply: a mesh without faces cannot be decimated"), "{message}");
}

#[test]
fn convert_makes_points() {
    let folder = Folder::new("cli_shape", "points");
    let (input, out) = (folder.write("ball.ply", &ball()), folder.path("out.ply"));
    let run = |seed: &str| {
        json(&["convert", &input, "--points", "200", "--seed", seed, "-o", &out]);
        mesh_files::read(&out).unwrap()
    };
    let cloud = run("1");
    assert_eq!((cloud.positions.len(), cloud.normals.len(), cloud.faces.len()), (200, 200, 0));
    for (p, n) in cloud.positions.iter().zip(&cloud.normals) {
        assert!((0..3).map(|k| p[k] * n[k]).sum::<f64>() > 0.95 * 38.0);
    }
    assert!(run("1") == cloud && run("2") != cloud);
    let said = json(&["convert", &out, "--points", "50", "-o", &folder.path("fewer.ply")]);
    assert_eq!((&said["written_vertices"], &said["sampling"]["points"]), (&50.into(), &50.into()));
    let said = json(&["convert", &out, "--points", "500", "-o", &folder.path("more.ply")]);
    assert!(said["warnings"][0].as_str().unwrap().contains("only 200 different points"), "{said}");
    refused(&["convert", &input, "--points", "0", "-o", &out], 2);
}

#[test]
fn convert_makes_a_mesh_anew_and_closes_it() {
    let folder = Folder::new("cli_shape", "remesh");
    let (whole, out) = (folder.write("ball.ply", &ball()), folder.path("out.ply"));
    let said = json(&["convert", &whole, "--remesh", "5", "-o", &out]);
    assert_eq!((&said["remesh"]["spacing"], said["warnings"].as_array().unwrap().len()), (&5.0.into(), 0));
    let mut open = ball();
    open.faces.retain(|face| face.iter().any(|&v| open.positions[v as usize][1] < 35.0));
    let open = folder.write("open.ply", &open);
    let said = json(&["convert", &open, "--remesh", "5", "--faces", "400", "-o", &out]);
    assert!(said["warnings"][0].as_str().unwrap().contains("holes are closed"), "{said}");
    let read = mesh_files::read(&out).unwrap();
    assert_eq!(read.faces.len(), 400);
    let components = Topology::new(read.positions.len(), &read.faces).components().all;
    assert!(components.len() == 1 && components[0].is_closed() && components[0].genus() == Ok(0), "{components:?}");
    refused(&["convert", &whole, "--remesh", "0", "-o", &out], 2);
    assert!(refused(&["convert", &whole, "--remesh", "1e-4", "-o", &out], 1).contains("make the spacing wider"));
}
