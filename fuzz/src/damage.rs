//! Model files that are wrong in their meaning, not in their checksums: changes of a sound file, and new checksums.

use std::sync::OnceLock;

use arbitrary::{Arbitrary, Unstructured};
use crc::{CRC_32_ISO_HDLC, Crc, Table};
use habitus_reference::bilinear::Bilinear;
use habitus_reference::model_file::{Extras, Section, bytes, sections};
use habitus_reference::prior::Gaussian;

use crate::body_case::Choice;
use crate::numbers::HARD;
use crate::wavelet_case;

static CRC32: Crc<u32, Table<16>> = Crc::<u32, Table<16>>::new(&CRC_32_ISO_HDLC);

/// Bytes of the header, and of an entry of the table.
const HEADER: usize = 64;
const ENTRY: usize = 64;

/// Words that lie at limits of the format.
const HARD_WORDS: [u32; 16] =
    [0, 1, 2, 3, 4, 15, 16, 17, 64, 65, 1024, 1025, 1 << 24, (1 << 24) + 1, i32::MAX as u32, u32::MAX];

/// A word to be put into a file.
#[derive(Debug, Arbitrary)]
enum Word {
    Small(u8),
    Hard(u8),
    HardFloat(u8),
    Any(u32),
}

impl Word {
    fn value(&self) -> u32 {
        match *self {
            Word::Small(value) => u32::from(value),
            Word::Hard(index) => HARD_WORDS[usize::from(index) % HARD_WORDS.len()],
            Word::HardFloat(index) => HARD[usize::from(index) % HARD.len()].to_bits(),
            Word::Any(value) => value,
        }
    }
}

/// One change of a file; places beyond the end change nothing.
#[derive(Debug, Arbitrary)]
enum Change {
    /// A word of the header, counted in words.
    Header(u8, Word),
    /// A word of an entry of the table.
    Entry(u8, u8, Word),
    /// A word anywhere, counted in words.
    Content(u16, Word),
    /// A byte anywhere, for texts.
    Byte(u16, u8),
    /// Two entries change places.
    Swapped(u8, u8),
    /// An entry is written over another one.
    Doubled(u8, u8),
    /// A section is taken out of the table; the table becomes shorter.
    Removed(u8),
    /// The file ends here, or is filled up with zeros to here.
    Length(u16),
}

/// A sound file and what is done to it.
#[derive(Debug, Arbitrary)]
pub struct Damage {
    base: u8,
    changes: Vec<Change>,
    length_repaired: bool,
}

impl Damage {
    /// The damaged file with sound checksums; `None` when the bytes do not make a list of changes.
    pub fn file_of(bytes: &[u8]) -> Option<Vec<u8>> {
        let damage = Damage::arbitrary_take_rest(Unstructured::new(bytes)).ok()?;
        static SOUND: OnceLock<[Vec<u8>; SOUND_FILES]> = OnceLock::new();
        let sound = SOUND.get_or_init(|| std::array::from_fn(sound_file));
        let mut file = sound[usize::from(damage.base) % sound.len()].clone();
        for change in damage.changes.iter().take(64) {
            change.apply(&mut file);
        }
        if damage.length_repaired {
            repair_length(&mut file);
        }
        repair_checksums(&mut file);
        Some(file)
    }
}

impl Change {
    fn apply(&self, file: &mut Vec<u8>) {
        let entry = |index: u8| HEADER + ENTRY * usize::from(index % 16);
        match *self {
            Change::Header(at, ref word) => put(file, usize::from(at % 16) * 4, &word.value().to_le_bytes()),
            Change::Entry(index, at, ref word) => {
                put(file, entry(index) + usize::from(at % 16) * 4, &word.value().to_le_bytes());
            }
            Change::Content(at, ref word) => put(file, usize::from(at) * 4, &word.value().to_le_bytes()),
            Change::Byte(at, byte) => put(file, usize::from(at), &[byte]),
            Change::Swapped(a, b) => {
                let (first, second) = (piece(file, entry(a)), piece(file, entry(b)));
                put(file, entry(a), &second);
                put(file, entry(b), &first);
            }
            Change::Doubled(from, to) => {
                let bytes = piece(file, entry(from));
                put(file, entry(to), &bytes);
            }
            Change::Removed(index) => {
                let count = word_at(file, 28);
                let from = entry(index);
                if count > 1 && from + ENTRY <= file.len() {
                    // The sections stay where they are; the gap behind the table is zeros, as the format asks.
                    let table_end = (HEADER + ENTRY * count as usize).min(file.len());
                    if from < table_end {
                        file[from..table_end].rotate_left(ENTRY);
                        file[table_end - ENTRY..table_end].fill(0);
                        put(file, 28, &(count - 1).to_le_bytes());
                    }
                }
            }
            Change::Length(length) => file.resize(usize::from(length), 0),
        }
    }
}

/// Fills up with zeros to a multiple of 64 bytes and puts the length into the header.
pub fn repair_length(file: &mut Vec<u8>) {
    file.resize(file.len().next_multiple_of(64), 0);
    let length = file.len() as u64;
    put(file, 16, &length.to_le_bytes());
}

