//! Landmarks in JSON: positions or vertices, in a list or by their names.

use std::path::Path;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::Value;

use super::{FACE_LANDMARKS, LandmarkFile, beyond_places, is_place, repeated, standard_names};
use crate::Error;
use crate::io::json_place::{byte_of_error, byte_of_value, place_of_byte, sentence};

/// What a list or an entry must be.
const FORMS: &str = "positions [x, y, z] or vertices (whole numbers from 0), all of one kind";

/// The landmarks of the JSON text `bytes`.
pub(super) fn landmarks(bytes: &[u8], path: &Path) -> Result<LandmarkFile, Error> {
    let document: Value = parsed(bytes, path)?;
    let malformed = |key: &str, problem: String| malformed(bytes, path, key, problem);
    match document {
        Value::Array(entries) => list(&entries, &malformed),
        Value::Object(object) if object.keys().any(|key| number(key).is_some()) => {
            numbered(&Value::Object(object), &malformed)
        }
        Value::Object(_) => by_name(parsed(bytes, path)?, &malformed),
        _ => Err(malformed("", format!("neither a list nor an object: landmarks are {FORMS}"))),
    }
}

type Malformed<'a> = &'a dyn Fn(&str, String) -> Error;

fn parsed<T: for<'a> Deserialize<'a>>(bytes: &[u8], path: &Path) -> Result<T, Error> {
    serde_json::from_slice(bytes).map_err(|error| {
        let place = place_of_byte(bytes, byte_of_error(bytes, &error));
        Error::malformed(path, place, format!("no valid JSON: {}", sentence(&error)))
    })
}

/// The error at the value of a key, at the whole document where there is none.
fn malformed(bytes: &[u8], path: &Path, key: &str, problem: String) -> Error {
    let text = std::str::from_utf8(bytes).unwrap_or_default();
    Error::malformed(path, place_of_byte(bytes, byte_of_value(text, key)), problem)
}

/// 13 of `landmarks13`.
fn number(key: &str) -> Option<u32> {
    key.strip_prefix("landmarks")?.parse().ok()
}

/// An object with `landmarks13` and `landmarks13_names`, or another number: vertices.
fn numbered(document: &Value, malformed: Malformed<'_>) -> Result<LandmarkFile, Error> {
    // Thirteen first, else the set with the fewest, so that the choice does not depend on the order in the file.
    let sets = document.as_object().into_iter().flat_map(|object| object.keys()).filter(|key| number(key).is_some());
    let named = |key: &&String| document.get(format!("{key}_names")).is_some() || number(key) == Some(13);
    let Some(key) = sets.filter(named).min_by_key(|key| (number(key) != Some(13), number(key))) else {
        return Err(malformed(
            "",
            "there is no \"landmarks13\" with \"landmarks13_names\" (or another number) in it".into(),
        ));
    };
    let vertices: Vec<u32> = serde_json::from_value(document[key].clone())
        .map_err(|error| malformed(key, format!("\"{key}\" is no list of vertex indices: {error}")))?;
    let names_key = format!("{key}_names");
    let names: Vec<String> = match document.get(&names_key) {
        Some(names) => serde_json::from_value(names.clone())
            .map_err(|error| malformed(&names_key, format!("\"{names_key}\" is no list of names: {error}")))?,
        None => FACE_LANDMARKS.map(str::to_owned).to_vec(),
    };
    if names.len() != vertices.len() || vertices.is_empty() {
        let (n_names, n) = (names.len(), vertices.len());
        let problem = format!("\"{key}\" has {n} vertices and {n_names} names: give each vertex one name");
        return Err(malformed(key, problem));
    }
    if let Some(name) = repeated(&names) {
        return Err(malformed(&names_key, format!("the landmark {name:?} is there twice")));
    }
    Ok(LandmarkFile::Vertices { names: Some(names), vertices })
}

/// `[[x, y, z], ...]` or `[vertex, ...]`.
fn list(entries: &[Value], malformed: Malformed<'_>) -> Result<LandmarkFile, Error> {
    let places: Vec<(String, String)> =
        (0..entries.len()).map(|k| (format!("[{k}]"), format!("landmark {k} (counted from 0)"))).collect();
    let values = values(entries.iter(), &places, malformed)?;
    let names = standard_names(entries.len());
    Ok(match values {
        Values::Points(points) => LandmarkFile::Points { names, points },
        Values::Vertices(vertices) => LandmarkFile::Vertices { names, vertices },
    })
}

/// `{"nose_tip": [x, y, z], ...}` or `{"nose_tip": vertex, ...}`.
fn by_name(Entries(entries): Entries, malformed: Malformed<'_>) -> Result<LandmarkFile, Error> {
    let (names, entries): (Vec<String>, Vec<Value>) = entries.into_iter().unzip();
    if let Some(name) = repeated(&names) {
        return Err(malformed(name, format!("the landmark {name:?} is there twice")));
    }
    let places: Vec<(String, String)> =
        names.iter().map(|name| (name.clone(), format!("the landmark {name:?}"))).collect();
    let values = values(entries.iter(), &places, malformed)?;
    let names = Some(names);
    Ok(match values {
        Values::Points(points) => LandmarkFile::Points { names, points },
        Values::Vertices(vertices) => LandmarkFile::Vertices { names, vertices },
    })
}

/// What stands for the landmarks, all of one kind.
enum Values {
    Points(Vec<[f64; 3]>),
    Vertices(Vec<u32>),
}

/// The entries, each with its path in the document and what it is called.
fn values<'a>(
    entries: impl Iterator<Item = &'a Value>,
    places: &[(String, String)],
    malformed: Malformed<'_>,
) -> Result<Values, Error> {
    let (mut points, mut vertices) = (Vec::new(), Vec::new());
    for (entry, (key, called)) in entries.zip(places) {
        let point: Option<[f64; 3]> = serde_json::from_value(entry.clone()).ok();
        let vertex: Option<u32> = serde_json::from_value(entry.clone()).ok();
        match (point, vertex) {
            (Some(point), _) if vertices.is_empty() => {
                if !is_place(&point) {
                    return Err(malformed(key, beyond_places(called)));
                }
                points.push(point);
            }
            (_, Some(vertex)) if points.is_empty() => vertices.push(vertex),
            _ => return Err(malformed(key, format!("{called} is {}: give {FORMS}", shown(entry)))),
        }
    }
    match (points.is_empty(), vertices.is_empty()) {
        (true, true) => Err(malformed("", "there is no landmark in it".into())),
        (false, _) => Ok(Values::Points(points)),
        _ => Ok(Values::Vertices(vertices)),
    }
}

/// The beginning of a value.
fn shown(value: &Value) -> String {
    crate::io::text::shown(value.to_string().as_bytes())
}

/// The entries of an object in their order, also those of equal names.
struct Entries(Vec<(String, Value)>);

impl<'de> Deserialize<'de> for Entries {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Collects;
        impl<'de> Visitor<'de> for Collects {
            type Value = Entries;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Entries, A::Error> {
                let mut entries = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    entries.push(entry);
                }
                Ok(Entries(entries))
            }
        }
        deserializer.deserialize_map(Collects)
    }
}
