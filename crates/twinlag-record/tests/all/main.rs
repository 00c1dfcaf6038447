//! All tests of `twinlag-record` in one program: linked once, and run side by side.

mod columns;
mod common;
mod programs;
mod properties;
mod reading;
mod refusals;
mod rows;
mod send_sync;
