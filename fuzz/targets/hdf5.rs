//! The program of the target `hdf5`.

#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| twinlag_fuzz::hdf5(bytes));
