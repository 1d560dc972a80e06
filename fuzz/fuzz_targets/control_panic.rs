//! Negative control: an index out of bounds behind four bytes, as behind the magic of a file.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(rest) = bytes.strip_prefix(b"HAB!") {
        let sizes = [1u8, 2, 3];
        let size = sizes[rest.len()];
        assert!(size > 0);
    }
});
