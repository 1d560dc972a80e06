//! A collection: the text file that names the meshes of a training set, of every person in every expression.
//!
//! ```text
//! 3 #Expressions
//! 2 #Identities
//! anna_neutral.ply
//! bert_neutral.ply
//! anna_smile.ply
//! ...
//! ```
//! The names stand in storage order: of expression `p` and identity `i`, number `p * n_identities + i`. They are
//! relative to the folder of the collection. A mesh whose file is absent is missing, which training may allow.

use std::path::{Path, PathBuf};

use super::file_bytes;
use super::text::{integer, numbered_lines, shown, without_byte_order_mark, words};
use crate::{Error, Place};

/// The meshes that a collection names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Collection {
    /// How many persons.
    pub n_identities: usize,
    /// How many expressions of each.
    pub n_expressions: usize,
    /// The files, in storage order; `n_expressions * n_identities` of them.
    pub paths: Vec<PathBuf>,
    /// Which of the files were there when the collection was read, in the same order.
    pub present: Vec<bool>,
}

impl Collection {
    /// Where the mesh of this identity and expression stands in storage order; `None` when there is no such.
    pub fn slot(&self, identity: usize, expression: usize) -> Option<usize> {
        let exists = identity < self.n_identities && expression < self.n_expressions;
        exists.then(|| expression * self.n_identities + identity)
    }

    /// The file of this identity and expression, or `None` when it is missing or there is no such.
    pub fn path(&self, identity: usize, expression: usize) -> Option<&Path> {
        let slot = self.slot(identity, expression)?;
        self.paths.get(slot).filter(|_| self.present.get(slot) == Some(&true)).map(PathBuf::as_path)
    }

    /// How many of the files are missing.
    pub fn n_missing(&self) -> usize {
        self.present.iter().filter(|present| !**present).count()
    }
}

/// Reads the collection at `path` and looks which of its meshes are there.
///
/// # Errors
/// [`Error::Read`]; [`Error::Malformed`] with the line, also when a name is that of a folder or no file is there.
pub fn read(path: impl AsRef<Path>) -> Result<Collection, Error> {
    let path = path.as_ref();
    let (mut collection, lines) = parsed(&file_bytes(path)?, path)?;
    for ((file, present), line) in collection.paths.iter().zip(&mut collection.present).zip(&lines) {
        match file.metadata() {
            Ok(metadata) if metadata.is_file() => *present = true,
            Ok(_) => {
                let problem = format!("{} is not a file: name a mesh file", file.display());
                return Err(Error::malformed(path, Place::Line(*line), problem));
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(source) => return Err(Error::Read { path: file.clone(), source }),
        }
    }
    if collection.n_missing() == collection.paths.len() {
        let first = collection.paths.first().map(|first| first.display().to_string()).unwrap_or_default();
        let problem = format!("none of its {} files is there, beginning with {first}", collection.paths.len());
        let line = lines.first().copied().unwrap_or(1);
        return Err(Error::malformed(path, Place::Line(line), problem));
    }
    Ok(collection)
}

/// The collection in the bytes of the file at `path`. Its meshes are not looked for: none is `present`.
///
/// # Errors
/// [`Error::Malformed`] with the line.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Collection, Error> {
    parsed(bytes, path).map(|(collection, _)| collection)
}

