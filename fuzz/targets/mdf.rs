//! The program of the target `mdf`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::mdf(bytes));
