//! Intervals by parametric bootstrap: the same estimator on records simulated from what it found.
//!
//! A gas with the power that the record shows, noise taken off, is passed through both fitted
//! sensors; noise of the found levels is added, anew for each replicate; and the estimator answers
//! each. The spread of `ln(τ*/τ)` turned round gives the interval. It takes a hundred times as long
//! as a standard error, and makes no use of one: for estimators that have none, and to check those
//! that do. The estimator's own model makes the records, so it cannot show that the model is wrong.
//!
//! # Source
//! Efron and Tibshirani 1993, the basic bootstrap interval.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use twinlag_cross_relation::{CostError, InferredInputs, Readings, Segment, Steps, inferred_inputs};
use twinlag_transform::{Complex64, Forward, Inverse};

use crate::error::EstimateError;
use crate::estimate::Estimate;
use crate::outcome::Outcome;
use crate::task::Task;
use crate::vocabulary::Bootstrap;

/// Largest share of replicates that may have no answer: a tenth lost
/// from one tail puts its 2.5 % point at 12.5 %, which shortens the interval by a fifth.
const MAX_FAILED_SHARE: f64 = 0.1;
/// A bin of this many times the power of its surroundings is a line of the gas: of noise alone, one
/// in `e⁵`, 150, is, and three neighbours together one in `10⁵`.
const LINE_OVER_SURROUNDINGS: f64 = 5.0;
/// Gas is taken to be there where the power is this many standard errors above that of noise alone.
const CLEAR_STANDARD_ERRORS: f64 = 2.0;

impl Bootstrap {
    /// Fewest replicates: the outermost of 39 are the 2.5 % and 97.5 % points.
    pub const MIN_REPLICATES: usize = 39;

    fn check(&self) -> Result<(), EstimateError> {
        if self.replicates >= Self::MIN_REPLICATES {
            return Ok(());
        }
        Err(EstimateError::Unexpected {
            what: "replicates of a bootstrap",
            expected: format!("at least {}", Self::MIN_REPLICATES),
            got: self.replicates.to_string(),
        })
    }

    /// 95 % intervals of both time constants, s, for what `estimator` made of `task`; `None` where
    /// more than a tenth of the replicates cannot be answered.
    ///
    /// Replicates are answered on several threads; what comes out does not depend on their number. To watch or end it,
    /// hand over an estimator that counts what it is asked and returns [`EstimateError::Cancelled`].
    ///
    /// # Errors
    /// [`EstimateError::Unexpected`] for too few replicates; what the estimator says of `task` itself, such as uneven
    /// sampling, or [`EstimateError::Cancelled`].
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Bootstrap, Estimate, Estimator, Task};
    ///
    /// let task = Task::new(&readings);
    /// let found = Estimator::DifferenceEquationGtls.estimate(&task)?;
    /// let bootstrap = Bootstrap { replicates: 39, seed: 1 };
    /// let intervals = bootstrap.intervals(&Estimator::DifferenceEquationGtls, &task, &found)?.expect("answered");
    /// assert!(intervals[0][0] < found.tau_s[0] && found.tau_s[0] < intervals[0][1]);
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn intervals(
        &self,
        estimator: &dyn Estimate,
        task: &Task<'_>,
        outcome: &Outcome,
    ) -> Result<Option<[[f64; 2]; 2]>, EstimateError> {
        self.check()?;
        let [t1, t2] = outcome.tau_s;
        let [s1, s2] = outcome.second_tau_s.map(|s| s.unwrap_or(0.0));
        let Some(levels_k) = outcome.noise_std_k else { return Ok(None) };
        let inputs = inferred_inputs(task.readings, task.hold, &[t1, t2, 1.0, 0.0, s1, s2])?;
        let clean = clean_readings(&inputs, levels_k, outcome.noise_ar1);
        let one = |replicate: usize| -> Result<Option<[f64; 2]>, EstimateError> {
            let readings = self.replicate(replicate as u64, &clean, task, levels_k, outcome.noise_ar1)?;
            let again = Task { readings: &readings, starts_s: vec![outcome.tau_s], intervals: false, ..*task };
            let found = match estimator.estimate(&again) {
                Err(EstimateError::Cost(CostError::Singular)) => return Ok(None),
                found => found?,
            };
            Ok(found.end.is_usable().then(|| [0, 1].map(|i| (found.tau_s[i] / outcome.tau_s[i]).ln())))
        };
        let found: Vec<Option<[f64; 2]>> = (0..self.replicates).into_par_iter().map(one).collect::<Result<_, _>>()?;
        let mut logs = [0, 1].map(|i| found.iter().flatten().map(|log| log[i]).collect::<Vec<f64>>());
        let failed = self.replicates - logs[0].len();
        if failed as f64 > MAX_FAILED_SHARE * self.replicates as f64 {
            return Ok(None);
        }
        logs.iter_mut().for_each(|l| l.sort_by(f64::total_cmp));
        // The k-th of n lies at k/(n + 1).
        let quantile = |sorted: &[f64], share: f64| {
            let place = share * (sorted.len() + 1) as f64 - 1.0;
            let below = (place.floor() as usize).min(sorted.len() - 2);
            sorted[below] + (place - below as f64) * (sorted[below + 1] - sorted[below])
        };
        let interval = |i: usize| [0.975, 0.025].map(|share| outcome.tau_s[i] * (-quantile(&logs[i], share)).exp());
        Ok(Some([interval(0), interval(1)]))
    }

    fn replicate(
        &self,
        replicate: u64,
        clean: &[[Vec<f64>; 2]],
        task: &Task<'_>,
        levels_k: [f64; 2],
        ar1: [f64; 2],
    ) -> Result<Readings, EstimateError> {
        let mut noise = [0, 1].map(|channel| {
            let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
            rng.set_stream(2 * replicate + channel);
            rng
        });
        let mut noisy = |channel: usize, y: &[f64]| -> Vec<f64> {
            let (std_k, phi) = (levels_k[channel], ar1[channel]);
            let fresh_k = std_k * (1.0 - phi * phi).sqrt();
            let mut last_k: Option<f64> = None;
            y.iter()
                .map(|y| {
                    let draw: f64 = noise[channel].sample(StandardNormal);
                    let now_k = last_k.map_or(std_k * draw, |last| phi * last + fresh_k * draw);
                    last_k = Some(now_k);
                    y + now_k
                })
                .collect()
        };
        let segments = clean.iter().zip(task.readings.segments()).map(|([y1, y2], segment)| {
            let steps: &Steps = segment.steps();
            Segment::new(noisy(0, y1), noisy(1, y2), steps.clone())
        });
        Ok(Readings::new(segments.collect::<Result<_, _>>()?)?)
    }
}

