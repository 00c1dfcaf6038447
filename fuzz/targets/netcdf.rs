//! The program of the target `netcdf`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::netcdf(bytes));
