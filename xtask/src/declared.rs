//! What the C header declares, read from its text: constants, and the members of every struct with their place on a 32-bit target.
//!
//! cbindgen keeps its own list to itself; the text that it writes is regular, and a line that is none of the expected ones is an error.

use crate::process::Result;

/// A struct of the header as wasm32 lays it out.
#[derive(Debug, PartialEq, Eq)]
pub struct Struct {
    /// C's name.
    pub name: String,
    /// Its size.
    pub bytes: usize,
    /// Its members in their order.
    pub members: Vec<Member>,
}

/// A member of a struct.
#[derive(Debug, PartialEq, Eq)]
pub struct Member {
    /// C's name.
    pub name: String,
    /// `u32`, `i32`, `f32` or `u64`; a pointer and a `size_t` are `u32`.
    pub element: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Elements, 1 unless it is an array.
    pub count: usize,
}

/// The named numbers of the header in their order: `#define NAME number` and what enumerations list.
pub fn constants(header: &str) -> Vec<(&str, i64)> {
    header
        .lines()
        .filter_map(|line| {
            let (name, number) = match line.strip_prefix("#define ") {
                Some(rest) => rest.split_once(' ')?,
                None => line.trim().strip_suffix(',')?.split_once(" = ")?,
            };
            let plain = name.starts_with("HAB_") && !name.contains('(');
            Some((name, number.parse().ok()?)).filter(|_| plain)
        })
        .collect()
}

/// The structs of the header in their order.
pub fn structs(header: &str) -> Result<Vec<Struct>> {
    let mut found = Vec::new();
    let mut rest = header;
    while let Some((_, behind)) = rest.split_once("\ntypedef struct ") {
        let (name, body) = behind.split_once(" {\n").ok_or("a struct of the header has no body".to_owned())?;
        let (body, after) = body.split_once("\n}").ok_or_else(|| format!("{name} has no end"))?;
        found.push(laid_out(name, body)?);
        rest = after;
    }
    if found.is_empty() { Err(String::from("the header declares no struct").into()) } else { Ok(found) }
}

/// C's rules of layout: each member at the next multiple of its alignment, the size a multiple of the largest.
fn laid_out(name: &str, body: &str) -> Result<Struct> {
    let (mut members, mut end, mut largest) = (Vec::new(), 0_usize, 1);
    for line in body.lines().map(str::trim).filter(|line| !line.starts_with("/*") && !line.starts_with('*')) {
        let unknown = || format!("{name}: the member `{line}` is of a form that is not known");
        let declaration = line.strip_suffix(';').ok_or_else(unknown)?;
        let (kind, declared) = declaration.rsplit_once(' ').ok_or_else(unknown)?;
        let (declared, count) = match declared.strip_suffix(']').and_then(|declared| declared.split_once('[')) {
            Some((declared, count)) => (declared, count.parse().map_err(|_| unknown())?),
            None => (declared, 1),
        };
        let pointed = declared.strip_prefix('*');
        let (element, element_bytes) = match kind {
            _ if pointed.is_some() => ("u32", 4),
            "uint32_t" | "size_t" => ("u32", 4),
            "int32_t" => ("i32", 4),
            "float" => ("f32", 4),
            "uint64_t" => ("u64", 8),
            _ => return Err(unknown().into()),
        };
        let offset = end.next_multiple_of(element_bytes);
        end = offset + count * element_bytes;
        largest = largest.max(element_bytes);
        members.push(Member { name: pointed.unwrap_or(declared).to_owned(), element, offset, count });
    }
    Ok(Struct { name: name.to_owned(), bytes: end.next_multiple_of(largest), members })
}

#[cfg(test)]
mod tests {
    use super::{Member, constants, structs};

    const HEADER: &str = "
#define HAB_SIZE(a) (a)
#define HAB_VERSION 3
enum {
    /* Text. */
    HAB_BAD = 101,
};
typedef struct hab_thing {
    /**
     * Text; more.
     */
    uint32_t first[3];
    const uint8_t *data;
    float x;
    uint64_t big;
    size_t n;
} hab_thing;
";

    #[test]
    fn constants_are_found_and_macros_are_not() {
        assert_eq!(constants(HEADER), [("HAB_VERSION", 3), ("HAB_BAD", 101)]);
    }

    #[test]
    fn members_lie_where_c_puts_them() {
        let found = structs(HEADER).expect("it is a header");
        let member = |name: &str, element, offset, count| Member { name: name.to_owned(), element, offset, count };
        let members = [
            member("first", "u32", 0, 3),
            member("data", "u32", 12, 1),
            member("x", "f32", 16, 1),
            member("big", "u64", 24, 1),
            member("n", "u32", 32, 1),
        ];
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].name.as_str(), found[0].bytes), ("hab_thing", 40));
        assert_eq!(found[0].members, members);
    }

    #[test]
    fn an_unknown_member_is_an_error() {
        assert!(structs(&HEADER.replace("float x", "double x")).is_err());
        assert!(structs("nothing").is_err());
    }
}
