//! What a verb says: results on stdout (text or one JSON object), progress and warnings on stderr.

use std::cell::RefCell;
use std::io::Write;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::Value;

use super::pace::Pace;
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

    /// A progress bar on stderr for `what`, which a stage drives by telling how many of how many steps are done, with the time that is left as soon
    /// as it is known. The stage begins when it first tells. The bar appears after a second; where stderr is no terminal, a line is printed every
    /// few seconds.
    pub(super) fn progress<'a>(&self, what: &'a str) -> impl FnMut(usize, usize) + 'a {
        let mut clock: Option<[Instant; 2]> = None;
        let mut pace = Pace::default();
        let mut bar: Option<ProgressBar> = None;
        let terminal = console_is_terminal();
        move |done, total| {
            let [started, spoken] = clock.get_or_insert_with(|| [Instant::now(); 2]);
            let left = pace.seconds_left(started.elapsed(), done, total);
            let left = left.map_or(String::new(), |left| format!(", about {left:.0} s left"));
            if started.elapsed() < PATIENCE {
                return;
            }
            if !terminal {
                if spoken.elapsed() > 5 * PATIENCE && done > 0 && done < total {
                    let _ = writeln!(std::io::stderr(), "{what}: {done}/{total}{left}");
                    *spoken = Instant::now();
                }
                return;
            }
            let bar = bar.get_or_insert_with(|| {
                let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len}{msg}")
                    .unwrap_or_else(|_| ProgressStyle::default_bar());
                ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr())
                    .with_style(style)
                    .with_prefix(what.to_owned())
            });
            bar.set_message(left);
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
