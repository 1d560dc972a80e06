//! Parts of a cloud whose outside winding numbers leave open, such as flat pieces, take the side of their neighbours.

use glam::DVec3;
use rayon::prelude::*;

use super::propagation::{Parts, opposite};
use crate::Error;
use crate::spatial::points::PointTree;

/// Parts below this certainty ask their neighbours.
const OPEN: f64 = 0.1;

/// The share of a part's points, those nearest to other parts, that ask.
const ASKING: f64 = 0.25;

/// The agreement, from 0 to 1, that settles a part.
const SETTLED: f64 = 0.3;

/// Times that parts ask which had no settled neighbour before.
const MAX_ROUNDS: usize = 4;

/// Turns open parts so that they agree with the settled ones nearest to them, where those are not farther away than the part is
/// large. Points agree as in the spanning tree. The certainty of a part becomes the agreement.
pub(super) fn side_with_neighbours(
    points: &[[f64; 3]],
    parts: &mut Parts,
    certainties: &mut [f64],
) -> Result<(), Error> {
    for _ in 0..MAX_ROUNDS {
        let (settled, open): (Vec<usize>, Vec<usize>) =
            (0..certainties.len()).partition(|&part| certainties[part] >= OPEN);
        if settled.is_empty() || open.is_empty() {
            return Ok(());
        }
        let indices: Vec<u32> = settled.iter().flat_map(|&part| parts.members[part].iter().copied()).collect();
        let places: Vec<[f64; 3]> = indices.iter().map(|&index| points[index as usize]).collect();
        let tree = PointTree::new(&places)?;
        let votes: Vec<f64> =
            open.par_iter().map(|&part| vote(points, &parts.normals, &parts.members[part], &indices, &tree)).collect();
        for (&part, vote) in open.iter().zip(&votes).filter(|(_, vote)| vote.abs() >= SETTLED) {
            certainties[part] = vote.abs();
            parts.turn(part, *vote);
        }
        if votes.iter().all(|vote| vote.abs() < SETTLED) {
            return Ok(());
        }
    }
    Ok(())
}

/// How much a part agrees with the points `indices` nearest to it, from -1 to 1; 0 where they are too far away.
fn vote(points: &[[f64; 3]], normals: &[DVec3], members: &[u32], indices: &[u32], tree: &PointTree) -> f64 {
    let mut pairs: Vec<(f64, u32, u32)> = members
        .iter()
        .map(|&member| {
            let near = tree.nearest(points[member as usize]);
            (near.distance, member, indices[near.index as usize])
        })
        .collect();
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    pairs.truncate((ASKING * pairs.len() as f64).ceil() as usize);
    let at = |index: u32| DVec3::from_array(points[index as usize]);
    let first = at(members[0]);
    let (low, high) = members.iter().fold((first, first), |(low, high), &m| (low.min(at(m)), high.max(at(m))));
    if !(pairs[pairs.len() / 2].0 <= 0.5 * low.distance(high)) {
        return 0.0;
    }
    let agreement = |&(_, a, b): &(f64, u32, u32)| {
        let (opposite, cost) = opposite(normals[a as usize], normals[b as usize], at(b) - at(a));
        (1.0 - cost) * if opposite { -1.0 } else { 1.0 }
    };
    pairs.iter().map(agreement).sum::<f64>() / pairs.len() as f64
}
