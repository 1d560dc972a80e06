//! Step 6 of the specification: shapes that agree with the header, indices below their counts, numbers within their limits, texts.

use super::header::{Header, Kind};
use super::limits;
use super::model::Model;
use super::section::{ElementType, Section, SectionId};
use super::view::{Floats, Indices};
use super::{content_skin, header::u32_at};
use crate::Error;
use crate::generator::LANES;
use crate::generator::skinned::CORRECTIONS;
use crate::workspace::saturated;

/// `Ok` when every section means something.
pub(super) fn check(model: &Model<'_>) -> Result<(), Error> {
    let coefficients = model.required(SectionId::Coefficients)?;
    for section in model.sections().iter() {
        if let Some(id) = SectionId::from_u32(section.id) {
            check_section(model, id, &section)?;
        }
    }
    let header = model.header();
    let wavelet = header.kind == Kind::Wavelet;
    for group in [
        &[SectionId::IdentityMean, SectionId::IdentityScale, SectionId::IdentityPrecision][..],
        &[SectionId::PoseMean, SectionId::PoseScale, SectionId::PosePrecision],
        &[SectionId::PoseLower, SectionId::PoseUpper],
    ] {
        if group.iter().any(|&id| model.known(id).is_some()) {
            // The weights of a wavelet model are too many for a matrix.
            for &id in group.iter().take(if wavelet { 2 } else { 3 }) {
                model.required(id)?;
            }
        }
    }
    for (named, names) in
        [(SectionId::Landmarks, SectionId::LandmarkNames), (SectionId::PoseStarts, SectionId::PoseNames)]
    {
        if model.known(names).is_some() {
            model.required(named)?;
        }
    }
    match coefficients.element {
        ElementType::I8 => {
            model.required(SectionId::Offsets)?;
            model.required(SectionId::Ranges)?;
        }
        ElementType::F16 => {
            model.required(SectionId::Offsets)?;
        }
        _ => {}
    }
    match header.kind {
        Kind::Skinned => content_skin::check(model),
        Kind::Wavelet => model.required(SectionId::Grid).map(|_| ()),
        Kind::Bilinear | Kind::Linear => Ok(()),
    }
}

/// Terms of a block of coefficients, the corrective ones of a skinned model included.
fn n_terms(model: &Model<'_>) -> usize {
    let header = model.header();
    let joints = model.known(SectionId::JointParents).map_or(0, |section| section.shape[0] as usize);
    let corrections = if header.kind == Kind::Skinned && header.pose_linear { joints } else { 0 };
    header.n_terms().saturating_add(corrections.saturating_mul(CORRECTIONS))
}

/// Whether a section belongs to models of this kind.
fn belongs(id: SectionId, kind: Kind) -> bool {
    use SectionId as Id;
    match id {
        Id::JointParents
        | Id::JointAxes
        | Id::JointPositions
        | Id::JointBasis
        | Id::JointNames
        | Id::SkinStarts
        | Id::SkinJoints
        | Id::SkinWeights
        | Id::PoseLower
        | Id::PoseUpper => kind == Kind::Skinned,
        Id::Grid => kind == Kind::Wavelet,
        Id::PoseMean | Id::PoseScale => kind != Kind::Linear,
        Id::PosePrecision | Id::PoseStarts | Id::PoseNames => matches!(kind, Kind::Bilinear | Kind::Skinned),
        Id::IdentityPrecision => kind != Kind::Wavelet,
        _ => true,
    }
}

fn check_section(model: &Model<'_>, id: SectionId, section: &Section<'_>) -> Result<(), Error> {
    let header = model.header();
    let wrong = Error::BadSection { section: section.id };
    let (element, rank) = id.form();
    let stored = id == SectionId::Coefficients && matches!(section.element, ElementType::F16 | ElementType::I8);
    if !(section.element == element || stored) || section.rank != rank || !belongs(id, header.kind) {
        return Err(wrong);
    }
    if !shape_fits(model, id, section) {
        return Err(wrong);
    }
    let bad = |index: usize| Error::BadContent { section: section.id, index: saturated(index) };
    first_wrong(model, id, section).map_or(Ok(()), |index| Err(bad(index)))
}

