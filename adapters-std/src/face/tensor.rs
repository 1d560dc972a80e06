//! Registered shapes of every identity in every expression, the input of face training.

use crate::error::Error;

/// Shapes in one topology, `n_identities x n_expressions` of them.
///
/// Shape `(i, p)` is shape number `k = p n_identities + i` (identity fastest): `3 n_vertices` coordinates in mm, xyz
/// after xyz. Seen as a matrix, the data are column-major with one shape a column.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeTensor {
    n_identities: usize,
    n_expressions: usize,
    n_vertices: usize,
    data: Vec<f64>,
}

impl ShapeTensor {
    /// Takes shapes that already lie in storage order (identity fastest).
    ///
    /// Errors: a size of zero, a length that is not the product of the sizes, a coordinate that is not finite.
    pub fn from_shapes(
        n_identities: usize,
        n_expressions: usize,
        n_vertices: usize,
        data: Vec<f64>,
    ) -> Result<Self, Error> {
        check_sizes(n_identities, n_expressions, n_vertices, data.len())?;
        let tensor = ShapeTensor { n_identities, n_expressions, n_vertices, data };
        match tensor.data.iter().position(|x| !x.is_finite()) {
            Some(at) => Err(tensor.not_finite(at)),
            None => Ok(tensor),
        }
    }

    /// Reads a C-ordered array `[identity, expression, vertex, 3]`, the layout of an NPY tensor; errors as above.
    pub fn from_array<T: Copy + Into<f64>>(
        n_identities: usize,
        n_expressions: usize,
        n_vertices: usize,
        array: &[T],
    ) -> Result<Self, Error> {
        check_sizes(n_identities, n_expressions, n_vertices, array.len())?;
        let len = 3 * n_vertices;
        let mut data = Vec::with_capacity(array.len());
        for expression in 0..n_expressions {
            for identity in 0..n_identities {
                let start = (identity * n_expressions + expression) * len;
                data.extend(array[start..start + len].iter().map(|&x| x.into()));
            }
        }
        Self::from_shapes(n_identities, n_expressions, n_vertices, data)
    }

    /// The C-ordered array `[identity, expression, vertex, 3]`.
    pub fn to_array(&self) -> Vec<f64> {
        let mut array = Vec::with_capacity(self.data.len());
        for identity in 0..self.n_identities {
            for expression in 0..self.n_expressions {
                array.extend_from_slice(self.shape(identity, expression));
            }
        }
        array
    }

    /// Number of identities, `d2`.
    pub fn n_identities(&self) -> usize {
        self.n_identities
    }

    /// Number of expressions, `d3`.
    pub fn n_expressions(&self) -> usize {
        self.n_expressions
    }

    /// Number of vertices of every shape.
    pub fn n_vertices(&self) -> usize {
        self.n_vertices
    }

    /// Number of shapes, `N = d2 d3`.
    pub fn n_shapes(&self) -> usize {
        self.n_identities * self.n_expressions
    }

    /// Coordinates of one shape, `3 n_vertices`.
    pub fn shape_len(&self) -> usize {
        3 * self.n_vertices
    }

    /// All coordinates in storage order.
    pub fn data(&self) -> &[f64] {
        &self.data
    }

    /// All coordinates in storage order, to be moved (by alignment, say); they must stay finite.
    pub fn data_mut(&mut self) -> &mut [f64] {
        &mut self.data
    }

    /// Shape of `identity` in `expression`.
    ///
    /// # Panics
    /// When one of them is not below its count.
    pub fn shape(&self, identity: usize, expression: usize) -> &[f64] {
        assert!(identity < self.n_identities && expression < self.n_expressions);
        let len = self.shape_len();
        let start = (expression * self.n_identities + identity) * len;
        &self.data[start..start + len]
    }

