//! See `habitus_fuzz::c_calls`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::c_calls::check(bytes));
