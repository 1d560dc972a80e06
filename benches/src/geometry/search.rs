//! Rows of spatial search: nearest points, closest points of a surface, rays, winding numbers.
//!
//! Before a time counts, the programs' mean distances are compared: they must have found the same.

use std::error::Error;
use std::num::NonZero;
use std::time::Instant;

use habitus::mesh::Mesh;
use habitus::spatial::{Closest, PointTree, TriangleTree, WindingTree};
use kiddo::{ImmutableKdTree, SquaredEuclidean};

use super::peers::Task;
use super::table::Row;
use super::workload::{QUERIES, bumpy_sphere, far, moved, near, rays, shuffled};
use super::{Bench, Candidate, Plan, memory};

/// Queries of programs that look at every element for each.
const SLOW_QUERIES: usize = 50;

/// Seconds after which a run of winding numbers should end.
const WINDING_SECONDS: f64 = 0.5;

/// Adds the rows of nearest points: clouds of about `10 f^2` points.
///
/// # Errors
/// When a peer fails or finds other distances.
pub fn points(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    for &frequency in &plan.clouds {
        let surface = bumpy_sphere(frequency).positions;
        let points = shuffled(surface);
        let positions = [("near", near(&points)), ("far", far())];
        let cloud = Mesh { positions: points.clone(), ..Mesh::default() };
        let opponents = plan.peers.at(&cloud, &positions, &[])?;
        let n = points.len();
        let mut bench = Bench { plan, group: "points", n, rows };
        let tree = PointTree::new(&points)?;

        let kept = memory::of("points", &frequency.to_string()).map(|memory| memory.kept);
        let build = Candidate::alone(n, || PointTree::new(&points));
        let mut candidates = vec![Candidate { bytes: kept, ..build }];
        candidates.extend(opponents.candidates(&Task::build("points.build", n))?);
        bench.add("build", n, candidates)?;

        let raw = ImmutableKdTree::<f64, 3>::new_from_slice(&points)?;
        for (name, positions) in &positions {
            let nearest = |p: &[f64; 3]| tree.nearest(*p).distance;
            let distances: Vec<f64> = positions.iter().map(nearest).collect();
            let by_kiddo = |p: &[f64; 3]| raw.query(p).nearest_one::<SquaredEuclidean<f64>>().execute().distance;
            let mut candidates = bench.ours(QUERIES, None, || tree.nearest_all(positions))?;
            let one_by_one = || positions.iter().map(nearest).sum::<f64>();
            candidates.push(Candidate::alone(QUERIES, one_by_one).called("habitus, one by one"));
            let kiddo_alone = || positions.iter().map(by_kiddo).sum::<f64>();
            candidates.push(Candidate::alone(QUERIES, kiddo_alone).called("kiddo 6, one by one"));
            candidates.extend(opponents.candidates(&Task::queries("points", name, &distances))?);
            if *name == "near" {
                candidates.extend(opponents.candidates(&Task::queries(
                    "every.point",
                    name,
                    &distances[..SLOW_QUERIES],
                ))?);
            }
            bench.add(&format!("nearest of 100k {name}"), QUERIES, candidates)?;
        }
        let ten = || positions[0].1.iter().map(|&p| tree.nearest_n(p, 10).len()).sum::<usize>();
        let mut candidates = vec![Candidate::alone(QUERIES, ten).called("habitus, one by one")];
        let ten_by_kiddo = || {
            let ten = NonZero::<usize>::MIN.saturating_add(9);
            let found = |p| raw.query(p).nearest_n::<SquaredEuclidean<f64>>(ten).execute().len();
            positions[0].1.iter().map(found).sum::<usize>()
        };
        candidates.push(Candidate::alone(QUERIES, ten_by_kiddo).called("kiddo 6, one by one"));
        bench.add("10 nearest of 100k near", QUERIES, candidates)?;
    }
    Ok(())
}

