//! The format of the vectors.
//!
//! ```text
//! # comment
//! case KERNEL NAME
//!   key value value ...
//!     value ...               continues the field above
//! ```
//!
//! Values are separated by spaces: integers in decimal; `f32` and `f64` as 8 and 16 hexadecimal digits of their bit pattern, or `0` for a
//! pattern of zeros; bytes as pairs of digits, where `00*K` stands for K zero bytes. A file consists of lines that end in a line feed.

/// The lines of a text, without `str::lines`, whose searcher keeps a panic path in small programs.
#[derive(Debug, Clone, Copy)]
struct Lines<'t> {
    rest: &'t str,
}

impl<'t> Iterator for Lines<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.bytes().position(|byte| byte == b'\n').unwrap_or(self.rest.len());
        let line = self.rest.get(..end)?;
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        Some(line)
    }
}

/// The words of a line.
#[derive(Debug, Clone, Copy)]
struct Words<'t> {
    rest: &'t str,
}

impl<'t> Iterator for Words<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        let start = self.rest.bytes().position(|byte| byte != b' ')?;
        let rest = self.rest.get(start..)?;
        let end = rest.bytes().position(|byte| byte == b' ').unwrap_or(rest.len());
        self.rest = rest.get(end..).unwrap_or_default();
        rest.get(..end)
    }
}

/// One case: a kernel, a name, and fields.
#[derive(Debug, Clone, Copy)]
pub struct Case<'t> {
    /// What is computed.
    pub kernel: &'t str,
    /// Which case of it.
    pub name: &'t str,
    body: Lines<'t>,
}

impl<'t> Case<'t> {
    /// The values of a field; `None` without such a field.
    pub fn field(&self, key: &str) -> Option<Values<'t>> {
        let mut lines = self.body;
        while let Some(line) = lines.next() {
            if line.starts_with("case ") {
                return None;
            }
            let mut words = Words { rest: line };
            if !line.starts_with("    ") && line.starts_with("  ") && words.next() == Some(key) {
                return Some(Values { words, lines });
            }
        }
        None
    }

    /// The text of the case's own fields, without the empty lines behind them.
    pub(crate) fn fields(&self) -> &'t str {
        let (mut lines, mut end) = (self.body, 0);
        loop {
            let start = self.body.rest.len() - lines.rest.len();
            match lines.next() {
                Some(line) if line.starts_with("case ") => break,
                Some("") => {}
                Some(line) => end = start + line.len(),
                None => break,
            }
        }
        self.body.rest.get(..end).unwrap_or_default()
    }

    /// The case with other fields.
    pub(crate) fn with_fields<'f>(&self, fields: &'f str) -> Case<'f>
    where
        't: 'f,
    {
        Case { kernel: self.kernel, name: self.name, body: Lines { rest: fields } }
    }

    /// The first value of a field.
    pub fn word(&self, key: &str) -> Option<&'t str> {
        self.field(key)?.next()
    }
}

/// The cases of a file.
#[derive(Debug, Clone, Copy)]
pub struct Cases<'t> {
    lines: Lines<'t>,
}

impl<'t> Cases<'t> {
    /// The cases of a text.
    pub fn new(text: &'t str) -> Self {
        Cases { lines: Lines { rest: text } }
    }
}

impl<'t> Iterator for Cases<'t> {
    type Item = Case<'t>;

    fn next(&mut self) -> Option<Case<'t>> {
        loop {
            let mut words = Words { rest: self.lines.next()? };
            if words.next() == Some("case") {
                let (kernel, name) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
                return Some(Case { kernel, name, body: self.lines });
            }
        }
    }
}

/// The values of a field.
#[derive(Debug, Clone, Copy)]
pub struct Values<'t> {
    words: Words<'t>,
    lines: Lines<'t>,
}

impl<'t> Iterator for Values<'t> {
    type Item = &'t str;

    fn next(&mut self) -> Option<&'t str> {
        loop {
            if let Some(word) = self.words.next() {
                return Some(word);
            }
            let line = self.lines.next()?;
            if !line.starts_with("    ") {
                // Anything else ends the field for good.
                self.lines.rest = "";
                return None;
            }
            self.words.rest = line;
        }
    }
}

/// A decimal integer.
pub fn decimal(word: &str) -> Option<u32> {
    if word.is_empty() {
        return None;
    }
    word.bytes().try_fold(0u32, |value, digit| {
        let digit = u32::from(digit.checked_sub(b'0').filter(|&digit| digit < 10)?);
        value.checked_mul(10)?.checked_add(digit)
    })
}

/// Hexadecimal digits, exactly so many, or a single zero.
pub fn hexadecimal(word: &str, digits: usize) -> Option<u64> {
    if word == "0" {
        return Some(0);
    }
    if word.len() != digits || digits > 16 {
        return None;
    }
    word.bytes().try_fold(0u64, |value, digit| {
        let digit = match digit {
            b'0'..=b'9' => digit - b'0',
            b'a'..=b'f' => digit - b'a' + 10,
            _ => return None,
        };
        Some(value << 4 | u64::from(digit))
    })
}
