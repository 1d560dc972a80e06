//! Real scans, bodies and animals as surfaces, as meshes and as clouds of their vertices: areas, borders, paths and their return.

use std::f64::consts::PI;
use std::path::Path;
use std::time::Instant;

use habitus::io::mesh;
use habitus::mesh::{CleanOptions, Mesh, clean};
use habitus::spatial::surface::{CloudSurface, IntrinsicTriangulation, MeshSurface, Surface, total_area};
use habitus_tests::data::dir_or_skip;

struct Walks {
    /// Of paths of 5 spacings that do not stop: how far from the start they come back, in spacings; sorted.
    missed: Vec<f64>,
    /// The share of ends of paths of 3 spacings that the logarithm finds again, to a hundredth of a spacing.
    found: f64,
    /// The share that it does not find at all.
    lost: f64,
    stopped: usize,
    microseconds: f64,
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}

fn walks(surface: &dyn Surface) -> Walks {
    let h = surface.spacing();
    let n = surface.n_samples() as u32;
    let (mut missed, mut stopped, mut found, mut lost, mut asked) = (Vec::new(), 0, 0, 0, 0);
    let mut seconds = 0.0;
    for step in 0..500_u32 {
        let (from, angle) = (surface.sample((u64::from(step) * 7919 % u64::from(n)) as u32), f64::from(step) * 2.4);
        let start = Instant::now();
        let there = surface.trace(&from, angle, 5.0 * h);
        seconds += start.elapsed().as_secs_f64();
        if there.stopped.is_some() {
            stopped += 1;
            continue;
        }
        let place = |at| surface.position(at).expect("a location of this surface");
        let back = surface.trace(&there.end, angle + there.turn + PI, 5.0 * h);
        missed.push(distance(place(&back.end), place(&from)) / h);
        let near = surface.trace(&from, angle, 3.0 * h).end;
        asked += 1;
        if let Some([x, y]) = surface.local_log(&from, &near, 6.0 * h) {
            let end = surface.trace(&from, y.atan2(x), x.hypot(y)).end;
            found += u32::from(distance(place(&end), place(&near)) < 0.01 * h);
        } else {
            lost += 1;
        }
    }
    missed.sort_by(f64::total_cmp);
    Walks {
        missed,
        found: f64::from(found) / f64::from(asked),
        lost: f64::from(lost) / f64::from(asked),
        stopped,
        microseconds: seconds / 500.0 * 1e6,
    }
}

