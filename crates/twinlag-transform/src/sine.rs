//! The sine transform of type I, from the Fourier transform of the series with as many zeros after
//! it and two more.

use crate::fourier::Forward;

/// `Σ_k x[k] sin(π (j+1)(k+1)/(n+1))` for `j = 0 … n−1`, of `n` values; its own inverse but for a
/// factor `2/(n+1)`.
///
/// ```
/// use twinlag_transform::sine_transform;
///
/// let values = [1.0, -2.0, 0.5];
/// let back = sine_transform(&sine_transform(&values)).into_iter().map(|v| 2.0 / 4.0 * v);
/// // Four products a sum, twice: some ten roundings of numbers below 4.
/// assert!(back.zip(values).all(|(got, want)| (got - want).abs() < 1e-14));
/// ```
pub fn sine_transform(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    // One zero in front, so that the first value lies at the first step of the angle.
    let padded: Vec<f64> = std::iter::once(0.0).chain(values.iter().copied()).collect();
    let spectrum = Forward::of(2 * (n + 1)).transform(&padded);
    spectrum[1..=n].iter().map(|y| -y.im).collect()
}
