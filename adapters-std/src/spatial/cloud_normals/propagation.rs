//! One side for all points of a cloud that hang together, passed on along a minimum spanning tree (`hoppe1992`).

use glam::DVec3;
use rayon::prelude::*;

use super::planes::Planes;

/// The cosine between an edge and a normal above which the edge leads from one sheet to another.
const STEEP: f64 = 0.8;

/// Points that hang together, with normals that agree.
pub(super) struct Parts {
    /// One per point; zero for points in no part.
    pub normals: Vec<DVec3>,
    /// The points of each part, ascending; the largest part first, of equal ones that with the first point.
    pub members: Vec<Vec<u32>>,
}

/// An edge between neighbours. The order is that in which the tree takes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// The bits of a cost of at least 0, which sort as it does.
    cost: u32,
    ends: [u32; 2],
}

/// Whether the normals `m` and `n` of two points, `between` apart, have opposite signs, and what it costs to believe so: 0 for
/// two points of a plane or an arc, 1 where nothing can be told.
///
/// Mirrored at the plane in the middle, one normal of an arc of a circle becomes the other, for any angle between them; the
/// scalar product of the normals alone (`hoppe1992`) is wrong from a right angle on. But an edge along the normals would tie the
/// two sides of a thin sheet together, or two layers of a scan.
pub(super) fn opposite(m: DVec3, n: DVec3, between: DVec3) -> (bool, f64) {
    let along = between.normalize_or_zero();
    let (rise_m, rise_n) = (m.dot(along), n.dot(along));
    let agreement = m.dot(n) - 2.0 * rise_m * rise_n;
    let rise = rise_m.abs().max(rise_n.abs());
    (agreement < 0.0, if rise > STEEP { 1.0 } else { 1.0 - agreement.abs() })
}

impl Parts {
    /// Those of the cloud, each turned either way.
    pub fn of(points: &[[f64; 3]], planes: &Planes) -> Self {
        let has_normal = |index: u32| planes.normals[index as usize] != DVec3::ZERO;
        let told = |[a, b]: [u32; 2]| {
            let [p, q] = [a, b].map(|index| DVec3::from_array(points[index as usize]));
            opposite(planes.normals[a as usize], planes.normals[b as usize], q - p)
        };
        let mut edges: Vec<Edge> = (0..points.len() as u32)
            .into_par_iter()
            .flat_map_iter(|index| {
                // An edge between mutual neighbours comes from its first end alone.
                let ends = planes.of_point(index as usize).iter().filter_map(move |&other| {
                    let is_mutual = || planes.of_point(other as usize).contains(&index);
                    let wanted = has_normal(index) && has_normal(other) && (index < other || !is_mutual());
                    wanted.then_some([index.min(other), index.max(other)])
                });
                ends.map(|ends| Edge { cost: (told(ends).1.max(0.0) as f32).to_bits(), ends })
            })
            .collect();
        edges.par_sort_unstable();
        let mut forest = Forest::new(points.len());
        for edge in edges {
            forest.join(edge.ends, || told(edge.ends).0);
        }
        forest.parts(planes)
    }

    /// Turns a part when the sign is negative.
    pub fn turn(&mut self, part: usize, sign: f64) {
        for &index in self.members[part].iter().filter(|_| sign < 0.0) {
            self.normals[index as usize] = -self.normals[index as usize];
        }
    }
}

/// Trees that grow together; each point knows whether it is opposite to its root.
struct Forest {
    parents: Vec<u32>,
    /// Whether a point is opposite to its parent.
    is_opposite: Vec<bool>,
    sizes: Vec<u32>,
}

impl Forest {
    fn new(n: usize) -> Self {
        Forest { parents: (0..n as u32).collect(), is_opposite: vec![false; n], sizes: vec![1; n] }
    }

    /// The root of a point, and whether the point is opposite to it. Shortens the way for the next time.
    fn root(&mut self, point: u32) -> (u32, bool) {
        let (mut root, mut opposite) = (point, false);
        while self.parents[root as usize] != root {
            opposite ^= self.is_opposite[root as usize];
            root = self.parents[root as usize];
        }
        let (mut at, mut of_rest) = (point, opposite);
        while self.parents[at as usize] != root && at != root {
            let next = self.parents[at as usize];
            let after = of_rest ^ self.is_opposite[at as usize];
            self.parents[at as usize] = root;
            self.is_opposite[at as usize] = of_rest;
            (at, of_rest) = (next, after);
        }
        (root, opposite)
    }

    /// Joins the trees of two points, which are opposite or not, unless they are one.
    fn join(&mut self, [a, b]: [u32; 2], are_opposite: impl Fn() -> bool) {
        let ((root_a, of_a), (root_b, of_b)) = (self.root(a), self.root(b));
        if root_a == root_b {
            return;
        }
        let is_a_larger = self.sizes[root_a as usize] >= self.sizes[root_b as usize];
        let (large, small) = if is_a_larger { (root_a, root_b) } else { (root_b, root_a) };
        self.parents[small as usize] = large;
        self.is_opposite[small as usize] = of_a ^ of_b ^ are_opposite();
        self.sizes[large as usize] += self.sizes[small as usize];
    }

    fn parts(mut self, planes: &Planes) -> Parts {
        let n = self.parents.len();
        let mut normals = vec![DVec3::ZERO; n];
        let mut part_of_root = vec![u32::MAX; n];
        let mut members: Vec<Vec<u32>> = Vec::new();
        for point in 0..n as u32 {
            let normal = planes.normals[point as usize];
            if normal == DVec3::ZERO {
                continue;
            }
            let (root, opposite) = self.root(point);
            let part = &mut part_of_root[root as usize];
            if *part == u32::MAX {
                *part = members.len() as u32;
                members.push(Vec::new());
            }
            members[*part as usize].push(point);
            normals[point as usize] = if opposite { -normal } else { normal };
        }
        // The sort is stable: parts of one size stay in the order of their first points.
        members.sort_by_key(|points| std::cmp::Reverse(points.len()));
        Parts { normals, members }
    }
}
