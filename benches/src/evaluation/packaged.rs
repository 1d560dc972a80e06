//! The peers as others package them (`bench_eval`, `bench_eval.py`): they run before and after our rows, and the better of both counts.

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::samples::Times;

/// In which language a program is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Language {
    /// Plain loops, and Eigen.
    Cpp,
    /// numpy, torch, smplx, onnxruntime, PyWavelets.
    Python,
}

/// Times by job, threads and language, with the program's name.
#[derive(Debug, Clone, Default)]
pub struct Packaged(BTreeMap<(String, u64, Language, String), Times>);

impl Packaged {
    /// Runs the programs: `scripts` holds bench_eval.py, `folder` what the scripts' set-up has made.
    ///
    /// # Errors
    /// When a program is missing or fails, or prints something else than a row in JSON a line.
    pub fn run(&mut self, scripts: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
        let python = |arguments: &[&str]| {
            let mut command = Command::new(folder.join("venv/bin/python"));
            command.args(arguments).current_dir(scripts);
            command
        };
        for (language, mut command) in [
            (Language::Cpp, Command::new(folder.join("bin/bench_eval"))),
            (Language::Python, python(&["bench_eval.py"])),
            (Language::Python, python(&["bench_train.py", "fit"])),
        ] {
            // Rows of two threads are measured whatever the load, as ours are.
            command.env("PEERS_DIR", folder).env("PEERS_MAX_LOAD", "99");
            let output = command.output().map_err(|error| format!("{command:?}: {error}; set up the peers first"))?;
            if !output.status.success() {
                let text = String::from_utf8_lossy(&output.stderr).into_owned();
                return Err(format!("{command:?} failed ({}): {text}", output.status).into());
            }
            for line in String::from_utf8(output.stdout)?.lines() {
                self.add(language, line)?;
            }
        }
        Ok(())
    }

    /// Takes a row in single precision; of two of the same program the better one stays.
    fn add(&mut self, language: Language, line: &str) -> Result<(), Box<dyn Error>> {
        let row: Value = serde_json::from_str(line).map_err(|error| format!("{line}: {error}"))?;
        if row["dtype"] != "f32" {
            return Ok(());
        }
        let text = |name: &str| row[name].as_str().map(str::to_owned).ok_or_else(|| format!("no {name} in {line}"));
        let number = |name: &str| row[name].as_f64().ok_or_else(|| format!("no {name} in {line}"));
        let threads = row["threads"].as_u64().ok_or_else(|| format!("no threads in {line}"))?;
        let new = Times { best: number("min_ms")?, median: number("median_ms")? };
        let times = self.0.entry((text("job")?, threads, language, text("peer")?)).or_insert(new);
        *times = Times { best: times.best.min(new.best), median: times.median.min(new.median) };
        Ok(())
    }

    /// The fastest program at a job, by its median.
    pub fn fastest(&self, job: &str, threads: usize, language: Language) -> Option<(&str, Times)> {
        let rows = self
            .0
            .iter()
            .filter(|((name, count, from, _), _)| (name.as_str(), *count, *from) == (job, threads as u64, language));
        let named = rows.map(|((_, _, _, peer), times)| (peer.as_str(), *times));
        named.min_by(|(_, a), (_, b)| a.median.total_cmp(&b.median))
    }
}

#[cfg(test)]
mod tests {
    use super::{Language, Packaged};

    fn line(peer: &str, dtype: &str, median: f64) -> String {
        format!(r#"{{"job":"a","peer":"{peer}","threads":1,"dtype":"{dtype}","median_ms":{median},"min_ms":1.0}}"#)
    }

    #[test]
    fn the_better_run_of_the_fastest_program_counts() {
        let mut rows = Packaged::default();
        for (peer, dtype, median) in [("one", "f32", 3.0), ("one", "f32", 2.5), ("two", "f32", 4.0), ("f", "f64", 0.1)]
        {
            rows.add(Language::Cpp, &line(peer, dtype, median)).unwrap();
        }
        let (peer, times) = rows.fastest("a", 1, Language::Cpp).unwrap();
        assert_eq!((peer, times.median), ("one", 2.5));
        assert!(rows.fastest("a", 2, Language::Cpp).is_none() && rows.fastest("a", 1, Language::Python).is_none());
        assert!(rows.add(Language::Cpp, "{}").is_ok_and(|()| true) && rows.add(Language::Cpp, "no row").is_err());
    }
}
