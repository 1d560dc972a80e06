//! See `habitus_fuzz::bilinear`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::bilinear::check(bytes));
