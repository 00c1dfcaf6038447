//! The program of the target `compensate`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::compensate(bytes));
