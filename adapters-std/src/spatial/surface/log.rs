//! The logarithmic map at short range, by shooting straightest geodesics.

use glam::{DVec2, DVec3};

use super::angles::{angle_of, turned_back};
use super::{Location, Surface};

/// Shots at most.
const SHOTS: usize = 24;

/// A miss below this share of the spacing is none.
const MISS: f64 = 1e-10;

/// The nearest miss that is accepted, as a share of the length.
const NEAR: f64 = 0.05;

/// See [`Surface::local_log`].
pub(super) fn by_shooting(surface: &dyn Surface, at: &Location, to: &Location, longest: f64) -> Option<[f64; 2]> {
    let (start, target) = (DVec3::from_array(surface.position(at)?), DVec3::from_array(surface.position(to)?));
    let chord = target - start;
    if !(chord.length() <= longest) || !longest.is_finite() {
        return None;
    }
    let exact = MISS * surface.spacing();
    if chord.length() <= exact {
        return (at == to || same_place(surface, at, to)).then_some([0.0; 2]);
    }
    let flat = DVec2::from_array(surface.frame_at(at)?.coordinates(chord.to_array()));
    let mut vector = if flat.length() > 0.1 * chord.length() { flat.normalize() * chord.length() } else { flat };
    // The nearest miss, the vector that the path has covered and the correction after it.
    let mut best = (f64::INFINITY, vector, DVec2::ZERO);
    let mut share = 1.0;
    for _ in 0..SHOTS {
        let trace = surface.trace(at, angle_of(vector), vector.length());
        let miss = target - DVec3::from_array(surface.position(&trace.end)?);
        if miss.length() < best.0 {
            let flat = DVec2::from_array(surface.frame_at(&trace.end)?.coordinates(miss.to_array()));
            let covered = vector.normalize_or_zero() * trace.length;
            best = (miss.length(), covered, turned_back(flat, DVec2::from_angle(trace.turn)));
            share = 1.0;
        } else {
            share *= 0.5;
        }
        if best.0 <= exact {
            break;
        }
        vector = best.1 + best.2 * share;
        if !(vector.length() <= 2.0 * longest) {
            break;
        }
    }
    let (miss, covered, correction) = best;
    let found = covered + correction;
    (miss <= exact.max(NEAR * found.length()) && found.length() <= longest).then(|| found.to_array())
}

/// Whether locations at one place are on one sheet: their samples are the same or neighbours.
fn same_place(surface: &dyn Surface, at: &Location, to: &Location) -> bool {
    let (Some(a), Some(b)) = (surface.nearest_sample(at), surface.nearest_sample(to)) else { return false };
    a == b || surface.neighbours(a).iter().any(|edge| edge.j == b)
}
