//! `cargo xtask header`: the C header, generated from the source of the crate in ffi/, and what is generated from the header.

use crate::c_header::{Header, PATH};
use crate::process::{Result, project};
use crate::{javascript, layout};
use habitus_ffi::code::CODES;
use std::path::{Path, PathBuf};

/// The crate it is made from.
const CRATE: &str = "ffi";

/// Options of `cargo xtask header`.
#[derive(clap::Args)]
pub struct Options {
    /// Compare with the committed files instead of writing them.
    #[arg(long)]
    check: bool,
    /// Write the entries that tests/hosts/layout.c compares to DIR/layout_entries.h instead.
    #[arg(long, value_name = "DIR", conflicts_with = "check")]
    layout: Option<PathBuf>,
}

/// Writes or compares.
pub fn run(options: &Options) -> Result<()> {
    if let Some(folder) = &options.layout {
        return layout_entries(folder);
    }
    let header = generated()?;
    let (script, assertions) = (javascript::script(&header)?, javascript::assertions(&header)?);
    for (path, made) in [(PATH, header), (javascript::ASSERTIONS, assertions), (javascript::SCRIPT, script)] {
        if options.check {
            compare(path, &made)?;
        } else {
            std::fs::write(project().join(path), made).map_err(|error| format!("{path}: {error}"))?;
        }
    }
    Ok(())
}

/// Fails unless the committed file is what would be written.
fn compare(path: &str, made: &str) -> Result<()> {
    let committed = std::fs::read_to_string(project().join(path)).map_err(|error| format!("{path}: {error}"))?;
    match committed.lines().zip(made.lines()).position(|(a, b)| a != b) {
        None if committed == made => {
            println!("{path} is what the crate in {CRATE}/ gives, {} lines", made.lines().count());
            Ok(())
        }
        difference => {
            let line = difference.map_or_else(|| String::from("at its end"), |line| format!("at line {}", line + 1));
            Err(format!("{path} differs from the crate in {CRATE}/ {line}: run `cargo xtask header` and commit it")
                .into())
        }
    }
}

/// Writes the C side of the layout check to a folder.
pub fn layout_entries(folder: &Path) -> Result<()> {
    let path = folder.join("layout_entries.h");
    let text = layout::entries(&Header::read()?);
    std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()).into())
}

/// The header's text.
fn generated() -> Result<String> {
    let folder = project().join(CRATE);
    let read =
        |name: &str| std::fs::read_to_string(folder.join(name)).map_err(|error| format!("{CRATE}/{name}: {error}"));
    let mut config = cbindgen::Config::from_file(folder.join("cbindgen.toml"))?;
    config.header = Some(read("header-intro.h")?.trim_end().to_owned());
    config.after_includes = Some(format!("{}\n\n{}", codes(), read("header-macros.h")?.trim_end()));
    let bindings = cbindgen::Builder::new()
        .with_crate(&folder)
        .with_config(config)
        .generate()
        .map_err(|error| format!("{CRATE}: {error}"))?;
    let mut text = Vec::new();
    bindings.write(&mut text);
    Ok(plain_c(&String::from_utf8_lossy(&text)))
}

/// What cbindgen writes, with enumerations as C99 and C++ both know them (functions take them as uint32_t), and Rust's heading for what the
/// caller promises in C's words.
fn plain_c(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text.replace(" * # Safety\n *", " * Requires:");
    while let Some((before, behind)) = rest.split_once("\n#if defined(__cplusplus) || __STDC_VERSION__") {
        let body = behind.split_once(" {\n").map_or(behind, |(_, body)| body);
        let (body, tail) = body.split_once("};\n").unwrap_or((body, ""));
        let tail = tail.split_once("#endif // __cplusplus\n").map_or(tail, |(_, tail)| tail);
        out += before;
        out += " {\n";
        out += body;
        out += "};\n";
        rest = tail.to_owned();
    }
    out + &rest
}

/// The error codes as C: a type of 32 bits, and constants. cbindgen does not see them, because a macro makes them.
fn codes() -> String {
    let mut text = String::from(
        "\n/* What a function returns. Numbers are never given out again: 1xx argument, 2xx buffer, 3xx model file, 4xx numeric,\n   \
         5xx unsupported. {first} and {second} are the numbers of the hab_error_detail. */\ntypedef int32_t hab_code;\nenum {\n",
    );
    for (code, name, meaning) in CODES {
        let (name, meaning) = (name.to_string_lossy(), meaning.to_string_lossy());
        text += &format!("    /* {} */\n    {name} = {},\n", meaning.trim(), *code as i32);
    }
    // C99 allows the last comma.
    text + "};"
}
