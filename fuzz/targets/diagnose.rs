//! The program of the target `diagnose`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::diagnose(bytes));
