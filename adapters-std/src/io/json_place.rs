//! Where in a JSON text the value of a path stands: readers of documents say it with their errors.

use std::collections::BTreeMap;

use serde_json::value::RawValue;

use crate::Place;

/// The byte of `text`, which is valid JSON, at which the value of `path` begins, such as `accessors[3].bufferView`.
///
/// Of a path whose end is missing it is the innermost value around it; of keys that stand twice the last counts, as it
/// does for those who read the document.
pub(crate) fn byte_of_value(text: &str, path: &str) -> usize {
    let (mut value, mut rest) = (text.trim_start_matches([' ', '\t', '\r', '\n']), path);
    while let Some((inner, behind)) = step(value, rest) {
        (value, rest) = (inner, behind);
    }
    // A value is a part of the text.
    value.as_ptr() as usize - text.as_ptr() as usize
}

/// The value that the first step of the path leads to, and what of the path is behind.
fn step<'t, 'p>(value: &'t str, path: &'p str) -> Option<(&'t str, &'p str)> {
    if path.is_empty() {
        return None;
    }
    if value.starts_with('[') {
        let (index, behind) = path.strip_prefix('[')?.split_once(']')?;
        let elements: Vec<&RawValue> = serde_json::from_str(value).ok()?;
        let element = elements.get(index.parse::<usize>().ok()?)?;
        return Some((element.get(), behind));
    }
    let entries: BTreeMap<String, &RawValue> = serde_json::from_str(value).ok()?;
    let path = path.strip_prefix('.').unwrap_or(path);
    // Keys may hold dots and brackets themselves: the longest that fits is meant.
    let behind = |key: &str| path.strip_prefix(key).filter(|rest| rest.is_empty() || rest.starts_with(['.', '[']));
    let fitting = entries.iter().filter_map(|(key, inner)| Some((inner.get(), behind(key)?)));
    fitting.min_by_key(|(_, behind)| behind.len())
}

/// The line and column of a byte, in the lines that JSON has for its own errors.
pub(crate) fn place_of_byte(text: &[u8], byte: usize) -> Place {
    let before = &text[..byte.min(text.len())];
    let start = memchr::memrchr(b'\n', before).map_or(0, |end| end + 1);
    Place::Column { line: 1 + memchr::memchr_iter(b'\n', before).count(), column: 1 + before.len() - start }
}

/// The byte at which `text` is no JSON. An error at the end is at its length.
pub(crate) fn byte_of_error(text: &[u8], error: &serde_json::Error) -> usize {
    let lines = text.split_inclusive(|&byte| byte == b'\n').take(error.line().saturating_sub(1));
    (lines.map(<[u8]>::len).sum::<usize>() + error.column().saturating_sub(1)).min(text.len())
}

/// What is wrong, without the line and column that stand behind it: they belong in front.
pub(crate) fn sentence(error: &serde_json::Error) -> String {
    let text = error.to_string();
    text.rsplit_once(" at line ").map_or(text.as_str(), |(sentence, _)| sentence).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use serde_json::{Value, json};

    /// What stands in the text at the value of the path.
    fn at<'t>(text: &'t str, path: &str) -> &'t str {
        &text[byte_of_value(text, path)..]
    }

    #[test]
    fn paths_lead_through_lists_and_objects() {
        let text = " {\"a\" : [1, {\"b\": \"x]\\\"}\"} ,\n [[ 7 ] ]], \"c\":{\"a\":true}}";
        assert!(at(text, "").starts_with("{\"a\""));
        assert!(at(text, "a").starts_with("[1, "));
        assert!(at(text, "a[0]").starts_with("1, "));
        assert!(at(text, "a[1].b").starts_with("\"x]"));
        assert!(at(text, "a[2][0][0]").starts_with("7 ]"));
        assert_eq!(at(text, "c.a"), "true}}");
    }

    #[test]
    fn of_what_is_missing_it_is_the_value_around() {
        let text = "{\"a\": [{\"b\": 1}]}";
        for (path, expected) in
            [("x.y", text), ("a[7]", "[{\"b\": 1}]}"), ("a[0].c.d", "{\"b\": 1}]}"), ("a.b", "[{\"b\": 1}]}")]
        {
            assert_eq!(at(text, path), expected, "{path}");
        }
        for text in ["", "7", "{", "[1,"] {
            assert_eq!(byte_of_value(text, "a[0]"), 0, "{text}");
        }
    }

    #[test]
    fn keys_may_be_anything_and_the_last_of_equal_ones_counts() {
        let text = r#"{"a": 1, "a.b[0]": {"": {"[0]": 2}}, "\u0061": 3}"#;
        assert!(at(text, "a").starts_with("3}"));
        assert!(at(text, "a.b[0]").starts_with("{\"\""));
        assert!(at(text, "a.b[0]..[0]").starts_with("2}"));
    }

    #[test]
    fn lines_and_columns_count_from_one() {
        let text = b"{\n \"a\": 1}";
        assert_eq!(place_of_byte(text, 0), Place::Column { line: 1, column: 1 });
        assert_eq!(place_of_byte(text, 3), Place::Column { line: 2, column: 2 });
        assert_eq!(place_of_byte(text, 99), Place::Column { line: 2, column: 9 });
    }

    #[test]
    fn errors_of_the_parser_have_a_byte_and_no_place_in_their_words() {
        let error = |text: &str| serde_json::from_str::<Value>(text).expect_err("no JSON");
        let text = "{\n\"a\": ?}";
        assert_eq!((byte_of_error(text.as_bytes(), &error(text)), &*sentence(&error(text))), (7, "expected value"));
        assert!(byte_of_error(b"[1,", &error("[1,")) <= 3);
    }

    proptest! {
        #[test]
        fn the_value_of_every_path_is_found(names in prop::collection::vec("[a-c.\\[\\]\"\\\\é]{0,3}", 1..6), which in 0usize..6, is_pretty: bool) {
            let object: serde_json::Map<String, Value> =
                names.iter().enumerate().map(|(index, name)| (name.clone(), json!([0, {"é": index}]))).collect();
            let name = &names[which % names.len()];
            let index = object[name][1]["é"].clone();
            let document = json!({ "list": [object] });
            let text = if is_pretty { serde_json::to_string_pretty(&document) } else { serde_json::to_string(&document) };
            let text = text.unwrap();
            // A key whose path is that of a value below another cannot be told from it.
            prop_assume!(!names.iter().any(|other| other.starts_with(&format!("{name}[1]"))));
            let found = at(&text, &format!("list[0].{name}[1].é"));
            prop_assert!(found.starts_with(&index.to_string()), "{name:?} {found}");
        }
    }
}
