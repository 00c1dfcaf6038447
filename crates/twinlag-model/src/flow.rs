//! A measured flow velocity or density along the record, or the speed of sensors that move.

use crate::error::ModelError;
use crate::instants::Instants;
use crate::number::Number;

/// Least speed of sensors that move, as a share of their root mean square speed. Where they turn they are at rest for a moment, and
/// what then carries heat is not their speed: the water follows them, and rises by itself. Chosen.
const MIN_SPEED_SHARE: f64 = 0.25;

/// Relative change of a flow that is more than rounding.
const MIN_RELATIVE_CHANGE: f64 = 1e-6;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlowKind {
    /// A velocity or a density, in any unit, positive throughout.
    Flow,
    /// The speed of sensors that move, m/s, with its sign.
    Motion,
}

impl FlowKind {
    /// What the reference of such a flow is called beside the numbers of an effect.
    pub fn reference_name(self) -> &'static str {
        match self {
            Self::Flow => "mean_flow",
            Self::Motion => "mean_speed",
        }
    }
}

/// A flow along a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    kind: FlowKind,
    time_s: Vec<f64>,
    /// Logarithm of its size over that of the reference.
    log_ratio: Vec<f64>,
    /// The reference over its values, with their sign.
    inverse_ratio: Vec<f64>,
    reference: f64,
}

impl Flow {
    /// The flow along a record.
    ///
    /// - `stretches`: instants, s, and values of each
    ///
    /// # Errors
    /// [`ModelError::Flow`] for values that are not finite, not as many as instants, or not positive where they are a flow.
    pub fn new(kind: FlowKind, stretches: &[(&Instants, &[f64])]) -> Result<Self, ModelError> {
        let is_possible = |v: &f64| v.is_finite() && (*v > 0.0 || kind == FlowKind::Motion);
        if !stretches.iter().all(|(time_s, values)| time_s.len() == values.len() && values.iter().all(is_possible)) {
            return Err(ModelError::Flow);
        }
        let time_s: Vec<f64> = stretches.iter().flat_map(|s| s.0.iter()).collect();
        let values: Vec<f64> = stretches.iter().flat_map(|s| s.1.iter().copied()).collect();
        let count = values.len().max(1) as f64;
        let least = match kind {
            FlowKind::Flow => f64::MIN_POSITIVE,
            FlowKind::Motion => MIN_SPEED_SHARE * (values.iter().map(|v| v * v).sum::<f64>() / count).sqrt(),
        };
        let sizes: Vec<f64> = values.iter().map(|v| v.abs().max(least).max(f64::MIN_POSITIVE)).collect();
        let log_mean = sizes.iter().map(|size| size.ln()).sum::<f64>() / count;
        let log_ratio: Vec<f64> = sizes.iter().map(|size| size.ln() - log_mean).collect();
        let inverse_ratio = log_ratio.iter().zip(&values).map(|(l, v)| (-l).exp().copysign(*v)).collect();
        Ok(Self { kind, time_s, log_ratio, inverse_ratio, reference: log_mean.exp() })
    }

    /// This flow with its ratios taken to `reference` in place of its geometric mean.
    ///
    /// - `reference`: in the unit of the flow, finite and positive
    pub(crate) fn relative_to(mut self, reference: f64) -> Self {
        let ratio = reference / self.reference;
        self.log_ratio.iter_mut().for_each(|log_ratio| *log_ratio -= ratio.ln());
        self.inverse_ratio.iter_mut().for_each(|inverse| *inverse *= ratio);
        Self { reference, ..self }
    }

    /// What it is.
    pub fn kind(&self) -> FlowKind {
        self.kind
    }

    /// The flow that it is compared with, in its unit: its geometric mean, or that of the record in which an effect was found.
    pub fn reference(&self) -> f64 {
        self.reference
    }

    /// `ln(v/v_ref)` of its size at an instant, on straight lines between the samples.
    pub fn log_ratio_at(&self, time_s: f64) -> f64 {
        self.at(&self.log_ratio, time_s)
    }

    /// `v_ref/v` with its sign at an instant, on straight lines between the samples.
    pub(crate) fn inverse_ratio_at(&self, time_s: Number) -> Number {
        let (before, after, share) = self.place(time_s.re);
        let [from, to] = [self.inverse_ratio[before], self.inverse_ratio[after]];
        let step_s = self.time_s[after] - self.time_s[before];
        let is_between = share > 0.0 && share < 1.0;
        let slope = if is_between { (to - from) / step_s } else { 0.0 };
        Number::from(from + share * (to - from)) + (time_s - time_s.re) * slope
    }

    /// Rate of change of `v_ref/v` at an instant, 1/s, over the samples on either side and their neighbours.
    pub(crate) fn inverse_ratio_rate_at(&self, time_s: f64) -> f64 {
        let (before, after, _) = self.place(time_s);
        let (first, last) = (before.saturating_sub(1), (after + 1).min(self.time_s.len() - 1));
        let length_s = self.time_s[last] - self.time_s[first];
        if length_s > 0.0 { (self.inverse_ratio[last] - self.inverse_ratio[first]) / length_s } else { 0.0 }
    }

    /// The least and the largest `v_ref/v`.
    pub(crate) fn inverse_ratios(&self) -> [f64; 2] {
        let bounds = [f64::INFINITY, f64::NEG_INFINITY];
        self.inverse_ratio.iter().fold(bounds, |[least, largest], ratio| [least.min(*ratio), largest.max(*ratio)])
    }

    fn at(&self, values: &[f64], time_s: f64) -> f64 {
        let (before, after, share) = self.place(time_s);
        values[before] + share * (values[after] - values[before])
    }

    /// The samples on either side of an instant, and the share of the way from one to the other.
    fn place(&self, time_s: f64) -> (usize, usize, f64) {
        let last = self.time_s.len() - 1;
        let after = self.time_s.partition_point(|t| *t <= time_s).clamp(1, last.max(1)).min(last);
        let before = after.saturating_sub(1);
        let step_s = self.time_s[after] - self.time_s[before];
        let share = if step_s > 0.0 { ((time_s - self.time_s[before]) / step_s).clamp(0.0, 1.0) } else { 0.0 };
        (before, after, share)
    }

    /// Whether its size or its direction changes by more than rounding.
    pub fn changes(&self) -> bool {
        let [least, largest] = self.inverse_ratios();
        largest - least > MIN_RELATIVE_CHANGE
    }
}
