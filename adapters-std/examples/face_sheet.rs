//! Draws sheets of procedural faces: `cargo run --example face_sheet -- FOLDER [LEVEL]`.

use habitus::mesh::Mesh;
use habitus::report::{View, contact_sheet};
use habitus::synth::face_grid::FaceGrid;
use habitus::synth::face_motion::EXPRESSIONS;
use habitus::synth::face_shape::N_FACTORS;
use habitus::synth::faces::{face_colours, face_positions};
use habitus::synth::{FaceOptions, FacePopulation};

const LINING: Option<[u8; 3]> = Some([52, 30, 28]);

fn main() -> Result<(), habitus::Error> {
    let mut arguments = std::env::args().skip(1);
    let folder = std::path::PathBuf::from(arguments.next().unwrap_or_else(|| ".".into()));
    let level = arguments.next().and_then(|level| level.parse().ok()).unwrap_or(4);
    let grid = FaceGrid::of_level(level)?;
    let faces = grid.faces();
    let average = |expression: usize| -> Result<Mesh, habitus::Error> {
        let positions = face_positions(&grid, &[0.0; N_FACTORS], expression)?;
        let colours = face_colours(&grid, &[0.0; N_FACTORS], expression)?;
        Ok(Mesh { positions, faces: faces.clone(), colours, ..Mesh::default() })
    };
    let average: Vec<Mesh> = (0..EXPRESSIONS.len()).map(average).collect::<Result<_, _>>()?;
    let views = [View::FRONT, View::THREE_QUARTER, View::SIDE];
    let plain = |mesh: &Mesh| Mesh { colours: Vec::new(), ..mesh.clone() };
    contact_sheet(&[vec![plain(&average[0])], vec![average[0].clone()]], &views, [520, 640], LINING)
        .write_png(folder.join("average.png"))?;
    let clay: Vec<Vec<Mesh>> = average.chunks(4).map(|row| row.iter().map(plain).collect()).collect();
    for (name, view) in [("front", View::FRONT), ("quarter", View { yaw: 0.45, ..View::FRONT }), ("side", View::SIDE)] {
        contact_sheet(&clay, &[view], [340, 430], LINING).write_png(folder.join(format!("clay_{name}.png")))?;
    }
    let rows: Vec<Vec<Mesh>> = average.chunks(4).map(<[Mesh]>::to_vec).collect();
    contact_sheet(&rows, &views[..1], [380, 480], LINING).write_png(folder.join("expressions.png"))?;
    let people = FacePopulation::of(&FaceOptions { identities: 12, level, ..FaceOptions::default() })?;
    let neutrals: Vec<Mesh> = (0..12).filter_map(|identity| people.mesh(identity, 0)).collect();
    let rows: Vec<Vec<Mesh>> = neutrals.chunks(4).map(<[Mesh]>::to_vec).collect();
    contact_sheet(&rows, &views[..2], [230, 290], LINING).write_png(folder.join("people.png"))?;
    let grid = |identity| (0..EXPRESSIONS.len()).filter_map(|e| people.mesh(identity, e)).collect::<Vec<Mesh>>();
    let rows: Vec<Vec<Mesh>> = (0..6).map(grid).collect();
    contact_sheet(&rows, &views[..1], [200, 260], LINING).write_png(folder.join("population.png"))?;
    let rows: Vec<Vec<Mesh>> = rows.iter().map(|row| row.iter().map(plain).collect()).collect();
    contact_sheet(&rows, &[View { yaw: 0.45, ..View::FRONT }], [200, 260], LINING)
        .write_png(folder.join("clay_population.png"))
}
