//! How much worse other time constants explain a record: the valley of the likelihood over both of them.
//!
//! Two sensors of which nothing is known determine how much later one is than the other far better than how late either is, so the
//! valley is long and narrow where little is known, and a picture of it says more than two intervals.

use rayon::prelude::*;

use crate::extended::Extended;
use crate::observations::evenly_spread;

/// Samples up to which the whole record is evaluated, and the pieces of a longer one that have as many: each value of the grid costs
/// one evaluation.
const MAX_SAMPLES: usize = 16_384;
const PIECES: usize = 8;
/// Values along each axis.
const POINTS: usize = 33;
/// How far an axis reaches either way: this many standard errors, but no less and no more than these factors. Chosen so that the
/// valley shows beside the estimate.
const REACH_STANDARD_ERRORS: f64 = 8.0;
const REACH_FACTORS: [f64; 2] = [1.001, 8.0];

/// `(Σ r² − min Σ r²) / max(s², 1)` over both time constants, `r` the whitened residual and `s²` its mean square at the minimum: the
/// difference of `−2 ln L`, the rest of the model as it was fitted. What more than noise leaves over is its unit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct DevianceSurface {
    /// Values of both time constants, s, rising, with a constant factor between them.
    pub tau_s: [Vec<f64>; 2],
    /// The deviance, row by row: the first time constant changes fastest.
    pub deviance: Vec<f64>,
    /// Time constants of the fit, s.
    pub fitted_s: [f64; 2],
    /// Samples that it is of: of a long record pieces that are spread evenly.
    pub samples: usize,
    /// Samples of the record.
    pub of_samples: usize,
}

impl DevianceSurface {
    /// The surface about the time constants of `model`; `None` where one of them is no positive number, and where the sensors do not
    /// let the residual be computed.
    ///
    /// - `covariance`: that of the fit, the time constants first
    pub fn of(model: &Extended, covariance: Option<&[Vec<f64>]>) -> Option<Self> {
        let of_samples = model.observations().samples();
        let pieces;
        let piece = MAX_SAMPLES / PIECES;
        let (model, samples) = if of_samples > MAX_SAMPLES {
            pieces = model.excerpt(evenly_spread(of_samples, PIECES, piece), piece);
            (&pieces, pieces.observations().samples())
        } else {
            (model, of_samples)
        };
        let theta = model.parameters();
        let fitted_s = [theta[0], theta[1]];
        if !fitted_s.iter().all(|tau_s| tau_s.is_finite() && *tau_s > 0.0) || samples == 0 {
            return None;
        }
        // Pieces know less than the whole.
        let longer = (of_samples as f64 / samples as f64).sqrt();
        let tau_s = [0, 1].map(|i| {
            let relative = covariance.map_or(f64::INFINITY, |c| c[i][i].sqrt() / fitted_s[i]);
            let [least, most] = REACH_FACTORS;
            let reach = (REACH_STANDARD_ERRORS * longer * relative).exp().clamp(least, most);
            let at = |k: usize| 2.0 * k as f64 / (POINTS - 1) as f64 - 1.0;
            (0..POINTS).map(|k| fitted_s[i] * reach.powf(at(k))).collect::<Vec<f64>>()
        });
        let energy = |one_s: f64, two_s: f64| {
            let mut parameters = theta.to_vec();
            (parameters[0], parameters[1]) = (one_s, two_s);
            let residual = model.evaluate(&parameters).residual;
            (residual.iter().map(|r| r * r).sum::<f64>(), residual.len())
        };
        let places: Vec<(usize, usize)> = (0..POINTS).flat_map(|j| (0..POINTS).map(move |i| (i, j))).collect();
        let energies: Vec<(f64, usize)> = places.par_iter().map(|(i, j)| energy(tau_s[0][*i], tau_s[1][*j])).collect();
        let least = energies.iter().filter(|(energy, count)| energy.is_finite() && *count > 0);
        let (least, count) = least.min_by(|a, b| a.0.total_cmp(&b.0)).copied()?;
        let unit = (least / count as f64).max(1.0);
        let deviance = energies.iter().map(|(energy, _)| (energy - least) / unit).collect();
        Some(Self { tau_s, deviance, fitted_s, samples, of_samples })
    }
}
