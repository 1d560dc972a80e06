//! Small meshes whose connections are known, and what holds for any faces.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

/// A grid of `columns x rows` quads, each two triangles, whose first and last column or row may be the same.
fn grid(columns: u32, rows: u32, [wraps_x, wraps_y]: [bool; 2]) -> (usize, Vec<[u32; 3]>) {
    let wide = if wraps_x { columns } else { columns + 1 };
    let high = if wraps_y { rows } else { rows + 1 };
    let at = |x: u32, y: u32| (y % high) * wide + x % wide;
    let quads = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    let faces = quads.flat_map(|(x, y)| {
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
        [[a, b, c], [a, c, d]]
    });
    ((wide * high) as usize, faces.collect())
}

/// A band of `n` quads that is turned once before it is closed.
fn moebius(n: u32) -> Vec<[u32; 3]> {
    let corner = |i: u32, side: u32| if i < n { 2 * i + side } else { 1 - side };
    (0..n)
        .flat_map(|i| {
            let [a, b, c, d] = [corner(i, 0), corner(i + 1, 0), corner(i + 1, 1), corner(i, 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect()
}

fn only(topology: &Topology) -> Component {
    let mut components = topology.components().all;
    assert_eq!(components.len(), 1);
    components.remove(0)
}

#[test]
fn genus_and_loops_of_square_tube_torus_and_moebius_strip() {
    for (wraps, euler, loops, genus) in
        [([false, false], 1, 1, Ok(0)), ([true, false], 0, 2, Ok(0)), ([true, true], 0, 0, Ok(1))]
    {
        let (n, faces) = grid(5, 4, wraps);
        let topology = Topology::new(n, &faces);
        let component = only(&topology);
        assert_eq!((component.euler(), component.n_boundary_loops, component.genus()), (euler, loops, genus));
        assert_eq!(topology.is_closed(), loops == 0);
        assert!(topology.non_manifold_vertices().is_empty());
    }
    let topology = Topology::new(10, &moebius(5));
    let component = only(&topology);
    assert_eq!((component.n_boundary_loops, component.n_inconsistent_edges), (1, 1));
    assert_eq!(component.genus(), Err(NoGenus::NotOrientable));
    assert_eq!(topology.boundary_loops()[0].len(), 10);
}

#[test]
fn loops_have_the_surface_on_their_left() {
    let (n, faces) = grid(1, 1, [false, false]);
    assert_eq!(Topology::new(n, &faces).boundary_loops(), [[0, 1, 3, 2]]);
    // A face that is turned inside out does not break the loop.
    assert_eq!(Topology::new(n, &[[0, 1, 3], [0, 2, 3]]).boundary_loops(), [[0, 1, 3, 2]]);
}

#[test]
fn loops_that_touch_at_a_vertex_stay_apart() {
    // A bow-tie: two triangles at vertex 0.
    let topology = Topology::new(5, &[[0, 1, 2], [0, 3, 4]]);
    assert_eq!(topology.boundary_loops(), [[0, 1, 2], [0, 3, 4]]);
    assert_eq!(topology.non_manifold_vertices(), [0]);
    assert_eq!(topology.fans(0).len(), 2);
    assert_eq!(only(&topology).genus(), Err(NoGenus::NonManifold));
    // Two holes of a sheet that meet at its middle vertex: its two fans do not, so that the holes are one, passing it twice.
    let (n, mut faces) = grid(4, 4, [false, false]);
    let hole = |x: u32, y: u32| (2 * (y * 4 + x)) as usize;
    for at in [hole(2, 2), hole(1, 1)] {
        faces.drain(at..at + 2);
    }
    let mut lengths: Vec<usize> = Topology::new(n, &faces).boundary_loops().iter().map(Vec::len).collect();
    lengths.sort_unstable();
    assert_eq!(lengths, [8, 16]);
}

#[test]
fn an_edge_with_three_faces_parts_their_fans() {
    let topology = Topology::new(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
    let edge = topology.edge_between(1, 0).expect("it is there");
    assert_eq!(topology.class(edge), EdgeClass::NonManifold);
    assert_eq!(topology.fans(0).len(), 3);
    assert_eq!(topology.boundary_loops().len(), 3);
    assert_eq!(topology.edge_between(2, 3), None);
    assert_eq!(topology.count(EdgeClass::Boundary), 6);
}

#[test]
fn rings_are_in_order() {
    let (n, faces) = grid(2, 2, [false, false]);
    let topology = Topology::new(n, &faces);
    let middle = topology.one_ring(4).expect("one fan");
    assert!(middle.is_closed && middle.faces.len() == 6);
    let at = middle.vertices.iter().position(|&v| v == 5).expect("a neighbour");
    let turned: Vec<u32> = (0..6).map(|k| middle.vertices[(at + k) % 6]).collect();
    assert_eq!(turned, [5, 8, 7, 3, 0, 1]);
    let corner = topology.one_ring(0).expect("one fan");
    assert_eq!((corner.vertices, corner.is_closed), (vec![1, 4, 3], false));
    assert!(topology.is_boundary_vertex(0) && !topology.is_boundary_vertex(4));
}

#[test]
fn faces_that_cannot_be_one_are_passed_over() {
    let topology = Topology::new(3, &[[0, 0, 1], [0, 1, 2], [0, 1, 3]]);
    assert_eq!(topology.edges().len(), 3);
    assert_eq!(topology.edges_of_face(0), [u32::MAX; 3]);
    assert_eq!(topology.edges_of_face(2), [u32::MAX; 3]);
    assert_eq!(topology.components().of_face, [u32::MAX, 0, u32::MAX]);
    assert_eq!(Topology::new(0, &[]).components().all.len(), 0);
}

proptest! {
    #[test]
    fn any_faces_have_edges_fans_and_loops_that_fit(faces in prop::collection::vec([0u32..9, 0u32..9, 0u32..9], 0..24)) {
        let topology = Topology::new(9, &faces);
        let mut expected = BTreeMap::<[u32; 2], Vec<u32>>::new();
        for (number, face) in faces.iter().enumerate().filter(|(_, [a, b, c])| a != b && b != c && c != a) {
            for [a, b] in sides(*face) {
                expected.entry([a.min(b), a.max(b)]).or_default().push(number as u32);
            }
        }
        prop_assert_eq!(topology.edges().len(), expected.len());
        for (edge, (vertices, faces)) in topology.edges().iter().zip(&expected) {
            prop_assert_eq!((&edge.vertices, &edge.faces[..]), (vertices, &faces[..]));
        }
        for (face, edges) in faces.iter().enumerate().map(|(n, f)| (f, topology.edges_of_face(n as u32))) {
            for (edge, [a, b]) in edges.into_iter().zip(sides(*face)).filter(|(edge, _)| *edge != u32::MAX) {
                prop_assert_eq!(topology.edges()[edge as usize].vertices, [a.min(b), a.max(b)]);
            }
        }
        for vertex in 0..9 {
            let fans = topology.fans(vertex);
            let mut all: Vec<u32> = fans.iter().flat_map(|fan| fan.faces.clone()).collect();
            all.sort_unstable();
            prop_assert_eq!(&all, topology.faces_of_vertex(vertex));
            prop_assert_eq!(topology.has_several_fans(vertex), fans.len() > 1);
            for fan in &fans {
                prop_assert_eq!(fan.vertices.len(), fan.faces.len() + usize::from(!fan.is_closed));
                for (k, face) in fan.faces.iter().enumerate() {
                    let corners = faces[*face as usize];
                    let next = fan.vertices[(k + 1) % fan.vertices.len()];
                    prop_assert!(corners.contains(&fan.vertices[k]) && corners.contains(&next));
                }
            }
        }
        // Every side at an edge without exactly two faces is in exactly one loop.
        let n_sides: usize = expected.values().filter(|faces| faces.len() != 2).map(Vec::len).sum();
        prop_assert_eq!(topology.boundary_loops().iter().map(Vec::len).sum::<usize>(), n_sides);
        let components = topology.components();
        prop_assert_eq!(components.all.iter().map(|c| c.n_edges).sum::<usize>(), expected.len());
        for component in &components.all {
            if component.n_non_manifold_edges + component.n_non_manifold_vertices == 0 && component.is_orientable {
                // 2 - b - chi is even and not negative.
                let rest = 2 - component.n_boundary_loops as i64 - component.euler();
                prop_assert!(rest >= 0 && rest % 2 == 0, "{:?}", component);
            }
        }
    }
}
