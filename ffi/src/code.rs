//! Error codes: the kernel's, and those of what only C can do wrong.

use core::ffi::{CStr, c_char};

use habitus_core::{Code, Error};

use crate::memory::Arguments;

/// Defines the codes once: name, number, meaning.
macro_rules! codes {
    ($($(#[doc = $meaning:literal])+ $name:ident = $number:literal,)*) => {
        /// What a function returns. Numbers are never given out again: 1xx argument, 2xx buffer, 3xx model file, 4xx numeric, 5xx unsupported.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        #[repr(i32)]
        pub enum hab_code {
            $($(#[doc = $meaning])+ $name = $number,)*
        }

        /// Every code with its name and its meaning.
        pub const CODES: &[(hab_code, &CStr, &CStr)] = &[$((
            hab_code::$name,
            c_string(concat!(stringify!($name), "\0")),
            trimmed(c_string(concat!($($meaning,)+ "\0"))),
        )),*];
    };
}

const fn c_string(text: &str) -> &CStr {
    match CStr::from_bytes_with_nul(text.as_bytes()) {
        Ok(text) => text,
        Err(_) => c"",
    }
}

/// Without the space that a documentation comment begins with.
const fn trimmed(text: &CStr) -> &CStr {
    match text.to_bytes_with_nul().split_first() {
        Some((b' ', rest)) => match CStr::from_bytes_with_nul(rest) {
            Ok(text) => text,
            Err(_) => text,
        },
        _ => text,
    }
}

codes! {
    /// Done.
    HAB_OK = 0,
    /// Argument {argument} has {second} elements where {first} are needed.
    HAB_DIMENSION_MISMATCH = 101,
    /// An index or the end of a range is {first}; the limit is {second}.
    HAB_INDEX_OUT_OF_RANGE = 102,
    /// Number {first} is NaN, infinite or too large.
    HAB_NOT_FINITE = 103,
    /// Option {first} is outside its allowed values.
    HAB_BAD_OPTION = 104,
    /// There is nothing to work with: no samples, no landmarks.
    HAB_EMPTY = 105,
    /// Sample {first} has a normal that is not of unit length, or is at no vertex where one is asked for.
    HAB_BAD_SAMPLE = 106,
    /// Argument {first} is null.
    HAB_NULL_POINTER = 111,
    /// Argument {first} was not opened or prepared by this library, or was overwritten since.
    HAB_NOT_OPENED = 112,
    /// Argument {first} says in struct_bytes that it has {second} bytes, a size that this library does not know.
    HAB_BAD_STRUCT = 113,
    /// The output holds {second} elements; {first} are needed.
    HAB_OUTPUT_TOO_SMALL = 201,
    /// The workspace holds {second} floats; {first} are needed.
    HAB_WORKSPACE_TOO_SMALL = 202,
    /// Arguments {first} and {second} overlap, and one of them is written.
    HAB_OVERLAP = 211,
    /// Argument {first} is not aligned to {second} bytes.
    HAB_MISALIGNED = 212,
    /// The length of argument {first} exceeds the address space.
    HAB_BAD_LENGTH = 213,
    /// The model file has {second} bytes where {first} are expected: by its header, or for one.
    HAB_TRUNCATED = 301,
    /// These bytes are no .hab model file.
    HAB_BAD_MAGIC = 302,
    /// Format version {first} is unknown; a newer library may read it.
    HAB_UNKNOWN_VERSION = 303,
    /// The checksum of section {first} (0: the header) does not match: the file is damaged.
    HAB_BAD_CHECKSUM = 304,
    /// The header is wrong at byte {first}.
    HAB_BAD_HEADER = 305,
    /// The entry of section {first} is wrong.
    HAB_BAD_SECTION = 306,
    /// Section {first} is unknown and must not be ignored; a newer library may read it.
    HAB_UNKNOWN_SECTION = 307,
    /// Section {first} is missing.
    HAB_MISSING_SECTION = 308,
    /// Element {second} of section {first} is wrong.
    HAB_BAD_CONTENT = 309,
    /// A count of {first} exceeds the format's limit of {second}.
    HAB_LIMIT_EXCEEDED = 310,
    /// A matrix is not positive definite at row {first}.
    HAB_NON_POSITIVE_PIVOT = 401,
    /// An iteration did not converge within {first} steps.
    HAB_NOT_CONVERGED = 402,
    /// The points do not determine a placement: fewer than three, or on a line.
    HAB_DEGENERATE = 403,
    /// The model has no section {first}.
    HAB_UNSUPPORTED = 501,
    /// The function is for models of kind {first}; this one is of kind {second}.
    HAB_WRONG_KIND = 502,
    /// The vertices share a state of {first} floats: use hab_evaluation_init.
    HAB_NEEDS_EVALUATION = 511,
    /// The model has no section {first}, a covariance: use hab_fit_levels, or HAB_PRIOR_BOX.
    HAB_NEEDS_LEVELS = 512,
    /// A fault of this library; please report it.
    HAB_INTERNAL = 901,
}

/// What a failed call adds to its code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct hab_error_detail {
    /// The code that the call returned.
    pub code: i32,
    /// First number of the code, see hab_code; 0 when it has none.
    pub first: u32,
    /// Second number of the code.
    pub second: u32,
    /// Position, from 1, of the argument that the code speaks of: the pointer's where a slice is meant; 0 where it speaks of none.
    pub argument: u32,
}

/// Why a call did nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Refusal {
    Kernel(Error),
    NullPointer { argument: u32 },
    NotOpened { argument: u32 },
    BadStruct { argument: u32, bytes: u32 },
    Overlap { arguments: [u32; 2] },
    Misaligned { argument: u32, alignment: u32 },
    BadLength { argument: u32 },
    Length { argument: u32, expected: usize, found: usize },
    NeedsEvaluation { floats: usize },
    NeedsLevels { section: u32 },
    Internal,
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Refusal::Kernel(error)
    }
}

impl Refusal {
    /// Code and numbers as C sees them.
    pub(crate) fn detail(self) -> (hab_code, [u32; 2]) {
        match self {
            Refusal::Kernel(error) => (code_of(error.code()), error.numbers()),
            Refusal::NullPointer { argument } => (hab_code::HAB_NULL_POINTER, [argument, 0]),
            Refusal::NotOpened { argument } => (hab_code::HAB_NOT_OPENED, [argument, 0]),
            Refusal::BadStruct { argument, bytes } => (hab_code::HAB_BAD_STRUCT, [argument, bytes]),
            Refusal::Overlap { arguments } => (hab_code::HAB_OVERLAP, arguments),
            Refusal::Misaligned { argument, alignment } => (hab_code::HAB_MISALIGNED, [argument, alignment]),
            Refusal::BadLength { argument } => (hab_code::HAB_BAD_LENGTH, [argument, 0]),
            Refusal::Length { expected, found, .. } => {
                (hab_code::HAB_DIMENSION_MISMATCH, [expected, found].map(|len| u32::try_from(len).unwrap_or(u32::MAX)))
            }
            Refusal::NeedsEvaluation { floats } => {
                (hab_code::HAB_NEEDS_EVALUATION, [u32::try_from(floats).unwrap_or(u32::MAX), 0])
            }
            Refusal::NeedsLevels { section } => (hab_code::HAB_NEEDS_LEVELS, [section, 0]),
            Refusal::Internal => (hab_code::HAB_INTERNAL, [0, 0]),
        }
    }

    /// The argument that it speaks of, from 1; 0 for none.
    pub(crate) fn argument(self) -> u32 {
        match self {
            Refusal::Kernel(_) | Refusal::NeedsEvaluation { .. } | Refusal::NeedsLevels { .. } | Refusal::Internal => 0,
            Refusal::Overlap { arguments: [argument, _] }
            | Refusal::NullPointer { argument }
            | Refusal::NotOpened { argument }
            | Refusal::BadStruct { argument, .. }
            | Refusal::Misaligned { argument, .. }
            | Refusal::BadLength { argument }
            | Refusal::Length { argument, .. } => argument,
        }
    }
}

/// `Ok` when a slice has the length that is asked for; `argument` is the position of its pointer.
pub(crate) fn length(argument: u32, expected: usize, found: usize) -> Result<(), Refusal> {
    if expected == found { Ok(()) } else { Err(Refusal::Length { argument, expected, found }) }
}

/// C's code of a code of the kernel; they have the same numbers.
fn code_of(code: Code) -> hab_code {
    known(code as i32).map_or(hab_code::HAB_INTERNAL, |(code, ..)| *code)
}

fn known(code: i32) -> Option<&'static (hab_code, &'static CStr, &'static CStr)> {
    CODES.iter().find(|(known, ..)| *known as i32 == code)
}

