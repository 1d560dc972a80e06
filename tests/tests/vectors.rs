//! The committed golden vectors are what the reference gives; so a change of the reference or of a file is noticed.

use std::path::Path;

#[test]
fn committed_vectors_are_those_of_the_reference() {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/vectors");
    let written = habitus_tests::vectors::written();
    let mut total = 0;
    for (name, text) in &written {
        let committed = std::fs::read_to_string(dir.join(name)).expect("a committed file of vectors");
        let differing = committed.lines().zip(text.lines()).position(|(a, b)| a != b);
        let remedy = "cargo run -p habitus-tests --bin write-vectors -- --write, and an entry in the change log";
        assert_eq!(differing, None, "{name}: the first line (from 0) that differs; meant to change? {remedy}");
        assert_eq!(committed.len(), text.len(), "{name}: lengths; {remedy}");
        total += text.len();
    }
    // The firmware that runs them has 4 MiB for code and text.
    assert!(total < 800_000, "{total} bytes are more than a firmware should carry beside its code");
    // Every file there is one that the runner reads.
    let files = std::fs::read_dir(&dir).expect("the folder of the vectors").count();
    assert_eq!((files, written.len()), (7, 7));
    let read: Vec<&str> = habitus_golden::VECTORS.files.iter().map(|(name, _)| *name).chain(["models.txt"]).collect();
    assert!(written.iter().all(|(name, _)| read.contains(name)), "{read:?}");
}
