//! `cargo xtask no-panic`: no entry of the kernel, for Rust or for C, reaches the panic handler or an allocator.
//!
//! The kernel's public surface is compiled with full link-time optimisation into a static library whose panic
//! handler calls a symbol that nothing defines. From every entry the references are followed; apart from the
//! memory functions that any C compiler may call, nothing undefined may be met.

use crate::archive::{Library, Node};
use crate::c_header::Header;
use crate::call_graph::{Trespass, trespasses};
use crate::process::{Result, cargo_in, succeed, target_dir};
use crate::public_functions::unnamed;
use crate::side_by_side::{each, processors};
use std::collections::{BTreeMap, BTreeSet};

/// The package with the entries.
pub const FOLDER: &str = "tests/no-panic";
/// Its folder below the build folder.
pub const TARGET: &str = "no-panic";
/// The kernel, every public function of which some entry calls.
const KERNEL: &str = "core-nostd/src";

/// Entries are the exported functions whose names begin so: those of the package, and those of the crate for C that is linked into it.
const PREFIXES: [&str; 2] = ["check_", "hab_"];
/// Optimised for speed, and for size, where fewer checks are seen to be needless; and their folders below the build folder.
const PROFILES: [(&str, &str); 2] = [("release", TARGET), ("size", "no-panic-size")];
/// The controls among them, each with the symbol it must be caught with.
const CONTROLS: [(&str, &str); 3] =
    [("check_control_index", PANIC), ("check_control_deep", PANIC), ("check_control_heap", "malloc")];
/// What the panic handler calls.
const PANIC: &str = "habitus_panic_path_survived";
/// Undefined symbols that are no trespass.
pub const MEMORY_FUNCTIONS: [&str; 5] = ["memcpy", "memmove", "memset", "memcmp", "bcmp"];

/// Builds the library for speed and for size, and inspects both.
pub fn run() -> Result<()> {
    let unnamed = unnamed(KERNEL, &format!("{FOLDER}/src"))?;
    if !unnamed.is_empty() {
        return Err(format!("no entry in {FOLDER} calls {}: add one for each", unnamed.join(", ")).into());
    }
    // Each is one long run of one core.
    let libraries = each(&PROFILES, processors(), |(profile, target)| library(profile, target))?;
    let mut found = 0;
    let mut proven = 0;
    for (library, (profile, _)) in libraries.into_iter().zip(PROFILES) {
        let library = library?;
        let entries = entries(&library);
        if let Some(prefix) = PREFIXES.iter().find(|prefix| !entries.iter().any(|entry| entry.starts_with(**prefix))) {
            return Err(format!("{FOLDER} exports no function named {prefix}*: nothing was checked").into());
        }
        declared(&entries.iter().copied().filter(|entry| entry.starts_with(PREFIXES[1])).collect())?;
        let (controls, entries): (Vec<&str>, Vec<&str>) = entries.into_iter().partition(|entry| is_control(entry));
        caught(&library, &controls)?;
        proven = entries.len();
        let of_profile: Vec<_> = entries.iter().flat_map(|entry| trespasses(&library, entry, forbidden)).collect();
        report(profile, &of_profile);
        found += of_profile.len();
    }
    if found > 0 {
        let text = "ways above lead to a panic or an allocation: remove each, most often by \
                    `get`, an iterator, or one length check at the top";
        return Err(format!("{found} {text}").into());
    }
    println!(
        "no panic, no allocation: {proven} entries proven at two optimisations, {} controls caught",
        CONTROLS.len()
    );
    Ok(())
}

/// Whether an exported function is an entry that is no control.
pub fn is_entry(name: &str) -> bool {
    PREFIXES.iter().any(|prefix| name.starts_with(prefix)) && !is_control(name)
}

fn is_control(entry: &str) -> bool {
    CONTROLS.iter().any(|(control, _)| *control == entry)
}

/// Fails unless each control is there and caught.
fn caught(library: &Library, there: &[&str]) -> Result<()> {
    for (control, symbol) in CONTROLS {
        if !there.contains(&control) {
            return Err(format!("the control {control} is missing from {FOLDER}").into());
        }
        if !trespasses(library, control, forbidden).iter().any(|trespass| trespass.symbol == symbol) {
            return Err(format!("the control {control} was not caught with {symbol}: the check is blind").into());
        }
    }
    Ok(())
}

fn library(profile: &str, target: &str) -> Result<Library> {
    succeed(&mut cargo_in(FOLDER, target, &["build", "--quiet", "--profile", profile]))?;
    let path = target_dir(target).join(profile).join("libhabitus_no_panic.a");
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Library::of_archive(&bytes).map_err(|error| format!("{}: {error}", path.display()).into())
}

fn entries(library: &Library) -> Vec<&str> {
    library
        .exported
        .keys()
        .map(String::as_str)
        .filter(|name| PREFIXES.iter().any(|prefix| name.starts_with(prefix)))
        .collect()
}

/// Fails unless the entries for C are the functions of the header.
fn declared(entries: &BTreeSet<&str>) -> Result<()> {
    let header = Header::read()?;
    let functions = header.functions.iter().map(String::as_str).collect::<BTreeSet<_>>();
    match functions.symmetric_difference(entries).next() {
        None => Ok(()),
        Some(name) => {
            Err(format!("{name} is in only one of {FOLDER} and the header: not every entry was checked").into())
        }
    }
}

fn forbidden(node: &Node) -> bool {
    match node {
        Node::Undefined(name) => !MEMORY_FUNCTIONS.contains(&name.as_str()),
        Node::Defined { .. } => false,
    }
}

/// Prints each way once, with the entries that it serves.
fn report(profile: &str, found: &[Trespass]) {
    let mut entries_of: BTreeMap<(&[String], &BTreeSet<String>), Vec<&str>> = BTreeMap::new();
    for trespass in found {
        // The first step is the entry itself; what it calls may be shared.
        let tail = if trespass.way.len() > 3 { &trespass.way[1..] } else { &trespass.way };
        entries_of.entry((tail, &trespass.positions)).or_default().push(&trespass.entry);
    }
    for ((way, positions), entries) in entries_of {
        eprintln!("{} (profile {profile}):", entries.join(", "));
        for (depth, name) in way.iter().enumerate() {
            eprintln!("  {:depth$}{name}", "");
        }
        for position in positions {
            eprintln!("  may panic at {position}");
        }
    }
}
