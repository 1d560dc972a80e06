//! Point clouds as NPY arrays: `[n, 3]` positions, or `[n, 6]` positions and normals, of any type of number.
//!
//! Written as `f4` when that holds every number exactly, else as `f8`.

use std::path::Path;

use super::coordinates::REMEDY;
use super::losses::Losses;
use super::{Formatted, MeshFile, NonFinite, ReadOptions, WriteOptions, check_n_vertices};
use crate::Error;
use crate::io::npy;
use crate::mesh::{Mesh, Scalar};

/// The cloud in the bytes of an NPY file; `path` is for the messages.
///
/// # Errors
/// [`Error::Malformed`] with the byte; also for another shape.
pub fn parse(bytes: &[u8], path: &Path, options: &ReadOptions) -> Result<MeshFile, Error> {
    let (shape, values) = npy::parse_f64(bytes, path)?;
    let [n, width @ (3 | 6)] = shape[..] else {
        let remedy = if matches!(shape[..], [3 | 6, _]) { ": transpose it" } else { "" };
        let problem = format!(
            "an array of shape {shape:?}; a cloud has the shape [n, 3] (positions) or [n, 6] (positions and normals){remedy}"
        );
        return Err(Error::malformed(path, npy::place_of_shape(bytes, path), problem));
    };
    check_n_vertices(n, path, || npy::place_of_shape(bytes, path))?;
    if options.non_finite == NonFinite::Refuse
        && let Some(index) = values.iter().position(|x| !x.is_finite())
    {
        let place = npy::place_of_value(bytes, path, index);
        let (vertex, column, value) = (index / width, index % width, values[index]);
        let problem = format!("column {column} of vertex {vertex} is {value}; a finite number is expected: {REMEDY}");
        return Err(Error::malformed(path, place, problem));
    }
    let mesh = if width == 3 {
        Mesh { positions: values.as_chunks::<3>().0.to_vec(), ..Mesh::default() }
    } else {
        let vectors = values.as_chunks::<3>().0;
        let every_other = |first: usize| vectors.iter().skip(first).step_by(2).copied().collect();
        Mesh { positions: every_other(0), normals: every_other(1), ..Mesh::default() }
    };
    Ok(mesh.into())
}

/// The bytes of an NPY file of the positions and, if there are any, normals of a mesh that passes [`Mesh::check`].
///
/// # Errors
/// None: what an array of points cannot hold is left out and named.
pub fn format(file: &MeshFile, _: &WriteOptions) -> Result<Formatted, String> {
    let mesh = &file.mesh;
    let values: Vec<f64> = match mesh.normals.is_empty() {
        true => mesh.positions.as_flattened().to_vec(),
        false => mesh
            .positions
            .iter()
            .zip(&mesh.normals)
            .flat_map(|(position, normal)| [*position, *normal])
            .flatten()
            .collect(),
    };
    let shape = [mesh.positions.len(), if mesh.normals.is_empty() { 3 } else { 6 }];
    let bytes = if values.iter().all(|&x| Scalar::F32.holds(x)) {
        npy::format_f32(&shape, &values.iter().map(|&x| x as f32).collect::<Vec<_>>())
    } else {
        npy::format_f64(&shape, &values)
    };
    let mut losses = Losses::default();
    losses.note(mesh.faces.len(), "face", "faces");
    losses.note(mesh.colours.len(), "colour of a vertex", "colours of vertices");
    losses.note_attributes(mesh);
    losses.note_beyond_mesh(file);
    Ok(losses.formatted(bytes.map_err(|error| error.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::super::samples::{any_mesh, assail, kept, meshes, rich_files};
    use super::*;
    use proptest::prelude::*;

    fn outcome(bytes: &[u8]) -> Result<Mesh, Error> {
        Ok(parse(bytes, Path::new("t.npy"), &ReadOptions::default())?.mesh)
    }

    fn written(mesh: &Mesh) -> Vec<u8> {
        format(&mesh.clone().into(), &WriteOptions::default()).expect("any mesh is written").bytes
    }

    #[test]
    fn positions_and_normals_of_every_type_are_read() {
        let bytes = npy::format_u32(&[2, 3], &[1, 2, 3, 4, 5, 6]).expect("an array");
        assert_eq!(outcome(&bytes).expect("a cloud").positions, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
        let bytes = npy::format_f64(&[1, 6], &[0.1, 2.0, 3.0, 0.0, 0.0, 1.0]).expect("an array");
        let mesh = outcome(&bytes).expect("a cloud");
        assert_eq!((mesh.positions, mesh.normals), (vec![[0.1, 2.0, 3.0]], vec![[0.0, 0.0, 1.0]]));
    }

    #[test]
    fn errors_name_the_place_and_the_remedy() {
        let array = |shape: &[usize], value: f64| {
            let n = shape.iter().product();
            npy::format_f64(shape, &vec![value; n]).expect("an array")
        };
        for (bytes, message) in [
            (
                array(&[3, 5], 0.0),
                "t.npy, byte 60: an array of shape [3, 5]; a cloud has the shape [n, 3] (positions) or [n, 6]",
            ),
            (array(&[6, 9], 0.0), "transpose it"),
            (array(&[4], 0.0), "shape [4]"),
            (array(&[2, 2, 3], 0.0), "shape [2, 2, 3]"),
            (array(&[0, 3], 0.0), "t.npy, byte 60: there is no vertex"),
            (
                array(&[2, 3], f64::NAN),
                "byte 128: column 0 of vertex 0 is NaN; a finite number is expected: `habitus clean`",
            ),
            (b"\x93NUMPY".to_vec(), "byte 6: an NPY file has at least 10 bytes: is it truncated?"),
        ] {
            let error = outcome(&bytes).expect_err("must be refused").to_string();
            assert!(error.contains(message), "{message}: {error}");
        }
        assert!(kept(&array(&[2, 6], f64::NAN), parse).expect("kept").normals[1][2].is_nan());
    }

    #[test]
    fn numbers_are_short_only_when_exact() {
        let mut mesh = Mesh { positions: vec![[0.5, -0.0, 1024.0]], ..Mesh::default() };
        assert!(written(&mesh).windows(4).any(|bytes| bytes == b"'<f4"));
        mesh.positions[0][2] = 0.1;
        assert!(written(&mesh).windows(4).any(|bytes| bytes == b"'<f8"));
    }

    #[test]
    fn what_an_array_cannot_hold_is_named() {
        let left_out = |file: &MeshFile| format(file, &WriteOptions::default()).expect("written").left_out;
        let files = rich_files();
        assert_eq!(left_out(&files[0])[..2], ["2 faces", "4 colours of vertices"]);
        assert_eq!((left_out(&files[0]).len(), left_out(&files[1]).len()), (10, 12));
    }

    #[test]
    fn hostile_bytes_are_refused_or_harmless() {
        for mesh in meshes().iter().step_by(3) {
            assail(&written(mesh), parse);
        }
    }

    proptest! {
        #[test]
        fn clouds_read_back(mesh in any_mesh()) {
            let again = outcome(&written(&mesh)).unwrap();
            prop_assert_eq!((again.positions, again.normals), (mesh.positions, mesh.normals));
        }
    }
}
