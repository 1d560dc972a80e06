//! See `habitus_fuzz::tables`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::tables::check(bytes));
