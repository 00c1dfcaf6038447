//! A measured flow velocity or density along the record.

use crate::error::ModelError;
use crate::instants::Instants;

/// Its logarithm over that of its geometric mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    time_s: Vec<f64>,
    log_ratio: Vec<f64>,
}

impl Flow {
    /// The flow along a record.
    ///
    /// - `stretches`: instants, s, and values of each
    ///
    /// # Errors
    /// [`ModelError::Flow`] for values that are not positive, or not as many as instants.
    pub fn new(stretches: &[(&Instants, &[f64])]) -> Result<Self, ModelError> {
        let is_sound = |(time_s, values): &(&Instants, &[f64])| {
            time_s.len() == values.len() && values.iter().all(|v| v.is_finite() && *v > 0.0)
        };
        if !stretches.iter().all(is_sound) {
            return Err(ModelError::Flow);
        }
        let time_s: Vec<f64> = stretches.iter().flat_map(|s| s.0.iter()).collect();
        let logs: Vec<f64> = stretches.iter().flat_map(|s| s.1.iter().map(|v| v.ln())).collect();
        let mean = logs.iter().sum::<f64>() / logs.len().max(1) as f64;
        Ok(Self { time_s, log_ratio: logs.into_iter().map(|l| l - mean).collect() })
    }

    /// `ln(v/v_mean)` at an instant, on straight lines between the samples.
    pub fn log_ratio_at(&self, time_s: f64) -> f64 {
        let last = self.time_s.len() - 1;
        let after = self.time_s.partition_point(|t| *t <= time_s).clamp(1, last.max(1)).min(last);
        let before = after.saturating_sub(1);
        let step_s = self.time_s[after] - self.time_s[before];
        let share = if step_s > 0.0 { ((time_s - self.time_s[before]) / step_s).clamp(0.0, 1.0) } else { 0.0 };
        self.log_ratio[before] + share * (self.log_ratio[after] - self.log_ratio[before])
    }

    /// Whether it changes by more than rounding.
    pub fn changes(&self) -> bool {
        self.log_ratio.iter().any(|l| l.abs() > 1e-6)
    }
}
