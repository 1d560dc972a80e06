//! Fused multiply-adds in compiled code: one rounding instead of two, so other bits than elsewhere.

mod aarch64;
mod s390x;
mod thumb;

use object::read::archive::ArchiveFile;
use object::{Architecture, Object, ObjectSection, ObjectSymbol, SymbolKind};

/// Number of instructions in a run of code, and the offsets of the fused ones.
type Scan = fn(&[u8]) -> (usize, Vec<u64>);

/// Addresses of fused multiply-add instructions in a linked program or an object for ARM (Thumb), AArch64 or s390x.
///
/// # Errors
/// When the file is for another processor, or lacks the symbols that tell code from data, so that nothing could be found.
pub fn fused_multiply_adds(file: &object::File<'_>) -> Result<Vec<u64>, String> {
    let scan: Scan = match file.architecture() {
        Architecture::Arm => thumb::scan,
        Architecture::Aarch64 => aarch64::scan,
        Architecture::S390x => s390x::scan,
        other => return Err(format!("no search for fused multiply-adds in code for {other:?}")),
    };
    let mut found = Vec::new();
    let mut instructions = 0;
    for section in file.sections().filter(|section| section.kind() == object::SectionKind::Text) {
        let bytes = section.data().map_err(|error| error.to_string())?;
        let ranges = match file.architecture() {
            Architecture::Arm => marked(file, &section, 't'),
            Architecture::Aarch64 => marked(file, &section, 'x'),
            _ => functions(file, &section),
        };
        for [from, to] in ranges {
            let start = section.address();
            let part = bytes.get((from - start) as usize..(to - start) as usize).unwrap_or_default();
            let (count, offsets) = scan(part);
            instructions += count;
            found.extend(offsets.into_iter().map(|offset| from + offset));
        }
    }
    if instructions == 0 {
        return Err(String::from("no symbols mark its code, so it cannot be searched"));
    }
    Ok(found)
}

/// Number of fused multiply-adds in the objects of a static library whose names begin with `prefix`, those of one crate: with
/// link-time optimisation the kernel is in them. Other objects hold what the compiler brings for itself (its own `fma` among them), so
/// the searched ones may refer only to what `allowed` accepts.
///
/// # Errors
/// When there is no such object, or one refers to code that is not searched.
pub fn fused_multiply_adds_of_archive(
    bytes: &[u8],
    prefix: &str,
    allowed: &dyn Fn(&str) -> bool,
) -> Result<usize, String> {
    let archive = ArchiveFile::parse(bytes).map_err(|error| format!("not a static library: {error}"))?;
    let (mut searched, mut found) = (0, 0);
    for member in archive.members() {
        let member = member.map_err(|error| error.to_string())?;
        if !member.name().starts_with(prefix.as_bytes()) || !member.name().ends_with(b".o") {
            continue;
        }
        let data = member.data(bytes).map_err(|error| error.to_string())?;
        let file = object::File::parse(data).map_err(|error| error.to_string())?;
        let undefined = file.symbols().filter(|symbol| symbol.is_undefined()).filter_map(|symbol| symbol.name().ok());
        if let Some(name) = undefined.filter(|name| !name.is_empty()).find(|name| !allowed(name)) {
            return Err(format!("it refers to {name}, which was not searched for fused multiply-adds"));
        }
        searched += 1;
        found += fused_multiply_adds(&file)?.len();
    }
    if searched == 0 { Err(format!("no object named {prefix}*.o is in the library")) } else { Ok(found) }
}

/// Ranges of code between the mapping symbols of ARM: `$` and `code` begins code, `$d` data.
fn marked(file: &object::File<'_>, section: &object::Section<'_, '_>, code: char) -> Vec<[u64; 2]> {
    let symbols = file.symbols().filter(|symbol| symbol.section_index() == Some(section.index()));
    let mut marks: Vec<(u64, bool)> = symbols
        .filter_map(|symbol| {
            let kind = symbol.name().ok()?.strip_prefix('$')?.chars().next()?;
            (kind == code || kind == 'd').then_some((symbol.address(), kind == code))
        })
        .collect();
    marks.sort_unstable();
    let ends = marks.iter().skip(1).map(|mark| mark.0).chain([section.address() + section.size()]);
    marks.iter().zip(ends).filter(|(mark, _)| mark.1).map(|(mark, end)| [mark.0, end]).collect()
}

/// Ranges of the functions that have a size.
fn functions(file: &object::File<'_>, section: &object::Section<'_, '_>) -> Vec<[u64; 2]> {
    let symbols = file.symbols().filter(|symbol| symbol.section_index() == Some(section.index()));
    let functions = symbols.filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0);
    functions.map(|symbol| [symbol.address(), symbol.address() + symbol.size()]).collect()
}
