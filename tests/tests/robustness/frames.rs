//! Scans in other units and axes than the template's: found again, or refused with the reason.

use habitus::mesh::Mesh;
use habitus::spatial::frame_recovery::{FrameOptions, FrameTemplate, Unit};
use habitus::synth::{FaceOptions, FacePopulation};

/// The unit that must be found, or pieces of the refusal.
enum Found {
    Unit(Unit),
    Refused(&'static [&'static str]),
}

fn changed(mesh: &Mesh, change: impl Fn([f64; 3]) -> [f64; 3]) -> Mesh {
    Mesh { positions: mesh.positions.iter().map(|p| change(*p)).collect(), ..mesh.clone() }
}

/// The surface of a cube with this edge, 8 by 8 quads on a side, outwards.
fn cube(edge: f64) -> Mesh {
    let n = 8_u32;
    let mut mesh = Mesh::default();
    for side in 0..6_u32 {
        let (axis, is_far) = ((side % 3) as usize, side >= 3);
        let first = mesh.positions.len() as u32;
        for cell in 0..(n + 1) * (n + 1) {
            let mut p = [if is_far { edge } else { 0.0 }; 3];
            p[(axis + 1) % 3] = edge * f64::from(cell % (n + 1)) / f64::from(n);
            p[(axis + 2) % 3] = edge * f64::from(cell / (n + 1)) / f64::from(n);
            mesh.positions.push(p);
        }
        for cell in 0..n * n {
            let a = first + cell / n * (n + 1) + cell % n;
            let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
            mesh.faces.extend(if is_far { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    mesh
}

#[test]
fn scans_in_other_frames_are_found_or_refused() {
    let people = FacePopulation::of(&FaceOptions { identities: 2, seed: 3, level: 3 }).expect("two people");
    let [face, other] = [0, 1].map(|person| people.mesh(person, 0).expect("a neutral face"));
    let z_up = |[x, y, z]: [f64; 3]| [x, -z, y];
    let rows = [
        ("metres", &face, changed(&other, |p| p.map(|x| x / 1000.0)), Found::Unit(Unit::Metre)),
        ("inches, z up", &face, changed(&other, |p| z_up(p.map(|x| x / 25.4))), Found::Unit(Unit::Inch)),
        ("decimetres", &face, changed(&other, |p| p.map(|x| x / 100.0)), Found::Refused(&["in none", "give the unit"])),
        ("a cube for a face", &face, cube(110.0), Found::Refused(&["residual", "template's kind"])),
        ("a cube for a cube", &cube(110.0), cube(108.0), Found::Refused(&["two rotations fit about as well"])),
    ];
    let mut wrong = Vec::new();
    for (name, template, scan, wanted) in rows {
        let template = FrameTemplate::new(template).expect("a template");
        let recovery = template.recovery(&scan, &FrameOptions::default()).expect("a scan");
        let (text, is_right) = match (recovery.frame(), wanted) {
            // In the template's unit and axes, it lies where it lay before it was changed.
            (Ok(frame), wanted) => {
                let restored = frame.restored(&scan);
                let pairs = restored.positions.iter().zip(&other.positions);
                let is_back = pairs.clone().all(|(p, q)| (0..3).all(|k| (p[k] - q[k]).abs() < 1e-9));
                let is_right = matches!(wanted, Found::Unit(unit) if unit == frame.unit) && is_back;
                (format!("{}, {}, residual {:.2} mm", frame.unit.symbol(), frame.turn, frame.residual), is_right)
            }
            (Err(error), wanted) => {
                let text = error.to_string();
                let is_right =
                    matches!(wanted, Found::Refused(pieces) if pieces.iter().all(|piece| text.contains(piece)));
                (text.lines().next().unwrap_or_default().to_owned(), is_right)
            }
        };
        println!("{} | {name:40} | {text}", if is_right { "ok   " } else { "WRONG" });
        if !is_right {
            wrong.push(name);
        }
    }
    assert!(wrong.is_empty(), "other outcomes than expected: {wrong:?}");
}