/// Adds the rows of closest points and rays: surfaces of about `20 f^2` faces.
///
/// # Errors
/// When a peer fails or finds other distances.
pub fn triangles(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    for &frequency in &plan.frequencies {
        let mesh = bumpy_sphere(frequency);
        let n = mesh.faces.len();
        let positions = [("near", near(&mesh.positions)), ("far", far())];
        let rays = rays();
        let opponents = plan.peers.at(&mesh, &positions, &rays)?;
        let mut bench = Bench { plan, group: "triangles", n, rows };
        let build = || TriangleTree::new(&mesh.positions, &mesh.faces);
        let tree = build()?;

        let mut candidates = bench.ours(n, Some(tree.n_bytes()), build)?;
        candidates.extend(opponents.candidates(&Task::build("triangles.build", n))?);
        bench.add("build", n, candidates)?;

        for (name, positions) in &positions {
            let closest = |p: &[f64; 3]| tree.closest(*p).distance;
            let distances: Vec<f64> = positions.iter().map(closest).collect();
            let mut candidates = bench.ours(QUERIES, None, || tree.closest_all(positions))?;
            let one_by_one = || positions.iter().map(closest).sum::<f64>();
            candidates.push(Candidate::alone(QUERIES, one_by_one).called("habitus, one by one"));
            candidates.extend(opponents.candidates(&Task::queries("triangles", name, &distances))?);
            if *name == "near" {
                candidates.extend(opponents.candidates(&Task::queries(
                    "every.triangle",
                    name,
                    &distances[..SLOW_QUERIES],
                ))?);
            }
            bench.add(&format!("closest of 100k {name}"), QUERIES, candidates)?;

            let face = |closest: &Closest| closest.face;
            let hints: Vec<u32> = tree.closest_all(positions).iter().map(face).collect();
            let moved = moved(positions);
            let candidates = bench.ours(QUERIES, None, || tree.closest_all_from(&moved, &hints))?;
            bench.add(&format!("closest of 100k {name}, warm"), QUERIES, candidates)?;
        }
        let hits = tree.first_hit_all(&rays);
        let ways: Vec<f64> = hits.iter().flatten().map(|hit| hit.t).collect();
        let mut candidates = bench.ours(QUERIES, None, || tree.first_hit_all(&rays))?;
        candidates.extend(opponents.candidates(&Task {
            job: "triangles.rays".into(),
            items: QUERIES,
            values: &ways,
        })?);
        bench.add("first hit of 100k rays", QUERIES, candidates)?;
    }
    Ok(())
}

/// Adds the rows of winding numbers: surfaces of about `20 f^2` faces.
///
/// # Errors
/// When the mesh is refused.
pub fn winding(plan: &Plan, rows: &mut Vec<Row>) -> Result<(), Box<dyn Error>> {
    for &frequency in &plan.frequencies {
        let mesh = bumpy_sphere(frequency);
        let n = mesh.faces.len();
        let mut bench = Bench { plan, group: "winding numbers", n, rows };
        let build = || WindingTree::of_mesh(&mesh.positions, &mesh.faces);
        let tree = build()?;
        let kept = memory::of("winding", &frequency.to_string()).map(|memory| memory.kept);
        let candidates = bench.ours(n, kept, build)?;
        bench.add("build", n, candidates)?;
        for (name, positions) in [("near", near(&mesh.positions)), ("far", far())] {
            let start = Instant::now();
            tree.at_all(&positions[..4]);
            let affordable = 4.0 * WINDING_SECONDS / start.elapsed().as_secs_f64();
            let items = (affordable as usize).clamp(4, QUERIES);
            let mut candidates = bench.ours(items, None, || tree.at_all(&positions[..items]))?;
            let one_by_one = || positions[..items].iter().map(|&p| tree.at(p)).sum::<f64>();
            candidates.push(Candidate::alone(items, one_by_one).called("habitus, one by one"));
            bench.add(&format!("100k {name}"), QUERIES, candidates)?;
        }
    }
    Ok(())
}
