//! Landmarks that are not where the others ask for them: far away, or exchanged with one another. They are named, so that they can be mended.

use glam::DVec3;

use super::start::{FEWEST, MOST_RESIDUAL, rms, robust_alignment};
use crate::Error;
use crate::register::rigid::alignment;

/// A landmark is wild when its distances from the others are this many times as large as the others', or as small.
const WILD: f64 = 2.0;
/// Landmarks that fit the mean better than this, mm (root mean square), are not exchanged.
const FITTING: f64 = 6.0;
/// Exchanged landmarks are at least so far from where they should be, mm,
const FAR: f64 = 10.0;
/// and, exchanged back, at most this part of it.
const BACK: f64 = 0.5;
/// Exchanged back, the landmarks fit by this factor better.
pub(super) const EXCHANGED: f64 = 0.7;
/// Triples of landmarks from which placements are tried.
const MOST_TRIPLES: usize = 400;

/// The size of `raw` in that of `source`, points xyz after xyz in the same order, from the distances between them: for each point the median ratio of
/// its distances from the others, and of these the median (Siegel 1982), which nearly half of the points do not move. Also the ratio of each point.
///
/// 0 where all points are in one place.
pub(super) fn size(source: &[[f64; 3]], raw: &[[f64; 3]]) -> (f64, Vec<f64>) {
    let apart =
        |points: &[[f64; 3]], a: usize, b: usize| DVec3::from_array(points[a]).distance(DVec3::from_array(points[b]));
    let n = source.len().min(raw.len());
    let of_point = |a: usize| {
        let others = (0..n).filter(|&b| b != a).map(|b| (apart(raw, a, b), apart(source, a, b)));
        lower_median(others.filter(|(_, of_source)| *of_source > 0.0).map(|(of_raw, of_source)| of_raw / of_source))
    };
    let ratios: Vec<f64> = (0..n).map(of_point).collect();
    (lower_median(ratios.iter().copied()), ratios)
}

/// The points whose ratio of [`size`] is another one than that of most; none when too few would be left.
pub(super) fn wild((size, ratios): &(f64, Vec<f64>)) -> Vec<usize> {
    let is_wild = |ratio: f64| !(size / WILD..=size * WILD).contains(&ratio);
    let found: Vec<usize> = (0..ratios.len()).filter(|&k| is_wild(ratios[k])).collect();
    if ratios.len() - found.len() >= FEWEST { found } else { Vec::new() }
}

/// The smaller one of the two in the middle; 0 of none.
fn lower_median(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}

/// Refuses landmarks of which those in `wild` lie off while the others agree; `raw` in a unit of `unit_mm`.
pub(super) fn refuse_wild(
    name: &dyn Fn(usize) -> String,
    source: &[[f64; 3]],
    raw: &[[f64; 3]],
    unit_mm: f64,
    wild: &[usize],
) -> Result<(), Error> {
    let kept: Vec<usize> = (0..source.len()).filter(|k| !wild.contains(k)).collect();
    let (Some(&first), false) = (kept.first(), wild.is_empty()) else { return Ok(()) };
    let target = |k: usize| (DVec3::from_array(raw[k]) - DVec3::from_array(raw[first])) * unit_mm;
    let of_kept: Vec<f64> = kept.iter().flat_map(|&k| source[k]).collect();
    let targets: Vec<f64> = kept.iter().flat_map(|&k| target(k).to_array()).collect();
    let Ok(placement) = alignment(&of_kept, &targets, None, false) else { return Ok(()) };
    let off = |k: usize| DVec3::from_array(placement.point(source[k])).distance(target(k));
    let others: Vec<f64> = kept.iter().map(|&k| off(k)).collect();
    if !(rms(&others) <= MOST_RESIDUAL) {
        return Ok(());
    }
    let named: Vec<(String, f64)> = wild.iter().map(|&k| (name(k), off(k))).collect();
    Err(lie_off(&named, rms(&others)))
}

/// The error of landmarks that are so many mm from where the others ask for them.
pub(super) fn lie_off(named: &[(String, f64)], others: f64) -> Error {
    let list: Vec<String> = named.iter().map(|(name, off)| format!("{name} is {} mm", figure(*off, 1))).collect();
    let landmark = if named.len() == 1 { "the landmark" } else { "of the landmarks" };
    let them = if named.len() == 1 { "it" } else { "them" };
    Error::input(format!(
        "{landmark} {} from where the others ask for it, and these agree to {others:.1} mm: mark {them} anew, or leave {them} out",
        list.join(", ")
    ))
}

