//! Tests of the reader and the writer: every code of the 3xx band, every byte flipped, every truncation.

use std::vec::Vec;

use super::*;
use crate::Error;
use crate::generator::{Generator, Weights};
use crate::testing::{bytes_of, coefficients, file_of, float_section, header, model_file};

fn small() -> Vec<u8> {
    model_file(&header(18, 2, 3, true), 5)
}

/// Changes bytes and repairs the checksums, so that what lies behind them is reached.
pub(crate) fn forged(file: &[u8], change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut file = file.to_vec();
    change(&mut file);
    let count = u32::from_le_bytes(file[28..32].try_into().unwrap()) as usize;
    for k in 0..count.min((file.len() - 64) / 64) {
        let entry = 64 + 64 * k;
        let word = |at: usize| u64::from_le_bytes(file[entry + at..entry + at + 8].try_into().unwrap()) as usize;
        if let Some(bytes) = word(32).checked_add(word(40)).and_then(|end| file.get(word(32)..end)) {
            let crc = crc::crc32(&[bytes]).to_le_bytes();
            file[entry + 48..entry + 52].copy_from_slice(&crc);
        }
    }
    let end = (64 + 64 * count).min(file.len());
    let crc = crc::crc32(&[&file[..60], &file[64..end]]).to_le_bytes();
    file[60..64].copy_from_slice(&crc);
    file
}

/// Offset of the entry of a section in the table.
fn entry(file: &[u8], id: SectionId) -> usize {
    let mut at = 64;
    while u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) != id as u32 {
        at += 64;
    }
    at
}

/// Offset of the content of a section.
fn content(file: &[u8], id: SectionId) -> usize {
    let at = entry(file, id) + 32;
    u64::from_le_bytes(file[at..at + 8].try_into().unwrap()) as usize
}

fn opened_error(file: &[u8]) -> Error {
    Model::open(file).expect_err("the file must be refused")
}

#[test]
fn everything_that_was_written_is_read() {
    let file = small();
    let model = Model::open(&file).unwrap();
    assert_eq!(*model.header(), header(18, 2, 3, true));
    assert_eq!(model.faces().unwrap().get(15), Some([15, 16, 17]));
    assert_eq!(model.faces().unwrap().get(16), None);
    assert_eq!(model.landmarks().unwrap().len(), 8);
    assert_eq!(model.landmark_names().unwrap().get(7), Some("point_7"));
    assert_eq!(model.mirror().unwrap().get(0), Some(17));
    assert_eq!(model.gaussian(Mode::Pose).unwrap().mean.iter().collect::<Vec<_>>(), [0.0, 0.1, 0.2]);
    assert_eq!(model.pose_starts().unwrap().len(), 6);
    assert_eq!(model.pose_names().unwrap().get(1), Some("other"));
    assert_eq!(model.spectrum(Mode::Identity).unwrap().get(0), Some(5.0));
    assert_eq!(model.provenance(), Some("test"));
    assert_eq!(model.remainder().unwrap().len(), 2 * 18 * 3);
}

#[test]
fn writing_what_was_read_gives_the_same_bytes() {
    let file = small();
    let model = Model::open(&file).unwrap();
    let sections: Vec<Section<'_>> = model.sections().iter().collect();
    let sources: Vec<SectionSource<'_>> = sections.iter().map(SectionSource::from_section).collect();
    assert_eq!(file_of(model.header(), &sources), file);
}

#[test]
fn any_alignment_gives_the_same_bits() {
    let file = small();
    let mut expected = vec![0.0; 54];
    let weights = Weights { identity: &[0.3, -0.7], pose: &[1.1, 0.2, -0.4] };
    Model::open(&file).unwrap().bilinear().unwrap().evaluate(weights, 0..18, &mut expected).unwrap();
    for shift in 1..17 {
        let mut moved = vec![0xaa; shift];
        moved.extend_from_slice(&file);
        let mut out = vec![0.0; 54];
        Model::open(&moved[shift..]).unwrap().bilinear().unwrap().evaluate(weights, 0..18, &mut out).unwrap();
        assert_eq!(out, expected);
    }
}

#[test]
fn every_flipped_byte_is_refused() {
    let file = small();
    for at in 0..file.len() {
        for flip in [0xff, 0x01, 0x80] {
            let mut damaged = file.clone();
            damaged[at] ^= flip;
            assert!(Model::open(&damaged).is_err(), "byte {at} ^ {flip:#x}");
        }
    }
}

/// The same behind repaired checksums: refused, or opened as a model that evaluates to numbers.
#[test]
fn every_forged_byte_is_refused_or_harmless() {
    let file = small();
    let mut opened = 0;
    for at in 0..file.len() {
        for flip in [0xff, 0x01, 0x80] {
            let forged = forged(&file, |file| file[at] ^= flip);
            for checksums in [Checksums::Verify, Checksums::Skip] {
                if let Ok(model) = Model::open_with(&forged, checksums) {
                    let generator = model.bilinear().unwrap();
                    let (identity, pose) = (vec![0.5; generator.identity_dim()], vec![0.5; generator.pose_dim()]);
                    let mut out = vec![f32::NAN; 3 * generator.vertex_count()];
                    let weights = Weights { identity: &identity, pose: &pose };
                    generator.evaluate(weights, 0..generator.vertex_count(), &mut out).unwrap();
                    assert!(out.iter().all(|value| value.is_finite()));
                    opened += 1;
                }
            }
        }
    }
    assert!(opened > 1000, "numbers inside their limits are harmless: {opened}");
}

#[test]
fn every_truncation_is_refused() {
    let file = small();
    for len in 0..file.len() {
        let error = opened_error(&file[..len]);
        assert!(matches!(error, Error::Truncated { .. }), "{len}: {error:?}");
    }
    let mut longer = file.clone();
    longer.extend_from_slice(&[0; 64]);
    assert!(matches!(opened_error(&longer), Error::Truncated { .. }));
}

