use thiserror::Error;

/// Why a cost could not be set up.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum CostError {
    #[error("both channels need the same number of samples, got {first} and {second}")]
    LengthMismatch { first: usize, second: usize },
    #[error("a segment of {samples} samples needs {expected} steps between them, got {steps}")]
    StepCount { samples: usize, steps: usize, expected: usize },
    #[error("at least {needed} samples are needed in all, got {samples}")]
    TooShort { samples: usize, needed: usize },
    #[error("sample {index} of channel {channel} is {value}: mask what is missing by starting a new segment")]
    NotFinite { channel: usize, index: usize, value: f64 },
    #[error("the time between samples must be finite and positive, got {value} s")]
    BadStep { value: f64 },
    #[error("this cost needs evenly spaced samples; the whitened cost takes uneven ones as they are")]
    UnevenSampling,
    #[error("{name} must be finite and positive, got {value}")]
    NotPositive { name: &'static str, value: f64 },
    #[error("{name} must be from 1e-76 to 1e76, got {value}: its fourth power has to be a number of full precision")]
    OutOfRange { name: &'static str, value: f64 },
    #[error("uneven sampling needs the zero-order hold or the bilinear rule: the others look further than one step")]
    HoldNeedsEvenSampling,
    #[error("a band-limited gas has no difference equation to whiten: choose a hold")]
    NoDifferenceEquation,
    #[error("noise is modelled as stationary autoregression of order 1 or 2, got coefficients {coefficients:?}")]
    Autoregression { coefficients: Vec<f64> },
    #[error("the spectral form needs evenly spaced samples and a one-step inverse (zero-order hold or bilinear rule)")]
    NoSpectralForm,
    #[error("the least-squares system is singular: the channels do not determine two time constants")]
    Singular,
}
