//! The inside test on small surfaces whose sides are known.

use super::*;
use crate::spatial::samples::{bumpy_sphere, lattice_faces, lattice_positions};
use proptest::prelude::*;

/// The bumpy sphere, 100 mm in radius, and its faces.
fn sphere() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let (positions, faces) = bumpy_sphere(16);
    (positions.into_iter().map(|p| p.map(|x| 100.0 * x)).collect(), faces)
}

fn options(most_inward: f64) -> InsideOptions {
    InsideOptions { most_inward, ..InsideOptions::default() }
}

/// Positions in and around the sphere.
fn spread(n: usize) -> Vec<[f64; 3]> {
    let at = |i: usize, step: f64| ((i as f64 * step).fract() * 2.0 - 1.0) * 160.0;
    (1..=n).map(|i| [at(i, 0.819_172_513), at(i, 0.671_043_606), at(i, 0.549_700_477)]).collect()
}

#[test]
fn sides_of_a_closed_surface_are_those_of_the_normal() {
    let (positions, faces) = sphere();
    let test = InsideTest::new(&positions, &faces, InsideOptions::default()).expect("faces fit");
    assert_eq!((test.n_inward(), test.turned_faces()), (0, &[][..]));
    let asked = spread(2000);
    let told = test.at_all(&asked);
    let hints: Vec<u32> = told.iter().map(|sided| sided.closest.face).collect();
    assert_eq!(test.at_all_from(&asked, &hints[..1000]), told);
    let mut n = [0; 3];
    for (&p, sided) in asked.iter().zip(&told) {
        assert_eq!(*sided, test.at(p));
        let signed = sided.closest.signed_distance(p);
        assert_eq!(sided.signed_distance, signed);
        assert_eq!(sided.side, if signed > 3.0 { Side::Outside } else { Side::Inside });
        n[sided.side as usize] += 1;
    }
    assert!(n[0] > 100 && n[1] > 100 && n[2] == 0, "{n:?}");
}

#[test]
fn a_narrow_hole_is_bridged_and_at_a_wide_one_nothing_is_known() {
    let (positions, faces) = sphere();
    let without_top = |height: f64| -> InsideTest {
        let is_left = |face: &&[u32; 3]| face.iter().all(|&v| positions[v as usize][1] < height);
        let left: Vec<[u32; 3]> = faces.iter().filter(is_left).copied().collect();
        InsideTest::new(&positions, &left, InsideOptions::default()).expect("faces fit")
    };
    let (narrow, wide) = (without_top(118.0), without_top(60.0));
    let (above, below, middle) = ([3.0, 145.0, 2.0], [3.0, 95.0, 2.0], [0.0, 0.0, 0.0]);
    let side = |test: &InsideTest, p| test.at(p).side;
    assert_eq!([above, below, middle].map(|p| side(&narrow, p)), [Side::Outside, Side::Inside, Side::Inside]);
    assert_eq!(side(&wide, above), Side::Unknown);
    assert_eq!(side(&wide, [0.0, -150.0, 0.0]), Side::Outside);
    assert_eq!(side(&wide, [0.0, -80.0, 0.0]), Side::Inside);
    assert!(narrow.at(below).closest.on_boundary && narrow.at(below).signed_distance < 0.0);
}

#[test]
fn faces_that_look_inwards_are_turned_when_they_are_too_many() {
    let (positions, mut faces) = sphere();
    let turned: Vec<u32> = (0..faces.len() as u32).filter(|face| face % 7 == 3).collect();
    turned.iter().for_each(|&face| faces[face as usize].swap(1, 2));
    let test = InsideTest::new(&positions, &faces, InsideOptions::default()).expect("faces fit");
    assert_eq!((test.n_inward(), test.turned_faces()), (turned.len(), &turned[..]));
    assert_eq!(test.at([0.0; 3]).side, Side::Inside);
    assert!((test.at([0.0; 3]).winding - 1.0).abs() < 0.01);
    assert_eq!(InsideTest::new(&positions, &faces, options(0.2)).expect("faces fit").turned_faces(), &[0; 0]);
}

