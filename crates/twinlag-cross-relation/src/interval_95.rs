//! 95 % intervals from standard errors.

/// 97.5 % point of the standard normal distribution: half width of a 95 % interval, in standard errors.
pub const Z_975: f64 = 1.959_963_984_540_054;

/// 95 % point of chi-squared with one degree of freedom: the square of [`Z_975`].
pub const CHI2_95: f64 = 3.841_458_820_694_124;

/// The 95 % interval of a positive number whose logarithm is normal: a factor `exp(1.96 s/v)` either way of the value `v`
/// with the standard error `s`.
///
/// ```
/// use twinlag_cross_relation::log_normal_interval_95;
///
/// let [low, high] = log_normal_interval_95(2.0, 1.0);
/// assert!(low > 0.0 && (low * high - 4.0).abs() < 1e-12); // as many times smaller as larger
/// assert!((high / 2.0 - 0.98_f64.exp()).abs() < 1e-3);
/// ```
pub fn log_normal_interval_95(value: f64, standard_error: f64) -> [f64; 2] {
    let factor = (Z_975 * standard_error / value).exp();
    [value / factor, value * factor]
}
