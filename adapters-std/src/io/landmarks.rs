//! Landmark files: vertex indices in JSON, or coordinates in text, with or without labels.
//!
//! | content | form |
//! |---|---|
//! | JSON with `landmarksN`, vertex indices, and `landmarksN_names` | [`LandmarkFile::Vertices`] |
//! | labelled list: the count, then for each a line with its label and a line `x y z` | [`LandmarkFile::Points`] |
//! | numbers only, three per landmark, in lines of any length | [`LandmarkFile::Points`] |
//!
//! A labelled list may leave landmarks out. Thirteen landmarks without names are those of [`FACE_LANDMARKS`].

use std::path::Path;

use super::file_bytes;
use super::json_place::{byte_of_error, byte_of_value, place_of_byte, sentence};
use super::text::{check_is_text, integer, numbered_lines, real, shown, vector, without_byte_order_mark, words};
use crate::mesh::Mesh;
use crate::{Error, Place};

/// The landmarks of a face in the order of unlabelled files; left and right are the subject's (left is +x).
///
/// The first eight hardly move with the expression.
pub const FACE_LANDMARKS: [&str; 13] = [
    "right_eye_outer",
    "right_eye_inner",
    "left_eye_inner",
    "left_eye_outer",
    "nose_tip",
    "right_nose_wing",
    "left_nose_wing",
    "subnasal",
    "right_mouth_corner",
    "left_mouth_corner",
    "upper_lip_middle",
    "lower_lip_middle",
    "chin",
];

/// What a landmark file says.
#[derive(Debug, Clone, PartialEq)]
pub enum LandmarkFile {
    /// Vertices of a mesh that the file does not name.
    Vertices {
        /// One name per landmark.
        names: Vec<String>,
        /// The vertex of each landmark.
        vertices: Vec<u32>,
    },
    /// Coordinates, in the unit and frame of the mesh that they belong to.
    Points {
        /// One name per landmark, if the file has labels or thirteen landmarks.
        names: Option<Vec<String>>,
        /// The position of each landmark.
        points: Vec<[f64; 3]>,
    },
}

/// A landmark on a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SnappedLandmark {
    /// The vertex nearest to the landmark, the first of several equally near.
    pub vertex: u32,
    /// How far it is from the landmark, in the unit of the mesh; 0 for landmarks given as vertices.
    pub distance: f64,
}

impl LandmarkFile {
    /// The names, if there are any.
    pub fn names(&self) -> Option<&[String]> {
        match self {
            LandmarkFile::Vertices { names, .. } => Some(names),
            LandmarkFile::Points { names, .. } => names.as_deref(),
        }
    }

    /// The landmarks as vertices of `mesh`, in the order of the file.
    ///
    /// Whether the distances are tolerable is for the caller to judge: they are large when the landmarks were marked in
    /// another unit or frame.
    ///
    /// # Errors
    /// [`Error::Input`] for a vertex that the mesh does not have, or a mesh without vertices.
    pub fn snapped_to(&self, mesh: &Mesh) -> Result<Vec<SnappedLandmark>, Error> {
        let n_vertices = mesh.positions.len();
        match self {
            LandmarkFile::Vertices { names, vertices } => {
                let on_vertex = |(name, &vertex): (&String, &u32)| {
                    if (vertex as usize) < n_vertices {
                        return Ok(SnappedLandmark { vertex, distance: 0.0 });
                    }
                    Err(Error::input(format!(
                        "landmark {name} is vertex {vertex}, but the mesh has {n_vertices}: is the file for this mesh?"
                    )))
                };
                names.iter().zip(vertices).map(on_vertex).collect()
            }
            LandmarkFile::Points { points, .. } => {
                let nearest = |point: &[f64; 3]| {
                    nearest_vertex(&mesh.positions, point)
                        .ok_or_else(|| Error::input("landmarks cannot be put on a mesh without vertices"))
                };
                points.iter().map(nearest).collect()
            }
        }
    }
}

