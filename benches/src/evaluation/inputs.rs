//! Deterministic inputs of the rows of evaluation, for us and for the peers.

use std::error::Error;
use std::io::Write;

use habitus_core::format::Model;
use habitus_core::wavelet::Grid;
use habitus_tests::models::body::{Pca, Rig};

use crate::workload::noise;

/// Deterministic inputs of both sides.
pub struct Inputs {
    floats: Vec<Vec<f32>>,
    integers: Vec<Vec<i32>>,
    /// Identity weights of the body.
    pub identity: Vec<f32>,
    /// Angles of the body.
    pub pose: Vec<f32>,
    /// Coefficients of both grids, in planes.
    pub wavelets: [Vec<f32>; 2],
    /// Points to be aligned, xyz.
    pub points: Vec<f32>,
}

impl Inputs {
    /// Of the rig, the components and the model file of the body.
    ///
    /// # Errors
    /// When the file is no model.
    pub fn new(rig: &Rig, pca: &Pca, file: &[u8]) -> Result<Self, Box<dyn Error>> {
        let (len, joints) = (pca.mean.len(), rig.parents.len());
        let single = |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<f32>>();
        let transposed = |columns: &[Vec<f64>], len: usize| -> Vec<f32> {
            (0..len).flat_map(|row| columns.iter().map(move |column| column[row] as f32)).collect()
        };
        let components: Vec<Vec<f64>> = pca.components.chunks(len).map(<[f64]>::to_vec).collect();
        let slopes: Vec<Vec<f64>> =
            components.iter().map(|component| rig.joints(component).into_iter().flatten().collect()).collect();
        let place: Vec<f64> = rig.joints(&pca.mean).into_iter().flatten().collect();
        let (mut held, mut weight) = (Vec::new(), Vec::new());
        for vertex in &rig.weights {
            let sum: f64 = vertex.iter().map(|(_, value)| value).sum();
            for k in 0..4 {
                let (bone, value) = vertex.get(k).copied().unwrap_or((0, 0.0));
                held.push(bone as i32);
                weight.push((value / sum) as f32);
            }
        }
        let identity: Vec<f32> = (0..100).map(|k| noise(3_000_000 + k)).collect();
        let pose: Vec<f32> = (0..3 * joints).map(|k| 0.3 * noise(4_000_000 + k)).collect();
        let model = Model::open(file)?;
        let section = |id: u32| model.sections().find(id).map(|section| section.bytes.to_vec()).unwrap_or_default();
        let words = |bytes: Vec<u8>| bytes.as_chunks::<4>().0.iter().map(|raw| i32::from_le_bytes(*raw)).collect();
        let block_weights = section(28).as_chunks::<4>().0.iter().map(|raw| f32::from_le_bytes(*raw)).collect();
        let parents = rig.parents.iter().map(|parent| parent.map_or(-1, |parent| parent as i32)).collect();
        let floats = vec![
            single(&pca.mean),
            transposed(&components, len),
            single(&place),
            transposed(&slopes, 3 * joints),
            weight,
            identity.clone(),
            pose.clone(),
            block_weights,
        ];
        let wavelets = [5usize, 6].map(|levels| {
            let count = ((4 << levels) + 1) * ((6 << levels) + 1);
            (0..3 * count).map(|k| noise(5_000_000 + k)).collect()
        });
        let points = (0..3 * 26719).map(|k| 100.0 * noise(6_000_000 + k)).collect();
        Ok(Inputs {
            floats,
            integers: vec![parents, held, words(section(26)), words(section(27))],
            identity,
            pose,
            wavelets,
            points,
        })
    }

    /// As the peers read them; wavelets as (height, width, 3), then in planes.
    ///
    /// # Panics
    /// Never: the grids are valid.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let mut put = |count: usize, bytes: Vec<u8>| {
            let _ = out.write_all(&(count as u64).to_le_bytes());
            let _ = out.write_all(&bytes);
        };
        for floats in &self.floats {
            put(floats.len(), floats.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        for integers in &self.integers {
            put(integers.len(), integers.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        for (levels, planes) in [5, 6].into_iter().zip(&self.wavelets) {
            let in_place = self.interleaved(levels, planes);
            put(in_place.len(), in_place.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        for planes in &self.wavelets {
            put(planes.len(), planes.iter().flat_map(|value| value.to_le_bytes()).collect());
        }
        put(self.points.len(), self.points.iter().flat_map(|value| value.to_le_bytes()).collect());
        out
    }

    /// Coefficients level by level in planes, brought to their nodes.
    fn interleaved(&self, levels: usize, planes: &[f32]) -> Vec<f32> {
        let grid = Grid::new(5, 7, levels).expect("a grid");
        let count = grid.len();
        let mut out = vec![0.0; 3 * count];
        for coefficient in 0..count {
            let node = grid.node_of(coefficient).expect("a node");
            let at = node.row * ((4 << levels) + 1) + node.column;
            (0..3).for_each(|axis| out[3 * at + axis] = planes[axis * count + coefficient]);
        }
        out
    }
}