fn at(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

fn tell(name: &str, surface: &dyn Surface, seconds: f64) -> Walks {
    let n = surface.n_samples() as u32;
    let boundary = (0..n).filter(|&sample| surface.is_boundary(sample)).count();
    let walks = walks(surface);
    println!(
        "{name}: {n} samples in {seconds:.2} s, h {:.2}, area {:.0}, {} components, {:.1} % on the border; 5 h paths: {:.1} us, \
         {} of 500 stop, back to {:.1e} / {:.1e} / {:.1e} h (median, 95 %, worst); logarithm finds {:.1} %, nothing {:.1} %",
        surface.spacing(),
        total_area(surface),
        surface.n_components(),
        100.0 * boundary as f64 / f64::from(n),
        walks.microseconds,
        walks.stopped,
        at(&walks.missed, 0.5),
        at(&walks.missed, 0.95),
        at(&walks.missed, 1.0),
        100.0 * walks.found,
        100.0 * walks.lost,
    );
    walks
}

/// A mesh as a surface and its vertices as another.
fn pair(data: &Path, file: &str) -> (Mesh, MeshSurface, CloudSurface, [Walks; 2]) {
    let mut cleaned =
        clean(&mesh::read(data.join(file)).expect("a mesh"), &CleanOptions::default()).expect("a surface").mesh;
    cleaned.normals = cleaned.vertex_normals();
    let start = Instant::now();
    let on_mesh = MeshSurface::new(&cleaned).expect("a manifold");
    let walks_on_mesh = tell(&format!("{file} as a mesh"), &on_mesh, start.elapsed().as_secs_f64());
    // Cutting leaves several vertices at one place: the cloud has one of them.
    let mut points = Mesh { faces: Vec::new(), ..cleaned.clone() };
    points = clean(&points, &CleanOptions::default()).expect("points").mesh;
    let start = Instant::now();
    let on_cloud = CloudSurface::new(&points).expect("an oriented cloud");
    let walks_on_cloud = tell(&format!("{file} as a cloud"), &on_cloud, start.elapsed().as_secs_f64());
    (cleaned, on_mesh, on_cloud, [walks_on_mesh, walks_on_cloud])
}

#[test]
fn bodies_and_animals_are_walked_on_as_meshes_and_as_clouds() {
    let Some(data) = dir_or_skip("bodies_and_animals_are_walked_on_as_meshes_and_as_clouds") else { return };
    for (file, area) in
        [("bodies/model/average_body_dec.ply", 0.03), ("meshes/scorpion.ply", 0.1), ("meshes/cat.ply", 0.1)]
    {
        let (mesh, on_mesh, on_cloud, [exact, marched]) = pair(&data, file);
        let ratio = total_area(&on_cloud) / total_area(&on_mesh);
        println!("{file}: the cloud has {ratio:.4} of the area");
        assert!((ratio - 1.0).abs() < area, "{ratio}");
        assert!(exact.found > 0.85 && marched.found > 0.8, "{} {}", exact.found, marched.found);
        assert!(exact.lost < 0.05 && marched.lost < 0.05, "{} {}", exact.lost, marched.lost);
        assert!(exact.stopped == 0 && at(&exact.missed, 1.0) < 1e-6, "{}", at(&exact.missed, 1.0));
        assert!(at(&marched.missed, 0.5) < 0.05, "{}", at(&marched.missed, 0.5));
        // Nearly all places are found as places of the cloud as well.
        let mut apart: Vec<f64> = (0..1000_u32)
            .map(|step| {
                let p = mesh.positions[step as usize * 7 % mesh.positions.len()];
                distance(on_cloud.position(&on_cloud.locate(p)).expect("a place"), p) / on_mesh.spacing()
            })
            .collect();
        apart.sort_by(f64::total_cmp);
        println!(
            "{file}: cloud and vertices are {:.3} / {:.3} h apart (median, 95 %)",
            at(&apart, 0.5),
            at(&apart, 0.95)
        );
        assert!(at(&apart, 0.5) < 0.1, "{}", at(&apart, 0.5));
        let mut intrinsic = IntrinsicTriangulation::of_mesh(&mesh).expect("a manifold");
        let (before, start) = (intrinsic.total_area(), Instant::now());
        let flips = intrinsic.flip_to_delaunay().expect("flips end");
        let kept = intrinsic.total_area() / before - 1.0;
        println!(
            "{file}: {flips} flips in {:.3} s for {} faces, area kept to {kept:.1e}",
            start.elapsed().as_secs_f64(),
            mesh.faces.len()
        );
        assert!(kept.abs() < 1e-9, "{kept}");
    }
}

#[test]
fn face_scans_are_walked_on_as_meshes_and_as_clouds() {
    let Some(data) = dir_or_skip("face_scans_are_walked_on_as_meshes_and_as_clouds") else { return };
    for file in ["faces/scans/scan_00.ply", "faces/scans/scan_01.ply"] {
        let (_, on_mesh, on_cloud, [exact, marched]) = pair(&data, file);
        println!("{file}: the cloud has {:.4} of the area", total_area(&on_cloud) / total_area(&on_mesh));
        assert!(at(&exact.missed, 1.0) < 1e-6, "{}", at(&exact.missed, 1.0));
        assert!(at(&marched.missed, 0.5) < 0.2, "{}", at(&marched.missed, 0.5));
    }
}
