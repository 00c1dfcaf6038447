//! The program of the target `tdms`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::tdms(bytes));
