//! The promise "no panic, no heap" as a test, so that `cargo test` covers it.

use std::process::Command;

#[test]
fn no_entry_of_the_kernel_reaches_a_panic_or_an_allocator() {
    let output = Command::new(env!("CARGO_BIN_EXE_xtask")).arg("no-panic").output().expect("xtask can be started");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("3 controls caught"));
}
