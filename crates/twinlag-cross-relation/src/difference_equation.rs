//! A first guess for nothing: the difference equation is linear in two numbers.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;

use crate::error::CostError;
use crate::readings::Readings;

/// Time constants `[τ1, τ2]` (s) by least squares on the difference equation.
///
/// With `λ = (1 − c)/(1 − a)`: `y2[k] − y2[k−1] = λ (y1[k] − y2[k−1]) − a λ (y1[k−1] − y2[k−1])`, linear in `λ` and `a λ`
/// (QR factorisation). Noise in the regressors biases it to short time constants, badly from a few per cent on: a start,
/// not an estimate.
///
/// # Errors
/// [`CostError::UnevenSampling`]; [`CostError::Singular`] where the solution is no pair of positive time constants.
pub fn difference_equation_least_squares(readings: &Readings) -> Result<[f64; 2], CostError> {
    let period_s = readings.even_period_s().ok_or(CostError::UnevenSampling)?;
    let pairs: Vec<[f64; 3]> = readings
        .segments()
        .iter()
        .flat_map(|s| {
            s.y1().windows(2).zip(s.y2().windows(2)).map(|(y1, y2)| [y1[1] - y2[0], y1[0] - y2[0], y2[1] - y2[0]])
        })
        .collect();
    let regressors = Mat::from_fn(pairs.len(), 2, |i, j| pairs[i][j]);
    let target = Mat::from_fn(pairs.len(), 1, |i, _| pairs[i][2]);
    let solution = regressors.col_piv_qr().solve_lstsq(target);
    let (lambda, minus_a_lambda) = (solution[(0, 0)], solution[(1, 0)]);
    let a = -minus_a_lambda / lambda;
    let c = 1.0 - lambda * (1.0 - a);
    if [a, c].iter().all(|p| *p > 0.0 && *p < 1.0) {
        Ok([a, c].map(|p| -period_s / p.ln()))
    } else {
        Err(CostError::Singular)
    }
}
