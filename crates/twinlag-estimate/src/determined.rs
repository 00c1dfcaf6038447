//! Whether a record determines a time constant at all, as far as its standard error or its interval
//! says.

use twinlag_cross_relation::Z_975;

use crate::whitened::WhitenedFit;

/// Standard error of the logarithm of a time constant above which it is not determined: its
/// interval then spans a factor of seven, `exp(2 · 1.96 · 0.5)`.
pub const MAX_LOG_STANDARD_ERROR: f64 = 0.5;
/// A time constant longer than this share of the record's span, and known no better than
/// [`MAX_LOG_STANDARD_ERROR_IF_LONG`], is where fits run to when the record does not distinguish
/// two lags from none.
const LONG_SHARE_OF_SPAN: f64 = 1.0 / 3.0;
/// Standard error of the logarithm of a time constant that is long beside the record, above which
/// it is not believed: 0.1, an interval of a factor of 1.5.
const MAX_LOG_STANDARD_ERROR_IF_LONG: f64 = 0.1;

impl<const P: usize> WhitenedFit<'_, P> {
    /// The free time constants that a record does not determine at `theta`, given their covariance
    /// if there is one.
    pub fn vague(&self, theta: &[f64; P], covariance: Option<&[[f64; P]; P]>) -> Vec<usize> {
        (0..2).filter(|&i| !self.is_held(i) && self.is_vague(i, theta, covariance)).collect()
    }

    /// Whether parameter `i`, a time constant, is not determined at `theta`.
    pub fn is_vague(&self, i: usize, theta: &[f64; P], covariance: Option<&[[f64; P]; P]>) -> bool {
        let long_s = LONG_SHARE_OF_SPAN * self.task.readings.span_s();
        covariance.is_none_or(|c| {
            let log_error = c[i][i].sqrt() / theta[i];
            log_error > MAX_LOG_STANDARD_ERROR || (log_error > MAX_LOG_STANDARD_ERROR_IF_LONG && theta[i] > long_s)
        })
    }

    /// Whether a 95 % interval of time constant `i`, s, runs to a bound, or spans more than one of
    /// [`MAX_LOG_STANDARD_ERROR`] does.
    pub fn is_unbounded(&self, i: usize, [low, high]: [f64; 2]) -> bool {
        let variable = &self.variables[i];
        low <= variable.lower || high >= variable.upper || spans_too_much([low, high])
    }
}

/// Whether a 95 % interval spans more than one of [`MAX_LOG_STANDARD_ERROR`] does.
pub fn spans_too_much([low, high]: [f64; 2]) -> bool {
    (high / low).ln() > 2.0 * Z_975 * MAX_LOG_STANDARD_ERROR
}