fn nearest_vertex(positions: &[[f64; 3]], point: &[f64; 3]) -> Option<SnappedLandmark> {
    let squared = |p: &[f64; 3]| p.iter().zip(point).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
    let (vertex, distance) = positions.iter().map(squared).enumerate().min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(SnappedLandmark { vertex: u32::try_from(vertex).ok()?, distance: distance.sqrt() })
}

/// Reads the landmark file at `path`: JSON when it begins with `{`, else text.
///
/// # Errors
/// [`Error::Read`] or [`Error::Malformed`].
pub fn read(path: impl AsRef<Path>) -> Result<LandmarkFile, Error> {
    let path = path.as_ref();
    parse(&file_bytes(path)?, path)
}

/// [`read`] of the bytes of a file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`].
pub fn parse(bytes: &[u8], path: &Path) -> Result<LandmarkFile, Error> {
    check_is_text(bytes, path)?;
    let bytes = without_byte_order_mark(bytes);
    if bytes.trim_ascii_start().starts_with(b"{") {
        return json(bytes, path);
    }
    let lines: Vec<_> = numbered_lines(bytes).filter(|(_, text)| !text.trim_ascii().is_empty()).collect();
    if lines.is_empty() {
        let last = Place::Line(numbered_lines(bytes).count());
        return Err(Error::malformed(path, last, "there is no landmark in it"));
    }
    // A label is the only word that is no number; the header comes first.
    let labelled = lines.iter().any(|(_, text)| words(text).next().is_some_and(starts_label));
    if labelled { labelled_list(&lines, path) } else { unlabelled(&lines, path) }
}

fn starts_label(word: &[u8]) -> bool {
    word[0].is_ascii_alphabetic() && !["nan", "inf", "infinity"].contains(&&*shown(word).to_ascii_lowercase())
}

fn json(bytes: &[u8], path: &Path) -> Result<LandmarkFile, Error> {
    let document: serde_json::Value = serde_json::from_slice(bytes).map_err(|error| {
        let place = place_of_byte(bytes, byte_of_error(bytes, &error));
        Error::malformed(path, place, format!("no valid JSON: {}", sentence(&error)))
    })?;
    // The place of the value of a key, of the whole document where there is none.
    let malformed = |key: &str, problem: String| {
        let text = std::str::from_utf8(bytes).unwrap_or_default();
        Error::malformed(path, place_of_byte(bytes, byte_of_value(text, key)), problem)
    };
    let number = |key: &str| key.strip_prefix("landmarks").and_then(|digits| digits.parse::<u32>().ok());
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
    Ok(LandmarkFile::Vertices { names, vertices })
}

fn repeated(names: &[String]) -> Option<&String> {
    names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)).map(|(_, name)| name)
}

fn labelled_list(lines: &[(usize, &[u8])], path: &Path) -> Result<LandmarkFile, Error> {
    let malformed = |line, problem: String| Error::malformed(path, Place::Line(line), problem);
    let (first, header) = lines[0];
    let n: usize = integer(header.trim_ascii()).ok_or_else(|| {
        malformed(first, format!("{:?} where the number of the landmarks is expected", shown(header)))
    })?;
    let mut names: Vec<String> = Vec::new();
    let mut points = Vec::new();
    for pair in lines[1..].chunks(2) {
        let (line, text) = pair[0];
        let label = text.trim_ascii();
        if !starts_label(label) || words(label).count() != 1 {
            let problem = format!("{:?} where a label of one word is expected, such as nose_tip", shown(text));
            return Err(malformed(line, problem));
        }
        let name = String::from_utf8(label.to_vec())
            .map_err(|_| malformed(line, format!("the label {:?} is not UTF-8", shown(label))))?;
        if names.contains(&name) {
            return Err(malformed(line, format!("the landmark {name:?} is there twice")));
        }
        let Some(&(line, text)) = pair.get(1) else {
            return Err(malformed(line, format!("the file ends before the coordinates of {name}")));
        };
        let mut coordinates = words(text);
        points.push(vector(&mut coordinates, "landmark", path, line)?);
        if let Some(word) = coordinates.next() {
            return Err(malformed(line, format!("{:?} follows the coordinates x y z of {name}", shown(word))));
        }
        names.push(name);
    }
    if points.len() != n {
        let problem = format!("{n} landmarks are announced, but {} follow: correct the number", points.len());
        return Err(malformed(first, problem));
    }
    Ok(LandmarkFile::Points { names: Some(names), points })
}

