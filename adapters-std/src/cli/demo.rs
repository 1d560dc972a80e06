//! `habitus demo`: everything from nothing.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::{Console, Outputs};
use crate::Error;
use crate::demo::{self, DemoOptions};

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// Folder to write
    #[arg(short, long, default_value = "habitus-demo", value_name = "DIR")]
    output: PathBuf,
    /// People to learn from
    #[arg(long, default_value_t = DemoOptions::default().identities as u32, value_parser = clap::value_parser!(u32).range(2..=10_000))]
    identities: u32,
    /// People to scan and fit
    #[arg(long, default_value_t = DemoOptions::default().unseen as u32, value_parser = clap::value_parser!(u32).range(1..=1000))]
    unseen: u32,
    /// Seed
    #[arg(long, default_value_t = DemoOptions::default().seed)]
    seed: u64,
}

pub(super) fn run(args: &DemoArgs, console: &Console) -> Result<(), Error> {
    Outputs::beside([]).folder("-o", Some(&args.output), [""; 0]).check()?;
    demo::check_folder(&args.output)?;
    let options = DemoOptions { identities: args.identities as usize, unseen: args.unseen as usize, seed: args.seed };
    let mut current = "";
    let mut bar: Option<Box<dyn FnMut(usize, usize)>> = None;
    let (figures, seconds) = demo::run(&options, &args.output, &mut |stage, done, total| {
        if stage != current {
            console.say(&format!("{stage} ..."));
            bar = Some(Box::new(console.progress(stage)));
            current = stage;
        }
        if let Some(bar) = &mut bar {
            bar(done, total);
        }
    })?;
    let text = format!(
        "This population is procedural: no person was scanned.\n\
         {} people x {} expressions, {} vertices -> face.hab, {} + {} weights, {} bytes\n\
         mean vertex error, mm\n\
         \x20 training faces reproduced             {:.3}\n\
         \x20 unseen faces, mean face placed        {:.3}\n\
         \x20 unseen faces, fitted to 13 landmarks  {:.3}\n\
         \x20 unseen faces, fitted to raw scans     {:.3}, where seen {:.3}, where hidden {:.3}\n\
         \x20 unseen faces, fitted to all points    {:.3}\n\
         {}\n\
         written: {} (open it in a browser); face.hab, faces.png, figures.json, meshes (GLB, PLY)",
        figures.identities,
        figures.expressions,
        figures.vertices,
        figures.identity_dim,
        figures.expression_dim,
        figures.model_bytes,
        figures.training_error_mm,
        figures.unseen_mean_face_error_mm,
        figures.unseen_landmark_fit_error_mm,
        figures.unseen_scan_fit_error_mm,
        figures.unseen_scan_fit_seen_error_mm,
        figures.unseen_scan_fit_hidden_error_mm,
        figures.unseen_point_fit_error_mm,
        seconds.iter().map(|(stage, seconds)| format!("{stage} {seconds:.1} s")).collect::<Vec<_>>().join(", "),
        args.output.join("index.html").display(),
    );
    let mut object = serde_json::to_value(&figures).map_err(|error| Error::Internal(error.to_string()))?;
    object["seconds"] = seconds.iter().map(|stage| json!(stage)).collect();
    console.result(&text, object)
}
