//! An opened model file: checked once, then only views.

use super::content;
use super::crc::crc32;
use super::header::{Header, Kind, field, u32_at};
use super::section::{ElementType, Section, SectionId, Sections};
use super::view::{Faces, Floats, Indices, Lines};
use crate::Error;
use crate::generator::any::AnyGenerator;
use crate::generator::bilinear::Bilinear;
use crate::generator::linear::Linear;
use crate::generator::skinned::{Blend, CORRECTIONS, Skinned};
use crate::generator::wavelet::{self as local, Multiscale};
use crate::quantise::{F32, Storage};
use crate::skeleton::Skeleton;
use crate::skinning::Influences;
use crate::wavelet::{Grid, Wavelet};
use crate::workspace::{check_len, saturated};

/// Whether [`Model::open_with`] looks at the checksums of the sections. The header's is always checked, and so is all meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Checksums {
    /// Yes: one more pass over the file.
    Verify,
    /// No: for slow devices whose storage is trusted, and for hosts that have done it.
    Skip,
}

/// One of the two groups of weights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Who it is.
    Identity,
    /// Expression of a face, posture of a body.
    Pose,
}

/// Gaussian of a mode's weights over the training data (part of the model file).
#[derive(Debug, Clone, Copy)]
pub struct Gaussian<'a> {
    /// Mean, `d`.
    pub mean: Floats<'a>,
    /// Standard deviation by which each weight is measured, `d`: the weight at `t` standard deviations is `mean + t * scale`.
    pub scale: Floats<'a>,
    /// Inverse covariance, `d x d`, symmetric.
    pub precision: Floats<'a>,
}

/// Mean and standard deviation of each weight of a mode, whatever their covariance.
#[derive(Debug, Clone, Copy)]
pub struct Spread<'a> {
    /// Mean.
    pub mean: Floats<'a>,
    /// Standard deviation by which each weight is measured, above zero.
    pub scale: Floats<'a>,
}

impl<'a> Gaussian<'a> {
    /// Mean and scale alone.
    pub fn spread(&self) -> Spread<'a> {
        Spread { mean: self.mean, scale: self.scale }
    }

    /// Writes the weights at so many standard deviations from the mean, `mean + deviation * scale` each; 0 is the mean of the training data.
    ///
    /// Errors: `DimensionMismatch`, `NotFinite` when a deviation or a weight is not finite; `weights` is untouched then. Panics: never.
    pub fn weights_into(&self, deviations: &[f32], weights: &mut [f32]) -> Result<(), Error> {
        check_len(self.mean.len(), deviations.len())?;
        self.spread().weights_into(deviations, weights)
    }
}

impl Spread<'_> {
    /// As [`Gaussian::weights_into`], of the first weights, as many as there are deviations: a coarser level of a wavelet model has a prefix.
    ///
    /// Errors: as there; `DimensionMismatch` for more deviations than means. Panics: never.
    pub fn weights_into(&self, deviations: &[f32], weights: &mut [f32]) -> Result<(), Error> {
        check_len(self.mean.len().min(deviations.len()), deviations.len())?;
        check_len(deviations.len(), weights.len())?;
        let all = || {
            let statistics = self.mean.iter().zip(self.scale.iter());
            statistics.zip(deviations).map(|((mean, scale), deviation)| mean + deviation * scale)
        };
        if let Some(index) = all().position(|weight| !weight.is_finite()) {
            return Err(Error::NotFinite { index: saturated(index) });
        }
        for (to, weight) in weights.iter_mut().zip(all()) {
            *to = weight;
        }
        Ok(())
    }
}

/// A model file that has passed every check. Copying it copies views.
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    header: Header,
    sections: Sections<'a>,
}

impl<'a> Model<'a> {
    /// Checks the bytes of a model file and opens it in place. The bytes may have any alignment.
    ///
    /// Cost: one pass over the file for the checksums, one for the numbers. Nothing is copied.
    /// Errors: those of codes 3xx. Panics: never.
    pub fn open(bytes: &'a [u8]) -> Result<Self, Error> {
        Self::open_with(bytes, Checksums::Verify)
    }

