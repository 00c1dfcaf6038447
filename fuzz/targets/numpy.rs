//! The program of the target `numpy`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::numpy(bytes));
