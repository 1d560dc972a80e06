//! Negative control: an allocation of what a file merely claims.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let [b'n', claimed, ..] = *bytes {
        // Not touched: on a busy machine filling it could take so long that the time limit is met first.
        std::hint::black_box(Vec::<u8>::with_capacity(usize::from(claimed) << 24));
    }
});
