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
    /// In order of time; at least one.
    runs: Vec<Run>,
    reference: f64,
}

/// The flow along a stretch of the record.
#[derive(Clone, Debug, PartialEq)]
struct Run {
    time_s: Instants,
    /// Logarithm of its size over that of the reference.
    log_ratio: Vec<f64>,
    /// The reference over its values, with their sign.
    inverse_ratio: Vec<f64>,
    /// Whether all of its values are the same to the last bit.
    is_steady: bool,
}

impl Flow {
    /// The flow along a record.
    ///
    /// - `stretches`: instants, s, and values of each, in order of time; those without a sample are left out
    ///
    /// # Errors
    /// [`ModelError::Flow`] for values that are not finite, not as many as instants, or not positive where they are a flow; and if there
    /// are none.
    pub fn new(kind: FlowKind, stretches: &[(&Instants, &[f64])]) -> Result<Self, ModelError> {
        let is_possible = |v: &f64| v.is_finite() && (*v > 0.0 || kind == FlowKind::Motion);
        let values = || stretches.iter().flat_map(|(_, values)| values.iter().copied());
        let count = values().count();
        if count == 0 || !stretches.iter().all(|(t, v)| t.len() == v.len() && v.iter().all(is_possible)) {
            return Err(ModelError::Flow);
        }
        let mean = |of: &dyn Fn(f64) -> f64| values().map(of).sum::<f64>() / count as f64;
        let least = match kind {
            FlowKind::Flow => f64::MIN_POSITIVE,
            FlowKind::Motion => (MIN_SPEED_SHARE * mean(&|v| v * v).sqrt()).max(f64::MIN_POSITIVE),
        };
        let log_size = |v: f64| v.abs().max(least).ln();
        let log_mean = mean(&log_size);
        let run = |(time_s, values): &(&Instants, &[f64])| {
            let log_ratio: Vec<f64> = values.iter().map(|v| log_size(*v) - log_mean).collect();
            let inverse_ratio = log_ratio.iter().zip(*values).map(|(l, v)| (-l).exp().copysign(*v)).collect();
            let is_steady = values.iter().all(|v| v.to_bits() == values[0].to_bits());
            Run { time_s: Instants::clone(time_s), log_ratio, inverse_ratio, is_steady }
        };
        let runs = stretches.iter().filter(|(_, values)| !values.is_empty()).map(run).collect();
        Ok(Self { kind, runs, reference: log_mean.exp() })
    }

