//! See `habitus_fuzz::wavelets`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::wavelets::check(bytes));
