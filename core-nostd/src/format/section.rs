//! The section table of a model file.

use super::header::{HEADER_BYTES, put, u32_at, u64_at};
use super::limits::MAX_SECTIONS;
use crate::Error;
use crate::workspace::saturated;

pub(super) const ENTRY_BYTES: usize = 64;
/// Sections are written at multiples of this.
pub(super) const ALIGNMENT: usize = 64;
/// Sections are accepted at multiples of this.
const ACCEPTED_ALIGNMENT: u64 = 16;
pub(super) const MAY_IGNORE: u32 = 1;

/// Identifiers of the sections of version 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
#[allow(missing_docs)]
pub enum SectionId {
    Coefficients = 1,
    Faces = 2,
    Landmarks = 3,
    LandmarkNames = 4,
    Mirror = 5,
    IdentityMean = 6,
    IdentityScale = 7,
    IdentityPrecision = 8,
    PoseMean = 9,
    PoseScale = 10,
    PosePrecision = 11,
    PoseStarts = 12,
    PoseNames = 13,
    IdentitySpectrum = 14,
    PoseSpectrum = 15,
    Provenance = 16,
    Remainder = 17,
    Offsets = 18,
    Ranges = 19,
    QuantisationError = 20,
    JointParents = 21,
    JointAxes = 22,
    JointPositions = 23,
    JointBasis = 24,
    JointNames = 25,
    SkinStarts = 26,
    SkinJoints = 27,
    SkinWeights = 28,
    PoseLower = 29,
    PoseUpper = 30,
    Grid = 31,
}

impl SectionId {
    /// All of them.
    pub const ALL: [Self; 31] = [
        Self::Coefficients,
        Self::Faces,
        Self::Landmarks,
        Self::LandmarkNames,
        Self::Mirror,
        Self::IdentityMean,
        Self::IdentityScale,
        Self::IdentityPrecision,
        Self::PoseMean,
        Self::PoseScale,
        Self::PosePrecision,
        Self::PoseStarts,
        Self::PoseNames,
        Self::IdentitySpectrum,
        Self::PoseSpectrum,
        Self::Provenance,
        Self::Remainder,
        Self::Offsets,
        Self::Ranges,
        Self::QuantisationError,
        Self::JointParents,
        Self::JointAxes,
        Self::JointPositions,
        Self::JointBasis,
        Self::JointNames,
        Self::SkinStarts,
        Self::SkinJoints,
        Self::SkinWeights,
        Self::PoseLower,
        Self::PoseUpper,
        Self::Grid,
    ];

    /// Element type and rank that the specification gives the section; the coefficients may also be [`ElementType::F16`] or [`ElementType::I8`].
    pub const fn form(self) -> (ElementType, usize) {
        match self {
            Self::Coefficients | Self::Ranges => (ElementType::F32, 4),
            Self::Remainder | Self::Offsets | Self::JointBasis => (ElementType::F32, 3),
            Self::Faces => (ElementType::U32, 2),
            Self::Landmarks | Self::Mirror | Self::JointParents | Self::SkinStarts | Self::SkinJoints | Self::Grid => {
                (ElementType::U32, 1)
            }
            Self::IdentityPrecision | Self::PosePrecision | Self::PoseStarts => (ElementType::F32, 2),
            Self::JointAxes | Self::JointPositions | Self::SkinWeights => (ElementType::F32, 2),
            Self::LandmarkNames | Self::PoseNames | Self::Provenance | Self::JointNames => (ElementType::U8, 1),
            _ => (ElementType::F32, 1),
        }
    }

    /// A reader that does not know the section may ignore it.
    pub const fn may_ignore(self) -> bool {
        matches!(
            self,
            Self::IdentitySpectrum
                | Self::PoseSpectrum
                | Self::Provenance
                | Self::Remainder
                | Self::QuantisationError
                | Self::JointNames
        )
    }

    /// The known section with this number.
    pub fn from_u32(id: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|known| *known as u32 == id)
    }
}

/// Type of the elements of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
#[allow(missing_docs)]
pub enum ElementType {
    U8 = 1,
    U32 = 2,
    F32 = 3,
    F16 = 4,
    I8 = 5,
}

impl ElementType {
    /// Bytes of an element.
    pub const fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::F16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// One section of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Section<'a> {
    /// Identifier; see [`SectionId`].
    pub id: u32,
    /// A reader that does not know the identifier may ignore the section.
    pub may_ignore: bool,
    /// Type of the elements.
    pub element: ElementType,
    /// Number of axes.
    pub rank: usize,
    /// Length of each axis, slowest first; 1 beyond the rank.
    pub shape: [u32; 4],
    /// Content.
    pub bytes: &'a [u8],
    pub(super) crc: u32,
}

/// The sections of a file in their order, each checked against the file's bounds.
#[derive(Debug, Clone, Copy)]
pub struct Sections<'a> {
    file: &'a [u8],
    table: &'a [u8],
}

