//! The header of a PLY file: how the values are written, and which elements with which properties follow.

use std::path::Path;

use crate::io::text::{begins_as_utf_16, check_is_text, integer, shown, without_byte_order_mark, words};
use crate::mesh::Scalar;
use crate::{Error, Place};

/// The most elements, and the most properties of an element: names are compared with each other.
pub(super) const MOST_NAMES: usize = 1000;

/// How values are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The type of either spelling: the original names, or those with their number of bits.
fn scalar_named(name: &[u8]) -> Option<Scalar> {
    Some(match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => return None,
    })
}

/// One property of an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Property {
    pub name: Vec<u8>,
    /// The type of the value, or of each value of the list.
    pub scalar: Scalar,
    /// The type of the number in front of a list; `None` for a single value.
    pub list: Option<Scalar>,
}

/// A run of records of the same properties.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Element {
    pub name: Vec<u8>,
    pub count: u64,
    /// The line that announces them.
    pub line: usize,
    pub properties: Vec<Property>,
}

impl Header {
    /// The line that says how many vertices there are; the last line when none does.
    pub(super) fn line_of_vertices(&self) -> usize {
        let vertices = self.elements.iter().find(|element| element.name == b"vertex");
        vertices.map_or(self.body_line - 1, |element| element.line)
    }
}

impl Element {
    /// The fewest bytes that a record takes: as text, a digit and a separator for each value.
    pub(super) fn least_bytes(&self, encoding: Encoding) -> usize {
        let of = |property: &Property| match encoding {
            Encoding::Text => 2,
            _ => property.list.unwrap_or(property.scalar).n_bytes(),
        };
        self.properties.iter().map(of).sum()
    }
}

/// The header and where the values begin.
#[derive(Debug)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Comments that name a texture, as some programs write them.
    pub n_textures: usize,
    /// The byte behind `end_header` and its line end.
    pub body: usize,
    /// The line on which that byte lies.
    pub body_line: usize,
}

/// Reads the header at the beginning of `bytes`.
pub(super) fn header(bytes: &[u8], path: &Path) -> Result<Header, Error> {
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    if begins_as_utf_16(bytes) {
        check_is_text(bytes, path)?;
    }
    let start = bytes.len() - without_byte_order_mark(bytes).len();
    let mut lines = Lines::new(bytes, start);
    if lines.next().map(<[u8]>::trim_ascii) != Some(b"ply") {
        return Err(malformed(1, "a PLY file begins with a line \"ply\"; this one does not".into()));
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut n_textures = 0;
    while let Some(text) = lines.next() {
        let line = lines.line;
        let words: Vec<&[u8]> = words(text).take(6).collect();
        match words[..] {
            [b"comment", b"TextureFile", ..] => n_textures += 1,
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", name, ..] => {
                encoding = Some(match name {
                    b"ascii" => Encoding::Text,
                    b"binary_little_endian" => Encoding::LittleEndian,
                    b"binary_big_endian" => Encoding::BigEndian,
                    _ => return Err(malformed(line, format!("the format {:?} is not known", shown(name)))),
                });
            }
            [b"element", name, count] => {
                let count = integer(count).ok_or_else(|| {
                    malformed(line, format!("{:?} where a number of elements is expected", shown(count)))
                })?;
                if elements.iter().any(|element| element.name == name) {
                    return Err(malformed(line, format!("a second element {:?}", shown(name))));
                }
                if elements.len() == MOST_NAMES {
                    return Err(malformed(line, format!("more than {MOST_NAMES} elements")));
                }
                elements.push(Element { name: name.to_vec(), count, line, properties: Vec::new() });
            }
            [b"property", ref rest @ ..] => {
                let property = property(rest).map_err(|problem| malformed(line, problem))?;
                let Some(element) = elements.last_mut() else {
                    return Err(malformed(line, "a property before the first element".into()));
                };
                if element.properties.len() == MOST_NAMES {
                    return Err(malformed(line, format!("an element of more than {MOST_NAMES} properties")));
                }
                element.properties.push(property);
            }
            [b"end_header"] => {
                // Also before a binary body: a text with such a name could not be read again.
                check_is_text(&bytes[..lines.at], path)?;
                let encoding = encoding.ok_or_else(|| malformed(line, "the header has no line \"format\"".into()))?;
                return Ok(Header { encoding, elements, n_textures, body: lines.at, body_line: line + 1 });
            }
            [word, ..] => {
                let problem = format!("{:?} is no line of a PLY header; format, element or property is", shown(word));
                return Err(malformed(line, problem));
            }
        }
    }
    Err(malformed(lines.line, "the header does not end with \"end_header\": is the file truncated?".into()))
}

