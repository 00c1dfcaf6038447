//! The program of the target `matlab`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::matlab(bytes));
