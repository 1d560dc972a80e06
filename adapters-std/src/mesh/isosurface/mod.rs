//! The surface on which a sampled field has a given value (marching cubes, `lorensen1987`, with cases that fit together).
//!
//! Vertices lie on the edges of the grid. Where all samples are known the surface is a manifold without boundary but at
//! the grid's border: each crossed edge is used once by each of its four cubes, neighbouring cubes cut their common face
//! alike, and no inner edge of a cube's part lies in a face, so that every edge has two triangles and the triangles at a
//! vertex form one ring.

mod cases;

use rayon::prelude::*;

use super::{Mesh, field::Field};
use crate::Error;
use cases::{CASES, SIDES, Side};

/// Vertices keep this part of an edge away from its ends, so that no triangle degenerates where a sample has the value
/// of the surface exactly, or nearly.
const END: f64 = 1.0 / 256.0;
/// The four cubes around an edge, in order, as steps back on the two other axes.
const AROUND: [[usize; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

/// What happens to a surface that reaches the border of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Border {
    /// It ends there.
    #[default]
    Open,
    /// It is closed by flat caps 1/256 of the spacing outside the grid, as if all beyond lay outside.
    Closed,
}

/// The surface on which the field takes the value `level`, with its outside where the field is larger.
///
/// A sample that has the value exactly counts as outside. Along an edge of the grid the field is taken as linear; a vertex
/// keeps at least 1/256 of the spacing away from the samples, so all triangles have positive areas and angles. Cubes with an
/// unknown (NaN) corner are left out: the surface has a boundary there, and stays a manifold. Next to an infinite value the
/// vertex is at the finite end of the edge.
/// A surface that is not reached by any cube gives a mesh without vertices.
///
/// Source: `lorensen1987`; the 256 cases are derived so that the surface is closed and a manifold.
///
/// Cost: linear in the samples, parallel; 8 bytes per vertex beside the result. Determinism: vertices and faces are in
/// the order of the grid, whatever the number of threads.
///
/// # Errors
/// Those of [`Field::check`]; [`Error::Input`] for a level that is not finite or a surface of 2^32 vertices or more.
pub fn isosurface(field: &Field, level: f64, border: Border) -> Result<Mesh, Error> {
    field.check()?;
    if !level.is_finite() {
        return Err(Error::input(format!("an isosurface at the value {level}: give a finite one")));
    }
    let cubes = Cubes::new(field, level, border);
    let [_, _, nz] = cubes.size;
    let layers: Vec<Layer> = (0..nz).into_par_iter().map(|k| cubes.layer(k)).collect();
    let mut starts = vec![0usize];
    layers.iter().for_each(|layer| starts.push(starts[starts.len() - 1] + layer.keys.len()));
    if u32::try_from(starts[nz]).is_err() {
        return Err(Error::input(format!("an isosurface of {} vertices: make the spacing wider", starts[nz])));
    }
    let faces: Vec<Vec<[u32; 3]>> = (0..nz - 1)
        .into_par_iter()
        .map(|k| {
            let vertex = |sample: [usize; 3], key: usize| {
                let found = layers[sample[2]].keys.binary_search(&key).unwrap_or_default();
                (starts[sample[2]] + found) as u32
            };
            cubes.faces(k, vertex)
        })
        .collect();
    let positions = layers.into_iter().flat_map(|layer| layer.positions).collect();
    Ok(Mesh { positions, faces: faces.concat(), ..Mesh::default() })
}

/// The vertices on the edges that start in one layer of samples.
struct Layer {
    /// Ascending; see [`Cubes::key`].
    keys: Vec<usize>,
    positions: Vec<[f64; 3]>,
}

/// The field, with one more layer of outside samples all around where the border is closed.
struct Cubes<'a> {
    field: &'a Field,
    level: f64,
    pad: usize,
    /// Number of samples on each axis, with the padding.
    size: [usize; 3],
    has_unknown: bool,
}

impl<'a> Cubes<'a> {
    fn new(field: &'a Field, level: f64, border: Border) -> Self {
        let pad = usize::from(border == Border::Closed);
        let has_unknown = field.values.par_iter().any(|value| value.is_nan());
        Cubes { field, level, pad, size: field.grid.size.map(|n| n + 2 * pad), has_unknown }
    }

    fn value(&self, sample: [usize; 3]) -> f64 {
        let size = self.field.grid.size;
        let inner = sample.map(|n| n.wrapping_sub(self.pad));
        if (0..3).any(|axis| inner[axis] >= size[axis]) {
            return f64::INFINITY;
        }
        self.field.values[self.field.grid.index(inner)]
    }

    fn is_inside(&self, sample: [usize; 3]) -> bool {
        self.value(sample) < self.level
    }

