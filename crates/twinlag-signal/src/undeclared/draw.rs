//! Small random draws.

use rand::{Rng, RngExt};

/// Log-uniform between two positive numbers.
pub(super) fn log_uniform(low: f64, high: f64, rng: &mut impl Rng) -> f64 {
    low * (high / low).powf(rng.random())
}

/// Minus one or one.
pub(super) fn sign(rng: &mut impl Rng) -> f64 {
    if rng.random() { 1.0 } else { -1.0 }
}

/// One of several, each as likely.
pub(super) fn one_of<T: Copy>(choices: &[T], rng: &mut impl Rng) -> T {
    choices[rng.random_range(0..choices.len())]
}
