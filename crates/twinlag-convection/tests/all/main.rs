//! All tests of `twinlag-convection` in one program: linked once, and run side by side.

mod bodies;
mod makers;
mod published;
