//! The first 64 bytes of a model file.

use super::limits;
use crate::Error;
use crate::workspace::saturated;

pub(super) const HEADER_BYTES: usize = 64;
pub(super) const MAGIC: [u8; 8] = *b"\x89HAB\r\n\x1a\n";
const VERSION: u32 = 1;
const MILLIMETRE: u32 = 1;
const Y_UP: u32 = 1;

/// Byte offsets of the fields.
pub(super) mod field {
    pub const VERSION: usize = 8;
    pub const HEADER_LENGTH: usize = 12;
    pub const FILE_LENGTH: usize = 16;
    pub const KIND: usize = 24;
    pub const SECTIONS: usize = 28;
    pub const VERTICES: usize = 32;
    pub const IDENTITY: usize = 36;
    pub const POSE: usize = 40;
    pub const FLAGS: usize = 44;
    pub const UNIT: usize = 48;
    pub const AXES: usize = 52;
    pub const RESERVED: usize = 56;
    pub const CRC: usize = 60;
}

/// What kind of generator a model file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
#[repr(u32)]
pub enum Kind {
    /// Equation 8.2, with 12.1 as the case without linear terms.
    Bilinear = 1,
    /// A mean and components (equation 9.1): identity weights alone.
    Linear = 2,
    /// S-SCAPE (equations 9.1 to 9.3): components of a rest shape, a skeleton, and skinning.
    Skinned = 3,
    /// A local multilinear model for each coefficient of a wavelet transform on a grid (chapter 15).
    Wavelet = 4,
}

impl Kind {
    const ALL: [Self; 4] = [Self::Bilinear, Self::Linear, Self::Skinned, Self::Wavelet];

    /// Flags that a file of this kind must have, and those that it may have.
    const fn flags(self) -> (u32, u32) {
        match self {
            Self::Bilinear => (0, IDENTITY_LINEAR | POSE_LINEAR),
            Self::Linear => (IDENTITY_LINEAR, 0),
            Self::Skinned => (IDENTITY_LINEAR, POSE_LINEAR | DUAL_QUATERNION),
            Self::Wavelet => (0, 0),
        }
    }
}

const IDENTITY_LINEAR: u32 = 1;
const POSE_LINEAR: u32 = 2;
const DUAL_QUATERNION: u32 = 4;

/// Counts of a model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Kind of the generator.
    pub kind: Kind,
    /// Vertices.
    pub n_vertices: u32,
    /// Identity weights; of each coefficient in a wavelet model.
    pub identity_dim: u32,
    /// Pose weights: expression for faces, posture for bodies; of each coefficient in a wavelet model.
    pub pose_dim: u32,
    /// The generator has terms linear in the identity weights alone; always so for linear and skinned models.
    pub identity_linear: bool,
    /// The generator has terms linear in the pose weights alone; in a skinned model, terms that correct the rest shape.
    pub pose_linear: bool,
    /// A skinned model blends dual quaternions, not matrices.
    pub dual_quaternion: bool,
}

impl Header {
    /// Terms of a block of coefficients, without the corrective ones of a skinned model; the largest number for counts beyond it.
    pub const fn n_terms(&self) -> usize {
        let (identity, pose) = (self.identity_dim as usize, self.pose_dim as usize);
        if let Kind::Linear | Kind::Skinned = self.kind {
            return identity.saturating_add(1);
        }
        let linear = if self.pose_linear { pose } else { 0 };
        let of_identity = identity.saturating_mul(pose.saturating_add(self.identity_linear as usize));
        of_identity.saturating_add(linear).saturating_add(1)
    }

    /// Blocks of 16 vertices (of 16 coefficients in a wavelet model, which has as many).
    pub const fn n_blocks(&self) -> usize {
        (self.n_vertices as usize).div_ceil(crate::generator::LANES)
    }

    /// `Ok` when every count is within its limits.
    pub(super) fn check(&self) -> Result<(), Error> {
        for (count, limit, offset) in [
            (self.n_vertices, limits::MAX_VERTICES, field::VERTICES),
            (self.identity_dim, limits::MAX_WEIGHTS, field::IDENTITY),
            (self.pose_dim, limits::MAX_WEIGHTS, field::POSE),
        ] {
            if count == 0 && (offset != field::POSE || self.kind != Kind::Linear) {
                return Err(Error::BadHeader { offset: saturated(offset) });
            }
            if count > limit {
                return Err(Error::LimitExceeded { found: count, limit });
            }
        }
        if self.kind == Kind::Linear && self.pose_dim != 0 {
            return Err(Error::BadHeader { offset: saturated(field::POSE) });
        }
        Ok(())
    }

