//! Every row of evaluation (faces, bodies, wavelets, alignment) in one run: ours, the machine's limit, a plain loop over our layout, and the peers' way.
//!
//! `cargo run --release -p habitus-benches --bin evaluation -- [--json] [--rounds N] [--big] [--only WORD] [--peers SCRIPTS]`
//!
//! The body is the developer's (`habitus_tests::models::body`): it wants the shared data. The peers are compiled when the measurement runs and want Eigen
//! (`libeigen3-dev`). `--big` adds the bilinear model of 802 MB in its three storages; `--only` takes the groups faces, bodies, wavelets, alignment.
//! `--peers` runs the packaged peers before and after our rows: SCRIPTS is the folder of bench_eval.py, and PEERS_DIR names the one that its set-up has
//! filled.

use std::error::Error;
use std::path::Path;
use std::process::Command;

use habitus_benches::evaluation::inputs::Inputs;
use habitus_benches::evaluation::packaged::Packaged;
use habitus_benches::evaluation::{Bench, alignment, bodies, faces, report, wavelets};
use habitus_benches::peer::{Peer, Program};
use habitus_tests::data::dir_or_skip;
use habitus_tests::models::body::{self, Rig};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let has = |flag: &str| arguments.iter().any(|argument| argument == flag);
    let value =
        |flag: &str| arguments.iter().position(|argument| argument == flag).and_then(|at| arguments.get(at + 1));
    let rounds = value("--rounds").map_or(Ok(10), |text| text.parse())?;
    let wanted = |group: &str| value("--only").is_none_or(|only| only == group);
    let mut packaged = Packaged::default();
    let mut packaged_run = || match value("--peers") {
        Some(scripts) => {
            let folder = std::env::var_os("PEERS_DIR").ok_or("set PEERS_DIR to the folder of the peers' set-up")?;
            packaged.run(Path::new(scripts), Path::new(&folder))
        }
        None => Ok(()),
    };
    let Some(data) = dir_or_skip("the rows of evaluation") else { return Ok(()) };
    let files = [
        ("peers.cpp", include_str!("../evaluation/peers.cpp")),
        ("plain.hpp", include_str!("../evaluation/plain.hpp")),
    ];
    let program = Program::compiled(&files, &["-I/usr/include/eigen3"])
        .map_err(|error| format!("{error}; on Debian: apt-get install libeigen3-dev"))?;
    let (rig, pca) = (Rig::read(&data)?, body::pca(&data, 100)?);
    let (twenty, hundred) = (body::file(&data, 20)?, body::file(&data, 100)?);
    let inputs = Inputs::new(&rig, &pca, &hundred)?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("inputs");
    std::fs::write(&path, inputs.bytes())?;
    let mut command = Command::new(program.path());
    command.arg(&path);
    let mut peer = Peer::started(command)?;
    packaged_run()?;
    let mut bench = Bench { rounds, peer: &mut peer, rows: Vec::new() };
    if wanted("faces") {
        faces::small(&mut bench)?;
    }
    if has("--big") {
        faces::large(&mut bench)?;
    }
    if wanted("bodies") {
        bodies::skinning(&mut bench, &inputs, &twenty)?;
        bodies::whole(&mut bench, &inputs, &twenty)?;
        bodies::whole(&mut bench, &inputs, &hundred)?;
    }
    if wanted("wavelets") {
        wavelets::synthesis(&mut bench, &inputs)?;
        wavelets::model(&mut bench)?;
    }
    if wanted("alignment") {
        alignment::rigid(&mut bench, &inputs)?;
    }
    let rows = bench.rows;
    packaged_run()?;
    if has("--json") {
        println!("{:#}", report::json(&rows, &program, &packaged));
    } else {
        print!("{}", report::table(&rows, &program, &peer.programs));
        print!("{}", report::packaged_table(&rows, &packaged));
    }
    Ok(())
}
