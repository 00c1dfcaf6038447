//! The program of the target `characterise`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::characterise(bytes));
