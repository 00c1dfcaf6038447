//! All tests of `twinlag-model` in one program: linked once, and run side by side.

mod mismatch;
mod missing;
mod no_size;
mod saturation;
mod scatter;
mod turbulent;
mod twins;