/// Puts the checksum of each section that lies in the file, then that of header and table.
pub fn repair_checksums(file: &mut [u8]) {
    let count = word_at(file, 28).min(64) as usize;
    let table_end = HEADER + ENTRY * count;
    if table_end > file.len() {
        return;
    }
    for entry in (HEADER..table_end).step_by(ENTRY) {
        let (from, length) = (long_at(file, entry + 32), long_at(file, entry + 40));
        let content = from.checked_add(length).and_then(|to| file.get(from..to));
        if let Some(crc) = content.map(|content| CRC32.checksum(content)) {
            put(file, entry + 48, &crc.to_le_bytes());
        }
    }
    let mut digest = CRC32.digest();
    digest.update(&file[..60]);
    digest.update(&file[64..table_end]);
    put(file, 60, &digest.finalize().to_le_bytes());
}

fn put(file: &mut [u8], at: usize, bytes: &[u8]) {
    for (to, from) in file.iter_mut().skip(at).zip(bytes) {
        *to = *from;
    }
}

fn piece(file: &[u8], at: usize) -> [u8; ENTRY] {
    file.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; ENTRY])
}

fn word_at(file: &[u8], at: usize) -> u32 {
    file.get(at..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

fn long_at(file: &[u8], at: usize) -> usize {
    let bytes = file.get(at..).and_then(|rest| rest.first_chunk());
    bytes.and_then(|bytes| usize::try_from(u64::from_le_bytes(*bytes)).ok()).unwrap_or(usize::MAX)
}

/// Sound files that there are.
pub const SOUND_FILES: usize = 10;

/// A linear model or a body, small, in one of the storages.
fn sound_body(base: usize) -> Vec<u8> {
    // Ball, hinge, ball; corrective terms and dual quaternions by bits 0 and 1, joints that follow by bit 2.
    let choice = Choice {
        n: 16,
        dim: 1,
        joints: [(0, 0), (0, 1), (1, 0), (0, 2)],
        n_joints: 1 + base as u8 % 2,
        flags: [0, 4, 7, 2][base % 4],
        storage: [2, 0, 2, 1][base % 4],
        seed: 5,
        term_size: 1,
        ..Choice::default()
    };
    choice.case().file(base.is_multiple_of(4)).1
}

/// A wavelet model, cubic in `f32` or bilinear in bytes.
fn sound_wavelet(base: usize) -> Vec<u8> {
    let bilinear = base as u8 % 2;
    let choice = wavelet_case::Choice {
        base: [bilinear, 1],
        levels: 1,
        flags: bilinear,
        storage: 2 * bilinear,
        seed: 5,
        term_size: 1,
        ..wavelet_case::Choice::default()
    };
    choice.case().file().1
}

/// A sound model file, small: bilinear with and without linear terms, with the coefficients alone or with every section; linear; bodies; wavelets.
pub fn sound_file(base: usize) -> Vec<u8> {
    match base % SOUND_FILES {
        0..4 => {}
        4..8 => return sound_body(base),
        _ => return sound_wavelet(base),
    }
    let (n, [di, dp]) = [(1, [1, 1]), (17, [2, 1]), (16, [1, 3]), (20, [2, 2])][base % 4];
    let mut state = 1u32;
    let mut points = |size: f32| -> Vec<[f32; 3]> {
        let mut number = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            size * ((state >> 8) as f32 / (1 << 23) as f32 - 1.0)
        };
        (0..n).map(|_| [number(), number(), number()]).collect()
    };
    let linear = [[false, false], [true, false], [false, true], [true, true]][base % 4];
    let model = Bilinear {
        offset: points(100.0),
        pose_linear: linear[1].then(|| (0..dp).map(|_| points(8.0)).collect()),
        identity_linear: linear[0].then(|| (0..di).map(|_| points(8.0)).collect()),
        bilinear: (0..di).map(|_| (0..dp).map(|_| points(8.0)).collect()).collect(),
    };
    if base.is_multiple_of(4) {
        let sections = sections(&model, &Extras::default());
        return bytes(&model, &sections);
    }
    let gaussian = |d: usize| Gaussian {
        mean: (0..d).map(|k| k as f32 * 0.25).collect(),
        scale: vec![0.5; d],
        precision: (0..d).map(|i| (0..d).map(|j| if i == j { 4.0 } else { 0.5 }).collect()).collect(),
    };
    let landmarks: Vec<u32> = (0..n as u32).step_by(3).collect();
    let extras = Extras {
        faces: (0..n as u32 - 2).map(|k| [k, k + 1, k + 2]).collect(),
        landmark_names: landmarks.iter().map(|k| format!("p{k}")).collect::<Vec<_>>().join("\n"),
        landmarks,
        identity: Some(gaussian(di)),
        pose: Some(gaussian(dp)),
        provenance: "for the fuzzer".into(),
    };
    let mut all = sections(&model, &extras);
    let words = |values: &[u32]| -> Vec<u8> { values.iter().flat_map(|value| value.to_le_bytes()).collect() };
    let floats = |values: &[f32]| -> Vec<u8> { values.iter().flat_map(|value| value.to_le_bytes()).collect() };
    let mirror: Vec<u32> = (0..n as u32).rev().collect();
    let mut push = |id: u32, element: u32, shape: &[usize], bytes: Vec<u8>| {
        let shape = shape.iter().map(|&axis| axis as u32).collect();
        all.push(Section { id, may_ignore: id >= 14, element, shape, bytes });
    };
    push(5, 2, &[n], words(&mirror));
    push(12, 3, &[2, dp], floats(&vec![0.5; 2 * dp]));
    push(13, 1, &[6], b"a\nb\xC3\xA9x".to_vec());
    push(14, 3, &[3], floats(&[9.0, 4.0, 0.0]));
    push(15, 3, &[1], floats(&[1.0]));
    push(99, 1, &[5], b"later".to_vec());
    bytes(&model, &all)
}