/// Refuses landmarks of which two or more were exchanged with one another; `as_given` is how well they fit, `sides` how well with all sides exchanged,
/// `source` the mean's, `target` in mm.
pub(super) fn refuse_exchanged(
    name: &dyn Fn(usize) -> String,
    source: &[[f64; 3]],
    target: &[[f64; 3]],
    as_given: f64,
    sides: f64,
) -> Result<(), Error> {
    let n = source.len();
    let (Some(placed), true) = (placed_by_most(source, target), as_given > FITTING) else { return Ok(()) };
    let apart = |a: usize, b: usize| placed[a].distance(DVec3::from_array(target[b]));
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            let (given, back) = (apart(a, a).min(apart(b, b)), apart(a, b).max(apart(b, a)));
            if given > FAR && back < BACK * given {
                pairs.push((back, a, b));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut order: Vec<usize> = (0..n).collect();
    let mut named = Vec::new();
    for (_, a, b) in pairs {
        if order[a] == a && order[b] == b {
            order.swap(a, b);
            named.push(format!("{} and {}", name(a), name(b)));
        }
    }
    // Of more it is the sides of the face that are exchanged, which is said elsewhere.
    if named.is_empty() || 4 * named.len() > n {
        return Ok(());
    }
    let back: Vec<[f64; 3]> = order.iter().map(|&k| target[k]).collect();
    let (_, exchanged) = robust_alignment(source.as_flattened(), back.as_flattened())?;
    if exchanged < EXCHANGED * as_given && exchanged < sides {
        return Err(Error::input(format!(
            "the landmarks {} seem to be exchanged: all are {as_given:.1} mm (root mean square) from the model's as given, and {exchanged:.1} mm with \
             these exchanged; left is the subject's left (+x)",
            named.join(", ")
        )));
    }
    Ok(())
}

/// The points of `source` placed on `target` so that the median distance is least, from triples of them and then from those that agree.
fn placed_by_most(source: &[[f64; 3]], target: &[[f64; 3]]) -> Option<Vec<DVec3>> {
    let n = source.len();
    let of = |points: &[[f64; 3]], which: &[usize]| -> Vec<f64> { which.iter().flat_map(|&k| points[k]).collect() };
    let placed = |which: &[usize]| -> Option<(f64, Vec<DVec3>)> {
        let motion = alignment(&of(source, which), &of(target, which), None, false).ok()?;
        let points: Vec<DVec3> = source.iter().map(|&p| DVec3::from_array(motion.point(p))).collect();
        let mut distances: Vec<f64> =
            points.iter().zip(target).map(|(p, q)| p.distance(DVec3::from_array(*q))).collect();
        distances.sort_by(f64::total_cmp);
        Some((*distances.get(n / 2)?, points))
    };
    let triples = n * n.saturating_sub(1) * n.saturating_sub(2) / 6;
    let stride = triples.div_ceil(MOST_TRIPLES).max(1);
    let all = (0..n).flat_map(|a| (a + 1..n).flat_map(move |b| (b + 1..n).map(move |c| [a, b, c])));
    let best = all.step_by(stride).filter_map(|triple| placed(&triple)).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let agrees = |k: &usize| best.1[*k].distance(DVec3::from_array(target[*k])) <= FAR.max(2.0 * best.0);
    let agreeing: Vec<usize> = (0..n).filter(agrees).collect();
    Some(placed(&agreeing).map_or(best.1, |(_, points)| points))
}

/// A number of a message: with so many decimals, a huge one with its exponent.
pub(super) fn figure(x: f64, decimals: usize) -> String {
    if x.abs() < 1e5 { format!("{x:.decimals$}") } else { format!("{x:.3e}") }
}

#[cfg(test)]
mod tests {
    use super::super::samples::{face, landmarks};
    use super::*;

    fn marks() -> Vec<[f64; 3]> {
        landmarks(&face(&[0.5], &[])).into_iter().flatten().collect()
    }

    #[test]
    fn wild_points_do_not_change_the_size() {
        let source = marks();
        let mut raw: Vec<[f64; 3]> = source.iter().map(|p| p.map(|x| x / 25.4 + 3.0)).collect();
        for k in [2, 7, 11] {
            raw[k][1] += 10f64.powi(k as i32);
        }
        let found = size(&source, &raw);
        assert!((found.0 * 25.4 - 1.0).abs() < 1e-9, "{}", found.0);
        assert_eq!(wild(&found), [2, 7, 11]);
        assert_eq!(size(&source, &vec![[1.0; 3]; source.len()]).0, 0.0);
        assert_eq!(wild(&(1.0, vec![1.0, 1.1, 0.9, 5.0])), [0; 0], "three do not say that the fourth is wild");
    }

    #[test]
    fn exchanged_points_are_named() {
        let source = landmarks(&face(&[], &[])).into_iter().flatten().collect::<Vec<_>>();
        let said = |exchanges: &[[usize; 2]]| {
            let mut target = marks();
            exchanges.iter().for_each(|&[a, b]| target.swap(a, b));
            let (_, as_given) = robust_alignment(source.as_flattened(), target.as_flattened()).expect("a motion");
            let name = |k: usize| format!("<{k}>");
            refuse_exchanged(&name, &source, &target, as_given, f64::INFINITY)
                .map_or_else(|e| e.to_string(), |()| String::new())
        };
        assert_eq!(said(&[]), "");
        assert!(said(&[[0, 3]]).contains("the landmarks <0> and <3> seem to be exchanged"), "{}", said(&[[0, 3]]));
        assert!(said(&[[1, 2]]).contains("<1> and <2> seem"), "{}", said(&[[1, 2]]));
        assert!(said(&[[4, 12]]).contains("<4> and <12> seem"), "{}", said(&[[4, 12]]));
        let eyes = said(&[[0, 3], [1, 2]]);
        assert!(eyes.contains("<0> and <3>") && eyes.contains("<1> and <2>"), "{eyes}");
    }

    #[test]
    fn huge_figures_have_an_exponent() {
        assert_eq!((figure(25677.1456, 3), figure(1e300, 3)), ("25677.146".into(), "1.000e300".into()));
    }
}