    fn is_known(&self, cube: [usize; 3]) -> bool {
        (0..3).all(|axis| cube[axis] + 1 < self.size[axis])
            && (!self.has_unknown || (0..8).all(|corner| !self.value(corner_of(cube, corner)).is_nan()))
    }

    /// Which of the four cubes around an edge are known, a bit each.
    fn known_around(&self, sample: [usize; 3], axis: usize) -> usize {
        let known = |steps: [usize; 2]| {
            let mut cube = sample;
            for (other, step) in [(axis + 1) % 3, (axis + 2) % 3].into_iter().zip(steps) {
                match cube[other].checked_sub(step) {
                    Some(n) => cube[other] = n,
                    None => return false,
                }
            }
            self.is_known(cube)
        };
        AROUND.iter().enumerate().map(|(bit, &steps)| usize::from(known(steps)) << bit).sum()
    }

    /// The key of a vertex: its edge, twice. Of two known cubes that meet in nothing but the edge, the second uses a vertex
    /// of its own, whose key is larger by 1; else the surface would touch itself there.
    fn key(&self, sample: [usize; 3], axis: usize, second: bool) -> usize {
        let [i, j, k] = sample;
        (((k * self.size[1] + j) * self.size[0] + i) * 3 + axis) * 2 + usize::from(second)
    }

    fn layer(&self, k: usize) -> Layer {
        let mut layer = Layer { keys: Vec::new(), positions: Vec::new() };
        for (j, i) in (0..self.size[1]).flat_map(|j| (0..self.size[0]).map(move |i| (j, i))) {
            let sample = [i, j, k];
            let value = self.value(sample);
            for axis in 0..3 {
                let mut end = sample;
                end[axis] += 1;
                if end[axis] >= self.size[axis] {
                    continue;
                }
                let end = self.value(end);
                if (value < self.level) == (end < self.level) || value.is_nan() || end.is_nan() {
                    continue;
                }
                let known = self.known_around(sample, axis);
                let n_vertices = if known == 0b0101 || known == 0b1010 { 2 } else { usize::from(known != 0) };
                for second in 0..n_vertices {
                    layer.keys.push(self.key(sample, axis, second == 1));
                    layer.positions.push(self.crossing(sample, axis, value, end));
                }
            }
        }
        layer
    }

    fn crossing(&self, sample: [usize; 3], axis: usize, value: f64, end: f64) -> [f64; 3] {
        let part = match (value.is_finite(), end.is_finite()) {
            (true, true) => {
                let mut part = (self.level - value) / (end - value);
                if !part.is_finite() {
                    // Differences of halves do not overflow.
                    part = (0.5 * self.level - 0.5 * value) / (0.5 * end - 0.5 * value);
                }
                part.clamp(END, 1.0 - END)
            }
            (true, false) => END,
            (false, true) => 1.0 - END,
            (false, false) => 0.5,
        };
        let (origin, spacing) = (self.field.grid.origin, self.field.grid.spacing);
        std::array::from_fn(|a| {
            let steps = sample[a] as f64 - self.pad as f64 + if a == axis { part } else { 0.0 };
            origin[a] + steps * spacing
        })
    }

    fn faces(&self, k: usize, vertex: impl Fn([usize; 3], usize) -> u32) -> Vec<[u32; 3]> {
        let mut faces = Vec::new();
        for (j, i) in (0..self.size[1] - 1).flat_map(|j| (0..self.size[0] - 1).map(move |i| (j, i))) {
            let cube = [i, j, k];
            let inside: usize =
                (0..8).map(|corner| usize::from(self.is_inside(corner_of(cube, corner))) << corner).sum();
            if inside == 0 || inside == 255 || !self.is_known(cube) {
                continue;
            }
            let vertex_on = |side: u8| {
                let Side { axis, base } = SIDES[usize::from(side)];
                let sample = corner_of(cube, base);
                let second = self.has_unknown && self.is_second(sample, axis, base);
                vertex(sample, self.key(sample, axis, second))
            };
            faces.extend(CASES[inside].iter().map(|sides| sides.map(vertex_on)));
        }
        faces
    }

    /// Whether the cube in which the edge starts at corner `base` uses the second vertex of the edge.
    fn is_second(&self, sample: [usize; 3], axis: usize, base: usize) -> bool {
        let steps = [(axis + 1) % 3, (axis + 2) % 3].map(|other| base >> other & 1);
        let known = self.known_around(sample, axis);
        let place = AROUND.iter().position(|&around| around == steps).unwrap_or_default();
        (known == 0b0101 || known == 0b1010) && place >= 2
    }
}

fn corner_of(cube: [usize; 3], corner: usize) -> [usize; 3] {
    std::array::from_fn(|axis| cube[axis] + (corner >> axis & 1))
}

#[cfg(test)]
mod tests;
