//! Landmarks as rows of an NPY array: `[k, n, 3]` for `k` scans, or `[n, 3]` for one.

use std::path::{Path, PathBuf};

use super::landmarks::{LandmarkFile, beyond_places, is_place, standard_names};
use super::npy;
use crate::Error;

/// Reads landmarks for a scan: `FILE.npy:K` is row `K` (from 0) of an array, any other name is read as [`super::landmarks::read`] does.
///
/// # Errors
/// Those of the readers; [`Error::Input`] for an array of another shape, a row that does not exist or is missing, a coordinate that is none.
pub fn read(name: &Path) -> Result<LandmarkFile, Error> {
    let (path, row) = split(name);
    if !is_npy(&path) {
        return super::landmarks::read(name);
    }
    let problem = |text: String| Error::input(format!("{}: {text}", path.display()));
    let row = match row {
        Some(text) => Some(text.parse::<usize>().map_err(|_| {
            problem(format!("{text:?} behind the colon is no row; count the rows from 0, such as {}:0", path.display()))
        })?),
        None => None,
    };
    let bytes = super::file_bytes(&path)?;
    let (shape, values) = npy::parse_f64(&bytes, &path)?;
    let (n, from) = match (&shape[..], row) {
        (&[n, 3], None) => (n, 0),
        (&[n, 3], Some(row)) => {
            return Err(problem(format!(
                "the array has shape [{n}, 3], the landmarks of one scan, so it has no row {row} to choose; leave out :{row}"
            )));
        }
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
    let names = standard_names(n);
    for (k, point) in points.iter().enumerate().filter(|(_, point)| !point.iter().all(|x| x.is_nan())) {
        let called = names
            .as_ref()
            .map_or(format!("landmark {k} (counted from 0)"), |names| format!("the landmark {}", names[k]));
        if !point.iter().all(|x| x.is_finite()) {
            return Err(problem(format!("{called} is not finite: mark it anew, or leave it out with three NaN")));
        }
        if !is_place(point) {
            return Err(problem(beyond_places(&called)));
        }
    }
    Ok(LandmarkFile::Points { names, points })
}

/// The file that [`read`] reads.
pub fn file(name: &Path) -> PathBuf {
    split(name).0
}

fn is_npy(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy"))
}

/// The path and the row of `FILE.npy:K`, which may be none.
fn split(name: &Path) -> (PathBuf, Option<&str>) {
    let parts = name.to_str().and_then(|text| text.rsplit_once(':'));
    match parts.filter(|(path, _)| is_npy(Path::new(path)) && !name.is_file()) {
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
        assert!(said(named(&one, ":0")).contains("b.npy: the array has shape [4, 3], the landmarks of one scan"));
        for row in [":-1", ":x", ":"] {
            assert!(said(named(&rows, row)).contains("a.npy: \"") && said(named(&rows, row)).contains("no row; count"));
        }
        npy::write_f64(&one, &[2, 6], &values).expect("written");
        assert!(said(one.clone()).contains("byte 60: the array has shape [2, 6]; landmarks have [n, 3]"));
        npy::write_f64(&one, &[1, 3], &[1.0, f64::NAN, 2.0]).expect("written");
        assert!(said(one.clone()).contains("landmark 0 (counted from 0) is not finite"));
        npy::write_f64(&one, &[1, 3], &[1.0, 1e300, 2.0]).expect("written");
        assert!(said(one).contains("landmark 0 (counted from 0) has a coordinate beyond"));
    }
}
