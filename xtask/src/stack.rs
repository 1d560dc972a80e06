//! `cargo xtask stack`: the most stack that each public entry of the kernel, for Rust or for C, can take on a Cortex-M, from its code alone.
//!
//! The compiler writes the frame of every function beside its code (`-Z emit-stack-sizes`). Along the calls of the library that the proof without panic
//! inspects, compiled for size as firmware is, frames are summed to the deepest way. A function whose address is mentioned may be called from anywhere:
//! the deepest of those that an entry reaches is added, with those that it reaches in turn. Recursion is an error. Frames of the caller and of interrupts are not in it.

use crate::archive::{Library, Node};
use crate::compiler::{Build, Compiler, Kind};
use crate::no_panic;
use crate::process::{Result, project, succeed, target_dir};
use crate::targets::Target;
use std::collections::{BTreeMap, BTreeSet};

/// Relative to the project: entry to bytes.
const BUDGETS: &str = "tests/stack.json";
/// The profile of [`no_panic::FOLDER`], and the library that it makes.
const PROFILE: &str = "size";
const LIBRARY: &str = "habitus-no-panic";
/// Bytes of an address of the target.
const ADDRESS: usize = 4;
/// Where the compiler writes frames.
const SIZES: &str = ".stack_sizes";

/// In the mangled name of a writer's `core::fmt::Write::write_fmt`, which stands in the table that it mentions and never calls itself through it.
const WRITE_FMT: &str = "3fmt5Write9write_fmt";

/// Options of `cargo xtask stack`.
#[derive(clap::Args)]
pub struct Options {
    /// Print the bytes by entry as JSON, and nothing else, on standard output.
    #[arg(long)]
    json: bool,
    /// Write the budgets anew: what was found and 3 % more, in steps of 8 bytes.
    #[arg(long)]
    write: bool,
}

/// Builds, sums, compares with the budgets.
pub fn run(options: &Options) -> Result<()> {
    let library = built()?;
    let frames = frames(&library)?;
    let mut found = BTreeMap::new();
    for (entry, &node) in library.exported.iter().filter(|(name, _)| no_panic::is_entry(name)) {
        found.insert(entry.clone(), deepest(&library, &frames, node)?);
    }
    if options.write {
        let budgets: BTreeMap<_, _> =
            found.iter().map(|(entry, bytes)| (entry, (bytes + bytes * 3 / 100).div_ceil(8) * 8)).collect();
        std::fs::write(project().join(BUDGETS), format!("{:#}\n", serde_json::json!(budgets)))
            .map_err(|error| format!("{BUDGETS}: {error}"))?;
    }
    let text = std::fs::read_to_string(project().join(BUDGETS)).map_err(|error| format!("{BUDGETS}: {error}"))?;
    let budgets: BTreeMap<String, u64> = serde_json::from_str(&text).map_err(|error| format!("{BUDGETS}: {error}"))?;
    if options.json {
        println!("{:#}", serde_json::json!(found));
    } else {
        println!("{}", table(&found));
    }
    let objections = objections(&found, &budgets);
    if objections.is_empty() { Ok(()) } else { Err(objections.join("\n").into()) }
}

