//! Scans as files have them: meshes and clouds, in any unit, whole or in pieces, whichever way their faces look.

use habitus::mesh::Mesh;

use crate::work::{mean_distance, work};

/// Fits a scan that is stored in another way; the mean error, mm, and the distance from the fit of the scan itself.
fn stored(name: &str, scan: &Mesh) -> (f64, f64) {
    let (_, error, apart) = told(name, scan);
    (error, apart)
}

/// The same, with the object that the fit prints.
fn told(name: &str, scan: &Mesh) -> (serde_json::Value, f64, f64) {
    let work = work();
    let landmarks = work.triples(&format!("{name}.txt"), |p| p);
    let (object, vertices) = work.fitted(&work.mesh(&format!("{name}.ply"), scan), &landmarks, &[]);
    (object, work.error(&vertices), mean_distance(&vertices, &work.plain().1))
}

/// The scan alone, without what its file says besides.
fn bare() -> Mesh {
    Mesh { positions: work().scan.positions.clone(), faces: work().scan.faces.clone(), ..Mesh::default() }
}

#[test]
fn faces_that_look_inwards_are_turned() {
    let mut scan = bare();
    scan.faces.iter_mut().for_each(|face| face.swap(0, 1));
    let (error, apart) = stored("inwards", &scan);
    assert!(apart < 1e-3, "{error} {apart}");
    // Also where only one side of the face does.
    let mut scan = bare();
    let middle = work().landmarks[4].1;
    let aside = |v: u32| scan.positions[v as usize][0] - middle[0];
    let flips: Vec<bool> = scan.faces.iter().map(|face| face.iter().all(|&v| aside(v) > 0.0)).collect();
    scan.faces.iter_mut().zip(&flips).filter(|(_, flips)| **flips).for_each(|(face, _)| face.swap(0, 1));
    let (error, apart) = stored("half_inwards", &scan);
    assert!(apart < 0.02, "{error} {apart}");
    // And where each face looks as it likes.
    let mut scan = bare();
    scan.faces.iter_mut().step_by(3).for_each(|face| face.swap(0, 1));
    let (error, apart) = stored("mixed", &scan);
    assert!(apart < 0.02, "{error} {apart}");
}

#[test]
fn loose_triangles_are_a_surface() {
    let scan = bare();
    let positions = scan.faces.iter().flatten().map(|&v| scan.positions[v as usize]).collect();
    let faces = (0..scan.faces.len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let (error, apart) = stored("loose", &Mesh { positions, faces, ..Mesh::default() });
    assert!(error < 0.6 && apart < 0.1, "{error} {apart}");
}

#[test]
fn duplicate_points_and_faces_change_nothing() {
    let mut scan = bare();
    let n = scan.positions.len() as u32;
    scan.positions.extend_from_within(..);
    // Both sides of the sheet, on vertices of their own.
    let other: Vec<[u32; 3]> = scan.faces.iter().map(|&[a, b, c]| [b + n, a + n, c + n]).collect();
    scan.faces.extend(other);
    let (error, apart) = stored("doubled", &scan);
    assert!(error < 0.6 && apart < 0.1, "{error} {apart}");
}

#[test]
fn pieces_and_fins_are_fitted() {
    // In two pieces, the left one inside out, with a gap of the width of a triangle.
    let mut scan = bare();
    let middle = work().landmarks[4].1[0] + 10.0;
    let side = |face: &[u32; 3]| face.iter().filter(|&&v| scan.positions[v as usize][0] > middle).count();
    let (left, right): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
        scan.faces.iter().copied().filter(|face| [0, 3].contains(&side(face))).partition(|face| side(face) == 3);
    scan.faces = left.into_iter().map(|[a, b, c]| [b, a, c]).chain(right).collect();
    let (error, apart) = stored("pieces", &scan);
    assert!(error < 0.6 && apart < 0.3, "{error} {apart}");
    // Fins on every fiftieth face: edges with three faces.
    let mut scan = bare();
    for face in scan.faces.clone().into_iter().step_by(50) {
        let p = scan.positions[face[0] as usize];
        scan.faces.push([face[0], face[1], scan.positions.len() as u32]);
        scan.positions.push([p[0], p[1], p[2] + 3.0]);
    }
    let (error, _) = stored("fins", &scan);
    assert!(error < 0.8, "{error}");
}

#[test]
fn clouds_are_fitted_with_and_without_normals() {
    let normals = bare().vertex_normals();
    let cloud = |normals: Vec<[f64; 3]>| Mesh { positions: bare().positions, normals, ..Mesh::default() };
    let mixed = normals.iter().enumerate().map(|(k, n)| if k.is_multiple_of(2) { *n } else { n.map(|x| -x) }).collect();
    let inwards = normals.iter().map(|n| n.map(|x| -x)).collect();
    let none = vec![[0.0; 3]; normals.len()];
    for (name, normals) in
        [("cloud", vec![]), ("own", normals), ("own_inwards", inwards), ("own_mixed", mixed), ("own_none", none)]
    {
        let (object, error, apart) = told(name, &cloud(normals));
        assert!(error < 0.8 && apart < 0.6, "{name}: {error} {apart}");
        // The distance is that of the mesh: the spacing of the points does not show.
        let median = |object: &serde_json::Value| object["scan_distance_median_mm"].as_f64().expect("a number");
        let (of_cloud, of_mesh) = (median(&object), median(&work().plain().0));
        assert!((of_cloud - of_mesh).abs() < 0.2 * of_mesh, "{name}: {of_cloud} {of_mesh}");
    }
}

/// The unit is told or found; the fit is the same, in the unit of the scan.
#[test]
fn scans_in_any_unit_give_the_same_fit() {
    let work = work();
    let (object, expected) = work.plain();
    assert_eq!(object["unit"], "mm");
    for (unit, mm) in [("cm", 10.0), ("m", 1000.0), ("in", 25.4)] {
        let mut scan = bare();
        scan.positions.iter_mut().flatten().for_each(|x| *x /= mm);
        let scan = work.mesh(&format!("scan_{unit}.ply"), &scan);
        let landmarks = work.triples(&format!("{unit}.txt"), |p| p.map(|x| x / mm));
        for more in [&[][..], &["--unit", unit]].into_iter().take(if unit == "m" { 2 } else { 1 }) {
            let (object, vertices) = work.fitted(&scan, &landmarks, more);
            assert_eq!(object["unit"], unit);
            let vertices: Vec<[f64; 3]> = vertices.iter().map(|p| p.map(|x| x * mm)).collect();
            let apart = mean_distance(&vertices, expected);
            // Which of two points stands for a cell is decided by the last bits.
            assert!(apart < 0.1, "{unit} {more:?}: {apart}");
        }
        let wrong = if unit == "cm" { "m" } else { "cm" };
        let said = work.refused("face.hab", &scan, &landmarks, &["--unit", wrong]);
        assert!(
            said.contains(&format!("in {wrong} the landmarks are")) && said.contains("is the unit right"),
            "{said}"
        );
    }
}
