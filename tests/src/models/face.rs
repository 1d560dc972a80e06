//! A multilinear face model: 30 + 7 weights of the shared face tensor, aligned as a group, with its thirteen landmarks.

use std::path::Path;

use habitus::Error;
use habitus::face::hosvd::{HosvdOptions, ModeSize, hosvd};
use habitus::face::training_data::{Template, tensor};
use habitus::io::model::{ModelSource, hab};
use habitus::register::gpa::{GpaOptions, align_in_place};

/// The model file.
///
/// # Errors
/// When the data cannot be read, or on a fault of training or of the writer.
pub fn file(data: &Path) -> Result<Vec<u8>, Error> {
    let folder = data.join("faces");
    let mut shapes = tensor(&folder.join("tensor_train.npy"))?;
    let (triangles, landmarks) = (folder.join("dec_triangles.npy"), folder.join("dec.json"));
    let template = Template::read(&shapes, Some(&triangles), Some(&landmarks), None)?;
    let len = shapes.shape_len();
    align_in_place(shapes.data_mut(), len, &GpaOptions::default())?;
    let options = HosvdOptions { identity: ModeSize::Dimension(30), expression: ModeSize::Dimension(7), hooi: None };
    let model = hosvd(&shapes, &options)?.model;
    let mut source = ModelSource::of_multilinear(&model);
    source.faces = template.faces;
    source.landmarks = template.landmarks;
    source.landmark_names = template.landmark_names;
    source.provenance = "multilinear model of the shared face tensor; a developer's model".into();
    hab::bytes(&source)
}
