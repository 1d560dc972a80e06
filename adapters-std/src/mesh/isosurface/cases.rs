//! The triangles of a cube for each of the 256 ways in which its corners can lie inside and outside.
//!
//! The table is derived, not written down. On each face of the cube every run of neighbouring inside corners is cut off
//! by one segment (so that of two opposite inside corners each is cut off alone); both cubes at the face find the same
//! segments. The segments form loops, which are filled by triangles none of whose inner edges lies in a face of the cube.

use std::sync::LazyLock;

/// A cube has its corner `x + 2 y + 4 z` at `(x, y, z)`; a side runs along `axis` from the corner `base`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Side {
    pub axis: usize,
    pub base: usize,
}

/// The twelve sides of a cube: those along x, then y, then z.
pub(super) const SIDES: [Side; 12] = {
    let mut sides = [Side { axis: 0, base: 0 }; 12];
    let (mut axis, mut n) = (0, 0);
    while axis < 3 {
        let mut base = 0;
        while base < 8 {
            if base >> axis & 1 == 0 {
                sides[n] = Side { axis, base };
                n += 1;
            }
            base += 1;
        }
        axis += 1;
    }
    sides
};

/// For each set of inside corners (a bit each), triangles of sides, counter-clockwise seen from outside.
pub(super) static CASES: LazyLock<Vec<Vec<[u8; 3]>>> = LazyLock::new(|| (0..256).map(triangles).collect());

fn triangles(inside: usize) -> Vec<[u8; 3]> {
    let mut next = [None; 12];
    for (axis, side) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
        let corners = face(axis, side);
        let is_inside = |step: usize| inside >> corners[step % 4] & 1 == 1;
        for start in 0..4 {
            if is_inside(start) && !is_inside(start + 3) {
                let length = (1..4).find(|&n| !is_inside(start + n)).unwrap_or(3);
                let (first, last) = (corners[start], corners[(start + length - 1) % 4]);
                let (before, after) = (corners[(start + 3) % 4], corners[(start + length) % 4]);
                next[side_between(before, first)] = Some(side_between(last, after));
            }
        }
    }
    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut polygon = Vec::new();
        let mut side = start;
        while let Some(following) = next[side].take() {
            polygon.push(side);
            side = following;
        }
        if polygon.len() >= 3 {
            let filled = filling(&polygon);
            triangles.extend(filled.iter().flatten().map(|t| t.map(|side| side as u8)));
        }
    }
    triangles
}

/// The corners of a face of the cube, counter-clockwise seen from outside.
fn face(axis: usize, side: usize) -> [usize; 4] {
    let (a, b) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let base = side << axis;
    if side == 1 { [base, base + a, base + a + b, base + b] } else { [base, base + b, base + a + b, base + a] }
}

fn side_between(a: usize, b: usize) -> usize {
    SIDES.iter().position(|side| side.base == a.min(b) && 1 << side.axis == a ^ b).unwrap_or(0)
}

/// Whether both sides belong to one face of the cube.
fn share_a_face(a: usize, b: usize) -> bool {
    let (a, b) = (SIDES[a], SIDES[b]);
    (0..3).any(|axis| axis != a.axis && axis != b.axis && (a.base ^ b.base) >> axis & 1 == 0)
}

/// Triangles that fill a polygon with no inner edge in a face of the cube; `None` if there are no such.
fn filling(polygon: &[usize]) -> Option<Vec<[usize; 3]>> {
    let (&[first, .., last], n) = (polygon, polygon.len()) else { return Some(Vec::new()) };
    if n < 3 {
        return Some(Vec::new());
    }
    (1..n - 1).find_map(|apex| {
        let allowed = |from: usize, to: usize| to - from == 1 || !share_a_face(polygon[from], polygon[to]);
        if !allowed(0, apex) || !allowed(apex, n - 1) {
            return None;
        }
        let mut triangles = filling(&polygon[..=apex])?;
        triangles.extend(filling(&polygon[apex..])?);
        triangles.push([first, polygon[apex], last]);
        Some(triangles)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_is_filled_from_all_its_sides() {
        for (inside, triangles) in CASES.iter().enumerate() {
            let crossed = (0..12)
                .filter(|&s| (inside >> SIDES[s].base ^ inside >> (SIDES[s].base | 1 << SIDES[s].axis)) & 1 == 1);
            let mut used: Vec<u8> = triangles.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            assert!(crossed.map(|s| s as u8).eq(used.iter().copied()), "case {inside}");
        }
    }

    #[test]
    fn one_inside_corner_is_cut_off_by_a_triangle_that_faces_away() {
        // Sides 0, 4 and 8 leave corner 0 along x, y and z.
        let [triangle] = CASES[1][..] else { panic!("one triangle") };
        let start = triangle.iter().position(|&side| side == 0).unwrap();
        assert_eq!([0, 1, 2].map(|step| triangle[(start + step) % 3]), [0, 4, 8]);
        assert!(CASES[0].is_empty() && CASES[255].is_empty());
    }
}
