use thiserror::Error;

/// Why a sensor model could not be built.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ModelError {
    #[error("{name} must be finite and positive, got {value}")]
    NotPositive { name: &'static str, value: f64 },
    #[error("{name} must lie in [{low}, {high}), got {value}")]
    OutOfRange { name: &'static str, low: f64, high: f64, value: f64 },
    #[error("a pole must lie strictly between 0 and 1, got {value}: the sensor would not be a lag")]
    Pole { value: f64 },
    #[error(
        "a band-limited response has no difference equation: use its frequency response, or another discretisation"
    )]
    NoDifferenceEquation,
}

pub(crate) fn positive(name: &'static str, value: f64) -> Result<f64, ModelError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(ModelError::NotPositive { name, value }) }
}
