//! Errors of the kernel: small, `Copy`, without strings, with stable numbers shared with the C ABI.

use core::fmt;

/// What a function of the kernel refused to do, with the two numbers that say where.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// A slice has another length than the model asks for.
    DimensionMismatch {
        /// Length that was needed.
        expected: u32,
        /// Length that was given.
        found: u32,
    },
    /// An index or the end of a range is not below its limit.
    IndexOutOfRange {
        /// The index.
        index: u32,
        /// The first index that is too large.
        limit: u32,
    },
    /// A number is NaN or infinite.
    NotFinite {
        /// Its position in the slice that holds it.
        index: u32,
    },
    /// An option lies outside its allowed values.
    BadOption {
        /// Position of the option in the documentation of the call.
        option: u32,
    },
    /// Nothing to work with: no samples, no landmarks.
    Empty,
    /// A sample breaks a rule: its normal has not unit length, or it is at no vertex where one is asked for.
    BadSample {
        /// Its position among the samples.
        index: u32,
    },
    /// The output slice is too short.
    OutputTooSmall {
        /// Elements that were needed.
        needed: u32,
        /// Elements that were given.
        given: u32,
    },
    /// The workspace is too short.
    WorkspaceTooSmall {
        /// Floats that were needed.
        needed: u32,
        /// Floats that were given.
        given: u32,
    },
    /// The file ends too early, or is longer than its header says.
    Truncated {
        /// Bytes that the header asks for.
        needed: u32,
        /// Bytes that are there.
        found: u32,
    },
    /// Not a model file.
    BadMagic,
    /// A version of the format that this library does not know.
    UnknownVersion {
        /// The version.
        version: u32,
    },
    /// A checksum does not match.
    BadChecksum {
        /// Identifier of the section, 0 for the header.
        section: u32,
    },
    /// The header contradicts itself.
    BadHeader {
        /// Byte offset of the field.
        offset: u32,
    },
    /// A section's entry is wrong: element type, shape, offset, length, overlap, or given twice.
    BadSection {
        /// Identifier of the section.
        section: u32,
    },
    /// A section that must not be ignored is unknown to this library.
    UnknownSection {
        /// Identifier of the section.
        section: u32,
    },
    /// A section that this kind of model needs is absent.
    MissingSection {
        /// Identifier of the section.
        section: u32,
    },
    /// A section's content breaks a rule: an index too large, a matrix not symmetric, text not UTF-8.
    BadContent {
        /// Identifier of the section.
        section: u32,
        /// Position of the element in the section.
        index: u32,
    },
    /// A count exceeds the limit of the format.
    LimitExceeded {
        /// The count.
        found: u32,
        /// The largest allowed.
        limit: u32,
    },
    /// A Cholesky pivot is not positive: the matrix is not positive definite.
    NonPositivePivot {
        /// Row of the pivot.
        index: u32,
    },
    /// An iteration did not reach its tolerance.
    NotConverged {
        /// Iterations that were made.
        iterations: u32,
    },
    /// Points that do not determine a placement: fewer than three, or on a line.
    Degenerate,
    /// The model is of another kind, or its coefficients are stored in another way, than the function is for.
    WrongKind {
        /// The kind, or the element type, that the function is for.
        expected: u32,
        /// What the model has.
        found: u32,
    },
    /// A column of a least-squares problem depends on those before it, to rounding.
    RankDeficient {
        /// The column.
        index: u32,
    },
    /// The model has no such part, for instance no landmarks.
    Unsupported {
        /// Identifier of the section that would be needed.
        section: u32,
    },
}

/// Stable numbers of the errors: 1xx argument, 2xx buffer, 3xx file, 4xx numeric, 5xx unsupported. Never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Code {
    Ok = 0,
    DimensionMismatch = 101,
    IndexOutOfRange = 102,
    NotFinite = 103,
    BadOption = 104,
    Empty = 105,
    BadSample = 106,
    OutputTooSmall = 201,
    WorkspaceTooSmall = 202,
    Truncated = 301,
    BadMagic = 302,
    UnknownVersion = 303,
    BadChecksum = 304,
    BadHeader = 305,
    BadSection = 306,
    UnknownSection = 307,
    MissingSection = 308,
    BadContent = 309,
    LimitExceeded = 310,
    NonPositivePivot = 401,
    NotConverged = 402,
    Degenerate = 403,
    RankDeficient = 404,
    Unsupported = 501,
    WrongKind = 502,
}

