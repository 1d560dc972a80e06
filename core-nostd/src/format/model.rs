//! An opened model file: checked once, then only views.

use super::crc::crc32;
use super::header::{Header, field, u32_at};
use super::limits;
use super::section::{Section, SectionId, Sections};
use super::view::{Faces, Floats, Indices, Lines};
use crate::Error;
use crate::generator::bilinear::Bilinear;
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

impl Gaussian<'_> {
    /// Writes the weights at so many standard deviations from the mean, `mean + deviation * scale` each; 0 is the mean of the training data.
    ///
    /// Errors: `DimensionMismatch`, `NotFinite` when a deviation or a weight is not finite; `weights` is untouched then. Panics: never.
    pub fn weights_into(&self, deviations: &[f32], weights: &mut [f32]) -> Result<(), Error> {
        check_len(self.mean.len(), deviations.len())?;
        check_len(self.mean.len(), weights.len())?;
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

    /// As [`Model::open`]; the checksums of the sections may be skipped.
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
        model.check_content()?;
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

    /// The generator of a bilinear model (equations 8.2 and 12.1).
    pub fn bilinear(&self) -> Result<Bilinear<'a>, Error> {
        let section = self.required(SectionId::Coefficients)?;
        Bilinear::new(self.header, section.bytes)
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

    fn known(&self, id: SectionId) -> Option<Section<'a>> {
        self.sections.find(id as u32)
    }

    fn required(&self, id: SectionId) -> Result<Section<'a>, Error> {
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

    /// Step 6 of the specification: shapes, indices, numbers, texts.
    fn check_content(&self) -> Result<(), Error> {
        self.required(SectionId::Coefficients)?;
        for section in self.sections.iter() {
            if let Some(id) = SectionId::from_u32(section.id) {
                self.check_section(id, &section)?;
            }
        }
        for group in [
            [SectionId::IdentityMean, SectionId::IdentityScale, SectionId::IdentityPrecision],
            [SectionId::PoseMean, SectionId::PoseScale, SectionId::PosePrecision],
        ] {
            if group.iter().any(|&id| self.known(id).is_some()) {
                for id in group {
                    self.required(id)?;
                }
            }
        }
        if self.known(SectionId::LandmarkNames).is_some() {
            self.required(SectionId::Landmarks)?;
        }
        if self.known(SectionId::PoseNames).is_some() {
            self.required(SectionId::PoseStarts)?;
        }
        Ok(())
    }

    fn check_section(&self, id: SectionId, section: &Section<'a>) -> Result<(), Error> {
        let wrong = Error::BadSection { section: section.id };
        let (element, rank) = id.form();
        if section.element != element || section.rank != rank {
            return Err(wrong);
        }
        let [first, second, third, fourth] = section.shape;
        let header = &self.header;
        let (identity, pose) = (header.identity_dim, header.pose_dim);
        let shape_fits = match id {
            SectionId::Coefficients => {
                (first as usize, second as usize, third, fourth) == (header.n_blocks(), header.n_terms(), 3, 16)
            }
            SectionId::Remainder => second == header.n_vertices && third == 3 && first <= limits::MAX_ROWS,
            SectionId::Faces => second == 3 && first <= limits::MAX_FACES,
            SectionId::Landmarks => first <= limits::MAX_LANDMARKS,
            SectionId::Mirror => first == header.n_vertices,
            SectionId::IdentityMean | SectionId::IdentityScale => first == identity,
            SectionId::PoseMean | SectionId::PoseScale => first == pose,
            SectionId::IdentityPrecision => first == identity && second == identity,
            SectionId::PosePrecision => first == pose && second == pose,
            SectionId::PoseStarts => second == pose && first <= limits::MAX_ROWS,
            SectionId::IdentitySpectrum | SectionId::PoseSpectrum => first <= limits::MAX_ROWS,
            SectionId::LandmarkNames | SectionId::PoseNames | SectionId::Provenance => first <= limits::MAX_TEXT,
        };
        if !shape_fits {
            return Err(wrong);
        }
        let bad = |index: usize| Error::BadContent { section: section.id, index: saturated(index) };
        let (floats, indices) = (Floats::new(section.bytes), Indices::new(section.bytes));
        let found = match id {
            SectionId::Coefficients => first_beyond(section.bytes),
            SectionId::Faces | SectionId::Landmarks => indices.iter().position(|vertex| vertex >= header.n_vertices),
            SectionId::Mirror => indices.iter().enumerate().position(|(vertex, other)| {
                indices.get(other as usize).and_then(|back| usize::try_from(back).ok()) != Some(vertex)
            }),
            SectionId::IdentityScale | SectionId::PoseScale => {
                floats.iter().position(|scale| !(scale > 0.0 && scale.is_finite()))
            }
            SectionId::IdentityPrecision | SectionId::PosePrecision => first_asymmetry(floats, first as usize),
            SectionId::IdentitySpectrum | SectionId::PoseSpectrum => {
                let mut last = f32::INFINITY;
                floats.iter().position(|value| {
                    let fits = value.is_finite() && value >= 0.0 && value <= last;
                    last = value;
                    !fits
                })
            }
            SectionId::IdentityMean | SectionId::PoseMean | SectionId::PoseStarts | SectionId::Remainder => {
                let lengths = matches!(id, SectionId::Remainder);
                let limit = if lengths { limits::MAX_COEFFICIENT } else { limits::MAX_WEIGHT };
                floats.iter().position(|value| !(value.abs() <= limit))
            }
            SectionId::LandmarkNames => self.first_wrong_text(section, self.landmarks().map(|all| all.len())),
            SectionId::PoseNames => {
                self.first_wrong_text(section, self.pose_starts().map(|all| all.len() / (pose as usize).max(1)))
            }
            SectionId::Provenance => self.first_wrong_text(section, None),
        };
        found.map_or(Ok(()), |index| Err(bad(index)))
    }

    /// First byte that is not UTF-8, or the length when the number of lines is not `expected`.
    fn first_wrong_text(&self, section: &Section<'a>, expected: Option<usize>) -> Option<usize> {
        match core::str::from_utf8(section.bytes) {
            Err(error) => Some(error.valid_up_to()),
            Ok(text) => {
                let lines = text.bytes().filter(|&byte| byte == b'\n').count() + 1;
                (expected.is_some_and(|expected| expected != lines)).then_some(section.bytes.len())
            }
        }
    }
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
