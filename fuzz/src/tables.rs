//! Readers of arrays, landmarks and collections: the first bytes say which.
//!
//! | begins with | read as | asserted of what is accepted |
//! |---|---|---|
//! | `\x93NUMPY` | NPY | the shape holds the values; indices are the same numbers as reals; written, it reads back |
//! | `PK` | NPZ | its names are sorted; each array is an array or a damaged entry |
//! | anything else | landmarks, and collection | names are unique and one per landmark; a path per slot |

use std::collections::BTreeSet;
use std::path::Path;

use habitus::Error;
use habitus::io::landmarks::{self, LandmarkFile};
use habitus::io::npy::npz::NpzReader;
use habitus::io::{collection, npy};
use habitus::mesh::Mesh;

const PATH: &str = "any.bytes";

/// Reads the bytes as the kind of file that they begin like.
pub fn check(bytes: &[u8]) {
    match bytes {
        [0x93, ..] => array(bytes),
        [b'P', b'K', ..] => archive(bytes),
        _ => {
            landmark_file(bytes);
            collection_file(bytes);
        }
    }
}

/// What the reader accepted; an error must be one of the file and name it.
fn accepted<T>(outcome: Result<T, Error>) -> Option<T> {
    match outcome {
        Ok(value) => Some(value),
        Err(error @ Error::Malformed { .. }) => {
            assert!(error.to_string().starts_with(PATH), "the error does not name the file: {error}");
            None
        }
        Err(error) => panic!("not an error of the file: {error}"),
    }
}

fn array(bytes: &[u8]) {
    let path = Path::new(PATH);
    let reals = accepted(npy::parse_f64(bytes, path));
    let indices = accepted(npy::parse_u32(bytes, path));
    if let Some((shape, values)) = &reals {
        assert_eq!(shape.iter().product::<usize>(), values.len());
        let written = npy::format_f64(shape, values).expect("the shape holds the values");
        let (again_shape, again) = npy::parse_f64(&written, path).expect("what was written is read");
        assert_eq!(&again_shape, shape);
        assert!(again.iter().zip(values).all(|(a, b)| a.to_bits() == b.to_bits()), "{again:?} {values:?}");
    }
    if let Some((shape, indices)) = indices {
        let (real_shape, reals) = reals.expect("indices are exact as real numbers");
        assert_eq!(shape, real_shape);
        assert!(indices.iter().map(|&index| f64::from(index)).eq(reals));
        let written = npy::format_u32(&shape, &indices).expect("the shape holds the values");
        assert_eq!(npy::parse_u32(&written, path).expect("what was written is read"), (shape, indices));
    }
}

fn archive(bytes: &[u8]) {
    let Some(mut archive) = accepted(NpzReader::parse(bytes.to_vec(), Path::new(PATH))) else { return };
    let names = archive.names();
    assert!(names.is_sorted());
    // A few suffice, and an archive of a thousand entries that share their bytes would only be slow.
    for name in names.iter().take(4) {
        let reals = accepted(archive.f64(name));
        if let Some((shape, indices)) = accepted(archive.u32(name)) {
            let (real_shape, reals) = reals.expect("indices are exact as real numbers");
            assert_eq!(shape, real_shape);
            assert!(indices.iter().map(|&index| f64::from(index)).eq(reals));
        }
    }
}

fn landmark_file(bytes: &[u8]) {
    let Some(file) = accepted(landmarks::parse(bytes, Path::new(PATH))) else { return };
    let n = match &file {
        LandmarkFile::Vertices { vertices, .. } => vertices.len(),
        LandmarkFile::Points { points, .. } => {
            assert!(points.iter().flatten().all(|x| x.is_finite()));
            points.len()
        }
    };
    assert!(n > 0, "a landmark file without landmarks");
    if let Some(names) = file.names() {
        assert_eq!(names.len(), n);
        assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), n, "a name is there twice: {names:?}");
    }
    let mesh = Mesh { positions: vec![[0.0; 3], [1.0, 2.0, 3.0], [-1e9, 0.0, 1e9]], ..Mesh::default() };
    match file.snapped_to(&mesh) {
        Ok(snapped) => {
            assert_eq!(snapped.len(), n);
            assert!(snapped.iter().all(|at| (at.vertex as usize) < 3 && at.distance >= 0.0), "{snapped:?}");
        }
        Err(error) => assert!(matches!(error, Error::Input(_)), "{error}"),
    }
}

fn collection_file(bytes: &[u8]) {
    let Some(collection) = accepted(collection::parse(bytes, Path::new(PATH))) else { return };
    let (identities, expressions) = (collection.n_identities, collection.n_expressions);
    assert!(identities > 0 && expressions > 0);
    assert_eq!(identities.checked_mul(expressions), Some(collection.paths.len()));
    assert_eq!(collection.n_missing(), collection.paths.len());
    assert_eq!(collection.slot(identities - 1, expressions - 1), Some(collection.paths.len() - 1));
    assert_eq!(collection.slot(identities, 0), None);
    assert_eq!(collection.path(0, 0), None, "no file was looked for");
}
