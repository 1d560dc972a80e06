//! What an exported function can reach in a static library, by which way, and from which line of source.

use crate::archive::{Library, Node};
use std::collections::{BTreeSet, VecDeque};

/// A way from an entry to a symbol that it must not reach.
#[derive(Debug)]
pub struct Trespass {
    /// The exported function.
    pub entry: String,
    /// The symbol reached.
    pub symbol: String,
    /// Readable names from the entry to the symbol, both included.
    pub way: Vec<String>,
    /// Source positions that the functions on the way would report when panicking.
    pub positions: BTreeSet<String>,
}

/// Every symbol for which `forbidden` holds and which `entry` reaches, each with one shortest way.
pub fn trespasses(library: &Library, entry: &str, forbidden: impl Fn(&Node) -> bool) -> Vec<Trespass> {
    let Some(&start) = library.exported.get(entry) else { return Vec::new() };
    let mut came_from: Vec<Option<usize>> = vec![None; library.nodes.len()];
    let mut queue = VecDeque::from([start]);
    let mut found = Vec::new();
    while let Some(node) = queue.pop_front() {
        if forbidden(&library.nodes[node]) {
            found.push(node);
            continue;
        }
        for edge in &library.edges[node] {
            if edge.to != start && came_from[edge.to].is_none() {
                came_from[edge.to] = Some(node);
                queue.push_back(edge.to);
            }
        }
    }
    let way_to = |end: usize| {
        let mut way: Vec<usize> = std::iter::successors(Some(end), |&node| came_from[node]).collect();
        way.reverse();
        way
    };
    found
        .into_iter()
        .map(|end| {
            let way = way_to(end);
            Trespass {
                entry: entry.to_owned(),
                symbol: library.nodes[end].name().to_owned(),
                positions: way.iter().flat_map(|&node| positions(library, node)).collect(),
                way: way.iter().map(|&node| readable(library.nodes[node].name())).collect(),
            }
        })
        .collect()
}

/// A mangled name as it is written in the source.
fn readable(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name.trim_start_matches(".text.")))
}

/// The source positions (`core::panic::Location`) that a function mentions.
fn positions(library: &Library, node: usize) -> Vec<String> {
    library.edges[node].iter().filter_map(|edge| position(library, edge.to)).collect()
}

/// Reads a node as a `core::panic::Location`: a pointer to the file's name, its length, line, column.
///
/// The layout is the compiler's own affair. Should it change, reports lose their positions and nothing else.
fn position(library: &Library, node: usize) -> Option<String> {
    let (Node::Defined { bytes, .. }, [file]) = (&library.nodes[node], library.edges[node].as_slice()) else {
        return None;
    };
    let (Node::Defined { bytes: name, .. }, 24) = (&library.nodes[file.to], bytes.len()) else { return None };
    let length = usize::try_from(u64::from_le_bytes(bytes.get(8..16)?.try_into().ok()?)).ok()?;
    let line = u32::from_le_bytes(bytes.get(16..20)?.try_into().ok()?);
    let column = u32::from_le_bytes(bytes.get(20..24)?.try_into().ok()?);
    let name = name.get(usize::try_from(file.byte).ok()?..)?.get(..length)?;
    let name = std::str::from_utf8(name).ok()?;
    name.ends_with(".rs").then(|| format!("{name}:{line}:{column}"))
}
