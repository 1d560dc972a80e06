//! See `habitus_fuzz::model_file`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::model_file::check(bytes));
