//! All tests of `twinlag-compensate` in one program: linked once, and run side by side.

mod exact;
mod intensity;
mod learn;
mod stream;
mod tracker;
