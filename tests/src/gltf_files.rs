//! Meshes with everything that our glTF writer can write, for the validator and for tests.

use std::path::Path;

use habitus::io::mesh::{Joint, MeshFile, MorphTarget, Skin, read_file};
use habitus::io::npy;
use habitus::mesh::{Attribute, Mesh, Scalar};

/// Contents by name, one for each thing that may be in a file, then all of them together.
pub fn contents() -> Vec<(&'static str, MeshFile)> {
    let plain = wave(9);
    let n = plain.positions.len();
    let mut coloured = plain.clone();
    coloured.normals = coloured.vertex_normals();
    coloured.colours = (0..n).map(|vertex| [vertex as u8, 255 - vertex as u8, (7 * vertex) as u8]).collect();
    let attributed = Mesh { attributes: attributes(n), ..plain.clone() };
    // Triangles of a line and of a point, a vertex without triangles, numbers that f32 rounds or hardly holds.
    let mut rough = plain.clone();
    rough.positions.extend([[1.5, -2.5, -0.0], [0.1, 1e-40, -1e38]]);
    rough.faces.extend([[0, 0, 1], [3, 3, 3]]);
    rough.normals = rough.vertex_normals();
    let cloud = Mesh { faces: Vec::new(), ..coloured.clone() };
    let morphed = |mesh: &Mesh| MeshFile { morphs: morphs(n), ..mesh.clone().into() };
    let skinned = |mesh: &Mesh, n_joints| MeshFile { skin: Some(chain(mesh, n_joints)), ..mesh.clone().into() };
    // Joints of other sizes, one of them mirrored; weights whose f32 do not sum to 1 exactly, or not at all.
    let mut uneven = skinned(&plain, 5);
    if let Some(skin) = &mut uneven.skin {
        for (joint, scale) in skin.joints.iter_mut().zip([2.0_f64, 0.1, -1.0, 1.0 / 3.0, 1.0]) {
            joint.bind[0] = joint.bind[0].map(|x| x * scale.abs());
            joint.bind[1] = joint.bind[1].map(|x| x * scale.abs());
            joint.bind[2] = joint.bind[2].map(|x| x * scale);
        }
        for (vertex, influences) in skin.influences.iter_mut().enumerate() {
            let weight = [0.1, 1.0 / 3.0, 1e-3, 0.0][vertex % 4];
            influences.iter_mut().enumerate().for_each(|(at, (_, x))| *x = weight / (at + 1) as f64);
        }
    }
    let mut all = morphed(&Mesh { attributes: attributes(n), ..coloured.clone() });
    all.skin = Some(chain(&all.mesh, 5));
    vec![
        ("mesh", plain.clone().into()),
        ("point", Mesh { positions: vec![[0.1, 0.2, 0.3]], ..Mesh::default() }.into()),
        ("cloud", cloud.into()),
        ("normals_colours", coloured.into()),
        ("attributes", attributed.into()),
        ("rough", rough.into()),
        ("morphs", morphed(&plain)),
        ("skin", skinned(&plain, 5)),
        ("skin_uneven", uneven),
        ("skin_300_joints", skinned(&plain, 300)),
        ("all", all),
    ]
}

/// A wavy grid of `side` times `side` vertices, whose numbers `f32` holds.
fn wave(side: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..side {
        for column in 0..side {
            let (x, y) = (column as f32 * 12.5, row as f32 * 10.1);
            mesh.positions.push([x, y, 20.0 * (x / 37.0).sin() * (y / 53.0).cos()].map(f64::from));
        }
    }
    for row in 1..side {
        for column in 1..side {
            let [a, b, c, d] = [side + 1, side, 1, 0].map(|back| (row * side + column - back) as u32);
            mesh.faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}

/// One of every type that the format has for vertices, and names that need care.
fn attributes(n: usize) -> Vec<Attribute> {
    let types = [
        ("offset", Scalar::I8, -3.0),
        ("label", Scalar::U8, 2.0),
        ("depth", Scalar::I16, -300.0),
        ("view", Scalar::U16, 40_000.0),
        ("distance to \"truth\", mm", Scalar::F32, 0.25),
        ("Größe", Scalar::F32, -1.5),
        ("", Scalar::F32, 0.5),
    ];
    let values = |first: f64| (0..n).map(|vertex| first + f64::from(vertex as u8 % 7)).collect();
    types.map(|(name, scalar, first)| Attribute { name: name.into(), scalar, values: values(first) }).into()
}

/// Targets of which one moves nothing and one has no name.
fn morphs(n: usize) -> Vec<MorphTarget> {
    let target = |name: &str, step: f64| {
        let displacements = (0..n).map(|vertex| [0.0, step * vertex as f64, -0.5 * step]).collect();
        MorphTarget { name: name.into(), displacements }
    };
    vec![target("smile", 0.125), target("", 0.25), target("jaw \"open\"", 0.0)]
}

/// A chain of turned joints with a second root; vertices are moved by one to five of them, in parts that `f32` holds.
fn chain(mesh: &Mesh, n_joints: u32) -> Skin {
    let joint = |index: u32| {
        let (sin, cos) = (0.05 * f64::from(index)).sin_cos();
        let frame = [[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0], [50.0, 10.0 * f64::from(index), 0.0]];
        let parent = (index > 0 && index + 1 < n_joints).then(|| index - 1);
        Joint { name: if index == 2 { String::new() } else { format!("joint {index}") }, parent, bind: frame }
    };
    let parts = [&[1.0][..], &[0.5, 0.5], &[0.5, 0.25, 0.25], &[0.25; 4], &[0.5, 0.125, 0.125, 0.125, 0.125]];
    let influences = (0..mesh.positions.len()).map(|vertex| {
        let moved_by = |(at, &weight): (usize, &f64)| (((vertex * 31 + at) % n_joints as usize) as u32, weight);
        parts[vertex % parts.len()].iter().enumerate().map(moved_by).collect()
    });
    Skin { joints: (0..n_joints).map(joint).collect(), influences: influences.collect() }
}

/// The small average body of the shared data with its bones and weights.
///
/// # Panics
/// When the data are not as their description says.
pub fn body(data: &Path) -> MeshFile {
    let folder = data.join("bodies/model");
    let mut file = read_file(folder.join("average_body_dec.ply"), &Default::default()).expect("the average body");
    let text = std::fs::read_to_string(folder.join("model.json")).expect("the model");
    let model: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let (_, positions) = npy::read_f64(folder.join("base_joints.npy")).expect("the joints");
    let joints = model["joints"].as_array().expect("a list").iter().zip(positions.as_chunks::<3>().0);
    let joints: Vec<Joint> = joints
        .map(|(joint, &position)| Joint {
            name: joint["name"].as_str().expect("a name").to_owned(),
            // The root's parent is -1.
            parent: joint["parent"].as_u64().map(|parent| parent as u32),
            bind: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], position],
        })
        .collect();
    let (_, indices) = npy::read_u32(folder.join("dec_weight_index.npy")).expect("the joints of the vertices");
    let (_, weights) = npy::read_f64(folder.join("dec_weight_value.npy")).expect("the weights");
    let influences = indices.as_chunks::<4>().0.iter().zip(weights.as_chunks::<4>().0).map(|(joints, weights)| {
        let all = joints.iter().copied().zip(weights.iter().copied());
        all.filter(|(_, weight)| *weight != 0.0).collect()
    });
    file.skin = Some(Skin { joints, influences: influences.collect() });
    file
}
