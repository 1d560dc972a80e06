//! Names of the kernel's public functions, read from its sources, and those that the entries of the no-panic proof do not name.

use crate::process::{Result, project};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Functions of the kernel that no file in `folder` names, each with its file. A name says nothing of its type: of two functions of one name, one named is
/// enough.
pub fn unnamed(kernel: &str, folder: &str) -> Result<Vec<String>> {
    let mut named = BTreeSet::new();
    for path in sources(&project().join(folder))? {
        named.extend(words(&read(&path)?).map(String::from));
    }
    let mut found = Vec::new();
    for path in sources(&project().join(kernel))? {
        let text = read(&path)?;
        let missing = public_functions(&text).filter(|name| !named.contains(*name));
        found.extend(
            missing.map(|name| format!("{name} ({})", path.strip_prefix(project()).unwrap_or(&path).display())),
        );
    }
    Ok(found)
}

/// The files of a folder and the folders in it that are no tests.
fn sources(folder: &Path) -> Result<Vec<PathBuf>> {
    let told = |error| format!("{}: {error}", folder.display());
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(told)? {
        let path = entry.map_err(told)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() {
            found.extend(sources(&path)?);
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") && name != "testing.rs" {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

fn read(path: &Path) -> Result<String> {
    Ok(std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?)
}

/// Names of the functions that the text declares public, up to its tests.
fn public_functions(text: &str) -> impl Iterator<Item = &str> {
    let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or(text);
    code.lines().filter_map(|line| {
        let rest = line.trim_start().strip_prefix("pub ")?;
        let rest = rest.strip_prefix("const ").unwrap_or(rest).strip_prefix("fn ")?;
        words(rest).next()
    })
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|letter: char| letter != '_' && !letter.is_alphanumeric()).filter(|word| !word.is_empty())
}

#[cfg(test)]
mod tests {
    use super::public_functions;

    #[test]
    fn public_functions_are_found_up_to_the_tests() {
        let text = "pub fn one(a: f32) {}\n    pub const fn two<R: Real>() {}\npub(crate) fn own() {}\nfn mine() {}\n\
                    // pub fn said\n#[cfg(test)]\nmod tests {\n    pub fn three() {}\n}\n";
        assert_eq!(public_functions(text).collect::<Vec<_>>(), ["one", "two"]);
    }
}
