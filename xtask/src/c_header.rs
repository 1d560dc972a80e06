//! What include/habitus.h declares, read from its text: functions, structs with their members, constants.

use crate::process::{Result, project};

/// The header, relative to the project.
pub const PATH: &str = "include/habitus.h";

/// Declarations in their order.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Names of the functions.
    pub functions: Vec<String>,
    /// Names of the structs with those of their members.
    pub structs: Vec<(String, Vec<String>)>,
    /// Names of the enumerations' constants and of the macros that are numbers.
    pub constants: Vec<String>,
}

impl Header {
    /// The committed header's.
    pub fn read() -> Result<Header> {
        let text = std::fs::read_to_string(project().join(PATH)).map_err(|error| format!("{PATH}: {error}"))?;
        Header::of(&text).map_err(|error| format!("{PATH}: {error}").into())
    }

    /// A text's.
    fn of(text: &str) -> std::result::Result<Header, String> {
        let mut header = Header::default();
        let text = without_comments(text);
        for line in text.lines().filter_map(|line| line.strip_prefix("#define ")) {
            // A macro with arguments is no constant, one without a value is the guard.
            if let Some((name, value)) = line.split_once(' ')
                && !name.contains('(')
                && !value.trim().is_empty()
            {
                header.constants.push(name.to_owned());
            }
        }
        let code: String = plain(&text);
        let mut rest = code.as_str();
        while let Some((statement, behind)) = statement(rest) {
            rest = behind;
            header.add(statement.trim())?;
        }
        if header.functions.is_empty() || header.structs.is_empty() || header.constants.is_empty() {
            return Err(String::from("functions, structs or constants were not found"));
        }
        Ok(header)
    }

    fn add(&mut self, statement: &str) -> std::result::Result<(), String> {
        let unknown = || format!("not understood: `{statement}`");
        if let Some((head, body)) = statement.split_once('{') {
            let (body, tail) = body.rsplit_once('}').ok_or_else(unknown)?;
            if head.trim_start().starts_with("enum") {
                let names = body.split(',').filter_map(|case| case.split('=').next().map(str::trim));
                self.constants.extend(names.filter(|name| !name.is_empty()).map(str::to_owned));
            } else if head.trim_start().starts_with("typedef struct") {
                let members = body.split(';').map(str::trim).filter(|member| !member.is_empty());
                let members = members
                    .map(|member| declared(member).ok_or_else(unknown))
                    .collect::<std::result::Result<_, _>>()?;
                self.structs.push((tail.trim().to_owned(), members));
            } else {
                return Err(unknown());
            }
        } else if let Some((head, _)) = statement.split_once('(') {
            self.functions.push(declared(head).ok_or_else(unknown)?);
        } else if !statement.is_empty() && statement != "typedef int32_t hab_code" {
            return Err(unknown());
        }
        Ok(())
    }
}

/// The name that a declaration without arguments or initial value declares.
fn declared(declaration: &str) -> Option<String> {
    let before_axes = declaration.split('[').next()?;
    let name =
        before_axes.rsplit(|letter: char| !letter.is_alphanumeric() && letter != '_').find(|word| !word.is_empty())?;
    Some(name.to_owned())
}

/// The next statement, up to a semicolon outside of braces, and what follows it.
fn statement(text: &str) -> Option<(&str, &str)> {
    let mut depth = 0;
    for (at, letter) in text.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' => depth -= 1,
            ';' if depth == 0 => return Some((text.get(..at)?, text.get(at + 1..)?)),
            _ => {}
        }
    }
    None
}

fn without_comments(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, behind)) = rest.split_once("/*") {
        out += before;
        rest = behind.split_once("*/").map_or("", |(_, behind)| behind);
    }
    let out = out + rest;
    out.lines().map(|line| line.split("//").next().unwrap_or_default().to_owned() + "\n").collect()
}

/// Without directives, and without the braces of `extern "C"`, which they surround.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let (mut continued, mut for_cpp) = (false, false);
    for line in text.lines() {
        let directive = continued || line.trim_start().starts_with('#');
        if directive {
            continued = line.ends_with('\\');
            for_cpp = line.starts_with("#ifdef __cplusplus") || (for_cpp && !line.starts_with("#endif"));
        } else if !for_cpp {
            out += line;
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn declarations_are_found_in_a_header() {
        let text = "#ifndef A\n#define A\n/* #define NOT 1 */\n#define ONE 1\n#define F(x) \\\n    (x)\ntypedef int32_t hab_code;\n\
                    enum { HAB_X = 0, HAB_Y = 2, };\nenum named {\n /** c */\n HAB_Z = 3,\n};\n\
                    typedef struct s {\n uint32_t a[3];\n const uint8_t *b;\n} s;\n#ifdef __cplusplus\nextern \"C\" {\n#endif // __cplusplus\n\
                    const char *f(int32_t code);\nhab_code g(const struct s *s,\n  size_t n);\n#endif\n";
        let header = Header::of(text).unwrap();
        assert_eq!(header.functions, ["f", "g"]);
        assert_eq!(header.structs, [(String::from("s"), vec![String::from("a"), String::from("b")])]);
        assert_eq!(header.constants, ["ONE", "HAB_X", "HAB_Y", "HAB_Z"]);
        assert!(Header::of("int x;").is_err());
    }

    #[test]
    fn the_committed_header_is_understood() {
        let header = Header::read().unwrap();
        assert!(header.functions.iter().any(|name| name == "hab_fit_landmarks"), "{header:?}");
        assert!(header.functions.iter().all(|name| name.starts_with("hab_")), "{header:?}");
        assert!(header.constants.iter().all(|name| name.starts_with("HAB_")), "{header:?}");
    }
}
