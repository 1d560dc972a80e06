//! Landmarks as rows of an NPY array: `[k, n, 3]` for `k` scans, or `[n, 3]` for one.

use std::path::{Path, PathBuf};

use super::landmarks::{FACE_LANDMARKS, LandmarkFile};
use super::npy;
use crate::Error;

/// Reads landmarks for a scan: `FILE.npy:K` is row `K` (from 0) of an array, any other name is read as [`super::landmarks::read`] does.
///
/// # Errors
/// Those of the readers; [`Error::Input`] for an array of another shape, a row that does not exist or is missing.
pub fn read(name: &Path) -> Result<LandmarkFile, Error> {
    let (path, row) = split(name);
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("npy")) {
        return super::landmarks::read(name);
    }
    let bytes = super::file_bytes(&path)?;
    let (shape, values) = npy::parse_f64(&bytes, &path)?;
    let problem = |text: String| Error::input(format!("{}: {text}", path.display()));
    let (n, from) = match (&shape[..], row) {
        (&[n, 3], None) => (n, 0),
        (&[rows, n, 3], Some(row)) if row < rows => (n, row * n),
        (&[rows, _, 3], Some(row)) => {
            return Err(problem(format!("there is no row {row}, the array has {rows} (counted from 0)")));
        }
        (&[rows, _, 3], None) => {
            return Err(problem(format!(
                "the array has the landmarks of {rows} scans; name one, such as {}:0",
                path.display()
            )));
        }
        _ => {
            let problem = format!("the array has shape {shape:?}; landmarks have [n, 3], or [scans, n, 3]");
            return Err(Error::malformed(&path, npy::place_of_shape(&bytes, &path), problem));
        }
    };
    let points = values.as_chunks::<3>().0.get(from..from + n).unwrap_or_default().to_vec();
    let names = (n == FACE_LANDMARKS.len()).then(|| FACE_LANDMARKS.map(str::to_owned).to_vec());
    Ok(LandmarkFile::Points { names, points })
}

/// The path and the row of `FILE.npy:K`.
fn split(name: &Path) -> (PathBuf, Option<usize>) {
    let parts = name.to_str().and_then(|text| text.rsplit_once(':'));
    match parts.and_then(|(path, row)| Some((path, row.parse().ok()?))) {
        Some((path, row)) => (PathBuf::from(path), Some(row)),
        None => (name.to_owned(), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_named_behind_a_colon() {
        let folder = tempfile::tempdir().expect("a folder");
        let (rows, one) = (folder.path().join("a.npy"), folder.path().join("b.npy"));
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        npy::write_f64(&rows, &[2, 2, 3], &values).expect("written");
        npy::write_f64(&one, &[4, 3], &values).expect("written");
        let named = |path: &Path, row: &str| PathBuf::from(format!("{}{row}", path.display()));
        let points = |name: PathBuf| match read(&name) {
            Ok(LandmarkFile::Points { points, .. }) => points,
            other => panic!("{other:?}"),
        };
        assert_eq!(points(named(&rows, ":1")), [[6.0, 7.0, 8.0], [9.0, 10.0, 11.0]]);
        assert_eq!(points(one.clone()).len(), 4);
        let said = |name: PathBuf| read(&name).expect_err("refused").to_string();
        assert!(said(named(&rows, ":2")).contains("there is no row 2, the array has 2"));
        assert!(said(rows.clone()).contains("landmarks of 2 scans; name one"));
        assert!(said(named(&one, ":0")).contains("byte 60: the array has shape [4, 3]; landmarks have [n, 3]"));
    }
}
