//! The length to which the tolerances of cleaning are relative.

use glam::DVec3;

use super::draft::Draft;

/// A face this many times larger than the median does not count: a single vertex at 1e30, with which some scanners mark
/// what they did not see, must not make everything else look small.
const MONSTROUS: f64 = 1e6;

/// `L = sqrt(area)` of a mesh, without monstrous faces; of a cloud the diagonal of the box that holds the middle nine tenths
/// of the points on each axis. In the scaled unit of the draft; 0 where there is no extent.
pub(super) fn scale(draft: &Draft<'_>) -> f64 {
    if draft.faces.is_empty() {
        return extent(draft.positions.iter().zip(&draft.is_alive).filter(|(_, alive)| **alive).map(|(p, _)| *p));
    }
    let areas: Vec<f64> = draft.faces.iter().map(|&face| draft.area(face)).collect();
    let mut positive: Vec<f64> = areas.iter().copied().filter(|&area| area > 0.0).collect();
    if positive.is_empty() {
        return 0.0;
    }
    let middle = positive.len() / 2;
    let (_, &mut median, _) = positive.select_nth_unstable_by(middle, f64::total_cmp);
    areas.iter().filter(|&&area| area <= MONSTROUS * median).sum::<f64>().sqrt()
}

fn extent(points: impl Iterator<Item = DVec3>) -> f64 {
    let mut axes: [Vec<f64>; 3] = Default::default();
    for point in points {
        axes.iter_mut().zip(point.to_array()).for_each(|(axis, x)| axis.push(x));
    }
    let width = |axis: &mut Vec<f64>| {
        let (n, skipped) = (axis.len(), axis.len() / 20);
        if n == 0 {
            return 0.0;
        }
        let low = *axis.select_nth_unstable_by(skipped, f64::total_cmp).1;
        *axis.select_nth_unstable_by(n - 1 - skipped, f64::total_cmp).1 - low
    };
    let [x, y, z] = &mut axes;
    DVec3::new(width(x), width(y), width(z)).length()
}