fn unlabelled(lines: &[(usize, &[u8])], path: &Path) -> Result<LandmarkFile, Error> {
    let mut numbers = Vec::new();
    let mut last = 0;
    for &(line, text) in lines {
        last = line;
        for word in words(text) {
            let problem = || format!("{:?} where a coordinate or a label is expected", shown(word));
            numbers.push(real(word).ok_or_else(|| Error::malformed(path, Place::Line(line), problem()))?);
        }
    }
    let (points, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        let problem = format!("{} numbers; three for each landmark are expected", numbers.len());
        return Err(Error::malformed(path, Place::Line(last), problem));
    }
    let names = (points.len() == FACE_LANDMARKS.len()).then(|| FACE_LANDMARKS.map(str::to_owned).to_vec());
    Ok(LandmarkFile::Points { names, points: points.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> LandmarkFile {
        parse(text.as_bytes(), Path::new("t.txt")).expect("a landmark file")
    }

    fn error(text: &str) -> String {
        parse(text.as_bytes(), Path::new("t.txt")).expect_err("must be refused").to_string()
    }

    #[test]
    fn json_prefers_thirteen() {
        let names = |n: usize| (0..n).map(|i| format!("\"n{i}\"")).collect::<Vec<_>>().join(",");
        let vertices = |n: usize| (0..n).map(|i| (i * i).to_string()).collect::<Vec<_>>().join(",");
        let set = |n| format!("\"landmarks{n}\":[{}],\"landmarks{n}_names\":[{}]", vertices(n), names(n));
        for text in [format!("{{{},{}}}", set(5), set(13)), format!("{{{},{}}}", set(28), set(13))] {
            let LandmarkFile::Vertices { names, vertices } = file(&text) else { panic!("vertices") };
            assert_eq!((names.len(), vertices[12]), (13, 144));
        }
        assert_eq!(file(&format!("{{{},\"landmarks4\":[1]}}", set(5))).names().map(<[_]>::len), Some(5));
        let unnamed = format!("{{\"landmarks13\":[{}],\"landmarks13_of_68\":1}}", vertices(13));
        assert_eq!(file(&unnamed).names().expect("names")[4], "nose_tip");
    }

    #[test]
    fn labelled_lists_may_leave_landmarks_out() {
        let file = file("\u{FEFF}2\r\nnose_tip\r\n1 2 3\r\n\r\nchin\r\n-1e1 0 .5\r\n");
        let names = Some(vec!["nose_tip".to_owned(), "chin".to_owned()]);
        assert_eq!(file, LandmarkFile::Points { names, points: vec![[1.0, 2.0, 3.0], [-10.0, 0.0, 0.5]] });
    }

    #[test]
    fn numbers_alone_are_triples_in_lines_of_any_length() {
        for text in ["1 2 3\n4 5 6", "1\n2\n3\n4\n5\n6\n"] {
            let points = vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
            assert_eq!(file(text), LandmarkFile::Points { names: None, points });
        }
        assert_eq!(file(&"1 2 3\n".repeat(13)).names().expect("names"), FACE_LANDMARKS);
    }

    #[test]
    fn landmarks_snap_to_the_nearest_vertex() {
        let positions = vec![[0.0; 3], [10.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 5.0, 0.0]];
        let mesh = Mesh { positions, ..Mesh::default() };
        let snapped = file("9 0 0\n0 5 0\n").snapped_to(&mesh).expect("vertices");
        let wanted = [SnappedLandmark { vertex: 1, distance: 1.0 }, SnappedLandmark { vertex: 3, distance: 0.0 }];
        assert_eq!(snapped, wanted);
        assert!(file("9 0 0").snapped_to(&Mesh::default()).is_err());
        let vertices = file("{\"landmarks2\":[3,4],\"landmarks2_names\":[\"a\",\"b\"]}");
        let message = vertices.snapped_to(&mesh).expect_err("must be refused").to_string();
        assert!(message.contains("landmark b is vertex 4, but the mesh has 4"), "{message}");
    }

    #[test]
    fn errors_name_the_line_and_the_remedy() {
        for (text, message) in [
            (" \n\n", "line 3: there is no landmark in it"),
            ("{\n\"a\" 1}", "line 2, column 5: no valid JSON: expected `:`"),
            ("{\"landmarks68\": [1]}", "line 1, column 1: there is no \"landmarks13\""),
            ("{\n\"landmarks13\": [1]}", "line 2, column 16: \"landmarks13\" has 1 vertices and 13 names"),
            (
                "{\"landmarks2\": [1, -1], \"landmarks2_names\": []}",
                "line 1, column 16: \"landmarks2\" is no list of vertex indices",
            ),
            (
                "{\"landmarks2\": [1, 2], \"landmarks2_names\": [\"a\", 1]}",
                "line 1, column 44: \"landmarks2_names\" is no list of names",
            ),
            (
                "{\"landmarks2\": [1, 2], \"landmarks2_names\": [\"a\", \"a\"]}",
                "column 44: the landmark \"a\" is there twice",
            ),
            ("\u{1}\0", "byte 1: a zero byte"),
            ("nose_tip\n1 2 3", "line 1: \"nose_tip\" where the number"),
            ("2\nnose_tip\n1 2 3", "line 1: 2 landmarks are announced, but 1 follow"),
            ("1\nnose_tip\n", "line 2: the file ends before the coordinates of nose_tip"),
            ("1\nnose_tip\n1 2", "line 3: the landmark ends before its z"),
            ("1\nnose_tip\n1 2 3 4", "line 3: \"4\" follows"),
            ("1\nnose_tip\n1 2 nan", "line 3: the landmark has \"nan\""),
            ("2\na\n1 2 3\na\n1 2 3", "line 4: the landmark \"a\" is there twice"),
            ("2\na b\n1 2 3", "line 2: \"a b\" where a label of one word"),
            ("1 2 3\n4 5", "line 2: 5 numbers; three"),
            ("1 2 3\n4 nan 6", "line 2: \"nan\" where a coordinate"),
        ] {
            assert!(error(text).contains(message), "{text:?}: {}", error(text));
        }
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        let json = "{\"landmarks2\": [1, 20], \"landmarks2_names\": [\"a\", \"b\"]}";
        for text in [json, "2\nnose_tip\n1 2 3\nchin\n-1e1 0 .5\n", "1 2 3\n4 5 6\n"] {
            let judge = |bytes: &[u8]| match parse(bytes, Path::new("t")) {
                Ok(LandmarkFile::Vertices { names, vertices }) => assert_eq!(names.len(), vertices.len()),
                Ok(LandmarkFile::Points { names, points }) => {
                    assert!(names.is_none_or(|names| names.len() == points.len()));
                    assert!(points.iter().flatten().all(|x| x.is_finite()));
                }
                Err(error) => assert!(matches!(error, Error::Malformed { .. }), "{error}"),
            };
            let mut bytes = text.as_bytes().to_vec();
            for at in 0..bytes.len() {
                judge(&text.as_bytes()[..at]);
                for byte in 0..=255 {
                    bytes[at] = byte;
                    judge(&bytes);
                }
                bytes[at] = text.as_bytes()[at];
            }
        }
    }
}
