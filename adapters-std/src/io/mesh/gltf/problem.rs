//! Why a document is refused: the path of the value that is wrong, the paths that led there, and the number behind it.
//!
//! An error begins where the value was asked, with the path below the object that was asked; who asked puts its own part
//! in front with [`Within::within`], or says with [`Within::at_root`] that the path is whole and that those outside only
//! led to it, as a primitive leads to its accessor.

use std::fmt;

/// A number in a buffer: the index of the buffer in the document and the byte of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Datum {
    pub buffer: usize,
    pub byte: usize,
}

/// See the module.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Problem {
    /// The path of the value, then those that led to it.
    paths: Vec<String>,
    /// The last of the paths is whole.
    is_whole: bool,
    what: String,
    /// The number that is wrong, where it is one of a buffer.
    pub datum: Option<Datum>,
}

impl Problem {
    /// What is wrong with the value of this key of the object that was asked.
    pub(super) fn at(key: impl Into<String>, what: impl Into<String>) -> Self {
        Problem { paths: vec![key.into()], is_whole: false, what: what.into(), datum: None }
    }

    /// What is wrong with the value itself that was asked.
    pub(super) fn here(what: impl Into<String>) -> Self {
        Problem::at("", what)
    }

    /// The same with the number that is wrong.
    pub(super) fn with(self, datum: Option<Datum>) -> Self {
        Problem { datum, ..self }
    }

    /// The same of the value of an accessor of the document.
    pub(super) fn referred(self, accessor: u64) -> Self {
        Problem { is_whole: true, ..self.below(format!("accessors[{accessor}]")) }
    }

    /// The path of the value in the document.
    pub(super) fn path(&self) -> &str {
        self.paths.first().map_or("", String::as_str)
    }

    fn below(mut self, path: String) -> Self {
        match self.paths.last_mut().filter(|_| !self.is_whole) {
            Some(inner) if inner.is_empty() || inner.starts_with('[') => inner.insert_str(0, &path),
            Some(inner) => *inner = format!("{path}.{inner}"),
            None => self.paths.push(path),
        }
        self.is_whole = false;
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for path in self.paths.iter().rev().filter(|path| !path.is_empty()) {
            write!(f, "{path}: ")?;
        }
        f.write_str(&self.what)
    }
}

/// Puts the path of the object that was asked in front of an error.
pub(super) trait Within<T> {
    fn within(self, path: impl FnOnce() -> String) -> Result<T, Problem>;

    /// The same where the path is that from the root.
    fn at_root(self, path: impl FnOnce() -> String) -> Result<T, Problem>;
}

impl<T> Within<T> for Result<T, Problem> {
    fn within(self, path: impl FnOnce() -> String) -> Result<T, Problem> {
        self.map_err(|problem| problem.below(path()))
    }

    fn at_root(self, path: impl FnOnce() -> String) -> Result<T, Problem> {
        self.map_err(|problem| Problem { is_whole: true, ..problem.below(path()) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_innermost_path_is_the_place_and_all_are_said() {
        let problem: Result<(), Problem> = Err(Problem::at("buffer", "it names nothing"));
        let problem = problem.at_root(|| "bufferViews[2]".into()).within(|| "bufferView".into());
        let problem = problem.at_root(|| "accessors[1]".into()).within(|| "_a.b".into()).within(|| "attributes".into());
        let problem = problem.within(|| "meshes[0]".into()).unwrap_err();
        assert_eq!(problem.path(), "bufferViews[2].buffer");
        assert_eq!(
            problem.to_string(),
            "meshes[0].attributes._a.b: accessors[1].bufferView: bufferViews[2].buffer: it names nothing"
        );
    }

    #[test]
    fn elements_of_lists_follow_without_a_dot() {
        let problem: Result<(), Problem> = Err(Problem::here("it is 7"));
        let problem = problem.within(|| "[3]".into()).within(|| "children".into()).unwrap_err();
        assert_eq!((problem.path(), &*problem.to_string()), ("children[3]", "children[3]: it is 7"));
        assert_eq!(Problem::here("nothing").to_string(), "nothing");
    }
}