/// Readings without noise whose gas has the power that `inputs` show: both channels of each
/// stretch.
fn clean_readings(inputs: &InferredInputs, levels_k: [f64; 2], ar1: [f64; 2]) -> Vec<[Vec<f64>; 2]> {
    inputs
        .segments
        .iter()
        .map(|[f1, f2]| {
            let gas = gas([f1, f2], inputs, levels_k, ar1);
            [0, 1].map(|i| undo(&inputs.filters[i], &gas))
        })
        .collect()
}

/// The best combination of both inferred inputs, its noise's power taken off.
fn gas(f: [&[f64]; 2], inputs: &InferredInputs, levels_k: [f64; 2], ar1: [f64; 2]) -> Vec<f64> {
    let n = f[0].len();
    // A straight line through all samples is taken off before the circular transform, and put back
    // after it. (One between the ends would hold their noise, ten times that of the readings, as a
    // slow gas signal.)
    let centre = 0.5 * (n - 1) as f64;
    let mean = f.iter().map(|f| f.iter().sum::<f64>()).sum::<f64>() / (2 * n) as f64;
    let moment = n as f64 * ((n * n) as f64 - 1.0) / 12.0;
    let along = |f: &[f64]| -> f64 { f.iter().enumerate().map(|(k, v)| (k as f64 - centre) * v).sum() };
    let slope = 0.5 * (along(f[0]) + along(f[1])) / moment;
    let line = |k: usize| mean + slope * (k as f64 - centre);
    let forward = Forward::of(n);
    let [first, second] =
        f.map(|f| forward.transform(&f.iter().enumerate().map(|(k, v)| v - line(k)).collect::<Vec<f64>>()));
    let noise = |i: usize, bin: usize| {
        let turn = Complex64::from_polar(1.0, std::f64::consts::TAU * bin as f64 / n as f64);
        let gain = inputs.filters[i].iter().rev().fold(Complex64::new(0.0, 0.0), |sum, c| sum * turn + c).norm_sqr();
        let phi = ar1[i];
        let colour = (1.0 - phi * phi) / (1.0 + phi * phi - 2.0 * phi * turn.re);
        n as f64 * levels_k[i].powi(2) * gain * colour
    };
    let mut spectrum: Vec<(Complex64, f64)> = (0..first.len())
        .map(|bin| {
            let (n1, n2) = (noise(0, bin), noise(1, bin));
            ((first[bin] * n2 + second[bin] * n1) / (n1 + n2), n1 * n2 / (n1 + n2))
        })
        .collect();
    let bins = spectrum.len();
    let ratios: Vec<f64> = spectrum.iter().map(|(x, noise)| x.norm_sqr() / noise).collect();
    for (bin, (x, _)) in spectrum.iter_mut().enumerate() {
        // Power, not the series itself, is what the replicates have to have right.
        *x *= gas_share(&ratios, bin, bins).sqrt();
    }
    let out = Inverse::of(n).transform(spectrum.into_iter().map(|(x, _)| x).collect());
    out.iter().enumerate().map(|(k, v)| v / n as f64 + line(k)).collect()
}

