//! Reader of clouds: see `habitus_fuzz::mesh`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| habitus_fuzz::mesh::check_npy_cloud(bytes));
