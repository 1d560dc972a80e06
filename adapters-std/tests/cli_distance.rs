//! `habitus measure distance` as a user meets it.

// Each of these tests needs a part of it.
#[allow(dead_code)]
mod program;

use std::process::Output;

use habitus::io::mesh as mesh_files;
use habitus::mesh::Mesh;
use program::Folder;
use serde_json::Value;

/// The words of `measure distance` with these arguments.
fn distance<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    [&["measure", "distance"], arguments].concat()
}

fn habitus(arguments: &[&str]) -> Output {
    program::habitus(&distance(arguments))
}

/// Runs with `--json` and returns the object and what was said on stderr.
fn json(arguments: &[&str]) -> (Value, String) {
    program::json_and_said(&distance(arguments))
}

/// Runs what must be refused with this status; returns what was said on stderr.
fn refused(arguments: &[&str], status: i32) -> String {
    program::refused(&distance(arguments), status)
}

/// A square sheet of side 40 with 81 vertices at depth `z`.
fn sheet(z: f64) -> Mesh {
    let positions = (0..81).map(|k| [f64::from(k % 9) * 5.0, f64::from(k / 9) * 5.0, z]).collect();
    let faces = (0..64).map(|k| k / 8 * 9 + k % 8).flat_map(|v| [[v, v + 1, v + 10], [v, v + 10, v + 9]]).collect();
    Mesh { positions, faces, ..Mesh::default() }
}

#[test]
fn two_sheets_give_figures_a_coloured_mesh_and_a_picture() {
    let folder = Folder::new("cli_distance", "sheets");
    let (a, b) = (folder.write("a.ply", &sheet(0.0)), folder.write("b.obj", &sheet(2.0)));
    let (ply, png) = (folder.path("out.ply"), folder.path("out.png"));
    let (object, _) = json(&[&a, &b, "--ply", &ply, "--png", &png, "--size", "60", "--max", "4", "--within", "1,2.5"]);
    for direction in ["a_to_b", "b_to_a"] {
        for figure in ["mean_mm", "rms_mm", "median_mm", "quantile_99_mm", "largest_mm"] {
            assert_eq!(object[direction][figure], 2.0, "{direction} {figure}");
        }
        assert_eq!((&object[direction]["points"], &object[direction]["at_boundary"]), (&81.into(), &32.into()));
        assert_eq!(object[direction]["without_boundary"]["points"], 49);
        assert_eq!(object[direction]["within"][0]["percent"], 0.0);
        assert_eq!(object[direction]["within"][1]["percent"], 100.0);
    }
    // A lies behind B.
    assert_eq!(
        (&object["a_to_b"]["signed_mean_mm"], &object["b_to_a"]["signed_mean_mm"]),
        (&(-2.0).into(), &2.0.into())
    );
    assert_eq!((&object["hausdorff_mm"], &object["chamfer_mean_mm"]), (&2.0.into(), &2.0.into()));
    assert_eq!((&object["ply"], &object["png"]), (&ply.clone().into(), &png.clone().into()));
    let coloured = mesh_files::read(&ply).unwrap();
    assert_eq!((coloured.positions, coloured.faces), (sheet(0.0).positions, sheet(0.0).faces));
    let scale = habitus::report::ColourScale::sequential(0.0, 4.0);
    assert_eq!((coloured.colours[40], coloured.colours[0]), (scale.colour(2.0), scale.missing));
    assert_eq!(&std::fs::read(&png).unwrap()[..8], b"\x89PNG\r\n\x1a\n");

    let text = String::from_utf8(habitus(&[&a, &b]).stdout).unwrap();
    assert!(text.contains("| A to B | 81 | 2.0000 |"), "{text}");
    assert!(text.contains("| B to A, not at the boundary of A | 49 |"), "{text}");
    assert!(text.contains("(Hausdorff): 2.0000 mm"), "{text}");
}

#[test]
fn samples_and_clouds_are_measured_too() {
    let folder = Folder::new("cli_distance", "clouds");
    let a = folder.write("a.ply", &sheet(0.0));
    let cloud = folder.write("cloud.ply", &Mesh { faces: Vec::new(), ..sheet(1.0) });
    let words = [&a, &cloud, "--samples", "200", "--size", "60", "--png", &folder.path("out.png")];
    let (object, _) = json(&words);
    assert_eq!((&object["a_to_b"]["points"], &object["b_to_a"]["points"]), (&200.into(), &81.into()));
    assert_eq!((&object["b_to_a"]["mean_mm"], &object["b_to_a"]["signed_mean_mm"]), (&1.0.into(), &1.0.into()));
    assert!(object["a_to_b"]["signed_mean_mm"].is_null());
    let mean = object["a_to_b"]["mean_mm"].as_f64().unwrap();
    assert!(mean > 1.5 && mean < 3.0, "{mean}");
    let again = json(&[&words[..], &["--threads", "1"]].concat()).0;
    assert_eq!(again, object, "the same for any number of threads");
}

#[test]
fn other_units_give_a_warning() {
    let folder = Folder::new("cli_distance", "units");
    let metres = sheet(0.0).positions.iter().map(|p| p.map(|x| x / 1000.0)).collect();
    let a = folder.write("metres.ply", &Mesh { positions: metres, ..sheet(0.0) });
    let b = folder.write("b.ply", &sheet(0.0));
    let (object, said) = json(&[&a, &b]);
    assert!(said.contains("about 1000 times smaller than"), "{said}");
    assert_eq!(object["warnings"].as_array().unwrap().len(), 1);
    assert!(json(&[&b, &b]).0["warnings"].as_array().unwrap().is_empty());
}

#[test]
fn what_cannot_be_measured_is_refused_with_the_remedy() {
    let folder = Folder::new("cli_distance", "refused");
    let a = folder.write("a.ply", &sheet(0.0));
    let cloud = folder.write("cloud.ply", &Mesh { faces: Vec::new(), ..sheet(0.0) });
    let flat = folder.write("flat.ply", &Mesh { faces: vec![[0, 1, 2]], ..sheet(0.0) });
    let empty = folder.path("empty.ply");
    std::fs::write(&empty, "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n").unwrap();
    assert!(refused(&[&a, &cloud, "--signed"], 1).contains("leave --signed out"));
    assert!(refused(&[&a, &empty], 1).contains("empty.ply"));
    assert!(refused(&[&a, &folder.path("none.ply")], 1).contains("none.ply: cannot be read"));
    let message = refused(&[&flat, &a, "--samples", "9"], 1);
    assert!(message.contains("flat.ply: its faces have no area"), "{message}");
    assert!(refused(&[&a, &a, "--png", &folder.path("out.jpg")], 1).contains("is a .png file"));
    assert!(refused(&[&a, &a, "--ply", &folder.path("out.obj")], 1).contains("is a .ply file"));
    for wrong in [["--max", "0"], ["--max", "NaN"], ["--samples", "0"], ["--within", "-1"]] {
        refused(&[&a, &a, wrong[0], wrong[1]], 2);
    }
    refused(&[&a, &a, "--samples", "9", "--area-weighted"], 2);
}