/// Whether a section has the shape that the header asks for.
fn shape_fits(model: &Model<'_>, id: SectionId, section: &Section<'_>) -> bool {
    let header = model.header();
    let [first, second, third, fourth] = section.shape;
    let axes = section.shape.map(|axis| axis as usize);
    // A wavelet model has so many weights for each coefficient.
    let each = if header.kind == Kind::Wavelet { header.n_vertices as usize } else { 1 };
    let identity = (header.identity_dim as usize).saturating_mul(each);
    let pose = (header.pose_dim as usize).saturating_mul(each);
    let apart = n_terms(model).saturating_sub(1);
    let (blocks, joints) = (header.n_blocks(), model.known(SectionId::JointParents).map_or(0, |s| s.shape[0]));
    match id {
        SectionId::Coefficients if section.element == ElementType::F32 => axes == [blocks, n_terms(model), 3, LANES],
        SectionId::Coefficients => axes == [blocks, apart, 3, LANES],
        SectionId::Offsets => axes == [blocks, 3, LANES, 1],
        SectionId::Ranges => axes == [blocks, apart, 3, 2],
        SectionId::QuantisationError => first == 3,
        SectionId::Remainder => second == header.n_vertices && third == 3 && first <= limits::MAX_ROWS,
        SectionId::Faces => second == 3 && first <= limits::MAX_FACES,
        SectionId::Landmarks => first <= limits::MAX_LANDMARKS,
        SectionId::Mirror => first == header.n_vertices,
        SectionId::IdentityMean | SectionId::IdentityScale => first as usize == identity,
        SectionId::PoseMean | SectionId::PoseScale | SectionId::PoseLower | SectionId::PoseUpper => {
            first as usize == pose
        }
        SectionId::IdentityPrecision => first as usize == identity && second as usize == identity,
        SectionId::PosePrecision => first as usize == pose && second as usize == pose,
        SectionId::PoseStarts => second as usize == pose && first <= limits::MAX_ROWS,
        SectionId::IdentitySpectrum | SectionId::PoseSpectrum => first <= limits::MAX_ROWS,
        SectionId::LandmarkNames | SectionId::PoseNames | SectionId::Provenance | SectionId::JointNames => {
            first <= limits::MAX_TEXT
        }
        SectionId::JointParents => first <= limits::MAX_JOINTS,
        SectionId::JointAxes | SectionId::JointPositions => first == joints && second == 3,
        SectionId::JointBasis => first == joints && second as usize == identity && third == 3,
        SectionId::SkinStarts => first as usize == blocks.saturating_add(1),
        SectionId::SkinJoints => true,
        SectionId::SkinWeights => {
            second as usize == LANES
                && (third, fourth) == (1, 1)
                && model.known(SectionId::SkinJoints).is_some_and(|s| s.shape[0] == first)
        }
        SectionId::Grid => first == 4,
    }
}

/// First element that breaks a rule of its section.
fn first_wrong(model: &Model<'_>, id: SectionId, section: &Section<'_>) -> Option<usize> {
    let header = model.header();
    let (floats, indices) = (Floats::new(section.bytes), Indices::new(section.bytes));
    let beyond = |limit: f32| floats.iter().position(|value| !(value.abs() <= limit));
    match id {
        SectionId::Coefficients => match section.element {
            ElementType::F16 => first_infinite_half(section.bytes),
            ElementType::I8 => None,
            _ => first_beyond(section.bytes),
        },
        SectionId::Offsets => first_beyond(section.bytes),
        SectionId::Ranges => first_wide_range(floats),
        SectionId::QuantisationError => floats.iter().position(|value| !(value >= 0.0 && value.is_finite())),
        SectionId::Faces | SectionId::Landmarks => indices.iter().position(|vertex| vertex >= header.n_vertices),
        SectionId::Mirror => indices.iter().enumerate().position(|(vertex, other)| {
            indices.get(other as usize).and_then(|back| usize::try_from(back).ok()) != Some(vertex)
        }),
        SectionId::IdentityScale | SectionId::PoseScale => {
            floats.iter().position(|scale| !(scale > 0.0 && scale.is_finite()))
        }
        SectionId::IdentityPrecision | SectionId::PosePrecision => first_asymmetry(floats, section.shape[0] as usize),
        SectionId::IdentitySpectrum | SectionId::PoseSpectrum => {
            let mut last = f32::INFINITY;
            floats.iter().position(|value| {
                let fits = value.is_finite() && value >= 0.0 && value <= last;
                last = value;
                !fits
            })
        }
        SectionId::IdentityMean | SectionId::PoseMean | SectionId::PoseStarts => beyond(limits::MAX_WEIGHT),
        SectionId::PoseLower => beyond(limits::MAX_WEIGHT),
        SectionId::PoseUpper => {
            let lower = model.known(SectionId::PoseLower).map_or(Floats::default(), |s| Floats::new(s.bytes));
            let above = |(index, value)| lower.get(index).is_some_and(|lower| lower <= value);
            beyond(limits::MAX_WEIGHT).or_else(|| floats.iter().enumerate().position(|pair| !above(pair)))
        }
        SectionId::Remainder | SectionId::JointPositions | SectionId::JointBasis => beyond(limits::MAX_COEFFICIENT),
        SectionId::LandmarkNames => first_wrong_text(section, model.landmarks().map(|all| all.len())),
        SectionId::PoseNames => {
            let rows = model.pose_starts().map(|all| all.len() / (header.pose_dim as usize).max(1));
            first_wrong_text(section, rows)
        }
        SectionId::JointNames => {
            let joints = model.known(SectionId::JointParents).map(|section| section.shape[0] as usize);
            first_wrong_text(section, joints.or(Some(0)))
        }
        SectionId::Provenance => first_wrong_text(section, None),
        SectionId::JointParents => content_skin::first_wrong_parent(indices),
        SectionId::JointAxes => content_skin::first_wrong_axis(floats),
        SectionId::SkinStarts => {
            let entries = model.known(SectionId::SkinJoints).map_or(0, |section| section.shape[0]);
            content_skin::first_wrong_start(indices, entries)
        }
        // Block by block, when the other sections are known to be sound.
        SectionId::SkinJoints | SectionId::SkinWeights => None,
        SectionId::Grid => first_wrong_grid(section, header),
    }
}

