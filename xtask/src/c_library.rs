//! The libraries that C and C++ programs link, made from the crate in ffi/ for this machine.
//!
//! Rust's static library also holds the standard library, which no function of the header reaches. One link keeps what the functions reach, as
//! one object in which nothing else is visible: it needs no system library, and its names meet no other Rust library's in a program. Static and
//! shared library are made from this object.

use crate::c_header::Header;
use crate::no_panic::MEMORY_FUNCTIONS;
use crate::process::{Result, cargo_in, output, succeed, target_dir};
use object::{Object, ObjectSymbol};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of the shared library that programs ask for; another one only when they would no longer run with it.
const COMPATIBILITY: u32 = 1;
/// Build folder.
pub const TARGET: &str = "hosts";

/// Where the libraries are, and their names.
pub struct Libraries {
    /// `libhabitus.a`.
    pub static_library: PathBuf,
    /// The shared library under its full name.
    pub shared_library: PathBuf,
}

impl Libraries {
    /// The name that linkers look for.
    pub const LINK_NAME: &str = "libhabitus.so";

    /// The name in programs.
    pub fn soname() -> String {
        format!("{}.{COMPATIBILITY}", Self::LINK_NAME)
    }

    /// The name of the file.
    pub fn file_name() -> String {
        format!("{}.{}", Self::soname(), habitus_ffi::HAB_ABI_VERSION)
    }
}

/// The C compiler of this machine.
pub fn c_compiler() -> Command {
    Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
}

/// Builds and inspects both.
pub fn built(profile: &str) -> Result<Libraries> {
    if !cfg!(all(unix, not(target_vendor = "apple"))) {
        let remedy = format!("`cargo build -p habitus-ffi --profile {profile}` makes the libraries under Rust's names");
        return Err(
            format!("the libraries are put together with ELF tools, which this system does not use: {remedy}").into()
        );
    }
    for (tool, package) in [("objcopy", "binutils"), ("ar", "binutils")] {
        if output(Command::new(tool).arg("--version")).is_none() {
            return Err(format!("{tool} is missing: on Debian `apt-get install {package}`").into());
        }
    }
    if output(c_compiler().arg("--version")).is_none() {
        return Err(String::from("no C compiler: on Debian `apt-get install gcc`, or name one in CC").into());
    }
    let functions = Header::read()?.functions;
    let arguments = ["rustc", "--quiet", "--lib", "--crate-type", "staticlib", "--profile", profile];
    succeed(&mut cargo_in("ffi", TARGET, &arguments))?;
    let of_profile = if matches!(profile, "dev" | "test") { "debug" } else { profile };
    let folder = target_dir(TARGET).join(of_profile);
    let object = object_of(&folder, &functions)?;
    let static_library = folder.join("libhabitus.a");
    // An archive of an earlier run would keep its members.
    let _ = std::fs::remove_file(&static_library);
    succeed(Command::new("ar").arg("rcsD").arg(&static_library).arg(&object))?;
    let shared_library = shared(&folder, &functions, &object)?;
    inspected(&object, &functions, false)?;
    inspected(&shared_library, &functions, true)?;
    Ok(Libraries { static_library, shared_library })
}

/// What the functions reach, with nothing else to be seen.
fn object_of(folder: &Path, functions: &[String]) -> Result<PathBuf> {
    let (linked, object, names) = (folder.join("linked.o"), folder.join("habitus.o"), folder.join("functions.txt"));
    write(&names, &(functions.join("\n") + "\n"))?;
    let roots = functions.iter().map(|name| format!("-Wl,-u,{name}"));
    let mut link = c_compiler();
    link.args(["-r", "-nostdlib", "-Wl,--gc-sections"]).args(roots);
    succeed(link.arg("-o").arg(&linked).arg(folder.join("libhabitus_ffi.a")))?;
    let keep = format!("--keep-global-symbols={}", names.display());
    succeed(Command::new("objcopy").arg(keep).arg("--strip-unneeded").arg(&linked).arg(&object))?;
    Ok(object)
}

fn shared(folder: &Path, functions: &[String], object: &Path) -> Result<PathBuf> {
    let (script, library) = (folder.join("functions.map"), folder.join(Libraries::file_name()));
    write(&script, &format!("{{ global: {}; local: *; }};\n", functions.join("; ")))?;
    let mut link = c_compiler();
    link.args(["-shared", "-static-libgcc", "-Wl,--gc-sections,-z,defs,-z,relro,-z,now,-s"]);
    link.arg(format!("-Wl,-soname,{}", Libraries::soname())).arg(format!("-Wl,--version-script,{}", script.display()));
    succeed(link.arg("-o").arg(&library).arg(object))?;
    Ok(library)
}

/// Fails unless a library defines the header's functions, and no other, and asks for nothing but the memory functions of C: so it neither
/// allocates nor panics, and needs no system library.
fn inspected(path: &Path, functions: &[String], dynamic: bool) -> Result<()> {
    let failed = |error: String| format!("{}: {error}", path.display());
    let bytes = std::fs::read(path).map_err(|error| failed(error.to_string()))?;
    let file = object::File::parse(&*bytes).map_err(|error| failed(error.to_string()))?;
    let symbols = if dynamic { file.dynamic_symbols() } else { file.symbols() };
    let (mut defined, mut asked) = (BTreeSet::new(), BTreeSet::new());
    for symbol in symbols.filter(ObjectSymbol::is_global) {
        let name = symbol.name().map_err(|error| failed(error.to_string()))?;
        // What the linker's start code asks for is weak.
        match symbol.is_undefined() {
            true if symbol.is_weak() || name.is_empty() => {}
            true => _ = asked.insert(name),
            false => _ = defined.insert(name),
        }
    }
    let functions = functions.iter().map(String::as_str).collect::<BTreeSet<_>>();
    if let Some(name) = functions.symmetric_difference(&defined).next() {
        let fault =
            if defined.contains(name) { "is visible, but not in the header" } else { "is in the header, but missing" };
        return Err(failed(format!("{name} {fault}")).into());
    }
    match asked.iter().find(|name| !MEMORY_FUNCTIONS.contains(name)) {
        Some(name) => {
            Err(failed(format!("it asks for {name}: a function of the header reaches the standard library")).into())
        }
        None => Ok(()),
    }
}

fn write(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).map_err(|error| format!("{}: {error}", path.display()).into())
}
