//! The logarithmic map at short range, by shooting straightest geodesics: first along the chord, where that misses along the edges of a
//! shortest path (the discrete exponential map of Schmidt, Grimm, Wyvill, Interactive decal compositing, 2006).

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use glam::{DVec2, DVec3};

use super::angles::{angle_of, turned_back};
use super::{Location, Surface};

/// Shots at most from one first direction.
const SHOTS: usize = 24;

/// A miss below this share of the spacing is none.
const MISS: f64 = 1e-10;

/// The nearest miss that is accepted, as a share of the length.
const NEAR: f64 = 0.05;

/// A path along edges may be so many times longer than what is looked for.
const DETOUR: f64 = 1.5;

/// Samples at most that are looked at for such a path.
const MOST_SETTLED: usize = 4096;

/// The nearest of several shots.
struct Best {
    /// How far from the target it ended.
    miss: f64,
    /// The vector that it covered.
    covered: DVec2,
    /// What was missing at its end, in the frame of its start.
    correction: DVec2,
}

impl Best {
    fn vector(&self) -> DVec2 {
        self.covered + self.correction
    }

    fn is_near(&self, exact: f64) -> bool {
        self.miss <= exact.max(NEAR * self.vector().length())
    }
}

/// See [`Surface::local_log`].
pub(super) fn by_shooting(surface: &dyn Surface, at: &Location, to: &Location, longest: f64) -> Option<[f64; 2]> {
    let (start, target) = (DVec3::from_array(surface.position(at)?), DVec3::from_array(surface.position(to)?));
    let (from_sample, to_sample) = (surface.nearest_sample(at)?, surface.nearest_sample(to)?);
    let distance = start.distance(target);
    if !(distance <= longest && longest.is_finite()) || surface.component(from_sample) != surface.component(to_sample) {
        return None;
    }
    let exact = MISS * surface.spacing();
    if distance <= exact {
        // At one place, but perhaps of two sheets.
        let is_near =
            from_sample == to_sample || surface.neighbours(from_sample).iter().any(|edge| edge.j == to_sample);
        return is_near.then_some([0.0; 2]);
    }
    let mut best = shots(surface, at, target, along_chord(surface, at, target)?, longest)?;
    if best.miss > exact
        && let Some(first) = along_edges(surface, at, target, [from_sample, to_sample], DETOUR * longest)
        && let Some(other) = shots(surface, at, target, first, longest)
        && other.miss < best.miss
    {
        best = other;
    }
    let found = best.vector();
    (best.is_near(exact) && found.length() <= longest).then(|| found.to_array())
}

/// The direction of the chord with its length.
fn along_chord(surface: &dyn Surface, at: &Location, target: DVec3) -> Option<DVec2> {
    let chord = target - DVec3::from_array(surface.position(at)?);
    let flat = DVec2::from_array(surface.frame_at(at)?.coordinates(chord.to_array()));
    Some(if flat.length() > 0.1 * chord.length() { flat.normalize() * chord.length() } else { flat })
}

/// The nearest of the shots that begin with this vector; each corrects the nearest before by what that missed, or by half as much where
/// the last was no nearer.
fn shots(surface: &dyn Surface, at: &Location, target: DVec3, first: DVec2, longest: f64) -> Option<Best> {
    let mut vector = first;
    let mut best = Best { miss: f64::INFINITY, covered: vector, correction: DVec2::ZERO };
    let mut share = 1.0;
    for _ in 0..SHOTS {
        let trace = surface.trace(at, angle_of(vector), vector.length());
        let miss = target - DVec3::from_array(surface.position(&trace.end)?);
        if miss.length() < best.miss {
            let flat = DVec2::from_array(surface.frame_at(&trace.end)?.coordinates(miss.to_array()));
            let covered = vector.normalize_or_zero() * trace.length;
            let correction = turned_back(flat, DVec2::from_angle(trace.turn));
            best = Best { miss: miss.length(), covered, correction };
            share = 1.0;
        } else {
            share *= 0.5;
        }
        if best.miss <= MISS * surface.spacing() {
            break;
        }
        vector = best.covered + best.correction * share;
        if !(vector.length() <= 2.0 * longest) {
            break;
        }
    }
    Some(best)
}

/// The sum of the edges of a shortest path, each transported to the frame at its beginning.
fn along_edges(
    surface: &dyn Surface,
    at: &Location,
    target: DVec3,
    [from, to]: [u32; 2],
    longest: f64,
) -> Option<DVec2> {
    let exact = MISS * surface.spacing();
    let (mut here, mut sum, mut turn) = (*at, DVec2::ZERO, 0.0);
    let samples = shortest_path(surface, from, to, longest)?;
    let stations = samples.into_iter().map(|sample| surface.position(&surface.sample(sample)).map(DVec3::from_array));
    for station in stations.chain([Some(target)]) {
        let station = station?;
        if station.distance(DVec3::from_array(surface.position(&here)?)) <= exact {
            continue;
        }
        let hop = shots(surface, &here, station, along_chord(surface, &here, station)?, longest)?;
        if !hop.is_near(exact) {
            return None;
        }
        // From where the hop ends, be that the station or not quite: its frame is the one that the turn is about.
        let vector = hop.vector();
        let trace = surface.trace(&here, angle_of(vector), vector.length());
        sum += turned_back(vector, DVec2::from_angle(turn));
        turn += trace.turn;
        here = trace.end;
    }
    Some(sum)
}

/// The samples of a shortest path along edges, both ends included, if it is at most so long (Dijkstra). Of equally near samples the one
/// with the smaller index comes first.
fn shortest_path(surface: &dyn Surface, from: u32, to: u32, longest: f64) -> Option<Vec<u32>> {
    // Distance and predecessor. Distances are not negative, so that their bits sort as they do.
    let mut reached: BTreeMap<u32, (f64, u32)> = BTreeMap::from([(from, (0.0, from))]);
    let mut waiting = BinaryHeap::from([Reverse((0.0_f64.to_bits(), from))]);
    let mut settled = 0;
    while let Some(Reverse((bits, sample))) = waiting.pop() {
        let distance = f64::from_bits(bits);
        if reached.get(&sample).is_some_and(|&(nearest, _)| nearest < distance) {
            continue;
        }
        if sample == to {
            let before =
                |&sample: &u32| reached.get(&sample).map(|&(_, before)| before).filter(|&before| before != sample);
            let mut path: Vec<u32> = std::iter::successors(Some(to), before).collect();
            path.reverse();
            return Some(path);
        }
        settled += 1;
        if settled > MOST_SETTLED {
            return None;
        }
        for edge in surface.neighbours(sample) {
            let next = distance + edge.length;
            if next <= longest && reached.get(&edge.j).is_none_or(|&(nearest, _)| next < nearest) {
                reached.insert(edge.j, (next, sample));
                waiting.push(Reverse((next.to_bits(), edge.j)));
            }
        }
    }
    None
}
