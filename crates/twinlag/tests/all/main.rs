//! All tests of `twinlag` in one program: linked once, and run side by side.

mod common;
mod curvature;
mod grades;
mod intervals;
mod missing;
mod noise_levels;
mod properties;
mod second_order;
mod several_records;
mod stream;
mod undetermined;
