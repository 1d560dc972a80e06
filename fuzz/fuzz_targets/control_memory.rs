//! Negative control: an allocation of what a file merely claims, in pieces of 64 KiB.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(count) = bytes.strip_prefix(b"n").and_then(|rest| rest.first_chunk()) {
        let claimed = Vec::<[u8; 65536]>::with_capacity(usize::from(u16::from_le_bytes(*count)));
        assert!(std::hint::black_box(&claimed).is_empty());
    }
});