impl Error {
    /// The stable number of this error.
    pub const fn code(self) -> Code {
        match self {
            Error::DimensionMismatch { .. } => Code::DimensionMismatch,
            Error::IndexOutOfRange { .. } => Code::IndexOutOfRange,
            Error::NotFinite { .. } => Code::NotFinite,
            Error::BadOption { .. } => Code::BadOption,
            Error::Empty => Code::Empty,
            Error::BadSample { .. } => Code::BadSample,
            Error::OutputTooSmall { .. } => Code::OutputTooSmall,
            Error::WorkspaceTooSmall { .. } => Code::WorkspaceTooSmall,
            Error::Truncated { .. } => Code::Truncated,
            Error::BadMagic => Code::BadMagic,
            Error::UnknownVersion { .. } => Code::UnknownVersion,
            Error::BadChecksum { .. } => Code::BadChecksum,
            Error::BadHeader { .. } => Code::BadHeader,
            Error::BadSection { .. } => Code::BadSection,
            Error::UnknownSection { .. } => Code::UnknownSection,
            Error::MissingSection { .. } => Code::MissingSection,
            Error::BadContent { .. } => Code::BadContent,
            Error::LimitExceeded { .. } => Code::LimitExceeded,
            Error::NonPositivePivot { .. } => Code::NonPositivePivot,
            Error::NotConverged { .. } => Code::NotConverged,
            Error::Degenerate => Code::Degenerate,
            Error::RankDeficient { .. } => Code::RankDeficient,
            Error::Unsupported { .. } => Code::Unsupported,
            Error::WrongKind { .. } => Code::WrongKind,
        }
    }
}

impl Error {
    /// The two numbers of the error in the order of their declaration, zero where it has fewer.
    pub const fn numbers(self) -> [u32; 2] {
        match self {
            Error::DimensionMismatch { expected, found } | Error::WrongKind { expected, found } => [expected, found],
            Error::IndexOutOfRange { index, limit } => [index, limit],
            Error::OutputTooSmall { needed, given } | Error::WorkspaceTooSmall { needed, given } => [needed, given],
            Error::Truncated { needed, found } => [needed, found],
            Error::BadContent { section, index } => [section, index],
            Error::LimitExceeded { found, limit } => [found, limit],
            Error::NotFinite { index }
            | Error::BadSample { index }
            | Error::NonPositivePivot { index }
            | Error::RankDeficient { index } => [index, 0],
            Error::BadOption { option } => [option, 0],
            Error::UnknownVersion { version } => [version, 0],
            Error::BadHeader { offset } => [offset, 0],
            Error::BadChecksum { section }
            | Error::BadSection { section }
            | Error::UnknownSection { section }
            | Error::MissingSection { section }
            | Error::Unsupported { section } => [section, 0],
            Error::NotConverged { iterations } => [iterations, 0],
            Error::Empty | Error::BadMagic | Error::Degenerate => [0, 0],
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Error::DimensionMismatch { expected, found } => write!(f, "expected {expected} values, found {found}"),
            Error::IndexOutOfRange { index, limit } => write!(f, "index {index} is not below {limit}"),
            Error::NotFinite { index } => write!(f, "value {index} is not finite"),
            Error::BadOption { option } => write!(f, "option {option} is outside its allowed values"),
            Error::BadSample { index } => {
                write!(
                    f,
                    "sample {index} has a normal that is not of unit length, or is at no vertex where one is asked for"
                )
            }
            Error::Empty => f.write_str("nothing to work with: no samples were given"),
            Error::OutputTooSmall { needed, given } => {
                write!(f, "the output holds {given} values, {needed} are needed")
            }
            Error::WorkspaceTooSmall { needed, given } => {
                write!(f, "the workspace holds {given} floats, {needed} are needed")
            }
            Error::Truncated { needed, found } => {
                write!(f, "the model file has {found} bytes where its header says {needed}")
            }
            Error::BadMagic => f.write_str("not a .hab model file"),
            Error::UnknownVersion { version } => {
                write!(f, "format version {version} is unknown; a newer library may read it")
            }
            Error::BadChecksum { section: 0 } => {
                f.write_str("the header's checksum does not match: the file is damaged")
            }
            Error::BadChecksum { section } => {
                write!(f, "the checksum of section {section} does not match: the file is damaged")
            }
            Error::BadHeader { offset } => write!(f, "the header is wrong at byte {offset}"),
            Error::BadSection { section } => write!(f, "the entry of section {section} is wrong"),
            Error::UnknownSection { section } => {
                write!(f, "section {section} is unknown and may not be ignored; a newer library may read it")
            }
            Error::MissingSection { section } => write!(f, "section {section} is missing"),
            Error::BadContent { section, index } => write!(f, "element {index} of section {section} is wrong"),
            Error::LimitExceeded { found, limit } => {
                write!(f, "a count of {found} exceeds the format's limit of {limit}")
            }
            Error::NonPositivePivot { index } => write!(f, "the matrix is not positive definite at row {index}"),
            Error::NotConverged { iterations } => write!(f, "no convergence after {iterations} iterations"),
            Error::Degenerate => f.write_str("the points do not determine a placement: fewer than three, or on a line"),
            Error::WrongKind { expected, found } => {
                write!(f, "the function is for models of kind or storage {expected}, this one has {found}")
            }
            Error::RankDeficient { index } => write!(f, "column {index} depends on those before it"),
            Error::Unsupported { section } => write!(f, "the model has no section {section}"),
        }
    }
}

impl core::error::Error for Error {}
