//! Normals, colours and attributes of vertices that are merged.

use crate::mesh::{Mesh, Scalar, unit};

pub(super) struct Values {
    normals: Vec<[f64; 3]>,
    /// Not rounded before the end.
    colours: Vec<[f64; 3]>,
    /// With whether the values may be mixed.
    attributes: Vec<(bool, Vec<f64>)>,
}

impl Values {
    pub fn new(mesh: &Mesh) -> Self {
        let may_mix = |scalar| matches!(scalar, Scalar::F32 | Scalar::F64);
        Values {
            normals: mesh.normals.clone(),
            colours: mesh.colours.iter().map(|colour| colour.map(f64::from)).collect(),
            attributes: mesh.attributes.iter().map(|a| (may_mix(a.scalar), a.values.clone())).collect(),
        }
    }

    /// Gives `u` the values at this part of the way from `u` to `v`.
    pub fn mix(&mut self, u: usize, v: usize, part: f64) {
        let between = |a: f64, b: f64| (1.0 - part) * a + part * b;
        for vectors in [&mut self.normals, &mut self.colours] {
            if !vectors.is_empty() {
                vectors[u] = std::array::from_fn(|axis| between(vectors[u][axis], vectors[v][axis]));
            }
        }
        for (may_mix, values) in &mut self.attributes {
            values[u] = match may_mix {
                true => between(values[u], values[v]),
                false => values[if part > 0.5 { v } else { u }],
            };
        }
    }

    /// Writes the values of the kept vertices into their mesh.
    pub fn write(&self, mesh: &mut Mesh, kept: &[u32]) {
        let kept = || kept.iter().map(|&vertex| vertex as usize);
        for (normal, vertex) in mesh.normals.iter_mut().zip(kept()) {
            // One that was not mixed keeps its bits.
            if *normal != self.normals[vertex] {
                *normal = unit(self.normals[vertex]);
            }
        }
        for (colour, vertex) in mesh.colours.iter_mut().zip(kept()) {
            *colour = self.colours[vertex].map(|channel| channel.round().clamp(0.0, 255.0) as u8);
        }
        for (attribute, (_, values)) in mesh.attributes.iter_mut().zip(&self.attributes) {
            let stored = |value: f64| if attribute.scalar == Scalar::F32 { f64::from(value as f32) } else { value };
            attribute.values = kept().map(|vertex| stored(values[vertex])).collect();
        }
    }
}
