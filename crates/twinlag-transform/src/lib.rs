//! Fourier and sine transforms of real series of any length, and tapers.
//!
//! For the other crates of the workspace. Nothing here is generic, so the many kernels of
//! [rustfft](https://docs.rs/rustfft) are compiled once, with this crate, and not with each crate
//! that transforms something. Plans are kept, shared by all threads: asking for one again costs a
//! look-up. Whoever wants complex input, `f32`, or more than one dimension is better served by
//! rustfft itself.
//!
//! ```
//! use twinlag_transform::{Complex64, Forward, Inverse};
//!
//! let wave_at = |k: i32| (std::f64::consts::TAU * 2.0 * f64::from(k) / 12.0).cos();
//! let wave: Vec<f64> = (0..12).map(wave_at).collect();
//! let spectrum = Forward::of(12).transform(&wave);
//! assert!((spectrum[2] - Complex64::new(6.0, 0.0)).norm() < 1e-14);
//! let twelve_times = Inverse::of(12).transform(spectrum);
//! assert!((twelve_times[1] / 12.0 - 0.5).abs() < 1e-15);
//! ```

mod doubled;
mod fourier;
mod kept;
mod length;
mod sine;
mod taper;

pub use doubled::doubled_power;
pub use fourier::{Forward, Inverse};
pub use length::fast_length;
pub use num_complex::Complex64;
pub use sine::sine_transform;
pub use taper::{Tapered, hann, hann_between};

/// Plans may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Forward, Inverse, Tapered)>();
};
