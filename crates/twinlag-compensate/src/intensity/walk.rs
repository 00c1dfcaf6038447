//! A first-order process, and what it is given a quadratic likelihood at each instant.

use std::ops::Range;

use crate::smooth::Score;

/// The logarithm of the likelihood as `g (u − a) − i (u − a)²/2` of the process `u` at each instant.
pub(super) struct Observed<'a> {
    time_s: &'a [f64],
    /// What the mean of the process goes with.
    activity: &'a [f64],
    /// `a`.
    at: &'a [f64],
    /// `g`.
    slope: Vec<f64>,
    /// `i`.
    information: Vec<f64>,
}

impl<'a> Observed<'a> {
    /// - `worth`: information over half of what is expected to be seen
    pub(super) fn of(time_s: &'a [f64], activity: &'a [f64], at: &'a [f64], score: &Score, worth: f64) -> Self {
        let slope = score.seen.iter().zip(&score.expected).map(|(seen, expected)| 0.5 * (seen - expected)).collect();
        let information = score.expected.iter().map(|expected| 0.5 * worth * expected.max(0.0)).collect();
        Self { time_s, activity, at, slope, information }
    }

    pub(super) const fn len(&self) -> usize {
        self.time_s.len()
    }

    /// All instants, or stretches evenly apart that have `most` of them together.
    pub(super) fn stretches(&self, most: usize, count: usize) -> Vec<Range<usize>> {
        let n = self.len();
        let (length, count) = if n <= most { (n, 1) } else { (most / count, count) };
        (0..count).map(|k| k * (n - length) / (count - 1).max(1)).map(|from| from..from + length).collect()
    }
}

/// `power` times the activity, and a stationary first-order process about it whose exponential has a
/// mean of one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Walk {
    pub(super) std: f64,
    pub(super) memory_s: f64,
    pub(super) power: f64,
}

/// Mean and variance of the process at an instant, given what was observed by then.
#[derive(Clone, Copy)]
struct Known {
    mean: f64,
    variance: f64,
    /// The factor by which what was known before has decayed.
    decay: f64,
}

impl Walk {
    /// Whether it hardly changes.
    pub(super) fn is_steady(&self, std: f64) -> bool {
        self.std <= std && self.power == 0.0
    }

    /// What is added to `power` times the activity: the mean of the exponential of both is one.
    fn level(&self, observed: &Observed<'_>) -> f64 {
        let spread = -0.5 * self.std * self.std;
        if self.power == 0.0 {
            return spread;
        }
        let mean = observed.activity.iter().map(|a| (self.power * a).exp()).sum::<f64>() / observed.len() as f64;
        spread - mean.ln()
    }

    /// Forward over `part`: what is known after each instant is `told`. The logarithm of the integral of
    /// the likelihood.
    fn forward(&self, part: Range<usize>, observed: &Observed<'_>, mut told: impl FnMut(Known)) -> f64 {
        let level = self.level(observed);
        let stationary = self.std * self.std;
        let (mut mean, mut variance, mut log_evidence) = (0.0, stationary, 0.0);
        let mut last_s = observed.time_s[part.start];
        let mut of_step = (0.0, 1.0);
        for k in part {
            let step_s = observed.time_s[k] - last_s;
            last_s = observed.time_s[k];
            if (step_s - of_step.0).abs() > 1e-9 * step_s {
                of_step = (step_s, (-step_s / self.memory_s).exp());
            }
            let decay = if step_s > 0.0 { of_step.1 } else { 1.0 };
            mean *= decay;
            variance = stationary + decay * decay * (variance - stationary);
            let (slope, information) = (observed.slope[k], observed.information[k]);
            let away = mean + level + self.power * observed.activity[k] - observed.at[k];
            let factor = 1.0 + variance * information;
            let exponent = slope * away - 0.5 * information * away * away + 0.5 * variance * slope * slope;
            log_evidence += exponent / factor - 0.5 * factor.ln();
            mean += variance * (slope - information * away) / factor;
            variance /= factor;
            told(Known { mean, variance, decay });
        }
        log_evidence
    }

