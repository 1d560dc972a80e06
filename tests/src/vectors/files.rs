//! What model files hold, and what is refused.

use super::models::{Model, Models};
use super::text::File;
use crate::reference::model_file::crc32;
use crate::reference::prior::Gaussian;

pub fn text(models: &Models) -> String {
    let mut file =
        File::new("What model files hold, and what is refused. Patches are pairs of a position and its new byte.");
    for name in ["plain_1", "linear_49", "identity_linear", "pose_linear", "whole"] {
        opened(&mut file, models.named(name));
    }
    refusals(&mut file, models.named("whole"));
    file.text()
}

pub fn opened(file: &mut File, model: &Model) {
    let head = &model.head;
    let [n, di, dp] = [head.n, head.identity_dim, head.pose_dim].map(|count| count as u32);
    let sections = model.sections.iter().flat_map(|section| {
        let mut shape = section.shape.clone();
        shape.resize(4, 1);
        let start = [section.id, u32::from(section.may_ignore), section.element, section.shape.len() as u32];
        start.into_iter().chain(shape).chain([section.bytes.len() as u32]).collect::<Vec<u32>>()
    });
    let mut case = file.case("open", &model.name);
    case.word("model", &model.name)
        .integers("header", [head.kind, n, di, dp, head.flags])
        .integers("sections", sections);
    for (key, gaussian) in [("identity_gaussian", &model.extras.identity), ("pose_gaussian", &model.extras.pose)] {
        if let Some(Gaussian { mean, scale, precision }) = gaussian {
            case.numbers(key, mean.iter().chain(scale).chain(precision.iter().flatten()));
        }
    }
    if !model.extras.landmarks.is_empty() {
        case.integers("landmarks", model.extras.landmarks.iter().copied());
    }
    if !model.extras.faces.is_empty() {
        case.integers("faces", model.extras.faces.iter().flatten().copied());
    }
}

fn refusals(file: &mut File, model: &Model) {
    let length = model.bytes.len();
    for (kept, refusal) in [
        (0, [301, 64, 0]),
        (7, [301, 64, 7]),
        (63, [301, 64, 63]),
        (64, [301, length as u32, 64]),
        (length - 64, [301, length as u32, length as u32 - 64]),
        (length - 1, [301, length as u32, length as u32 - 1]),
        (length + 64, [301, length as u32, length as u32 + 64]),
    ] {
        file.case("open", &format!("kept_{kept}")).word("model", &model.name).integer("length", kept).error(refusal);
    }
    // Damage: every one of these leaves the checksums as they were.
    let place = |id: u32| {
        let position = model.sections.iter().position(|section| section.id == id).expect("a section of the model");
        let entry = 64 + 64 * position;
        let offset: [u8; 8] = model.bytes[entry + 32..entry + 40].try_into().expect("eight bytes");
        (entry, u64::from_le_bytes(offset) as usize)
    };
    let (table_entry, coefficients) = place(1);
    for (name, position, refusal) in [
        ("magic", 1, [302, 0, 0]),
        ("header_length", 12, [305, 12, 0]),
        ("kind", 24, [305, 24, 0]),
        ("unit", 48, [305, 48, 0]),
        ("axes", 52, [305, 52, 0]),
        ("reserved", 56, [305, 56, 0]),
        ("header_crc", 60, [304, 0, 0]),
        ("table", table_entry + 48, [304, 0, 0]),
        ("coefficient", coefficients + 5, [304, 1, 0]),
        ("last_provenance", place(16).1 + model.extras.provenance.len() - 1, [304, 16, 0]),
    ] {
        let value = model.bytes[position] ^ 4;
        patched(file, model, name, &[(position, value)], refusal);
    }
    patched(file, model, "version", &[(8, 2)], [303, 2, 0]);
    // Forgery: the checksums are made to match, so that the meaning is what is refused.
    let (mean_entry, mean) = place(6);
    let (_, landmarks) = place(3);
    let (_, faces) = place(2);
    let (precision_entry, precision) = place(8);
    let nan = f32::NAN.to_le_bytes();
    let float = |at: usize| [0, 1, 2, 3].map(|k| (at + k, nan[k]));
    for (name, changes, refusal) in [
        ("landmark_index", vec![(landmarks + 8, 45)], [309, 3, 2]),
        ("face_index", vec![(faces, 255)], [309, 2, 0]),
        ("nan_mean", float(mean + 4).to_vec(), [309, 6, 1]),
        ("nan_coefficient", float(coefficients + 400).to_vec(), [309, 1, 100]),
        ("asymmetric", vec![(precision + 5, model.bytes[precision + 5] ^ 1)], [309, 8, 1]),
        ("unknown_section", vec![(mean_entry + 1, 1)], [307, 262, 0]),
        ("element_type", vec![(mean_entry + 8, 2)], [306, 6, 0]),
        ("rank", vec![(precision_entry + 12, 1)], [306, 8, 0]),
        ("no_vertices", vec![(32, 0)], [305, 32, 0]),
        ("too_many_weights", vec![(37, 4), (36, 1)], [310, 1025, 1024]),
        ("flags", vec![(44, 4)], [305, 44, 0]),
    ] {
        let forged = forged(model, &changes);
        patched(file, model, name, &forged, refusal);
    }
}

/// The changes, and those of every checksum that they need.
pub fn forged(model: &Model, changes: &[(usize, u8)]) -> Vec<(usize, u8)> {
    let mut bytes = model.bytes.clone();
    for &(position, value) in changes {
        bytes[position] = value;
    }
    let table_end = 64 + 64 * model.sections.len();
    let put = |bytes: &mut [u8], at: usize, value: u32| bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    for (position, section) in model.sections.iter().enumerate() {
        let entry = 64 + 64 * position;
        let offset: [u8; 8] = model.bytes[entry + 32..entry + 40].try_into().expect("eight bytes");
        let offset = u64::from_le_bytes(offset) as usize;
        let crc = crc32(bytes[offset..offset + section.bytes.len()].iter().copied());
        put(&mut bytes, entry + 48, crc);
    }
    let crc = crc32(bytes[..60].iter().chain(&bytes[64..table_end]).copied());
    put(&mut bytes, 60, crc);
    let differs = |&k: &usize| bytes[k] != model.bytes[k];
    (0..bytes.len()).filter(differs).map(|k| (k, bytes[k])).collect()
}

pub fn patched(file: &mut File, model: &Model, name: &str, patch: &[(usize, u8)], refusal: [u32; 3]) {
    let words = patch.iter().flat_map(|(position, value)| [position.to_string(), format!("{value:02x}")]);
    file.case("open", name).word("model", &model.name).words("patch", words).error(refusal);
}
