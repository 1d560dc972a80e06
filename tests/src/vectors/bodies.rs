//! Linear and skinned models, and those in half precision and bytes: all that is asked of bilinear ones.

use super::files::{forged, opened, patched};
use super::fit::{Kind, Order, few_fits, normal_equations};
use super::generator::{batch, evaluate, gradient, linearised_block, linearised_vertex, prepared, start, weights};
use super::models::{Model, Models};
use super::text::File;
use crate::reference::normal_equations::Frame;

pub fn text(models: &Models) -> String {
    let mut file = File::new("Linear and skinned models in every storage, bilinear ones in half precision and bytes.");
    for model in models.bodies() {
        evaluate(&mut file, model);
        linearised_vertex(&mut file, model, model.generator.n() / 2);
    }
    for name in [
        "components_17_i8",
        "components_16_f16",
        "components_17_f32",
        "body_1",
        "body_15_dual",
        "body_16_i8",
        "body_17",
        "body_17_still_dual_f16",
        "body_33_still_i8",
        "body_33_dual_i8",
        "corrected_16",
        "corrected_17_f16",
        "corrected_17_dual_i8",
        "bilinear_15_i8",
        "bilinear_17_f16",
        "bilinear_33_i8",
    ] {
        let model = models.named(name);
        // The last block, which is full, wants a vertex, or has a single one.
        linearised_block(&mut file, model, (model.generator.n() - 1) / 16);
        if model.generator.n() == 33 {
            linearised_block(&mut file, model, 1);
        }
    }
    for (name, from, to) in [
        ("body_1", 0, 1),
        ("body_16_i8", 0, 1),
        ("body_17_still_dual_f16", 1, 2),
        ("body_33_dual_i8", 1, 2),
        ("corrected_16", 0, 1),
        ("corrected_17_f16", 1, 2),
        ("corrected_17_dual_i8", 0, 2),
        ("bilinear_15_i8", 0, 1),
        ("bilinear_17_f16", 1, 2),
    ] {
        for identity_fixed in [true, false] {
            prepared(&mut file, models.named(name), identity_fixed, from, to);
        }
    }
    for name in [
        "components_17_i8",
        "body_1",
        "body_16_i8",
        "body_17",
        "body_33_still_i8",
        "body_17_still_dual_f16",
        "corrected_17_f16",
        "bilinear_17_f16",
        "linear_17",
    ] {
        gradient(&mut file, models.named(name));
    }
    for (name, from, to) in [
        ("components_17_f32", 0, 17),
        ("components_33_i8", 15, 33),
        ("body_17", 3, 17),
        ("corrected_17_dual_i8", 0, 16),
        ("bilinear_17_f16", 16, 17),
        ("plain_17", 0, 17),
    ] {
        batch(&mut file, models.named(name), from, to);
    }
    for (name, kind, frame) in [
        ("components_33_i8", Kind::Mixed, Frame::Similarity),
        ("components_16_f16", Kind::Barycentric, Frame::Rigid),
        ("body_17", Kind::Mixed, Frame::Similarity),
        ("body_33_dual_i8", Kind::Normals, Frame::Rigid),
        ("corrected_17_dual_i8", Kind::Barycentric, Frame::Fixed),
        ("bilinear_33_i8", Kind::Mixed, Frame::Rigid),
    ] {
        normal_equations(&mut file, models.named(name), 9, kind, Order::Runs, frame);
    }
    few_fits(&mut file, models.named("components_whole"));
    few_fits(&mut file, models.named("body_whole"));
    for name in ["components_33_i8", "components_16_f16", "body_17", "corrected_17_dual_i8", "body_whole"] {
        opened(&mut file, models.named(name));
    }
    refusals(&mut file, models);
    file.text()
}

fn refusals(file: &mut File, models: &Models) {
    let body = models.named("body_17");
    let (x, y) = weights(body);
    let nan = [y[0], f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let all = [0, 17];
    for (what, x, y, ranges, refusal) in [
        ("short_identity", &x[..1], &y[..], all, [101, 2, 1]),
        ("short_pose", &x[..], &y[..8], all, [101, 9, 8]),
        ("nan", &x[..], &nan[..], all, [103, 3, 0]),
        ("beyond", &x[..], &y[..], [3, 18], [102, 18, 17]),
        ("reversed", &x[..], &y[..], [9, 4], [102, 9, 17]),
    ] {
        start(file, "evaluate", body, what, x, y).integers("ranges", ranges).error(refusal);
    }
    for (model, what, fixed, y, to, refusal) in [
        (body, "identity_beyond", "identity", &y[..], 3, [102, 3, 2]),
        (body, "pose_beyond", "pose", &y[..], 3, [102, 3, 2]),
        (body, "pose_nan", "pose", &nan[..], 2, [103, 3, 0]),
        (body, "pose_short", "pose", &y[..5], 2, [101, 9, 5]),
        (models.named("components_17_f32"), "one_mode", "pose", &[][..], 2, [502, 1, 2]),
    ] {
        start(file, "prepared", model, what, &x, y)
            .word("fixed", fixed)
            .integer("from", 0)
            .integer("to", to)
            .error(refusal);
    }
    // Where a section lies in the file.
    let place = |model: &Model, id: u32| {
        let position = model.sections.iter().position(|section| section.id == id).expect("a section of the model");
        let entry = 64 + 64 * position;
        let offset: [u8; 8] = model.bytes[entry + 32..entry + 40].try_into().expect("eight bytes");
        u64::from_le_bytes(offset) as usize
    };
    let half = [models.named("components_16_f16"), models.named("components_17_i8")];
    for (model, name, id, at, bytes, refusal) in [
        (body, "parent_behind", 21, 4, 1u32.to_le_bytes(), [309, 21, 1]),
        (body, "axis_too_long", 22, 12, 1.5f32.to_le_bytes(), [309, 22, 3]),
        (body, "another_ball", 22, 12, 0f32.to_le_bytes(), [309, 22, 15]),
        (body, "position", 23, 8, f32::NAN.to_le_bytes(), [309, 23, 2]),
        (body, "basis", 24, 4, f32::INFINITY.to_le_bytes(), [309, 24, 1]),
        (body, "no_such_joint", 27, 4, 5u32.to_le_bytes(), [309, 27, 1]),
        (body, "joints_descend", 27, 4, 0u32.to_le_bytes(), [309, 27, 1]),
        (body, "negative_weight", 28, 4, (-0.5f32).to_le_bytes(), [309, 28, 1]),
        (body, "weights_do_not_sum", 28, 8, 0f32.to_le_bytes(), [309, 28, 2]),
        (body, "weight_of_padding", 28, 4 * 16 * 2 + 8, 1f32.to_le_bytes(), [309, 28, 34]),
        (half[0], "infinite_half", 1, 4, [0, 0x7c, 0, 0], [309, 1, 2]),
        (half[1], "wide_range", 19, 4, 1e11f32.to_le_bytes(), [309, 19, 1]),
    ] {
        let at = place(model, id) + at;
        let changes: Vec<(usize, u8)> = bytes.iter().enumerate().map(|(k, &byte)| (at + k, byte)).collect();
        patched(file, model, name, &forged(model, &changes), refusal);
    }
}
