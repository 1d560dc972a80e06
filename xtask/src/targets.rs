//! The targets beside the host: for each its compiler's name, the C compiler, and what runs its programs here.

use crate::process::{Result, output};
use std::path::Path;
use std::process::Command;

/// A target for which `no_std` code is built and run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// Cortex-M4F and M7F, without an operating system.
    CortexM,
    /// wasm without a system interface.
    Wasm,
    /// AArch64 under Linux.
    AArch64,
    /// s390x under Linux: big endian.
    BigEndian,
}

impl Target {
    /// Rust's name.
    pub const fn triple(self) -> &'static str {
        match self {
            Target::CortexM => "thumbv7em-none-eabihf",
            Target::Wasm => "wasm32-unknown-unknown",
            Target::AArch64 => "aarch64-unknown-linux-gnu",
            Target::BigEndian => "s390x-unknown-linux-gnu",
        }
    }

    /// The folder of its builds below the build folder.
    pub const fn folder(self) -> &'static str {
        match self {
            Target::CortexM => "firmware",
            Target::Wasm => "wasm",
            Target::AArch64 => "aarch64",
            Target::BigEndian => "big-endian",
        }
    }

    /// The name for tables.
    pub const fn title(self) -> &'static str {
        match self {
            Target::CortexM => "Cortex-M4F",
            Target::Wasm => "wasm",
            Target::AArch64 => "AArch64",
            Target::BigEndian => "s390x, big endian",
        }
    }

    /// The prefix of the GNU tools; wasm has none.
    const fn gnu_prefix(self) -> Option<&'static str> {
        match self {
            Target::CortexM => Some("arm-none-eabi"),
            Target::Wasm => None,
            Target::AArch64 => Some("aarch64-linux-gnu"),
            Target::BigEndian => Some("s390x-linux-gnu"),
        }
    }

    /// The C compiler's name; none for wasm, whose modules no C program is linked with.
    pub fn c_compiler_name(self) -> Option<String> {
        self.gnu_prefix().map(|prefix| format!("{prefix}-gcc"))
    }

    /// The C compiler, set to the processor that Rust compiles for. Fails with a remedy when it is missing.
    pub fn c_compiler(self) -> Result<Command> {
        let name = self.c_compiler_name().ok_or_else(|| format!("no C compiler is used for {}", self.title()))?;
        let packages = match self {
            Target::CortexM => "gcc-arm-none-eabi libnewlib-arm-none-eabi",
            Target::Wasm => "",
            Target::AArch64 => "gcc-aarch64-linux-gnu libc6-dev-arm64-cross",
            Target::BigEndian => "gcc-s390x-linux-gnu libc6-dev-s390x-cross",
        };
        // Newlib serves its headers and its library for bare metal apart from the compiler; so do the cross C libraries.
        let proof = if self == Target::CortexM { "-print-file-name=libc.a" } else { "-print-file-name=crt1.o" };
        let found = output(Command::new(&name).arg(proof));
        if !found.is_some_and(|path| Path::new(path.trim()).is_file()) {
            return Err(format!("{name} or its C library is missing: on Debian `apt-get install {packages}`").into());
        }
        let mut command = Command::new(&name);
        if self == Target::CortexM {
            command.args(["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]);
        }
        Ok(command)
    }

    /// What runs a program: append the program's path (for wasm a script of node, then its arguments; without an operating system a board comes
    /// first, see [`Board::emulator`](crate::boards::Board::emulator)). Fails with a remedy when it is missing.
    pub fn emulator(self) -> Result<Command> {
        let (name, remedy) = match self {
            Target::CortexM => ("qemu-system-arm", "on Debian `apt-get install qemu-system-arm`"),
            Target::Wasm => ("node", "Node.js 18 or newer, on Debian `apt-get install nodejs`"),
            Target::AArch64 => ("qemu-aarch64", "on Debian `apt-get install qemu-user`"),
            Target::BigEndian => ("qemu-s390x", "on Debian `apt-get install qemu-user`"),
        };
        if output(Command::new(name).arg("--version")).is_none() {
            return Err(format!("{name} is missing: {remedy}").into());
        }
        Ok(Command::new(name))
    }

    /// Name and version of [`Target::emulator`].
    pub fn emulator_version(self) -> Result<String> {
        let command = self.emulator()?;
        let version = output(Command::new(command.get_program()).arg("--version")).unwrap_or_default();
        Ok(format!("{} {}", command.get_program().display(), number(&version)))
    }
}

/// The first word of a text that looks like a version.
pub fn number(text: &str) -> String {
    let words = text.split_whitespace().map(|word| word.trim_start_matches('v').trim_end_matches(')'));
    let mut numbers = words.filter(|word| word.starts_with(|first: char| first.is_ascii_digit()) && word.contains('.'));
    numbers.next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn the_version_is_found_in_what_tools_print() {
        assert_eq!(number("aarch64-linux-gnu-gcc (Debian 12.2.0-14) 12.2.0"), "12.2.0-14");
        assert_eq!(number("qemu-s390x version 7.2.22 (Debian 1:7.2+dfsg-7)\nCopyright 2003"), "7.2.22");
        assert_eq!(number("v20.20.2\n"), "20.20.2");
        assert_eq!(number("rustc 1.96.0 (ac68faa20 2026-05-25)"), "1.96.0");
        assert_eq!(number("no version here"), "");
    }
}
