//! `cargo xtask install --prefix DIR`: libraries, headers, CMake package and pkg-config file. The folder can be moved afterwards.

use crate::c_library::{Libraries, built};
use crate::process::{Result, project};
use std::path::{Path, PathBuf};

/// Options of `cargo xtask install`.
#[derive(clap::Args)]
pub struct Options {
    /// Where to: DIR/lib, DIR/include.
    #[arg(long, value_name = "DIR")]
    prefix: PathBuf,
    /// Profile of cargo.
    #[arg(long, default_value = "library")]
    profile: String,
}

/// Builds and copies.
pub fn run(options: &Options) -> Result<()> {
    let libraries = built(&options.profile)?;
    for path in installed(&libraries, &options.prefix)? {
        println!("{}", path.display());
    }
    Ok(())
}

/// Copies libraries that were built, and what goes with them, to a prefix; returns the paths.
pub fn installed(libraries: &Libraries, prefix: &Path) -> Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    let mut put = |to: &str, content: Content<'_>| -> Result<()> {
        let path = prefix.join(to);
        let failed = |error: std::io::Error| format!("{}: {error}", path.display());
        let folder = path.parent().unwrap_or(prefix);
        std::fs::create_dir_all(folder).map_err(failed)?;
        // A link of an earlier version would be written through.
        if path.symlink_metadata().is_ok() {
            std::fs::remove_file(&path).map_err(failed)?;
        }
        match content {
            Content::File(from) => std::fs::copy(from, &path).map(|_| ()),
            Content::Text(text) => std::fs::write(&path, text),
            Content::Link(target) => linked(&target, &path),
        }
        .map_err(failed)?;
        paths.push(path);
        Ok(())
    };
    let (soname, file_name) = (Libraries::soname(), Libraries::file_name());
    put("lib/libhabitus.a", Content::File(&libraries.static_library))?;
    put(&format!("lib/{file_name}"), Content::File(&libraries.shared_library))?;
    put(&format!("lib/{soname}"), Content::Link(file_name.clone()))?;
    put(&format!("lib/{}", Libraries::LINK_NAME), Content::Link(soname))?;
    for header in ["habitus.h", "habitus.hpp"] {
        put(&format!("include/{header}"), Content::File(&project().join("include").join(header)))?;
    }
    for name in ["habitus-config.cmake", "habitus-config-version.cmake"] {
        put(&format!("lib/cmake/habitus/{name}"), Content::Text(filled_in(name)?))?;
    }
    put("lib/pkgconfig/habitus.pc", Content::Text(filled_in("habitus.pc")?))?;
    Ok(paths)
}

enum Content<'c> {
    File(&'c Path),
    Text(String),
    Link(String),
}

/// A template of the crate with its names and numbers.
fn filled_in(name: &str) -> Result<String> {
    let path = project().join("ffi").join(format!("{name}.in"));
    let text = std::fs::read_to_string(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    let values = [
        ("@VERSION@", env!("CARGO_PKG_VERSION").to_owned()),
        ("@SONAME@", Libraries::soname()),
        ("@FILE_NAME@", Libraries::file_name()),
        ("@POINTER_BYTES@", size_of::<usize>().to_string()),
    ];
    let text = values.iter().fold(text, |text, (name, value)| text.replace(name, value));
    match text.split('@').nth(1) {
        Some(name) if text.matches('@').count() > 1 => {
            Err(format!("{}: nothing is known for @{name}@", path.display()).into())
        }
        _ => Ok(text),
    }
}

#[cfg(unix)]
fn linked(target: &str, path: &Path) -> std::io::Result<()> {
    std::os::unix::fs::symlink(target, path)
}

#[cfg(not(unix))]
fn linked(_: &str, _: &Path) -> std::io::Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}