    /// This flow with its ratios taken to `reference` in place of its geometric mean.
    ///
    /// - `reference`: in the unit of the flow, finite and positive
    pub(crate) fn relative_to(mut self, reference: f64) -> Self {
        let ratio = reference / self.reference;
        for run in &mut self.runs {
            run.log_ratio.iter_mut().for_each(|log_ratio| *log_ratio -= ratio.ln());
            run.inverse_ratio.iter_mut().for_each(|inverse| *inverse *= ratio);
        }
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

    /// `ln(v/v_ref)` of its size at an instant: on straight lines between the samples of a stretch, and beyond its ends as at the nearest
    /// end of any.
    pub fn log_ratio_at(&self, time_s: f64) -> f64 {
        let (run, before, after, share) = self.place(time_s);
        let [from, to] = [run.log_ratio[before], run.log_ratio[after]];
        from + share * (to - from)
    }

    /// `v_ref/v` with its sign at an instant: on straight lines between the samples of a stretch, and beyond its ends as at the nearest end
    /// of any.
    pub(crate) fn inverse_ratio_at(&self, time_s: Number) -> Number {
        let (run, before, after, share) = self.place(time_s.re);
        let [from, to] = [run.inverse_ratio[before], run.inverse_ratio[after]];
        let step_s = run.time_s.at(after) - run.time_s.at(before);
        let is_between = share > 0.0 && share < 1.0;
        let slope = if is_between { (to - from) / step_s } else { 0.0 };
        Number::from(from + share * (to - from)) + (time_s - time_s.re) * slope
    }

    /// Rate of change of `v_ref/v` at an instant, 1/s, over the samples on either side and their neighbours.
    pub(crate) fn inverse_ratio_rate_at(&self, time_s: f64) -> f64 {
        let (run, before, after, _) = self.place(time_s);
        let (first, last) = (before.saturating_sub(1), (after + 1).min(run.time_s.len() - 1));
        let length_s = run.time_s.at(last) - run.time_s.at(first);
        if length_s > 0.0 { (run.inverse_ratio[last] - run.inverse_ratio[first]) / length_s } else { 0.0 }
    }

    /// The least and the largest `v_ref/v`.
    pub(crate) fn inverse_ratios(&self) -> [f64; 2] {
        let bounds = [f64::INFINITY, f64::NEG_INFINITY];
        let all = self.runs.iter().flat_map(|run| &run.inverse_ratio);
        all.fold(bounds, |[least, largest], ratio| [least.min(*ratio), largest.max(*ratio)])
    }

    /// The run that an instant is of, its samples on either side of that, and the share of the way from one to the other.
    fn place(&self, time_s: f64) -> (&Run, usize, usize, f64) {
        let run = self.run_at(time_s);
        let last = run.time_s.len() - 1;
        let after = run.time_s.first_after(time_s).clamp(1, last.max(1)).min(last);
        let before = after.saturating_sub(1);
        let [before_s, after_s] = [before, after].map(|k| run.time_s.at(k));
        let share = if after_s > before_s { ((time_s - before_s) / (after_s - before_s)).clamp(0.0, 1.0) } else { 0.0 };
        (run, before, after, share)
    }

    /// The run that an instant is in, or that is nearest to it: a delay leads out of a stretch at its ends.
    fn run_at(&self, time_s: f64) -> &Run {
        let next = self.runs.partition_point(|run| run.time_s.at(0) <= time_s);
        let before = &self.runs[next.saturating_sub(1)];
        match self.runs.get(next) {
            Some(run) if run.time_s.at(0) - time_s < time_s - before.time_s.at(before.time_s.len() - 1) => run,
            _ => before,
        }
    }

    /// Whether two steady flows are different ones, by more than rounding; `false` where either changes.
    pub fn is_another_than(&self, other: &Self) -> bool {
        let are_steady = !self.changes() && !other.changes();
        are_steady && (self.reference / other.reference - 1.0).abs() > MIN_RELATIVE_CHANGE
    }

    /// Whether its size or its direction changes by more than rounding.
    pub fn changes(&self) -> bool {
        let [least, largest] = self.inverse_ratios();
        largest - least > MIN_RELATIVE_CHANGE
    }

    /// Whether it is the same, to the last bit, in all of the stretch that an instant is of.
    pub(crate) fn is_steady_around(&self, time_s: f64) -> bool {
        self.run_at(time_s).is_steady
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two stretches, 100 s apart; what lies between them is as at the nearer end.
    #[test]
    fn each_stretch_has_its_own_flow() {
        let (early, late) = (Instants::even(0.0, 1.0, 11), Instants::even(110.0, 1.0, 11));
        let rising: Vec<f64> = (0..11).map(|k| 4.0 + f64::from(k)).collect();
        let flow = Flow::new(FlowKind::Flow, &[(&early, &[2.0; 11]), (&late, &rising)]).expect("positive");
        let ratio = |time_s: f64| flow.log_ratio_at(time_s).exp() * flow.reference();
        // At 110.5 s halfway in the logarithm. Sums of some twenty logarithms of order one are rounded to 20 · 2.2e-16.
        let halfway = 20.0_f64.sqrt();
        let expected =
            [(-5.0, 2.0), (3.3, 2.0), (10.1, 2.0), (59.0, 2.0), (61.0, 4.0), (110.5, halfway), (130.0, 14.0)];
        for (time_s, want) in expected {
            let got = ratio(time_s);
            assert!((got / want - 1.0).abs() < 5e-15, "{time_s} s: got {got}, want {want} within 5e-15");
        }
        assert!(flow.is_steady_around(10.1) && !flow.is_steady_around(109.9) && flow.changes());
        assert_eq!(flow.inverse_ratio_rate_at(10.0), 0.0);
    }
}
