//! What the primitives of a document leave out, counted together.

use std::collections::BTreeMap;

use super::super::losses::Losses;

/// Counts by name.
#[derive(Debug, Default)]
pub(super) struct Tally(BTreeMap<(&'static str, &'static str, String), usize>);

impl Tally {
    /// Counts `n` of what has this name when there is one and when there are several.
    pub(super) fn note(&mut self, n: usize, one: &'static str, several: &'static str) {
        self.count(n, one, several, String::new());
    }

    /// The same with a name from the file behind it.
    pub(super) fn note_named(&mut self, n: usize, one: &'static str, several: &'static str, name: &str) {
        self.count(n, one, several, format!(" {:?}", name.chars().take(40).collect::<String>()));
    }

    fn count(&mut self, n: usize, one: &'static str, several: &'static str, name: String) {
        if n > 0 {
            *self.0.entry((one, several, name)).or_default() += n;
        }
    }

    /// Notes all counts.
    pub(super) fn into_losses(self, losses: &mut Losses) {
        for ((one, several, name), n) in self.0 {
            losses.note(n, &format!("{one}{name}"), &format!("{several}{name}"));
        }
    }
}
