//! The analogue-to-digital converter: rounding to the nearest multiple of the step, then
//! saturation.

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{below, finite, positive};

/// Rounding and saturation of a channel. Each field may be left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Adc {
    /// Readings are rounded to multiples of this, K (halves away from zero). Not rounded if left
    /// out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub step_k: Option<f64>,
    /// Lowest reading, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low_c: Option<f64>,
    /// Highest reading, °C.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high_c: Option<f64>,
}

impl Adc {
    /// What the converter makes of a temperature, °C.
    ///
    /// ```
    /// use twinlag_signal::Adc;
    ///
    /// let adc = Adc { step_k: Some(0.25), low_c: None, high_c: Some(100.0) };
    /// // Quarters are exact in binary.
    /// assert_eq!(adc.convert(20.1), 20.0);
    /// assert_eq!(adc.convert(20.2), 20.25);
    /// assert_eq!(adc.convert(130.0), 100.0);
    /// ```
    pub fn convert(&self, temperature_c: f64) -> f64 {
        let rounded_c = self.step_k.map_or(temperature_c, |step_k| (temperature_c / step_k).round() * step_k);
        rounded_c.max(self.low_c.unwrap_or(f64::NEG_INFINITY)).min(self.high_c.unwrap_or(f64::INFINITY))
    }

    pub(crate) fn check(&self, within: &str) -> Result<(), SignalError> {
        if let Some(step_k) = self.step_k {
            positive(within, "step_k", step_k)?;
        }
        for (name, limit_c) in [("low_c", self.low_c), ("high_c", self.high_c)] {
            if let Some(limit_c) = limit_c {
                finite(within, name, limit_c)?;
            }
        }
        match (self.low_c, self.high_c) {
            (Some(low_c), Some(high_c)) => below(within, "low_c", low_c, "high_c", high_c),
            _ => Ok(()),
        }
    }
}
