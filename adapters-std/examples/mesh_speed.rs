//! How fast mesh files are read and written: a wavy grid of a million vertices and two million triangles, in memory.
//!
//! `cargo run --release -p habitus --no-default-features --example mesh_speed [VERTICES]`

use std::path::Path;
use std::time::Instant;

use habitus::io::mesh::{Encoding, Formatted, MeshFile, ReadOptions, WriteOptions, npy_cloud, obj, off, ply};
use habitus::mesh::Mesh;

type Parse = fn(&[u8], &Path, &ReadOptions) -> Result<MeshFile, habitus::Error>;
type Format = fn(&MeshFile, &WriteOptions) -> Result<Formatted, String>;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let n_vertices: usize = std::env::args().nth(1).map_or(Ok(1_000_000), |n| n.parse())?;
    let file: MeshFile = grid((n_vertices as f64).sqrt() as usize).into();
    let ply_text = WriteOptions { encoding: Encoding::Text };
    let ply_big = WriteOptions { encoding: Encoding::BigEndian };
    let rows: [(&str, Parse, Format, WriteOptions); 6] = [
        ("ply, little endian", ply::parse, ply::format, WriteOptions::default()),
        ("ply, big endian", ply::parse, ply::format, ply_big),
        ("ply, text", ply::parse, ply::format, ply_text),
        ("obj", obj::parse, obj::format, WriteOptions::default()),
        ("off", off::parse, off::format, WriteOptions::default()),
        ("npy", npy_cloud::parse, npy_cloud::format, WriteOptions::default()),
    ];
    println!("{:<20} {:>8} {:>12} {:>12}", "format", "MB", "read MB/s", "write MB/s");
    for (name, parse, format, options) in rows {
        let formatted = format(&file, &options)?;
        let megabytes = formatted.bytes.len() as f64 / 1e6;
        let write = fastest(|| format(&file, &options).map(drop).map_err(Into::into))?;
        let read = fastest(|| {
            let again = parse(&formatted.bytes, Path::new(name), &ReadOptions::default())?;
            if again.mesh.positions == file.mesh.positions { Ok(()) } else { Err("another mesh was read".into()) }
        })?;
        println!("{name:<20} {megabytes:>8.1} {:>12.0} {:>12.0}", megabytes / read, megabytes / write);
    }
    Ok(())
}

/// Seconds of the fastest of five runs.
fn fastest(mut run: impl FnMut() -> Result<(), Box<dyn std::error::Error>>) -> Result<f64, Box<dyn std::error::Error>> {
    let mut fastest = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        run()?;
        fastest = fastest.min(start.elapsed().as_secs_f64());
    }
    Ok(fastest)
}

/// A grid of `side * side` vertices 1 mm apart, with micrometres as decimals, as scanners write them.
fn grid(side: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let micrometres = |x: f64| (x * 1e3).round() / 1e3;
    for row in 0..side {
        for column in 0..side {
            let (x, y) = (column as f64, row as f64);
            let z = 20.0 * (x / 37.0).sin() * (y / 53.0).cos();
            mesh.positions.push([micrometres(x * 1.0003 + 0.1), micrometres(y * 0.9997 - 0.2), micrometres(z)]);
        }
    }
    let corner = |row: usize, column: usize| (row * side + column) as u32;
    for row in 1..side {
        for column in 1..side {
            let [a, b] = [corner(row - 1, column - 1), corner(row - 1, column)];
            let [c, d] = [corner(row, column - 1), corner(row, column)];
            mesh.faces.extend([[a, b, d], [a, d, c]]);
        }
    }
    mesh
}
