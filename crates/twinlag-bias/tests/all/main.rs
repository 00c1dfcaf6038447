//! All tests of `twinlag-bias` in one program: linked once, and run side by side.

mod compensation;
mod covariance;
mod noise_moments;