#[test]
fn a_whole_surface_inside_out_is_turned_and_so_are_pieces_of_it() {
    let (positions, faces) = sphere();
    let inside_out: Vec<[u32; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let test = InsideTest::new(&positions, &inside_out, InsideOptions::default()).expect("faces fit");
    assert_eq!(test.turned_faces().len(), faces.len());
    // Two halves with a slit between them; the upper one is inside out. Rays leave through the slit here and there.
    let low = |face: &[u32; 3]| face.iter().all(|&v| positions[v as usize][1] <= 1.0);
    let high = |face: &[u32; 3]| face.iter().all(|&v| positions[v as usize][1] >= 5.0);
    let upper: Vec<[u32; 3]> = inside_out.iter().filter(|face| high(face)).copied().collect();
    let mut halves: Vec<[u32; 3]> = faces.iter().filter(|face| low(face)).copied().collect();
    let n_low = halves.len() as u32;
    halves.extend(upper);
    let test = InsideTest::new(&positions, &halves, InsideOptions::default()).expect("faces fit");
    assert_eq!(test.turned_faces(), (n_low..halves.len() as u32).collect::<Vec<_>>());
    assert_eq!(test.at([0.0, 90.0, 0.0]).side, Side::Inside);
    assert_eq!(test.at([0.0, 150.0, 0.0]).side, Side::Outside);
}

#[test]
fn layers_do_not_turn_each_other() {
    // The sphere, and a second layer 2 mm within most of it.
    let (positions, faces) = sphere();
    let n = positions.len() as u32;
    let inner = positions.iter().map(|p| p.map(|x| 0.98 * x));
    let both: Vec<[f64; 3]> = positions.iter().copied().chain(inner).collect();
    let second = faces.iter().filter(|face| positions[face[0] as usize][2] < 40.0);
    let all: Vec<[u32; 3]> = faces.iter().copied().chain(second.map(|face| face.map(|v| v + n))).collect();
    let test = InsideTest::new(&both, &all, options(0.0)).expect("faces fit");
    assert_eq!(test.turned_faces(), &[0; 0]);
    // The border of the layer lies under the other: it is no border of a hole.
    assert!(spread(500).iter().all(|&p| test.at(p).side != Side::Unknown));
}

#[test]
fn no_thread_changes_a_bit() {
    let (positions, mut faces) = sphere();
    faces.truncate(faces.len() * 4 / 5);
    faces.iter_mut().step_by(5).for_each(|face| face.swap(0, 1));
    let told = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().expect("threads");
        pool.install(|| {
            let test = InsideTest::new(&positions, &faces, options(0.0)).expect("faces fit");
            (test.turned_faces().to_vec(), test.at_all(&spread(1000)))
        })
    };
    assert_eq!(told(1), told(3));
}

proptest! {
    #[test]
    fn any_triangles_tell_something(
        positions in lattice_positions(),
        faces in lattice_faces(),
        asked in prop::collection::vec(prop::array::uniform3(-6_i8..7), 1..10),
        scale in prop_oneof![Just(1.0), Just(1e-60), Just(1e60)],
        eps in prop_oneof![Just(0.0), Just(0.3)],
    ) {
        let placed = |p: [f64; 3]| p.map(|x| x * scale);
        let positions: Vec<[f64; 3]> = positions.into_iter().map(placed).collect();
        let asked: Vec<[f64; 3]> = asked.into_iter().map(|p| placed(p.map(f64::from))).collect();
        let options = InsideOptions { eps: eps * scale, widest_hole: 2.0 * scale, most_inward: 0.1, ..InsideOptions::default() };
        let test = InsideTest::new(&positions, &faces, options).expect("faces fit");
        prop_assert!(test.n_inward() <= faces.len() && test.turned_faces().is_sorted());
        // What has been turned is in order.
        let mut again = faces.clone();
        test.turned_faces().iter().for_each(|&face| again[face as usize].swap(1, 2));
        for (&p, sided) in asked.iter().zip(test.at_all(&asked)) {
            prop_assert_eq!(sided, test.at(p));
            prop_assert!(sided.winding.is_finite() && sided.signed_distance.abs() == sided.closest.distance);
            if sided.closest.distance > options.eps {
                prop_assert!(sided.side == Side::Unknown || (sided.side == Side::Outside) == (sided.signed_distance > 0.0));
            }
        }
        let turned = InsideTest::new(&positions, &again, options).expect("faces fit");
        prop_assert!(test.turned_faces().is_empty() || turned.n_inward() == 0, "{:?}", turned.turned_faces());
    }
}

#[test]
fn what_cannot_be_asked_is_refused_or_unknown() {
    let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let refused = |options| InsideTest::new(&positions, &[[0, 1, 2]], options).expect_err("refused").to_string();
    let sound = InsideOptions::default();
    assert!(refused(InsideOptions { eps: -1.0, ..sound }).contains("eps of the inside test is -1"));
    assert!(refused(InsideOptions { widest_hole: f64::NAN, ..sound }).contains("widest_hole"));
    assert!(InsideTest::new(&positions, &[], sound).is_err());
    let widest_hole = f64::INFINITY;
    let test = InsideTest::new(&positions, &[[0, 1, 2]], InsideOptions { widest_hole, ..sound }).expect("a face");
    for p in [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [1e71, 0.0, 0.0]] {
        let sided = test.at(p);
        assert!(sided.side == Side::Unknown && sided.signed_distance.is_nan() && sided.winding.is_nan());
    }
    assert_eq!(test.at([0.2, 0.2, 1e69]).side, Side::Outside);
}
