//! All tests of `twinlag-cli` in one program: linked once, and run side by side.

mod agreement;
mod bad_input;
mod batch;
mod cluster;
mod common;
mod compensate;
mod contract;
mod diagnose;
mod documents;
mod explain;
mod inspect;
mod live;
mod live_state;
mod manners;
mod plan;
mod plausibility;
mod saved_models;
mod schemas;
mod study;
