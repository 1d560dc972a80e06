//! Training data and template of a face model, from files.

use std::path::Path;

use crate::Error;
use crate::face::tensor::ShapeTensor;
use crate::io::landmarks::LandmarkFile;
use crate::io::{collection, landmarks, mesh, npy};
use crate::mesh::Mesh;

/// Reads registered shapes: an NPY tensor `[identity, expression, vertex, 3]` (mm), the same as the only array of an NPZ archive or its array
/// `tensor`, or a `collection` text file with one mesh per shape.
///
/// Errors: a tensor of another rank, a shape that is missing, meshes of different sizes, numbers that are not finite.
pub fn tensor(path: &Path) -> Result<ShapeTensor, Error> {
    let is = |known: &str| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(known));
    if is("npy") || is("npz") {
        let (shape, values) = if is("npy") { npy::read_f64(path)? } else { archived_tensor(path)? };
        let [identities, expressions, vertices, 3] = shape[..] else {
            return Err(Error::input(format!(
                "{}: the array has shape {shape:?}; a training tensor has four axes, [identity, expression, vertex, 3]",
                path.display()
            )));
        };
        return named(ShapeTensor::from_array(identities, expressions, vertices, &values), path);
    }
    let collection = collection::read(path)?;
    let (d2, d3) = (collection.n_identities, collection.n_expressions);
    let mut data = Vec::new();
    let mut first: Option<(usize, &Path)> = None;
    for expression in 0..d3 {
        for identity in 0..d2 {
            let Some(file) = collection.path(identity, expression) else {
                return Err(Error::input(format!(
                    "{}: the shape of identity {identity}, expression {expression} is missing ({} of {} are); give every file, or leave \
                     that identity or expression out of the collection",
                    path.display(),
                    collection.n_missing(),
                    d2 * d3
                )));
            };
            let mesh = mesh::read(file)?;
            let (count, of) = *first.get_or_insert((mesh.positions.len(), file));
            if mesh.positions.len() != count {
                return Err(Error::input(format!(
                    "{}: {} vertices, but {} has {count}; all shapes must be registered to one template",
                    file.display(),
                    mesh.positions.len(),
                    of.display()
                )));
            }
            data.extend(mesh.positions.into_iter().flatten());
        }
    }
    let vertices = first.map_or(0, |(count, _)| count);
    named(ShapeTensor::from_shapes(d2, d3, vertices, data), path)
}

/// The only array of an NPZ archive, or the one called `tensor`.
fn archived_tensor(path: &Path) -> Result<(Vec<usize>, Vec<f64>), Error> {
    let mut npz = npy::npz::NpzReader::open(path)?;
    let names = npz.names();
    match &names[..] {
        [only] => npz.f64(only),
        _ => npz.f64("tensor"),
    }
}

fn named(tensor: Result<ShapeTensor, Error>, path: &Path) -> Result<ShapeTensor, Error> {
    tensor.map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

/// What the shapes stand for: triangles, landmarks, sides.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Template {
    /// Triangles, or none.
    pub faces: Vec<[u32; 3]>,
    /// Vertex of each landmark, or none.
    pub landmarks: Vec<u32>,
    /// Name of each landmark, or none.
    pub landmark_names: Vec<String>,
    /// Vertex of the other side for each vertex, or none.
    pub mirror: Vec<u32>,
}

/// Largest distance of a landmark point to the template, as a share of the template's diagonal, at which it is snapped to a vertex.
const SNAP_LIMIT: f64 = 0.05;

