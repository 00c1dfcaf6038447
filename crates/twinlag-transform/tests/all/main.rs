//! Transforms and tapers against the sums and closed forms that define them.
//!
//! Here and not beside the code: the crate's own tests would compile all kernels of rustfft once
//! more.

mod doubled;
mod fourier;
mod length;
mod sine;
mod store;
mod taper;