#[test]
fn every_code_of_the_format_is_reached() {
    let file = small();
    let put = |at: usize, value: u32| move |file: &mut Vec<u8>| file[at..at + 4].copy_from_slice(&value.to_le_bytes());
    assert_eq!(opened_error(b"PK\x03\x04 and so on"), Error::BadMagic);
    assert_eq!(opened_error(&forged(&file, put(0, 1))), Error::BadMagic);
    assert_eq!(opened_error(&forged(&file, put(8, 2))), Error::UnknownVersion { version: 2 });
    for (at, value) in
        [(12, 65), (24, 5), (28, 0), (32, 0), (36, 0), (40, 0), (44, 8), (44, 4), (48, 2), (52, 0), (56, 1)]
    {
        assert_eq!(opened_error(&forged(&file, put(at, value))), Error::BadHeader { offset: at as u32 }, "{at}");
    }
    for (at, limit) in [(28, limits::MAX_SECTIONS), (32, limits::MAX_VERTICES), (36, 1024), (40, 1024)] {
        let error = opened_error(&forged(&file, put(at, limit + 1)));
        assert_eq!(error, Error::LimitExceeded { found: limit + 1, limit });
    }
    let mut damaged = file.clone();
    damaged[60] ^= 1;
    assert_eq!(opened_error(&damaged), Error::BadChecksum { section: 0 });
    let mut damaged = file.clone();
    damaged[content(&file, SectionId::Faces)] ^= 1;
    assert_eq!(opened_error(&damaged), Error::BadChecksum { section: 2 });
    assert!(Model::open_with(&damaged, Checksums::Skip).is_ok());

    let faces = entry(&file, SectionId::Faces);
    let wrong = Error::BadSection { section: 2 };
    // Flags, element type, rank, shape, unused axis, offset, length, reserved, and the extremes of each length.
    for (at, value) in [
        (4, 2),
        (8, 6),
        (8, 4),
        (8, 3),
        (12, 0),
        (12, 5),
        (12, 1),
        (16, 0),
        (16, u32::MAX),
        (20, 4),
        (24, 2),
        (32, 8),
        (36, u32::MAX),
        (40, 0),
        (40, u32::MAX),
        (44, u32::MAX),
        (52, 1),
        (60, 1),
    ] {
        assert_eq!(opened_error(&forged(&file, put(faces + at, value))), wrong, "{at} = {value}");
    }
    assert_eq!(opened_error(&forged(&file, put(faces, 1))), Error::BadSection { section: 1 });
    assert_eq!(opened_error(&forged(&file, put(faces, 999))), Error::UnknownSection { section: 999 });
    assert_eq!(opened_error(&forged(&file, put(faces, 0))), Error::BadSection { section: 0 });

    let bad = |id: SectionId, index: usize, value: u32| {
        let file = forged(&file, put(content(&file, id) + 4 * index, value));
        let expected = Error::BadContent { section: id as u32, index: index as u32 };
        assert_eq!(opened_error(&file), expected, "{id:?} {index}");
    };
    bad(SectionId::Faces, 47, 18);
    bad(SectionId::Landmarks, 3, 18);
    bad(SectionId::Mirror, 2, 3);
    bad(SectionId::Coefficients, 100, f32::NAN.to_bits());
    bad(SectionId::Coefficients, 5, 2e12f32.to_bits());
    bad(SectionId::IdentityMean, 1, f32::INFINITY.to_bits());
    bad(SectionId::PoseScale, 2, 0);
    bad(SectionId::PosePrecision, 4, (-1.0f32).to_bits());
    bad(SectionId::PosePrecision, 1, 7.0f32.to_bits());
    bad(SectionId::IdentitySpectrum, 1, 9.0f32.to_bits());
    bad(SectionId::PoseStarts, 0, f32::NAN.to_bits());
    let names = content(&file, SectionId::LandmarkNames);
    assert_eq!(opened_error(&forged(&file, |file| file[names + 2] = 0xff)), Error::BadContent { section: 4, index: 2 });
    assert!(matches!(
        opened_error(&forged(&file, |file| file[names + 2] = b'\n')),
        Error::BadContent { section: 4, .. }
    ));
}

#[test]
fn unknown_sections_are_skipped_or_refused() {
    let header = header(16, 1, 1, false);
    let core = bytes_of(&coefficients(&header, 3));
    let shape = [1, 2, 3, 16];
    let coefficients = float_section(SectionId::Coefficients, &shape, &core);
    let mut extra = SectionSource { id: 4711, may_ignore: true, element: ElementType::U8, shape: &[3], bytes: b"abc" };
    let file = file_of(&header, &[extra, coefficients]);
    assert_eq!(Model::open(&file).unwrap().sections().find(4711).unwrap().bytes, b"abc");
    extra.may_ignore = false;
    let mut out = vec![0; 4096];
    let sources = [extra, coefficients];
    assert_eq!(write(&header, &sources, &mut out), Err(Error::UnknownSection { section: 4711 }));
    assert_eq!(write(&header, &[], &mut out), Err(Error::BadHeader { offset: 28 }));
    extra.may_ignore = true;
    assert_eq!(write(&header, &[extra], &mut out), Err(Error::MissingSection { section: 1 }));
    assert!(matches!(write(&header, &[coefficients], &mut out[..100]), Err(Error::OutputTooSmall { .. })));
    let mean = bytes_of(&[0.0]);
    let lonely = float_section(SectionId::IdentityMean, &[1], &mean);
    assert_eq!(write(&header, &[coefficients, lonely], &mut out), Err(Error::MissingSection { section: 7 }));
}
