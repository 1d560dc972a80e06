//! A body model: GPA and PCA of the 400 shared bodies as they are given, with the shipped rig of 31 bones and its joint regressor.

use std::path::Path;

use habitus::Error;
use habitus::io::model::{Coefficients, JointSource, LinearForm, ModePrior, ModelSource, SkinSource, hab};
use habitus::io::npy;
use habitus::register::gpa::{GpaOptions, align_in_place};
use nalgebra::{DMatrix, SymmetricEigen};

/// The shipped rig.
pub struct Rig {
    /// Parent of each bone, parents first.
    pub parents: Vec<Option<usize>>,
    /// Name of each bone.
    pub names: Vec<String>,
    /// For each vertex the bones and weights that hold it.
    pub weights: Vec<Vec<(usize, f64)>>,
    /// Joint `row` takes `value` of vertex `column`.
    pub regressor: Vec<(usize, usize, f64)>,
    /// Triangles of the small mesh.
    pub faces: Vec<[u32; 3]>,
    /// Landmarks by name.
    pub landmarks: Vec<(String, u32)>,
}

impl Rig {
    /// Reads it from the shared data.
    ///
    /// # Errors
    /// When a file cannot be read.
    pub fn read(data: &Path) -> Result<Self, Error> {
        let folder = data.join("bodies/model");
        let text = std::fs::read_to_string(folder.join("model.json")).map_err(|e| Error::Internal(e.to_string()))?;
        let json: serde_json::Value = serde_json::from_str(&text).map_err(|e| Error::Internal(e.to_string()))?;
        let joints = json["joints"].as_array().cloned().unwrap_or_default();
        let parents =
            joints.iter().map(|joint| joint["parent"].as_i64().and_then(|p| usize::try_from(p).ok())).collect();
        let names = joints.iter().map(|joint| joint["name"].as_str().unwrap_or_default().to_owned()).collect();
        let (_, index) = npy::read_u32(folder.join("dec_weight_index.npy"))?;
        let (_, value) = npy::read_f64(folder.join("dec_weight_value.npy"))?;
        let weights = index.chunks(4).zip(value.chunks(4));
        let weights = weights.map(|(index, value)| {
            let all = index.iter().zip(value).filter(|(_, value)| **value > 0.0);
            all.map(|(&bone, &value)| (bone as usize, value)).collect()
        });
        let (_, row) = npy::read_u32(folder.join("dec_joint_regressor_row.npy"))?;
        let (_, column) = npy::read_u32(folder.join("dec_joint_regressor_col.npy"))?;
        let (_, value) = npy::read_f64(folder.join("dec_joint_regressor_val.npy"))?;
        let regressor = row.iter().zip(&column).zip(&value).map(|((r, c), v)| (*r as usize, *c as usize, *v)).collect();
        let (_, faces) = npy::read_u32(folder.join("dec_triangles.npy"))?;
        let landmarks = json["landmarks_dec"].as_object().into_iter().flatten();
        let landmarks = landmarks.map(|(name, vertex)| (name.clone(), vertex.as_u64().unwrap_or(0) as u32)).collect();
        let faces = faces.as_chunks::<3>().0.to_vec();
        Ok(Rig { parents, names, weights: weights.collect(), regressor, faces, landmarks })
    }

    /// Positions of the joints in a shape.
    pub fn joints(&self, shape: &[f64]) -> Vec<[f64; 3]> {
        let mut joints = vec![[0.0; 3]; self.parents.len()];
        for &(joint, vertex, value) in &self.regressor {
            (0..3).for_each(|axis| joints[joint][axis] += value * shape[3 * vertex + axis]);
        }
        joints
    }
}

/// A mean shape and principal components one standard deviation long.
pub struct Pca {
    /// Mean, mm.
    pub mean: Vec<f64>,
    /// Components, one after another, mm.
    pub components: Vec<f64>,
    /// Variances, all of them, mm^2.
    pub variances: Vec<f64>,
}

/// GPA and PCA of the shared training bodies.
///
/// # Errors
/// When the file cannot be read.
pub fn pca(data: &Path, dim: usize) -> Result<Pca, Error> {
    let (shape, mut bodies) = npy::read_f64(data.join("bodies/train_vertices_i16.npy"))?;
    let (count, len) = (shape[0], 3 * shape[1]);
    for (k, value) in bodies.iter_mut().enumerate() {
        *value = *value * 0.05 + if k % 3 == 1 { 1000.0 } else { 0.0 };
    }
    let mean = align_in_place(&mut bodies, len, &GpaOptions::default())?.mean;
    for body in bodies.chunks_mut(len) {
        body.iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
    }
    let centred = DMatrix::from_column_slice(len, count, &bodies);
    let gram = centred.transpose() * &centred / (count - 1) as f64;
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut components = Vec::with_capacity(dim * len);
    for &k in order.iter().take(dim) {
        // The image of a unit vector of the Gram matrix has the length of sqrt((count - 1) lambda).
        let column = &centred * eigen.eigenvectors.column(k) / ((count - 1) as f64).sqrt();
        let largest = column.iter().copied().fold(0.0f64, |a, b| if b.abs() > a.abs() { b } else { a });
        components.extend(column.iter().map(|value| value * largest.signum()));
    }
    let variances = order.iter().map(|&k| eigen.eigenvalues[k].max(0.0)).collect();
    Ok(Pca { mean, components, variances })
}

/// The model file: `dim` components, 31 balls, weights whitened.
///
/// # Errors
/// When the data cannot be read, or on a fault of the writer.
pub fn file(data: &Path, dim: usize) -> Result<Vec<u8>, Error> {
    let (rig, pca) = (Rig::read(data)?, pca(data, dim)?);
    let len = pca.mean.len();
    let bases: Vec<Vec<[f64; 3]>> = pca.components.chunks(len).map(|component| rig.joints(component)).collect();
    let joints = rig.joints(&pca.mean).into_iter().enumerate().map(|(joint, position)| JointSource {
        name: rig.names[joint].clone(),
        parent: rig.parents[joint],
        axis: None,
        position,
        basis: bases.iter().map(|basis| basis[joint]).collect(),
    });
    let joints: Vec<JointSource> = joints.collect();
    let angles = 3 * joints.len();
    let limit = std::f64::consts::PI;
    let skin = SkinSource {
        joints,
        weights: rig.weights,
        bounds: Some((vec![-limit; angles], vec![limit; angles])),
        dual_quaternion: false,
    };
    let form = LinearForm { mean: &pca.mean, components: &pca.components };
    let mut source = ModelSource::new(Coefficients::Skinned(form, &[], &skin));
    source.faces = rig.faces;
    source.landmarks = rig.landmarks.iter().map(|(_, vertex)| *vertex).collect();
    source.landmark_names = rig.landmarks.into_iter().map(|(name, _)| name).collect();
    let identity = |d: usize| (0..d * d).map(|k| f64::from(u8::from(k % (d + 1) == 0))).collect();
    source.identity_prior = ModePrior { mean: vec![0.0; dim], scale: vec![1.0; dim], precision: identity(dim) };
    source.identity_spectrum = pca.variances;
    source.provenance =
        "GPA and PCA of 400 bodies of the MakeHuman shape space (CC0), as given; the MPFB rig of 31 bones (CC0); \
        a developer's model, not posture normalised"
            .into();
    hab::bytes(&source)
}
