//! `cargo xtask gltf`: the Khronos validator on files of everything that our glTF writer can write, which must have
//! neither errors nor warnings. A file that is spoilt on purpose comes along: a validator that lets it pass shows nothing.

use crate::process::{Result, cargo, ended, output, project, succeed, target_dir};
use crate::targets::Target;
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The package that names the validator and its version, and the script that calls it.
const FOLDER: &str = "xtask/gltf";
const FILES: [&str; 3] = ["package.json", "package-lock.json", "validate.mjs"];
/// The model whose export is validated too.
const MODEL: &str = "examples/firmware/models/face.hab";
/// The file that must be refused, and the one that it is made of.
const SPOILT: (&str, &str) = ("spoilt.gltf", "mesh.gltf");

/// Options of `cargo xtask gltf`.
#[derive(clap::Args)]
pub struct Options {
    /// Print what the validator says as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
}

/// Installs the validator, writes the files, has them validated.
pub fn run(options: &Options) -> Result<()> {
    let mut validate = validator()?;
    let answer = ended(validate.args(written()?), Duration::from_secs(300))?;
    if let Some(how) = answer.failure {
        return Err(format!("the validator did not come to an end ({how})").into());
    }
    let answer: Value =
        serde_json::from_str(&answer.text).map_err(|error| format!("the validator's answer is no JSON: {error}"))?;
    if options.json {
        println!("{answer:#}");
    } else {
        println!("{}", table(&answer));
    }
    let objections = objections(&answer);
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

/// Node.js with the script, beside which the validator is installed from npm.
fn validator() -> Result<Command> {
    let mut node = Target::Wasm.emulator()?;
    let folder = target_dir("gltf-validator");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let same = |name: &str| {
        let [ours, theirs] = [project().join(FOLDER).join(name), folder.join(name)].map(std::fs::read);
        ours.ok().is_some_and(|ours| theirs.ok() == Some(ours))
    };
    // npm leaves this file when it has come to its end.
    let is_installed = folder.join("node_modules/.package-lock.json").is_file() && FILES.iter().all(|name| same(name));
    if !is_installed {
        if output(Command::new("npm").arg("--version")).is_none() {
            return Err("npm is missing: on Debian `apt-get install npm`".to_owned().into());
        }
        for name in FILES {
            let copied = std::fs::copy(project().join(FOLDER).join(name), folder.join(name));
            copied.map_err(|error| format!("{FOLDER}/{name}: {error}"))?;
        }
        let mut npm = Command::new("npm");
        npm.args(["ci", "--ignore-scripts", "--no-audit", "--no-fund"]).current_dir(&folder);
        // The figures alone belong on standard output.
        succeed(npm.stdout(std::io::stderr()))?;
    }
    node.arg(folder.join("validate.mjs"));
    Ok(node)
}

/// Writes the files anew and returns their paths, sorted.
fn written() -> Result<Vec<PathBuf>> {
    let folder = target_dir("gltf");
    let failed = |error: std::io::Error| format!("{}: {error}", folder.display());
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(failed)?;
    }
    std::fs::create_dir_all(&folder).map_err(failed)?;
    let run = |arguments: &[&str]| {
        let mut cargo = cargo(&[&["run", "--quiet"], arguments].concat());
        cargo.stdout(std::io::stderr());
        cargo
    };
    succeed(run(&["-p", "habitus-tests", "--bin", "write-gltf", "--"]).arg(&folder))?;
    let face = folder.join("exported_face.glb");
    succeed(run(&["-p", "habitus", "--bin", "habitus", "--", "export", MODEL, "--output"]).arg(face))?;
    spoil(&folder)?;
    let entries = std::fs::read_dir(&folder).map_err(failed)?;
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    Ok(paths)
}

/// Writes a file whose bounds are not those of its positions.
fn spoil(folder: &Path) -> Result<()> {
    let spoilt = || -> std::io::Result<()> {
        let mut document: Value = serde_json::from_slice(&std::fs::read(folder.join(SPOILT.1))?)?;
        document["accessors"][0]["max"][0] = Value::from(-1.0);
        std::fs::write(folder.join(SPOILT.0), document.to_string())
    };
    spoilt().map_err(|error| format!("{} cannot be made: {error}", SPOILT.0).into())
}

