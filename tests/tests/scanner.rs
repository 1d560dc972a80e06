//! The virtual scanner beside the simulated scans of the shared data, which another program made with the same faults.

use std::path::Path;

use habitus::io::{mesh, npy};
use habitus::mesh::Mesh;
use habitus::spatial::TriangleTree;
use habitus::synth::scanner::{ScanOptions, Viewpoint, scanned};
use habitus_tests::data::dir_or_skip;
use serde_json::Value;

/// The true faces of the shared scans.
fn truths(folder: &Path) -> Vec<Mesh> {
    let faces = npy::read_u32(folder.join("../model_triangles.npy")).expect("triangles").1.as_chunks::<3>().0.to_vec();
    let (shape, vertices) = npy::read_f64(folder.join("truth_vertices.npy")).expect("the truth");
    let face = |place: &[f64]| {
        let positions = place.as_chunks::<3>().0.to_vec();
        Mesh { positions, faces: faces.clone(), ..Mesh::default() }
    };
    vertices.chunks_exact(3 * shape[1]).map(face).collect()
}

/// Mean and 95 % quantile of the distances from the points labelled 0 to the surface.
fn distances(scan: &Mesh, truth: &Mesh) -> (f64, f64) {
    let tree = TriangleTree::new(&truth.positions, &truth.faces).expect("a surface");
    let labels = &scan.attributes.iter().find(|attribute| attribute.name == "label").expect("labels").values;
    let of_face = scan.positions.iter().zip(labels).filter(|(_, label)| **label == 0.0).map(|(p, _)| *p);
    let mut all: Vec<f64> = tree.closest_all(&of_face.collect::<Vec<_>>()).iter().map(|at| at.distance).collect();
    all.sort_by(f64::total_cmp);
    (all.iter().sum::<f64>() / all.len() as f64, all[all.len() * 95 / 100])
}

#[test]
fn scans_are_as_far_from_the_truth_as_the_shared_ones() {
    let Some(data) = dir_or_skip("scans_are_as_far_from_the_truth_as_the_shared_ones") else { return };
    let folder = data.join("faces/scans");
    let records: Value = serde_json::from_slice(&std::fs::read(folder.join("scans.json")).expect("records")).unwrap();
    let mut ratios = Vec::new();
    for (number, (truth, record)) in truths(&folder).iter().zip(records["scans"].as_array().unwrap()).enumerate() {
        let number_of = |name: &str| record[name].as_f64().unwrap();
        let views = number_of("views") as usize;
        let options = ScanOptions {
            views: Viewpoint::on_arc(views, if views == 2 { 60.0 } else { 90.0 }),
            pixel: number_of("pixel_mm"),
            noise: number_of("noise_sigma_mm"),
            seed: number as u64,
            ..ScanOptions::default()
        };
        let ours = scanned(truth, &options).expect("a scan").mesh;
        let shared = mesh::read(folder.join(format!("scan_{number:02}.ply"))).expect("a scan");
        let ((mean, p95), (their_mean, their_p95)) = (distances(&ours, truth), distances(&shared, truth));
        println!(
            "{number:02}: {} points, mean {mean:.3}, 95 % {p95:.3}; shared: {}, {their_mean:.3}, {their_p95:.3}",
            ours.positions.len(),
            shared.positions.len()
        );
        ratios.push(mean / their_mean);
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    println!("ratio of the means {mean:.3}");
    assert!((0.9..1.1).contains(&mean), "{mean}");
    assert!(ratios.iter().all(|ratio| (0.7..1.4).contains(ratio)), "{ratios:?}");
}
