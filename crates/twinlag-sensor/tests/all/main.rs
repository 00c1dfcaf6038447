//! All tests of `twinlag-sensor` in one program: linked once, and run side by side.

mod send_sync;
mod stream;
