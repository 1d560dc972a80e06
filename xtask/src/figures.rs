//! Figures that a program prints of itself, as lines `@name value`.

use std::collections::BTreeMap;

/// How the names of counted instructions begin.
pub const COUNT: &str = "count_";

/// Figures by name.
pub type Figures = BTreeMap<String, u64>;

/// The lines `@name value` of a program's output.
pub fn printed_figures(text: &str) -> Figures {
    let lines = text.lines().filter_map(|line| line.strip_prefix('@')?.split_once(' '));
    lines.filter_map(|(name, value)| Some((name.to_owned(), value.parse().ok()?))).collect()
}

/// The other lines.
pub fn printed_text(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('@'))
}

#[cfg(test)]
mod tests {
    use super::{printed_figures, printed_text};

    #[test]
    fn only_lines_that_announce_a_figure_are_read() {
        let text = "opened\n@stack 1234\n@checked 7\n@odd x\nstack 9\n";
        let figures = printed_figures(text);
        assert_eq!(figures.into_iter().collect::<Vec<_>>(), [("checked".into(), 7), ("stack".into(), 1234)]);
        assert_eq!(printed_text(text).collect::<Vec<_>>(), ["opened", "stack 9"]);
    }
}
