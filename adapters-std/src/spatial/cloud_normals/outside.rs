//! Which of the two sides of each part of a cloud is its outside.

use glam::DVec3;
use rayon::prelude::*;

use super::planes::Planes;
use super::propagation::Parts;
use crate::Error;
use crate::spatial::WindingTree;

/// Parts that are turned with regard to one another; further ones, which are smaller, with regard to these.
const N_JOINT: usize = 64;

/// Places at which winding numbers are taken, shared among the parts by their sizes, and the fewest for a part.
const N_PROBES: usize = 4000;
const FEWEST_PROBES: usize = 16;

/// Passes over all parts after which turning ends; it ends by itself, each turn being for the better.
const MAX_PASSES: usize = 32;

/// The winding number on a closed surface that is oriented outwards.
const ON_SURFACE: f64 = 0.5;

/// A place on the cloud.
struct Probe {
    /// A little before and a little behind the point, so that its own part and its noise cancel.
    sides: [[f64; 3]; 2],
    /// The area for which it stands.
    weight: f64,
}

/// Turns the parts so that the winding numbers on all points are as near as possible to 1/2, in the mean square over the area.
/// Returns how certain each is.
pub(super) fn turn_outwards(points: &[[f64; 3]], planes: &Planes, parts: &mut Parts) -> Result<Vec<f64>, Error> {
    let n_joint = parts.members.len().min(N_JOINT);
    let n_points: usize = parts.members.iter().map(Vec::len).sum();
    let probes_of: Vec<Vec<Probe>> =
        parts.members.iter().map(|members| probes(points, planes, members, n_points)).collect();
    let trees: Vec<WindingTree> = parts.members[..n_joint]
        .iter()
        .map(|members| tree(points, planes, &parts.normals, members))
        .collect::<Result<_, _>>()?;
    let joint: Vec<&Probe> = probes_of[..n_joint].iter().flatten().collect();
    // The winding number at each probe by each part alone.
    let numbers: Vec<Vec<f64>> =
        trees.iter().map(|tree| joint.par_iter().map(|probe| number(tree, probe)).collect()).collect();
    let mut sum = vec![0.0; joint.len()];
    let (mut start, mut signs) = (0, Vec::new());
    for (by_part, own) in numbers.iter().zip(&probes_of) {
        let range = start..start + own.len();
        start = range.end;
        let mean: f64 = by_part[range].iter().zip(own).map(|(number, probe)| number * probe.weight).sum();
        signs.push(if mean < 0.0 { -1.0 } else { 1.0 });
        add(&mut sum, by_part, signs[signs.len() - 1]);
    }
    let error = |sum: &[f64]| squared_error(sum, joint.iter().copied());
    let mut certainties = vec![0.0; n_joint];
    for _ in 0..MAX_PASSES {
        let mut has_turned = false;
        for part in 0..n_joint {
            let mut turned = sum.clone();
            add(&mut turned, &numbers[part], -2.0 * signs[part]);
            let (before, after) = (error(&sum), error(&turned));
            certainties[part] = certainty(before.min(after), before.max(after));
            // What differs by rounding alone is left as it is.
            if after < before * (1.0 - 1e-9) {
                (sum, has_turned) = (turned, true);
                signs[part] = -signs[part];
            }
        }
        if !has_turned {
            break;
        }
    }
    for (part, sign) in signs.iter().enumerate() {
        parts.turn(part, *sign);
    }
    let rest = turned_among(points, planes, parts, &probes_of, n_joint)?;
    for (sign, certainty) in rest {
        parts.turn(certainties.len(), sign);
        certainties.push(certainty);
    }
    Ok(certainties)
}

/// For each part from the `n_joint`-th on, how it fits best among those before, and how certain that is.
fn turned_among(
    points: &[[f64; 3]],
    planes: &Planes,
    parts: &Parts,
    probes_of: &[Vec<Probe>],
    n_joint: usize,
) -> Result<Vec<(f64, f64)>, Error> {
    if parts.members.len() == n_joint {
        return Ok(Vec::new());
    }
    let others = tree(points, planes, &parts.normals, &parts.members[..n_joint].concat())?;
    let sign_of = |(members, probes): (&Vec<u32>, &Vec<Probe>)| {
        let own = tree(points, planes, &parts.normals, members)?;
        let error = |sign: f64| {
            let sum: Vec<f64> =
                probes.iter().map(|probe| number(&others, probe) + sign * number(&own, probe)).collect();
            squared_error(&sum, probes.iter())
        };
        let (kept, turned) = (error(1.0), error(-1.0));
        Ok((if turned < kept { -1.0 } else { 1.0 }, certainty(kept.min(turned), kept.max(turned))))
    };
    parts.members[n_joint..].par_iter().zip(&probes_of[n_joint..]).map(sign_of).collect()
}

/// Turns each part so that most of its normals, by their cosines, point to the side of the position; returns how certain each
/// is.
pub(super) fn turn_towards(points: &[[f64; 3]], position: [f64; 3], parts: &mut Parts) -> Vec<f64> {
    let position = DVec3::from_array(position);
    let mut certainties = Vec::new();
    for part in 0..parts.members.len() {
        let cosines = parts.members[part].iter().map(|&index| {
            let to = (position - DVec3::from_array(points[index as usize])).normalize_or_zero();
            parts.normals[index as usize].dot(to)
        });
        let (sum, size) = cosines.fold((0.0, 0.0), |(sum, size), cosine| (sum + cosine, size + cosine.abs()));
        certainties.push(if size > 0.0 { sum.abs() / size } else { 0.0 });
        parts.turn(part, sum);
    }
    certainties
}

/// Evenly chosen points of a part.
fn probes(points: &[[f64; 3]], planes: &Planes, members: &[u32], n_points: usize) -> Vec<Probe> {
    let n = (N_PROBES * members.len() / n_points).max(FEWEST_PROBES).min(members.len());
    let area: f64 = members.iter().map(|&index| planes.area(index as usize)).sum();
    let probe = |number: usize| {
        let index = members[number * members.len() / n] as usize;
        let (point, step) = (DVec3::from_array(points[index]), planes.normals[index] * (0.5 * planes.radii[index]));
        Probe { sides: [point + step, point - step].map(|side| side.to_array()), weight: area / n as f64 }
    };
    (0..n).map(probe).collect()
}

fn tree(points: &[[f64; 3]], planes: &Planes, normals: &[DVec3], members: &[u32]) -> Result<WindingTree, Error> {
    let of = |list: &dyn Fn(usize) -> [f64; 3]| members.iter().map(|&index| list(index as usize)).collect::<Vec<_>>();
    let areas: Vec<f64> = members.iter().map(|&index| planes.area(index as usize)).collect();
    WindingTree::of_points(&of(&|index| points[index]), &of(&|index| normals[index].to_array()), &areas)
}

fn number(tree: &WindingTree, probe: &Probe) -> f64 {
    let [before, behind] = probe.sides.map(|side| tree.at(side));
    0.5 * (before + behind)
}

fn add(sum: &mut [f64], numbers: &[f64], factor: f64) {
    sum.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += factor * number);
}

fn squared_error<'a>(sum: &[f64], probes: impl Iterator<Item = &'a Probe>) -> f64 {
    sum.iter().zip(probes).map(|(number, probe)| probe.weight * (number - ON_SURFACE).powi(2)).sum()
}

/// From the errors of the better and the worse way.
fn certainty(better: f64, worse: f64) -> f64 {
    if worse > 0.0 && worse.is_finite() { (worse - better) / (worse + better) } else { 0.0 }
}
