//! Writes the sound model files that the target `hab` starts from: `cargo run --example sound_files -- corpus/hab`.

fn main() -> std::io::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "corpus/hab".into());
    for base in 0..habitus_fuzz::damage::SOUND_FILES {
        std::fs::write(format!("{folder}/seed-sound-{base}"), habitus_fuzz::damage::sound_file(base))?;
    }
    Ok(())
}