    /// Logarithm of the mean over this process of the likelihood in `part`.
    pub(super) fn log_evidence(&self, part: &Range<usize>, observed: &Observed<'_>) -> f64 {
        self.forward(part.clone(), observed, |_| ())
    }

    /// The process given everything observed (Rauch, Tung and Striebel 1965).
    pub(super) fn smoothed(&self, observed: &Observed<'_>) -> Vec<f64> {
        let mut known = Vec::with_capacity(observed.len());
        self.forward(0..observed.len(), observed, |k| known.push(k));
        let mut means: Vec<f64> = known.iter().map(|k| k.mean).collect();
        let stationary = self.std * self.std;
        for k in (0..known.len().saturating_sub(1)).rev() {
            let decay = known[k + 1].decay;
            let predicted = stationary + decay * decay * (known[k].variance - stationary);
            means[k] += known[k].variance * decay / predicted * (means[k + 1] - decay * known[k].mean);
        }
        let level = self.level(observed);
        means.iter_mut().zip(observed.activity).for_each(|(u, a)| *u += level + self.power * a);
        means
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// Against the dense Gaussian: with `K` the covariance of the process, `I` the information and `m` its
    /// mean less `a`, the mean is `m + (K⁻¹ + I)⁻¹ (g − I m)` and the evidence
    /// `g'm − m'I m/2 + r'(K⁻¹ + I)⁻¹ r/2 − ln det(1 + K I)/2`, `r = g − I m`.
    #[test]
    fn it_is_the_dense_gaussian() {
        let n = 60;
        let time_s: Vec<f64> = (0..n).map(|k| 0.1 * k as f64 + 0.03 * (2.1 * k as f64).sin()).collect();
        let wave = |rate: f64| (0..n).map(|k| (rate * k as f64).sin()).collect::<Vec<f64>>();
        let (activity, at) = (wave(0.7), wave(0.2));
        let slope: Vec<f64> = wave(1.3).iter().map(|v| 2.0 * v).collect();
        let information: Vec<f64> = wave(0.9).iter().map(|v| 1.1 + v).collect();
        let observed = Observed { time_s: &time_s, activity: &activity, at: &at, slope, information };
        let walk = Walk { std: 1.4, memory_s: 0.8, power: 0.6 };
        let covariance =
            DMatrix::from_fn(n, n, |j, k| walk.std * walk.std * (-(time_s[j] - time_s[k]).abs() / walk.memory_s).exp());
        let level = walk.level(&observed);
        let prior = DVector::from_fn(n, |k, _| level + walk.power * activity[k]);
        let away = &prior - DVector::from_column_slice(&at);
        let diagonal = DMatrix::from_diagonal(&DVector::from_column_slice(&observed.information));
        let slope = DVector::from_column_slice(&observed.slope);
        let left = &slope - &diagonal * &away;
        let posterior =
            (covariance.clone().try_inverse().expect("positive") + &diagonal).try_inverse().expect("positive");
        let want = &prior + &posterior * &left;
        let got = walk.smoothed(&observed);
        assert!((0..n).all(|k| (got[k] - want[k]).abs() < 1e-9), "{got:?}, want {want}");
        let determinant = (DMatrix::identity(n, n) + covariance * &diagonal).determinant();
        let want = slope.dot(&away) - 0.5 * away.dot(&(&diagonal * &away)) + 0.5 * left.dot(&(&posterior * &left))
            - 0.5 * determinant.ln();
        let got = walk.log_evidence(&(0..n), &observed);
        assert!((got - want).abs() < 1e-9 * want.abs().max(1.0), "{got}, want {want}");
        let mean: f64 = prior.iter().map(|m| (m + 0.5 * walk.std * walk.std).exp()).sum::<f64>() / n as f64;
        assert!((mean - 1.0).abs() < 1e-12);
    }
}