    /// As [`Model::open`]; the checksums of the sections may be skipped, the header's is always checked.
    ///
    /// Errors: those of codes 3xx; with [`Checksums::Skip`] no `BadChecksum` of a section. Panics: never.
    pub fn open_with(bytes: &'a [u8], checksums: Checksums) -> Result<Self, Error> {
        let (header, count) = Header::read(bytes)?;
        let sections = Sections::new(bytes, count)?;
        let head = bytes.get(..field::CRC).unwrap_or_default();
        if crc32(&[head, sections.table()]) != u32_at(bytes, field::CRC) {
            return Err(Error::BadChecksum { section: 0 });
        }
        sections.check()?;
        for section in sections.iter() {
            if SectionId::from_u32(section.id).is_none() && !section.may_ignore {
                return Err(Error::UnknownSection { section: section.id });
            }
            if checksums == Checksums::Verify && crc32(&[section.bytes]) != section.crc {
                return Err(Error::BadChecksum { section: section.id });
            }
        }
        let model = Model { header, sections };
        content::check(&model)?;
        Ok(model)
    }

    /// Counts.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// All sections, also those that this library does not know.
    pub fn sections(&self) -> Sections<'a> {
        self.sections
    }

    /// How the coefficients are stored.
    pub fn element(&self) -> ElementType {
        self.known(SectionId::Coefficients).map_or(ElementType::F32, |section| section.element)
    }

    /// The generator of a bilinear model (equations 8.2 and 12.1) with coefficients in `f32`; [`Model::bilinear_in`] for the other storages.
    ///
    /// Errors: `WrongKind` (kind, or storage) for another model.
    pub fn bilinear(&self) -> Result<Bilinear<'a>, Error> {
        self.bilinear_in::<F32<'a>>()
    }

    /// The generator of a bilinear model in the storage of its file.
    ///
    /// Errors: as [`Model::bilinear`].
    pub fn bilinear_in<S: Storage<'a>>(&self) -> Result<Bilinear<'a, S>, Error> {
        self.expect_kind(Kind::Bilinear)?;
        Ok(Bilinear::new(self.header, self.storage()?))
    }

    /// The generator of a linear model (equation 9.1) in the storage of its file: [`F32`], [`F16`](crate::quantise::F16) or [`I8`](crate::quantise::I8).
    ///
    /// Errors: `WrongKind` (kind, or storage) for another model.
    pub fn linear<S: Storage<'a>>(&self) -> Result<Linear<'a, S>, Error> {
        self.expect_kind(Kind::Linear)?;
        Ok(Linear::new(self.header.n_vertices, self.header.identity_dim, 0, self.storage()?))
    }

    /// The generator of a skinned model (equations 9.1 to 9.3) in the storage of its file.
    ///
    /// Errors: `WrongKind` (kind, or storage) for another model.
    pub fn skinned<S: Storage<'a>>(&self) -> Result<Skinned<'a, Linear<'a, S>>, Error> {
        self.expect_kind(Kind::Skinned)?;
        let skeleton = self.skeleton()?;
        let corrections = if self.header.pose_linear { skeleton.n_joints() * CORRECTIONS } else { 0 };
        let identity = self.header.identity_dim;
        let rest = Linear::new(self.header.n_vertices, identity, saturated(corrections), self.storage()?);
        let starts = self.indices(SectionId::SkinStarts).unwrap_or_default();
        let joints = self.indices(SectionId::SkinJoints).unwrap_or_default();
        let weights = self.known(SectionId::SkinWeights).map_or(&[][..], |section| section.bytes);
        let blend = if self.header.dual_quaternion { Blend::DualQuaternion } else { Blend::Linear };
        Ok(Skinned::new(rest, skeleton, Influences::new(starts, joints, weights), blend))
    }

    /// The generator of a multilinear wavelet model (chapter 15) in the storage of its file.
    ///
    /// Errors: `WrongKind` (kind, or storage) for another model.
    pub fn wavelet<S: Storage<'a>>(&self) -> Result<Multiscale<local::Stored<'a, S>>, Error> {
        self.expect_kind(Kind::Wavelet)?;
        let grid = self.indices(SectionId::Grid).unwrap_or_default();
        let word = |index: usize| grid.get(index).unwrap_or(0) as usize;
        let wavelet = if word(3) == 0 { Wavelet::Cubic } else { Wavelet::Bilinear };
        let locals = local::Stored::new(self.header.identity_dim, self.header.pose_dim, self.storage()?);
        Ok(Multiscale::new(locals, Grid::new(word(0), word(1), word(2))?, wavelet))
    }

    /// The generator of a model of any kind and storage.
    ///
    /// Errors: none for a model that was opened.
    pub fn generator(&self) -> Result<AnyGenerator<'a>, Error> {
        use ElementType as Stored;
        Ok(match (self.header.kind, self.element()) {
            (Kind::Bilinear, Stored::F16) => AnyGenerator::BilinearF16(self.bilinear_in()?),
            (Kind::Bilinear, Stored::I8) => AnyGenerator::BilinearI8(self.bilinear_in()?),
            (Kind::Bilinear, _) => AnyGenerator::BilinearF32(self.bilinear_in()?),
            (Kind::Linear, Stored::F16) => AnyGenerator::LinearF16(self.linear()?),
            (Kind::Linear, Stored::I8) => AnyGenerator::LinearI8(self.linear()?),
            (Kind::Linear, _) => AnyGenerator::LinearF32(self.linear()?),
            (Kind::Skinned, Stored::F16) => AnyGenerator::SkinnedF16(self.skinned()?),
            (Kind::Skinned, Stored::I8) => AnyGenerator::SkinnedI8(self.skinned()?),
            (Kind::Skinned, _) => AnyGenerator::SkinnedF32(self.skinned()?),
            (Kind::Wavelet, Stored::F16) => AnyGenerator::WaveletF16(self.wavelet()?),
            (Kind::Wavelet, Stored::I8) => AnyGenerator::WaveletI8(self.wavelet()?),
            (Kind::Wavelet, _) => AnyGenerator::WaveletF32(self.wavelet()?),
        })
    }

    /// The skeleton of a skinned model.
    ///
    /// Errors: `Unsupported` when the model has none.
    pub fn skeleton(&self) -> Result<Skeleton<'a>, Error> {
        let absent = |id: SectionId| Error::Unsupported { section: id as u32 };
        let parents = self.indices(SectionId::JointParents).ok_or(absent(SectionId::JointParents))?;
        let axes = self.floats(SectionId::JointAxes).ok_or(absent(SectionId::JointAxes))?;
        let positions = self.floats(SectionId::JointPositions).ok_or(absent(SectionId::JointPositions))?;
        let basis = self.floats(SectionId::JointBasis).unwrap_or_default();
        Ok(Skeleton::new(
            parents,
            axes,
            positions,
            basis,
            self.header.identity_dim as usize,
            self.header.pose_dim as usize,
        ))
    }

    /// Lower and upper bounds of the pose weights of a skinned model (box prior), radians.
    pub fn pose_bounds(&self) -> Option<(Floats<'a>, Floats<'a>)> {
        Some((self.floats(SectionId::PoseLower)?, self.floats(SectionId::PoseUpper)?))
    }

    /// Name of each joint.
    pub fn joint_names(&self) -> Option<Lines<'a>> {
        self.lines(SectionId::JointNames)
    }

    /// How far a quantised model lies from the one it was made from, over random weights (see the specification), millimetres: mean, root of the mean
    /// square, and largest distance of a vertex.
    pub fn quantisation_error(&self) -> Option<[f32; 3]> {
        let errors = self.floats(SectionId::QuantisationError)?;
        Some([errors.get(0)?, errors.get(1)?, errors.get(2)?])
    }

    fn expect_kind(&self, kind: Kind) -> Result<(), Error> {
        let found = self.header.kind;
        if found == kind { Ok(()) } else { Err(Error::WrongKind { expected: kind as u32, found: found as u32 }) }
    }

    /// The coefficients in the storage that was asked for.
    fn storage<S: Storage<'a>>(&self) -> Result<S, Error> {
        let section = self.required(SectionId::Coefficients)?;
        if section.element != S::ELEMENT {
            return Err(Error::WrongKind { expected: S::ELEMENT as u32, found: section.element as u32 });
        }
        let bytes = |id: SectionId| self.known(id).map_or(&[][..], |section| section.bytes);
        Ok(S::new(section.bytes, bytes(SectionId::Offsets), bytes(SectionId::Ranges)))
    }

    /// Triangles.
    pub fn faces(&self) -> Option<Faces<'a>> {
        self.known(SectionId::Faces).map(|section| Faces::new(Indices::new(section.bytes)))
    }

    /// Vertex of each landmark.
    pub fn landmarks(&self) -> Option<Indices<'a>> {
        self.indices(SectionId::Landmarks)
    }

    /// Name of each landmark.
    pub fn landmark_names(&self) -> Option<Lines<'a>> {
        self.lines(SectionId::LandmarkNames)
    }

    /// Vertex of the other side, for each vertex.
    pub fn mirror(&self) -> Option<Indices<'a>> {
        self.indices(SectionId::Mirror)
    }

    /// Distribution of a mode's weights over the training data.
    pub fn gaussian(&self, mode: Mode) -> Option<Gaussian<'a>> {
        let [mean, scale, precision] = match mode {
            Mode::Identity => [SectionId::IdentityMean, SectionId::IdentityScale, SectionId::IdentityPrecision],
            Mode::Pose => [SectionId::PoseMean, SectionId::PoseScale, SectionId::PosePrecision],
        };
        Some(Gaussian { mean: self.floats(mean)?, scale: self.floats(scale)?, precision: self.floats(precision)? })
    }

    /// Mean and scale of each weight of a mode, of every coefficient in a wavelet model; also where there is no covariance ([`Model::gaussian`]).
    pub fn spread(&self, mode: Mode) -> Option<Spread<'a>> {
        let [mean, scale] = match mode {
            Mode::Identity => [SectionId::IdentityMean, SectionId::IdentityScale],
            Mode::Pose => [SectionId::PoseMean, SectionId::PoseScale],
        };
        Some(Spread { mean: self.floats(mean)?, scale: self.floats(scale)? })
    }

    /// Pose weights of each training expression, `pose_dim` numbers a row.
    pub fn pose_starts(&self) -> Option<Floats<'a>> {
        self.floats(SectionId::PoseStarts)
    }

    /// Name of each row of [`Model::pose_starts`].
    pub fn pose_names(&self) -> Option<Lines<'a>> {
        self.lines(SectionId::PoseNames)
    }

    /// Eigenvalues of a mode's covariance over the training data before truncation, mm^2.
    pub fn spectrum(&self, mode: Mode) -> Option<Floats<'a>> {
        self.floats(match mode {
            Mode::Identity => SectionId::IdentitySpectrum,
            Mode::Pose => SectionId::PoseSpectrum,
        })
    }

    /// What the model misses of shapes it has not learned from: principal components of its residuals, `3 n_vertices` numbers each, one
    /// standard deviation long, mm.
    pub fn remainder(&self) -> Option<Floats<'a>> {
        self.floats(SectionId::Remainder)
    }

    /// Where the model comes from.
    pub fn provenance(&self) -> Option<&'a str> {
        self.provenance_lines().map(|lines| lines.text())
    }

    /// The same by lines.
    pub fn provenance_lines(&self) -> Option<Lines<'a>> {
        self.lines(SectionId::Provenance)
    }

    pub(super) fn known(&self, id: SectionId) -> Option<Section<'a>> {
        self.sections.find(id as u32)
    }

    pub(super) fn required(&self, id: SectionId) -> Result<Section<'a>, Error> {
        self.known(id).ok_or(Error::MissingSection { section: id as u32 })
    }

    fn floats(&self, id: SectionId) -> Option<Floats<'a>> {
        self.known(id).map(|section| Floats::new(section.bytes))
    }

    fn indices(&self, id: SectionId) -> Option<Indices<'a>> {
        self.known(id).map(|section| Indices::new(section.bytes))
    }

    fn lines(&self, id: SectionId) -> Option<Lines<'a>> {
        // The bytes were found to be UTF-8 when the file was opened.
        self.known(id).and_then(|section| core::str::from_utf8(section.bytes).ok()).map(Lines::new)
    }
}