    /// Checks that a template mesh fits: as many vertices as the shapes, and no triangle beyond them.
    ///
    /// `name` says in the message which mesh or file is meant. With `n_vertices` of `None` (a list of triangles
    /// alone), only the triangles are checked.
    pub fn check_template(&self, name: &str, n_vertices: Option<usize>, faces: &[[u32; 3]]) -> Result<(), Error> {
        if let Some(found) = n_vertices.filter(|&n| n != self.n_vertices) {
            return Err(Error::input(format!(
                "{name}: the template has {found} vertices, the training shapes have {}; \
                 give the mesh that the shapes were registered with",
                self.n_vertices
            )));
        }
        match faces.iter().position(|face| face.iter().any(|&v| v as usize >= self.n_vertices)) {
            None => Ok(()),
            Some(face) => Err(Error::input(format!(
                "{name}: triangle {face} names vertex {}, the training shapes have {} vertices (counted from 0); \
                 give the triangles that the shapes were registered with",
                faces[face].iter().max().copied().unwrap_or(0),
                self.n_vertices
            ))),
        }
    }

    fn not_finite(&self, at: usize) -> Error {
        let (shape, coordinate) = (at / self.shape_len(), at % self.shape_len());
        let (identity, expression) = (shape % self.n_identities, shape / self.n_identities);
        Error::input(format!(
            "the training tensor holds {} at identity {identity}, expression {expression}, vertex {}, axis {} \
             (counted from 0); leave that shape out, or fill it in first",
            self.data[at],
            coordinate / 3,
            ["x", "y", "z"][coordinate % 3]
        ))
    }
}

fn check_sizes(n_identities: usize, n_expressions: usize, n_vertices: usize, len: usize) -> Result<(), Error> {
    if n_identities == 0 || n_expressions == 0 || n_vertices == 0 {
        return Err(Error::input(format!(
            "a training tensor of {n_identities} identities, {n_expressions} expressions and {n_vertices} vertices is \
             empty; every size must be at least 1"
        )));
    }
    let needed = [n_expressions, n_vertices, 3].iter().try_fold(n_identities, |a, &b| a.checked_mul(b));
    if needed != Some(len) {
        return Err(Error::input(format!(
            "a training tensor [{n_identities}, {n_expressions}, {n_vertices}, 3] was announced, {len} numbers were \
             found; the axes must be [identity, expression, vertex, 3]"
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_order_and_storage_order_agree() {
        let (d2, d3, n) = (3, 2, 4);
        let array: Vec<f64> = (0..d2 * d3 * n * 3).map(|x| x as f64).collect();
        let tensor = ShapeTensor::from_array(d2, d3, n, &array).unwrap();
        assert_eq!(tensor.shape(1, 0)[0], (d3 * n * 3) as f64);
        assert_eq!(tensor.shape(0, 1)[0], (n * 3) as f64);
        assert_eq!(tensor.data()[n * 3], tensor.shape(1, 0)[0], "identity is fastest in storage");
        assert_eq!(tensor.to_array(), array);
        let stored = ShapeTensor::from_shapes(d2, d3, n, tensor.data().to_vec()).unwrap();
        assert_eq!(stored, tensor);
    }

    #[test]
    fn nan_is_named_by_identity_expression_and_vertex() {
        let mut array = vec![0.0f32; 3 * 2 * 4 * 3];
        array[(((2 * 2) + 1) * 4 + 3) * 3 + 1] = f32::NAN;
        let said = ShapeTensor::from_array(3, 2, 4, &array).unwrap_err().to_string();
        assert!(said.contains("NaN at identity 2, expression 1, vertex 3, axis y"), "{said}");
    }

    #[test]
    fn sizes_and_templates_that_do_not_fit_are_sentences() {
        assert!(ShapeTensor::from_shapes(0, 2, 4, vec![]).unwrap_err().to_string().contains("is empty"));
        assert!(ShapeTensor::from_shapes(1, 2, 4, vec![0.0; 23]).unwrap_err().to_string().contains("23 numbers"));
        assert!(ShapeTensor::from_shapes(usize::MAX, 2, 4, vec![0.0; 8]).is_err());
        let tensor = ShapeTensor::from_shapes(1, 2, 4, vec![0.0; 24]).unwrap();
        let said = tensor.check_template("head.obj", Some(5), &[]).unwrap_err().to_string();
        assert!(said.contains("head.obj") && said.contains("5 vertices") && said.contains("have 4"), "{said}");
        let said = tensor.check_template("t.npy", None, &[[0, 1, 2], [1, 4, 2]]).unwrap_err().to_string();
        assert!(said.contains("triangle 1 names vertex 4"), "{said}");
        tensor.check_template("t.npy", Some(4), &[[0, 1, 3]]).unwrap();
    }
}