fn reports(answer: &Value) -> &[Value] {
    answer["reports"].as_array().map_or(&[], Vec::as_slice)
}

/// What must not be: errors, warnings, an empty scene, a spoilt file that passes.
fn objections(answer: &Value) -> Vec<String> {
    let mut objections = Vec::new();
    for report in reports(answer) {
        let file = report["file"].as_str().unwrap_or_default();
        let [errors, warnings] = ["errors", "warnings"].map(|key| report[key].as_u64().unwrap_or(u64::MAX));
        if file == SPOILT.0 {
            if errors == 0 {
                objections.push(format!("{file} was spoilt on purpose, and the validator has no objection"));
            }
            continue;
        }
        if report["vertices"].as_u64().unwrap_or(0) == 0 {
            objections.push(format!("{file}: the validator sees no vertices in it"));
        }
        if (errors, warnings) != (0, 0) {
            // Severities 0 and 1 are errors and warnings.
            let messages = report["messages"].as_array().into_iter().flatten();
            let messages = messages.filter(|message| message["severity"].as_u64().is_none_or(|severity| severity < 2));
            objections.extend(messages.map(|message| {
                let [code, place, text] = ["code", "pointer", "message"].map(|key| message[key].as_str().unwrap_or(""));
                format!("{file}: {code} at {place}: {text}")
            }));
            objections.push(format!("{file}: {errors} errors, {warnings} warnings"));
        }
    }
    let n = reports(answer).iter().filter(|report| report["file"] != SPOILT.0).count();
    if n == 0 || n == reports(answer).len() {
        objections.push("the validator was not given the files and the spoilt one".to_owned());
    }
    objections
}

fn table(answer: &Value) -> String {
    let mut text = format!("Khronos glTF validator {}\n", answer["validator"].as_str().unwrap_or("?"));
    let columns = ["bytes", "vertices", "triangles", "errors", "warnings", "notes"];
    let heads: String = columns.iter().map(|column| format!(" {column:>9}")).collect();
    // A String takes everything.
    let _ = write!(text, "{:<22}{heads}", "file");
    for report in reports(answer) {
        let cells: String = columns.iter().map(|column| format!(" {:>9}", report[column].to_string())).collect();
        let _ = write!(text, "\n{:<22}{cells}", report["file"].as_str().unwrap_or("?"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{objections, table};
    use serde_json::json;

    #[test]
    fn errors_warnings_and_a_blind_validator_are_objected_to() {
        let report = |file: &str, errors: u32, warnings: u32| {
            let message = json!({"code": "CODE", "severity": 1, "pointer": "/nodes/0", "message": "words"});
            json!({"file": file, "errors": errors, "warnings": warnings, "vertices": 3, "messages": [message]})
        };
        let answer = |reports: &[serde_json::Value]| json!({"validator": "2", "reports": reports});
        let (good, spoilt) = (report("a.glb", 0, 0), report("spoilt.gltf", 2, 0));
        assert!(objections(&answer(&[good.clone(), spoilt.clone()])).is_empty());
        assert!(table(&answer(std::slice::from_ref(&good))).contains("a.glb"));
        let blind = objections(&answer(&[good.clone(), report("spoilt.gltf", 0, 0)]));
        assert!(blind[0].contains("has no objection"), "{blind:?}");
        let warned = objections(&answer(&[report("a.glb", 0, 1), spoilt.clone()]));
        assert_eq!(warned, ["a.glb: CODE at /nodes/0: words", "a.glb: 0 errors, 1 warnings"]);
        let unknown = objections(&answer(&[json!({"file": "a.glb"}), spoilt.clone()]));
        assert!(unknown.iter().any(|objection| objection.contains("no vertices")), "{unknown:?}");
        for files in [&[][..], &[good], &[spoilt]] {
            assert!(objections(&answer(files))[0].contains("was not given"));
        }
    }
}
