//! The unit and the axes of the simulated scans, stored in other units and turned, are found again from the templates.

use std::path::Path;

use habitus::io::{mesh, npy};
use habitus::mesh::Mesh;
use habitus::spatial::frame_recovery::{AxisTurn, FrameOptions, FrameTemplate, Handedness, Unit};
use habitus_tests::data::dir_or_skip;

type Matrix = [[f64; 3]; 3];

/// A scan and the rotation that carries it upright and to the front.
struct Case {
    name: String,
    scan: Mesh,
    upright: Matrix,
}

fn faces(data: &Path) -> (FrameTemplate, Vec<Case>) {
    let template = mesh::read(data.join("faces/model_neutral.ply")).expect("the mean face");
    let (_, rigid) = npy::read_f64(data.join("faces/scans/truth_rigid.npy")).expect("the truth");
    let case = |(number, m): (usize, &[f64; 16])| {
        let name = format!("faces/scans/scan_{number:02}.ply");
        let scan = mesh::read(data.join(&name)).expect("a scan");
        Case { name, scan, upright: [[m[0], m[4], m[8]], [m[1], m[5], m[9]], [m[2], m[6], m[10]]] }
    };
    let cases = rigid.as_chunks::<16>().0.iter().enumerate().map(case).collect();
    (FrameTemplate::new(&template).expect("a template"), cases)
}

