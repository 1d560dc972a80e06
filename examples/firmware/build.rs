//! Links the programs for the board that `HABITUS_BOARD` names, a folder of `boards`.

fn main() {
    println!("cargo::rerun-if-env-changed=HABITUS_BOARD");
    println!("cargo::rerun-if-changed=boards");
    println!("cargo::rerun-if-changed=link.ld");
    let board = std::env::var("HABITUS_BOARD").unwrap_or_else(|_| String::from("mps2-an386"));
    println!("cargo::rustc-link-arg-bins=-Lboards/{board}");
    println!("cargo::rustc-link-arg-bins=-Tlink.ld");
    // The golden vectors fit models of every size, in as much memory as the largest takes.
    println!("cargo::rustc-link-arg-bin=vectors=--defsym=_ram_bytes=0x400000");
    println!("cargo::rustc-link-arg-bin=vectors=--defsym=_stack_bytes=0x10000");
}
