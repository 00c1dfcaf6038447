//! All tests of `twinlag-study` in one program: linked once, and run side by side.

mod reproducible;
mod send_sync;
