//! `cargo xtask page`: the pages of `demo`, `fit --report` and `measure model --report`, made small and opened in a headless Chromium.

use crate::figures::printed_figures;
use crate::process::{Result, cargo, ended, project, succeed, target_dir};
use crate::targets::Target;
use std::time::Duration;

/// The script that opens them.
const SCRIPT: &str = "xtask/page/pages.mjs";

/// Makes the pages and has them checked.
pub fn run() -> Result<()> {
    let folder = target_dir("pages");
    if folder.exists() {
        std::fs::remove_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    }
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let [demo, fit, model, shots] = ["demo", "fit", "model", "shots"].map(|name| folder.join(name));
    let habitus = || cargo(&["run", "--quiet", "-p", "habitus", "--bin", "habitus", "--"]);
    succeed(habitus().args(["demo", "--identities", "20", "--unseen", "2", "-o"]).arg(&demo))?;
    let of_demo = |name: &str| demo.join(name);
    succeed(
        habitus()
            .arg("fit")
            .args([of_demo("face.hab"), of_demo("unseen_1_smile_scan.ply")])
            .arg("--landmarks")
            .arg(of_demo("unseen_1_smile_landmarks.txt"))
            .arg("--report")
            .arg(&fit),
    )?;
    succeed(habitus().args(["measure", "model"]).arg(of_demo("face.hab")).arg("--report").arg(&model))?;
    let mut node = Target::Wasm.emulator()?;
    node.arg(project().join(SCRIPT)).arg(&shots).args([&demo, &fit, &model]);
    let ended = ended(&mut node, Duration::from_secs(300))?;
    print!("{}", ended.text);
    let checks = printed_figures(&ended.text).get("checks").copied().unwrap_or(0);
    match ended.failure {
        Some(how) => Err(format!("a page fails ({how}); pictures of them are in {}", shots.display()).into()),
        None if checks < 100 => Err(format!("only {checks} checks were made").into()),
        None => Ok(()),
    }
}
