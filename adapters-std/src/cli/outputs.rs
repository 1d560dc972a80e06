//! What a verb is about to write, checked before any work: nothing that it reads may be overwritten, no two of its outputs may be one file,
//! and every output must have a place.

use std::path::{Path, PathBuf};

use crate::Error;
use crate::io::atomic;

/// The files and folders that a verb reads and writes.
#[derive(Debug, Default)]
pub(super) struct Outputs {
    inputs: Vec<PathBuf>,
    files: Vec<Output>,
    folders: Vec<Output>,
}

/// A file or folder that is written, and the option that names it.
#[derive(Debug, Clone)]
struct Output {
    option: &'static str,
    path: PathBuf,
}

impl Outputs {
    /// Those of a verb that reads `inputs`.
    pub(super) fn beside<'a>(inputs: impl IntoIterator<Item = &'a Path>) -> Self {
        Outputs { inputs: inputs.into_iter().map(Path::to_owned).collect(), ..Outputs::default() }
    }

    /// A file that an option names, if it does.
    pub(super) fn file(mut self, option: &'static str, path: Option<&Path>) -> Self {
        self.files.extend(path.map(|path| Output { option, path: path.to_owned() }));
        self
    }

    /// A folder that an option names, if it does, with the names of files in it that are written over.
    pub(super) fn folder<T: AsRef<Path>>(
        mut self,
        option: &'static str,
        path: Option<&Path>,
        names: impl IntoIterator<Item = T>,
    ) -> Self {
        if let Some(path) = path {
            self.folders.push(Output { option, path: path.to_owned() });
            self.files.extend(names.into_iter().map(|name| Output { option, path: path.join(name) }));
        }
        self
    }

    /// Whether everything can be written without harm to the inputs.
    ///
    /// A folder is made when it does not exist, but nothing above it. What is no regular file (`/dev/null`) can be named twice.
    ///
    /// # Errors
    /// [`Error::Input`] for an output that is an input or another output, also through links, or a file where a folder is expected or the other
    /// way round; [`Error::Write`] where there is no folder for it, or none that takes a file.
    pub(super) fn check(&self) -> Result<(), Error> {
        let is_in_folder = |output: &Output| {
            self.folders.iter().any(|folder| folder.option == output.option && output.path.starts_with(&folder.path))
        };
        for (at, output) in self.files.iter().enumerate() {
            let Some(target) = target(&output.path) else { continue };
            let shown = output.path.display();
            if let Some(input) = self.inputs.iter().find(|input| self::target(input).as_ref() == Some(&target)) {
                let input = if *input == output.path { String::new() } else { format!(" ({})", input.display()) };
                return Err(Error::input(format!(
                    "{shown}: {} would overwrite an input{input}; name another output",
                    output.option
                )));
            }
            let earlier = self.files[..at].iter().find(|other| self::target(&other.path).as_ref() == Some(&target));
            if let Some(earlier) = earlier {
                return Err(Error::input(format!(
                    "{shown}: {} and {} would write the same file; name another for one of them",
                    earlier.option, output.option
                )));
            }
        }
        self.files.iter().filter(|output| !is_in_folder(output)).try_for_each(|output| takes_file(&output.path))?;
        self.folders.iter().try_for_each(|folder| takes_folder(&folder.path))
    }
}

/// What is replaced when `path` is written or was read, with links followed; none for what is no regular file.
fn target(path: &Path) -> Option<PathBuf> {
    if std::fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return None;
    }
    if let Ok(found) = std::fs::canonicalize(path) {
        return Some(found);
    }
    let folder = std::fs::canonicalize(folder_of(path)).unwrap_or_else(|_| folder_of(path).to_owned());
    Some(folder.join(path.file_name()?))
}

/// The folder in which `path` lies.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

fn takes_file(path: &Path) -> Result<(), Error> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => {
            Err(Error::input(format!("{}: is a folder; name a file for the output", path.display())))
        }
        Ok(found) if !found.is_file() => Ok(()),
        _ => atomic::check_folder(path, &target(path).map_or_else(PathBuf::new, |path| folder_of(&path).to_owned())),
    }
}

fn takes_folder(path: &Path) -> Result<(), Error> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_dir() => atomic::check_folder(path, path),
        Ok(_) => Err(Error::input(format!("{}: is a file; name a folder for the output", path.display()))),
        Err(_) => atomic::check_folder(path, folder_of(path)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(outputs: &Outputs) -> String {
        outputs.check().map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn inputs_are_not_overwritten() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a.ply"), "x").expect("written");
        let over = |output: &Path| said(&Outputs::beside([&*at("a.ply")]).file("-o", Some(output)));
        assert!(over(&at("a.ply")).contains("a.ply: -o would overwrite an input; name another output"));
        assert!(
            over(&at("./../").join(folder.path().file_name().expect("a name")).join("a.ply")).contains("an input (")
        );
        assert_eq!(over(&at("b.ply")), "");
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(at("a.ply"), at("link.ply")).expect("a link");
            assert!(over(&at("link.ply")).contains("link.ply: -o would overwrite an input ("));
        }
        let report = Outputs::beside([&*at("page/scan.glb")]).folder("--report", Some(&at("page")), ["scan.glb"]);
        assert!(said(&report).contains("scan.glb: --report would overwrite an input"), "{}", said(&report));
        assert_eq!(std::fs::read(at("a.ply")).expect("read"), b"x");
    }

    #[test]
    fn outputs_are_different_files() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        let two = |a: &Path, b: &Path| said(&Outputs::beside([]).file("-o", Some(a)).file("--png", Some(b)));
        assert!(two(&at("a.png"), &at(".").join("a.png")).contains("-o and --png would write the same file"));
        assert_eq!(two(&at("a.png"), &at("b.png")), "");
        let null = Path::new("/dev/null");
        assert!(!null.exists() || two(null, null).is_empty());
        let both = Outputs::beside([]).file("-o", Some(&at("page/fit.glb"))).folder(
            "--report",
            Some(&at("page")),
            ["fit.glb"],
        );
        assert!(said(&both).contains("-o and --report would write the same file"), "{}", said(&both));
    }

    #[test]
    fn outputs_have_a_place() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("file"), "x").expect("written");
        let file = |name: &str| said(&Outputs::beside([]).file("-o", Some(&at(name))));
        let page = |name: &str| said(&Outputs::beside([]).folder("--report", Some(&at(name)), ["index.html"]));
        for said in [file("none/a.ply"), page("none/page"), file("file/a.ply")] {
            assert!(said.contains("there is no folder") && said.contains("create it, or name another"), "{said}");
        }
        assert!(page("file").contains("file: is a file; name a folder"));
        assert!(file(".").contains("is a folder; name a file"));
        assert_eq!((file("a.ply"), page("page"), page(".")), (String::new(), String::new(), String::new()));
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 1, "a check leaves nothing");
    }
}