/// The gas's share of the power at `bin`, given each bin's power over that of its noise.
///
/// From the median over bins within an eighth of the frequency, which lines do not touch; where
/// that is no clear sign of gas, two standard errors above noise alone, the share is zero. A bin that
/// stands out five times above its surroundings, its neighbours with it, is a line and counts by
/// itself. Anything less strict leaves noise in the gas, which would give the replicates more information
/// about the sensors than the record has.
fn gas_share(ratios: &[f64], bin: usize, bins: usize) -> f64 {
    let (low, high) = (bin - (bin / 8 + 4).min(bin), (bin + bin / 8 + 5).min(bins));
    let mut around = ratios[low..high].to_vec();
    let count = around.len();
    let median = *around.select_nth_unstable_by(count / 2, f64::total_cmp).1 / std::f64::consts::LN_2;
    let near = &ratios[bin.saturating_sub(1)..(bin + 2).min(bins)];
    let peak = near.iter().sum::<f64>() / near.len() as f64;
    let level = if peak > LINE_OVER_SURROUNDINGS * median.max(1.0) { ratios[bin] } else { median };
    // The median of so many exponential variables has the standard error 1/(ln 2 √count).
    let clear = 1.0 + CLEAR_STANDARD_ERRORS / (std::f64::consts::LN_2 * (count as f64).sqrt());
    if level > clear { 1.0 - 1.0 / level } else { 0.0 }
}

/// The series that `filter` (oldest sample first, unit gain at rest) takes to `f`, at rest before
/// it.
fn undo(filter: &[f64], f: &[f64]) -> Vec<f64> {
    let (newest, older) = filter.split_last().expect("a filter has coefficients");
    let mut y = vec![f[0]; older.len()];
    for (k, f) in f.iter().enumerate() {
        let known: f64 = older.iter().zip(&y[k..]).map(|(c, y)| c * y).sum();
        y.push((f - known) / newest);
    }
    y
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use rayon::ThreadPoolBuilder;
    use twinlag_sensor::FirstOrder;

    use super::*;
    use crate::vocabulary::Estimator;

    /// Ends the run at the eleventh question.
    struct Impatient(AtomicUsize);

    impl Estimate for Impatient {
        fn name(&self) -> String {
            "impatient".into()
        }

        fn source(&self) -> &'static str {
            "this test"
        }

        fn assumes(&self) -> &'static str {
            "nothing"
        }

        fn estimate(&self, task: &Task<'_>) -> Result<Outcome, EstimateError> {
            if self.0.fetch_add(1, Ordering::Relaxed) >= 10 {
                return Err(EstimateError::Cancelled);
            }
            Estimator::DifferenceEquationGtls.estimate(task)
        }
    }

    #[test]
    fn intervals_do_not_depend_on_the_number_of_threads_and_a_run_can_be_cancelled() {
        let gas: Vec<f64> = (0..1000).map(|k| 300.0 + 20.0 * (0.13 * f64::from(k)).sin()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let [y1, y2] = [0.02, 0.1].map(|tau_s| {
            let clean = FirstOrder::new(tau_s, 0.002).expect("positive").respond(&gas);
            clean.into_iter().map(|y| y + 0.05 * rng.sample::<f64, _>(StandardNormal)).collect::<Vec<f64>>()
        });
        let readings = Readings::even(&y1, &y2, 0.002).expect("finite");
        let task = Task::new(&readings);
        let estimator = Estimator::DifferenceEquationGtls;
        let found = estimator.estimate(&task).expect("an estimate");
        let bootstrap = Bootstrap { replicates: 39, seed: 1 };
        let with = |threads: usize, estimator: &dyn Estimate| {
            let pool = ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| bootstrap.intervals(estimator, &task, &found))
        };
        let alone = with(1, &estimator).expect("answered");
        assert!(alone.is_some());
        assert_eq!(with(4, &estimator).expect("answered"), alone);
        assert_eq!(with(4, &Impatient(AtomicUsize::new(0))), Err(EstimateError::Cancelled));
    }
}
