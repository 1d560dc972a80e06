//! Typed access to the objects of a glTF document, with errors that name the place as a JSON path.
//!
//! The document is read here and not as the types of `gltf-json`, which keep node transforms as `f32`, do not say where
//! in the document an error is, and drop what they do not know: nothing may be lost in silence.

use serde_json::{Map, Value};

use super::problem::{Problem, Within};

/// An object of the document.
#[derive(Debug, Clone, Copy)]
pub(super) struct Object<'a>(&'a Map<String, Value>);

impl<'a> Object<'a> {
    /// The value, which must be an object.
    pub(super) fn of(value: &'a Value) -> Result<Self, Problem> {
        value.as_object().map(Object).ok_or_else(|| unexpected("", value, "an object"))
    }

    /// The value of the key; `null` is as good as nothing.
    pub(super) fn value(self, key: &str) -> Option<&'a Value> {
        self.0.get(key).filter(|value| !value.is_null())
    }

    /// Keys and values in the order of the keys.
    pub(super) fn entries(self) -> impl Iterator<Item = (&'a str, &'a Value)> {
        self.0.iter().map(|(key, value)| (key.as_str(), value))
    }

    pub(super) fn object(self, key: &str) -> Result<Option<Object<'a>>, Problem> {
        self.value(key).map(|value| Object::of(value).within(|| key.to_owned())).transpose()
    }

    /// The elements of a list; none when there is no list.
    pub(super) fn list(self, key: &str) -> Result<&'a [Value], Problem> {
        match self.value(key) {
            None => Ok(&[]),
            Some(Value::Array(elements)) => Ok(elements),
            Some(value) => Err(unexpected(key, value, "a list")),
        }
    }

    pub(super) fn text(self, key: &str) -> Result<Option<&'a str>, Problem> {
        self.value(key).map(|value| value.as_str().ok_or_else(|| unexpected(key, value, "a text"))).transpose()
    }

    pub(super) fn flag(self, key: &str) -> Result<bool, Problem> {
        match self.value(key) {
            None => Ok(false),
            Some(value) => value.as_bool().ok_or_else(|| unexpected(key, value, "true or false")),
        }
    }

    /// A whole number of at least 0.
    pub(super) fn whole(self, key: &str) -> Result<Option<u64>, Problem> {
        self.value(key).map(|value| whole(value).within(|| key.to_owned())).transpose()
    }

    /// As [`Object::whole`], where there must be one.
    pub(super) fn wanted(self, key: &str) -> Result<u64, Problem> {
        self.whole(key)?.ok_or_else(|| Problem::at(key, "it is missing; a whole number is expected"))
    }

    /// A list of `N` numbers.
    pub(super) fn numbers<const N: usize>(self, key: &str) -> Result<Option<[f64; N]>, Problem> {
        let Some(value) = self.value(key) else { return Ok(None) };
        let numbers = value.as_array().and_then(|list| list.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>());
        match numbers.and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(unexpected(key, value, &format!("a list of {N} numbers"))),
        }
    }
}

/// A whole number of at least 0; some programs write it with a decimal point.
pub(super) fn whole(value: &Value) -> Result<u64, Problem> {
    // Up to 2^53 every whole number is one as a real number too.
    let from_real = || value.as_f64().filter(|x| x.fract() == 0.0 && (0.0..9e15).contains(x)).map(|x| x as u64);
    value.as_u64().or_else(from_real).ok_or_else(|| unexpected("", value, "a whole number of at least 0"))
}

/// The index `value` of something of which there are `n`.
pub(super) fn index_below(value: &Value, n: usize, what: &str) -> Result<usize, Problem> {
    let index = whole(value)?;
    checked_index(index, n, what)
}

/// The index as it is used, when it is below `n`.
pub(super) fn checked_index(index: u64, n: usize, what: &str) -> Result<usize, Problem> {
    let below = usize::try_from(index).ok().filter(|&index| index < n);
    below.ok_or_else(|| Problem::here(format!("it names {what}[{index}], but there are {n}, counted from 0")))
}

fn unexpected(key: &str, value: &Value, expected: &str) -> Problem {
    let found = match value {
        Value::Array(elements) => format!("a list of {}", elements.len()),
        Value::Object(_) => "an object".to_owned(),
        Value::String(text) => format!("{:?}", text.chars().take(40).collect::<String>()),
        other => other.to_string(),
    };
    Problem::at(key, format!("{found} where {expected} is expected"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn errors_name_the_path() {
        let value = json!({"a": {"b": -1, "c": [1, 2], "d": "x", "e": 3.0, "f": null}});
        let root = Object::of(&value).unwrap();
        let a = root.object("a").unwrap().unwrap();
        assert_eq!(
            a.whole("b").within(|| "a".into()).unwrap_err().to_string(),
            "a.b: -1 where a whole number of at least 0 is expected"
        );
        assert_eq!(
            a.numbers::<3>("c").unwrap_err().to_string(),
            "c: a list of 2 where a list of 3 numbers is expected"
        );
        assert_eq!(a.numbers::<2>("c"), Ok(Some([1.0, 2.0])));
        assert_eq!(a.object("d").unwrap_err().to_string(), "d: \"x\" where an object is expected");
        assert_eq!((a.whole("e"), a.whole("f"), a.list("g")), (Ok(Some(3)), Ok(None), Ok(&[][..])));
        assert_eq!(a.wanted("f").unwrap_err().to_string(), "f: it is missing; a whole number is expected");
        assert_eq!(a.text("b").unwrap_err().to_string(), "b: -1 where a text is expected");
        assert_eq!(a.list("d").unwrap_err().to_string(), "d: \"x\" where a list is expected");
        assert_eq!(a.flag("d").unwrap_err().to_string(), "d: \"x\" where true or false is expected");
        let index = index_below(&json!(7), 3, "nodes").within(|| "scene".into());
        assert_eq!(index.unwrap_err().to_string(), "scene: it names nodes[7], but there are 3, counted from 0");
        assert!(whole(&json!(1e300)).is_err() && whole(&json!(0.5)).is_err());
    }
}
