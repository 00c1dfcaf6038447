//! Errors of a model on residuals that had no part in finding it.

use twinlag_model::{Fitted, Observations, Weighting};

/// Most samples of a changing mean that stands for a filter where no spectrum says which
/// frequencies are noise.
const MOST_SMOOTHED_SAMPLES: f64 = 50.0;

/// Sums of squares of the whitened residual, and of the difference between the inferred gas temperatures in K².
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Squares {
    residual: f64,
    difference_k2: f64,
    count: f64,
}

impl Squares {
    /// Of the residuals of `fitted` that count.
    pub(crate) fn of(fitted: &Fitted, observations: &Observations, counts: impl Fn(usize) -> bool) -> Self {
        let evaluation = fitted.model.evaluate(&fitted.theta, observations);
        // Without the frequencies in which there is only noise, which each factor of the inverse
        // makes larger.
        let filter = Weighting::of_disagreement(observations, fitted.model.noise_std_k());
        // Where no spectrum says which these are, changes within the faster time constant are left
        // out.
        let faster_s = fitted.theta[0].min(fitted.theta[1]);
        let half = (faster_s / observations.step_s()).clamp(1.0, MOST_SMOOTHED_SAMPLES) as usize;
        let smoothed = |stretch| filter.smooth_or_mean(&evaluation.disagreement_k[stretch], half);
        let apart: Vec<f64> = evaluation.stretches().flat_map(smoothed).collect();
        let mut out = Self::default();
        let values = evaluation.residual.iter().zip(&apart).zip(evaluation.sample());
        for ((residual, apart_k), _) in values.filter(|(_, sample)| counts(*sample)) {
            out.residual += residual * residual;
            out.difference_k2 += apart_k * apart_k;
            out.count += 1.0;
        }
        out
    }

    /// Of these and others together.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            residual: self.residual + other.residual,
            difference_k2: self.difference_k2 + other.difference_k2,
            count: self.count + other.count,
        }
    }

    /// Root mean squares: of the whitened residual, and of the difference, K.
    pub(crate) fn roots(self) -> [f64; 2] {
        [self.residual, self.difference_k2].map(|sum| (sum / self.count.max(1.0)).sqrt())
    }

    /// Deviance that this saves against `before`, the level of the noise free.
    pub(crate) fn gain(self, before: Self) -> f64 {
        let mean = |squares: Self| (squares.residual / squares.count.max(1.0)).max(f64::MIN_POSITIVE);
        self.count * (mean(before) / mean(self)).ln()
    }
}
