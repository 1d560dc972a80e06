//! Tests of where a fit begins.

use super::super::samples::{face, landmarks, mean_distance, model, placed};
use super::*;

fn start(landmarks: &[Option<[f64; 3]>], unit: Option<Unit>) -> Result<Start, Error> {
    let model = model();
    Start::new(&model, &Priors::of(&model)?, landmarks, unit, 1.5)
}

fn said(landmarks: &[Option<[f64; 3]>], unit: Option<Unit>) -> String {
    start(landmarks, unit).err().expect("refused").to_string()
}

/// Turned by a quarter about y and moved.
fn motion(p: [f64; 3]) -> [f64; 3] {
    [p[2] + 300.0, p[1] - 40.0, -p[0] + 7.0]
}

#[test]
fn landmarks_place_the_model_in_any_unit() {
    let truth = face(&[1.0, -0.5], &[0.5]);
    for unit in UNITS {
        let mm = unit.millimetres();
        let marks: Vec<_> = landmarks(&truth).into_iter().map(|p| p.map(|p| motion(p).map(|x| x / mm))).collect();
        for declared in [None, Some(unit)] {
            let start = start(&marks, declared).expect("a start");
            assert_eq!(start.unit, unit);
            let back = |p: [f64; 3]| std::array::from_fn(|k| p[k] + mm * start.region.centre[k]);
            let found: Vec<[f64; 3]> = placed(&start.state).into_iter().map(back).collect();
            let there: Vec<[f64; 3]> = truth.positions.iter().map(|p| motion(*p)).collect();
            assert!(mean_distance(&found, &there) < 3.0, "{}", mean_distance(&found, &there));
            assert!(start.residual < 2.0, "{}", start.residual);
            // The face looks along +x.
            assert!(start.region.front[0] > 0.98, "{:?}", start.region.front);
        }
        let wrong = if unit == Unit::Metre { Unit::Centimetre } else { Unit::Metre };
        assert!(said(&marks, Some(wrong)).contains("is the unit right"));
    }
}

#[test]
fn one_landmark_far_off_does_not_turn_the_placement() {
    let truth = face(&[], &[]);
    let mut marks: Vec<[f64; 3]> = landmarks(&truth).into_iter().flatten().collect();
    let source = marks.as_flattened().to_vec();
    marks[8][0] += 60.0;
    let (robust, _) = robust_alignment(&source, marks.as_flattened()).expect("a motion");
    let plain = alignment(&source, marks.as_flattened(), None, false).expect("a motion");
    let moved = |place: &dyn Fn([f64; 3]) -> [f64; 3]| {
        let found: Vec<[f64; 3]> = truth.positions.iter().map(|p| place(*p)).collect();
        mean_distance(&found, &truth.positions)
    };
    let robust = widened(&robust);
    let (robust, plain) = (moved(&|p| robust.applied(p)), moved(&|p| plain.point(p)));
    assert!(robust < 1.0 && plain > 4.0, "{robust} {plain}");
    // A start from it names it; 25 mm off it is only weighed down.
    let mut given: Vec<_> = marks.iter().copied().map(Some).collect();
    let sentence = said(&given, None);
    assert!(sentence.contains("the landmark right_mouth_corner is") && sentence.contains("leave it out"), "{sentence}");
    given[8] = Some([marks[8][0] - 35.0, marks[8][1], marks[8][2]]);
    let start = start(&given, None).expect("a start");
    let centre = start.region.centre;
    let found: Vec<[f64; 3]> = placed(&start.state).iter().map(|p| std::array::from_fn(|k| p[k] + centre[k])).collect();
    assert!(mean_distance(&found, &truth.positions) < 3.0, "{}", mean_distance(&found, &truth.positions));
}

#[test]
fn exchanged_sides_are_told() {
    let mut marks = landmarks(&face(&[0.5], &[]));
    for [a, b] in [[0, 3], [1, 2], [5, 6], [8, 9]] {
        marks.swap(a, b);
    }
    assert!(said(&marks, None).contains("left and right of the landmarks seem to be exchanged"));
}

#[test]
fn what_does_not_place_a_scan_is_refused() {
    let all = landmarks(&face(&[], &[]));
    let three: Vec<_> = all.iter().enumerate().map(|(k, p)| p.filter(|_| k < 3)).collect();
    assert!(said(&three, None).contains("3 landmarks do not place a scan; give at least 4"));
    assert!(said(&all[..7], None).contains("7 landmarks were given; the model has 13"));
    let with = |k: usize, p: [f64; 3]| {
        all.iter().enumerate().map(|(at, q)| if at == k { Some(p) } else { *q }).collect::<Vec<_>>()
    };
    assert!(said(&with(3, [f64::INFINITY, 0.0, 0.0]), None).contains("not finite"));
    assert!(said(&vec![Some([1.0; 3]); 13], None).contains("do not place the scan"));
    let large: Vec<_> = all.iter().map(|p| p.map(|p| p.map(|x| 4.0 * x))).collect();
    assert!(said(&large, None).contains("the unit of the scan cannot be told"));
    let mixed: Vec<_> = (0..13).map(|k| all[(5 * k + 2) % 13]).collect();
    assert!(!said(&mixed, Some(Unit::Millimetre)).is_empty());
}

#[test]
fn single_large_distances_do_not_change_the_spread() {
    assert_eq!(spread(&[1.538; 5]), 1.0);
    assert_eq!(spread(&[1.538, 1.538, 1.538, 1.538, 900.0]), 1.0);
    assert_eq!((spread(&[]), rms(&[]), rms(&[3.0, 4.0, 0.0, 0.0])), (0.0, 0.0, 2.5));
}
