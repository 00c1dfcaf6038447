//! Power at twice as many frequencies as a series has, in the memory of the series' own transform.

use std::f64::consts::PI;

use num_complex::Complex64;
use rustfft::FftPlanner;

use crate::fourier::Forward;

/// Power of `values` `[n]` at `n + 1` frequencies from zero to half the sampling frequency, `|Σ_k x[k] e^(−iπ jk/n)|²`: those of
/// the series with as many zeros after it, so that no frequency is far from one of them.
///
/// Those of even `j` are the frequencies of the series itself. Those of odd `j` follow, for even `n`, from the complex series
/// `(x[k] − i x[k + n/2]) e^(−iπ k/n)` of half the length: its term `m` is that of `j = 4m + 1`, or its conjugate that of `2n − j`.
/// The padded series would take twice the memory.
///
/// ```
/// use twinlag_transform::doubled_power;
///
/// // A tone half way between two frequencies of the series.
/// let tone: Vec<f64> = (0..16).map(|k| (std::f64::consts::PI * 5.0 / 16.0 * f64::from(k)).cos()).collect();
/// let power = doubled_power(&tone);
/// let largest = (0..power.len()).max_by(|a, b| power[*a].total_cmp(&power[*b]));
/// assert_eq!((power.len(), largest), (17, Some(5)));
/// ```
///
/// # Panics
/// If `n` is odd.
pub fn doubled_power(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    assert!(n.is_multiple_of(2), "an even number of values, not {n}");
    let mut power = vec![0.0; n + 1];
    let even = Forward::once(n).transform(values);
    power.iter_mut().step_by(2).zip(even).for_each(|(power, x)| *power = x.norm_sqr());
    let (first, second) = values.split_at(n / 2);
    let turned =
        |(k, (a, b)): (usize, (&f64, &f64))| Complex64::new(*a, -b) * Complex64::cis(-PI * k as f64 / n as f64);
    let mut odd: Vec<Complex64> = first.iter().zip(second).enumerate().map(turned).collect();
    FftPlanner::new().plan_fft_forward(n / 2).process(&mut odd);
    for (m, x) in odd.iter().enumerate() {
        let j = 4 * m + 1;
        power[j.min(2 * n - j)] = x.norm_sqr();
    }
    power
}
