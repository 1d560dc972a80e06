//! Negative control: an allocation of what a file merely claims.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some(count) = bytes.strip_prefix(b"n=").and_then(|rest| rest.first_chunk()) {
        // Not touched: on a busy machine filling it could take so long that the time limit is met first.
        std::hint::black_box(Vec::<u8>::with_capacity(u32::from_le_bytes(*count) as usize));
    }
});