/// Name of a code as in this header, for instance "HAB_NOT_FINITE"; "HAB_UNKNOWN_CODE" for a number that is none. The text is static and ends in a zero byte.
#[unsafe(no_mangle)]
pub extern "C" fn hab_error_name(code: i32) -> *const c_char {
    known(code).map_or(c"HAB_UNKNOWN_CODE", |(_, name, _)| name).as_ptr()
}

/// Meaning of a code in one sentence. The text is static and ends in a zero byte.
#[unsafe(no_mangle)]
pub extern "C" fn hab_error_message(code: i32) -> *const c_char {
    known(code).map_or(c"This number is no code of this library.", |(.., meaning)| meaning).as_ptr()
}

/// Writes what went wrong as one line, numbers included, ended by a zero byte and cut where the text is too small; 160 bytes hold every line.
///
/// Returns HAB_OK, HAB_NULL_POINTER, HAB_MISALIGNED, HAB_OVERLAP, HAB_BAD_LENGTH, or HAB_OUTPUT_TOO_SMALL for a text of no bytes.
///
/// # Safety
/// `detail` points to a detail that a call has filled in, `text` to `text_bytes` writable bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn hab_error_format(
    detail: *const hab_error_detail,
    text: *mut c_char,
    text_bytes: usize,
) -> hab_code {
    let mut arguments = Arguments::new();
    let mut run = || {
        let detail = arguments.object(1, detail);
        let text = arguments.output(2, text.cast::<u8>(), text_bytes);
        arguments.compared()?;
        // SAFETY: the caller's promise; what can be checked has been.
        let (detail, text) = unsafe { (*detail.get(), text.slice()) };
        let Some((_, rest)) = text.split_last_mut() else {
            return Err(Refusal::Kernel(Error::OutputTooSmall { needed: 1, given: 0 }));
        };
        let used = Line { rest: rest.iter_mut(), used: 0 }.sentence(&detail);
        if let Some(end) = text.get_mut(used) {
            *end = 0;
        }
        Ok(())
    };
    match run() {
        Ok(()) => hab_code::HAB_OK,
        Err(refusal) => refusal.detail().0,
    }
}