/// The lines of a header. The first one decides how all end: behind `end_header` and a lone carriage return, a line
/// feed is a value of a binary body.
struct Lines<'a> {
    bytes: &'a [u8],
    /// Where the next line begins.
    at: usize,
    /// The number of the last line.
    line: usize,
    end: u8,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8], at: usize) -> Self {
        let rest = &bytes[at..];
        let first = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
        let is_lone_return = rest[first..].starts_with(b"\r") && !rest[first..].starts_with(b"\r\n");
        Lines { bytes, at, line: 0, end: if is_lone_return { b'\r' } else { b'\n' } }
    }

    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = self.bytes.get(self.at..).filter(|rest| !rest.is_empty())?;
        let length = rest.iter().position(|&byte| byte == self.end);
        self.at += length.map_or(rest.len(), |length| length + 1);
        self.line += 1;
        Some(&rest[..length.unwrap_or(rest.len())])
    }
}

fn property(words: &[&[u8]]) -> Result<Property, String> {
    let scalar = |name: &[u8]| scalar_named(name).ok_or_else(|| format!("the type {:?} is not known", shown(name)));
    match *words {
        [b"list", count, value, name] => {
            let list = scalar(count)?;
            if matches!(list, Scalar::F32 | Scalar::F64) {
                return Err(format!("a list length of type {:?}; an integer is expected", shown(count)));
            }
            Ok(Property { name: name.to_vec(), scalar: scalar(value)?, list: Some(list) })
        }
        [value, name] => Ok(Property { name: name.to_vec(), scalar: scalar(value)?, list: None }),
        _ => Err("a property is written \"property TYPE NAME\" or \"property list TYPE TYPE NAME\"".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        header(text.as_bytes(), Path::new("t.ply")).expect_err("must be refused").to_string()
    }

    #[test]
    fn both_spellings_and_line_ends_are_read() {
        let text = "ply\r\nformat ascii 1.0\r\ncomment a\r\nelement vertex 3\r\nproperty uint8 a\r\n\
                    property list uchar int32 b\r\nend_header\r\nX";
        let header = header(text.as_bytes(), Path::new("t.ply")).expect("a header");
        assert_eq!((header.encoding, &text[header.body..], header.body_line), (Encoding::Text, "X", 8));
        let [element] = &header.elements[..] else { panic!("one element") };
        assert_eq!((element.count, element.properties[0].scalar), (3, Scalar::U8));
        assert_eq!(element.properties[1].list, Some(Scalar::U8));
        assert_eq!(element.least_bytes(Encoding::BigEndian), 2);
    }

    #[test]
    fn the_first_line_decides_how_lines_end() {
        let lines = "ply\nformat ascii 1.0\nelement vertex 3\nend_header\n";
        for (end, behind) in [("\n", "\r\nX"), ("\r\n", "\nX"), ("\r", "\nX")] {
            let text = format!("\u{feff}{}{behind}", lines.replace('\n', end));
            let header = header(text.as_bytes(), Path::new("t.ply")).expect("a header");
            assert_eq!((&text[header.body..], header.body_line), (behind, 5), "{end:?}");
        }
    }

    #[test]
    fn names_beyond_all_reason_are_refused() {
        let elements: String = (0..=MOST_NAMES).map(|at| format!("element e{at} 0\n")).collect();
        assert!(error(&format!("ply\n{elements}")).contains("line 1002: more than 1000 elements"));
        let properties = "property int a\n".repeat(MOST_NAMES + 1);
        assert!(error(&format!("ply\nelement e 1\n{properties}")).contains("line 1003: an element of more than 1000"));
    }

    #[test]
    fn errors_name_the_line() {
        for (text, message) in [
            ("", "line 1: a PLY file begins"),
            ("ply\nformat ascii 1.0\n", "line 2: the header does not end"),
            ("ply\nend_header\n", "line 2: the header has no line \"format\""),
            ("ply\nformat text 1.0\n", "the format \"text\" is not known"),
            ("ply\nelement vertex -1\n", "\"-1\" where a number of elements"),
            ("ply\nelement a 1\nelement a 1\n", "line 3: a second element \"a\""),
            ("ply\nproperty float x\n", "a property before the first element"),
            ("ply\nelement a 1\nproperty half x\n", "the type \"half\" is not known"),
            ("ply\nelement a 1\nproperty list float int x\n", "a list length of type \"float\""),
            ("ply\nelement a 1\nproperty float\n", "a property is written"),
            ("ply\nhello\n", "line 2: \"hello\" is no line of a PLY header"),
        ] {
            assert!(error(text).contains(message), "{text:?}: {}", error(text));
        }
    }
}
