//! The C side of the layout check: every constant, size and offset of include/habitus.h as entries of a C table, for tests/hosts/layout.c.
//!
//! The list is read from the header's text, Rust's from its source (ffi/src/layout.rs): what is missing in one of them shows in the comparison.

use crate::c_header::Header;
use std::fmt::Write;

/// The table's rows: `{ "name", value },`.
pub fn entries(header: &Header) -> String {
    let mut rows = String::from("/* Generated from include/habitus.h by `cargo xtask`. */\n");
    let mut row = |name: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(rows, "{{ \"{name}\", (uint64_t)({value}) }},");
    };
    for constant in &header.constants {
        row(constant, constant);
    }
    row("sizeof hab_code", "sizeof(hab_code)");
    for (name, members) in &header.structs {
        row(&format!("sizeof {name}"), &format!("sizeof({name})"));
        row(&format!("alignof {name}"), &format!("offsetof(struct {{ char before; {name} it; }}, it)"));
        for member in members {
            row(&format!("offsetof {name}.{member}"), &format!("offsetof({name}, {member})"));
            row(&format!("sizeof {name}.{member}"), &format!("sizeof(((const {name} *)0)->{member})"));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_member_has_an_offset_and_a_size() {
        let members = vec![String::from("a"), String::from("b")];
        let header = Header {
            structs: vec![(String::from("s"), members)],
            constants: vec![String::from("N")],
            ..Header::default()
        };
        let text = entries(&header);
        assert_eq!(text.lines().count(), 1 + 1 + 1 + 2 + 2 * 2);
        assert!(text.contains("{ \"N\", (uint64_t)(N) },") && text.contains("offsetof(s, b)"), "{text}");
    }
}
