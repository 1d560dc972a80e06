//! Areas, volume, centroid and edge lengths of a triangle mesh.

use glam::DVec3;

use super::{Mesh, Topology};

/// Lengths of the edges of a mesh, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeLengths {
    /// The shortest.
    pub min: f64,
    /// The median; of an even number of edges the larger of the middle two.
    pub median: f64,
    /// The mean, each edge counted once.
    pub mean: f64,
    /// The longest.
    pub max: f64,
}

impl Mesh {
    /// The area of each face, in the square of the unit. A face that names a vertex that does not exist has none.
    pub fn face_areas(&self) -> Vec<f64> {
        self.faces.iter().map(|&face| self.doubled_area(face).length() / 2.0).collect()
    }

    /// The sum of the areas of the faces, in file order.
    pub fn area(&self) -> f64 {
        self.faces.iter().map(|&face| self.doubled_area(face).length() / 2.0).sum()
    }

    /// One area per vertex: a third of the areas of its faces (lumped mass), summed in file order.
    pub fn vertex_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.positions.len()];
        for (&face, area) in self.faces.iter().zip(self.face_areas()) {
            for vertex in face {
                if let Some(sum) = areas.get_mut(vertex as usize) {
                    *sum += area / 3.0;
                }
            }
        }
        areas
    }

    /// The volume that the mesh encloses, positive when its faces are counter-clockwise seen from outside. Of a mesh with a
    /// boundary it is that of the cone over the boundary from the first corner of the first face, and says little.
    ///
    /// `V = sum over faces of (a - o) . ((b - o) x (c - o)) / 6`, with `o` the first corner of the first face, which keeps
    /// the terms small where the mesh lies far from the origin.
    pub fn signed_volume(&self) -> f64 {
        self.signed_volume_of(0..self.faces.len())
    }

    /// [`Self::signed_volume`] of some of the faces.
    pub(crate) fn signed_volume_of(&self, faces: impl IntoIterator<Item = usize>) -> f64 {
        let mut origin = None;
        let mut sum = 0.0;
        for corners in faces.into_iter().filter_map(|face| self.corners(*self.faces.get(face)?)) {
            let origin = *origin.get_or_insert(corners[0]);
            let [a, b, c] = corners.map(|corner| corner - origin);
            // (b - a) x (c - a) changes but its sign when the face is turned, bit for bit.
            sum += a.dot((b - a).cross(c - a));
        }
        sum / 6.0
    }

    /// The centre of the surface: the mean of the centres of the faces weighted by their areas; `None` where there is no
    /// area.
    pub fn centroid(&self) -> Option<[f64; 3]> {
        let (mut sum, mut total) = (DVec3::ZERO, 0.0);
        for (&face, area) in self.faces.iter().zip(self.face_areas()) {
            let Some([a, b, c]) = self.corners(face) else { continue };
            sum += (a + b + c) / 3.0 * area;
            total += area;
        }
        (total > 0.0).then(|| (sum / total).to_array())
    }

    /// Statistics of the lengths of the edges; `None` without edges.
    pub fn edge_lengths(&self, topology: &Topology) -> Option<EdgeLengths> {
        let at = |vertex: u32| self.positions.get(vertex as usize).copied().map(DVec3::from_array);
        let mut lengths: Vec<f64> = topology
            .edges()
            .iter()
            .filter_map(|edge| Some(at(edge.vertices[0])?.distance(at(edge.vertices[1])?)))
            .collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let middle = lengths.len() / 2;
        let (below, median, above) =
            (!lengths.is_empty()).then(|| lengths.select_nth_unstable_by(middle, f64::total_cmp))?;
        let min = below.iter().fold(*median, |least, &length| least.min(length));
        let max = above.iter().fold(*median, |most, &length| most.max(length));
        Some(EdgeLengths { min, median: *median, mean, max })
    }

    /// The corners of a face, when they exist.
    fn corners(&self, face: [u32; 3]) -> Option<[DVec3; 3]> {
        let at = |k: usize| self.positions.get(face[k] as usize).copied().map(DVec3::from_array);
        Some([at(0)?, at(1)?, at(2)?])
    }

    /// The normal of a face whose length is twice its area; zero where a corner does not exist.
    pub(super) fn doubled_area(&self, face: [u32; 3]) -> DVec3 {
        self.corners(face).map_or(DVec3::ZERO, |[a, b, c]| (b - a).cross(c - a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 1 x 2 x 3 away from the origin, outwards.
    fn cuboid() -> Mesh {
        let positions = (0..8).map(|i| [10.0 + f64::from(i & 1), f64::from(i & 2), 1.5 * f64::from((i & 4) / 2)]);
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Mesh { positions: positions.collect(), faces, ..Mesh::default() }
    }

    #[test]
    fn cuboid_has_the_figures_of_a_cuboid() {
        let mut mesh = cuboid();
        assert_eq!((mesh.area(), mesh.signed_volume()), (22.0, 6.0));
        assert_eq!(mesh.centroid(), Some([10.5, 1.0, 1.5]));
        assert!((mesh.vertex_areas().iter().sum::<f64>() - 22.0).abs() < 1e-13);
        let topology = Topology::new(8, &mesh.faces);
        let lengths = mesh.edge_lengths(&topology).expect("edges");
        assert_eq!((lengths.min, lengths.max), (1.0, 13.0_f64.sqrt()));
        let mean = (4.0 * 6.0 + 2.0 * (5.0_f64.sqrt() + 10.0_f64.sqrt() + 13.0_f64.sqrt())) / 18.0;
        assert!((lengths.mean - mean).abs() < 1e-14);
        assert_eq!(lengths.median, 5.0_f64.sqrt());
        mesh.faces.iter_mut().for_each(|face| face.swap(1, 2));
        assert_eq!(mesh.signed_volume(), -6.0);
    }

    #[test]
    fn nothing_has_no_figures() {
        let cloud = Mesh { positions: vec![[1.0; 3]; 3], ..Mesh::default() };
        assert_eq!((cloud.area(), cloud.signed_volume(), cloud.centroid()), (0.0, 0.0, None));
        assert_eq!(cloud.edge_lengths(&Topology::new(3, &[])), None);
        let broken = Mesh { faces: vec![[0, 1, 9]], ..cloud };
        assert_eq!((broken.face_areas(), broken.vertex_areas()), (vec![0.0], vec![0.0; 3]));
    }
}
