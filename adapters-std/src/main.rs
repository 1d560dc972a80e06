//! The program `habitus`.

fn main() -> std::process::ExitCode {
    habitus::cli::run()
}
