//! The program of the target `spreadsheet`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::spreadsheet(bytes));