impl Template {
    /// Reads the parts that are given and checks them against the number of vertices of the shapes.
    ///
    /// `template` is a mesh, or an NPY array of triangles `[m, 3]`; `landmarks` a JSON of vertices or a list of points on the template mesh;
    /// `mirror` an NPY array `[n]`.
    ///
    /// Errors: a template of another size, landmark points with triangles alone, landmarks far from the template, a mirror map that is no
    /// involution.
    pub fn read(
        tensor: &ShapeTensor,
        template: Option<&Path>,
        landmarks: Option<&Path>,
        mirror: Option<&Path>,
    ) -> Result<Self, Error> {
        let mut result = Template::default();
        let mut mesh = None;
        if let Some(path) = template {
            let name = path.display().to_string();
            if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("npy")) {
                result.faces = triangles(path)?;
                tensor.check_template(&name, None, &result.faces)?;
            } else {
                let read = mesh::read(path)?;
                tensor.check_template(&name, Some(read.positions.len()), &read.faces)?;
                if read.faces.is_empty() {
                    return Err(Error::input(format!(
                        "{name}: the template has no triangles; give a mesh, not a point cloud"
                    )));
                }
                result.faces = read.faces.clone();
                mesh = Some(read);
            }
        }
        if let Some(path) = landmarks {
            result.read_landmarks(path, mesh.as_ref(), tensor.n_vertices())?;
        }
        if let Some(path) = mirror {
            result.mirror = mirror_map(path, tensor.n_vertices())?;
        }
        Ok(result)
    }

    fn read_landmarks(&mut self, path: &Path, mesh: Option<&Mesh>, n_vertices: usize) -> Result<(), Error> {
        let file = landmarks::read(path)?;
        self.landmark_names = file.names().map(<[String]>::to_vec).unwrap_or_default();
        check_names(path, &self.landmark_names)?;
        if let LandmarkFile::Vertices { vertices, .. } = &file {
            if let Some(vertex) = vertices.iter().find(|&&vertex| vertex as usize >= n_vertices) {
                return Err(Error::input(format!(
                    "{}: landmark vertex {vertex} does not exist, the shapes have {n_vertices} (counted from 0); give the landmarks of this template",
                    path.display()
                )));
            }
            self.landmarks = vertices.clone();
            return Ok(());
        }
        let Some(mesh) = mesh else {
            return Err(Error::input(format!(
                "{}: landmarks given as points need a template mesh to lie on; give --template MESH instead of triangles alone, or landmarks as vertex \
                 indices (JSON)",
                path.display()
            )));
        };
        let limit = SNAP_LIMIT * mesh.bounding_box().map_or(0.0, |(low, high)| diagonal(low, high));
        for (index, snapped) in file.snapped_to(mesh)?.iter().enumerate() {
            if snapped.distance > limit {
                let name = self.landmark_names.get(index).map_or("", String::as_str);
                return Err(Error::input(format!(
                    "{}: landmark {index} {name} is {:.1} mm away from the template; give points on the template mesh, in its unit and frame",
                    path.display(),
                    snapped.distance
                )));
            }
            self.landmarks.push(snapped.vertex);
        }
        Ok(())
    }
}

fn triangles(path: &Path) -> Result<Vec<[u32; 3]>, Error> {
    let (shape, values) = npy::read_u32(path)?;
    match shape[..] {
        [_, 3] => Ok(values.as_chunks::<3>().0.to_vec()),
        _ => {
            Err(Error::input(format!("{}: the array has shape {shape:?}; triangles have shape [m, 3]", path.display())))
        }
    }
}

fn mirror_map(path: &Path, n_vertices: usize) -> Result<Vec<u32>, Error> {
    let (shape, values) = npy::read_u32(path)?;
    if shape != [n_vertices] {
        return Err(Error::input(format!(
            "{}: the array has shape {shape:?}; a mirror map of these shapes has [{n_vertices}]",
            path.display()
        )));
    }
    let returns = |vertex: usize| values.get(values[vertex] as usize).map(|&back| back as usize) == Some(vertex);
    match (0..n_vertices).find(|&vertex| !returns(vertex)) {
        None => Ok(values),
        Some(vertex) => Err(Error::input(format!(
            "{}: vertex {vertex} maps to {}, which does not map back; a mirror map sends each vertex to the other side and back",
            path.display(),
            values[vertex]
        ))),
    }
}

fn diagonal(low: [f64; 3], high: [f64; 3]) -> f64 {
    low.iter().zip(high).map(|(low, high)| (high - low) * (high - low)).sum::<f64>().sqrt()
}

/// Names of the expressions: from a JSON object with a list `expressions`, or a text file with one name per line; without a file, none.
///
/// Errors: another number of names than expressions, a name that is empty or holds a line feed.
pub fn expression_names(path: Option<&Path>, n_expressions: usize) -> Result<Vec<String>, Error> {
    let Some(path) = path else { return Ok(Vec::new()) };
    let bytes = crate::io::file_bytes(path)?;
    let names: Vec<String> = match serde_json::from_slice::<serde_json::Value>(&bytes) {
        Ok(value) => {
            value.get("expressions").and_then(|list| serde_json::from_value(list.clone()).ok()).ok_or_else(|| {
                Error::input(format!("{}: the JSON has no list of texts \"expressions\"", path.display()))
            })?
        }
        Err(_) => std::str::from_utf8(&bytes)
            .map_err(|_| Error::input(format!("{}: the names are not UTF-8; save the file as UTF-8", path.display())))?
            .lines()
            .map(|line| line.trim().to_owned())
            .collect(),
    };
    if names.len() != n_expressions {
        return Err(Error::input(format!(
            "{}: {} names for {n_expressions} expressions; give one name per expression, in the order of the data",
            path.display(),
            names.len()
        )));
    }
    check_names(path, &names)?;
    Ok(names)
}

/// Refuses names that a model file cannot hold, or that name two things.
fn check_names(path: &Path, names: &[String]) -> Result<(), Error> {
    for (index, name) in names.iter().enumerate() {
        if name.is_empty() || name.contains(char::is_control) {
            return Err(Error::input(format!(
                "{}: name {index} is empty or holds a control character",
                path.display()
            )));
        }
        if names.iter().take(index).any(|earlier| earlier == name) {
            return Err(Error::input(format!("{}: the name {name:?} stands twice; give each its own", path.display())));
        }
    }
    Ok(())
}