/// The collection, and the line of each of its names.
fn parsed(bytes: &[u8], path: &Path) -> Result<(Collection, Vec<usize>), Error> {
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    let mut last = 1;
    let mut lines = numbered_lines(without_byte_order_mark(bytes))
        .map(|(line, text)| (line, text.trim_ascii()))
        .filter(|(_, text)| !text.is_empty())
        .inspect(|(line, _)| last = *line);
    let n_expressions = count(lines.next(), "#Expressions", path)?;
    let n_identities = count(lines.next(), "#Identities", path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let (mut paths, mut numbers) = (Vec::new(), Vec::new());
    for (line, text) in lines {
        let name = std::str::from_utf8(text)
            .map_err(|_| malformed(line, format!("the file name {:?} is not UTF-8", shown(text))))?;
        if name.contains('\0') {
            return Err(malformed(line, format!("the file name {:?} has a zero byte", shown(text))));
        }
        paths.push(folder.join(name));
        numbers.push(line);
    }
    if n_expressions.checked_mul(n_identities) != Some(paths.len()) {
        let problem = format!(
            "{n_expressions} expressions of {n_identities} identities need one file name each, but {} are there",
            paths.len()
        );
        return Err(malformed(last, problem));
    }
    let present = vec![false; paths.len()];
    Ok((Collection { n_identities, n_expressions, paths, present }, numbers))
}

/// The number of a header line such as `10 #Expressions`.
fn count(line: Option<(usize, &[u8])>, mark: &str, path: &Path) -> Result<usize, Error> {
    let (line, text) = line.unwrap_or((1, b""));
    let mut words = words(text);
    let number = words.next().and_then(integer::<usize>).filter(|&n| n > 0);
    let rest = words.next();
    match number {
        Some(number) if rest.is_some_and(|word| word.eq_ignore_ascii_case(mark.as_bytes())) => Ok(number),
        _ => {
            let problem = format!("{:?} where a line such as \"3 {mark}\" is expected", shown(text));
            Err(Error::malformed(path, Place::Line(line), problem))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "3 #Expressions\r\n2 #Identities\r\na 0.ply\r\nb0.ply\r\n\r\na1.ply\r\nb1.ply\r\nsub/a2.ply\r\nb2.ply";

    #[test]
    fn names_stand_in_storage_order() {
        let collection = parse(TEXT.as_bytes(), Path::new("data/c.txt")).expect("a collection");
        assert_eq!((collection.n_identities, collection.n_expressions), (2, 3));
        assert_eq!(collection.paths[0], Path::new("data/a 0.ply"));
        assert_eq!(collection.slot(0, 2), Some(4));
        assert_eq!(collection.paths[4], Path::new("data/sub/a2.ply"));
        assert_eq!((collection.slot(2, 0), collection.slot(0, 3)), (None, None));
    }

    #[test]
    fn absent_files_are_missing_but_not_all_may_be() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("collection");
        std::fs::write(&path, TEXT).expect("write");
        let message = read(&path).expect_err("must be refused").to_string();
        assert!(message.contains("line 3: none of its 6 files is there"), "{message}");
        std::fs::write(folder.path().join("b1.ply"), "").expect("write");
        let collection = read(&path).expect("a collection");
        assert_eq!((collection.n_missing(), collection.path(0, 0)), (5, None));
        assert_eq!(collection.path(1, 1), Some(&*folder.path().join("b1.ply")));
        std::fs::create_dir(folder.path().join("b2.ply")).expect("folder");
        let message = read(&path).expect_err("must be refused").to_string();
        assert!(message.contains("line 9: ") && message.contains("b2.ply is not a file"), "{message}");
    }

    #[test]
    fn errors_name_the_line_and_the_remedy() {
        for (text, message) in [
            ("", "line 1: \"\" where a line such as \"3 #Expressions\""),
            ("2 #Identities\n3 #Expressions\n", "line 1: \"2 #Identities\" where"),
            ("0 #Expressions\n", "line 1"),
            ("2 #Expressions\n\nx #Identities\n", "line 3: \"x #Identities\" where a line such as \"3 #Identities\""),
            ("2 #Expressions\n1 #Identities\na\n", "line 3: 2 expressions of 1 identities need"),
            ("1 #Expressions\n1 #Identities\na\nb\n", "line 4: 1 expressions of 1 identities"),
            ("9999999999999 #Expressions\n9999999999999 #Identities\na\n", "but 1 are there"),
            ("1 #Expressions\n1 #Identities\na\0b\n", "line 3: the file name"),
        ] {
            let error = parse(text.as_bytes(), Path::new("t")).expect_err("must be refused").to_string();
            assert!(error.contains(message), "{text:?}: {error}");
        }
        assert!(parse(b"1 #Expressions\n1 #Identities\n\xFF", Path::new("t")).is_err());
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        let judge = |bytes: &[u8]| match parse(bytes, Path::new("t")) {
            Ok(collection) => assert_eq!(collection.paths.len(), collection.n_identities * collection.n_expressions),
            Err(error) => assert!(matches!(error, Error::Malformed { .. }), "{error}"),
        };
        let mut bytes = TEXT.as_bytes().to_vec();
        for at in 0..bytes.len() {
            judge(&TEXT.as_bytes()[..at]);
            for byte in 0..=255 {
                bytes[at] = byte;
                judge(&bytes);
            }
            bytes[at] = TEXT.as_bytes()[at];
        }
    }
}