impl<'a> Sections<'a> {
    /// The table of `count` entries behind the header.
    pub(super) fn new(file: &'a [u8], count: usize) -> Result<Self, Error> {
        let end = HEADER_BYTES + count.min(MAX_SECTIONS as usize) * ENTRY_BYTES;
        let table = file
            .get(HEADER_BYTES..end)
            .ok_or(Error::Truncated { needed: saturated(end), found: saturated(file.len()) })?;
        Ok(Sections { file, table })
    }

    pub(super) fn table(&self) -> &'a [u8] {
        self.table
    }

    /// `Ok` when every entry is sound, the sections are in order, apart and unique, and all bytes between them are zero.
    pub(super) fn check(&self) -> Result<(), Error> {
        let mut end = HEADER_BYTES + self.table.len();
        for (position, raw) in self.table.chunks_exact(ENTRY_BYTES).enumerate() {
            let id = u32_at(raw, 0);
            let wrong = Error::BadSection { section: id };
            let section = self.entry(raw)?;
            let earlier = self.table.chunks_exact(ENTRY_BYTES).take(position);
            if id == 0 || earlier.into_iter().any(|raw| u32_at(raw, 0) == id) {
                return Err(wrong);
            }
            let from = usize::try_from(u64_at(raw, 32)).map_err(|_| wrong)?;
            let gap = self.file.get(end..from).ok_or(wrong)?;
            if gap.iter().any(|&byte| byte != 0) {
                return Err(wrong);
            }
            end = from + section.bytes.len();
        }
        let rest = self.file.get(end..).unwrap_or_default();
        if rest.len() >= ALIGNMENT || rest.iter().any(|&byte| byte != 0) || !self.file.len().is_multiple_of(ALIGNMENT) {
            return Err(Error::BadHeader { offset: super::header::field::FILE_LENGTH as u32 });
        }
        Ok(())
    }

    fn entry(&self, raw: &[u8]) -> Result<Section<'a>, Error> {
        let id = u32_at(raw, 0);
        let wrong = Error::BadSection { section: id };
        let flags = u32_at(raw, 4);
        let element = match u32_at(raw, 8) {
            1 => ElementType::U8,
            2 => ElementType::U32,
            3 => ElementType::F32,
            4 => ElementType::F16,
            5 => ElementType::I8,
            _ => return Err(wrong),
        };
        let rank = u32_at(raw, 12) as usize;
        let shape = [u32_at(raw, 16), u32_at(raw, 20), u32_at(raw, 24), u32_at(raw, 28)];
        let (offset, length) = (u64_at(raw, 32), u64_at(raw, 40));
        let tail = raw.get(52..).unwrap_or_default();
        let unused = shape.iter().skip(rank).any(|&axis| axis != 1);
        if flags & !MAY_IGNORE != 0 || !(1..=4).contains(&rank) || unused || tail.iter().any(|&byte| byte != 0) {
            return Err(wrong);
        }
        let size = shape.iter().try_fold(element.bytes() as u64, |size, &axis| size.checked_mul(u64::from(axis)));
        if size != Some(length) || length == 0 || !offset.is_multiple_of(ACCEPTED_ALIGNMENT) {
            return Err(wrong);
        }
        let from = usize::try_from(offset).map_err(|_| wrong)?;
        let to = usize::try_from(length).ok().and_then(|length| from.checked_add(length)).ok_or(wrong)?;
        let bytes = self.file.get(from..to).ok_or(wrong)?;
        Ok(Section { id, may_ignore: flags & MAY_IGNORE != 0, element, rank, shape, bytes, crc: u32_at(raw, 48) })
    }

    /// The sections in the order of the file.
    pub fn iter(&self) -> impl Iterator<Item = Section<'a>> + use<'a> {
        let sections = *self;
        self.table.chunks_exact(ENTRY_BYTES).filter_map(move |raw| sections.entry(raw).ok())
    }

    /// The section with this identifier, whichever its form.
    pub fn find(&self, id: u32) -> Option<Section<'a>> {
        self.iter().find(|section| section.id == id)
    }
}

/// The bytes of one entry.
pub(super) fn entry_bytes(section: &super::SectionSource<'_>, offset: u64, crc: u32) -> [u8; ENTRY_BYTES] {
    let mut raw = [0; ENTRY_BYTES];
    put(&mut raw, 0, &section.id.to_le_bytes());
    put(&mut raw, 4, &u32::from(section.may_ignore).to_le_bytes());
    put(&mut raw, 8, &(section.element as u32).to_le_bytes());
    put(&mut raw, 12, &saturated(section.shape.len()).to_le_bytes());
    for axis in 0..4 {
        let length = section.shape.get(axis).copied().unwrap_or(1);
        put(&mut raw, 16 + 4 * axis, &length.to_le_bytes());
    }
    put(&mut raw, 32, &offset.to_le_bytes());
    put(&mut raw, 40, &(section.bytes.len() as u64).to_le_bytes());
    put(&mut raw, 48, &crc.to_le_bytes());
    raw
}
