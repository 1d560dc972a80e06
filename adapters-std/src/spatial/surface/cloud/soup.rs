//! The triangles of all stars together: a soup in which each is kept as often as points agree on it, with a third of the weight each
//! time (Sharp, Crane, A Laplacian for nonmanifold triangle meshes, 2020, section 5.7).

use super::neighbourhoods::Star;

/// A triangle between three points of a cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoupTriangle {
    /// Its points, the smallest index first, counter-clockwise seen from outside.
    pub points: [u32; 3],
    /// A third for each of its points in whose star it is.
    pub weight: f64,
}

/// The triangles, sorted by their points.
pub(super) fn soup(stars: &[Star]) -> Vec<SoupTriangle> {
    // The triangle as a set first, so that it counts once whichever way round its points see it.
    let mut all: Vec<([u32; 3], u32, [u32; 3])> = Vec::new();
    for (point, star) in stars.iter().enumerate() {
        let point = point as u32;
        for &[a, b] in &star.corners {
            let mut sorted = [point, a, b];
            let mut turned = sorted;
            sorted.sort_unstable();
            while turned[0] != sorted[0] {
                turned.rotate_left(1);
            }
            all.push((sorted, point, turned));
        }
    }
    all.sort_unstable();
    all.chunk_by(|a, b| a.0 == b.0)
        .map(|same| SoupTriangle { points: same[0].2, weight: same.len() as f64 / 3.0 })
        .collect()
}
