//! Landmark files: positions or vertices of a mesh, with or without names, in JSON or in text.
//!
//! | content | form |
//! |---|---|
//! | JSON with `landmarksN`, vertex indices, and `landmarksN_names` | [`LandmarkFile::Vertices`] |
//! | JSON list of vertex indices, or object of them by their names | [`LandmarkFile::Vertices`] |
//! | JSON list of `[x, y, z]`, or object of them by their names | [`LandmarkFile::Points`] |
//! | labelled list: the count, then for each a line with its label and a line `x y z` | [`LandmarkFile::Points`] |
//! | lines `name x y z`, or `name,x,y,z` or `x,y,z`, with or without these words as the first line | [`LandmarkFile::Points`] |
//! | numbers only, three per landmark, in lines of any length | [`LandmarkFile::Points`] |
//!
//! Named landmarks may be left out. Thirteen landmarks without names are those of [`FACE_LANDMARKS`].

mod json;
mod lines;

use std::path::Path;

use super::file_bytes;
use super::text::{check_is_text, without_byte_order_mark};
use crate::Error;
use crate::mesh::{LARGEST_COORDINATE, Mesh};

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
        /// One name per landmark, if the file has names or thirteen landmarks.
        names: Option<Vec<String>>,
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
            LandmarkFile::Vertices { names, .. } | LandmarkFile::Points { names, .. } => names.as_deref(),
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
                let on_vertex = |(at, &vertex): (usize, &u32)| {
                    if (vertex as usize) < n_vertices {
                        return Ok(SnappedLandmark { vertex, distance: 0.0 });
                    }
                    let name = names.as_ref().and_then(|names| names.get(at).cloned());
                    let name = name.unwrap_or_else(|| format!("{at} (counted from 0)"));
                    Err(Error::input(format!(
                        "landmark {name} is vertex {vertex}, but the mesh has {n_vertices}: is the file for this mesh?"
                    )))
                };
                vertices.iter().enumerate().map(on_vertex).collect()
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

/// Reads the landmark file at `path`: JSON when it begins with `{` or `[`, else text.
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
    match bytes.trim_ascii_start().first() {
        Some(b'{' | b'[') => json::landmarks(bytes, path),
        _ => lines::landmarks(bytes, path),
    }
}

/// The names of so many landmarks without names.
pub(super) fn standard_names(n: usize) -> Option<Vec<String>> {
    (n == FACE_LANDMARKS.len()).then(|| FACE_LANDMARKS.map(str::to_owned).to_vec())
}

/// Whether finite coordinates are those of a place on a mesh that can be read.
pub(super) fn is_place(point: &[f64; 3]) -> bool {
    point.iter().all(|x| x.abs() <= LARGEST_COORDINATE)
}

/// What is wrong with one that is no such place.
pub(super) fn beyond_places(called: &str) -> String {
    format!(
        "{called} has a coordinate beyond {LARGEST_COORDINATE:e}, which no place has: correct it, or leave the landmark out"
    )
}