/// A base of at least 2 x 2 nodes, refined to the number of vertices, with a transform that is known.
fn first_wrong_grid(section: &Section<'_>, header: &Header) -> Option<usize> {
    let word = |index: usize| u32_at(section.bytes, 4 * index);
    let (levels, base) = (word(2), [word(0), word(1)]);
    if let Some(index) = base.iter().position(|&size| !(2..=limits::MAX_VERTICES).contains(&size)) {
        return Some(index);
    }
    if levels > limits::MAX_LEVELS {
        return Some(2);
    }
    let [width, height] = base.map(|size| (u64::from(size - 1) << levels) + 1);
    if width.checked_mul(height) != Some(u64::from(header.n_vertices)) {
        return Some(2);
    }
    (word(3) > 1).then_some(3)
}

/// First byte that is not UTF-8, or the length when the number of lines is not `expected`.
fn first_wrong_text(section: &Section<'_>, expected: Option<usize>) -> Option<usize> {
    match core::str::from_utf8(section.bytes) {
        Err(error) => Some(error.valid_up_to()),
        Ok(text) => {
            let lines = text.bytes().filter(|&byte| byte == b'\n').count() + 1;
            (expected.is_some_and(|expected| expected != lines)).then_some(section.bytes.len())
        }
    }
}

/// First half-precision number that is infinite or NaN.
fn first_infinite_half(bytes: &[u8]) -> Option<usize> {
    bytes.as_chunks::<2>().0.iter().position(|raw| u16::from_le_bytes(*raw) & 0x7c00 == 0x7c00)
}

/// First scale or offset with which a code could stand for more than [`limits::MAX_COEFFICIENT`].
fn first_wide_range(ranges: Floats<'_>) -> Option<usize> {
    ranges.iter().position(|value| !(value.abs() <= limits::MAX_COEFFICIENT / 256.0))
}
/// First coefficient that is not a number of at most [`limits::MAX_COEFFICIENT`], in chunks that the compiler vectorises.
fn first_beyond(bytes: &[u8]) -> Option<usize> {
    let beyond = |raw: &[u8; 4]| !(f32::from_le_bytes(*raw).abs() <= limits::MAX_COEFFICIENT);
    let (blocks, _) = bytes.as_chunks::<64>();
    for (block, raw) in blocks.iter().enumerate() {
        let (elements, _) = raw.as_chunks::<4>();
        if elements.iter().fold(false, |any, raw| any | beyond(raw)) {
            let lane = elements.iter().position(beyond).unwrap_or(0);
            return Some(block * 16 + lane);
        }
    }
    None
}

/// First entry of a `d x d` matrix that is not finite, differs from its mirror image, or stands on the diagonal and is not positive.
fn first_asymmetry(matrix: Floats<'_>, d: usize) -> Option<usize> {
    matrix.iter().enumerate().position(|(index, value)| {
        // An empty matrix has no entries to come here with.
        let (Some(row), Some(column)) = (index.checked_div(d), index.checked_rem(d)) else { return true };
        let mirrored = matrix.get(column.saturating_mul(d).saturating_add(row));
        !value.is_finite() || mirrored != Some(value) || (row == column && value <= 0.0)
    })
}
