//! What can go wrong outside the kernel, in words that name the file, the place in it and the remedy.

use std::path::{Path, PathBuf};

/// Where in a file a problem was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line of a text file, counted from 1.
    Line(usize),
    /// A line and a byte of it, both counted from 1, of a text whose lines may be long.
    Column {
        /// The line.
        line: usize,
        /// The byte of the line.
        column: usize,
    },
    /// A byte offset of a binary file, counted from 0.
    Byte(u64),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Whole => Ok(()),
            Place::Line(line) => write!(f, ", line {line}"),
            Place::Column { line, column } => write!(f, ", line {line}, column {column}"),
            Place::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// An error of the adapters. Its `Display` is one sentence that says what is wrong and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file could not be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file could not be written.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A file's content is not what its format asks for.
    #[error("{}{place}: {problem}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in it.
        place: Place,
        /// What was found, what was expected, and the remedy.
        problem: String,
    },
    /// Data or options that do not fit together.
    #[error("{0}")]
    Input(String),
    /// The kernel refused.
    #[error("{what}: {error}")]
    Kernel {
        /// What was being done, and to which file.
        what: String,
        /// The kernel's error.
        error: habitus_core::Error,
    },
    /// A fault of this program.
    #[error("internal fault, please report it: {0}")]
    Internal(String),
}

impl Error {
    /// A file whose content is wrong at `place`.
    pub fn malformed(path: impl AsRef<Path>, place: Place, problem: impl Into<String>) -> Self {
        Error::Malformed { path: path.as_ref().to_owned(), place, problem: problem.into() }
    }

    /// Data or options that do not fit together; `problem` is a whole sentence with the remedy.
    pub fn input(problem: impl Into<String>) -> Self {
        Error::Input(problem.into())
    }

    /// The exit status of the command line: 1 for bad input, 3 for a fault of ours.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Internal(_) => 3,
            _ => 1,
        }
    }
}
