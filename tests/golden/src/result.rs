//! What came of a case: numbers compared, bits that differ, and what went wrong.

use habitus_core::Error;

use crate::memory::Number;
use crate::text::{Case, decimal, hexadecimal};

/// Why a case could not be compared as written. Every one of these counts as a failure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Problem {
    /// The field is absent or not as the format asks.
    Text(&'static str),
    /// The kernel of the case is unknown.
    Kernel,
    /// The caller's memory is too small.
    Memory,
    /// The kernel gave another number of values than the vectors hold for the field.
    Count(&'static str),
    /// The kernel refused what it should accept, or for another reason than the vectors say.
    Refused(Error),
    /// The kernel accepted what it should refuse.
    Accepted,
    /// Nothing was compared.
    Nothing,
}

/// Where a result first differs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Difference {
    /// Field of the case.
    pub field: &'static str,
    /// Number in the field.
    pub index: u32,
    /// Bit pattern in the vectors.
    pub expected: u64,
    /// Bit pattern that the kernel gave.
    pub found: u64,
}

/// The result of one case.
#[derive(Debug, Clone, Copy)]
pub struct CaseResult<'t> {
    /// File of the vectors.
    pub file: &'t str,
    /// Kernel.
    pub kernel: &'t str,
    /// Name of the case.
    pub name: &'t str,
    /// Numbers that were compared.
    pub numbers: u32,
    /// Bits in which they differ.
    pub differing_bits: u32,
    /// The first number that differs.
    pub first: Option<Difference>,
    /// What else went wrong.
    pub problem: Option<Problem>,
}

impl CaseResult<'_> {
    /// All bits as they should be.
    pub fn is_equal(&self) -> bool {
        self.differing_bits == 0 && self.problem.is_none()
    }
}

/// Sums over all cases.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Summary {
    /// Cases.
    pub cases: u32,
    /// Cases that differ or have a problem.
    pub failed: u32,
    /// Numbers that were compared.
    pub numbers: u32,
    /// Bits in which they differ.
    pub differing_bits: u32,
}

impl Summary {
    pub(crate) fn add(&mut self, result: &CaseResult<'_>) {
        self.cases = self.cases.saturating_add(1);
        self.failed = self.failed.saturating_add(u32::from(!result.is_equal()));
        self.numbers = self.numbers.saturating_add(result.numbers);
        self.differing_bits = self.differing_bits.saturating_add(result.differing_bits);
    }
}

/// Compares one case.
pub(crate) struct Tally<'t> {
    case: Case<'t>,
    pub result: CaseResult<'t>,
}

impl<'t> Tally<'t> {
    pub fn new(file: &'t str, case: Case<'t>) -> Self {
        let Case { kernel, name, .. } = case;
        let result = CaseResult { file, kernel, name, numbers: 0, differing_bits: 0, first: None, problem: None };
        Tally { case, result }
    }

    /// Compares results with the field `key`, number by number.
    pub fn compare<R: Number>(&mut self, key: &'static str, found: &[R]) -> Result<(), Problem> {
        let expected = self.case.field(key).ok_or(Problem::Text(key))?.map(|word| hexadecimal(word, R::DIGITS));
        self.compare_bits(key, expected, found.iter().map(|number| number.bits()))
    }

    /// As [`Tally::compare`], with a part of the field that starts at `from`.
    pub fn compare_part<R: Number>(&mut self, key: &'static str, from: usize, found: &[R]) -> Result<(), Problem> {
        let values = self.case.field(key).ok_or(Problem::Text(key))?.skip(from).take(found.len());
        let expected = values.map(|word| hexadecimal(word, R::DIGITS));
        self.compare_bits(key, expected, found.iter().map(|number| number.bits()))
    }

    /// As [`Tally::compare`], with integers.
    pub fn compare_integers(&mut self, key: &'static str, found: &[u32]) -> Result<(), Problem> {
        let expected = self.case.field(key).ok_or(Problem::Text(key))?.map(|word| decimal(word).map(u64::from));
        self.compare_bits(key, expected, found.iter().map(|&number| u64::from(number)))
    }

    /// As [`Tally::compare_part`], with integers.
    pub fn compare_integers_part(&mut self, key: &'static str, from: usize, found: &[u32]) -> Result<(), Problem> {
        let values = self.case.field(key).ok_or(Problem::Text(key))?.skip(from).take(found.len());
        let expected = values.map(|word| decimal(word).map(u64::from));
        self.compare_bits(key, expected, found.iter().map(|&number| u64::from(number)))
    }

    fn compare_bits(
        &mut self,
        key: &'static str,
        mut expected: impl Iterator<Item = Option<u64>>,
        found: impl Iterator<Item = u64>,
    ) -> Result<(), Problem> {
        let mut index = 0;
        for found in found {
            let expected = expected.next().ok_or(Problem::Count(key))?.ok_or(Problem::Text(key))?;
            let bits = (expected ^ found).count_ones();
            if bits > 0 && self.result.first.is_none() {
                self.result.first = Some(Difference { field: key, index, expected, found });
            }
            self.result.numbers = self.result.numbers.saturating_add(1);
            self.result.differing_bits = self.result.differing_bits.saturating_add(bits);
            index = index.saturating_add(1);
        }
        if expected.next().is_some() { Err(Problem::Count(key)) } else { Ok(()) }
    }

    /// Ends the case with what its kernel said.
    pub fn finished(mut self, outcome: Result<(), Problem>) -> CaseResult<'t> {
        let refusal = self.case.field("error").is_some();
        let outcome = match outcome {
            Err(Problem::Refused(error)) if refusal => self.compare_integers("error", &numbers_of(error)),
            Ok(()) if refusal => Err(Problem::Accepted),
            Ok(()) if self.result.numbers == 0 => Err(Problem::Nothing),
            other => other,
        };
        self.result.problem = outcome.err();
        self.result
    }
}

impl From<Error> for Problem {
    fn from(error: Error) -> Self {
        Problem::Refused(error)
    }
}

/// Code and the two numbers of an error.
fn numbers_of(error: Error) -> [u32; 3] {
    let [first, second] = error.numbers();
    [error.code() as u32, first, second]
}
