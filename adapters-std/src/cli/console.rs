//! What a verb says: results on stdout (text or one JSON object), progress and warnings on stderr.

use std::cell::RefCell;
use std::io::Write;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::Value;

use crate::Error;

/// The two streams of the command line.
#[derive(Debug)]
pub(super) struct Console {
    json: bool,
    warnings: RefCell<Vec<String>>,
}

/// Progress appears when a stage takes longer than this.
const PATIENCE: Duration = Duration::from_secs(1);

impl Console {
    pub(super) fn new(json: bool) -> Self {
        Console { json, warnings: RefCell::default() }
    }

    /// The result of the verb: `text` for people or `object` for programs, which also receives the warnings.
    ///
    /// Control characters of texts that come from files are not passed on to a terminal. A reader that has gone away is no error.
    pub(super) fn result(&self, text: &str, mut object: Value) -> Result<(), Error> {
        let line = if self.json {
            if let Some(map) = object.as_object_mut() {
                map.insert("warnings".into(), self.warnings.borrow().clone().into());
            }
            object.to_string()
        } else {
            text.trim_end().replace(|c: char| c.is_control() && c != '\n' && c != '\t', "\u{fffd}")
        };
        let mut out = std::io::stdout().lock();
        match writeln!(out, "{line}").and_then(|()| out.flush()) {
            Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Error::Write { path: "standard output".into(), source })
            }
            _ => Ok(()),
        }
    }

    /// A sentence that the user should know, on stderr and in the JSON object.
    pub(super) fn warn(&self, sentence: &str) {
        self.say(&format!("warning: {sentence}"));
        self.warnings.borrow_mut().push(sentence.to_owned());
    }

    pub(super) fn error(&self, sentence: &str) {
        if self.json {
            let _ = writeln!(std::io::stdout(), "{}", serde_json::json!({ "error": sentence }));
        }
        self.say(&format!("error: {sentence}"));
    }

    /// A line on stderr; nobody is told when there is no stderr.
    pub(super) fn say(&self, line: &str) {
        let _ = writeln!(std::io::stderr(), "{}", line.replace(|c: char| c.is_control() && c != '\n', "\u{fffd}"));
    }

    /// A progress bar with ETA on stderr for `what`, which a stage drives by telling how many of how many steps are done. It appears after a
    /// second; where stderr is no terminal, a line is printed every few seconds.
    pub(super) fn progress<'a>(&self, what: &'a str) -> impl FnMut(usize, usize) + 'a {
        let started = std::time::Instant::now();
        let mut spoken = started;
        let mut bar: Option<ProgressBar> = None;
        let terminal = console_is_terminal();
        move |done, total| {
            if started.elapsed() < PATIENCE {
                return;
            }
            if !terminal {
                if spoken.elapsed() > 5 * PATIENCE && done > 0 && done < total {
                    let left = started.elapsed().as_secs_f64() / done as f64 * (total - done) as f64;
                    let _ = writeln!(std::io::stderr(), "{what}: {done}/{total}, about {left:.0} s left");
                    spoken = std::time::Instant::now();
                }
                return;
            }
            let bar = bar.get_or_insert_with(|| {
                let style = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len}, {eta} left")
                    .unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr())
                    .with_style(style)
                    .with_message(what.to_owned())
                    .with_elapsed(started.elapsed())
            });
            bar.set_position(done as u64);
            if done >= total {
                bar.finish_and_clear();
            }
        }
    }
}

fn console_is_terminal() -> bool {
    use std::io::IsTerminal;
    std::io::stderr().is_terminal()
}