/// The library of all entries, compiled for a Cortex-M with the frames of its functions.
fn built() -> Result<Library> {
    let compiler = Compiler::installed(Target::CortexM)?;
    let (kind, folder) = (Kind::StaticLibrary, target_dir("stack"));
    let mut command = compiler.build(&Build { folder: no_panic::FOLDER, profile: PROFILE, features: "", kind });
    let flags = format!("{} -Z emit-stack-sizes", crate::compiler::PASS_OFF);
    command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS", flags).env("RUSTC_BOOTSTRAP", "1");
    succeed(command.arg("--quiet").env("CARGO_TARGET_DIR", &folder))?;
    let path = compiler.artefact_below(&folder, kind, PROFILE, LIBRARY);
    let bytes = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Library::of_archive(&bytes).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// The frame of each function, by node.
fn frames(library: &Library) -> Result<BTreeMap<usize, u64>> {
    let mut frames = BTreeMap::new();
    for (node, edges) in library.nodes.iter().zip(&library.edges) {
        let Node::Defined { name, bytes } = node else { continue };
        if name != SIZES {
            continue;
        }
        for edge in edges {
            let from = usize::try_from(edge.offset).unwrap_or(usize::MAX).saturating_add(ADDRESS);
            let size = bytes.get(from..).and_then(number).ok_or_else(|| String::from("a frame's size is cut off"))?;
            frames.insert(edge.to, size);
        }
    }
    if frames.is_empty() { Err(String::from("the compiler wrote no frames").into()) } else { Ok(frames) }
}

/// An unsigned number in groups of seven bits, the lowest first.
fn number(bytes: &[u8]) -> Option<u64> {
    let mut value = 0;
    for (k, byte) in bytes.iter().enumerate().take(9) {
        value |= u64::from(byte & 0x7f) << (7 * k);
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

/// The most stack below a function, itself included.
fn deepest(library: &Library, frames: &BTreeMap<usize, u64>, entry: usize) -> Result<u64> {
    below(library, frames, entry, &mut BTreeMap::new(), &mut BTreeSet::new())
}

/// The same, `by_address` being the functions on the way that were called through an address.
fn below(
    library: &Library,
    frames: &BTreeMap<usize, u64>,
    function: usize,
    known: &mut BTreeMap<usize, u64>,
    by_address: &mut BTreeSet<usize>,
) -> Result<u64> {
    if !by_address.insert(function) {
        let name = library.nodes[function].name();
        if name.contains(WRITE_FMT) {
            return Ok(0);
        }
        return Err(format!("{name} may call itself through an address: its stack has no bound").into());
    }
    let called = depth(library, frames, function, known, &mut BTreeSet::new())?;
    let mut through = 0;
    for other in mentioned(library, frames, function) {
        through = through.max(below(library, frames, other, known, by_address)?);
    }
    by_address.remove(&function);
    Ok(called + through)
}

/// The functions whose addresses are mentioned by what a function calls, and by the constants that this mentions.
fn mentioned(library: &Library, frames: &BTreeMap<usize, u64>, function: usize) -> BTreeSet<usize> {
    let (mut seen, mut queue, mut found) = (BTreeSet::new(), vec![function], BTreeSet::new());
    while let Some(node) = queue.pop() {
        if !seen.insert(node) {
            continue;
        }
        for edge in library.edges[node].iter().filter(|edge| edge.to != node) {
            if frames.contains_key(&edge.to) && !edge.call {
                found.insert(edge.to);
            } else {
                queue.push(edge.to);
            }
        }
    }
    found
}

/// The deepest way from a function along calls.
fn depth(
    library: &Library,
    frames: &BTreeMap<usize, u64>,
    node: usize,
    known: &mut BTreeMap<usize, u64>,
    way: &mut BTreeSet<usize>,
) -> Result<u64> {
    let Some(own) = frames.get(&node) else { return Ok(0) };
    if let Some(&depth) = known.get(&node) {
        return Ok(depth);
    }
    if !way.insert(node) {
        return Err(format!("{} calls itself: its stack has no bound", library.nodes[node].name()).into());
    }
    let mut below = 0;
    // A jump within a function is a reference to its own section.
    for edge in library.edges[node].iter().filter(|edge| edge.call && edge.to != node) {
        below = below.max(depth(library, frames, edge.to, known, way)?);
    }
    way.remove(&node);
    known.insert(node, own + below);
    Ok(own + below)
}

/// A sentence for every entry beyond its budget or without one, and for every budget without an entry.
fn objections(found: &BTreeMap<String, u64>, budgets: &BTreeMap<String, u64>) -> Vec<String> {
    let beyond = found.iter().filter_map(|(entry, bytes)| match budgets.get(entry) {
        Some(budget) if bytes <= budget => None,
        Some(budget) => Some(format!("{entry}: {bytes} bytes of stack, its budget {budget} ({BUDGETS})")),
        None => Some(format!("{entry}: {bytes} bytes of stack and no budget in {BUDGETS}")),
    });
    let gone = budgets.keys().filter(|entry| !found.contains_key(*entry));
    beyond.chain(gone.map(|entry| format!("{entry} has a budget in {BUDGETS} and is no entry"))).collect()
}

fn table(found: &BTreeMap<String, u64>) -> String {
    let mut rows: Vec<_> = found.iter().collect();
    rows.sort_by_key(|(entry, bytes)| (std::cmp::Reverse(**bytes), *entry));
    let mut text = String::from("| entry | stack at most, bytes |\n|---|---:|\n");
    rows.iter().for_each(|(entry, bytes)| text += &format!("| {entry} | {bytes} |\n"));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::archive::Edge;

    /// Edges to the last two nodes mention an address, the others call.
    fn library(names: &[&str], edges: &[(usize, usize)]) -> Library {
        let mut library = Library::default();
        for name in names {
            library.nodes.push(Node::Defined { name: (*name).into(), bytes: Vec::new() });
            library.edges.push(Vec::new());
        }
        for &(from, to) in edges {
            library.edges[from].push(Edge { offset: 0, to, byte: 0, call: to + 2 < names.len() });
        }
        library
    }

    #[test]
    fn the_deepest_way_counts_and_what_is_called_through_addresses() {
        let ways = [(0, 1), (0, 2), (1, 3), (0, 4), (4, 5), (5, 3)];
        let graph = library(&["a", "b", "c", "d", "table", "e"], &ways);
        let frames = BTreeMap::from([(0, 8), (1, 16), (2, 40), (3, 32), (5, 24)]);
        // a, b, d, and through the table e, which calls d.
        assert_eq!(deepest(&graph, &frames, 0).map_err(|failure| failure.sentence), Ok(8 + 16 + 32 + 24 + 32));
    }

    #[test]
    fn recursion_is_refused_also_through_an_address() {
        let frames = BTreeMap::from([(0, 8), (1, 8)]);
        let by_calls = library(&["a", "b", "table", "other"], &[(0, 1), (1, 0)]);
        assert!(deepest(&by_calls, &frames, 0).is_err());
        let by_address = library(&["table", "a", "other"], &[(1, 0), (0, 1)]);
        assert!(deepest(&by_address, &frames, 1).is_err());
    }

    #[test]
    fn numbers_of_any_length() {
        assert_eq!(number(&[0x08]), Some(8));
        assert_eq!(number(&[0xe5, 0x8e, 0x26, 0xff]), Some(624_485));
        assert_eq!(number(&[0x80]), None);
    }

    #[test]
    fn more_than_a_budget_none_and_one_too_many_are_objected_to() {
        let map = |pairs: &[(&str, u64)]| pairs.iter().map(|(name, bytes)| ((*name).to_owned(), *bytes)).collect();
        let budgets: BTreeMap<String, u64> = map(&[("a", 8), ("b", 8)]);
        assert!(objections(&map(&[("a", 8), ("b", 0)]), &budgets).is_empty());
        assert_eq!(objections(&map(&[("a", 9), ("c", 1)]), &budgets).len(), 3);
    }
}
