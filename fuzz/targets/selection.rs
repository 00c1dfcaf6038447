//! The program of the target `selection`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::selection(bytes));
