//! All tests of `twinlag-diagnose` in one program: linked once, and run side by side.

mod campaign;
mod closed_loop;
mod common;
mod covered;
mod first_state;
mod flow;
mod motion;
mod noise;
mod records;
mod reduced;
