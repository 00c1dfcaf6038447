//! What a search would have seen, and what no search can.

use twinlag_model::{Beside, Observations, Policy, Shared, dense};

use crate::candidates::Search;
use crate::diagnosis::Limit;
use crate::rank::threshold;
use crate::size::{Around, Lacking};

impl Search<'_> {
    /// For each effect that the model lacks, the smallest size that the search would have seen: the square root of the threshold
    /// times the standard error that its size would have.
    pub(crate) fn limits(&self, around: &Around<'_>) -> Vec<Limit> {
        let probability = self.policy.round_false_alarm_probability / around.candidates.max(1) as f64;
        let mut out: Vec<Limit> = Vec::new();
        for limit in around.lacking.iter().filter_map(|lacking| self.limit(around, lacking, probability)) {
            let is_same = |o: &Limit| o.effect == limit.effect && o.channel == limit.channel;
            if !out.iter().any(is_same) {
                out.push(limit);
            }
        }
        out
    }

    fn limit(&self, around: &Around<'_>, lacking: &Lacking, probability: f64) -> Option<Limit> {
        let Lacking { effect, main, along } = lacking;
        let mut variances = along.iter().map(|a| Some(a.as_ref()?.variance())).collect::<Option<Vec<f64>>>()?;
        if along.len() > 1 {
            variances.push(self.variance_of_all(around, effect, *main)?);
        }
        let variance = variances.into_iter().fold(0.0, f64::max);
        let size = variance.sqrt() * threshold(effect.parameters().len(), probability).sqrt();
        let parameter = &effect.parameters()[*main];
        (size > 0.0 && size.is_finite()).then(|| Limit {
            effect: effect.identifier(),
            channel: effect.channel(),
            parameter: parameter.name.into(),
            size,
            unit: parameter.unit.into(),
        })
    }

    /// Variance of the size of an effect where a fit starts, its other parameters being free as well: they take part of it.
    fn variance_of_all(&self, around: &Around<'_>, effect: &Shared, main: usize) -> Option<f64> {
        let Around { fitted, lin: now, .. } = around;
        let theta = [&fitted.theta[..], effect.starts().first()?].concat();
        let model = fitted.model.with(effect.clone());
        let beside = Beside { without: now, max_difference: f64::INFINITY };
        let normal = model.normal_equations(&theta, self.observations, self.selection, Some(beside));
        let index = fitted.theta.len() + main;
        Some(dense::inverse(&normal.products)?[index][index] * fitted.mean_energy().max(1.0))
    }
}

/// What no record of two sensors reveals, however long and however lively the gas.
pub const NEVER_TESTABLE: [&str; 3] = [
    "anything that both sensors share (gain, offset, drift, delay, a second lag, a slow mode, \
     radiation)",
    "crosstalk that replaces part of a reading (it only makes one time constant wrong)",
    "which channel picked up a sinusoid that is also in the gas",
];

/// What no record of two sensors shows, and what this one does not.
///
/// - `tones`: separate tones of the gas, where it has few
pub(crate) fn not_testable(observations: &Observations, tones: Option<usize>, policy: &Policy) -> Vec<String> {
    let mut out = NEVER_TESTABLE.map(str::to_owned).to_vec();
    if let Some(tones) = tones.filter(|t| (2..=policy.most_counted_tones).contains(t)) {
        let (equations, left) = (2 * tones, 2 * tones - 2);
        out.push(format!(
            "more than {left} numbers beside the time constants (the gas has {tones} tones with an amplitude \
             and a phase each, which are {equations} equations, and the time constants take two of them)"
        ));
    }
    if observations.period_s.is_none() {
        out.push("coloured noise, input mismatch and lines (these need evenly spaced samples)".to_owned());
    }
    out
}
