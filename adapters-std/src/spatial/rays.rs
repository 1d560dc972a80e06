//! Where rays meet a triangle mesh.

use glam::DVec3;
use rayon::prelude::*;

use super::triangle::Sheared;
use super::triangles::TriangleTree;

/// A ray, or a piece of one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it begins.
    pub origin: [f64; 3],
    /// Where it goes; of any length between 1e-70 and 1e70.
    pub direction: [f64; 3],
    /// Where it ends, in multiples of the direction's length.
    pub longest: f64,
}

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// The distance from the origin in multiples of the direction's length.
    pub t: f64,
    /// The face.
    pub face: u32,
    /// Barycentric coordinates of the point in the face.
    pub barycentric: [f64; 3],
}

impl TriangleTree {
    /// All places where the ray meets the mesh at `t >= 0`, nearest first, equally near ones by face.
    ///
    /// A ray through an edge or a vertex meets every face at it, and never none; a face that it sees from the edge it does not meet.
    /// A ray that is not finite or has no direction meets nothing.
    pub fn hits(&self, origin: [f64; 3], direction: [f64; 3]) -> Vec<RayHit> {
        let mut hits = Vec::new();
        let (o, d) = (DVec3::from_array(origin), DVec3::from_array(direction));
        let sheared = Sheared::new(o, d);
        self.bvh().along(o, d, f64::INFINITY, |slot| {
            let (triangle, face) = self.triangle(slot);
            if let Some((t, barycentric)) = sheared.meets(triangle) {
                hits.push(RayHit { t, face, barycentric });
            }
            f64::INFINITY
        });
        hits.sort_unstable_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)));
        hits
    }

    /// The first place where the ray meets the mesh at `0 <= t <= longest`; of equally near ones that of the smallest face.
    pub fn first_hit(&self, origin: [f64; 3], direction: [f64; 3], longest: f64) -> Option<RayHit> {
        let mut first: Option<RayHit> = None;
        let (o, d) = (DVec3::from_array(origin), DVec3::from_array(direction));
        let sheared = Sheared::new(o, d);
        self.bvh().along(o, d, longest, |slot| {
            let (triangle, face) = self.triangle(slot);
            if let Some((t, barycentric)) = sheared.meets(triangle)
                && t <= longest
                && first.is_none_or(|first| t < first.t || (t == first.t && face < first.face))
            {
                first = Some(RayHit { t, face, barycentric });
            }
            first.map_or(longest, |first| first.t)
        });
        first
    }

    /// [`Self::first_hit`] of each ray, over all threads.
    pub fn first_hit_all(&self, rays: &[Ray]) -> Vec<Option<RayHit>> {
        rays.par_iter().with_min_len(64).map(|ray| self.first_hit(ray.origin, ray.direction, ray.longest)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::samples::{bumpy_sphere, lattice_faces, lattice_positions, wild_positions};
    use proptest::prelude::*;

    /// All hits, from every triangle in turn.
    fn slowly(positions: &[[f64; 3]], faces: &[[u32; 3]], origin: [f64; 3], direction: [f64; 3]) -> Vec<RayHit> {
        let ray = Sheared::new(origin.into(), direction.into());
        let mut hits: Vec<RayHit> = Vec::new();
        for (face, corners) in faces.iter().enumerate() {
            let corners = corners.map(|v| DVec3::from_array(positions[v as usize]));
            hits.extend(ray.meets(&corners).map(|(t, barycentric)| RayHit { t, face: face as u32, barycentric }));
        }
        hits.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)));
        hits
    }

    proptest! {
        #[test]
        fn hits_are_those_of_every_triangle_in_turn(
            positions in lattice_positions(),
            faces in lattice_faces(),
            origin in prop::array::uniform3(-5_i8..5),
            direction in prop::array::uniform3(-2_i8..3),
            shift in prop_oneof![Just(0.0), Just(1e6)],
        ) {
            prop_assume!(direction != [0; 3]);
            let positions: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| x + shift)).collect();
            let (origin, direction) = (origin.map(|x| f64::from(x) + shift), direction.map(f64::from));
            let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
            let all = slowly(&positions, &faces, origin, direction);
            prop_assert_eq!(tree.hits(origin, direction), all.clone());
            for longest in [0.5, 1.0, 1e9] {
                let first = all.first().copied().filter(|hit| hit.t <= longest);
                prop_assert_eq!(tree.first_hit(origin, direction, longest), first);
                prop_assert_eq!(tree.first_hit_all(&[Ray { origin, direction, longest }]), vec![first]);
            }
        }
    }

    proptest! {
        #[test]
        fn hits_from_afar_are_those_of_every_triangle_in_turn(
            positions in wild_positions(),
            faces in lattice_faces(),
            to in 0_usize..12,
            direction in prop::array::uniform3(-1.0_f64..1.0),
            distance in prop_oneof![Just(1.0), Just(1e9), Just(1e15), Just(1e40)],
            scale in prop_oneof![Just(1.0), Just(1e-40), Just(1e20)],
        ) {
            let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
            // Through a vertex, but for rounding.
            let origin = std::array::from_fn(|k| positions[to][k] - distance * direction[k]);
            let direction = direction.map(|x| x * scale);
            let all = slowly(&positions, &faces, origin, direction);
            prop_assert_eq!(tree.hits(origin, direction), all.clone());
            prop_assert_eq!(tree.first_hit(origin, direction, f64::INFINITY), all.first().copied());
        }
    }

    #[test]
    fn a_ray_through_any_vertex_or_edge_of_a_closed_mesh_goes_in_and_out() {
        let (positions, faces) = bumpy_sphere(12);
        let tree = TriangleTree::new(&positions, &faces).expect("faces fit");
        let origin = [0.01, -0.02, 0.03];
        let to = |p: [f64; 3]| std::array::from_fn(|k| p[k] - origin[k]);
        for face in &faces {
            let [a, b, _] = face.map(|v| positions[v as usize]);
            let middle = std::array::from_fn(|k| 0.5 * a[k] + 0.5 * b[k]);
            for direction in [to(a), to(middle)] {
                let hit = tree.first_hit(origin, direction, 2.0).expect("the surface goes all around");
                assert!((hit.t - 1.0).abs() < 1e-3, "{hit:?}");
            }
        }
    }

    #[test]
    fn rays_that_are_none_meet_nothing() {
        let tree = TriangleTree::new(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]]).expect("a face");
        let (o, d) = ([0.1, 0.1, -1.0], [0.0, 0.0, 2.0]);
        assert_eq!(tree.hits(o, d).iter().map(|hit| hit.t).collect::<Vec<_>>(), [0.5]);
        for spoilt in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(tree.hits([0.1, spoilt, -1.0], d), []);
            assert_eq!(tree.hits(o, [0.0, spoilt, 2.0]), []);
        }
        assert_eq!(tree.hits(o, [0.0; 3]), []);
        assert_eq!(tree.first_hit(o, d, f64::NAN), None);
    }
}
