//! Which edges and vertices of a surface border on a wide hole.

use glam::DVec3;

use super::pseudo_normals::edge_key;
use super::triangle::on_triangle;
use super::triangles::{Feature, TriangleTree};
use crate::mesh::Topology;

/// The edges and vertices at holes that are wider than a given width.
#[derive(Debug)]
pub(super) struct WideHoles {
    /// Sorted keys of the edges.
    edges: Vec<u64>,
    /// Sorted.
    vertices: Vec<u32>,
}

impl WideHoles {
    /// Those of a surface. The outer border of an open surface is a hole, too. There is none where another piece of the surface lies
    /// at most `layer` above or below the border and does not end there, or begins beyond it.
    ///
    /// `tree` and `topology` are of the same faces.
    pub fn of(tree: &TriangleTree, topology: &Topology, positions: &[[f64; 3]], widest: f64, layer: f64) -> Self {
        let (mut edges, mut vertices) = (Vec::new(), Vec::new());
        let patches = topology.patches().of_face;
        for boundary in topology.boundary_loops() {
            let points: Vec<DVec3> = boundary.iter().map(|&v| positions[v as usize].into()).collect();
            if !(width(&points) > widest) {
                continue;
            }
            for (k, &from) in boundary.iter().enumerate() {
                let to = boundary[(k + 1) % boundary.len()];
                let Some(edge) = topology.edge_between(from, to) else { continue };
                let face = topology.edges()[edge as usize].faces[0];
                let [middle, beyond] = beyond(topology.corners(face), [from, to], positions, 2.0 * layer);
                let is_other = |other: u32| patches[other as usize] != patches[face as usize];
                let goes_on = |other, feature| is_other(other) && !tree.ends_at(other, feature);
                if !is_covered(tree, middle, layer, goes_on)
                    && !is_covered(tree, beyond, layer, |other, _| is_other(other))
                {
                    edges.push(edge_key(from, to));
                    vertices.extend([from, to]);
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        vertices.sort_unstable();
        vertices.dedup();
        WideHoles { edges, vertices }
    }

    /// Whether this part of a face with these vertices lies on the border of one.
    pub fn touch(&self, face: [u32; 3], feature: Feature) -> bool {
        match feature {
            Feature::Face => false,
            Feature::Edge(side) => {
                let (from, to) = (face[usize::from(side)], face[(usize::from(side) + 1) % 3]);
                self.edges.binary_search(&edge_key(from, to)).is_ok()
            }
            Feature::Vertex(corner) => self.vertices.binary_search(&face[usize::from(corner)]).is_ok(),
        }
    }

    /// The bytes that it occupies.
    pub fn n_bytes(&self) -> usize {
        8 * self.edges.capacity() + 4 * self.vertices.capacity()
    }
}

/// The middle of a face's side, and the place `step` beyond it in the plane of the face.
fn beyond(face: [u32; 3], [from, to]: [u32; 2], positions: &[[f64; 3]], step: f64) -> [DVec3; 2] {
    let at = |vertex: u32| DVec3::from_array(positions[vertex as usize]);
    let opposite = face.into_iter().find(|&vertex| vertex != from && vertex != to).unwrap_or(from);
    let (from, to, opposite) = (at(from), at(to), at(opposite));
    let along = (to - from).normalize_or_zero();
    let inwards = opposite - from;
    let middle = from * 0.5 + to * 0.5;
    [middle, middle - (inwards - along * inwards.dot(along)).normalize_or_zero() * step]
}

/// Whether a face is at most `radius` away that counts for the part of it that is closest.
fn is_covered(tree: &TriangleTree, p: DVec3, radius: f64, counts: impl Fn(u32, Feature) -> bool) -> bool {
    let mut is_covered = false;
    let squared = radius * radius;
    tree.bvh().nearest(p, squared, |slot| {
        let (triangle, face) = tree.triangle(slot);
        let on = on_triangle(p, triangle);
        is_covered |= on.squared <= squared && counts(face, on.feature);
        // Nothing is nearer than what covers.
        if is_covered { -1.0 } else { squared }
    });
    is_covered
}

/// How wide a closed polygon is: the short axis of the ellipse that has the polygon's area, that of its largest projection to a plane,
/// and whose long axis is the polygon's diameter. So a slit is as wide as its gap, however long and bent it is.
fn width(points: &[DVec3]) -> f64 {
    let Some(&first) = points.first() else { return 0.0 };
    let twice: DVec3 = points.windows(2).map(|side| (side[0] - first).cross(side[1] - first)).sum();
    let farthest = |from: DVec3| {
        let farther = |best: DVec3, &p: &DVec3| {
            if p.distance_squared(from) > best.distance_squared(from) { p } else { best }
        };
        points.iter().fold(from, farther)
    };
    // The farthest from the farthest: the diameter of what is not too far from round, never more.
    let end = farthest(first);
    let diameter = end.distance(farthest(end));
    if diameter > 0.0 { 2.0 * twice.length() / (std::f64::consts::PI * diameter) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(n: usize, at: impl Fn(f64) -> [f64; 3]) -> Vec<DVec3> {
        (0..n).map(|i| at(i as f64 / n as f64 * std::f64::consts::TAU).into()).collect()
    }

    #[test]
    fn a_round_hole_is_as_wide_as_its_diameter_and_a_slit_as_its_gap() {
        let round = ring(100, |t| [7.0, 40.0 * t.cos(), 40.0 * t.sin()]);
        assert!((width(&round) - 80.0).abs() < 0.2, "{}", width(&round));
        // There and back along a quarter of a circle.
        let slit = ring(200, |t| {
            let along = 0.5 * std::f64::consts::PI * (1.0 - (t / std::f64::consts::PI - 1.0).abs());
            let radius = if t < std::f64::consts::PI { 300.0 } else { 310.0 };
            [radius * along.cos(), 0.0, radius * along.sin()]
        });
        assert!((8.0..20.0).contains(&width(&slit)), "{}", width(&slit));
        assert_eq!((width(&[]), width(&[DVec3::ONE; 3])), (0.0, 0.0));
        assert!(width(&ring(9, |t| [1e70 * t.cos(), 1e70 * t.sin(), 0.0])).is_finite());
    }

    #[test]
    fn parts_of_the_border_of_a_wide_hole_are_told() {
        // A square and, far away, a triangle.
        let square = [[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 100.0, 0.0], [0.0, 100.0, 0.0]];
        let far = [[500.0, 0.0, 0.0], [503.0, 0.0, 0.0], [500.0, 3.0, 0.0]];
        let positions = [&square[..], &far].concat();
        let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6]];
        let holes = |positions: &[[f64; 3]], faces: &[[u32; 3]]| {
            let tree = TriangleTree::new(positions, faces).expect("faces fit");
            WideHoles::of(&tree, &Topology::new(positions.len(), faces), positions, 80.0, 6.0)
        };
        let alone = holes(&positions, &faces);
        assert!(alone.touch(faces[0], Feature::Edge(0)) && alone.touch(faces[1], Feature::Vertex(2)));
        assert!(!alone.touch(faces[0], Feature::Edge(2)) && !alone.touch(faces[0], Feature::Face));
        assert!(!alone.touch(faces[2], Feature::Edge(0)) && !alone.touch(faces[2], Feature::Vertex(1)));
        assert!(alone.n_bytes() >= 8 * 4 + 4 * 4);

        // A second square overlaps the first at x = 100, 4 mm above it.
        let second = square.map(|[x, y, _]| [x + 70.0, y * 1.2 - 10.0, 4.0]);
        let positions = [&positions[..], &second].concat();
        let faces = [&faces[..], &[[7, 8, 9], [7, 9, 10]]].concat();
        let both = holes(&positions, &faces);
        assert!(both.touch(faces[0], Feature::Edge(0)) && !both.touch(faces[0], Feature::Edge(1)));
        assert!(both.touch(faces[3], Feature::Edge(1)) && !both.touch(faces[4], Feature::Edge(2)));
    }
}
