//! Writing a file so that it is there completely or not at all.
//!
//! The bytes go to a temporary file in the same folder, are flushed to the disk, and the file then takes the name of
//! the target: a reader, or a power failure, sees the old content or the new, never a part.

use std::fs::{File, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::Error;

/// Writes `bytes` to `path` atomically.
///
/// # Errors
/// [`Error::Write`]; the target is then unchanged.
pub fn write(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), Error> {
    write_with(path, |writer| writer.write_all(bytes))
}

/// Writes to `path` atomically what `content` writes to its argument, which can also seek.
///
/// A symbolic link stays one, and its target is replaced; an existing file's permissions are kept. A target that is
/// no regular file (`/dev/stdout`) is written directly.
///
/// # Errors
/// [`Error::Write`] with the error of the operating system or of `content`; the target is then unchanged.
pub fn write_with(
    path: impl AsRef<Path>,
    content: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), Error> {
    let path = path.as_ref();
    replaced(path, content).map_err(|source| Error::Write { path: path.to_owned(), source })
}

fn replaced(path: &Path, content: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    let old = std::fs::metadata(path).ok();
    if old.as_ref().is_some_and(|old| !old.is_file()) {
        let file = File::options().write(true).open(path)?;
        return flushed(&file, content);
    }
    let target = if path.is_symlink() && old.is_some() { std::fs::canonicalize(path)? } else { path.to_owned() };
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    };
    let temporary = temporary_in(&folder)?;
    flushed(temporary.as_file(), content)?;
    if let Some(old) = old {
        temporary.as_file().set_permissions(old.permissions())?;
    }
    temporary.as_file().sync_all()?;
    temporary.persist(&target).map_err(|error| error.error)?;
    // The new name itself must reach the disk; some file systems cannot flush a folder, which takes nothing away.
    if let Ok(folder) = File::open(&folder) {
        let _ = folder.sync_all();
    }
    Ok(())
}

/// Whether `folder` exists and takes files, so that `path` can be written there; nothing stays behind.
///
/// # Errors
/// [`Error::Write`] of `path`.
pub fn check_folder(path: &Path, folder: &Path) -> Result<(), Error> {
    temporary_in(folder).map(drop).map_err(|source| Error::Write { path: path.to_owned(), source })
}

fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    if !folder.is_dir() {
        let problem = format!("there is no folder {}: create it, or name another", folder.display());
        return Err(io::Error::new(io::ErrorKind::NotFound, problem));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".habitus-");
    if let Some(permissions) = new_file_permissions() {
        builder.permissions(permissions);
    }
    // Its own message names the temporary file, which nobody asked for.
    builder.tempfile_in(folder).map_err(|error| io::Error::from(error.kind()))
}

fn flushed(file: &File, content: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> io::Result<()> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    content(&mut writer)?;
    writer.flush()
}

/// What a new file may get before the user's mask is applied; temporary files are private otherwise.
#[cfg(unix)]
fn new_file_permissions() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(0o666))
}

#[cfg(not(unix))]
fn new_file_permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).expect("folder");
        entries.map(|e| e.expect("entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn replaces_the_content_and_leaves_nothing_else() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        write(&path, b"first").expect("write");
        write(&path, b"2nd").expect("write");
        assert_eq!(std::fs::read(&path).expect("read"), b"2nd");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_failing_writer_leaves_the_old_content() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.bin");
        write(&path, b"old").expect("write");
        let outcome = write_with(&path, |writer| {
            writer.write_all(b"half of the new")?;
            Err(io::Error::other("disk on fire"))
        });
        let message = outcome.expect_err("must fail").to_string();
        assert!(message.contains("a.bin: cannot be written: disk on fire"), "{message}");
        assert_eq!(std::fs::read(&path).expect("read"), b"old");
        assert_eq!(names(folder.path()), ["a.bin"]);
    }

    #[test]
    fn a_missing_folder_is_named_and_the_temporary_file_is_not() {
        let folder = tempfile::tempdir().expect("folder");
        std::fs::write(folder.path().join("file"), b"").expect("write");
        for missing in ["none", "file"] {
            let missing = folder.path().join(missing);
            let error = write(missing.join("a.bin"), b"x").expect_err("must fail");
            assert!(matches!(error, Error::Write { .. }));
            let named = format!("a.bin: cannot be written: there is no folder {}: create it", missing.display());
            let message = error.to_string();
            assert!(message.contains(&named) && !message.contains(".habitus-"), "{message}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_takes_no_file_is_told_without_the_temporary_one() {
        // Nobody, not even root, creates files there.
        let message = write("/proc/self/a.bin", b"x").expect_err("must fail").to_string();
        assert!(message.starts_with("/proc/self/a.bin: cannot be written: "), "{message}");
        assert!(!message.contains(".habitus-"), "{message}");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_and_links_are_kept() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().expect("folder");
        let (path, link) = (folder.path().join("a.bin"), folder.path().join("link.bin"));
        write(&path, b"old").expect("write");
        std::fs::set_permissions(&path, Permissions::from_mode(0o640)).expect("permissions");
        std::os::unix::fs::symlink(&path, &link).expect("link");
        write(&link, b"new").expect("write");
        assert!(link.is_symlink());
        assert_eq!(std::fs::read(&path).expect("read"), b"new");
        assert_eq!(std::fs::metadata(&path).expect("metadata").permissions().mode() & 0o777, 0o640);
    }
}
