//! The program of the target `parquet`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::parquet(bytes));
