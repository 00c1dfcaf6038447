//! The program of the target `binary`.

#![no_main]

// Libraries of formats panic on damaged files, which the reader catches: only a panic that leaves the target counts.
// It is not described either: the tests do that once its input is in the corpus.
libfuzzer_sys::fuzz_target!(init: std::panic::set_hook(Box::new(|_| ())), |bytes: &[u8]| twinlag_fuzz::binary(bytes));