fn bodies(data: &Path) -> (FrameTemplate, Vec<Case>) {
    let template = mesh::read(data.join("bodies/model/average_body.ply")).expect("the average body");
    let (_, placement) = npy::read_f64(data.join("bodies/scans/truth_placement.npy")).expect("the truth");
    let case = |(number, placement): (usize, &[f64; 7])| {
        let name = format!("bodies/scans/scan_{number:02}.ply");
        let scan = mesh::read(data.join(&name)).expect("a scan");
        let (sin, cos) = placement[3].to_radians().sin_cos();
        Case { name, scan, upright: [[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]] }
    };
    let cases = placement.as_chunks::<7>().0.iter().enumerate().map(case).collect();
    (FrameTemplate::new(&template).expect("a template"), cases)
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn degrees_between(a: &Matrix, b: &Matrix) -> f64 {
    let trace: f64 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum();
    ((trace - 1.0) / 2.0).clamp(-1.0, 1.0).acos().to_degrees()
}

/// Results of trials.
#[derive(Debug, Default, Clone, Copy)]
struct Counts {
    right: usize,
    refused: usize,
    wrong: usize,
}

/// Stores the scan in this unit and turned, recovers its frame and says whether it is that of the truth: the unit, the
/// nearest rotation between axes, and the whole rotation to 30 degrees.
fn trial(template: &FrameTemplate, case: &Case, unit: Unit, stored: AxisTurn, counts: &mut Counts) {
    let store = |p: &[f64; 3]| stored.applied(*p).map(|x| x / unit.millimetres());
    let scan = Mesh { positions: case.scan.positions.iter().map(store).collect(), ..case.scan.clone() };
    let recovery = template.recovery(&scan, &FrameOptions::default()).expect("a scan");
    let truth = product(&case.upright, &transposed(&stored.matrix()));
    let of_others = recovery.candidates.iter().filter(|candidate| !candidate.mirrored).nth(1);
    let separation = recovery.candidates[0].residual() / of_others.map_or(f64::NAN, |second| second.residual());
    let mirrored = recovery.candidates.iter().find(|candidate| candidate.mirrored).map_or(f64::NAN, |m| m.residual());
    match &recovery.outcome {
        Ok(frame) => {
            let nearest = AxisTurn::all()
                .into_iter()
                .min_by(|a, b| degrees_between(&a.matrix(), &truth).total_cmp(&degrees_between(&b.matrix(), &truth)));
            let off = degrees_between(&frame.motion.rotation, &truth);
            let right = frame.unit == unit && Some(frame.turn) == nearest && off < 30.0;
            *(if right { &mut counts.right } else { &mut counts.wrong }) += 1;
            println!(
                "{} {:2} {:29} {} off {off:4.1} deg  residual {:6.2} mm  second {separation:.2}  mirror {:.2}  {:?}",
                case.name,
                unit.symbol(),
                stored.to_string(),
                if right { "right" } else { "WRONG" },
                frame.residual,
                frame.residual / mirrored,
                frame.handedness
            );
        }
        Err(reason) => {
            counts.refused += 1;
            println!("{} {:2} {stored}: refused: {reason}\n{recovery}", case.name, unit.symbol());
        }
    }
}

/// Some rotations between axes: as stored, z up, lying, half turns, others.
const STORED: [usize; 6] = [0, 5, 9, 13, 18, 22];

/// Units in which scans come.
const UNITS: [Unit; 4] = [Unit::Metre, Unit::Centimetre, Unit::Inch, Unit::Millimetre];

/// The outcomes for each of the units, over the scans and rotations that are chosen by their numbers.
fn table(cases: &(FrameTemplate, Vec<Case>), chosen: impl Fn(usize, usize, usize) -> bool) -> [Counts; 4] {
    let mut counts = [Counts::default(); 4];
    for (number, case) in cases.1.iter().enumerate() {
        for (u, unit) in UNITS.into_iter().enumerate() {
            for (t, turn) in STORED.into_iter().enumerate() {
                if chosen(number, u, t) {
                    trial(&cases.0, case, unit, AxisTurn::all()[turn], &mut counts[u]);
                }
            }
        }
    }
    counts
}

fn sum(counts: &[Counts]) -> Counts {
    counts.iter().fold(Counts::default(), |sum, of| Counts {
        right: sum.right + of.right,
        refused: sum.refused + of.refused,
        wrong: sum.wrong + of.wrong,
    })
}

#[test]
fn frames_of_some_scans_are_found() {
    let Some(data) = dir_or_skip("frames_of_some_scans_are_found") else { return };
    // The scan with loose hair, stored in inches, and a body that faces -z and lacks a hand, in metres.
    for (cases, chosen) in [(faces(&data), (9, 2, 1)), (bodies(&data), (5, 0, 4))] {
        let counts = sum(&table(&cases, |scan, unit, turn| (scan, unit, turn) == chosen));
        assert_eq!((counts.right, counts.wrong), (1, 0), "{counts:?}");
    }
}

/// Every scan from every rotation, in a unit that changes from scan to scan and from rotation to rotation.
///
/// `cargo test --release -p habitus-tests --test frames -- --ignored --nocapture` prints the table.
#[test]
#[ignore = "takes minutes"]
fn frames_of_all_scans_are_found() {
    let Some(data) = dir_or_skip("frames_of_all_scans_are_found") else { return };
    let kinds = [("faces", faces(&data)), ("bodies", bodies(&data))];
    let tables = kinds.map(|(kind, cases)| (kind, table(&cases, |scan, unit, turn| unit == (turn + scan) % 4)));
    println!("{:8} {:4} {:>6} {:>8} {:>6}", "scans", "unit", "right", "refused", "wrong");
    for (kind, counts) in tables {
        let symbols = UNITS.map(Unit::symbol).into_iter().chain(["all"]);
        for (symbol, Counts { right, refused, wrong }) in symbols.zip(counts.into_iter().chain([sum(&counts)])) {
            println!("{kind:8} {symbol:4} {right:6} {refused:8} {wrong:6}");
        }
        assert_eq!(sum(&counts).wrong, 0);
    }
}

#[test]
fn things_of_another_kind_are_refused() {
    let Some(data) = dir_or_skip("things_of_another_kind_are_refused") else { return };
    let body = mesh::read(data.join("bodies/model/average_body.ply")).expect("the average body");
    let template = FrameTemplate::new(&body).expect("a template");
    for name in ["cat", "koala"] {
        let thing = mesh::read(data.join(format!("meshes/{name}.ply"))).expect("a mesh");
        let (low, high) = thing.bounding_box().expect("vertices");
        let diagonal = (0..3).map(|k| (high[k] - low[k]).powi(2)).sum::<f64>().sqrt();
        let large = |p: &[f64; 3]| p.map(|x| x / diagonal * 1900.0);
        let thing = Mesh { positions: thing.positions.iter().map(large).collect(), ..thing.clone() };
        let recovery = template.recovery(&thing, &FrameOptions::default()).expect("a mesh");
        println!("{name} {recovery}");
        assert!(recovery.outcome.is_err(), "{name}: {recovery}");
    }
}

#[test]
fn mirrored_scans_are_not_taken_for_turned_ones() {
    let Some(data) = dir_or_skip("mirrored_scans_are_not_taken_for_turned_ones") else { return };
    let (template, cases) = faces(&data);
    // Number 0 has faces, number 2 has not: the normals tell, or nothing does.
    for number in [0, 2] {
        let scan = &cases[number].scan;
        let positions = scan.positions.iter().map(|&[x, y, z]| [-x, y, z]).collect();
        let recovery =
            template.recovery(&Mesh { positions, ..scan.clone() }, &FrameOptions::default()).expect("a scan");
        println!("{recovery}");
        match &recovery.outcome {
            Ok(frame) => assert!(number == 2 && frame.handedness == Handedness::Unknown, "{recovery}"),
            Err(reason) => assert!(reason.contains("mirrored"), "{reason}"),
        }
    }
}
