//! Cleaning of real scans and meshes: what `docs/cleaning.md` says of them.

use std::path::Path;

use habitus::io::mesh::{self, NonFinite, ReadOptions};
use habitus::mesh::Mesh;
use habitus::mesh::clean::{CleanComponent, CleanOptions, Cleaned, clean};
use habitus_tests::data::dir_or_skip;

fn cleaned(mesh: &Mesh) -> Cleaned {
    clean(mesh, &CleanOptions::default()).expect("it can be cleaned")
}

fn read(path: &Path) -> Mesh {
    mesh::read_file(path, &ReadOptions { non_finite: NonFinite::Keep }).expect("a real file").mesh
}

/// The PLY files of these folders, with or without faces.
fn files(data: &Path, folders: &[&str], with_faces: bool) -> Vec<Mesh> {
    let entries = folders.iter().flat_map(|folder| std::fs::read_dir(data.join(folder)).expect("a folder of the data"));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "ply"));
    paths.sort();
    paths.iter().map(|path| read(path)).filter(|mesh| mesh.faces.is_empty() != with_faces).collect()
}

#[test]
fn real_files_are_found_as_documented_and_lose_no_face() {
    let Some(data) = dir_or_skip("real_files_are_found_as_documented_and_lose_no_face") else { return };
    // Files, loose vertices, fans parted, long faces kept, components, debris, loops, genus, outliers.
    let groups: [(&[&str], bool, [usize; 9]); 8] = [
        (&["faces/scans"], true, [8, 164, 481, 0, 251, 226, 1621, 0, 0]),
        (&["faces/scans"], false, [4, 0, 0, 0, 0, 0, 0, 0, 5]),
        (&["bodies/scans"], true, [12, 313, 304, 0, 210, 122, 909, 0, 0]),
        (&["bodies/scans"], false, [12, 0, 0, 0, 0, 0, 0, 0, 2]),
        (&["bodies/posed"], true, [10, 0, 0, 0, 10, 0, 0, 17, 0]),
        (&["sequences/layered", "sequences/tight", "sequences/wide"], true, [6, 0, 0, 0, 6, 0, 0, 8, 0]),
        (&["bodies/model"], true, [2, 0, 0, 16, 2, 0, 0, 0, 0]),
        (&["meshes"], true, [11, 0, 0, 0, 11, 0, 0, 1, 0]),
    ];
    for (folders, with_faces, expected) in groups {
        let mut sums = [0; 9];
        for mesh in files(&data, folders, with_faces) {
            let Cleaned { mesh: result, report, .. } = cleaned(&mesh);
            assert_eq!(result.faces.len(), mesh.faces.len());
            let of_components =
                |count: fn(&CleanComponent) -> usize| -> usize { report.components.iter().map(count).sum() };
            let counts = [
                1,
                report.unreferenced_vertices.count,
                report.non_manifold_vertices.count,
                report.long_faces.count,
                report.components.len(),
                report.n_debris(),
                of_components(|component| component.boundary_loops),
                of_components(|component| component.genus.expect("orientable") as usize),
                report.outliers.count,
            ];
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
            // Nothing but loose vertices and parted fans had to be changed.
            let n_changes = usize::from(counts[1] > 0) + 2 * usize::from(counts[2] > 0);
            assert_eq!(report.changes().len(), n_changes, "{:?}", report.changes());
        }
        assert_eq!(sums, expected, "{folders:?}");
    }
}

#[test]
fn faces_at_vertices_torn_out_of_scans_go_and_no_others() {
    let Some(data) = dir_or_skip("faces_at_vertices_torn_out_of_scans_go_and_no_others") else { return };
    for (file, distance) in [("faces/scans/scan_00.ply", 60.0), ("bodies/scans/scan_00.ply", 400.0)] {
        let mut mesh = read(&data.join(file));
        let mut n_faces = vec![0; mesh.positions.len()];
        mesh.faces.iter().flatten().for_each(|&vertex| n_faces[vertex as usize] += 1);
        // Spread over the file, whose order is random; inner vertices, so that a hole remains and no bay.
        let torn: Vec<usize> = (0..mesh.positions.len()).filter(|&v| n_faces[v] >= 5).step_by(300).take(20).collect();
        assert_eq!(torn.len(), 20);
        for (number, &vertex) in torn.iter().enumerate() {
            // Directions all round.
            let (turn, height) = (2.4 * number as f64, 0.95 - 0.1 * number as f64);
            let reach = (1.0 - height * height).sqrt();
            let direction = [reach * turn.cos(), reach * turn.sin(), height];
            mesh.positions[vertex].iter_mut().zip(direction).for_each(|(x, d)| *x += distance * d);
        }
        let is_torn = |face: &[u32; 3]| face.iter().any(|&vertex| torn.contains(&(vertex as usize)));
        let Cleaned { report, old_of_face, .. } = cleaned(&mesh);
        let expected: Vec<u32> = (0..mesh.faces.len() as u32).filter(|&f| !is_torn(&mesh.faces[f as usize])).collect();
        assert_eq!(old_of_face, expected, "{file}");
        assert_eq!((report.spikes.count, report.long_faces.count), (mesh.faces.len() - expected.len(), 0));
    }
}
