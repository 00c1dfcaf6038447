//! All tests of `twinlag-cross-relation` in one program: linked once, and run side by side.

mod compression;
mod derivatives;
mod difference_equation;
mod models;
mod second_order;