/// A line of text that is cut at the end of its memory. Formatting machinery of `core::fmt` would be larger than the kernel on a microcontroller.
struct Line<'a> {
    rest: core::slice::IterMut<'a, u8>,
    used: usize,
}

impl Line<'_> {
    /// Writes name and meaning of a code with its numbers; returns the bytes written.
    fn sentence(mut self, detail: &hab_error_detail) -> usize {
        let Some((_, name, meaning)) = known(detail.code) else {
            self.text(b"no code of this library");
            return self.used;
        };
        self.text(name.to_bytes());
        self.text(b": ");
        let mut rest = meaning.to_bytes();
        while let Some((&byte, behind)) = rest.split_first() {
            rest = if let Some(behind) = rest.strip_prefix(b"{first}") {
                self.number(detail.first);
                behind
            } else if let Some(behind) = rest.strip_prefix(b"{argument}") {
                self.number(detail.argument);
                behind
            } else if let Some(behind) = rest.strip_prefix(b"{second}") {
                self.number(detail.second);
                behind
            } else {
                self.byte(byte);
                behind
            };
        }
        self.used
    }

    fn text(&mut self, text: &[u8]) {
        text.iter().for_each(|&byte| self.byte(byte));
    }

    fn number(&mut self, number: u32) {
        let mut power = 1_000_000_000;
        while power > 0 {
            if number >= power || power == 1 {
                self.byte(b'0' + (number / power % 10) as u8);
            }
            power /= 10;
        }
    }

    fn byte(&mut self, byte: u8) {
        if let Some(to) = self.rest.next() {
            *to = byte;
            self.used += 1;
        }
    }
}
