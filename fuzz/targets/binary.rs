//! The program of the target `binary`.

#![no_main]

// Libraries of formats panic on damaged files, which the reader catches: only a panic that leaves the target is one that counts.
libfuzzer_sys::fuzz_target!(init: std::panic::set_hook(Box::new(|_| ())), |bytes: &[u8]| twinlag_fuzz::binary(bytes));
