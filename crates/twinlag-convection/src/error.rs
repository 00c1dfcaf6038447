use thiserror::Error;

/// Why no time constant is expected.
#[derive(Clone, Debug, PartialEq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ConvectionError {
    #[error("'{text}': expected {expected}, got '{got}'")]
    Text { text: String, expected: &'static str, got: String },
    #[error("{what} is {value}: expected a finite number above 0")]
    NotPositive { what: &'static str, value: f64 },
    #[error("{fluid} at {temperature_c:.1} °C: expected from {} to {} °C, for which its properties are known", range_c[0], range_c[1])]
    Temperature { fluid: &'static str, temperature_c: f64, range_c: [f64; 2] },
    #[error(
        "a Reynolds number of {reynolds:.3}, at {speed_m_s} m/s, is outside of the correlation of {source_of_it}: expected from \
         {:.3} to {:.3}. Give the range of the time constant instead", range[0], range[1]
    )]
    Reynolds { reynolds: f64, speed_m_s: f64, source_of_it: &'static str, range: [f64; 2] },
    #[error(
        "a Biot number of {biot:.2}: expected at most {limit}, since heat flows less than ten times as fast inside the sensor as to it. \
         Give the range of the time constant instead"
    )]
    Biot { biot: f64, limit: f64 },
}
