//! Writes cases in the format that `habitus-golden` reads.

use std::fmt::Write;

use super::models::Model;
use crate::reference::Refusal;
use crate::reference::number::Number;

/// A file of cases.
pub struct File {
    text: String,
}

impl File {
    pub fn new(content: &str) -> Self {
        let text = format!(
            "# {content}\n# Written from the reference by `cargo run -p habitus-tests --bin write-vectors -- --write`.\n\
             # Format: tests/golden/src/text.rs.\n"
        );
        File { text }
    }

    pub fn case(&mut self, kernel: &str, name: &str) -> Case<'_> {
        writeln!(self.text, "\ncase {kernel} {name}").expect("strings grow");
        Case { text: &mut self.text }
    }

    pub fn text(self) -> String {
        self.text
    }
}

/// A case to which fields are added.
pub struct Case<'f> {
    text: &'f mut String,
}

impl Case<'_> {
    pub fn words(&mut self, key: &str, words: impl IntoIterator<Item = impl AsRef<str>>) -> &mut Self {
        let mut width = 2 + key.len();
        write!(self.text, "  {key}").expect("strings grow");
        for word in words {
            let word = word.as_ref();
            if width + 1 + word.len() > 120 {
                self.text.push_str("\n   ");
                width = 3;
            }
            self.text.push(' ');
            self.text.push_str(word);
            width += 1 + word.len();
        }
        self.text.push('\n');
        self
    }

    /// Which part of the model is meant.
    pub fn parts(&mut self, model: &Model) -> &mut Self {
        model.part.1.iter().fold(self, |case, (key, numbers)| case.integers(key, numbers.iter().copied()))
    }

    pub fn word(&mut self, key: &str, word: &str) -> &mut Self {
        self.words(key, [word])
    }

    pub fn numbers<'n, R: Number + 'n>(&mut self, key: &str, numbers: impl IntoIterator<Item = &'n R>) -> &mut Self {
        self.words(key, numbers.into_iter().map(|number| number.hexadecimal()))
    }

    pub fn number<R: Number>(&mut self, key: &str, number: R) -> &mut Self {
        self.words(key, [number.hexadecimal()])
    }

    pub fn integers(&mut self, key: &str, integers: impl IntoIterator<Item = u32>) -> &mut Self {
        self.words(key, integers.into_iter().map(|integer| integer.to_string()))
    }

    pub fn integer(&mut self, key: &str, integer: usize) -> &mut Self {
        self.words(key, [integer.to_string()])
    }

    /// Rows one after the other.
    pub fn rows<R: Number>(&mut self, key: &str, rows: &[Vec<R>]) -> &mut Self {
        self.numbers(key, rows.iter().flatten())
    }

    pub fn error(&mut self, refusal: Refusal) -> &mut Self {
        self.integers("error", refusal)
    }

    /// Bytes in words of 16, runs of zeros shortened.
    pub fn bytes(&mut self, key: &str, bytes: &[u8]) -> &mut Self {
        let mut words = Vec::new();
        let mut rest = bytes;
        while !rest.is_empty() {
            let zeros = rest.iter().take_while(|&&byte| byte == 0).count();
            if zeros > 4 {
                words.push(format!("00*{zeros}"));
                rest = &rest[zeros..];
                continue;
            }
            let end = (1..rest.len().min(16)).find(|&k| rest[k..].iter().take(5).filter(|&&b| b == 0).count() == 5);
            let (word, behind) = rest.split_at(end.unwrap_or(rest.len().min(16)));
            words.push(word.iter().map(|byte| format!("{byte:02x}")).collect());
            rest = behind;
        }
        self.words(key, words)
    }
}