/// A name that is there twice.
fn repeated(names: &[String]) -> Option<&String> {
    let mut seen = std::collections::HashSet::new();
    names.iter().find(|name| !seen.insert(*name))
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
            assert_eq!((names.expect("names").len(), vertices[12]), (13, 144));
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
    fn rows_may_have_names_in_text_and_in_json() {
        let names = || Some(vec!["nose tip".to_owned(), "chin".to_owned()]);
        let points = || vec![[1.0, 2.0, 3.0], [4.0, 5.0, -6.0]];
        let rows = |names| LandmarkFile::Points { names, points: points() };
        for text in [
            "# marked by hand\nnose tip 1 2 3\n\nchin\t4 5 -6\n",
            "name x y z\nnose tip 1 2 3\nchin 4 5 -6",
            "Name,X,Y,Z\r\nnose tip,1,2,3\r\n\"chin\", 4, 5, -6\r\n",
            "nose tip,1,2,3\nchin,4,5,-6",
            "\"name\",\"x\",\"y\",\"z\"\n\"nose tip\",\"1\",2,3\n\"chin\",4,5,-6",
            "2\nnose tip\n1 2 3\nchin\n4 5 -6",
            "{\"nose tip\": [1, 2, 3], \"chin\": [4, 5, -6.0]}",
        ] {
            assert_eq!(file(text), rows(names()), "{text:?}");
        }
        for text in ["x,y,z\n1,2,3\n4,5,-6", "1,2,3\n4,5,-6", "x y z\n1 2 3\n4 5 -6", " [[1, 2, 3], [4, 5, -6]]"] {
            assert_eq!(file(text), rows(None), "{text:?}");
        }
        let on_vertices = |names| LandmarkFile::Vertices { names, vertices: vec![7, 0] };
        assert_eq!(file("{\"nose tip\": 7, \"chin\": 0}"), on_vertices(names()));
        assert_eq!(file("[7, 0]"), on_vertices(None));
        for text in
            [format!("[{}7]", "7,".repeat(12)), "1,2,3\n".repeat(13), format!("[{}[1,2,3]]", "[1,2,3],".repeat(12))]
        {
            assert_eq!(file(&text).names().expect("names"), FACE_LANDMARKS, "{text}");
        }
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
            ("1\nnose_tip\n1 2", "line 3: the landmark nose_tip ends before its z"),
            ("1\nnose_tip\n1 2 3 4", "line 3: \"4\" follows"),
            ("1\nnose_tip\n1 2 nan", "line 3: the landmark nose_tip has \"nan\""),
            ("2\na\n1 2 3\na\n1 2 3", "line 4: the landmark \"a\" is there twice"),
            ("2\na 1\n1 2 3", "line 2: \"a 1\" where a label alone"),
            ("1 2 3\n4 5", "line 2: 5 numbers; three"),
            ("1 2 3\n4 nan 6", "line 2: the landmark has \"nan\" where a finite"),
            ("nose_tip 1 2 3\nchin 1 nan 3", "line 2: the landmark chin has \"nan\" where a finite"),
            ("nose_tip 1 2 3\nchin 1 2", "line 2: the landmark chin ends before its z"),
            ("nose_tip 1 2 3\nchin 1 2 3 4", "line 2: 4 numbers behind the name"),
            ("nose_tip 1 2 3\n4 5 6", "line 2: the landmark has no name, the one before it a name: name all or none"),
            ("nose_tip 1 2 3\nnose_tip 4 5 6", "line 2: the landmark \"nose_tip\" is there twice"),
            ("1,2,3\n4,5", "line 2: 2 fields between commas where name,x,y,z or x,y,z"),
            ("1,2,3\na,4,5,6", "line 2: the landmark has a name, the one before it no name"),
            ("nose_tip;1;2;3", "line 1: a semicolon: put commas between name, x, y and z"),
            ("nose_tip 1 2 3\nchin;1,5;2;3", "line 2: a semicolon"),
            ("7,2,3,4", "line 1: \"7\" where a name is expected"),
            ("name,x,y,z\nchin,1,,3", "line 2: the landmark chin has \"\" where a finite"),
            ("x,y,z\n", "line 2: there is no landmark in it"),
            ("1 2 3\n4 1e300 6", "line 2: landmark 1 (counted from 0) has a coordinate beyond 1e70"),
            ("1\nchin\n4 1e300 6", "line 3: the landmark chin has a coordinate beyond"),
            (
                "[[1, 2, 3],\n [1, 2]]",
                "line 2, column 2: landmark 1 (counted from 0) is [1,2]: give positions [x, y, z] or",
            ),
            ("[[1, 2, 3],\n 7]", "line 2, column 2: landmark 1 (counted from 0) is 7: give"),
            ("[[1, 2, 1e300]]", "column 2: landmark 0 (counted from 0) has a coordinate beyond"),
            ("{\"chin\": [1, 2, 3], \"nose_tip\": null}", "column 33: the landmark \"nose_tip\" is null: give"),
            ("{\"chin\": 1, \"chin\": 2}", "column 21: the landmark \"chin\" is there twice"),
            ("[]", "column 1: there is no landmark in it"),
            ("{}", "column 1: there is no landmark in it"),
        ] {
            assert!(error(text).contains(message), "{text:?}: {}", error(text));
        }
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        let json = "{\"landmarks2\": [1, 20], \"landmarks2_names\": [\"a\", \"b\"]}";
        let rows = "x y z\na b 1 2 3\nchin 4 5 6";
        for text in [
            json,
            "2\nnose_tip\n1 2 3\nchin\n-1e1 0 .5\n",
            "1 2 3\n4 5 6\n",
            rows,
            "\"a\",1,2,3\nb,4,5,6",
            "{\"a\":[1,2,3],\"b\":[4,5,6]}",
            "[7,8]",
        ] {
            let judge = |bytes: &[u8]| match parse(bytes, Path::new("t")) {
                Ok(LandmarkFile::Vertices { names, vertices }) => {
                    assert!(names.is_none_or(|names| names.len() == vertices.len()));
                }
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
