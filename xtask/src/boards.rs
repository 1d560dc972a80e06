//! The emulated boards: each its processor, its memory for models, and how QEMU runs a program on it.

use crate::process::Result;
use crate::targets::Target;
use object::{Object, ObjectSection, ObjectSymbol};
use std::ops::Range;
use std::process::Command;

/// A board of ARM's MPS2+ series, as QEMU models it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Board {
    /// With a Cortex-M4F.
    An386,
    /// With a Cortex-M7.
    An500,
}

/// The memory that a program may write: stack, statics, workspace, output.
const RAM: Range<u64> = 0x2000_0000..0x2001_0000;
/// What the program of the golden vectors gets instead.
const WIDE_RAM: Range<u64> = 0x2000_0000..0x2040_0000;
/// Memory for code and constants.
const CODE: Range<u64> = 0..0x40_0000;

impl Board {
    /// Each.
    pub const ALL: [Board; 2] = [Board::An386, Board::An500];

    /// QEMU's name; the name of a folder of examples/firmware/boards, too.
    pub const fn name(self) -> &'static str {
        match self {
            Board::An386 => "mps2-an386",
            Board::An500 => "mps2-an500",
        }
    }

    /// The processor, for tables.
    pub const fn processor(self) -> &'static str {
        match self {
            Board::An386 => "Cortex-M4F",
            Board::An500 => "Cortex-M7",
        }
    }

    /// The folder of the programs linked for it, below the build folder.
    pub const fn folder(self) -> &'static str {
        match self {
            Board::An386 => "firmware-m4f",
            Board::An500 => "firmware-m7",
        }
    }

    /// Where models lie.
    const fn psram(self) -> Range<u64> {
        match self {
            Board::An386 => 0x2100_0000..0x2200_0000,
            Board::An500 => 0x6000_0000..0x6100_0000,
        }
    }

    /// The command that runs a program: append its path. With `counted` the emulated time is that of instructions, 64 ns each.
    pub fn emulator(self, counted: bool) -> Result<Command> {
        let mut command = Target::CortexM.emulator()?;
        command.args(["-M", self.name()]).args(OPTIONS.split_whitespace());
        if counted {
            command.args(["-icount", "shift=6,align=off,sleep=off"]);
        }
        command.arg("-kernel");
        Ok(command)
    }

    /// What of a linked program lies elsewhere than it should; `wide`: it may use all RAM.
    pub fn misplaced(self, file: &object::File<'_>, wide: bool) -> Vec<String> {
        let ram = if wide { WIDE_RAM } else { RAM };
        let regions = [(".vectors", CODE), (".text", CODE), (".rodata", CODE), (".models", self.psram())];
        let regions = regions.into_iter().chain([".stack", ".data", ".bss"].map(|name| (name, ram.clone())));
        let mut found = Vec::new();
        for (name, region) in regions {
            let Some(section) = file.section_by_name(name).filter(|section| section.size() > 0) else { continue };
            let (from, to) = (section.address(), section.address() + section.size());
            if from < region.start || to > region.end {
                found.push(format!("{name} lies at {from:#x}..{to:#x}, not in {region:#x?}", region = region));
            }
        }
        let symbol = |name| file.symbols().find(|symbol| symbol.name() == Ok(name)).map(|symbol| symbol.address());
        for (name, wanted) in [("_stack_bottom", ram.start), ("_memory_end", ram.end)] {
            if symbol(name) != Some(wanted) {
                found.push(format!("{name} is {:#x?}, not {wanted:#x}", symbol(name)));
            }
        }
        found
    }
}

/// What every program is run with; the same words as the `runner` in examples/firmware/.cargo/config.toml.
const OPTIONS: &str = "-nographic -monitor none -serial none -chardev stdio,id=out \
                       -semihosting-config enable=on,target=native,chardev=out";

#[cfg(test)]
mod tests {
    use super::{Board, OPTIONS, RAM};
    use crate::process::project;

    fn text(path: &str) -> String {
        std::fs::read_to_string(project().join("examples/firmware").join(path)).expect("a file of the project")
    }

    #[test]
    fn the_linker_scripts_have_the_same_memories() {
        for board in Board::ALL {
            let script = text(&format!("boards/{}/memory.ld", board.name()));
            let (psram, ram) = (board.psram(), RAM);
            let says =
                |region: &str, rest: String| script.lines().any(|line| line.contains(region) && line.contains(&rest));
            let mib = (psram.end - psram.start) >> 20;
            assert!(says("PSRAM (r)", format!("ORIGIN = {:#010x}, LENGTH = {mib}M", psram.start)), "{board:?}");
            assert!(says("RAM (rw)", format!("ORIGIN = {:#010x}", ram.start)), "{board:?}");
            assert!(says("RAM (rw)", format!(": {}K", (ram.end - ram.start) >> 10)), "{board:?}");
        }
    }

    #[test]
    fn cargo_runs_programs_as_this_does() {
        let runner = text(".cargo/config.toml");
        let words = OPTIONS.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(runner.contains(&format!("qemu-system-arm -M {} {words} -kernel", Board::An386.name())));
    }
}
