//! The inside test on damaged surfaces of bodies (Part II, T10): how often it is right, against the exact test on the sound surface.

use std::f64::consts::PI;

use glam::DVec3;
use habitus::io::mesh;
use habitus::mesh::sampling::uniform_points;
use habitus::mesh::{Mesh, Topology};
use habitus::spatial::{InsideOptions, InsideTest, Side, TriangleTree};
use habitus_tests::data::dir_or_skip;
use habitus_tests::random::Random;

/// Positions at most so far from the sound surface do not count. mm.
const NEAREST: f64 = 5.0;

/// Near to the surface. mm.
const NEAR: f64 = 40.0;

/// A position and whether it is inside of the sound surface.
type Asked = ([f64; 3], bool);

/// The winding number, summed over all faces.
fn exact_winding(mesh: &Mesh, p: DVec3) -> f64 {
    let angle = |face| {
        let [a, b, c] = mesh.triangle(face).map(|corner| DVec3::from_array(corner) - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    (0..mesh.faces.len()).map(angle).sum::<f64>() / (4.0 * PI)
}

/// Half of them anywhere in the box of the mesh and 100 mm around, half within 40 mm of the surface.
fn questions(mesh: &Mesh, n: usize) -> Vec<Asked> {
    let mut random = Random::new(11);
    let (low, high) = mesh.bounding_box().expect("there are vertices");
    let mut positions: Vec<[f64; 3]> = (0..n / 2)
        .map(|_| std::array::from_fn(|k| low[k] - 100.0 + (high[k] - low[k] + 200.0) * random.unit()))
        .collect();
    for on in uniform_points(mesh, n / 2, 12).expect("there is area") {
        let corners = mesh.triangle(on.face as usize).map(DVec3::from_array);
        let point: DVec3 = (0..3).map(|k| corners[k] * on.barycentric[k]).sum();
        let direction = DVec3::from_array(std::array::from_fn(|_| random.normal()));
        positions.push((point + direction.normalize_or_zero() * (NEAR * random.unit())).to_array());
    }
    let tree = TriangleTree::new(&mesh.positions, &mesh.faces).expect("faces fit");
    positions.retain(|&p| tree.closest(p).distance > NEAREST);
    let halves = positions.split_at(positions.len() / 2);
    let told =
        |half: &[[f64; 3]]| -> Vec<Asked> { half.iter().map(|&p| (p, exact_winding(mesh, p.into()) > 0.5)).collect() };
    std::thread::scope(|scope| {
        let other = scope.spawn(|| told(halves.1));
        let mut all = told(halves.0);
        all.extend(other.join().expect("no panic"));
        all
    })
}

/// Pieces of the surface around random faces, `radius` mm at most, together this share of the faces.
fn pieces(mesh: &Mesh, share: f64, radius: f64, random: &mut Random) -> Vec<Vec<usize>> {
    let topology = Topology::new(mesh.positions.len(), &mesh.faces);
    let middle = |face: usize| mesh.triangle(face).map(DVec3::from_array).iter().sum::<DVec3>() / 3.0;
    let mut taken = vec![false; mesh.faces.len()];
    let (mut pieces, mut n) = (Vec::new(), 0);
    while (n as f64) < share * mesh.faces.len() as f64 {
        let first = random.below(mesh.faces.len());
        let within = radius * (0.4 + 0.6 * random.unit());
        if taken[first] {
            continue;
        }
        taken[first] = true;
        let mut piece = vec![first];
        let mut at = 0;
        while let Some(&face) = piece.get(at) {
            at += 1;
            for edge in topology.edges_of_face(face as u32) {
                for &next in &topology.edges()[edge as usize].faces {
                    let next = next as usize;
                    if !taken[next] && middle(next).distance(middle(first)) <= within {
                        taken[next] = true;
                        piece.push(next);
                    }
                }
            }
        }
        n += piece.len();
        pieces.push(piece);
    }
    pieces
}

fn without_pieces(mesh: &Mesh, share: f64, radius: f64) -> Mesh {
    let mut is_left = vec![true; mesh.faces.len()];
    pieces(mesh, share, radius, &mut Random::new(1)).concat().into_iter().for_each(|face| is_left[face] = false);
    let faces = mesh.faces.iter().zip(is_left).filter(|(_, is_left)| *is_left).map(|(&face, _)| face).collect();
    Mesh { faces, ..mesh.clone() }
}

fn with_flips(mesh: &Mesh, share: f64) -> Mesh {
    let mut random = Random::new(2);
    let mut mesh = mesh.clone();
    mesh.faces.iter_mut().for_each(|face| {
        if random.unit() < share {
            face.swap(1, 2);
        }
    });
    mesh
}

/// Copies of a fifth of the surface with vertices of their own, displaced as a whole by up to 2 mm in any direction; each third one lies
/// where it was.
fn with_layers(mesh: &Mesh) -> Mesh {
    let mut random = Random::new(3);
    let mut copy = mesh.clone();
    for (number, piece) in pieces(mesh, 0.2, 120.0, &mut random).into_iter().enumerate() {
        let reach = if number % 3 == 0 { 0.0 } else { 2.0 * random.unit() };
        let shift = DVec3::from_array(std::array::from_fn(|_| random.normal())).normalize_or_zero() * reach;
        let mut new_of_old = std::collections::BTreeMap::new();
        for face in piece {
            let corners = mesh.faces[face].map(|vertex| {
                *new_of_old.entry(vertex).or_insert_with(|| {
                    copy.positions.push((DVec3::from_array(mesh.positions[vertex as usize]) + shift).to_array());
                    copy.positions.len() as u32 - 1
                })
            });
            copy.faces.push(corners);
        }
    }
    copy
}

/// The shares of right and of unknown answers, of all, and of right ones near the surface.
fn answers(name: &str, mesh: &Mesh, asked: &[Asked]) -> (f64, f64, f64) {
    let begin = std::time::Instant::now();
    let test = InsideTest::new(&mesh.positions, &mesh.faces, InsideOptions::default()).expect("faces fit");
    let built = begin.elapsed();
    let positions: Vec<[f64; 3]> = asked.iter().map(|(p, _)| *p).collect();
    let begin = std::time::Instant::now();
    let told = test.at_all(&positions);
    let each = begin.elapsed().as_secs_f64() * 1e6 / asked.len() as f64;
    let (mut right, mut unknown, mut near, mut near_right) = (0, 0, 0, 0);
    for (sided, &(_, is_inside)) in told.iter().zip(asked) {
        let truth = if is_inside { Side::Inside } else { Side::Outside };
        let is_right = usize::from(sided.side == truth);
        right += is_right;
        if sided.closest.distance < NEAR {
            near += 1;
            near_right += is_right;
        }
        unknown += usize::from(sided.side == Side::Unknown);
    }
    let n = asked.len() as f64;
    let (right, unknown, near_right) = (right as f64 / n, unknown as f64 / n, near_right as f64 / near as f64);
    println!(
        "{name:42} {:7} {:6} {:6} {:8.3} {:8.3} {:8.3} {:8.3} {:7.0} {each:6.1}",
        mesh.faces.len(),
        test.n_inward(),
        test.turned_faces().len(),
        100.0 * right,
        100.0 * unknown,
        (100.0 * (1.0 - right - unknown)).max(0.0),
        100.0 * near_right,
        built.as_secs_f64() * 1e3,
    );
    (right, unknown, near_right)
}

#[test]
fn damaged_surfaces_tell_inside_from_outside() {
    let Some(data) = dir_or_skip("damaged_surfaces_tell_inside_from_outside") else { return };
    println!(
        "{:42} {:>7} {:>6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>7} {:>6}",
        "surface", "faces", "inward", "turned", "right %", "unkn. %", "wrong %", "near %", "build ms", "us"
    );
    for (name, file) in [("body", "bodies/model/average_body.ply"), ("cat", "meshes/cat.ply")] {
        let mut sound = mesh::read(data.join(file)).expect("a closed mesh");
        // Animals are as long as a body is tall.
        let (low, high) = sound.bounding_box().expect("there are vertices");
        let longest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        if name != "body" {
            sound.positions.iter_mut().flatten().for_each(|x| *x *= 1700.0 / longest);
        }
        let asked = questions(&sound, 6000);
        let n_inside = asked.iter().filter(|(_, is_inside)| *is_inside).count();
        println!("{name}: {} positions, {n_inside} inside", asked.len());
        // The flaws of T10 and all at once; then what it does not ask for.
        let torn = without_pieces(&sound, 0.1, 30.0);
        let all = with_flips(&with_layers(&torn), 0.02);
        for (damage, damaged, asks) in [
            ("sound", sound.clone(), 1.0),
            ("10 % removed, up to 60 mm wide", torn, 0.995),
            ("2 % flipped", with_flips(&sound, 0.02), 0.995),
            ("layers of 20 % added", with_layers(&sound), 0.995),
            ("all three", all, 0.995),
            ("30 % flipped", with_flips(&sound, 0.3), 0.995),
            ("10 % removed, up to 200 mm wide", without_pieces(&sound, 0.1, 100.0), 0.0),
        ] {
            let (right, unknown, near) = answers(&format!("{name}, {damage}"), &damaged, &asked);
            assert!(right >= asks && near >= asks, "{name}, {damage}: {right}, near {near}");
            // Where holes are too wide, that is said rather than a side.
            assert!(1.0 - right - unknown <= 0.005, "{name}, {damage}: {right}, {unknown}");
        }
    }
}
