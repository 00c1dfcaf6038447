use thiserror::Error;

/// Why a noise description cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum NoiseError {
    #[error("{name} must be finite and not negative, got {value}")]
    Negative { name: &'static str, value: f64 },
    #[error("a noise ratio must be finite and positive, got {value}")]
    Ratio { value: f64 },
    #[error("a weight must lie between 0 (normalised) and 1 (compensated), got {value}")]
    Weight { value: f64 },
    #[error("without noise in either channel the cost has no scale: at least one level must be positive")]
    NoNoise,
    #[error(
        "an autocovariance starts with the variance, which no lag exceeds: lag {lag} is {value}, the variance {variance}"
    )]
    Autocovariance { lag: usize, value: f64, variance: f64 },
    #[error("at least {needed} neighbouring samples are needed to distinguish noise from signal, got {samples}")]
    TooShort { samples: usize, needed: usize },
}
