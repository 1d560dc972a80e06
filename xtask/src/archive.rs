//! A static library as a graph: sections are nodes, relocations are edges.
//!
//! The compiler gives each function and each constant a section of its own, so a section's relocations are
//! exactly what that function calls or mentions.

use object::read::archive::ArchiveFile;
use object::{Object, ObjectSection, ObjectSymbol, RelocationTarget, SectionIndex, SymbolSection};
use std::collections::{BTreeMap, HashMap};

/// A function or constant, or a symbol that the library does not define.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Node {
    /// Defined here: its name (mangled, or the section's where it has none) and its bytes.
    Defined {
        /// Name.
        name: String,
        /// Content before relocation.
        bytes: Vec<u8>,
    },
    /// To be found by the linker elsewhere.
    Undefined(String),
}

impl Node {
    /// The symbol's name as the linker knows it.
    pub fn name(&self) -> &str {
        match self {
            Node::Defined { name, .. } | Node::Undefined(name) => name,
        }
    }
}

/// A reference from one node to another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Byte of the referring node that the linker fills in.
    pub offset: u64,
    /// Index of the node referred to.
    pub to: usize,
    /// Byte of that node, where the reference is an absolute one.
    pub byte: u64,
    /// It calls or jumps (known on a Cortex-M alone); others mention an address.
    pub call: bool,
}

/// Everything that a static library defines and refers to.
#[derive(Debug, Default)]
pub struct Library {
    /// Functions, constants, undefined symbols.
    pub nodes: Vec<Node>,
    /// References out of each node, in the order of their offsets.
    pub edges: Vec<Vec<Edge>>,
    /// Exported symbols: name to node.
    pub exported: BTreeMap<String, usize>,
}

/// Whether a relocation is one of Thumb code that calls or jumps.
fn is_call(relocation: &object::Relocation) -> bool {
    use object::elf::{R_ARM_THM_JUMP19, R_ARM_THM_JUMP24, R_ARM_THM_PC22};
    let calls = [R_ARM_THM_PC22, R_ARM_THM_JUMP24, R_ARM_THM_JUMP19];
    matches!(relocation.flags(), object::RelocationFlags::Elf { r_type } if calls.contains(&r_type))
}

impl Library {
    /// Reads the objects of a static library; members that are no objects (the compiler's metadata) are passed over.
    pub fn of_archive(data: &[u8]) -> Result<Library, String> {
        let archive = ArchiveFile::parse(data).map_err(|error| format!("not a static library: {error}"))?;
        let mut files = Vec::new();
        for member in archive.members() {
            let bytes = member.and_then(|member| member.data(data)).map_err(|error| error.to_string())?;
            if let Ok(file) = object::File::parse(bytes) {
                files.push(file);
            }
        }
        Library::of_files(&files).map_err(|error| error.to_string())
    }

    fn of_files(files: &[object::File<'_>]) -> object::Result<Library> {
        let mut library = Library::default();
        let mut of_section: HashMap<(usize, SectionIndex), usize> = HashMap::new();
        for (number, file) in files.iter().enumerate() {
            for section in file.sections() {
                let name = section.name()?.to_owned();
                let bytes = section.data()?.to_vec();
                of_section.insert((number, section.index()), library.add(Node::Defined { name, bytes }));
            }
            for symbol in file.symbols() {
                let SymbolSection::Section(section) = symbol.section() else { continue };
                let (name, Some(&node)) = (symbol.name()?, of_section.get(&(number, section))) else { continue };
                // `$t` and the like mark where code and data begin.
                if symbol.is_local() && (name.is_empty() || name.starts_with(".L") || name.starts_with('$')) {
                    continue;
                }
                if let Some(Node::Defined { name: known, .. }) = library.nodes.get_mut(node) {
                    name.clone_into(known);
                }
                if symbol.is_global() {
                    library.exported.entry(name.to_owned()).or_insert(node);
                }
            }
        }
        let mut undefined: HashMap<String, usize> = HashMap::new();
        for (number, file) in files.iter().enumerate() {
            for section in file.sections() {
                let Some(&from) = of_section.get(&(number, section.index())) else { continue };
                for (offset, relocation) in section.relocations() {
                    let (to, start) = match relocation.target() {
                        RelocationTarget::Section(index) => (of_section.get(&(number, index)).copied(), 0),
                        RelocationTarget::Symbol(index) => {
                            let symbol = file.symbol_by_index(index)?;
                            match symbol.section() {
                                SymbolSection::Section(index) => {
                                    (of_section.get(&(number, index)).copied(), symbol.address())
                                }
                                _ => (Some(library.linked(&mut undefined, symbol.name()?)), 0),
                            }
                        }
                        _ => (None, 0),
                    };
                    if let (Some(to), Some(edges)) = (to, library.edges.get_mut(from)) {
                        let byte = start.wrapping_add_signed(relocation.addend());
                        edges.push(Edge { offset, to, byte, call: is_call(&relocation) });
                    }
                }
            }
        }
        for edges in &mut library.edges {
            edges.sort_by_key(|edge| edge.offset);
        }
        Ok(library)
    }

    fn add(&mut self, node: Node) -> usize {
        self.nodes.push(node);
        self.edges.push(Vec::new());
        self.nodes.len() - 1
    }

    /// The node that a linker would choose for a name that its object does not define.
    fn linked(&mut self, undefined: &mut HashMap<String, usize>, name: &str) -> usize {
        if let Some(&node) = self.exported.get(name).or_else(|| undefined.get(name)) {
            return node;
        }
        let node = self.add(Node::Undefined(name.to_owned()));
        undefined.insert(name.to_owned(), node);
        node
    }
}
