//! All tests of `twinlag-plan` in one program: linked once, and run side by side.

mod closed_form;
mod models;