    /// Reads the header of a file and returns it with the number of sections. The checksum is not looked at here.
    pub(super) fn read(bytes: &[u8]) -> Result<(Self, usize), Error> {
        let Some(raw) = bytes.first_chunk::<HEADER_BYTES>() else {
            // Told apart so that a wrong file is not called a short one.
            if bytes.iter().zip(MAGIC).any(|(&byte, magic)| byte != magic) {
                return Err(Error::BadMagic);
            }
            return Err(Error::Truncated { needed: HEADER_BYTES as u32, found: saturated(bytes.len()) });
        };
        if raw.iter().zip(MAGIC).any(|(&byte, magic)| byte != magic) {
            return Err(Error::BadMagic);
        }
        let version = u32_at(raw, field::VERSION);
        if version != VERSION {
            return Err(Error::UnknownVersion { version });
        }
        expect(raw, field::HEADER_LENGTH, HEADER_BYTES as u32)?;
        let length = u64_at(raw, field::FILE_LENGTH);
        if u64::try_from(bytes.len()) != Ok(length) {
            let needed = u32::try_from(length).unwrap_or(u32::MAX);
            return Err(Error::Truncated { needed, found: saturated(bytes.len()) });
        }
        let kind = u32_at(raw, field::KIND);
        let kind = Kind::ALL.into_iter().find(|known| *known as u32 == kind);
        let kind = kind.ok_or(Error::BadHeader { offset: field::KIND as u32 })?;
        expect(raw, field::UNIT, MILLIMETRE)?;
        expect(raw, field::AXES, Y_UP)?;
        expect(raw, field::RESERVED, 0)?;
        let sections = u32_at(raw, field::SECTIONS);
        if sections == 0 {
            return Err(Error::BadHeader { offset: field::SECTIONS as u32 });
        }
        if sections > limits::MAX_SECTIONS {
            return Err(Error::LimitExceeded { found: sections, limit: limits::MAX_SECTIONS });
        }
        let flags = u32_at(raw, field::FLAGS);
        let (needed, allowed) = kind.flags();
        if flags & needed != needed || flags & !(needed | allowed) != 0 {
            return Err(Error::BadHeader { offset: field::FLAGS as u32 });
        }
        let header = Header {
            kind,
            n_vertices: u32_at(raw, field::VERTICES),
            identity_dim: u32_at(raw, field::IDENTITY),
            pose_dim: u32_at(raw, field::POSE),
            identity_linear: flags & IDENTITY_LINEAR != 0,
            pose_linear: flags & POSE_LINEAR != 0,
            dual_quaternion: flags & DUAL_QUATERNION != 0,
        };
        header.check()?;
        Ok((header, sections as usize))
    }

    /// The header's bytes, with a checksum of zero.
    pub(super) fn bytes(&self, sections: u32, file_length: u64) -> [u8; HEADER_BYTES] {
        let mut raw = [0; HEADER_BYTES];
        let [identity, pose, dual] = [self.identity_linear, self.pose_linear, self.dual_quaternion].map(u32::from);
        let flags = (identity * IDENTITY_LINEAR) | (pose * POSE_LINEAR) | (dual * DUAL_QUATERNION);
        put(&mut raw, 0, &MAGIC);
        put(&mut raw, field::FILE_LENGTH, &file_length.to_le_bytes());
        for (offset, value) in [
            (field::VERSION, VERSION),
            (field::HEADER_LENGTH, HEADER_BYTES as u32),
            (field::KIND, self.kind as u32),
            (field::SECTIONS, sections),
            (field::VERTICES, self.n_vertices),
            (field::IDENTITY, self.identity_dim),
            (field::POSE, self.pose_dim),
            (field::FLAGS, flags),
            (field::UNIT, MILLIMETRE),
            (field::AXES, Y_UP),
        ] {
            put(&mut raw, offset, &value.to_le_bytes());
        }
        raw
    }
}

fn expect(raw: &[u8; HEADER_BYTES], offset: usize, value: u32) -> Result<(), Error> {
    if u32_at(raw, offset) == value { Ok(()) } else { Err(Error::BadHeader { offset: saturated(offset) }) }
}

/// The number at `offset`; zero behind the end, which the callers' constant offsets never reach.
pub(super) fn u32_at(raw: &[u8], offset: usize) -> u32 {
    raw.get(offset..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u32::from_le_bytes(*bytes))
}

/// As [`u32_at`], with eight bytes.
pub(super) fn u64_at(raw: &[u8], offset: usize) -> u64 {
    raw.get(offset..).and_then(|rest| rest.first_chunk()).map_or(0, |bytes| u64::from_le_bytes(*bytes))
}

/// Copies `bytes` to `offset`; what does not fit is dropped, which the callers' constant offsets never cause.
pub(super) fn put(raw: &mut [u8], offset: usize, bytes: &[u8]) {
    for (to, &from) in raw.iter_mut().skip(offset).zip(bytes) {
        *to = from;
    }
}
